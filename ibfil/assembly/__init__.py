"""From a case to the rods, loads, laws and the fluid that it describes."""
