"""What `ibfil check` says: what is modelled, dimensionless groups, costs, warnings."""
