"""Fit of a record to the stroke of a bench by one or both methods, and its effect on the response spectrum."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.config.model import BenchConfiguration
from bench.control.preparation import PreparedMotion, prepare
from bench.control.stroke_fit import PERIODS, Method, StrokeFit, periods_of
from bench.control.target import Reach
from bench.prediction.requests import StrokeFitRequest
from bench.prediction.seismic import band_of
from sim.errors import InvalidInput

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StrokeFits:
    """Result of fitting a record to the stroke of a bench.

    `unfitted` is the motion before the fit. `fitted` contains the fitted motion of each method that succeeded, and
    `refused` the error of each that did not. `own` are the periods [s] of the bare frame's modes.
    """

    record: Accelerogram
    reach: Reach
    unfitted: PreparedMotion
    fitted: Mapping[Method, PreparedMotion]
    refused: Mapping[Method, InvalidInput]
    own: Array

    @property
    def chosen(self) -> PreparedMotion:
        """Motion fitted by the first requested method that succeeded; least change precedes high-pass."""
        return next(iter(self.fitted.values()))


def stroke_fits(record: Accelerogram, request: StrokeFitRequest, configuration: BenchConfiguration) -> StrokeFits:
    """Fit `record` by the requested methods. Raises InvalidInput if it cannot be prepared or no method succeeds."""
    specimen = configuration.known_specimen
    reach = Reach.of(configuration, request.share)
    asked: dict[str, Any] = {
        "band": band_of(request.table_band, configuration),
        "peak": None if request.peak_factor is None else request.peak_factor * specimen.uplift_acceleration,
        "trim": request.trim or None,
        "length_ratio": request.length_ratio,
        "periods": periods_of(specimen.frame),
    }
    fitted: dict[Method, PreparedMotion] = {}
    refused: dict[Method, InvalidInput] = {}
    unfitted = prepare(record.sampled, **asked)
    for method in Method if request.method == "both" else (Method(request.method),):
        try:
            fitted[method] = prepare(record.sampled, reach=reach, method=method, **asked)
        except InvalidInput as reason:
            refused[method] = reason
    if not fitted:
        raise next(iter(refused.values()))
    own = np.array([2.0 * np.pi / omega for omega in specimen.frame.natural_frequencies])
    return StrokeFits(record, reach, unfitted, fitted, refused, own)


def change_at(fit: StrokeFit, periods: Array) -> Array:
    """Relative change of the response spectrum at `periods` [s], same shape; the spectrum must contain each of them."""
    return fit.change[np.searchsorted(fit.periods, periods)]


def change_over(fit: StrokeFit) -> tuple[float, float]:
    """Root mean square and largest magnitude of the relative change at periods from 0.1 to 2 s."""
    change = change_at(fit, PERIODS)
    return float(np.sqrt(np.mean(change**2))), float(np.abs(change).max())
