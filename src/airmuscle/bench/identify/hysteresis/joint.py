"""Joint fit of one friction law to the loops of several runs, with a force scale that depends on the pressure, and
selection of the friction that is written."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ....core import Array
from ....engine.distribution import DistributedCalls
from ....engine.processes import Workers, process_pool
from ....physics.muscle.friction import Friction, IdentifiedFriction, PressureScaledFriction
from ...segment.runs import RELATIVE_BAND
from .joint_result import JointFit, agreement_of_run, force_amplitude, preferred_fit
from .limits import combine_limits
from .loops import LoopFit
from .result import SIGNIFICANCE_LEVEL, HysteresisFit, Misfit, evidence
from .search import LoopSeries, search_parameters

MIN_PRESSURE_RATIO = 1.2
"""Minimum ratio of the highest to the lowest pressure of the runs for a fitted dependence on pressure (chosen)."""
PRESSURE_QUANTILES = (0.01, 0.99)
"""Quantiles of the pressures of the fitted rows that count as the range of the data (chosen)."""


def loops_not_joined(loop_fits: Sequence[LoopFit]) -> tuple[str, ...]:
    """Sentences that name each loop that the joint fit does not use, and the reason."""
    reasons = [(f"{fit.loop.recording.origin}, {fit.loop.description}", _reason_against(fit)) for fit in loop_fits]
    return tuple(f"Not in the joint fit: {loop}. {reason}" for loop, reason in reasons if reason)


def _reason_against(loop_fit: LoopFit) -> str:
    """Why a loop is not fitted together with others, as sentences; empty if it is."""
    if not loop_fit.usable_in_plant:
        return "The friction acts along the pressure, which a plant cannot use."
    if not loop_fit.fits:
        return "No law could be fitted to it alone."
    return " ".join(loop_fit.fits[0].reservations_of_rows)


def fit_jointly(
    loop_fits: Sequence[LoopFit], *, progress: Callable[[str], None] | None = None, workers: Workers = 1
) -> tuple[JointFit, ...]:
    """Fit every friction law to all loops together, lowest AICc first; empty for fewer than two usable loops.

    Each run has its own static curve, all runs have one friction. Its force scale depends on the pressure
    (`PressureScaledFriction`) if the F test and AICc favour this, and is constant otherwise.

    progress  called with a text for each law
    workers   number of processes, as in `compare`: a law is a task
    """
    usable = tuple(each for each in loop_fits if not _reason_against(each))
    if len(usable) < 2:
        return ()
    by_law: dict[type[Friction], list[HysteresisFit]] = {}
    for fit in (fit for each in usable for fit in each.fits):
        by_law.setdefault(type(fit.friction), []).append(fit)
    tasks = [own for own in by_law.values() if len(own) == len(usable)]
    fits: dict[int, JointFit] = {}
    with process_pool(workers) as executor:
        for i, joint in DistributedCalls(executor, _fit_law, usable).completed(tasks):
            fits[i] = joint
            if progress is not None:
                progress(f"{joint.name}, all runs")
    return tuple(sorted((fits[i] for i in sorted(fits)), key=lambda fit: -fit.aicc_reduction))


def identified_friction(friction: Friction, runs: Sequence[LoopSeries]) -> Friction:
    """The friction with the range of pressure and speed of the runs it was fitted to."""
    pressures = [run.pressure[run.fitted_rows] for run in runs if run.pressure is not None]
    if not pressures:
        return friction
    low, high = np.quantile(np.concatenate(pressures), PRESSURE_QUANTILES)
    margin = RELATIVE_BAND * max(abs(low), abs(high), 1e3)
    speed = combine_limits(tuple(run.limits for run in runs)).high_speed
    range_of_speed = {"max_speed": speed} if np.isfinite(speed) and speed > 0 else {}
    return IdentifiedFriction(friction, float(low - margin), float(high + margin), **range_of_speed)


def _fit_law(usable: Sequence[LoopFit], own: Sequence[HysteresisFit]) -> JointFit:
    """One law fitted to all runs, with a constant and with a pressure-dependent scale; the better of the two."""
    runs, scale_p_value = [fit.series for fit in own], float("nan")
    known = [None if run.pressure is None else float(np.mean(run.pressure[run.fitted_rows])) for run in runs]
    pressures = np.array([float("-inf") if each is None else each for each in known])
    reference, lowest = int(np.argmax(pressures)), float(pressures.min())  # -inf where a run has no pressure
    friction, weak = search_parameters(own[len(own) // 2].friction, runs)
    if np.isfinite(lowest) and pressures[reference] > max(1e3, MIN_PRESSURE_RATIO * lowest):
        scaled = search_parameters(_initial_scale(own, pressures, reference), runs)
        small, large = (Misfit.of(each, runs) for each in (friction, scaled[0]))
        scale_p_value = large.p_value(small)
        if scale_p_value < SIGNIFICANCE_LEVEL and large.reduction_of_aicc(small) > 0:
            friction, weak = scaled
    repeats = [each.loop.series(*each.loop.repeat) for each in usable if each.loop.repeat is not None]
    parts = zip(own, usable, pressures.tolist(), strict=True)
    agreement = [agreement_of_run(friction, fit, each.loop.description, pressure) for fit, each, pressure in parts]
    return JointFit(
        **evidence(friction, runs, repeats), weak_combinations=weak, series=tuple(runs), agreement=tuple(agreement),
        scale_p_value=scale_p_value,
    )  # fmt: skip


def _initial_scale(own: Sequence[HysteresisFit], pressures: Array, reference: int) -> PressureScaledFriction:
    """The friction of the run at the highest pressure, with a scale by the amplitudes of all runs."""
    amplitudes = [force_amplitude(fit.series, fit.friction) for fit in own]
    slope, offset = np.polyfit(pressures, amplitudes, 1)
    rounded = float(f"{pressures[reference]:.3g}")
    at_reference = offset + slope * rounded
    ratio = offset / at_reference if at_reference > 0 else 1.0
    return PressureScaledFriction(own[reference].friction, float(np.clip(ratio, 0.01, 5.0)), rounded)


class SelectedFriction(NamedTuple):
    """The friction to write, with the range of its data, the file or files it is from, and its verdict."""

    friction: Friction
    origin: str
    verdict: str


def select_friction(fits: Sequence[LoopFit], joint: Sequence[JointFit]) -> SelectedFriction | None:
    """The friction to write: of all runs together or, if they are not several, of the only run a plant can use."""
    if joint:
        best = preferred_fit(joint)
        if best is None:
            return None
        origin = f"{len(best.series)} runs"
        return SelectedFriction(identified_friction(best.friction, best.series), origin, best.verdict)
    usable = [fit.recommended for fit in fits if fit.recommended is not None and fit.usable_in_plant]
    if not usable:
        return None
    only = max(usable, key=lambda fit: fit.effective_sample_size)
    return SelectedFriction(identified_friction(only.friction, (only.series,)), only.series.origin, only.verdict)
