"""The version of ibfil, for the package, the run files and the build."""

__version__ = "0.2.0"
