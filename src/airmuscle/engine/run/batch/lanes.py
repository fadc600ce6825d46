"""Lanes: blocks of plants through one vectorised step together, one thread per core, in single or double precision."""

import abc
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ....core import ParameterError, Status
from ...compile.cache.kernel import aligned_array, lanes
from ...compile.llvm.emit import LlvmType
from ..integrators import ExplicitRungeKutta
from .job import BatchJob, Queue


class LaneBlock:
    """The arrays of one thread for a block of lanes; it owns them as long as a kernel uses their addresses."""

    def __init__(self, job: BatchJob, precision: "Precision", table: "SegmentTable") -> None:
        number, sizes = precision.number, job.compiled.sizes
        self.job, self.table, self.dtype = job, table, precision.dtype
        assert isinstance(job.integrator, ExplicitRungeKutta)
        self.step = job.integrator.step
        self.addresses, precomputed = job.compiled.program.lanes(job.integrator.tableau(), number)
        n, m, width = sizes.states, sizes.inputs, number.lanes
        lengths = (sizes.parameters, precomputed, n, n, m, m, m, 1, sizes.outputs)
        self.arrays = [aligned_array((length, width), self.dtype) for length in lengths]
        self.bounded = np.flatnonzero(np.isfinite(job.lower_bounds)).astype(np.int64)
        """States with a lower bound; their rows are checked after the run and not stored."""
        self.kept = np.concatenate([job.kept, self.bounded])
        self.rows = np.empty((self.kept.size, width, job.times.size), self.dtype)
        self.final = np.empty((width, n), self.dtype)
        self.status = np.empty(width, dtype=np.int64)
        self.counters = (np.empty(width, np.int64), np.empty(width, np.int64), *(np.empty(width) for _ in range(3)))
        self.width = width

    def run(self, plants: npt.NDArray[np.intp], lane: npt.NDArray[np.intp], stop: npt.NDArray[np.int64]) -> None:
        """Simulate one block of plants, of which `lane` names one for each lane."""
        job, table = self.job, self.table
        load_plants(job, self.arrays, lane)
        ended = lanes(
            *self.addresses, *self.arrays, table.ends, table.values, table.slopes, table.first[lane], table.last[lane],
            job.start_time, self.step, job.times, self.kept, self.rows, self.final, self.status, stop,
            *self.counters,
        )  # fmt: skip
        if ended == Status.INTERRUPTED:
            return
        for j, column in enumerate(job.columns.values()):
            column[plants] = self.rows[j, : plants.size]
        below = (self.final < job.lower_bounds).any(axis=1)
        for rows, i in zip(self.rows[len(job.columns) :], self.bounded, strict=True):
            below |= (rows < job.lower_bounds[i]).any(axis=1)
        self.status[below] = Status.NEGATIVE_AIR_MASS
        finish_block(job, plants, self.final, self.status)


def load_plants(job: BatchJob, arrays: Sequence[npt.NDArray[Any]], lane: npt.NDArray[np.intp]) -> None:
    """Write parameters and initial states of one plant a lane into the first and third array of a block."""
    arrays[0][:] = job.compiled.parameters[:, None]
    arrays[0][job.variations.places] = job.variations.values[lane].T
    arrays[2][:] = job.initial_states[lane].T


class SegmentTable:
    """The segments of all plants, one after the other, and the range of those of each; equal inputs share theirs."""

    def __init__(self, job: BatchJob) -> None:
        by_identity = {id(segments): segments for segments in job.segments}
        distinct, number = list(by_identity.values()), {key: i for i, key in enumerate(by_identity)}
        self.ends = np.concatenate([s.ends for s in distinct])
        self.values = np.ascontiguousarray(np.concatenate([s.values for s in distinct]))
        self.slopes = np.ascontiguousarray(np.concatenate([s.slopes for s in distinct]))
        ends = np.cumsum([s.ends.size for s in distinct])
        own = np.array([number[key] for key in map(id, job.segments)])
        self.first, self.last = np.append(0, ends)[own], ends[own]


def block_workers(
    make: Callable[[], Any], active: npt.NDArray[np.intp], cores: int
) -> tuple[Queue, list[Callable[[int], Any]], int]:
    """The queue of blocks of the active plants, one worker per core, and the number of plants in a block.

    `make` makes a block, such as a `LaneBlock`. Unused lanes repeat its last plant.
    """
    first = make()
    count = -(-active.size // first.width)
    queue = Queue(count)

    def worker(block: Any) -> Callable[[int], Any]:
        def run(i: int) -> None:
            plants = active[i * block.width : (i + 1) * block.width]
            block.run(plants, np.pad(plants, (0, block.width - plants.size), "edge"), queue.stop)

        return run

    return queue, [worker(block) for block in (first, *(make() for _ in range(min(cores, count) - 1)))], first.width


def finish_block(
    job: BatchJob, plants: npt.NDArray[np.intp], final: npt.NDArray[Any], status: npt.NDArray[np.int64]
) -> None:
    """Write the final states (W, n) and the status (W,) of the plants of a block.

    A plant that failed in its lane is simulated again, alone: for its rows, the time of failure and the reason.
    """
    job.final[plants] = final[: plants.size]
    job.status[plants], job.reached[plants] = status[: plants.size], job.times.size
    where = "in single precision, but not in double" if final.dtype == np.float32 else "in its lane, but not alone"
    for i in np.flatnonzero(status[: plants.size]):
        index, failure = int(plants[i]), Status(int(status[i]))
        job.run_single(index)
        if job.status[index] == Status.DONE:
            job.mark_not_run(index, failure, f"{failure.message} {where}")


def check_precision(precision: "Precision", integrator: object, *, loops: bool) -> None:
    """Raise ParameterError for a precision in which an integrator or control loops cannot be computed."""
    if precision.bits != 64 and loops:
        raise ParameterError("simulate_batch: control loops are computed in double precision; omit the precision.")
    if precision.bits != 64 and not isinstance(integrator, ExplicitRungeKutta):
        raise ParameterError(
            f"simulate_batch: {type(integrator).__name__} chooses its steps in double precision; {precision} requires "
            "an integrator of fixed step, such as RungeKutta4(1e-3)."
        )


BITS = 1024
"""Size of a vector of lanes: two of the widest registers, which alternate."""


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
    """Single precision, seven digits: half the memory and about twice as fast, for integrators of fixed step."""

    bits: ClassVar[int] = 32
    note: ClassVar[str] = "single precision: rounding errors accumulate over a run; expect about four correct digits"
