"""Friction laws of one loop with their chapter; the loop, its kind and level, tables of laws, and
their minor loops.
"""

import dataclasses
import functools
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import (
    BLACK,
    BLUE,
    DASHES,
    LINES,
    RED,
    Array,
    Reference,
    ShortRepr,
    leaves,
    legend_below,
    new_figure,
)
from ...physics.muscle.friction import Friction
from ...recording import Recording
from ...recording.columns import display_scale
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.formatting import P_VALUE
from ..diagnosis import level_text
from ..inspection import Mask, Run, branch_name, motion_direction
from ..reported import Reported
from .loop_data import MILLIMETRES, Axis, ContractionPath, FrictionPath, StaticCurve
from .result import FrictionFit, HysteresisFit, preferred_fit
from .search import LoopSeries, make_loop_series


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class HysteresisLoop(ShortRepr):
    """One run with both branches, the path of the friction, the static curve and
    the fitted rows.
    """

    recording: Recording
    run: Run
    friction_path: FrictionPath
    static_curve: StaticCurve
    fitted_rows: Mask
    transient_rows: int = 0
    """Number of fitted rows in which the pressure changes quickly."""
    repeat: tuple[Recording, Mask] | None = None
    """A second run of the same kind at the same level, for validation, and its fitted rows."""

    @property
    def description(self) -> str:
        """Kind and level of the run, for example `isobaric at 300 kPa`."""
        return describe_run(self.run)

    def series(self, recording: Recording, fitted_rows: Mask) -> LoopSeries:
        """The arrays of a run of this loop for a fit of friction."""
        return make_loop_series(recording, self.static_curve, self.friction_path, fitted_rows)

    @property
    def varied(self) -> str:
        """Name of the varied quantity: contraction or pressure."""
        return (
            "contraction" if {"contraction", "length"} & set(self.run.swept_columns) else "pressure"
        )

    @property
    def direction(self) -> Array:
        """Direction of the motion at the rows, shape (N,): 1 inflating or contracting, -1 deflating
        or extending.
        """
        return motion_direction(
            self.friction_path.displacement(self.recording), self.recording.columns.get("time")
        )

    def plot(self) -> Any:
        """A figure of the force over the varied quantity, by branch; rows that are not used are
        light.
        """
        recording = self.recording
        name = self.varied
        direction = self.direction
        factor, unit = display_scale(name)
        figure, axes = new_figure(width=6.0, height=3.9)
        axes.plot(
            recording[name] * factor, recording["force"], color=BLACK, linewidth=0.5, alpha=0.3
        )
        for sign, colour in ((1, BLUE), (-1, RED)):
            for used, alpha, label in (
                (~self.fitted_rows, 0.05, None),
                (self.fitted_rows, 0.8, branch_name(name, sign)),
            ):
                rows = (direction == sign) & used
                style = {
                    "marker": "o",
                    "linestyle": "none",
                    "markersize": 3,
                    "alpha": alpha,
                    "color": colour,
                }
                axes.plot(
                    recording[name][rows] * factor, recording["force"][rows], label=label, **style
                )
        axes.set(
            xlabel=f"{name} [{unit}]",
            ylabel="force [N]",
            title=f"{recording.origin}: {self.description}",
        )
        legend_below(figure, axes)
        return figure


def describe_run(run: Run) -> str:
    """Kind and level of a run, for example `isobaric at 300 kPa`."""
    if run.constant_column is None or run.constant_value is None:
        return run.kind.name
    return f"{run.kind.name} at {level_text(run.constant_column, run.constant_value)}"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LoopFit(Reported):
    """The friction laws fitted to one loop, lowest AICc first, and the reasons why others could not
    be fitted.
    """

    loop: HysteresisLoop
    fits: tuple[HysteresisFit, ...]
    failed: Mapping[str, str]

    @property
    def recommended(self) -> HysteresisFit | None:
        """The preferred law among those that the data justify, or None."""
        return preferred_fit(self.fits)

    @property
    def usable_in_plant(self) -> bool:
        """Whether the friction acts along the contraction; friction along pressure describes
        isometric loops only.
        """
        return isinstance(self.loop.friction_path, ContractionPath)

    def chapter(self) -> Chapter:
        """The description of the friction laws of the loop."""
        loop = self.loop
        best = self.recommended
        shown = best or next(iter(self.fits), None)
        plots = [Plot("loop", "Measured loop; light: rows that are not used.", loop.plot)]
        tables = [_law_table(self)]
        references = tuple[Reference, ...]()
        if shown is not None:
            chapter = shown.chapter()
            caption = (
                f"{shown.name} with the fitted parameters: initial loading, outer loop and two"
                " minor loops."
            )
            minor = functools.partial(plot_loops, shown.friction, loop.friction_path.axis)
            plots += [*chapter.plots, Plot("minor-loops", caption, minor)]
            tables += friction_tables(chapter)
            references = chapter.references
        rows = [(f.name, leaf) for f in self.fits for leaf in leaves(f.friction)]
        columns: dict[str, Any] = {
            "law": [law for law, _ in rows],
            "parameter": [leaf.path for _, leaf in rows],
            "value": TableColumn([leaf.value for _, leaf in rows], BY_ROW),
            "unit": [leaf.declared.unit for _, leaf in rows],
        }
        tables.append(Table("law-parameters", "Parameters of all laws", columns, shown=False))
        stated = {"recommended": best and best.name, "usable in a plant": self.usable_in_plant}
        return Chapter(
            "friction",
            f"{loop.recording.origin}: {loop.description}",
            tuple(_summary(self, shown)),
            values=tuple(NamedValue(name, value, brief=False) for name, value in stated.items()),
            tables=tuple(tables),
            plots=tuple(plots),
            notes=tuple(_notes(self)),
            references=references,
        )


def _summary(loop_fit: LoopFit, shown: HysteresisFit | None) -> list[str]:
    loop = loop_fit.loop
    up, down = (
        int(np.count_nonzero((loop.direction == sign) & loop.fitted_rows)) for sign in (1, -1)
    )
    rows = (
        f"{up} rows of the {branch_name(loop.varied, 1)} and {down} of the"
        f" {branch_name(loop.varied, -1)} branch are used, of {len(loop.recording)}."
    )
    if shown is None:
        return [rows]
    none = f"The data justify none of the laws; {shown.name} is shown as the best one. "
    return [f"{none if loop_fit.recommended is None else ''}{shown.verdict}", rows]


def _notes(loop_fit: LoopFit) -> list[str]:
    isometric = (
        "The loop is isometric: the pressure moved the fibres at constant length, and only a"
        " friction force over pressure is determined. Such a friction describes isometric loops and"
        " cannot be used in a plant. For a friction that can, measure a loop of contraction at"
        " constant pressure."
    )
    notes = [] if loop_fit.usable_in_plant else [isometric]
    if loop_fit.loop.repeat is not None:
        notes.append(
            f"Validated on {loop_fit.loop.repeat[0].origin}, a second run at the same level."
        )
    return [
        *notes,
        *(f"{name} was not fitted: {reason}" for name, reason in loop_fit.failed.items()),
    ]


def _law_table(loop_fit: LoopFit) -> Table:
    fits = loop_fit.fits
    repeat = "rms error on second run"
    columns: dict[str, Any] = (
        {}
        if loop_fit.loop.repeat is None
        else {
            repeat: TableColumn(
                [f.repeat_rmse for f in fits], "N", digits=3, short="on second run"
            ),
            f"{repeat} without friction": TableColumn(
                [f.repeat_rmse_without_friction for f in fits], "N", "", 3, False
            ),
            "repeatability": TableColumn(
                [f.repeatability for f in fits], "N", digits=3, brief=False
            ),
        }
    )
    columns |= {
        "branch gap without friction": TableColumn([f.gap for f in fits], "N", brief=False),
        "remaining branch gap": TableColumn([f.residual_gap for f in fits], "N", digits=3),
        "not determined": TableColumn([", ".join(f.undetermined) for f in fits], brief=False),
    }
    return compared_laws("laws", "Friction laws, best first", fits, columns)


def compared_laws(
    name: str, title: str, fits: Sequence[FrictionFit], further_columns: dict[str, Any]
) -> Table:
    """Return the errors and the tests of friction laws, with columns of their own."""
    columns: dict[str, Any] = {
        "law": [f.name for f in fits],
        "rms error without friction": TableColumn(
            [f.rmse_without_friction for f in fits], "N", digits=3, brief=False
        ),
        "rms error": TableColumn([f.rmse for f in fits], "N", digits=3),
        **further_columns,
        "reduction of AICc": [
            f.aicc_reduction if np.isfinite(f.aicc_reduction) else None for f in fits
        ],
        P_VALUE: TableColumn([f.p_value for f in fits], brief=False),
        "justified": [f.justified for f in fits],
    }
    return Table(name, title, columns, brief=len(fits))


def friction_tables(chapter: Chapter) -> list[Table]:
    """Return the tables of the chapter of a friction, as parts of another one."""
    return [
        dataclasses.replace(table, name=f"friction-{table.name}", brief=0)
        for table in chapter.tables
    ]


TURNING_POINTS = (2.0, -2.0, -0.6, -1.1, -0.6, 0.5, -0.3, 0.5, 2.0)
ROWS_PER_LEG = 200
"""Turning points of the path of `plot_loops`, as multiples of the presliding distance of the law,
and rows between two of them (chosen)."""
INNER_LOOPS = ((3, 5), (6, 8))
"""Legs of the path that form the inner loops, first and last plus one."""


def loop_path(distance: float) -> Array:
    """A path [m] from rest around an outer loop with two inner loops, scaled by a distance [m]."""
    turning_points = itertools.pairwise((0.0, *TURNING_POINTS))
    legs = [np.linspace(a, b, ROWS_PER_LEG, endpoint=False) for a, b in turning_points]
    return distance * np.concatenate([*legs, [TURNING_POINTS[-1]]])


def plot_loops(friction: Friction, axis: Axis = MILLIMETRES) -> Any:
    """Friction force over displacement: from rest, around the outer loop, through two inner loops.
    Returns a Matplotlib figure."""
    path = loop_path(friction.presliding_distance or 1e-3)
    force = friction.force_along(path)
    outer = force.copy()
    parts = [(force, 0, 1, "from rest", 1)]
    for (a, b), name in zip(INNER_LOOPS, ("inner loops", ""), strict=True):
        outer[a * ROWS_PER_LEG + 1 : b * ROWS_PER_LEG] = np.nan
        parts.append((force, a, b, name, 2))
    figure, axes = new_figure(width=5.6, height=3.9)
    for values, a, b, name, style in [(outer, 1, len(TURNING_POINTS), "outer loop", 0), *parts]:
        rows = slice(a * ROWS_PER_LEG, b * ROWS_PER_LEG + 1)
        label = name or None
        axes.plot(
            path[rows] * axis.factor,
            values[rows],
            color=LINES[style],
            linestyle=DASHES[style],
            label=label,
        )
    axes.set(xlabel=axis.label, ylabel="friction [N]", title=type(friction).__name__)
    legend_below(figure, axes, 3)
    return figure
