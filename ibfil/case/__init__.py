"""What a scene may say: the case file, read, checked, and all its faults told at once."""
