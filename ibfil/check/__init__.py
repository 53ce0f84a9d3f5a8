"""The overview before a run: effects modelled, dimensionless groups, costs, warnings."""
