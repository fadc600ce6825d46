"""Friction laws of one loop with their chapter; the loop, its kind and level, and the tables of compared laws."""

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ....core import BLACK, BLUE, RED, Reference, ShortRepr, leaves, legend_below, new_figure
from ....recording import Recording
from ....recording.columns import display_scale
from ....report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ....report.formatting import P_VALUE
from ...reported import Reported
from ...segment import Mask, Run, motion_direction
from ..data_checks import level_text
from .loop_data import ContractionPath, FrictionPath, StaticCurve
from .minor_loops import plot_loops
from .result import FrictionFit, HysteresisFit, preferred_fit
from .search import LoopSeries, make_loop_series


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class HysteresisLoop(ShortRepr):
    """One run with a rising and a falling branch, the path of the friction, the static curve and the fitted rows."""

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

    def plot(self) -> Any:
        """A figure of the force over the varied quantity, by branch; rows that are not used are light."""
        recording = self.recording
        name = "contraction" if {"contraction", "length"} & set(self.run.swept_columns) else "pressure"
        factor, unit = display_scale(name)
        direction = motion_direction(self.friction_path.displacement(recording), recording.columns.get("time"))
        figure, axes = new_figure(width=6.0, height=3.9)
        axes.plot(recording[name] * factor, recording["force"], color=BLACK, linewidth=0.5, alpha=0.3)
        for sign, colour, branch in ((1, BLUE, "rising"), (-1, RED, "falling")):
            for used, alpha, label in ((~self.fitted_rows, 0.05, None), (self.fitted_rows, 0.8, branch)):
                rows = (direction == sign) & used
                style = {"marker": "o", "linestyle": "none", "markersize": 3, "alpha": alpha, "color": colour}
                axes.plot(recording[name][rows] * factor, recording["force"][rows], label=label, **style)
        axes.set(xlabel=f"{name} [{unit}]", ylabel="force [N]", title=f"{recording.origin}: {self.description}")
        legend_below(figure, axes)
        return figure


def describe_run(run: Run) -> str:
    """Kind and level of a run, for example `isobaric at 300 kPa`."""
    if run.constant_column is None or run.constant_value is None:
        return run.kind.name
    return f"{run.kind.name} at {level_text(run.constant_column, run.constant_value)}"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LoopFit(Reported):
    """The friction laws fitted to one loop, lowest AICc first, and the reasons why others could not be fitted."""

    loop: HysteresisLoop
    fits: tuple[HysteresisFit, ...]
    failed: Mapping[str, str]

    @property
    def recommended(self) -> HysteresisFit | None:
        """The preferred law among those that the data justify, or None."""
        return preferred_fit(self.fits)

    @property
    def usable_in_plant(self) -> bool:
        """Whether the friction acts along the contraction; friction along pressure describes isometric loops only."""
        return isinstance(self.loop.friction_path, ContractionPath)

    def chapter(self) -> Chapter:
        """The description of the friction laws of the loop."""
        loop, best = self.loop, self.recommended
        shown = best or next(iter(self.fits), None)
        plots = [Plot("loop", "Measured loop; light: rows that are not used.", loop.plot)]
        tables, references = [_law_table(self)], tuple[Reference, ...]()
        if shown is not None:
            own = shown.chapter()
            caption = f"{shown.name} with the fitted parameters: initial loading, outer loop and two minor loops."
            minor = functools.partial(plot_loops, shown.friction, loop.friction_path.axis)
            plots += [*own.plots, Plot("minor-loops", caption, minor)]
            tables += friction_tables(own)
            references = own.references
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
            "friction", f"{loop.recording.origin}: {loop.description}", tuple(_summary(self, shown)),
            values=tuple(NamedValue(name, value, brief=False) for name, value in stated.items()), tables=tuple(tables),
            plots=tuple(plots), notes=tuple(_notes(self)), references=references,
        )  # fmt: skip


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
    return compared_laws("laws", "Friction laws, best first", fits, columns)


def compared_laws(name: str, title: str, fits: Sequence[FrictionFit], own: dict[str, Any]) -> Table:
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


def friction_tables(chapter: Chapter) -> list[Table]:
    """Return the tables of the chapter of a friction, as parts of another one."""
    return [dataclasses.replace(table, name=f"friction-{table.name}", brief=0) for table in chapter.tables]
