"""The rods: geometry and strains, moments, the finite-volume force (Eq. 44) and its Jacobian, loads, contact."""
