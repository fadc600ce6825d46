"""Rows of a run: outputs and inputs at its states, the first invalid row, and the recording with its diagnostics."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..compile.cache.kernel import record
from ..compile.program import CompiledSystem
from ..control.piecewise_linear import PiecewiseLinear
from ..core.arrays import Array
from ..core.diagnostics import Columns, Diagnostic, DiagnosticCode
from ..core.status import Status
from ..recording import Recording
from .integrators import Integrator, RawSolution

_HINTS = {
    Status.TOO_MANY_STEPS: "Raise the tolerance, lengthen a fixed step, or look for a valve that chatters.",
    Status.INTERRUPTED: "Nothing is lost; the rows until then are in the recording.",
    Status.NON_FINITE_COMMAND: "Check the last measurement of the controller, and its parameters.",
}
_GENERAL_HINT = "Check the last state: a parameter may be far from physical, or a fixed step too long."


class RowTable(NamedTuple):
    """Inputs (N, m) and outputs (N, k) of a run, the range of each column, and the first row that is not finite."""

    inputs: Array
    outputs: Array
    lower: Array
    upper: Array
    first_invalid: int


def evaluate_rows(
    compiled: CompiledSystem, states: Array, times: Array, segments: PiecewiseLinear, start: float
) -> RowTable:
    """Inputs and outputs at states (N, n) and rising times (N,) of a run whose segments begin at `start` [s]."""
    sizes, count = compiled.sizes, times.size
    inputs, outputs = np.empty((count, sizes.inputs)), np.empty((count, sizes.outputs))
    lower, upper = np.empty((2, sizes.states + sizes.inputs + sizes.outputs))
    first = record(
        compiled.address["outputs"], compiled.precomputed, states, times, start, segments.ends, segments.values,
        segments.slopes, inputs, outputs, lower, upper,
    )  # fmt: skip
    return RowTable(inputs, outputs, lower, upper, first)


def truncate_at_invalid_row(
    compiled: CompiledSystem, raw: RawSolution, table: RowTable, times: Array
) -> tuple[RawSolution, RowTable]:
    """The solution up to the first row that is impossible, where numbers go on although the model does not hold.

    A fixed step can end in numbers that are far off; isothermal air has a pressure, below vacuum, in a negative volume.
    """
    known, sizes = compiled.description, compiled.sizes
    positive = known.positive_outputs
    volumes = sizes.states + sizes.inputs + positive
    valid = table.first_invalid == raw.reached and bool((table.lower[: sizes.states] >= known.lower_bounds).all())
    if valid and bool((table.lower[volumes] > 0.0).all()):
        return raw, table
    reasons: dict[Status, Any] = {
        Status.NOT_FINITE: ~np.isfinite(table.outputs).all(axis=1),
        Status.NEGATIVE_AIR_MASS: (raw.rows[: raw.reached] < known.lower_bounds).any(axis=1),
        Status.NON_POSITIVE_VOLUME: (table.outputs[:, positive] <= 0.0).any(axis=1),
    }
    invalid = np.flatnonzero(np.any(list(reasons.values()), axis=0))
    if not invalid.size:
        return raw, table
    row = int(invalid[0])
    status = next(status for status, rows in reasons.items() if rows[row])
    raw = raw._replace(reached=row, time=float(times[row]), state=raw.rows[row], status=status)
    inputs, outputs = table.inputs[:row], table.outputs[:row]
    columns = np.hstack([raw.rows[:row], inputs, outputs]) if row else np.full((1, table.lower.size), np.nan)
    return raw, RowTable(inputs, outputs, columns.min(axis=0), columns.max(axis=0), row)


def make_recording(
    compiled: CompiledSystem, raw: RawSolution, table: RowTable, times: Array, integrator: Integrator | None,
    end: float, more: dict[str, Array], before: tuple[Diagnostic, ...] = (),
) -> tuple[Recording, tuple[Diagnostic, ...]]:  # fmt: skip
    """The recording of the rows that were reached, with its diagnostics as notes.

    more    further columns
    before  diagnostics that come first
    """
    known, reached = compiled.description, raw.reached
    states, times = raw.rows[:reached], times[:reached]
    for array in (times, states, table.outputs, table.inputs, *more.values()):
        array.setflags(write=False)
    columns: dict[str, Array] = {"time": times}
    columns.update(zip(known.state_names, states.T, strict=True))
    columns.update(zip(known.output_names, table.outputs.T, strict=True))
    columns.update(zip(known.input_names, table.inputs.T, strict=True))
    columns.update(more)
    text = f"simulated by {integrator}: {raw.steps} steps, {raw.rejected} rejected"
    diagnostics = [*before, Diagnostic(DiagnosticCode.INTEGRATOR, "integrator", text), *known.remarks]
    if reached:
        diagnostics += compiled.system.diagnose(Columns(columns, _limits(compiled, table)))
    if raw.status != Status.DONE:
        diagnostics.append(early_end(compiled, raw, end))
    notes = tuple(diagnostic.message for diagnostic in diagnostics)
    return Recording.from_arrays(columns, "simulation", known.constants, notes), tuple(diagnostics)


def _limits(compiled: CompiledSystem, table: RowTable) -> dict[str, tuple[float, float]]:
    known = compiled.description
    names = (*known.state_names, *known.input_names, *known.output_names)
    return dict(zip(names, zip(table.lower.tolist(), table.upper.tolist(), strict=True), strict=True))


def early_end(compiled: CompiledSystem, raw: RawSolution, end: float) -> Diagnostic:
    """When, why and at which state a run ended early, and what to do."""
    state = dict(zip(compiled.description.state_names, raw.state.tolist(), strict=True))
    units = [s.unit for s in compiled.system.states]
    at = ", ".join(f"{name} {v:.4g} {unit}" for (name, v), unit in zip(state.items(), units, strict=True))
    hint = _HINTS.get(raw.status, _GENERAL_HINT)
    if raw.status != Status.INTERRUPTED:
        hint = compiled.system.failure_hint(state) or hint
    text = (
        f"the run ended at {raw.time:.6g} of {end:.6g} s because {raw.status.message}, after {raw.steps} steps, at {at}"
    )
    return Diagnostic(DiagnosticCode.INCOMPLETE, "run", text, hint=hint)
