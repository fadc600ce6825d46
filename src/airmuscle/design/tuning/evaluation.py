"""Evaluation of sets of gains: the loops of all cases in batches, and the metrics of their runs."""

import dataclasses
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import AirmuscleError, Array, flatten, leaves, structure
from ...engine.loop import COMMAND, SETPOINT, ControlLaw, ControlLoop, with_designed_laws
from ...engine.run.batch import CONTROLLER, BatchSolution, hidden_progress, simulate_batch
from ...engine.run.integrators import Integrator
from . import CaseMetrics, TrackingIndex
from .case import LoopCase, loop_with_gains, with_gains

MAX_VALUES = 20_000_000
"""Values of all columns of one batch, which is 160 MB; more sets of gains are simulated in several
batches (chosen).
"""
AIR_MASS = "air_mass"
"""Last part of the name of the states that hold the air of a muscle."""


@dataclasses.dataclass(frozen=True, eq=False)
class CaseGroup:
    """Cases whose loops run in one batch: plants of one structure with the same loop.

    places          the cases among all
    varied          values (m,) of the parameters in which the m plants differ, by path
    initial_states  values (m,) by state
    scales          the controlled columns with their scales
    air             the states that hold the air of the muscles
    kept            the columns from which metrics are computed
    """

    places: npt.NDArray[np.intp]
    cases: tuple[LoopCase, ...]
    varied: Mapping[str, Array]
    initial_states: Mapping[str, Array]
    scales: Mapping[str, float]
    air: tuple[str, ...]
    kept: tuple[str, ...]


def group_cases(cases: Sequence[LoopCase], index: TrackingIndex) -> tuple[CaseGroup, ...]:
    """The cases in groups that can be simulated together. Raises what an impossible loop or initial
    state raises.
    """
    members: dict[Any, list[int]] = {}
    for i, case in enumerate(cases):
        members.setdefault(
            (id(structure(case.plant)), id(case.loop), case.controller_path), []
        ).append(i)
    groups = []
    for places in members.values():
        together = tuple(cases[i] for i in places)
        groups.append(_group_of(together, np.array(places), index))
    return tuple(groups)


def _group_of(
    cases: tuple[LoopCase, ...], places: npt.NDArray[np.intp], index: TrackingIndex
) -> CaseGroup:
    """Cases of one structure of the plant and one loop, with what they do not have in common."""
    first = cases[0]
    plant = first.plant
    starts = [case.start() for case in cases]
    states = {name: np.array([start[name] for start in starts]) for name in starts[0]}
    still = dict.fromkeys(plant.inputs, 0.0)
    outputs = plant.outputs(starts[0], still)
    state_names = [state.name for state in plant.states]
    columns = (*state_names, *outputs)
    try:
        first.loop.check_columns(columns, plant.inputs)
        scales = index.scales_for(first.loop.controller.setpoints, columns)
    except AirmuscleError as error:
        raise error.located(f"case '{first.name}'") from None
    air = tuple(name for name in state_names if name.rpartition(".")[2] == AIR_MASS)
    commands = (f"{COMMAND}{name}" for name in first.loop.controller.inputs)
    tracked = (column for name in scales for column in (name, f"{SETPOINT}{name}"))
    recorded = (*tracked, *commands, *air)
    varied = _varied_parameters(cases)
    return CaseGroup(places, cases, varied, states, scales, air, recorded)


def _varied_parameters(cases: Sequence[LoopCase]) -> dict[str, Array]:
    """The parameters (m,) by path in which the plants of cases differ."""
    # one row for each case
    rows = [flatten(case.plant) for case in cases]
    table = np.array(rows)
    paths = [leaf.path for leaf in leaves(cases[0].plant)]
    differs = (table != table[0]).any(axis=0)
    columns = zip(paths, table.T, differs, strict=True)
    return {path: column for path, column, varies in columns if varies}


@dataclasses.dataclass(frozen=True, eq=False)
class Evaluator:
    """Simulation of sets of gains, which have these paths, in all cases."""

    cases: tuple[LoopCase, ...]
    groups: tuple[CaseGroup, ...]
    paths: tuple[str, ...]
    duration: float
    index: TrackingIndex
    integrator: Integrator | None
    start_time: float = 0.0

    def metrics(self, gains: Array) -> tuple[CaseMetrics, Counter[str]]:
        """The metrics (E, M) of gains (E, D), and why sets of gains were refused or runs failed,
        with their numbers.

        Raises KeyboardInterrupt if the user stops the simulation.
        """
        shape = len(gains), len(self.cases)
        air, travel = np.full((2, *shape), np.nan)
        metrics = CaseMetrics(np.full(shape, np.inf), air, travel, np.zeros(shape, bool))
        possible = list[int]()
        reasons = Counter[str]()
        for i, row in enumerate(gains.tolist()):
            try:
                with_gains(self.cases[0].controller, dict(zip(self.paths, row, strict=True)))
            except AirmuscleError as error:  # the controller does not accept these gains together
                reasons[str(error)] += 1
            else:
                possible.append(i)
        rows = np.array(possible, dtype=np.intp)
        for group in self.groups:
            samples = self.duration / group.cases[0].loop.sample_time + 2
            sets_at_once = max(1, int(MAX_VALUES / (samples * len(group.kept) * len(group.cases))))
            for i in range(0, rows.size, sets_at_once):
                reasons.update(self._evaluate(group, gains, rows[i : i + sets_at_once], metrics))
        return metrics, reasons

    def _evaluate(
        self, group: CaseGroup, gains: Array, rows: npt.NDArray[np.intp], metrics: CaseMetrics
    ) -> Iterable[str]:
        """Write the metrics of some sets of gains in the cases of a group; the reasons of failed
        runs.
        """
        batch = self._simulate(group, gains[rows])
        if batch.interrupted:
            raise KeyboardInterrupt
        first = group.cases[0]
        shape = (rows.size, len(group.cases))
        at = np.ix_(rows, group.places)
        succeeded = batch.status == 0
        elapsed = batch.time - batch.time[0]
        with np.errstate(invalid="ignore", over="ignore"):
            index = self.index.values(elapsed, batch.columns, group.scales)
        completed = succeeded & np.isfinite(index)
        metrics.index[at] = np.where(completed, index, np.inf).reshape(shape)
        # What flows into a muscle is drawn from the supply, and what flows out is lost.
        drawn = []
        for name in group.air:
            inflow = np.maximum(np.diff(batch[name], axis=1), 0.0)
            drawn.append(inflow.sum(axis=1))
        air = np.sum(drawn, axis=0) if drawn else np.full(len(batch), np.nan)
        metrics.air[at] = air.reshape(shape) / self.duration
        strokes = []
        for name, (low, high) in first.loop.command_ranges(first.plant).items():
            changes = np.abs(np.diff(batch[f"{COMMAND}{name}"], axis=1))
            strokes.append(changes.sum(axis=1) / (high - low))
        travel = np.where(succeeded, np.sum(strokes, axis=0), np.nan)
        metrics.travel[at] = travel.reshape(shape) / self.duration
        metrics.completed[at] = completed.reshape(shape)
        return batch.reasons.values()

    def _simulate(self, group: CaseGroup, gains: Array) -> BatchSolution:
        """The loops of sets of gains (E, D) and m cases as a batch of E m rows, the cases of one
        set together.
        """
        sets = len(gains)
        m = len(group.cases)
        first = group.cases[0]
        variations = {path: np.tile(values, sets) for path, values in group.varied.items()}
        loop: ControlLoop | list[ControlLoop] = first.loop
        controller = first.loop.controller
        if isinstance(controller, ControlLaw) and with_designed_laws(controller) is controller:
            for i, path in enumerate(self.paths):
                variations[f"{CONTROLLER}{first.full_path(path)}"] = np.repeat(gains[:, i], m)
        else:
            of_set = (
                loop_with_gains(first, dict(zip(self.paths, row, strict=True)))
                for row in gains.tolist()
            )
            loop = [set_loop for set_loop in of_set for _ in range(m)]
        with hidden_progress():
            return simulate_batch(
                first.plant,
                variations,
                loop,
                duration=self.duration,
                output_times=first.loop.sample_time,
                initial_states={
                    name: np.tile(values, sets) for name, values in group.initial_states.items()
                },
                integrator=self.integrator,
                keep=group.kept,
                start_time=self.start_time,
            )


def joined_metrics(parts: Sequence[CaseMetrics]) -> CaseMetrics:
    """The metrics of several groups of sets of gains as those of one."""
    fields = ("index", "air", "travel", "completed")
    return CaseMetrics(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in fields)
    )
