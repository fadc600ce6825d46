"""Control benchmark of the antagonistic joint: all standard controllers, learning, on/off valves, and the targets.

    python benchmarks/control_benchmark.py [--budget 2400] [--seed 1] [--processes 1] [--out benchmarks/CONTROL.md]

Every controller is tuned with the same optimiser and budget for perturbed models and judged on the truth. Figures and
verdicts are computed; a reason is printed for a target that is missed.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import dataclasses
import pickle
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from control_page import FORWARD, ON_OFF, page

from airmuscle.design import (
    BenchmarkJoint,
    benchmark_controllers,
    find_tasks,
    inverse_dynamics,
    learn,
    on_off_joint,
    proportional_joint,
    ranking,
    standard_contenders,
)

JOINTS = {
    "proportional": proportional_joint,
    "on/off": on_off_joint,
}


def measure(budget: int, seed: int, processes: int) -> dict[str, Any]:
    """All results as plain data; the contenders do not depend on each other, and several are measured at once."""
    parts = [
        (kind, each.name, budget, seed)
        for kind, joint in JOINTS.items()
        for each in reversed(standard_contenders(joint()))
        if kind == "proportional" or each.name in ON_OFF
    ]
    with concurrent.futures.ProcessPoolExecutor(processes) as pool:
        pending = [pool.submit(measure_part, *part) for part in parts]
        for done, _ in enumerate(concurrent.futures.as_completed(pending), 1):
            _show("contenders", done, len(parts))
    results: dict[str, Any] = {
        "budget": budget,
        "seed": seed,
        "forward": forward_error(proportional_joint()),
    }
    for (kind, *_), each in zip(reversed(parts), (p.result() for p in reversed(pending)), strict=True):
        results |= each.pop("learning", {})
        into = results.setdefault(kind, {})
        for key, value in each.items():
            into[key] = {**into.get(key, {}), **value} if isinstance(value, dict) else value
    for kind in JOINTS:
        metrics, tasks = results[kind]["metrics"], results[kind]["tasks"]
        errors = {name: [(metrics[name, t] or {"rmse": np.nan})["rmse"] for t in tasks] for name, _ in metrics}
        results[kind]["scores"] = ranking(errors)
    return results


def measure_part(kind: str, name: str, budget: int, seed: int) -> dict[str, Any]:
    """The results of one contender, and for feed-forward and PID those of learning."""
    joint, started = JOINTS[kind](), time.process_time()
    (contender,) = (each for each in standard_contenders(joint) if each.name == name)
    result = benchmark_controllers(joint, [contender], budget=budget, seed=seed)
    found = _plain(result)
    if kind == "proportional" and name == FORWARD:
        curve = learn(joint, result.contenders[0], find_tasks(("sine 2 Hz",))[0], trials=31, seed=seed)
        errors = curve.errors.tolist()
        found["learning"] = {"learning": errors, "monotone": curve.is_monotone, "spread": curve.spread}
    return {**found, "cpu": {name: time.process_time() - started}}


def forward_error(joint: BenchmarkJoint) -> float:
    """Error of the feed-forward pressure [% of the pressure range]: model against truth without friction, slow sine."""
    (task,) = find_tasks(("sine 0.1 Hz",))
    time = np.arange(task.begin, task.duration, joint.sample_time)
    mean = np.full(time.size, joint.mean_pressure)
    ours, needed = (inverse_dynamics(joint, plant, task.motion, time, mean) for plant in (joint.model, joint.truth))
    span = joint.max_pressure - joint.min_pressure
    return 100.0 * float(np.sqrt(np.mean((ours - needed) ** 2))) / span


def _plain(result: Any) -> dict[str, Any]:
    joint: BenchmarkJoint = result.joint
    return {
        "valve": joint.valve,
        "tasks": [task.name for task in result.tasks],
        "gains": {each.name: {**each.tuning.gains, **each.identified} for each in result.contenders if each.tuning},
        "on bound": {each.name: dict(each.tuning.on_bound) for each in result.contenders if each.tuning},
        "limits": (joint.min_pressure / 1e5, joint.max_pressure / 1e5),
        "pressures": {
            key: pressure_range(joint, run.recording) for key, run in result.runs.items() if run.recording is not None
        },
        "metrics": {key: dataclasses.asdict(run.metrics) if run.metrics else None for key, run in result.runs.items()},
        "span": joint.pressure_span,
    }


def pressure_range(joint: BenchmarkJoint, recording: Any) -> tuple[float, float]:
    """Smallest and greatest true gauge pressure [bar] of both muscles in a run."""
    values = np.concatenate([np.asarray(recording[name]) for name in joint.pressures]) / 1e5
    return float(values.min()), float(values.max())


def _show(step: str, done: int, total: int) -> None:
    if sys.stderr.isatty():
        print(f"\r{step}: {done} of {total}".ljust(78), end="", file=sys.stderr, flush=True)


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--budget", type=int, default=2400)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("CONTROL.md"))
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="file for the results, from which --page writes the page again")
    parser.add_argument("--page", type=Path, help="such a file: nothing is measured")
    given = parser.parse_args()
    if given.page:
        results = pickle.loads(given.page.read_bytes())
    else:
        results = measure(given.budget, given.seed, given.processes)
    if given.keep:
        given.keep.write_bytes(pickle.dumps(results))
    staging = given.out.with_name(f".{given.out.name}.part")
    staging.write_text(page(results), encoding="utf-8")
    staging.replace(given.out)
    print(f"wrote {given.out}")


if __name__ == "__main__":
    main()
