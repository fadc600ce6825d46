"""Contraction surfaces of the chapter on Borzíková et al., and the disturbed data for their fits."""

import dataclasses
import warnings

import numpy as np

import airmuscle as am

from ..bench.identify.statistics import CorrelationIndex, correlation_index
from ..bench.identify.surface.basis import LoadRange
from ..bench.identify.surface.monotonicity import fit_monotone
from ..core import AirmuscleWarning
from ..files.library.entry_file import load_law
from ..physics.muscle.characteristic.borzikova import SAM_30X290, PlaneCurves

MISPRINT_INDEX = 2
"""Index of a_02, whose exponent is misprinted, in the coefficients."""
CORRECTED_A02 = -7.55e-5

AS_EXPONENT = "printed matrix as exponent of (1)"
PRINTED = "direct, as printed"
MISPRINT_CORRECTED = r"direct, \(a_{02}\) corrected only"
CORRECTED = "direct, corrected"
EXPONENTIAL = "exponential (1), fitted here"
MONOTONE = "exponential (1), monotone"


def surfaces(curves: PlaneCurves = SAM_30X290) -> dict[str, am.characteristic.ContractionLaw]:
    """Return all surfaces of the chapter by name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)  # the chapter shows the misprint
        printed = load_law("borzikova-direct-printed").characteristic
    corrected = load_law("borzikova-direct-repaired").characteristic
    exponential = load_law("borzikova-exponential").characteristic
    assert isinstance(printed, am.characteristic.BorzikovaDirect)
    assert isinstance(corrected, am.characteristic.BorzikovaDirect)
    assert isinstance(exponential, am.characteristic.BorzikovaExponential)
    saturation = curves.curves[0].saturation
    return {
        AS_EXPONENT: am.characteristic.BorzikovaExponential(
            printed.coefficients, *LoadRange.from_law(printed), saturation=saturation
        ),
        PRINTED: printed,
        MISPRINT_CORRECTED: with_a02(printed, CORRECTED_A02),
        CORRECTED: corrected,
        EXPONENTIAL: exponential,
        MONOTONE: fit_monotone(sample(curves), saturation).model,
    }


def sample(curves: PlaneCurves, points: int = 15) -> am.Recording:
    """Return a recording of `points` equidistant pressures from zero on every curve, curve after curve."""
    pressures = np.linspace(0.0, curves.max_pressure, points)
    return am.Recording(
        {
            "pressure": np.tile(pressures, len(curves.curves)),
            "force": np.repeat([c.force for c in curves.curves], points),
            "contraction": np.concatenate([c.contraction(pressures) for c in curves.curves]),
        },
        origin="plane curves of Borzíková et al., sampled",
        constants={"specimen": "Shadow Air Muscle SAM 30 x 290", "resting_length": 0.29},
        notes=("Curves fitted by the authors; the measured points are lost.",),
    )


def with_a02(law: am.characteristic.BorzikovaDirect, a02: float) -> am.characteristic.BorzikovaDirect:
    """Return the surface with another coefficient of F^2."""
    coefficients = (*law.coefficients[:MISPRINT_INDEX], a02, *law.coefficients[MISPRINT_INDEX + 1 :])
    return dataclasses.replace(law, coefficients=coefficients)


def index_on_curves(law: am.characteristic.ContractionLaw, curves: PlaneCurves) -> CorrelationIndex:
    """Return the correlation index of a surface at 15 evenly spaced pressures of each plane curve."""
    data = sample(curves)
    return correlation_index(data["contraction"], law.contraction(data["pressure"], data["force"]))


def round_contraction(recording: am.Recording, step: float = 0.005) -> am.Recording:
    """Return the recording with contractions rounded to multiples of `step` [1]."""
    return recording.with_columns(contraction=np.round(recording["contraction"] / step) * step)


def add_noise(recording: am.Recording, seed: int, deviation: float = 0.005) -> am.Recording:
    """Return the recording with normally distributed noise on the contractions, of standard deviation [1]."""
    noise = deviation * np.random.default_rng(seed).standard_normal(len(recording))
    return recording.with_columns(contraction=recording["contraction"] + noise)
