"""The tables of bodies, and of what is attached to them: motors and ends of filaments."""
