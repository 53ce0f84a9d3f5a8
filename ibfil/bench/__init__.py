"""`ibfil bench`: the pieces of a step against floors measured in the same run."""
