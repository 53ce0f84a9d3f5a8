"""A fluid around a fluid: rods that feel their own velocity."""
