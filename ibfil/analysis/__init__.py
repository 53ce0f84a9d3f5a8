"""A finished run: its numbers, flow, meshes and energy."""
