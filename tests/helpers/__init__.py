"""What several tests use: scenes, made runs, fakes."""
