"""The spaces that a fluid may fill: where its points are, and how nodes in it move each other."""
