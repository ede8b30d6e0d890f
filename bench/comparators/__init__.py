"""Other integrators of the same motions, for comparison with `sim.rocking`: fixed steps, scipy, CVODE, heyoka."""
