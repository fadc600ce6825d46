"""The chapters of a report on friction: a loop each, with every law tried on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.plotting import BLACK, BLUE, RED, legend_below, new_figure
from .chapter import Chapter, Plot, Table
from .parameters import parameter_table

if TYPE_CHECKING:
    from ..identify.hysteresis import HysteresisFit, HysteresisLoop, LoopFit


def hysteresis_chapters(found: Sequence[LoopFit], creep: Sequence[str] = ()) -> list[Chapter]:
    """One chapter a loop; what was said of creep stands in the last."""
    chapters = [_chapter(each, "" if len(found) == 1 else f"-{i}") for i, each in enumerate(found, 1)]
    if creep:
        chapters.append(Chapter("creep", "Creep", "\n\n".join(creep)))
    return chapters


def _chapter(found: LoopFit, suffix: str) -> Chapter:
    from ..identify.hysteresis.plot import plot_loops

    loop, best = found.loop, found.recommended
    shown = best or (found.fits[0] if found.fits else None)
    plots = [Plot(f"loop{suffix}", "The loop as measured; faint rows do not count.", _measured(loop))]
    tables = [_laws(found, suffix)]
    references: tuple[Any, ...] = ()
    if shown is not None:
        law = type(shown.friction).__name__
        plots.append(Plot(f"friction{suffix}", f"What {law} explains of the loop.", shown.plot()))
        inner = f"{law} with the fitted numbers: from rest, around the outer loop and through two minor loops."
        plots.append(Plot(f"minor-loops{suffix}", inner, plot_loops(shown.friction, loop.friction_path.axis)))
        tables.append(parameter_table(shown.friction, f"parameters{suffix}", f"Parameters of {law}"))
        references = shown.friction.references
    return Chapter(
        paper=f"friction{suffix}",
        title=f"{loop.recording.origin}: {loop.description}",
        summary="\n\n".join(_said(found, shown)),
        tables=tuple(tables),
        plots=tuple(plots),
        references=references,
    )


def _said(found: LoopFit, shown: HysteresisFit | None) -> list[str]:
    loop = found.loop
    said = [counted(loop)]
    if shown is not None and found.recommended is None:
        said.append(f"The data justify none of the laws; {type(shown.friction).__name__} is shown as the nearest.")
    if shown is not None:
        said.append(shown.verdict)
    if not found.usable_in_plant:
        said.append(
            "The muscle was held at one length, so that its threads were moved by the pressure: only a force by "
            "pressure is determined. Such a friction describes isometric loops and does not enter a plant. Run a loop "
            "of contraction at constant pressure for one that does."
        )
    if loop.repeat is not None:
        said.append(f"Judged on {loop.repeat[0].origin}, a second run at the same level.")
    return [*said, *(f"{name} was not fitted: {why}" for name, why in found.failed.items())]


def counted(loop: HysteresisLoop) -> str:
    """How many rows of either branch count."""
    from ..recording.segment import motion_direction

    way = motion_direction(loop.friction_path.displacement(loop.recording), loop.recording.columns.get("time"))
    up, down = (int(np.count_nonzero((way == sign) & loop.fitted_rows)) for sign in (1, -1))
    text = f"{up} rows on the way up and {down} on the way down count, of {len(loop.recording)}."
    if 10 * min(up, down) < max(up, down):
        text += " One branch has hardly any: let all rows count, or run the loop more slowly."
    return text


def _laws(found: LoopFit, suffix: str) -> Table:
    fits = found.fits
    repeated = found.loop.repeat is not None
    return Table(
        f"laws{suffix}",
        "Friction laws, the most telling first",
        {
            "law": [type(f.friction).__name__ for f in fits],
            "rms without [N]": [f.rmse_without_friction for f in fits],
            "rms [N]": [f.rmse for f in fits],
            **({"rms on second run [N]": [f.repeat_rmse for f in fits]} if repeated else {}),
            "gap before [N]": [f.gap for f in fits],
            "gap left [N]": [f.residual_gap for f in fits],
            "AICc falls by": [f.aicc_reduction for f in fits],
            "by chance": [f.p_value for f in fits],
            "justified": ["yes" if f.justified else "no" for f in fits],
            "not determined": [", ".join(f.undetermined) for f in fits],
        },
    )


def _measured(loop: HysteresisLoop) -> Any:
    """Force over what is swept, by branch; rows that do not count are faint."""
    from ..recording.display_units import display_scale
    from ..recording.segment import motion_direction

    recording = loop.recording
    name = "contraction" if "contraction" in loop.run.swept_columns or "length" in loop.run.swept_columns else "pressure"
    factor, unit = display_scale(name)
    way = motion_direction(loop.friction_path.displacement(recording), recording.columns.get("time"))
    figure, axes = new_figure(width=6.0, height=3.9)
    axes.plot(recording[name] * factor, recording["force"], color=BLACK, linewidth=0.5, alpha=0.3)
    for sign, colour, word in ((1, BLUE, "rising"), (-1, RED, "falling")):
        for rows, alpha, label in (
            ((way == sign) & ~loop.fitted_rows, 0.05, None),
            ((way == sign) & loop.fitted_rows, 0.8, word),
        ):
            style = {"marker": "o", "linestyle": "none", "markersize": 3, "alpha": alpha, "color": colour}
            axes.plot(recording[name][rows] * factor, recording["force"][rows], label=label, **style)
    axes.set(xlabel=f"{name} [{unit}]", ylabel="force [N]", title=f"{recording.origin}: {loop.description}")
    legend_below(figure, axes)
    return figure
