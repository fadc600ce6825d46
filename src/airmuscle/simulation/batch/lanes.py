"""Plants in lanes: blocks of them through the printed step together, a thread a core."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.errors import ParameterError
from ..integrators import LESS_THAN_NONE, NOT_FINITE, REASONS, ExplicitRungeKutta
from .job import BatchJob
from .precision import Precision
from .thread_pool import Queue

ALIGNMENT = 64
"""Bytes: what the printed loads and stores state."""


class LaneBlock:
    """The arrays of one thread, in which a block of lanes is run; it owns them as long as a kernel knows them."""

    def __init__(self, task: BatchJob, precision: Precision) -> None:
        number, sizes = precision.number, task.ready.sizes
        self.kind = np.float64 if number.bits == 64 else np.float32
        assert isinstance(task.method, ExplicitRungeKutta)
        self.addresses, held = task.ready.program.lanes(*task.method.tableau(), number)
        n, m, width = sizes.states, sizes.inputs, number.lanes
        lengths = (sizes.parameters, held, n, n, m, m, m, 1, sizes.outputs)
        self.arrays = aligned(lengths, width, self.kind)
        self.chosen = np.concatenate([task.chosen, _air(task)])
        self.rows = np.empty((self.chosen.size, width, task.times.size), self.kind)
        self.final = np.empty((width, n), self.kind)
        self.status = np.empty(width, dtype=np.int64)
        self.width = width


def _air(task: BatchJob) -> npt.NDArray[np.int64]:
    """States that may not be less than none; their rows are judged, and forgotten."""
    return np.flatnonzero(np.isfinite(task.lower_bounds)).astype(np.int64)


def aligned(lengths: tuple[int, ...], width: int, kind: Any) -> list[npt.NDArray[Any]]:
    """Arrays (length, width), each beginning at a multiple of ALIGNMENT bytes; empty ones have an address too."""
    size = np.dtype(kind).itemsize
    room = np.zeros((sum(lengths) + len(lengths)) * width * size + ALIGNMENT * (len(lengths) + 1), np.uint8)
    place, found = -room.ctypes.data % ALIGNMENT, []
    for length in lengths:
        found.append(room[place : place + length * width * size].view(kind).reshape(length, width))
        place += -(-length * width * size // ALIGNMENT) * ALIGNMENT
    return found


class PiecewiseLinearTable:
    """The segments of all plants, one after the other, and where those of each stand; equal commands share theirs."""

    def __init__(self, task: BatchJob) -> None:
        of_object = {id(segments): segments for segments in task.segments}
        different, number = list(of_object.values()), {key: i for i, key in enumerate(of_object)}
        self.ends = np.concatenate([s.ends for s in different])
        self.values = np.ascontiguousarray(np.concatenate([s.values for s in different]))
        self.slopes = np.ascontiguousarray(np.concatenate([s.slopes for s in different]))
        ends = np.cumsum([s.ends.size for s in different])
        mine = np.array([number[key] for key in map(id, task.segments)])
        self.first, self.last = np.append(0, ends)[mine], ends[mine]


def blocks(
    task: BatchJob, precision: Precision, active: npt.NDArray[np.intp], cores: int
) -> tuple[Queue, list[Callable[[int], Any]], int]:
    """The queue of blocks of the active plants, a worker a core, and how many plants a piece of work has."""
    from ...compile.cache.announce import announce_compilation
    from ...compile.kernels.lanes import lanes

    announce_compilation(lanes)
    table, first = PiecewiseLinearTable(task), LaneBlock(task, precision)
    pieces = -(-active.size // first.width)
    queue = Queue(pieces)
    rooms = [first, *(LaneBlock(task, precision) for _ in range(min(cores, pieces) - 1))]

    def worker(room: LaneBlock) -> Callable[[int], Any]:
        return lambda piece: _run(task, table, room, active[piece * room.width : (piece + 1) * room.width], queue.stop)

    return queue, [worker(room) for room in rooms], first.width


def _run(
    task: BatchJob,
    table: PiecewiseLinearTable,
    room: LaneBlock,
    plants: npt.NDArray[np.intp],
    stop: npt.NDArray[np.int64],
) -> None:
    """One block: parameters and starts in, rows and ends out. Lanes that are left over repeat its last plant."""
    from ...compile.kernels.lanes import INTERRUPTED, lanes

    method, variations = task.method, task.variations
    assert isinstance(method, ExplicitRungeKutta)
    lane_of = np.concatenate([plants, np.full(room.width - plants.size, plants[-1], dtype=np.intp)])
    p, y = room.arrays[0], room.arrays[2]
    p[:] = task.ready.parameters[:, None]
    p[variations.places] = variations.values[lane_of].T
    y[:] = task.starts[lane_of].T
    ended = lanes(
        *room.addresses, *room.arrays, table.ends, table.values, table.slopes, table.first[lane_of],
        table.last[lane_of], task.begin, method.step, task.times, room.chosen, room.rows, room.final, room.status,
        stop,
    )  # fmt: skip
    if ended == INTERRUPTED:
        return
    for j, column in enumerate(task.columns.values()):
        column[plants] = room.rows[j, : plants.size]
    task.final[plants] = room.final[: plants.size]
    task.status[plants], task.reached[plants] = room.status[: plants.size], task.times.size
    least = task.lower_bounds
    airless: npt.NDArray[np.bool_] = np.any(task.final[plants] < least, axis=1)
    for rows, i in zip(room.rows[len(task.columns) :], _air(task), strict=True):
        airless |= np.any(rows[: plants.size] < least[i], axis=1)
    for index, without_air in zip(plants, airless, strict=True):
        if without_air or task.status[index]:
            _explain(task, int(index), room.kind, LESS_THAN_NONE if without_air else NOT_FINITE)


def _explain(task: BatchJob, index: int, kind: Any, status: int) -> None:
    """A plant that failed in its lane is run again alone, for the rows that it reached, the time and the reason."""
    task.run_single(index)
    if task.status[index] == 0:
        what = "in single precision, though not in double" if kind == np.float32 else "in its lane, though not alone"
        task.mark_not_run(index, status, f"{REASONS[status]} {what}")


def check_precision(precision: Precision, task_method: object) -> None:
    """Raise ParameterError for a precision that a method cannot compute in."""
    if precision.number.bits != 64 and not isinstance(task_method, ExplicitRungeKutta):
        raise ParameterError(
            f"simulate_batch: {type(task_method).__name__} chooses its steps in double precision; {precision} goes "
            "with methods of fixed step, as RungeKutta4(1e-3)."
        )
