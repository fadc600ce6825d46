"""What a run computed becomes a Recording, with what its reader should know."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compile import System
from ..control.inputs import PiecewiseLinear
from ..core.arrays import Array
from ..core.errors import SimulationError
from ..muscle import INNER_CONTRACTION, SeriesSpring
from ..plant.plant import Plant
from ..recording import Recording
from .diagnostics import geometry_limit_hint, truncate_at_invalid_row, validity_warnings
from .integrators import INTERRUPTED, REASONS, Integrator, RawSolution

if TYPE_CHECKING:
    from ..compile.program import CompiledSystem


def _results(
    ready: CompiledSystem, course: RawSolution, segments: PiecewiseLinear, times: Array, start: float
) -> tuple[Array, Array]:
    """Outputs (N, K) and inputs (N, m) at the rows that were reached."""
    from ..compile.cache.kernel import evaluate

    states = np.ascontiguousarray(course.rows[: course.reached])
    inputs = np.ascontiguousarray(segments.inputs_at(times[: course.reached], start))
    results = np.empty((course.reached, ready.sizes.outputs))
    evaluate(ready.address["outputs"], ready.precomputed, states, inputs, results)
    return results, inputs


def to_recording(
    ready: CompiledSystem,
    course: RawSolution,
    segments: PiecewiseLinear,
    times: Array,
    start: float,
    method: Integrator,
) -> tuple[Recording, RawSolution]:
    """The rows that were reached, up to the first that cannot be, and the course up to there."""
    plant = ready.system
    results, inputs = _results(ready, course, segments, times, start)
    course = truncate_at_invalid_row(ready, course, results, times)
    reached = course.reached
    states, results, inputs = course.rows[:reached], results[:reached], inputs[:reached]
    columns: dict[str, Any] = {"time": times[:reached]}
    columns |= {s.name: states[:, i] for i, s in enumerate(plant.states)}
    columns |= {name: results[:, i] for i, name in enumerate(ready.output_names)}
    columns |= {name: inputs[:, i] for i, name in enumerate(plant.inputs)}
    notes: list[str] = [f"simulated by {method}: {course.steps} steps, {course.rejected} rejected"]
    constants: dict[str, float | str] = {}
    if isinstance(plant, Plant):
        constants = {"ambient": plant.ambient.pressure}
        if len(plant.muscles) == 1:
            constants["resting_length"] = plant.muscles[0].geometry.resting_length
        notes += [f"gas: {plant.gas}", describe_friction(plant), *extrapolation_warnings(plant, columns)]
        notes += validity_warnings(plant, columns) if reached else []
    return Recording(columns, "simulation", constants, tuple(notes)), course


def describe_friction(plant: Plant) -> str:
    """What friction a plant's muscles have; the default is none, which a reader should know."""
    if not any(m.friction.states for m in plant.muscles):
        return "friction: off"
    words = [f"{m.name} {m.friction if m.friction.states else 'none'}" for m in plant.muscles]
    return f"friction: {', '.join(words) if len(words) > 1 else plant.muscles[0].friction}"


def extrapolation_warnings(plant: Plant, columns: Mapping[str, Any]) -> list[str]:
    """When and how far a run left the validity range in which a muscle's characteristic has data, or the reach of a geometry."""
    found = []
    for prefix, muscle in zip(plant.prefixes, plant.muscles, strict=True):
        of_muscle = []
        validity_range = muscle.validity_range or getattr(muscle.contractile, "validity_range", None)
        if validity_range is not None:
            left, doubt = (
                f"{muscle.name} was outside the validity range of its characteristic",
                "nothing was measured there",
            )
            of_muscle += [
                ("pressure", validity_range.pressure, left, doubt),
                ("contraction", validity_range.contraction, left, doubt),
            ]
        own = INNER_CONTRACTION if isinstance(muscle.series, SeriesSpring) else "contraction"
        if f"{prefix}{own}" in columns:  # of a batch that may not be kept
            left, doubt = f"{muscle.name} was beyond the reach of its geometry", "no muscle can do this"
            of_muscle.append((own, muscle.geometry.contraction_range, left, doubt))
        for name, bounds, left, doubt in of_muscle:
            found += _beyond(columns["time"], columns[f"{prefix}{name}"], name, bounds, left, doubt)
    return found


def _beyond(time: Array, values: Array, name: str, bounds: tuple[float, float], left: str, doubt: str) -> list[str]:
    """A note where a column of pressure or contraction leaves its bounds."""
    (low, high), (scale, unit) = bounds, (1e3, "kPa") if name == "pressure" else (0.01, "%")
    beyond = np.maximum(low - values, values - high)
    if not (beyond > 1e-9 * (high - low)).any():
        return []
    worst, share = int(np.argmax(beyond)), float(np.mean(beyond > 0))
    return [
        f"{left} in {name} ({low / scale:.4g} to {high / scale:.4g} {unit}) in {share:.0%} of the rows, by at most "
        f"{beyond[worst] / scale:.4g} {unit} at {time[worst]:.4g} s; {doubt}"
    ]


def raise_if_incomplete(
    plant: System, recording: Recording, course: RawSolution, end: float, complete: bool
) -> Recording:
    """The recording, and where the run ended early the reason in its notes; a `complete` run then raises instead."""
    if course.status == 0:
        return recording
    told = failure_message(plant, course, end)
    recording = dataclasses.replace(recording, notes=(*recording.notes, told))
    if complete:
        raise SimulationError(told, recording, interrupted=course.status == INTERRUPTED)
    return recording


def failure_message(plant: System, course: RawSolution, end: float) -> str:
    """When, why and at which state a run ended early, and what to do."""
    state = ", ".join(f"{s.name} {v:.6g} {s.unit}" for s, v in zip(plant.states, course.state, strict=True))
    remedy = {
        4: "Raise the tolerance, lengthen a fixed step, or look for a valve that chatters.",
        5: "Nothing is lost; what was computed is in the recording.",
        8: "Look at what the controller measured last, and at its parameters.",
    }.get(course.status, "Look at the last state: a parameter may be far from physical, or a fixed step too long.")
    if isinstance(plant, Plant) and course.status != INTERRUPTED:
        remedy = geometry_limit_hint(plant, course.state) or remedy
    return (
        f"the run ended at {course.time:.6g} of {end:.6g} s because {REASONS[course.status]}, after {course.steps} "
        f"steps, at {state}. {remedy}"
    )
