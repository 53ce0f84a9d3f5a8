"""A new case for the physics that is named, with every key explained."""
