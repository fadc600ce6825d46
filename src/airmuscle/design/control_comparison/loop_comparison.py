"""Comparison of control loops on one plant and its truths; the result with its chapter."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...bench.reported import Reported, unit_column
from ...core import Array, Reference, cite, counted
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from .compared_loops import (
    ComparedLoop,
    ComparedPlant,
    LoopRun,
    RunName,
    RunSettings,
    counted_plants,
)
from .loop_figures import loop_error_figure, loop_run_figure
from .scores import Spread, mean_ratios, order_columns, spread
from .signals import RATED_STROKES

MAX_BRIEF = 10
"""Rows of the brief view (chosen)."""
ABOUT_EQUAL = 0.02
"""Relative difference of two scores below which no order is stated (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LoopComparison(Reported):
    """The runs of control loops on a nominal plant and on truths.

    loops     with their names, in the order given
    plants    the nominal one first
    columns   that have a set point in every loop
    runs      of each loop on each plant
    spreads   from which the truths were drawn, as texts
    notes     on the task, such as what a rig replaces
    """

    loops: tuple[ComparedLoop, ...]
    plants: tuple[ComparedPlant, ...]
    columns: tuple[str, ...]
    settings: RunSettings
    runs: Mapping[RunName, LoopRun]
    spreads: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the loops."""
        return tuple(compared.name for compared in self.loops)

    def values(self, loop: str, metric: str, column: str = "") -> Array:
        """A metric of a loop (plants,); of an error that of a column. Infinite where a run ended
        early.
        """
        values = list[float]()
        for plant in self.plants:
            metrics = self.runs[RunName(loop, plant.name)].metrics
            value = math.inf if metrics is None else getattr(metrics, metric)
            values.append(value[column] if isinstance(value, Mapping) else float(value))
        return np.array(values)

    def ratios(self) -> dict[str, Array]:
        """The score of each loop (1, plants): the geometric mean over the columns of the ratio of
        its rms error to the smallest on the same plant.
        """
        errors = np.array(
            [[self.values(name, "rmse", column) for column in self.columns] for name in self.names]
        )
        ratios = mean_ratios(self.names, errors)
        return {name: values[None, :] for name, values in ratios.items()}

    def scores(self) -> dict[str, Spread]:
        """The scores over the plants, ascending by their medians."""
        scores = {name: spread(values) for name, values in self.ratios().items()}
        return dict(sorted(scores.items(), key=lambda item: item[1].median))

    @property
    def references(self) -> tuple[Reference, ...]:
        """Sources of the plants and of the controllers."""
        controllers = tuple(compared.loop.controller for compared in self.loops)
        return tuple(cite((*(compared.plant for compared in self.plants), *controllers)))

    def chapter(self) -> Chapter:
        """The description of the comparison: ranking, errors, costs, margins, truths and runs."""
        tables = (
            self.ranking_table(),
            self.error_table(),
            self.cost_table(),
            self.margin_table(),
            self.order_table(),
            self.truth_table(),
            self.metrics_table(),
            self.failure_table(),
        )
        captions = {
            "errors": "RMS error of each controller on each plant.",
            "runs": "Controlled columns and commands on the nominal plant.",
        }
        figures = (
            partial(loop_error_figure, self.error_series(), self.columns),
            partial(loop_run_figure, self._nominal_runs(), self.columns),
        )
        completed = [run.metrics is not None for run in self.runs.values()]
        return Chapter(
            "compare",
            f"Comparison of {counted(len(self.loops), 'controller')}",
            self._summary(),
            values=(
                NamedValue("plants", len(self.plants), brief=False),
                NamedValue("runs", len(completed), brief=False),
                NamedValue("runs that ended early", completed.count(False), brief=False),
            ),
            tables=tuple(table for table in tables if table is not None),
            plots=tuple(
                Plot(*item, figure) for item, figure in zip(captions.items(), figures, strict=True)
            ),
            notes=self.notes,
            references=self.references,
            chosen=self._settings(),
        )

    def ranking_table(self) -> Table:
        """The controllers by score, and on how many plants each is the best one."""
        scores = self.scores()
        ratios = self.ratios()
        least = np.min([ratios[name][0] for name in scores], axis=0)
        completed = {
            name: float(np.isfinite(self.values(name, "effort")).mean()) for name in scores
        }
        return Table(
            "ranking",
            "Ranking",
            {
                "controller": list(scores),
                "score": [score.median for score in scores.values()],
                "lowest": [score.low for score in scores.values()],
                "highest": [score.high for score in scores.values()],
                "best on plants": [
                    int(np.count_nonzero(ratios[name][0] <= least)) for name in scores
                ],
                "runs completed": TableColumn(list(completed.values()), "1", "%", brief=False),
            },
            f"Score: rms error over the smallest one on the same plant"
            f"{', geometric mean over the columns' if len(self.columns) > 1 else ''}; 1 is the"
            f" best. Median and range over {counted_plants(self.plants)}.",
            brief=len(scores),
        )

    def error_table(self) -> Table:
        """Errors of each controller by column: nominal, median and largest over the plants."""
        rows = [(name, column) for column in self.columns for name in self.scores()]
        rmse = [self.values(name, "rmse", column) for name, column in rows]
        return Table(
            "errors",
            "Errors",
            {
                "controller": [name for name, _ in rows],
                "column": [column for _, column in rows],
                "rms, nominal": TableColumn([values[0] for values in rmse], BY_ROW),
                "rms, median": TableColumn([float(np.median(v)) for v in rmse], BY_ROW),
                "rms, largest": TableColumn([float(values.max()) for values in rmse], BY_ROW),
                "maximum, median": TableColumn(self._medians(rows, "max_error"), BY_ROW),
                "steady state, median": TableColumn(
                    self._medians(rows, "steady"), BY_ROW, brief=False
                ),
                "unit": unit_column([column for _, column in rows]),
            },
            f"From {self.settings.begin:g} s after the start on. Steady state: mean magnitude over"
            " the last tenth of the run.",
            brief=MAX_BRIEF,
        )

    def cost_table(self) -> Table:
        """Effort, strokes, valve life and air of each controller, medians over the plants."""
        names = list(self.scores())
        costs = {
            metric: [float(np.median(self.values(name, metric))) for name in names]
            for metric in ("effort", "strokes", "busiest", "air")
        }
        lives = [
            2.0 * RATED_STROKES / rate if rate > 0.0 else math.inf for rate in costs["busiest"]
        ]
        return Table(
            "costs",
            "Effort, strokes and air",
            {
                "controller": names,
                "effort": TableColumn(costs["effort"], "1", "%"),
                "strokes": TableColumn(costs["strokes"], "1/s"),
                "life of the busiest valve": TableColumn(lives, "s", "h", short="valve life"),
                "air": TableColumn(costs["air"], "kg/s", "g/s"),
            },
            "Effort: root mean square of the commands about their means, as a share of their"
            " ranges. Strokes: travel of the inputs behind their drivers, as a share of their"
            f" ranges. Life: at {RATED_STROKES:g} openings (chosen: give that of your valve), for"
            " inputs that are valves. Air: what flows into the muscles.",
            brief=len(names),
        )

    def margin_table(self) -> Table:
        """Margins of each loop at the end of its nominal run, or why there are none."""
        rows = [
            (name, opened)
            for name in self.names
            for opened in self.runs[RunName(name, self.plants[0].name)].margins
        ]
        margins = [opened.margins for _, opened in rows]

        def column(field: str) -> list[float | None]:
            return [None if opened is None else getattr(opened, field) for opened in margins]

        return Table(
            "margins",
            "Margins",
            {
                "controller": [name for name, _ in rows],
                "opened at": [opened.column for _, opened in rows],
                "gain margin": TableColumn(column("gain"), "1"),
                "phase margin": TableColumn(column("phase"), "rad", "deg"),
                "delay margin": TableColumn(column("delay"), "s", "ms"),
                "sensitivity peak": TableColumn(column("peak"), "1"),
                "remark": TableColumn([opened.reason for _, opened in rows], brief=False),
            },
            "At the end of the nominal run, or at the equilibrium at its last pressures.",
            brief=[i for i, opened in enumerate(margins) if opened is not None][:MAX_BRIEF],
        )

    def order_table(self) -> Table | None:
        """On how many plants one controller is better than another one; None for one plant."""
        if len(self.plants) < 2 or len(self.loops) < 2:
            return None
        columns: dict[str, Any] = order_columns(list(self.scores()), self._by_plant())
        return Table(
            "order",
            "Order",
            columns,
            f"Number of plants, of {len(self.plants)}, on which a controller has a smaller score"
            " than another one.",
        )

    def truth_table(self) -> Table | None:
        """The drawn parameters of each truth; None without truths."""
        truths = self.plants[1:]
        if not truths:
            return None
        columns: dict[str, Any] = {"plant": [truth.name for truth in truths]}
        for path in dict.fromkeys(path for truth in truths for path in truth.values):
            columns[path] = [truth.values.get(path) for truth in truths]
        if any(truth.delay for truth in truths):
            columns["unknown dead time [samples]"] = [truth.delay for truth in truths]
        return Table("truths", "Truths", columns, "Drawn parameters in SI units.", head=MAX_BRIEF)

    def metrics_table(self) -> Table:
        """All metrics, one row for each run and column, in SI units."""
        rows = [
            (run_name, column, run.metrics)
            for run_name, run in self.runs.items()
            for column in self.columns
            if run.metrics is not None
        ]
        columns: dict[str, Any] = {
            "controller": [name.loop for name, _, _ in rows],
            "plant": [name.plant for name, _, _ in rows],
            "column": [column for _, column, _ in rows],
            "rms error": [m.rmse[column] for _, column, m in rows],
            "maximum error": [m.max_error[column] for _, column, m in rows],
            "steady-state error": [m.steady[column] for _, column, m in rows],
            "effort": [m.effort for _, _, m in rows],
            "strokes": [m.strokes for _, _, m in rows],
            "air": [m.air for _, _, m in rows],
        }
        return Table("metrics", "All metrics", columns, "In SI units.", shown=False)

    def failure_table(self) -> Table | None:
        """The runs that ended early, with their reasons; None if there are none."""
        failed = [(name, run.reason) for name, run in self.runs.items() if run.metrics is None]
        if not failed:
            return None
        return Table(
            "failed",
            "Runs that ended early",
            {
                "controller": [name.loop for name, _ in failed],
                "plant": [name.plant for name, _ in failed],
                "reason": [reason for _, reason in failed],
            },
            brief=MAX_BRIEF,
        )

    def error_series(self) -> dict[str, dict[str, Array]]:
        """RMS errors (plants,) [SI] by column and controller, for the figure of errors."""
        return {
            column: {name: self.values(name, "rmse", column) for name in self.names}
            for column in self.columns
        }

    def _nominal_runs(self) -> dict[str, Any]:
        nominal = self.plants[0].name
        return {name: self.runs[RunName(name, nominal)].recording for name in self.names}

    def _by_plant(self) -> dict[str, Array]:
        return self.ratios()

    def _medians(self, rows: Sequence[tuple[str, str]], metric: str) -> list[float]:
        return [float(np.median(self.values(name, metric, column))) for name, column in rows]

    def _summary(self) -> tuple[str, str]:
        scores = self.scores()
        names = list(scores)
        best = names[0]
        if not math.isfinite(scores[best].median):
            first = "No controller completed its runs on most of the plants."
        elif len(names) == 1:
            first = f"One controller, {best}, on {counted_plants(self.plants)}."
        else:
            first = self._order_sentence(names)
        controlled = " and ".join(self.columns)
        second = (
            f"{counted(len(names), 'controller')} with set points of {controlled} ran for"
            f" {self.settings.duration:g} s on {counted_plants(self.plants)}."
        )
        drawn = f" Truths are drawn from {'; '.join(self.spreads)}." if self.spreads else ""
        return first, second + drawn

    def _order_sentence(self, names: Sequence[str]) -> str:
        """Which controller has the smallest error, by how much, and on how many plants."""
        ratios = self.ratios()
        best, second = names[:2]
        better = int((ratios[best][0] < ratios[second][0]).sum())
        factor = float(np.median(ratios[second][0] / ratios[best][0]))
        count = counted(len(self.plants), "plant")
        errors = "rms error" if len(self.columns) == 1 else "rms errors"
        if not factor > 1.0 + ABOUT_EQUAL:
            return (
                f"{best} and {second} have about the same {errors}: the ratio is {factor:.3g} in"
                f" the median, and {best} has the smaller one on {better} of {count}."
            )
        return (
            f"{best} has the smallest {errors}: those of {second}, the next one, are"
            f" {factor:.3g} times as large in the median, and larger on {better} of {count}."
        )

    def _settings(self) -> tuple[tuple[str, str, str], ...]:
        settings = self.settings
        loops = tuple(
            (
                f"controller {compared.name}",
                f"{type(compared.loop.controller).__name__}, sample time"
                f" {1e3 * compared.loop.sample_time:g} ms",
                "scenario",
            )
            for compared in self.loops
        )
        return (
            *loops,
            ("duration of a run", f"{settings.duration:g} s", "scenario"),
            ("judged from", f"{settings.begin:g} s after the start", "chosen"),
            *((f"spread {i}", text, "chosen") for i, text in enumerate(self.spreads, 1)),
        )
