"""Result of a tuning with its chapter: best gains, cases, history of the search and response."""

import contextlib
import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...bench.reported import Reported
from ...core import AirmuscleError, Reference, cite, leaves, published
from ...core.plotting import BLACK, BLUE, ORANGE, RED, SKY, legend_below, new_figure
from ...engine.loop import SETPOINT, ControlLoop, parameter_units
from ...engine.run import Integrator, simulate
from ...files.scenario import signal_units
from ...recording import Recording
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from . import LoopCase, RuleSettings, TrackingIndex, TuningHistory
from .case import GainRange, loop_with_gains
from .objective import Objective

HANSEN2016 = published("hansen-2016")
DISPLAY = {"Pa": (1e-5, "bar"), "m": (1e3, "mm"), "rad": (180 / np.pi, "deg")}
"""Factor and unit in which the controlled column is displayed."""
COSTS = {"air": (1e3, "mean air drawn [g/s]"), "travel": (1.0, "mean travel [strokes/s]")}
"""Factor and axis label of the metrics that are compared with the error."""
MAX_BRIEF = 10
"""Rows of the brief view (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Tuning(Reported):
    """The result of tuning: the gains with the smallest objective.

    cases, ranges    for which and within which the gains were sought
    index, scales    tracking index, and the controlled columns of the nominal case with their
                     scales
    criterion        the objective, a function of CaseMetrics
    history          every set of gains that was simulated
    start            1 if the history begins with the present gains of the controller, otherwise 0
    converged        whether the two best descents of the search agree
    interrupted      whether the user stopped the search
    """

    cases: tuple[LoopCase, ...]
    ranges: tuple[GainRange, ...]
    index: TrackingIndex
    scales: Mapping[str, float]
    criterion: Objective
    duration: float
    start_time: float
    seed: int
    simulations: int
    history: TuningHistory
    start: int
    converged: bool
    interrupted: bool = False

    @property
    def best(self) -> int:
        """The place of the best set of gains in the history."""
        return int(np.argmin(self.history.objective))

    @property
    def gains(self) -> dict[str, float]:
        """The best gains [SI] by path."""
        return dict(zip(self.history.paths, self.history.gains[self.best].tolist(), strict=True))

    @property
    def objective(self) -> float:
        """The objective of the best gains."""
        return float(self.history.objective[self.best])

    @property
    def present_objective(self) -> float | None:
        """The objective of the loop's own gains; None if one of them is outside its range."""
        return float(self.history.objective[0]) if self.start else None

    @property
    def loop(self) -> ControlLoop:
        """The loop of the first case with the best gains."""
        return loop_with_gains(self.cases[0], self.gains)

    @property
    def simulated_loops(self) -> int:
        """The number of loops that were simulated."""
        return len(self.history) * len(self.cases)

    @property
    def on_bound(self) -> Mapping[str, float]:
        """The best gains that lie on a bound of their range, within 1 % of it."""
        gains = self.gains
        places = {
            gain_range.path: float(gain_range.to_unit(np.array(gains[gain_range.path])))
            for gain_range in self.ranges
        }
        return {path: gains[path] for path, place in places.items() if not 0.01 <= place <= 0.99}

    @property
    def references(self) -> list[Reference]:
        """Sources of the optimiser, of the index, the controller and the plants."""
        return [
            HANSEN2016,
            *cite((self.index, *((case.loop.controller, case.plant) for case in self.cases))),
        ]

    def chapter(
        self,
        title: str = "",
        notes: Sequence[str] = (),
        rules: Sequence[RuleSettings] = (),
        integrator: Integrator | None = None,
    ) -> Chapter:
        """The description of the tuning: gains, cases, figures and settings.

        title       that of the scenario; by default it names the controller
        rules       settings of tuning rules that were among the starts
        integrator  of the runs of the nominal case in the figure of the response
        """
        case = self.cases[0]
        units = signal_units(case.plant, case.start())
        units = {**units, **parameter_units(case.controller, units)}
        error = "1" if self.index.scales else units.get(next(iter(self.scales))) or "1"
        unit = self.index.unit(error)
        captions = {
            "convergence": "Objective over the simulations; a failed set of gains is not drawn.",
            "pareto": (
                "Mean tracking index over the cases against mean air drawn and travel of commands,"
                " with Pareto fronts."
            ),
            "response": "Nominal case with present and tuned gains.",
        }
        figures = (
            self._convergence_figure,
            partial(self._pareto_figure, unit),
            partial(self._response_figure, error, integrator),
        )
        values = {
            "objective": self.objective,
            "objective with the present gains": self.present_objective,
            "simulated loops": self.simulated_loops,
            "sets of gains": len(self.history),
            "seed": self.seed,
            "interrupted": self.interrupted,
        }
        bound = [
            f"'{path}' is on a bound of its range; a wider range may give a smaller objective"
            for path in self.on_bound
        ]
        tables = (
            self._gain_table(units),
            self._case_table(unit),
            *([rule_table(rules)] if rules else []),
        )
        return Chapter(
            "tuning",
            title or f"Tuning of {type(case.controller).__name__}",
            self._summary(),
            tables=tables,
            values=tuple(NamedValue(name, value, brief=False) for name, value in values.items()),
            plots=tuple(
                Plot(*item, figure) for item, figure in zip(captions.items(), figures, strict=True)
            ),
            notes=(*notes, *bound),
            references=(*self.references, *cite(tuple(rules))),
            chosen=self._settings(),
        )

    def _summary(self) -> str:
        present = self.present_objective
        before = "" if present is None else f"; with the present gains it is {present:.4g}"
        parts = [
            f"{self.simulated_loops} loops were simulated: {len(self.history)} sets of gains in "
            f"{len(self.cases)} cases. The objective is {self.objective:.4g}{before}."
        ]
        failed = int(np.count_nonzero(~np.isfinite(self.history.objective)))
        if failed:
            parts.append(f"{failed} sets of gains failed in at least one case.")
        if self.interrupted:
            parts.append(
                f"The search was interrupted before its {self.simulations} simulations were used."
            )
        return " ".join(parts)

    def _gain_table(self, units: Mapping[str, str]) -> Table:
        """The gains before and after, with their ranges."""
        present = {leaf.path: leaf.value for leaf in leaves(self.cases[0].controller)}
        columns: dict[str, Any] = {
            "gain": [gain_range.path for gain_range in self.ranges],
            "minimum": TableColumn([gain_range.low for gain_range in self.ranges], BY_ROW),
            "maximum": TableColumn([gain_range.high for gain_range in self.ranges], BY_ROW),
            "present": TableColumn(
                [present[gain_range.path] for gain_range in self.ranges], BY_ROW
            ),
            "tuned": TableColumn(
                [self.gains[gain_range.path] for gain_range in self.ranges], BY_ROW
            ),
            "unit": [units.get(gain_range.path, "") for gain_range in self.ranges],
        }
        return Table("gains", "Gains", columns, brief=MAX_BRIEF)

    def _case_table(self, unit: str) -> Table:
        """The metrics of every case with the present gains, if these were simulated, and with the
        tuned gains.
        """
        metrics = self.history.metrics
        best = self.best
        columns: dict[str, Any] = {"case": [case.name for case in self.cases]}
        if self.start:
            columns["index, present gains"] = TableColumn(metrics.index[0], unit)
        columns["index, tuned gains"] = TableColumn(metrics.index[best], unit)
        columns["air drawn"] = TableColumn(metrics.air[best], "kg/s", "g/s")
        columns["travel"] = TableColumn(metrics.travel[best], "strokes/s")
        return Table(
            "cases", "Cases", columns, f"Index: {type(self.index).__name__}.", brief=MAX_BRIEF
        )

    def _settings(self) -> tuple[tuple[str, str, str], ...]:
        controller = self.cases[0].controller
        return (
            ("controller", type(controller).__name__, "scenario"),
            ("index", str(self.index), "chosen"),
            ("objective", str(self.criterion), "chosen"),
            (
                "optimiser",
                f"CMA-ES, seed {self.seed}, at most {self.simulations} simulations",
                "chosen",
            ),
            ("duration of a run", f"{self.duration:g} s", "scenario"),
        )

    def _convergence_figure(self) -> Any:
        """The objective of every set of gains, and the smallest so far, over the number of
        simulated loops.
        """
        figure, axis = new_figure(height=3.0)
        history = self.history
        loops = np.arange(1, len(history) + 1) * len(self.cases)
        finite = np.isfinite(history.objective)
        axis.plot(
            loops[finite],
            history.objective[finite],
            "o",
            color=SKY,
            markersize=2.5,
            label="set of gains",
        )
        axis.plot(loops, history.best_so_far, color=BLUE, label="smallest so far")
        if self.present_objective is not None and np.isfinite(self.present_objective):
            axis.axhline(
                self.present_objective,
                color=RED,
                linestyle="--",
                linewidth=1.0,
                label="present gains",
            )
        axis.set(xlabel="simulated loops", ylabel="objective", yscale="log")
        _plain_numbers(axis)
        legend_below(figure, axis, columns=3)
        return figure

    def _pareto_figure(self, unit: str) -> Any:
        """Mean index against mean air drawn and travel of the commands of all sets of gains, with
        the Pareto fronts.
        """
        history = self.history
        factor, shown = _display(unit)
        costs = [name for name in COSTS if np.isfinite(history.means(name)).any()]
        figure, axes = new_figure(
            1, len(costs), height=3.2, width=3.15 * max(len(costs), 1.4), squeeze=False
        )
        error = history.means("index") * factor
        for axis, name in zip(axes[0], costs, strict=True):
            scale, label = COSTS[name]
            cost = history.means(name) * scale
            front = history.pareto(name)
            axis.plot(cost, error, "o", color=SKY, markersize=2.5, label="set of gains")
            axis.plot(
                cost[front],
                error[front],
                "o-",
                color=ORANGE,
                markersize=3,
                linewidth=1.0,
                label="Pareto front",
            )
            if self.start:
                axis.plot(cost[0], error[0], "s", color=RED, markersize=6, label="present gains")
            axis.plot(
                cost[self.best],
                error[self.best],
                "D",
                color=BLUE,
                markersize=6,
                label="tuned gains",
            )
            axis.set(
                xlabel=label,
                ylabel=f"mean index [{shown}]" if shown else "mean index",
                yscale="log",
            )
            _plain_numbers(axis)
        legend_below(figure, axes[0, 0], columns=4)
        return figure

    def _response_figure(self, unit: str, integrator: Integrator | None) -> Any:
        """The controlled column of the nominal case, with its set point; a run that fails is left
        out.
        """
        case = self.cases[0]
        column = next(iter(self.scales))
        factor, shown = _display(unit)
        figure, axis = new_figure(height=3.0)
        run: Recording | None = None
        for name, gains, colour in (("present gains", {}, RED), ("tuned gains", self.gains, BLUE)):
            loop = loop_with_gains(case, gains)
            with contextlib.suppress(AirmuscleError):
                run = simulate(
                    case.plant,
                    loop,
                    duration=self.duration,
                    start_time=self.start_time,
                    initial_state=case.start(),
                    output_times=loop.sample_time,
                    integrator=integrator,
                )
                axis.plot(run["time"], run[column] * factor, color=colour, label=name)
        if run is not None:
            wanted = run[f"{SETPOINT}{column}"] * factor
            style = {"drawstyle": "steps-post", "linestyle": "--"}
            axis.plot(run["time"], wanted, color=BLACK, linewidth=0.9, label="set point", **style)
        axis.set(xlabel="time [s]", ylabel=f"{column} [{shown}]" if shown else column)
        legend_below(figure, axis, columns=4)
        return figure


def _plain_numbers(axis: Any) -> None:
    """Numbers without powers on a logarithmic axis."""
    axis.yaxis.set_major_formatter("{x:g}")
    axis.yaxis.set_minor_formatter("{x:g}")


def _display(unit: str) -> tuple[float, str]:
    """Factor and unit in which a quantity that begins with an SI unit is displayed: Pa s in bar
    s.
    """
    first, _, rest = ("" if unit == "1" else unit).partition(" ")
    factor, shown = DISPLAY.get(first, (1.0, first))
    return factor, f"{shown} {rest}".strip()


def rule_table(rules: Sequence[RuleSettings]) -> Table:
    """The settings of tuning rules."""
    columns: dict[str, Any] = {
        "rule": [settings.rule for settings in rules],
        "gain": [settings.gain for settings in rules],
        "integral time": TableColumn([settings.integral_time for settings in rules], "s"),
        "derivative time": TableColumn([settings.derivative_time for settings in rules], "s"),
        "set-point weight": [settings.setpoint_weight for settings in rules],
    }
    title = "Settings of tuning rules, among the starts"
    return Table("rules", title, columns, "The gain is in SI units.", brief=len(rules))
