"""Control loops in lanes: blocks of loops with common sampling instants through one vectorised step and sample."""

import numpy as np
import numpy.typing as npt

from ....core import Array, Status, tree
from ...compile.cache.kernel import aligned_array, loop_lanes
from ...loop.control_law import ControlLaw
from ..compiled_law import compiled_sample, parameters_of
from ..integrators import ExplicitRungeKutta
from .job import BatchJob
from .lanes import Double, finish_block, load_plants
from .loops import LoopBatch

NUMBER = Double().number
MAX_SAMPLES = 200_000
"""Samples of a run up to which the set points, samples and commands of a block fit in memory (chosen)."""


def run_in_lanes(job: BatchJob, plants: npt.NDArray[np.intp]) -> bool:
    """Whether the loops of these plants can be computed in lanes.

    That is with a fixed step, control laws of one structure, no drivers, common sampling instants and segments, and at
    most MAX_SAMPLES samples.
    """
    loops = job.loops
    if loops is None or not isinstance(job.integrator, ExplicitRungeKutta):
        return False
    distinct = {id(loop): loop for loop in loops.loops}.values()
    if any(loop.drivers or not isinstance(loop.controller, ControlLaw) for loop in distinct):
        return False
    structure, sample_time = tree.structure(loops.loops[0].controller), loops.loops[0].sample_time
    if any(tree.structure(o.controller) is not structure or o.sample_time != sample_time for o in distinct):
        return False
    first = loops.prepared(loops.loop_of(int(plants[0])))
    if first.instants.size > MAX_SAMPLES:
        return False
    ends = first.inputs.ends
    return all(np.array_equal(loops.prepared(loop).inputs.ends, ends) for loop in distinct)


class LoopLaneBlock:
    """The arrays of one thread for a block of loops; it owns them as long as a kernel uses their addresses."""

    def __init__(self, job: BatchJob, loops: LoopBatch) -> None:
        self.job, self.loops = job, loops
        sizes, width = job.compiled.sizes, NUMBER.lanes
        assert isinstance(job.integrator, ExplicitRungeKutta)
        self.step = job.integrator.step
        addresses, held = job.compiled.program.lanes(job.integrator.tableau(), NUMBER)
        law, self.prepared = loops.loops[0].controller, loops.prepared(loops.loops[0])
        assert isinstance(law, ControlLaw)
        self.sample = compiled_sample(law, width)
        self.addresses = *addresses, self.sample.address
        n, m, outputs, memory = sizes.states, sizes.inputs, sizes.outputs, len(law.initial_memory)
        k, s, c = len(law.measured_columns), len(law.setpoints), len(law.inputs)
        of_law = (parameters_of(law).size, memory, memory, k, s, c, c, c, 1)
        lengths = (sizes.parameters, held, n, n, m, m, m, 1, outputs, *of_law)
        self.arrays = [aligned_array((length, width)) for length in lengths]
        known = job.compiled.description
        columns = (*known.state_names, *known.output_names)
        self.measured_at = np.array([columns.index(name) for name in law.measured_columns], dtype=np.int64)
        self.commanded_at = np.array(self.prepared.commanded, dtype=np.int64)
        intervals, segments = self.prepared.instants.size - 1, self.prepared.inputs.ends.size
        self.setpoints = np.empty((intervals, s, width))
        self.values, self.slopes = np.empty((segments, m, width)), np.empty((segments, m, width))
        self.samples, self.commands = np.empty((intervals, k, width)), np.empty((intervals, c, width))
        self.plain = len(known.state_names) + len(known.output_names) + len(known.input_names)
        self.kept = job.kept[job.kept < self.plain]
        self.rows = np.empty((self.kept.size, width, job.times.size))
        self.starts = self.prepared.inputs.starts(job.start_time)
        rows = np.searchsorted(self.starts, job.times, side="right") - 1
        self.row_segment = np.maximum(rows, 0).astype(np.int64)
        self.status, self.width = np.empty(width, dtype=np.int64), width

    def _load(self, lane: npt.NDArray[np.intp]) -> None:
        """Take over parameters, initial states, set points and inputs of one plant a lane."""
        loops, u = self.loops, self.arrays[4]
        load_plants(self.job, self.arrays, lane)
        parameters, memory, _, _, _, _, low, high, period = self.arrays[9:]
        for i, plant in enumerate(lane.tolist()):
            loop = loops.loop_of(plant)
            prepared, law = loops.prepared(loop), loop.controller
            assert isinstance(law, ControlLaw)
            parameters[:, i] = parameters_of(law) if loops.laws is None else loops.laws.parameters(plant)
            memory[:, i] = list(law.initial_memory.values())
            self.setpoints[:, :, i] = prepared.setpoint_values
            self.values[:, :, i], self.slopes[:, :, i] = prepared.inputs.values, prepared.inputs.slopes
            ranges = np.array([prepared.ranges[name] for name in law.inputs]).reshape(-1, 2)
            low[:, i], high[:, i] = ranges.T
        period[:], u[:] = loops.loops[0].sample_time, self.values[0]

    def run(self, plants: npt.NDArray[np.intp], lane: npt.NDArray[np.intp], stop: npt.NDArray[np.int64]) -> None:
        """Simulate one block of loops, of which `lane` names one for each lane."""
        job, prepared = self.job, self.prepared
        self._load(lane)
        status = loop_lanes(
            *self.addresses, *self.arrays, prepared.instants, self.setpoints, prepared.first_segments, self.starts,
            prepared.inputs.ends, self.values, self.slopes, self.step, self.measured_at, self.commanded_at,
            job.lower_bounds, job.times, self.row_segment, self.kept, self.rows, self.samples, self.commands,
            self.status, stop,
        )  # fmt: skip
        if status != Status.INTERRUPTED:
            self._write(plants)

    def _write(self, plants: npt.NDArray[np.intp]) -> None:
        """Write the results of a block; a loop that failed is run again alone, for its rows and its reason."""
        job, kept = self.job, iter(self.rows)
        at = np.minimum(self.prepared.at_times[0], len(self.samples) - 1)
        for name, place in zip(job.columns, job.kept.tolist(), strict=True):
            column = job.columns[name]
            column[plants] = next(kept)[: plants.size] if place < self.plain else self._of_loop(name, at, plants)
        finish_block(job, plants, self.arrays[2].T, self.status)

    def _of_loop(self, name: str, at: npt.NDArray[np.intp], plants: npt.NDArray[np.intp]) -> Array:
        """A column (R, T) of the set points, measurements or commands of plants."""
        loops = self.loops
        kind, index = loops.place_of(name)
        if kind:
            return np.asarray((self.samples if kind == 1 else self.commands)[at, index, : plants.size].T)
        return np.array([loops.prepared(loops.loop_of(int(plant))).at_times[1][:, index] for plant in plants])
