"""One run on many processes: the grid's work is shared, process 0 does the rest."""
