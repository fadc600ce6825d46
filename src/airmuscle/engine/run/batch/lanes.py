"""Lanes: blocks of plants or control loops through one vectorised step together, one thread per
core.

Plants are computed in single or double precision, loops in double precision.
"""

import abc
import dataclasses
import functools
from collections.abc import Callable, Mapping
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

    more  lengths of further arrays beside those of the step, by the name of the kernel's argument
    """

    def __init__(self, job: BatchJob, precision: Precision, more: Mapping[str, int]) -> None:
        number = precision.number
        sizes = job.compiled.sizes
        integrator = job.integrator
        assert isinstance(integrator, ExplicitRungeKutta)
        self.job = job
        self.step = integrator.step
        self.width = number.lanes
        addresses, prepared_numbers = job.compiled.program.lanes(integrator.tableau(), number)
        self.addresses = dict(zip(("prepare", "step", "outputs"), addresses, strict=True))
        lengths = {
            "p": sizes.parameters,
            "c": prepared_numbers,
            "y": sizes.states,
            "other": sizes.states,
            "u": sizes.inputs,
            "base": sizes.inputs,
            "w": sizes.inputs,
            "h": 1,
            "o": sizes.outputs,
            **more,
        }
        self.arrays = {
            name: aligned_array((length, self.width), precision.dtype)
            for name, length in lengths.items()
        }
        """The arrays in lanes by the names of the kernel's arguments: parameters, what the step
        needs of them, states (two), inputs, their start and slopes, length, outputs, and more.
        """
        self.arrays["p"][:] = job.compiled.parameters[:, None]
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
        self.arrays["p"][job.variations.places] = job.variations.values[lane].T
        self.arrays["y"][:] = job.initial_states[lane].T

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
        super().__init__(job, precision, {})
        self.table = table
        self.stop = stop
        width = self.width
        dtype = precision.dtype
        self.bounded = np.flatnonzero(np.isfinite(job.lower_bounds)).astype(np.int64)
        """States with a lower bound; their rows are checked after the run and not stored."""
        self.kept = np.concatenate([job.kept, self.bounded])
        self.rows = np.empty((self.kept.size, width, job.times.size), dtype)
        self.final = np.empty((width, job.compiled.sizes.states), dtype)
        self.first = np.empty(width, np.int64)
        self.last = np.empty(width, np.int64)

    @functools.cached_property
    def kernel(self) -> BoundKernel:
        return lanes.bind(
            **self.addresses,
            **self.arrays,
            ends=self.table.ends,
            values=self.table.values,
            slopes=self.table.slopes,
            first=self.first,
            last=self.last,
            begin=self.job.start_time,
            length=self.step,
            times=self.job.times,
            chosen=self.kept,
            rows=self.rows,
            final=self.final,
            status=self.status,
            stop=self.stop,
            segment=np.empty(self.width, np.int64),
            ended=np.empty(self.width, np.int64),
            done=np.empty(self.width),
            total=np.empty(self.width),
            start=np.empty(self.width),
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
        lengths = {
            "parameters": first.parameters.size,
            "memory": memory,
            "later": memory,
            "measured": k,
            "setpoint": s,
            "command": c,
            "low": c,
            "high": c,
            "period": 1,
        }
        super().__init__(job, Double(), lengths)
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
            self.arrays["parameters"][job.laws.places] = job.laws.values[lane].T
        self.arrays["u"][:] = self.values[0]

    def _load_loop(self, loop: CompiledLoop, places: slice) -> None:
        """Take over one loop into these lanes."""
        law = loop.law
        assert law is not None
        prepared = loop.prepared
        inputs = prepared.inputs
        arrays = self.arrays
        initial_memory = np.array(list(law.initial_memory.values()))
        arrays["parameters"][:, places] = loop.parameters[:, None]
        arrays["memory"][:, places] = initial_memory[:, None]
        self.setpoints[:, :, places] = prepared.setpoint_values[..., None]
        self.values[:, :, places] = inputs.values[..., None]
        self.slopes[:, :, places] = inputs.slopes[..., None]
        for name in ("period", "low", "high"):
            arrays[name][:, places] = loop.arguments[name][:, None]

    @functools.cached_property
    def kernel(self) -> BoundKernel:
        prepared = self.prepared
        return loop_lanes.bind(
            **self.addresses,
            **self.arrays,
            sample=self.sample.address,
            edges=prepared.instants,
            setpoints=self.setpoints,
            first=prepared.first_segments,
            starts=self.starts,
            ends=prepared.inputs.ends,
            values=self.values,
            slopes=self.slopes,
            length=self.step,
            measured_at=self.first.arguments["measured_at"],
            commanded_at=self.first.arguments["commanded_at"],
            bounds=self.job.lower_bounds,
            times=self.job.times,
            row_segment=self.row_segment,
            chosen=self.kept,
            rows=self.rows,
            samples=self.samples,
            commands=self.commands,
            status=self.status,
            stop=self.stop,
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
        self.finish(plants, self.arrays["y"].T)

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
