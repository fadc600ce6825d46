"""Distribution of tasks on a Dask cluster: the time of a task that does nothing, and a study on two
workers and on one.
"""

from __future__ import annotations

import contextlib
import os
import pathlib
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from measure import Section, Target, format_time, print_section

from airmuscle.design import dask_cluster, load_study, result_store, run_study
from airmuscle.engine.distribution import DistributedCalls

TASKS = 10_000
RUNS = 1536
EXAMPLE = pathlib.Path(__file__).parents[1] / "examples"
HEADER = ("quantity", "one worker", "two workers", "ratio")
TEXT = (
    f"{TASKS} tasks that return a number, and a study of {RUNS} runs (`examples/valve_study.toml`"
    " with 256 base points), each on a LocalCluster of one and of two worker processes with one"
    " thread, which are warm: a first study compiles its kernels. Results are stored as by the"
    " commands. Other load on the cores lowers the ratio, because two workers and the scheduler"
    " need more than one core: the last row is what the machine gives at the same time to a loop in"
    " two plain processes, of which the study should have 0.85, 1.7 of 2."
)
LOOPS = 60_000_000
"""Steps of the loop in plain processes, some seconds."""


def empty_task(scale: float, number: int) -> float:
    """A product."""
    return scale * number


@contextlib.contextmanager
def workers(count: int) -> Iterator[Executor]:
    """A cluster of this number of workers."""
    with tempfile.TemporaryDirectory() as name:
        file = pathlib.Path(name) / "cluster.toml"
        file.write_text(
            f'class = "dask.distributed.LocalCluster"\nworkers = {count}\n[arguments]\n'
            'threads_per_worker = 1\ndashboard_address = ":0"\n',
            encoding="utf-8",
        )
        with dask_cluster(file) as executor:
            yield executor


def time_of_tasks(executor: Executor, folder: pathlib.Path) -> float:
    """Time [s] of all empty tasks with a store of their results."""
    begin = time.perf_counter()
    with result_store(folder):
        results = DistributedCalls(executor, empty_task, 2.0).results(range(TASKS))
    seconds = time.perf_counter() - begin
    assert results == [2.0 * number for number in range(TASKS)]
    return seconds


def counted_loop(steps: int) -> int:
    """A loop of Python, which one core does alone."""
    total = 0
    for number in range(steps):
        total += number & 1
    return total


def time_of_loop(pool: Executor, count: int) -> float:
    """Time [s] of the loop in this number of processes, each with its share."""
    begin = time.perf_counter()
    list(pool.map(counted_loop, [LOOPS // count] * count))
    return time.perf_counter() - begin


def write_study(folder: pathlib.Path) -> pathlib.Path:
    """The study of the example with RUNS runs."""
    text = (EXAMPLE / "valve_study.toml").read_text(encoding="utf-8")
    (folder / "fill_discharge.toml").write_bytes((EXAMPLE / "fill_discharge.toml").read_bytes())
    file = folder / "study.toml"
    file.write_text(text.replace("count = 64", f"count = {RUNS // 6}"), encoding="utf-8")
    return file


def time_of_study(executor: Executor, file: pathlib.Path, out: pathlib.Path) -> float:
    """Time [s] of a study."""
    study = load_study(file)
    begin = time.perf_counter()
    run_study(study, out, executor)
    return time.perf_counter() - begin


def section(rounds: int = 1) -> Section:
    """The complete benchmark."""
    tasks: dict[int, list[float]] = {1: [], 2: []}
    studies: dict[int, list[float]] = {1: [], 2: []}
    loops: dict[int, list[float]] = {1: [], 2: []}
    with (
        tempfile.TemporaryDirectory() as name,
        workers(1) as one,
        workers(2) as two,
        ProcessPoolExecutor(2) as pool,
    ):
        folder = pathlib.Path(name)
        file = write_study(folder)
        for count, executor in ((1, one), (2, two)):
            time_of_study(executor, file, folder / f"warm{count}")
        list(pool.map(counted_loop, [1, 1]))  # both processes start
        for number in range(rounds):
            for count, executor in ((1, one), (2, two)):
                loops[count].append(time_of_loop(pool, count))
                tasks[count].append(time_of_tasks(executor, folder / f"tasks{count}-{number}"))
                studies[count].append(time_of_study(executor, file, folder / f"{count}-{number}"))
    rows = (
        row_of(f"{TASKS} empty tasks", tasks),
        row_of(f"study of {RUNS} runs", studies),
        row_of("a loop in plain processes", loops),
    )
    of_a_task = 1e3 * min(tasks[2]) / TASKS
    ratio = float(np.median(np.divide(studies[1], studies[2])))
    possible = float(np.median(np.divide(loops[1], loops[2])))
    targets = (
        Target(f"cluster: a task of {TASKS}", of_a_task, 5.0, "ms"),
        Target(f"cluster: one worker / two workers, study of {RUNS} runs", ratio, 1.7, "x", True),
        Target("cluster: this ratio / that of plain processes", ratio / possible, 0.85, "x", True),
    )
    return Section("Distribution on a cluster", TEXT, HEADER, rows, targets)


def row_of(name: str, times: dict[int, list[float]]) -> tuple[str, ...]:
    """Medians of the times, and their ratio."""
    ratio = float(np.median(np.divide(times[1], times[2])))
    cells = (format_time(float(np.median(times[count]))) for count in (1, 2))
    return (name, *cells, f"{ratio:.2f}")


if __name__ == "__main__":
    print_section(section())
