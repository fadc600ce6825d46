"""Page of the control benchmark: rankings, targets and what holds on all truths; every word of a
result is computed.
"""

from __future__ import annotations

import datetime
import math
import platform
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from joint_truths import SEALED_SEED

from airmuscle.design import ControlComparison, Group, LearningCurve
from airmuscle.design.control_comparison.commissioning import SEARCH_SPREAD
from airmuscle.design.control_comparison.tables import search_table, truth_table
from airmuscle.report import Table, shown_columns

SINES = {0.5: 0.25, 1.0: 0.45, 2.0: 0.9, 3.0: 1.3}
"""Targets of the rms error [degree] of sines of 20 degrees by frequency [Hz] (chosen)."""
RATIO_TARGET = 3.0
LEARNING_TARGET = 0.15
HOLD_TARGET = 0.5
REST_TARGET = 10.0
SHARE_TARGET = 5.0
SCORE_TARGET = 1.1
FURTHER = ("max_error", "strokes", "air")
PLAIN = "PID"
FORWARD = "feed-forward + PID"
BOTH = "angle and stiffness"
Row = tuple[str, str, str, str]


def page(
    results: Mapping[str, ControlComparison], curve: LearningCurve, settings: Any, cpu: float
) -> str:
    """The page in Markdown."""
    known = {kind: without_sealed(result) for kind, result in results.items()}
    lines = ["# Results of the control benchmark", "", *introduction(known, settings, cpu), ""]
    lines += [
        "## Targets",
        "",
        *rows(("target, commissioned", "bound", "reached", ""), targets(known, curve)),
        "",
    ]
    lines += ["## What holds on every truth", "", *orders(known["proportional"]), ""]
    for kind, title in (("proportional", "Proportional valves"), ("on/off", "On/off valves")):
        lines += [f"## {title}", "", f"{sentence(known[kind].joint.valve)}", "", *part(known[kind])]
    if SEALED_SEED in settings.truths:
        lines += ["## The sealed truth", "", *sealed(results["proportional"])]
    lines += ["## Iterative learning", "", *learning(curve)]
    return "\n".join(lines) + "\n"


def introduction(results: Mapping[str, ControlComparison], settings: Any, cpu: float) -> list[str]:
    """What was computed, how long it took, and the truths."""
    result = results["proportional"]
    switched = results["on/off"]
    options = (
        f" --searches {len(result.seeds)} --on-off-searches {len(switched.seeds)}"
        if settings.slow
        else " --quick"
    )
    seeds = "; ".join(
        f"{kind} valves, seeds {', '.join(map(str, each.seeds))}" for kind, each in results.items()
    )
    return [
        (
            f"Results of `benchmarks/control/control_benchmark.py{options}` on"
            f" {datetime.date.today()}, Python {platform.python_version()}; {cpu / 60:.3g} minutes"
            " of CPU time. All figures are simulations. [The control benchmark](README.md)"
            " describes joint, truths, groups, tasks and metrics; their numbers are chosen. All"
            " text of this page but the headings is computed from the results."
        ),
        "",
        (
            f"Searches: {seeds}; at most {settings.sets_per_gain} sets of gains for each gain."
            f" Commissioning: {settings.commissioning_runs} runs on each truth. The controllers of"
            " the package were developed on other truths of the same family (seeds 1 to 6)."
        ),
        "",
        *(f"* {kind} valves: {convergence(each)}" for kind, each in results.items()),
        "",
        *table(truth_table(result.joint)),
    ]


def convergence(result: ControlComparison) -> str:
    """How many searches have converged, and the controllers whose searches differ by more than the
    stated spread.
    """
    found = search_table(result.joint, result.results)
    if found is None:
        return "nothing was tuned."
    ended = [list(map(int, str(each).split(" of "))) for each in found.columns["converged"]]
    pairs = zip(found.columns["controller"], found.columns["spread"], strict=True)
    beyond = [str(name) for name, value in pairs if value is not None and value > SEARCH_SPREAD]
    open_ended = ", ".join(result.unfinished) or "none"
    text = (
        f"{sum(n for n, _ in ended)} of {sum(m for _, m in ended)} searches converged within their"
        f" sets of gains (not: {open_ended}; their scores say as much about the search as about the"
        " controller); "
    )
    if len(result.seeds) == 1:
        return text + "one search each, so that its spread is not known."
    return (
        text + f"objectives that differ by more than {100 * SEARCH_SPREAD:g} %:"
        f" {', '.join(beyond) or 'none'}."
    )


def without_sealed(result: ControlComparison) -> ControlComparison:
    """The result on the truths other than the sealed one."""
    return on(result, [truth.name for truth in result.joint.truths if truth.name != "sealed truth"])


def on(result: ControlComparison, names: Iterable[str]) -> ControlComparison:
    """The result on some of the truths."""
    kept = tuple(truth for truth in result.joint.truths if truth.name in names)
    return replace(result, joint=replace(result.joint, truths=kept))


def part(result: ControlComparison) -> list[str]:
    """The tables of one joint."""
    lines = []
    for group in result.groups:
        lines += [f"### {sentence(group)[:-1]}", "", *table(result.ranking_table(group))]
        lines += table(result.order_table(group)) if len(result.truths) > 1 else []
        lines += table(result.error_table("rmse", group))
        for metric in FURTHER:
            lines += table(result.error_table(metric, group), digits=3)
    searched = search_table(result.joint, result.results)
    return [*lines, *(["### Searches", "", *table(searched)] if searched else [])]


def sealed(result: ControlComparison) -> list[str]:
    """Ranking and errors of both groups on the truth that no tuning has seen."""
    alone = on(result, ["sealed truth"])
    lines = table(truth_table(alone.joint))
    for group in alone.groups:
        lines += [*table(alone.ranking_table(group)), *table(alone.error_table("rmse", group))]
    return lines


def orders(result: ControlComparison) -> list[str]:
    """The pairs of controllers whose order is the same on every truth, in every search."""
    lines = []
    for group in result.groups:
        ratios = result.ratios(group)
        names = list(result.scores(group))
        pairs = [
            f"{a} before {b}"
            for i, a in enumerate(names)
            for b in names[i + 1 :]
            if (ratios[a].max(axis=0) < ratios[b].min(axis=0)).all()
        ]
        total = len(names) * (len(names) - 1) // 2
        lines.append(
            f"* {sentence(group)[:-1]}, {len(pairs)} of {total} pairs:"
            f" {'; '.join(pairs) or 'none'}."
        )
    best = {group: next(iter(result.scores(group))) for group in result.groups}
    if PLAIN in result.contenders(Group.COMMISSIONED):
        ours = best[Group.COMMISSIONED]
        for frequency in SINES:
            ratio = ratio_of(result, f"sine {frequency:g} Hz", PLAIN, ours, Group.COMMISSIONED)
            lines.append(
                f"* {sentence(Group.COMMISSIONED)[:-1]}, {frequency:g} Hz: {PLAIN} has at least"
                f" {ratio.min():.2g} times the rms error of {ours} (median {np.median(ratio):.2g})."
            )
    return lines


def ratio_of(result: ControlComparison, task: str, first: str, second: str, group: Group) -> Any:
    """Ratio of the rms errors of two controllers, (searches, truths)."""
    return result.values(first, task, "rmse", group) / result.values(second, task, "rmse", group)


def targets(results: Mapping[str, ControlComparison], curve: LearningCurve) -> list[Row]:
    """The targets: name, bound, what was reached over searches and truths, and where all searches
    meet it.
    """
    data = results["proportional"]
    switched = results["on/off"]
    group = Group.COMMISSIONED
    best = next(iter(data.scores(group)))
    median = float(np.median(data.ratios(group)[best]))
    found = [
        single(
            f"smallest score, median ({best})",
            f"≤ {SCORE_TARGET:g}",
            f"{median:.3f}",
            median <= SCORE_TARGET,
        )
    ]
    for name in dict.fromkeys((FORWARD, best)):
        for frequency, bound in SINES.items():
            errors = data.values(name, f"sine {frequency:g} Hz", "rmse", group)
            found.append(below(f"{name}, {frequency:g} Hz, 20 degrees", bound, errors, "°"))
    for frequency in list(SINES)[:3]:
        ratio = ratio_of(data, f"sine {frequency:g} Hz", PLAIN, FORWARD, group)
        met = met_on(ratio >= RATIO_TARGET)
        found.append(
            (f"{PLAIN} / {FORWARD}, {frequency:g} Hz", f"≥ {RATIO_TARGET:g}", spread(ratio), met)
        )
    for name in switched.contenders(group):
        for metric, bound, unit in (
            ("max_error", HOLD_TARGET, "°"),
            ("strokes", REST_TARGET, " 1/s"),
        ):
            values = switched.values(name, "hold", metric, group)
            found.append(
                below(
                    f"on/off valves at rest, {name}, {metric.replace('_', ' ')}",
                    bound,
                    values,
                    unit,
                )
            )
    for metric, scale in (("max_error", 10.0), ("stiffness_error", 1.0)):
        values = scale * data.values(BOTH, "stiffness change", metric, group)
        found.append(below(f"{BOTH}, {metric.replace('_', ' ')}", SHARE_TARGET, values, " %"))
    late = float(curve.errors[10:].max())
    last = f"trials 11 to {curve.errors.size}"
    found.append(
        single(
            f"learning, {last}", f"≤ {LEARNING_TARGET:g}°", f"{late:.3f}°", late <= LEARNING_TARGET
        )
    )
    rise = max(0.0, float(np.diff(curve.errors).max()))
    found.append(
        single(
            "learning, rises",
            f"≤ {curve.spread:.3f}° (noise)",
            f"{rise:.3f}°",
            rise <= curve.spread,
        )
    )
    return found


def single(name: str, bound: str, reached: str, met: bool) -> Row:
    """A target for one number."""
    return name, bound, reached, "met" if met else "missed"


def below(name: str, bound: float, values: Any, unit: str) -> Row:
    """A target below which the values (searches, truths) of a metric must be."""
    return name, f"≤ {bound:g}{unit}", f"{spread(values)}{unit}", met_on(values <= bound)


def met_on(fulfilled: Any) -> str:
    """On how many truths all searches fulfil a target (searches, truths)."""
    return f"met on {int(fulfilled.all(axis=0).sum())} of {fulfilled.shape[1]} truths"


def spread(values: Any) -> str:
    """Median with the range."""
    return f"{np.median(values):.3g} ({values.min():.3g} to {values.max():.3g})"


def learning(curve: LearningCurve) -> list[str]:
    """The errors of repeated trials."""
    return [
        (
            f"{curve.contender}, {curve.task.name}; rms error [degree] of trials 1 to"
            f" {curve.errors.size}:"
        ),
        "",
        ", ".join(f"{error:.3f}" for error in curve.errors) + ".",
    ]


def table(made: Table, digits: int = 4) -> list[str]:
    """A table of a report in Markdown, with its title and note."""
    shown = shown_columns(made, chosen=False)
    heads = [each.heading for each in shown]
    title = made.title
    if (
        len(units := {re.search(r" \[.*\]$|$", head)[0] for head in heads[1:]}) == 1
    ):  # that of all goes to the title
        (unit,) = units
        heads = [head.removesuffix(unit) for head in heads]
        title = title.replace(",", f"{unit},", 1)
    cells = [[_cell(value, digits) for value in each.cells] for each in shown]
    return [sentence(title), "", *rows(heads, zip(*cells, strict=True)), "", made.note, ""]


def rows(headings: Iterable[str], cells: Iterable[Iterable[str]]) -> list[str]:
    """Lines of a table in Markdown."""
    heads = list(headings)
    return [
        f"| {' | '.join(heads)} |",
        "|---" * len(heads) + "|",
        *(f"| {' | '.join(each)} |" for each in cells),
    ]


def _cell(value: Any, digits: int) -> str:
    if isinstance(value, str):
        return value
    return (
        "–"
        if value is None or math.isnan(value)
        else "∞"
        if math.isinf(value)
        else f"{value:.{digits}g}"
    )


def sentence(text: str) -> str:
    """A text with a capital and a full stop."""
    return f"{text[:1].upper()}{text[1:]}."
