"""Linear algebra of band matrices by node, small blocks, GMRES with a preconditioner, prescribed unknowns."""
