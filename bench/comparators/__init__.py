"""Alternative integrators of the motions of `sim.rocking`, for comparison: RK4, scipy, CVODE and heyoka."""
