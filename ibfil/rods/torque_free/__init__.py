"""Rods whose nodal forces and torques have no net torque, at any spacing."""
