"""The uncertainty that uncertain parameters leave in the predicted gain coefficients."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sim.errors import InvalidInput
from sim.sensitivity import Sensitivity


@dataclass(frozen=True)
class Budget:
    """First-order standard uncertainties of alpha_1 and alpha_2, and by parameter what each alone would give."""

    alpha_1: float
    alpha_2: float
    contributions: dict[str, tuple[float, float]]


def budget(
    sensitivities: Mapping[str, Sensitivity],
    standard_uncertainties: Mapping[str, float],
    correlation: Mapping[tuple[str, str], float] | None = None,
) -> Budget:
    """Uncertainty of alpha_1 and alpha_2 from standard uncertainties [SI] of parameters, by name.

    `correlation`: coefficients of pairs of names; pairs that are not named are independent. First order: JCGM 100:2008
    (GUM), Eq. (10) and (13). Raises InvalidInput for unknown names, negative uncertainties, impossible correlations.
    """
    names = list(standard_uncertainties)
    for name, size in standard_uncertainties.items():
        if name not in sensitivities:
            raise InvalidInput("standard uncertainty of", name, f"known parameters: {', '.join(sensitivities)}")
        if not 0.0 <= size < np.inf:
            raise InvalidInput(f"standard uncertainty of {name}", size, "it must be finite and 0 or more")
    matrix = np.eye(len(names))
    for (one, other), coefficient in (correlation or {}).items():
        if one not in names or other not in names or one == other or not -1.0 <= coefficient <= 1.0:
            allowed = "two different parameters that have an uncertainty, and a coefficient from -1 to 1"
            raise InvalidInput("correlation", ((one, other), coefficient), allowed)
        i, j = names.index(one), names.index(other)
        matrix[i, j] = matrix[j, i] = coefficient
    if names and float(np.linalg.eigvalsh(matrix).min()) < -1e-12:
        raise InvalidInput("correlation", dict(correlation or {}), "quantities cannot be correlated like this together")
    rows = [(sensitivities[name].alpha_1, sensitivities[name].alpha_2) for name in names]
    parts = np.array(rows).reshape(-1, 2) * np.array(list(standard_uncertainties.values()))[:, None]
    alpha_1, alpha_2 = np.sqrt(np.maximum(np.einsum("ia,ij,ja->a", parts, matrix, parts), 0.0)).tolist()
    contributions = {name: (float(part[0]), float(part[1])) for name, part in zip(names, np.abs(parts), strict=True)}
    return Budget(alpha_1, alpha_2, contributions)
