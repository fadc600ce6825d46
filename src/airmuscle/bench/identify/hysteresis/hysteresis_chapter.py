"""Report chapters: hysteresis loops with all fitted friction laws, and creep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core.plotting import BLACK, BLUE, RED, legend_below, new_figure
from ....recording.display_units import display_scale
from ....report.chapter import Chapter, Plot, Table
from ....report.formatting import P_VALUE
from ...segment import motion_direction
from . import HysteresisFit, HysteresisLoop, JointFit, LoopFit, loops_not_joined
from .joint_friction_chapter import joint_friction_chapter
from .plot import plot_loops


def hysteresis_chapters(
    loop_fits: Sequence[LoopFit],
    creep: Sequence[str] = (),
    joint: Sequence[JointFit] = (),
    remarks: Sequence[str] = (),
) -> list[Chapter]:
    """Return the chapter of the joint fits, if any, and one per loop; the sentences on creep form the last chapter.

    Remarks on the data, such as the delay of a sensor, form the first one.
    """
    chapters = [Chapter("data", "Remarks on the data", "\n\n".join(remarks))] if remarks else []
    chapters += [joint_friction_chapter(joint, loops_not_joined(loop_fits))] if joint else []
    chapters += [_chapter(each, "" if len(loop_fits) == 1 else f"-{i}") for i, each in enumerate(loop_fits, 1)]
    if creep:
        chapters.append(Chapter("creep", "Creep", "\n\n".join(creep)))
    return chapters


def _chapter(loop_fit: LoopFit, suffix: str) -> Chapter:
    loop = loop_fit.loop
    shown = loop_fit.recommended or (loop_fit.fits[0] if loop_fit.fits else None)
    plots = [Plot(f"loop{suffix}", "Measured loop; light: rows that are not used.", _loop_figure(loop))]
    tables = [_law_table(loop_fit, suffix)]
    references: tuple[Any, ...] = ()
    if shown is not None:
        law = type(shown.friction).__name__
        plots.append(Plot(f"friction{suffix}", f"Loop and hysteresis described by {law}.", shown.plot()))
        caption = f"{law} with the fitted parameters: initial loading, outer loop and two minor loops."
        plots.append(Plot(f"minor-loops{suffix}", caption, plot_loops(shown.friction, loop.friction_path.axis)))
        tables.append(_parameter_table(shown, f"parameters{suffix}", f"Parameters of {law}"))
        references = shown.friction.references
    return Chapter(
        paper=f"friction{suffix}",
        title=f"{loop.recording.origin}: {loop.description}",
        summary="\n\n".join(_summary(loop_fit, shown)),
        tables=tuple(tables),
        plots=tuple(plots),
        references=references,
    )


def _parameter_table(fit: HysteresisFit, name: str, title: str) -> Table:
    """Return the parameters of a friction, in units of the quantity that drives it."""
    headers = ("parameter", "symbol", "value (SI)", "unit", "meaning")
    columns = zip(*fit.displayed_parameters, strict=True)
    return Table(name, title, {header: list(column) for header, column in zip(headers, columns, strict=True)})


def _summary(loop_fit: LoopFit, shown: HysteresisFit | None) -> list[str]:
    loop = loop_fit.loop
    sentences = [describe_row_counts(loop)]
    if shown is not None and loop_fit.recommended is None:
        sentences.append(
            f"The data justify none of the laws; {type(shown.friction).__name__} is shown as the best one."
        )
    if shown is not None:
        sentences.append(shown.verdict)
    if not loop_fit.usable_in_plant:
        sentences.append(
            "The loop is isometric: the pressure moved the fibres at constant length, and only a friction force over "
            "pressure is determined. Such a friction describes isometric loops and cannot be used in a plant. For a "
            "friction that can, measure a loop of contraction at constant pressure."
        )
    if loop.repeat is not None:
        sentences.append(f"Validated on {loop.repeat[0].origin}, a second run at the same level.")
    return [*sentences, *(f"{name} was not fitted: {reason}" for name, reason in loop_fit.failed.items())]


def describe_row_counts(loop: HysteresisLoop) -> str:
    """Return a sentence with the number of rows used from each branch."""
    direction = motion_direction(loop.friction_path.displacement(loop.recording), loop.recording.columns.get("time"))
    up, down = (int(np.count_nonzero((direction == sign) & loop.fitted_rows)) for sign in (1, -1))
    return f"{up} rows of the rising branch and {down} of the falling branch are used, of {len(loop.recording)}."


def _law_table(loop_fit: LoopFit, suffix: str) -> Table:
    fits = loop_fit.fits
    repeated = loop_fit.loop.repeat is not None
    return Table(
        f"laws{suffix}",
        "Friction laws, best first",
        {
            "law": [type(f.friction).__name__ for f in fits],
            "rms error without friction [N]": [f.rmse_without_friction for f in fits],
            "rms error [N]": [f.rmse for f in fits],
            **({"rms error on second run [N]": [f.repeat_rmse for f in fits]} if repeated else {}),
            "branch gap without friction [N]": [f.gap for f in fits],
            "remaining branch gap [N]": [f.residual_gap for f in fits],
            "reduction of AICc": [f.aicc_reduction for f in fits],
            P_VALUE: [f.p_value for f in fits],
            "justified": ["yes" if f.justified else "no" for f in fits],
            "not determined": [", ".join(f.undetermined) for f in fits],
        },
    )


def _loop_figure(loop: HysteresisLoop) -> Any:
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
