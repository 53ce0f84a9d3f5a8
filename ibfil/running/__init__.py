"""Running a case from its start, or on from a checkpoint."""
