"""The fluids: over a step, at frozen positions, each answers forces with u = u0 + M F."""
