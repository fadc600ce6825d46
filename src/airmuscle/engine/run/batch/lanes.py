"""Lanes: blocks of plants or control loops through one vectorised step together, one thread per
core.

Plants are computed in single or double precision, loops in double precision.
"""

import abc
import dataclasses
import functools
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ....core import Array, Status, tree
from ...compile.cache.kernel import BoundKernel, aligned_array, lanes, loop_lanes
from ...compile.llvm.emit import LlvmType
from ...loop import MEASURED, SETPOINT, ControlLaw
from ..compiled_law import compiled_sample
from ..compiled_loop import CompiledLoop
from ..integrators import ExplicitRungeKutta
from ..sampled_loop import intervals_of
from .job import BatchJob, Queue

Plants = npt.NDArray[np.intp]
Flag = npt.NDArray[np.int64]
"""A flag (1,) that ends a kernel early."""
BITS = 1024
"""Size of a vector of lanes: two of the widest registers, which alternate."""
MAX_SAMPLES = 200_000
"""Samples of a run up to which the set points, samples and commands of a block fit in memory
(chosen).
"""


class Precision(abc.ABC):
    """The floating-point format of a batch in lanes."""

    bits: ClassVar[int]
    note: ClassVar[str] = ""
    """A remark for the reader of the results; empty where there is none."""

    @property
    def number(self) -> LlvmType:
        """The LLVM type of a vector of lanes."""
        return LlvmType(self.bits, BITS // self.bits)

    @property
    def dtype(self) -> Any:
        """The type of the numbers of an array."""
        return np.float64 if self.bits == 64 else np.float32


@dataclasses.dataclass(frozen=True)
class Double(Precision):
    """Double precision, sixteen digits; the default."""

    bits: ClassVar[int] = 64


@dataclasses.dataclass(frozen=True)
class Single(Precision):
    """Single precision, seven digits: half the memory and about twice as fast, for integrators of
    fixed step.
    """

    bits: ClassVar[int] = 32
    note: ClassVar[str] = (
        "single precision: rounding errors accumulate over a run; expect about four correct digits"
    )


class LaneArrays(abc.ABC):
    """The arrays of one thread for a block of lanes; it owns them as long as a kernel uses their
    addresses.

    more  sizes of further arrays after those of the step: parameters, what it needs of them, states
          (two), inputs, their start and slopes, length, outputs
    """

    def __init__(self, job: BatchJob, precision: Precision, more: tuple[int, ...] = ()) -> None:
        number = precision.number
        sizes = job.compiled.sizes
        integrator = job.integrator
        assert isinstance(integrator, ExplicitRungeKutta)
        self.job = job
        self.step = integrator.step
        self.width = number.lanes
        self.addresses, prepared_numbers = job.compiled.program.lanes(integrator.tableau(), number)
        n = sizes.states
        m = sizes.inputs
        lengths = (sizes.parameters, prepared_numbers, n, n, m, m, m, 1, sizes.outputs, *more)
        self.arrays = [aligned_array((length, self.width), precision.dtype) for length in lengths]
        self.arrays[0][:] = job.compiled.parameters[:, None]
        self.status = np.empty(self.width, dtype=np.int64)

    @property
    @abc.abstractmethod
    def kernel(self) -> BoundKernel:
        """The kernel with the arrays of this block."""

    @abc.abstractmethod
    def write(self, plants: Plants) -> None:
        """Write the results of one block of plants."""

    def run(self, plants: Plants, lane: Plants) -> None:
        """Simulate one block of plants, of which `lane` names one for each lane."""
        self.load(lane)
        if self.kernel() != Status.INTERRUPTED:
            self.write(plants)

    def load(self, lane: Plants) -> None:
        """Take over the parameters that differ, and the initial states, of one plant a lane."""
        job = self.job
        self.arrays[0][job.variations.places] = job.variations.values[lane].T
        self.arrays[2][:] = job.initial_states[lane].T

    def finish(self, plants: Plants, final: npt.NDArray[Any]) -> None:
        """Write the final states (W, n) and the status of plants.

        A plant that failed in its lane is simulated again, alone: for its rows, the time of failure
        and the reason.
        """
        job = self.job
        status = self.status[: plants.size]
        job.final[plants], job.status[plants], job.reached[plants] = (
            final[: plants.size],
            status,
            job.times.size,
        )
        where = (
            "in single precision, but not in double"
            if final.dtype == np.float32
            else "in its lane, but not alone"
        )
        for i in np.flatnonzero(status):
            index = int(plants[i])
            failure = Status(int(status[i]))
            job.run_single(index)
            if job.status[index] == Status.DONE:
                job.mark_not_run(index, failure, f"{failure.message} {where}")


class LaneBlock(LaneArrays):
    """A block of plants, each with its own segments and steps."""

    def __init__(
        self, job: BatchJob, precision: Precision, table: "SegmentTable", stop: Flag
    ) -> None:
        super().__init__(job, precision)
        self.table = table
        self.stop = stop
        width = self.width
        dtype = precision.dtype
        self.bounded = np.flatnonzero(np.isfinite(job.lower_bounds)).astype(np.int64)
        """States with a lower bound; their rows are checked after the run and not stored."""
        self.kept = np.concatenate([job.kept, self.bounded])
        self.rows = np.empty((self.kept.size, width, job.times.size), dtype)
        self.final = np.empty((width, job.compiled.sizes.states), dtype)
        self.counters = (
            np.empty(width, np.int64),
            np.empty(width, np.int64),
            *(np.empty(width) for _ in range(3)),
        )

        self.first, self.last = np.empty(width, np.int64), np.empty(width, np.int64)

    @functools.cached_property
    def kernel(self) -> BoundKernel:
        return lanes.bind(
            *self.addresses,
            *self.arrays,
            self.table.ends,
            self.table.values,
            self.table.slopes,
            self.first,
            self.last,
            self.job.start_time,
            self.step,
            self.job.times,
            self.kept,
            self.rows,
            self.final,
            self.status,
            self.stop,
            *self.counters,
        )

    def load(self, lane: Plants) -> None:
        super().load(lane)
        self.first[:] = self.table.first[lane]
        self.last[:] = self.table.last[lane]

    def write(self, plants: Plants) -> None:
        job = self.job
        for j, column in enumerate(job.columns.values()):
            column[plants] = self.rows[j, : plants.size]
        below = (self.final < job.lower_bounds).any(axis=1)
        for rows, i in zip(self.rows[len(job.columns) :], self.bounded, strict=True):
            below |= (rows < job.lower_bounds[i]).any(axis=1)
        self.status[below] = Status.NEGATIVE_AIR_MASS
        self.finish(plants, self.final)


class LoopLaneBlock(LaneArrays):
    """A block of control loops, whose sampling instants and segments are the same."""

    def __init__(self, job: BatchJob, stop: Flag) -> None:
        first = job.loop_of(0)
        assert first.law is not None
        law = first.law
        memory = len(first.law.initial_memory)
        k = len(law.measured_columns)
        s = len(law.setpoints)
        c = len(law.inputs)
        super().__init__(job, Double(), (first.parameters.size, memory, memory, k, s, c, c, c, 1))
        self.first = first
        self.stop = stop
        self.prepared = first.prepared
        width = self.width
        m = job.compiled.sizes.inputs
        self.sample = compiled_sample(law, width)
        intervals = self.prepared.instants.size - 1
        segments = self.prepared.inputs.ends.size
        self.setpoints = np.empty((intervals, s, width))
        self.values, self.slopes = np.empty((segments, m, width)), np.empty((segments, m, width))
        self.samples, self.commands = (
            np.empty((intervals, k, width)),
            np.empty((intervals, c, width)),
        )
        self.kept = job.kept[job.kept < job.own]
        self.rows = np.empty((self.kept.size, width, job.times.size))
        self.starts = self.prepared.inputs.starts(job.start_time)
        self.row_segment = intervals_of(job.times, self.starts)

    def load(self, lane: Plants) -> None:
        super().load(lane)
        job = self.job
        if len(job.loops) == 1:
            self._load_loop(self.first, slice(None))
        else:
            for i, plant in enumerate(lane.tolist()):
                self._load_loop(job.loop_of(plant), slice(i, i + 1))
        if job.laws is not None:
            self.arrays[9][job.laws.places] = job.laws.values[lane].T
        self.arrays[4][:] = self.values[0]

    def _load_loop(self, loop: CompiledLoop, places: slice) -> None:
        """Take over one loop into these lanes."""
        law = loop.law
        assert law is not None
        prepared = loop.prepared
        inputs = prepared.inputs
        sample_time, lowest, highest, _ = loop.commanding
        initial_memory = np.array(list(law.initial_memory.values()))
        parameters, memory, _, _, _, _, low, high, period = self.arrays[9:]
        parameters[:, places] = loop.parameters[:, None]
        memory[:, places] = initial_memory[:, None]
        self.setpoints[:, :, places] = prepared.setpoint_values[..., None]
        self.values[:, :, places] = inputs.values[..., None]
        self.slopes[:, :, places] = inputs.slopes[..., None]
        period[:, places] = sample_time
        low[:, places] = lowest[:, None]
        high[:, places] = highest[:, None]

    @functools.cached_property
    def kernel(self) -> BoundKernel:
        prepared = self.prepared
        return loop_lanes.bind(
            *self.addresses,
            self.sample.address,
            *self.arrays,
            prepared.instants,
            self.setpoints,
            prepared.first_segments,
            self.starts,
            prepared.inputs.ends,
            self.values,
            self.slopes,
            self.step,
            self.first.measuring[1],
            self.first.commanding[3],
            self.job.lower_bounds,
            self.job.times,
            self.row_segment,
            self.kept,
            self.rows,
            self.samples,
            self.commands,
            self.status,
            self.stop,
        )

    def write(self, plants: Plants) -> None:
        job = self.job
        rows_of_plants = iter(self.rows)
        for place, (name, column) in zip(job.kept.tolist(), job.columns.items(), strict=True):
            column[plants] = (
                next(rows_of_plants)[: plants.size]
                if place < job.own
                else self._of_loop(name, plants)
            )
        self.finish(plants, self.arrays[2].T)

    def _of_loop(self, name: str, plants: Plants) -> Array:
        """A column (R, T) of the set points, measurements or commands of plants."""
        signals = self.job.loops[0].signals
        prefix = next(signal_prefix for signal_prefix in signals if name.startswith(signal_prefix))
        index = signals[prefix].index(name.removeprefix(prefix))
        if prefix == SETPOINT:
            return np.array(
                [self.job.loop_of(i).prepared.at_times[1][:, index] for i in plants.tolist()]
            )
        at = np.minimum(self.prepared.at_times[0], len(self.samples) - 1)
        return np.asarray(
            (self.samples if prefix == MEASURED else self.commands)[at, index, : plants.size].T
        )


class SegmentTable:
    """The segments of all plants, one after the other, and the range of those of each; equal inputs
    share theirs.
    """

    def __init__(self, job: BatchJob) -> None:
        by_identity = {id(segments): segments for segments in job.segments}
        distinct = list(by_identity.values())
        number = {identity: i for i, identity in enumerate(by_identity)}
        self.ends = np.concatenate([segments.ends for segments in distinct])
        values = np.concatenate([segments.values for segments in distinct])
        self.values = np.ascontiguousarray(values)
        slopes = np.concatenate([segments.slopes for segments in distinct])
        self.slopes = np.ascontiguousarray(slopes)
        lengths = [segments.ends.size for segments in distinct]
        ends = np.cumsum(lengths)
        starts = np.append(0, ends)
        signal_of_plant = np.array([number[id(segments)] for segments in job.segments])
        self.first = starts[signal_of_plant]
        self.last = ends[signal_of_plant]


def lane_workers(
    job: BatchJob, active: Plants, precision: Precision, cores: int
) -> tuple[Queue, list[Callable[[int], Any]], int] | None:
    """The queue of blocks of the active plants, one worker per core, and the number of plants in a
    block.

    Unused lanes repeat the last plant. None where these plants are computed one by one.
    """
    if not isinstance(job.integrator, ExplicitRungeKutta) or (
        job.loops and not run_in_lanes(job, active)
    ):
        return None
    width = precision.number.lanes
    count = -(-active.size // width)
    queue = Queue(count)
    make: Callable[[], LaneArrays] = functools.partial(LoopLaneBlock, job, queue.stop)
    if not job.loops:
        table = SegmentTable(job)
        make = functools.partial(LaneBlock, job, precision, table, queue.stop)

    def worker(block: LaneArrays) -> Callable[[int], Any]:
        def run(i: int) -> None:
            places = np.arange(i * width, (i + 1) * width)
            lane = active[np.minimum(places, active.size - 1)]
            block.run(lane[: active.size - i * width], lane)

        return run

    return queue, [worker(make()) for _ in range(min(cores, count))], width


def run_in_lanes(job: BatchJob, plants: Plants) -> bool:
    """Whether the loops of these plants can be computed in lanes: control laws of one structure, no
    drivers, common sampling instants and segments, and at most MAX_SAMPLES samples."""
    distinct = {id(loop): loop for loop in job.loops}.values()
    if any(loop.drivers or not isinstance(loop.controller, ControlLaw) for loop in distinct):
        return False
    structure = tree.structure(job.loops[0].controller)
    sample_time = job.loops[0].sample_time
    if any(
        tree.structure(o.controller) is not structure or o.sample_time != sample_time
        for o in distinct
    ):
        return False
    first = job.loop_of(int(plants[0])).prepared
    if first.instants.size > MAX_SAMPLES:
        return False
    ends = first.inputs.ends
    return all(np.array_equal(job.prepared(loop).prepared.inputs.ends, ends) for loop in distinct)
