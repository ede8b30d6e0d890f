"""Free vibration of the bare frame: stiffness and damping with their covariance, for weighed masses."""
