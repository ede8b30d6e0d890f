"""Alternative integrators of the motions of `sim.rocking`, for comparison: fixed-step methods, scipy, CVODE, heyoka."""
