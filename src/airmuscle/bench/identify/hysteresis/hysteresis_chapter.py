"""Report chapters: friction laws of each loop and of all runs together, and creep."""

import dataclasses
import functools
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core import BLACK, BLUE, DASHES, LINES, RED, Array, leaves, legend_below, new_figure
from ....physics.muscle.friction import Friction
from ....recording.columns import display_scale
from ....report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ....report.formatting import P_VALUE
from ...segment import motion_direction
from . import HysteresisFit, HysteresisLoop, JointFit, LoopFit, loops_not_joined, preferred_fit
from .limits import MILLIMETRES, Axis
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
    best = [each.recommended or (each.fits[0] if each.fits else None) for each in loop_fits]
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
    failed: dict[str, list[str]] = {}
    for each in loop_fits if len(loop_fits) > SEPARATE_LOOPS else ():
        for name, reason in each.failed.items():
            failed.setdefault(f"{name} was not fitted to {{}}: {reason}", []).append(each.loop.recording.origin)
    justified = sum(each.recommended is not None for each in loop_fits)
    return Chapter(
        name="loops",
        title="Hysteresis loops",
        summary=f"{len(loop_fits)} loops; the data justify a friction law for {justified} of them.",
        tables=(Table("loops", "Best law of each loop", columns, brief=12),),
        notes=tuple(text.format(origins[0] if len(origins) == 1 else f"{len(origins)} runs")
                    for text, origins in failed.items()),
    )  # fmt: skip


def loop_chapter(loop_fit: LoopFit) -> Chapter:
    """Return the chapter of the friction laws of one loop."""
    loop = loop_fit.loop
    best = loop_fit.recommended
    shown = best or (loop_fit.fits[0] if loop_fit.fits else None)
    of_shown = None if shown is None else shown.chapter()
    plots = [Plot("loop", "Measured loop; light: rows that are not used.", functools.partial(_figure, loop))]
    tables = [_law_table(loop_fit)]
    if shown is not None and of_shown is not None:
        caption = f"{shown.name} with the fitted parameters: initial loading, outer loop and two minor loops."
        minor = functools.partial(plot_loops, shown.friction, loop.friction_path.axis)
        plots += [*of_shown.plots, Plot("minor-loops", caption, minor)]
        tables += [dataclasses.replace(table, name=f"friction-{table.name}", brief=0) for table in of_shown.tables]
    tables.append(_all_parameters(loop_fit))
    return Chapter(
        name="friction",
        title=f"{loop.recording.origin}: {loop.description}",
        summary=tuple(_summary(loop_fit, shown)),
        values=(
            NamedValue("recommended", best and best.name, brief=False),
            NamedValue("usable in a plant", loop_fit.usable_in_plant, brief=False),
        ),
        tables=tuple(tables),
        plots=tuple(plots),
        notes=tuple(_notes(loop_fit)),
        references=() if of_shown is None else of_shown.references,
    )


def _summary(loop_fit: LoopFit, shown: HysteresisFit | None) -> list[str]:
    loop = loop_fit.loop
    direction = motion_direction(loop.friction_path.displacement(loop.recording), loop.recording.columns.get("time"))
    up, down = (int(np.count_nonzero((direction == sign) & loop.fitted_rows)) for sign in (1, -1))
    rows = f"{up} rows of the rising branch and {down} of the falling branch are used, of {len(loop.recording)}."
    if shown is None:
        return [rows]
    if loop_fit.recommended is None:
        return [f"The data justify none of the laws; {shown.name} is shown as the best one. {shown.verdict}", rows]
    return [shown.verdict, rows]


def _notes(loop_fit: LoopFit) -> list[str]:
    notes = []
    if not loop_fit.usable_in_plant:
        notes.append(
            "The loop is isometric: the pressure moved the fibres at constant length, and only a friction force over "
            "pressure is determined. Such a friction describes isometric loops and cannot be used in a plant. For a "
            "friction that can, measure a loop of contraction at constant pressure."
        )
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


def _all_parameters(loop_fit: LoopFit) -> Table:
    """Return the parameters of all laws of a loop."""
    rows = [(f.name, leaf) for f in loop_fit.fits for leaf in leaves(f.friction)]
    columns: dict[str, Any] = {
        "law": [law for law, _ in rows],
        "parameter": [leaf.path for _, leaf in rows],
        "value": TableColumn([leaf.value for _, leaf in rows], BY_ROW),
        "unit": [leaf.declared.unit for _, leaf in rows],
    }
    return Table("law-parameters", "Parameters of all laws", columns, shown=False)


def joint_friction_chapter(fits: Sequence[JointFit], not_joined: Sequence[str] = ()) -> Chapter:
    """Return the chapter of the joint fits of all laws, lowest AICc first; the best justified one is shown.

    `not_joined` are sentences on the loops that the joint fit does not use.
    """
    shown = preferred_fit(fits) or fits[0]
    of_shown = shown.chapter()
    first = shown.verdict
    if not shown.justified:
        first = (
            "The runs justify no friction law that holds for all of them, so none is written. "
            f"{shown.name} is shown as the best one. {first}"
        )
    columns = {
        "depends on pressure": [fit.law is not fit.friction for fit in fits],
        "runs that disagree": [sum(run.disagrees for run in fit.agreement) for fit in fits],
    }
    laws = _compared_laws("joint-laws", "Friction laws fitted to all runs together, best first", fits, columns)
    tables = [dataclasses.replace(table, name=f"friction-{table.name}", brief=0) for table in of_shown.tables]
    return dataclasses.replace(
        of_shown,
        title="Friction of all runs",
        summary=(first,),
        tables=(laws, _run_table(shown), *tables),
        notes=tuple(not_joined),
    )


def _run_table(fit: JointFit) -> Table:
    """Return the friction of each run, from the run alone and from all runs; in the brief view those that disagree."""
    runs = fit.agreement
    columns: dict[str, Any] = {
        "run": [run.origin for run in runs],
        "level": [run.description for run in runs],
        "from this run": TableColumn([run.amplitude for run in runs], "N", digits=3),
        "standard error": TableColumn([run.amplitude_stderr for run in runs], "N", digits=2),
        "from all runs": TableColumn([run.joint_amplitude for run in runs], "N", digits=3),
        "rms deviation": TableColumn([run.deviation for run in runs], "1", "%"),
        P_VALUE: TableColumn([run.p_value for run in runs], brief=False),
        "agrees": TableColumn([not run.disagrees for run in runs], brief=False),
    }
    title = f"Friction of each run, {fit.name}: half the range of the force"
    disagreeing = [i for i, run in enumerate(runs) if run.disagrees]
    return Table("joint-runs", title, columns, brief=disagreeing)


def _figure(loop: HysteresisLoop) -> Any:
    """Return a figure of the force over the varied quantity, by branch; rows that are not used are light."""
    recording = loop.recording
    name = (
        "contraction" if "contraction" in loop.run.swept_columns or "length" in loop.run.swept_columns else "pressure"
    )
    factor, unit = display_scale(name)
    direction = motion_direction(loop.friction_path.displacement(recording), recording.columns.get("time"))
    figure, axes = new_figure(width=6.0, height=3.9)
    axes.plot(recording[name] * factor, recording["force"], color=BLACK, linewidth=0.5, alpha=0.3)
    for sign, colour, branch in ((1, BLUE, "rising"), (-1, RED, "falling")):
        for rows, alpha, label in (
            ((direction == sign) & ~loop.fitted_rows, 0.05, None),
            ((direction == sign) & loop.fitted_rows, 0.8, branch),
        ):
            style = {"marker": "o", "linestyle": "none", "markersize": 3, "alpha": alpha, "color": colour}
            axes.plot(recording[name][rows] * factor, recording["force"][rows], label=label, **style)
    axes.set(xlabel=f"{name} [{unit}]", ylabel="force [N]", title=f"{recording.origin}: {loop.description}")
    legend_below(figure, axes)
    return figure


TURNING_POINTS = (2.0, -2.0, -0.6, -1.1, -0.6, 0.5, -0.3, 0.5, 2.0)
"""Turning points of the path of `plot_loops`, as multiples of the presliding distance of the law (chosen)."""
INNER_LOOPS = ((3, 5), (6, 8))
"""Legs of the path that form the inner loops, first and last plus one."""
ROWS_PER_LEG = 200
"""Rows between two turning points."""


def loop_path(distance: float) -> Array:
    """A path [m] from rest around an outer loop with two inner loops, scaled by a distance [m]."""
    turning_points = itertools.pairwise((0.0, *TURNING_POINTS))
    legs = [np.linspace(a, b, ROWS_PER_LEG, endpoint=False) for a, b in turning_points]
    return distance * np.concatenate([*legs, [TURNING_POINTS[-1]]])


def plot_loops(friction: Friction, axis: Axis = MILLIMETRES) -> Any:
    """Friction force over displacement: from rest, around the outer loop, through two inner loops.

    Returns a Matplotlib figure.
    """
    path = loop_path(friction.presliding_distance or 1e-3)
    force = friction.force_along(path)
    parts = [("outer loop", ROWS_PER_LEG, len(path)), ("from rest", 0, ROWS_PER_LEG + 1)]
    parts += [
        ("inner loops" if i == 0 else "", a * ROWS_PER_LEG, b * ROWS_PER_LEG + 1)
        for i, (a, b) in enumerate(INNER_LOOPS)
    ]
    outer = force.copy()
    for a, b in INNER_LOOPS:
        outer[a * ROWS_PER_LEG + 1 : b * ROWS_PER_LEG] = np.nan
    figure, axes = new_figure(width=5.6, height=3.9)
    for (name, first, last), style in zip(parts, (0, 1, 2, 2), strict=True):
        rows, label = slice(first, last), name or None
        values = force if style else outer
        axes.plot(path[rows] * axis.factor, values[rows], color=LINES[style], linestyle=DASHES[style], label=label)
    axes.set(xlabel=axis.label, ylabel="friction [N]", title=type(friction).__name__)
    legend_below(figure, axes, 3)
    return figure
