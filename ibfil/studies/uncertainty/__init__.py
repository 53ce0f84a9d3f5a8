"""`ibfil uncertainty`: an error bar on every number, and where it comes from."""
