"""Trees of checked expressions, and functions of arrays made of them."""
