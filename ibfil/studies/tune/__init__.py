"""`ibfil tune`: the cheapest step and nodes for an error that is allowed."""
