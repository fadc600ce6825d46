"""Control benchmark of the antagonistic joint: all standard controllers on all truths, and the page
of their results.

    python benchmarks/control/control_benchmark.py [--quick] [--searches 3] [--on-off-searches 3]
        [--processes 2]
                                           [--results FOLDER] [--out PAGE]

Each controller is tuned by three searches, commissioned on every truth and judged there; the sealed
truth is one of them, so that it is run for the page alone. A controller with its searches and runs
is a file in the folder of the results: an interrupted run goes on where it was, as long as the
program and the settings are the same. `--quick` is a smaller form with one search on two truths of
development, for a look at a change.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import dataclasses
import hashlib
import os
import pickle
import sys
import time
from pathlib import Path

from contender_set import standard_contenders
from joint_models import on_off_joint, proportional_joint
from joint_truths import SEALED_SEED, TRUTH_SEEDS

import airmuscle
from airmuscle.design import (
    STANDARD_TASKS,
    ContenderResult,
    ControlComparison,
    JointRig,
    LearningCurve,
    compare_controllers,
    find_tasks,
    learn,
)
from airmuscle.design.control_comparison.commissioning import COMMISSIONING_RUNS, SETS_PER_GAIN

JOINTS = {"proportional": proportional_joint, "on/off": on_off_joint}
ON_OFF = ("PID", "feed-forward + PID", "feed-forward + sliding mode")
LEARNED = "feed-forward + PID"
PACKAGES = ("control", "core", "design", "engine", "physics")


@dataclasses.dataclass(frozen=True)
class Settings:
    """Truths, seeds of the searches, most sets of gains for each gain, and runs of a
    commissioning.
    """

    truths: tuple[int, ...]
    seeds: tuple[int, ...]
    sets_per_gain: int
    commissioning_runs: int
    slow: bool = True
    """Whether controllers that are called from Python take part."""


FULL = Settings((*TRUTH_SEEDS, SEALED_SEED), (1, 2, 3), SETS_PER_GAIN, COMMISSIONING_RUNS)
QUICK = Settings((1, 2), (1,), 12, 30, slow=False)


@dataclasses.dataclass(frozen=True)
class Part:
    """The contenders that share their searches, one after the other, with the CPU time [s]."""

    kind: str
    results: tuple[ContenderResult, ...]
    curve: LearningCurve | None
    cpu: float


def searches(joint: JointRig, kind: str, settings: Settings) -> list[tuple[str, ...]]:
    """The names of the contenders that share a search, the slow ones first."""
    groups: dict[str, list[str]] = {}
    for each in standard_contenders(joint):
        if (kind == "on/off" and each.name not in ON_OFF) or (each.tuned_as and not settings.slow):
            continue
        groups.setdefault((each.tuned_as or each).name, []).append(each.name)
    return sorted(map(tuple, groups.values()), key=len, reverse=True)


def measure(settings: Settings, folder: Path, processes: int, switched: int) -> list[Part]:
    """All parts, from their files where these exist; `switched` is the number of searches for
    on/off valves.
    """
    folder.mkdir(parents=True, exist_ok=True)
    jobs = []
    for kind, joint in JOINTS.items():
        count = switched if kind == "on/off" else len(settings.seeds)
        own = dataclasses.replace(settings, seeds=settings.seeds[:count])
        for names in searches(joint(settings.truths[:1]), kind, own):
            name = f"{kind}-{names[0]}-{fingerprint(own)}.pickle".replace("/", "-").replace(
                " ", "-"
            )
            jobs.append((kind, names, own, folder / name))
    waiting = [job for job in jobs if not job[-1].exists()]
    with concurrent.futures.ProcessPoolExecutor(processes) as pool:
        pending = [pool.submit(measure_part, *job) for job in waiting]
        for done, each in enumerate(concurrent.futures.as_completed(pending), 1):
            each.result()
            if sys.stderr.isatty():
                print(
                    f"\rcontrollers: {done} of {len(waiting)}".ljust(78),
                    end="",
                    file=sys.stderr,
                    flush=True,
                )
    return [pickle.loads(job[-1].read_bytes()) for job in jobs]


def measure_part(kind: str, names: tuple[str, ...], settings: Settings, path: Path) -> None:
    """Write the results of contenders that share their searches, complete or not at all."""
    started = time.process_time()
    joint = JOINTS[kind](settings.truths)
    contenders = [each for each in standard_contenders(joint) if each.name in names]
    found = compare_controllers(
        joint,
        contenders,
        STANDARD_TASKS,
        seeds=settings.seeds,
        sets_per_gain=settings.sets_per_gain,
        commissioning_runs=settings.commissioning_runs,
    ).results
    curve = None
    if (kind, names[0]) == ("proportional", LEARNED):
        curve = learn(
            joint, found[0], find_tasks(("sine 2 Hz",))[0], trials=31, seed=settings.seeds[0]
        )
    kept = tuple(map(without_recordings, found))
    staging = path.with_suffix(f".{os.getpid()}.part")
    staging.write_bytes(pickle.dumps(Part(kind, kept, curve, time.process_time() - started)))
    staging.replace(path)


def without_recordings(result: ContenderResult) -> ContenderResult:
    """A result whose runs have metrics alone."""
    return dataclasses.replace(
        result,
        runs={key: dataclasses.replace(run, recording=None) for key, run in result.runs.items()},
    )


def fingerprint(settings: Settings) -> str:
    """A text that changes with the settings and with the program."""
    digest = hashlib.sha256(repr(settings).encode())
    source = Path(airmuscle.__file__).parent
    of_program = (path for name in PACKAGES for path in sorted((source / name).rglob("*.py")))
    for path in (*of_program, *sorted(Path(__file__).parent.glob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def collect(parts: list[Part], settings: Settings) -> dict[str, ControlComparison]:
    """The results of both joints."""
    results = {}
    for kind, joint in JOINTS.items():
        order = [each.name for each in standard_contenders(joint(settings.truths[:1]))]
        found = [each for part in parts if part.kind == kind for each in part.results]
        found.sort(key=lambda each: (each.seed, order.index(each.name)))
        results[kind] = ControlComparison(joint(settings.truths), STANDARD_TASKS, tuple(found))
    return results


def main() -> None:
    """Measure and write the page."""
    from control_page import page

    here = Path(__file__).parent
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument(
        "--searches",
        type=int,
        default=len(FULL.seeds),
        help="of each controller (3); 1 for --quick",
    )
    parser.add_argument(
        "--on-off-searches", type=int, help="of those with on/off valves; the same unless given"
    )
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument(
        "--results", type=Path, default=here.parents[1] / "build" / "control_benchmark"
    )
    parser.add_argument(
        "--out", type=Path, help="default: CONTROL.md beside this file; of --quick in the results"
    )
    given = parser.parse_args()
    settings = (
        QUICK
        if given.quick
        else dataclasses.replace(FULL, seeds=tuple(range(1, given.searches + 1)))
    )
    out = given.out or (given.results / "quick.md" if given.quick else here / "CONTROL.md")
    parts = measure(
        settings, given.results, given.processes, given.on_off_searches or len(settings.seeds)
    )
    curve = next(part.curve for part in parts if part.curve)
    text = page(collect(parts, settings), curve, settings, sum(part.cpu for part in parts))
    staging = out.with_name(f".{out.name}.part")
    staging.write_text(text, encoding="utf-8")
    staging.replace(out)
    print(f"wrote {out}")


if __name__ == "__main__":
    main()
