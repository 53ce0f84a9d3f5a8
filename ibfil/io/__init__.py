"""Files of a run: the run file, its checkpoint and journal, and what they say of how it was made."""
