"""`ibfil rest` and `ibfil modes`: equilibria, growth rates, mode shapes, thresholds."""
