"""Report chapters: friction laws of each loop and of all runs together, and creep."""

import dataclasses
import functools
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core import BLACK, BLUE, DASHES, LINES, RED, Array, Reference, leaves, legend_below, new_figure
from ....physics.muscle.friction import Friction
from ....recording.columns import display_scale
from ....report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ....report.formatting import P_VALUE
from ...segment import motion_direction
from . import HysteresisFit, HysteresisLoop, JointFit, LoopFit, loops_not_joined, preferred_fit
from .loop_data import MILLIMETRES, Axis
from .result import FrictionFit

SEPARATE_LOOPS = 2
"""Maximum number of loops of which the brief view has the laws of each; of more it has one row each (chosen)."""


def hysteresis_chapters(loop_fits: Sequence[LoopFit], joint: Sequence[JointFit] = ()) -> list[Chapter]:
    """Return the overview of several loops, the chapter of the joint fits, if any, and one chapter for each loop."""
    chapters = [_overview(loop_fits)] if len(loop_fits) > 1 else []
    chapters += [joint_friction_chapter(joint, loops_not_joined(loop_fits))] if joint else []
    for i, each in enumerate(loop_fits, 1):
        chapter = loop_chapter(each).among(suffix="" if len(loop_fits) == 1 else f"-{i}")
        chapters.append(dataclasses.replace(chapter, brief=len(loop_fits) <= SEPARATE_LOOPS))
    return chapters


def _overview(loop_fits: Sequence[LoopFit]) -> Chapter:
    """Return the chapter with one row for each loop: its preferred law, or that of the lowest AICc."""
    best = [each.recommended or next(iter(each.fits), None) for each in loop_fits]
    columns: dict[str, Any] = {
        "run": [each.loop.recording.origin for each in loop_fits],
        "kind": [each.loop.description for each in loop_fits],
        "rows": [int(each.loop.fitted_rows.sum()) for each in loop_fits],
        "law": [each and each.name for each in best],
        "rms error without friction": TableColumn([each and each.rmse_without_friction for each in best], "N", digits=3,
                                             short="without friction"),
        "rms error": TableColumn([each and each.rmse for each in best], "N", digits=3),
        "justified": [each.recommended is not None for each in loop_fits],
        "usable in a plant": TableColumn([each.usable_in_plant for each in loop_fits], brief=False),
    }  # fmt: skip
    failed: dict[tuple[str, str], list[str]] = {}
    for each in loop_fits if len(loop_fits) > SEPARATE_LOOPS else ():
        for law in each.failed.items():
            failed.setdefault(law, []).append(each.loop.recording.origin)
    runs = {law: origins[0] if len(origins) == 1 else f"{len(origins)} runs" for law, origins in failed.items()}
    notes = tuple(f"{name} was not fitted to {which}: {reason}" for (name, reason), which in runs.items())
    justified = sum(each.recommended is not None for each in loop_fits)
    summary = f"{len(loop_fits)} loops; the data justify a friction law for {justified} of them."
    tables = (Table("loops", "Best law of each loop", columns, brief=12),)
    return Chapter("loops", "Hysteresis loops", summary, tables=tables, notes=notes)


def loop_chapter(loop_fit: LoopFit) -> Chapter:
    """Return the chapter of the friction laws of one loop."""
    loop, best = loop_fit.loop, loop_fit.recommended
    shown = best or next(iter(loop_fit.fits), None)
    plots = [Plot("loop", "Measured loop; light: rows that are not used.", functools.partial(_figure, loop))]
    tables, references = [_law_table(loop_fit)], tuple[Reference, ...]()
    if shown is not None:
        own = shown.chapter()
        caption = f"{shown.name} with the fitted parameters: initial loading, outer loop and two minor loops."
        minor = functools.partial(plot_loops, shown.friction, loop.friction_path.axis)
        plots += [*own.plots, Plot("minor-loops", caption, minor)]
        tables += _friction_tables(own)
        references = own.references
    rows = [(f.name, leaf) for f in loop_fit.fits for leaf in leaves(f.friction)]
    columns: dict[str, Any] = {
        "law": [law for law, _ in rows],
        "parameter": [leaf.path for _, leaf in rows],
        "value": TableColumn([leaf.value for _, leaf in rows], BY_ROW),
        "unit": [leaf.declared.unit for _, leaf in rows],
    }
    tables.append(Table("law-parameters", "Parameters of all laws", columns, shown=False))
    stated = {"recommended": best and best.name, "usable in a plant": loop_fit.usable_in_plant}
    return Chapter(
        "friction", f"{loop.recording.origin}: {loop.description}", tuple(_summary(loop_fit, shown)),
        values=tuple(NamedValue(name, value, brief=False) for name, value in stated.items()), tables=tuple(tables),
        plots=tuple(plots), notes=tuple(_notes(loop_fit)), references=references,
    )  # fmt: skip


def _friction_tables(chapter: Chapter) -> list[Table]:
    """Return the tables of the chapter of a friction, as parts of another one."""
    return [dataclasses.replace(table, name=f"friction-{table.name}", brief=0) for table in chapter.tables]


def _summary(loop_fit: LoopFit, shown: HysteresisFit | None) -> list[str]:
    loop = loop_fit.loop
    direction = motion_direction(loop.friction_path.displacement(loop.recording), loop.recording.columns.get("time"))
    up, down = (int(np.count_nonzero((direction == sign) & loop.fitted_rows)) for sign in (1, -1))
    rows = f"{up} rows of the rising branch and {down} of the falling branch are used, of {len(loop.recording)}."
    if shown is None:
        return [rows]
    none = f"The data justify none of the laws; {shown.name} is shown as the best one. "
    return [f"{none if loop_fit.recommended is None else ''}{shown.verdict}", rows]


def _notes(loop_fit: LoopFit) -> list[str]:
    isometric = (
        "The loop is isometric: the pressure moved the fibres at constant length, and only a friction force over "
        "pressure is determined. Such a friction describes isometric loops and cannot be used in a plant. For a "
        "friction that can, measure a loop of contraction at constant pressure."
    )
    notes = [] if loop_fit.usable_in_plant else [isometric]
    if loop_fit.loop.repeat is not None:
        notes.append(f"Validated on {loop_fit.loop.repeat[0].origin}, a second run at the same level.")
    return [*notes, *(f"{name} was not fitted: {reason}" for name, reason in loop_fit.failed.items())]


def _law_table(loop_fit: LoopFit) -> Table:
    fits = loop_fit.fits
    columns: dict[str, Any] = {}
    if loop_fit.loop.repeat is not None:
        columns |= {
            "rms error on second run": TableColumn([f.repeat_rmse for f in fits], "N", digits=3, short="on second run"),
            "rms error on second run without friction": TableColumn(
                [f.repeat_rmse_without_friction for f in fits], "N", digits=3, brief=False
            ),
            "repeatability": TableColumn([f.repeatability for f in fits], "N", digits=3, brief=False),
        }
    columns |= {
        "branch gap without friction": TableColumn([f.gap for f in fits], "N", brief=False),
        "remaining branch gap": TableColumn([f.residual_gap for f in fits], "N", digits=3),
        "not determined": TableColumn([", ".join(f.undetermined) for f in fits], brief=False),
    }
    return _compared_laws("laws", "Friction laws, best first", fits, columns)


def _compared_laws(name: str, title: str, fits: Sequence[FrictionFit], own: dict[str, Any]) -> Table:
    """Return the errors and the tests of friction laws, with columns of their own."""
    columns: dict[str, Any] = {
        "law": [f.name for f in fits],
        "rms error without friction": TableColumn([f.rmse_without_friction for f in fits], "N", digits=3, brief=False),
        "rms error": TableColumn([f.rmse for f in fits], "N", digits=3),
        **own,
        "reduction of AICc": [f.aicc_reduction if np.isfinite(f.aicc_reduction) else None for f in fits],
        P_VALUE: TableColumn([f.p_value for f in fits], brief=False),
        "justified": [f.justified for f in fits],
    }
    return Table(name, title, columns, brief=len(fits))


def joint_friction_chapter(fits: Sequence[JointFit], not_joined: Sequence[str] = ()) -> Chapter:
    """Return the chapter of the joint fits of all laws, lowest AICc first, with the friction of each run by the best
    justified one; `not_joined` are sentences on the loops that the joint fit does not use."""
    shown = preferred_fit(fits) or fits[0]
    none = "The runs justify no friction law that holds for all of them, so none is written."
    none = "" if shown.justified else f"{none} {shown.name} is shown as the best one. "
    columns = {
        "depends on pressure": [fit.law is not fit.friction for fit in fits],
        "runs that disagree": [sum(run.disagrees for run in fit.agreement) for fit in fits],
    }
    laws, own, runs = "Friction laws fitted to all runs together, best first", shown.chapter(), shown.agreement
    by_run: dict[str, Any] = {
        "run": [run.origin for run in runs],
        "level": [run.description for run in runs],
        "from this run": TableColumn([run.amplitude for run in runs], "N", digits=3),
        "standard error": TableColumn([run.amplitude_stderr for run in runs], "N", digits=2),
        "from all runs": TableColumn([run.joint_amplitude for run in runs], "N", digits=3),
        "rms deviation": TableColumn([run.deviation for run in runs], "1", "%"),
        P_VALUE: TableColumn([run.p_value for run in runs], brief=False),
        "agrees": TableColumn([not run.disagrees for run in runs], brief=False),
    }
    title = f"Friction of each run, {shown.name}: half the range of the force"
    of_runs = Table("joint-runs", title, by_run, brief=[i for i, run in enumerate(runs) if run.disagrees])
    tables = (_compared_laws("joint-laws", laws, fits, columns), of_runs, *_friction_tables(own))
    return dataclasses.replace(
        own, title="Friction of all runs", summary=(f"{none}{shown.verdict}",), tables=tables, notes=tuple(not_joined)
    )


def _figure(loop: HysteresisLoop) -> Any:
    """Return a figure of the force over the varied quantity, by branch; rows that are not used are light."""
    recording = loop.recording
    name = "contraction" if {"contraction", "length"} & set(loop.run.swept_columns) else "pressure"
    factor, unit = display_scale(name)
    direction = motion_direction(loop.friction_path.displacement(recording), recording.columns.get("time"))
    figure, axes = new_figure(width=6.0, height=3.9)
    axes.plot(recording[name] * factor, recording["force"], color=BLACK, linewidth=0.5, alpha=0.3)
    for sign, colour, branch in ((1, BLUE, "rising"), (-1, RED, "falling")):
        for used, alpha, label in ((~loop.fitted_rows, 0.05, None), (loop.fitted_rows, 0.8, branch)):
            rows = (direction == sign) & used
            style = {"marker": "o", "linestyle": "none", "markersize": 3, "alpha": alpha, "color": colour}
            axes.plot(recording[name][rows] * factor, recording["force"][rows], label=label, **style)
    axes.set(xlabel=f"{name} [{unit}]", ylabel="force [N]", title=f"{recording.origin}: {loop.description}")
    legend_below(figure, axes)
    return figure


TURNING_POINTS, ROWS_PER_LEG = (2.0, -2.0, -0.6, -1.1, -0.6, 0.5, -0.3, 0.5, 2.0), 200
"""Turning points of the path of `plot_loops`, as multiples of the presliding distance of the law, and rows between two
of them (chosen)."""
INNER_LOOPS = ((3, 5), (6, 8))
"""Legs of the path that form the inner loops, first and last plus one."""


def loop_path(distance: float) -> Array:
    """A path [m] from rest around an outer loop with two inner loops, scaled by a distance [m]."""
    turning_points = itertools.pairwise((0.0, *TURNING_POINTS))
    legs = [np.linspace(a, b, ROWS_PER_LEG, endpoint=False) for a, b in turning_points]
    return distance * np.concatenate([*legs, [TURNING_POINTS[-1]]])


def plot_loops(friction: Friction, axis: Axis = MILLIMETRES) -> Any:
    """Friction force over displacement: from rest, around the outer loop, through two inner loops. Returns a Matplotlib
    figure."""
    path = loop_path(friction.presliding_distance or 1e-3)
    force = friction.force_along(path)
    outer, parts = force.copy(), [(force, 0, 1, "from rest", 1)]
    for (a, b), name in zip(INNER_LOOPS, ("inner loops", ""), strict=True):
        outer[a * ROWS_PER_LEG + 1 : b * ROWS_PER_LEG] = np.nan
        parts.append((force, a, b, name, 2))
    figure, axes = new_figure(width=5.6, height=3.9)
    for values, a, b, name, style in [(outer, 1, len(TURNING_POINTS), "outer loop", 0), *parts]:
        rows, label = slice(a * ROWS_PER_LEG, b * ROWS_PER_LEG + 1), name or None
        axes.plot(path[rows] * axis.factor, values[rows], color=LINES[style], linestyle=DASHES[style], label=label)
    axes.set(xlabel=axis.label, ylabel="friction [N]", title=type(friction).__name__)
    legend_below(figure, axes, 3)
    return figure
