"""Control benchmark of the antagonistic joint: all standard controllers, learning, on/off valves, and the targets.

    python benchmarks/control_benchmark.py [--budget 2400] [--seed 1] [--out benchmarks/CONTROL.md]

Every controller is tuned with the same optimiser and budget for perturbed models and judged on the truth. Figures and
verdicts are computed; a reason is printed for a target that is missed.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import Any

import numpy as np
from control_page import FORWARD, ON_OFF, page

from airmuscle.study.control_benchmark import (
    BenchmarkJoint,
    compare_controllers,
    find_tasks,
    inverse_dynamics,
    learn,
    on_off_joint,
    proportional_joint,
    standard_contenders,
)


def measure(budget: int, seed: int) -> dict[str, Any]:
    """All results as plain data."""
    return {"budget": budget, "seed": seed, **measure_proportional(budget, seed), **measure_on_off(budget, seed)}


def measure_proportional(budget: int, seed: int) -> dict[str, Any]:
    """The results of the joint with proportional valves, and those of learning."""
    joint = proportional_joint()
    result = compare_controllers(joint, standard_contenders(joint), budget=budget, seed=seed, progress=_show)
    tuned = next(each for each in result.contenders if each.name == FORWARD)
    curve = learn(joint, tuned, find_tasks(("sine 2 Hz",))[0], trials=31, seed=seed)
    return {
        "proportional": _plain(result), "learning": curve.errors.tolist(), "monotone": curve.is_monotone,
        "spread": curve.spread, "forward": forward_error(joint),
    }  # fmt: skip


def measure_on_off(budget: int, seed: int) -> dict[str, Any]:
    """The results of the joint with on/off valves."""
    joint = on_off_joint()
    chosen = [each for each in standard_contenders(joint) if each.name in ON_OFF]
    return {"on/off": _plain(compare_controllers(joint, chosen, budget=budget, seed=seed, progress=_show))}


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
        "scores": result.scores(),
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
    given = parser.parse_args()
    results = measure(given.budget, given.seed)
    staging = given.out.with_name(f".{given.out.name}.part")
    staging.write_text(page(results), encoding="utf-8")
    staging.replace(given.out)
    print(f"wrote {given.out}")


if __name__ == "__main__":
    main()
