"""The numbers of a run: observables, stop rules, expectations."""
