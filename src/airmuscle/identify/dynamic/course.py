"""One record of a dynamic fit: what the model gives at its rows, and the derivatives by every unknown."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import declare
from ...errors import IdentificationError, ParameterError, suggestion
from ...method import Method
from ...program import System
from ...sensitive import Sensitive, sensitivity
from .experiment import Experiment, StartTime, StartValue, Unknown
from .start import conditions, solved

Array = npt.NDArray[np.float64]


class Course:
    """The model of one record, compiled once with its sensitivities; `unknowns` are all of the fit."""

    def __init__(
        self, plant: System, experiment: Experiment, number: int, unknowns: Sequence[Unknown],
        observed: Mapping[str, float], method: Method,
    ) -> None:  # fmt: skip
        from ...program.prepared import prepared  # CasADi, which describing a fit does not need

        self.plant, self.experiment, self.method = experiment.plant or plant, experiment, method
        self.unknowns = unknowns
        self.mine = [k for k, u in enumerate(unknowns) if u.record in (None, number)]
        self.columns = [k for k in self.mine if not isinstance(unknowns[k].what, StartTime)]
        groups = tuple(unknowns[k].paths for k in self.columns)
        system = Sensitive(self.plant, groups, tuple(unknowns[k].scale for k in self.columns))
        self.ready = prepared(system)
        self.names = tuple(observed)
        self.times = _rising(experiment)
        self.measured = np.column_stack([experiment.recording[name] for name in self.names])
        self._place = {leaf.path: i for i, leaf in enumerate(declare.leaves(self.plant))}
        self._leaves = declare.flatten(self.plant)
        self._conditions = conditions(self.plant, experiment.start)
        self._known = list(experiment.start.known)
        self._sizes = [s.nominal for s in self.plant.states]
        self._guess = np.array([experiment.start.guess[s.name] for s in self.plant.states])
        outputs = list(self.ready.output_names)
        self._value = [_index(outputs, name, experiment) for name in self.names]
        self._slope = [outputs.index(f"{name}.rate") for name in self.names]
        self._by = [[outputs.index(sensitivity(name, k)) for name in self.names] for k in range(len(groups))]

    def leaves(self, values: Array) -> Array:
        """The plant's leaves with the unknowns at `values`."""
        found = self._leaves.copy()
        for k in self.mine:
            for path in self.unknowns[k].paths:
                found[self._place[path]] = values[k]
        return found

    def start(self, values: Array) -> tuple[Array, Array]:
        """The state at the start (n,) and its derivatives by every column (n, K)."""
        known = np.array([self.experiment.start.known[name] for name in self._known])
        for k in self.columns:
            what = self.unknowns[k].what
            if isinstance(what, StartValue):
                known[self._known.index(what.name)] = values[k]
        state, by_known, by_leaf = solved(
            self._conditions, self.experiment.start, self.leaves(values), known, self._guess, self._sizes
        )
        slopes = np.zeros((state.size, len(self.columns)))
        for j, k in enumerate(self.columns):
            what = self.unknowns[k].what
            if isinstance(what, StartValue):
                slopes[:, j] = by_known[:, self._known.index(what.name)]
            else:
                slopes[:, j] = sum(by_leaf[:, self._place[path]] for path in self.unknowns[k].paths)
        return state, slopes

    def start_time(self, values: Array) -> float:
        """Where the run begins on the record's clock [s]."""
        shifts = [values[k] for k in self.mine if isinstance(self.unknowns[k].what, StartTime)]
        return float(shifts[0]) if shifts else self.experiment.start_time

    def evaluate(self, values: Array) -> tuple[Array, Array]:
        """What the model gives at the record's rows (N, Q), and its derivatives by all unknowns (N, Q, P).

        Raises IdentificationError where the run fails or its start does not exist.
        """
        outputs, before = self._outputs(values)
        slopes = np.zeros((*self.measured.shape, len(self.unknowns)))
        for j, k in enumerate(self.columns):
            slopes[:, :, k] = outputs[:, self._by[j]]
        for k in self.mine:
            if isinstance(self.unknowns[k].what, StartTime):
                slopes[:, :, k] = np.where(before[:, None], 0.0, -outputs[:, self._slope])
        return outputs[:, self._value], slopes

    def _outputs(self, values: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        from ...engine.evaluate import evaluate

        state, slopes = self.start(values)
        clock = self.times - self.start_time(values)
        before = clock < 0
        inputs = self.plant.inputs
        segments = self.experiment.command.segments(inputs, 0.0, max(float(clock[-1]), 1e-9))
        leaves = np.concatenate([self.leaves(values), self.ready.parameters[self._leaves.size :]])
        ready = dataclasses.replace(self.ready, parameters=leaves, held=self.ready.program.held(leaves))
        full = np.concatenate([state, slopes.T.ravel()])
        course = self.method.run(ready, segments, 0.0, full, np.maximum(clock, 0.0), most_steps=1_000_000)
        if course.status != 0:
            raise IdentificationError(
                f"{self.experiment.recording.origin}: the run ended early, at {course.time:.4g} s."
            )
        under = np.ascontiguousarray(segments.inputs_at(np.maximum(clock, 0.0), 0.0))
        results = np.empty((clock.size, ready.sizes.outputs))
        evaluate(ready.address["outputs"], ready.held, course.rows, under, results)
        return results, before


def _rising(experiment: Experiment) -> Array:
    times = experiment.recording["time"]
    bad = np.flatnonzero(~(np.diff(times) >= 0))
    if bad.size or not times.size:
        where = f"row {bad[0] + 2} stands at {times[bad[0] + 1]:g} s" if bad.size else "it has no rows"
        raise IdentificationError(f"{experiment.recording.origin}: time must rise; {where}. Mend or cut the record.")
    return times


def _index(outputs: list[str], name: str, experiment: Experiment) -> int:
    if name not in outputs:
        known = [n for n in outputs if not n.startswith("d ") and not n.endswith(".rate")]
        raise ParameterError(
            f"{experiment.recording.origin}: the plant has no output '{name}'; there are {', '.join(known)}."
            f"{suggestion(name, known)}"
        )
    return outputs.index(name)


def stacked(courses: Sequence[Course], values: Array, deviations: Array) -> tuple[Array, Array]:
    """Residuals (R,) in standard deviations, model less measured, rows without a reading left out; slopes (R, P)."""
    errors, slopes = [], []
    for course in courses:
        modelled, by = course.evaluate(values)
        kept = np.isfinite(course.measured)
        errors.append(((modelled - course.measured) / deviations)[kept])
        slopes.append((by / deviations[:, None])[kept])
    return np.concatenate(errors), np.concatenate(slopes)


def observations(courses: Sequence[Course]) -> Any:
    """How many readings take part."""
    return sum(int(np.isfinite(course.measured).sum()) for course in courses)
