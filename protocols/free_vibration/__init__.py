"""Free vibration of the bare frame: stiffness and damping with their covariance, given the storey masses."""
