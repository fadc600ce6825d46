"""Lanes: blocks of plants through one vectorised step together, one thread per core, in single or double precision."""

import abc
import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ....core import ParameterError, Status
from ...compile.cache.kernel import lanes
from ...compile.llvm.emit import LlvmType
from ..integrators import ExplicitRungeKutta
from .job import BatchJob, Queue

ALIGNMENT = 64
"""Alignment of vectors in memory, in bytes."""


class LaneBlock:
    """The arrays of one thread for a block of lanes; it owns them as long as a kernel uses their addresses."""

    def __init__(self, job: BatchJob, precision: "Precision") -> None:
        number, sizes = precision.number, job.compiled.sizes
        self.dtype = np.float64 if number.bits == 64 else np.float32
        assert isinstance(job.integrator, ExplicitRungeKutta)
        self.addresses, precomputed = job.compiled.program.lanes(job.integrator.tableau(), number)
        n, m, width = sizes.states, sizes.inputs, number.lanes
        lengths = (sizes.parameters, precomputed, n, n, m, m, m, 1, sizes.outputs)
        self.arrays = aligned_arrays(lengths, width, self.dtype)
        self.kept = np.concatenate([job.kept, _bounded_states(job)])
        self.rows = np.empty((self.kept.size, width, job.times.size), self.dtype)
        self.final = np.empty((width, n), self.dtype)
        self.status = np.empty(width, dtype=np.int64)
        self.counters = (np.empty(width, np.int64), np.empty(width, np.int64), *(np.empty(width) for _ in range(3)))
        self.width = width


def _bounded_states(job: BatchJob) -> npt.NDArray[np.int64]:
    """States with a lower bound; their rows are checked after the run and not stored."""
    return np.flatnonzero(np.isfinite(job.lower_bounds)).astype(np.int64)


def aligned_arrays(lengths: tuple[int, ...], width: int, dtype: Any) -> list[npt.NDArray[Any]]:
    """Arrays (length, width), each at a multiple of ALIGNMENT bytes; empty ones have an address too."""
    size = np.dtype(dtype).itemsize
    room = np.zeros((sum(lengths) + len(lengths)) * width * size + ALIGNMENT * (len(lengths) + 1), np.uint8)
    place, arrays = -room.ctypes.data % ALIGNMENT, []
    for length in lengths:
        arrays.append(room[place : place + length * width * size].view(dtype).reshape(length, width))
        place += -(-length * width * size // ALIGNMENT) * ALIGNMENT
    return arrays


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


def lane_workers(
    job: BatchJob, precision: "Precision", active: npt.NDArray[np.intp], cores: int
) -> tuple[Queue, list[Callable[[int], Any]], int]:
    """The queue of blocks of the active plants, one worker per core, and the number of plants in a block."""
    table, first = SegmentTable(job), LaneBlock(job, precision)
    count = -(-active.size // first.width)
    queue = Queue(count)
    blocks = [first, *(LaneBlock(job, precision) for _ in range(min(cores, count) - 1))]

    def worker(block: LaneBlock) -> Callable[[int], Any]:
        return lambda i: _run(job, table, block, active[i * block.width : (i + 1) * block.width], queue.stop)

    return queue, [worker(block) for block in blocks], first.width


def _run(
    job: BatchJob, table: SegmentTable, block: LaneBlock, plants: npt.NDArray[np.intp], stop: npt.NDArray[np.int64]
) -> None:
    """Simulate one block. Unused lanes repeat its last plant."""
    integrator, variations = job.integrator, job.variations
    assert isinstance(integrator, ExplicitRungeKutta)
    lane = np.concatenate([plants, np.full(block.width - plants.size, plants[-1], dtype=np.intp)])
    p, y = block.arrays[0], block.arrays[2]
    p[:] = job.compiled.parameters[:, None]
    p[variations.places] = variations.values[lane].T
    y[:] = job.initial_states[lane].T
    ended = lanes(
        *block.addresses, *block.arrays, table.ends, table.values, table.slopes, table.first[lane], table.last[lane],
        job.start_time, integrator.step, job.times, block.kept, block.rows, block.final, block.status, stop,
        *block.counters,
    )  # fmt: skip
    if ended == Status.INTERRUPTED:
        return
    for j, column in enumerate(job.columns.values()):
        column[plants] = block.rows[j, : plants.size]
    job.final[plants] = block.final[: plants.size]
    job.status[plants], job.reached[plants] = block.status[: plants.size], job.times.size
    bounds = job.lower_bounds
    below: npt.NDArray[np.bool_] = np.any(job.final[plants] < bounds, axis=1)
    for rows, i in zip(block.rows[len(job.columns) :], _bounded_states(job), strict=True):
        below |= np.any(rows[: plants.size] < bounds[i], axis=1)
    for index, negative in zip(plants, below, strict=True):
        if negative or job.status[index]:
            retry_alone(job, int(index), block.dtype, Status.NEGATIVE_AIR_MASS if negative else Status.NOT_FINITE)


def retry_alone(job: BatchJob, index: int, dtype: Any, status: Status) -> None:
    """Simulate a plant that failed in its lane again, alone: for its rows, the time of failure and the reason."""
    job.run_single(index)
    if job.status[index] == Status.DONE:
        where = "in single precision, but not in double" if dtype == np.float32 else "in its lane, but not alone"
        job.mark_not_run(index, status, f"{status.message} {where}")


def check_precision(precision: "Precision", integrator: object, *, loops: bool) -> None:
    """Raise ParameterError for a precision in which an integrator or control loops cannot be computed."""
    if precision.number.bits != 64 and loops:
        raise ParameterError("simulate_batch: control loops are computed in double precision; omit the precision.")
    if precision.number.bits != 64 and not isinstance(integrator, ExplicitRungeKutta):
        raise ParameterError(
            f"simulate_batch: {type(integrator).__name__} chooses its steps in double precision; {precision} requires "
            "an integrator of fixed step, such as RungeKutta4(1e-3)."
        )


BITS = 1024
"""Size of a vector of lanes: two of the widest registers, which alternate."""


class Precision(abc.ABC):
    """The floating-point format of a batch in lanes."""

    @property
    @abc.abstractmethod
    def number(self) -> LlvmType:
        """The LLVM type of a vector of lanes."""

    @property
    @abc.abstractmethod
    def note(self) -> str:
        """A remark for the reader of the results; empty where there is none."""


@dataclasses.dataclass(frozen=True)
class Double(Precision):
    """Double precision, sixteen digits; the default."""

    @property
    def number(self) -> LlvmType:
        return LlvmType(64, BITS // 64)

    @property
    def note(self) -> str:
        return ""


@dataclasses.dataclass(frozen=True)
class Single(Precision):
    """Single precision, seven digits: half the memory and about twice as fast, for integrators of fixed step."""

    @property
    def number(self) -> LlvmType:
        return LlvmType(32, BITS // 32)

    @property
    def note(self) -> str:
        return "single precision: rounding errors accumulate over a run; expect about four correct digits"
