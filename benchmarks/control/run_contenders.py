"""Some controllers of the control benchmark, or those of scenario files, on some tasks: a report
with rankings, and with `--json` every metric in SI units.

    python benchmarks/control/run_contenders.py --contender PID --contender "feed-forward + PID"
        --task "sine 1 Hz" --trials 10
    python benchmarks/control/run_contenders.py --valves on-off --truth-seeds 1-2 --budget 40
    python benchmarks/control/run_contenders.py --contender PID
        --contender examples/joint_cascade.toml --runs 0
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from contender_set import standard_contenders
from joint_models import on_off_joint, proportional_joint
from joint_truths import TRUTH_SEEDS

from airmuscle.core import check_known
from airmuscle.design import (
    Contender,
    ControlComparison,
    JointRig,
    LearningCurve,
    compare_controllers,
    find_tasks,
    learn,
    result_store,
    scenario_contender,
)
from airmuscle.design.control_comparison import read_seeds
from airmuscle.design.control_comparison.commissioning import COMMISSIONING_RUNS
from airmuscle.errors import InputError
from airmuscle.report import as_data, as_json, as_text, write_report

VALVES = {"proportional": proportional_joint, "on-off": on_off_joint}
LEARNED = "feed-forward + PID"
"""The controller whose feed-forward is learned from trial to trial."""
BUDGET = 60
"""Sets of gains for each gain (chosen)."""


def contenders(rig: JointRig, requested: Sequence[str]) -> list[Contender]:
    """The requested controllers, by their names or by scenario files; by default all."""
    known = {contender.name: contender for contender in standard_contenders(rig)}
    names = dict.fromkeys(requested)
    for name in names:
        if name not in known and name.endswith(".toml"):
            known[name] = scenario_contender(rig, name)
        check_known("there is no controller", name, known, error=InputError)
    return [known[name] for name in names or known]


def options() -> argparse.ArgumentParser:
    """The options of the script."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--valves", choices=list(VALVES), default="proportional")
    parser.add_argument("--contender", action="append", default=[], help="name or scenario file")
    parser.add_argument("--task", action="append", default=[], help="default: all")
    parser.add_argument("--truth-seeds", default=",".join(map(str, TRUTH_SEEDS)))
    parser.add_argument("--searches", type=int, default=1, help="with different seeds")
    parser.add_argument("--budget", type=int, default=BUDGET, help="sets of gains for each gain")
    parser.add_argument("--runs", type=int, default=COMMISSIONING_RUNS, help="to commission")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--trials", type=int, default=0, help="of learning at 2 Hz; 0: none")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("benchmark"))
    parser.add_argument("--json", action="store_true")
    return parser


def learned(result: ControlComparison, trials: int, seed: int) -> list[LearningCurve]:
    """The trials of learning, if any are asked for."""
    if not trials:
        return []
    tuned = [entry for entry in result.results if entry.name == LEARNED]
    if trials < 2 or not tuned:
        raise InputError(f"--trials needs at least 2 trials and the controller '{LEARNED}'.")
    (task,) = find_tasks(("sine 2 Hz",))
    return [learn(result.joint, tuned[0], task, trials=trials, seed=seed)]


def main(arguments: Sequence[str] | None = None) -> ControlComparison:
    """Compare the controllers, write the report and print the brief view."""
    given = options().parse_args(arguments)
    rig = VALVES[given.valves](read_seeds(given.truth_seeds))
    with result_store(given.out / "tasks") as store:
        result = compare_controllers(
            rig,
            contenders(rig, given.contender),
            find_tasks(tuple(given.task)),
            seeds=range(given.seed, given.seed + given.searches),
            sets_per_gain=given.budget,
            commissioning_runs=given.runs,
            workers=given.workers,
        )
    chapter = result.chapter(learned(result, given.trials, given.seed))
    write_report([chapter], given.out, title="Control benchmark")
    store.remove()
    print(as_json(as_data([chapter])) if given.json else as_text([chapter], 100, "the report"))
    return result


if __name__ == "__main__":
    main()
