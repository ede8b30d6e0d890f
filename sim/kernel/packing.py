"""Indices of the specimen's parameters in the array that is passed to compiled functions."""

M1, M2, K1, K2, C1, C2, H1, K_C, D, B, H_B, MASS, INERTIA, RESTITUTION, GRAVITY, COUPLED = range(16)
"""Indices in the packed parameters, in the order of `Specimen.packed()`. COUPLED is 0 for the bare frame."""
