"""Named ways to integrate the same equations, for comparison: `sim.solvers.catalogue` has them all."""
