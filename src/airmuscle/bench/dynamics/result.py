"""DynamicFit: estimates, standard errors, goodness of fit, undetermined combinations of parameters,
profile and figure; location of the pressure sensor in a fill by two fits."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import Array, IdentificationError, check_known, counted, tree
from ...core.plotting import BLACK, RED, given_axes, legend_outside, new_figure
from ...engine.compile import System
from ...recording import Recording
from ...recording.columns import display_scale
from ...report.chapter import BY_ROW, Chapter, NamedValue, Plot, Table, TableColumn
from ...report.parameter_tables import estimate_table
from ...report.shown import BRIEF_ROWS
from ..estimation import Estimate, Identifiability, SolvedProblem
from ..reported import Reported, unit_column
from .experiment import Unknown
from .problem import DynamicFitProblem
from .reliability import Optimum, scatter_of_records, searches_at_lowest

NORMAL_95 = 1.96
"""Square root of the cost increase, in residual variances, at the limits of a 95 % confidence
interval.
"""
MAX_STANDARD_ERRORS = 4.0
"""Range of a profile in standard errors to either side, at most twice the estimate of a
parameter.
"""
MIN_IMPROVEMENT = 0.1
"""Reduction of the sum of squares, in residual variances, that shows that the fit was not
converged; chosen.
"""


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicProfile:
    """Values of one estimate in increasing order, and the increase of the sum of squares in
    residual variances.
    """

    name: str
    unit: str
    values: Array
    cost_increase: Array
    estimates: Array
    """All estimates at every value [SI], shape (M, P)."""

    @property
    def interval(self) -> tuple[float, float]:
        """Limits of the 95 % interval, where the cost increase is 1.96 squared; NaN where it stays
        below, or where the plant cannot be simulated before it is reached."""
        best = int(np.argmin(self.cost_increase))
        increase = self.cost_increase - self.cost_increase[best]
        distance = np.sqrt(np.maximum(increase, 0.0))
        downward = slice(best, None, -1)
        upward = slice(best, None)
        low = self._find_crossing(self.values[downward], distance[downward])
        high = self._find_crossing(self.values[upward], distance[upward])
        return low, high

    @staticmethod
    def _find_crossing(values: Array, distance: Array) -> float:
        above = np.flatnonzero(distance > NORMAL_95)
        if not above.size or not np.isfinite(distance[above[0]]):
            return float("nan")
        after = int(above[0])
        before = after - 1
        step = distance[after] - distance[before]
        fraction = (NORMAL_95 - distance[before]) / step
        return float(values[before] + fraction * (values[after] - values[before]))

    def __str__(self) -> str:
        low, high = (f"{end:.4g}" if np.isfinite(end) else "unbounded" for end in self.interval)
        rows = [
            f"\n  {v:.4g}: {c:.3g}" for v, c in zip(self.values, self.cost_increase, strict=True)
        ]
        if self.cost_increase.min() < -MIN_IMPROVEMENT:
            rows.append("\n  a better fit was found on the profile: fit again from there")
        unit = "" if self.unit == "1" else f" [{self.unit}]"
        text = "increase of the sum of squares in residual variances"
        return (
            f"{self.name}{unit}, 95 % confidence interval {low} to {high}; {text}:{''.join(rows)}"
        )


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class DynamicFit(Reported):
    """Plant parameters estimated from transient records; `print` it."""

    problem: DynamicFitProblem
    estimates: tuple[Estimate, ...]
    correlations: Array
    """Correlation matrix of the estimates, in their order, shape (P, P)."""
    identifiability: Identifiability
    residual_std: float
    """Standard deviation of the residuals relative to the sensors, with N - P degrees of
    freedom.
    """
    costs: Array
    """Sums of squared residuals of the searches, lowest first; infinite where an initial guess
    failed.
    """
    optima: tuple[Optimum, ...]
    """The distinct optima of the searches, lowest first."""
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Estimate:
        """An estimate by its name, such as `start time of record 2`. Raises ParameterError."""
        names = [e.name for e in self.estimates]
        check_known("the fit has no unknown", name, names, "it has")
        return self.estimates[names.index(name)]

    @property
    def values(self) -> Array:
        """Estimated values [SI], shape (P,)."""
        return np.array([e.value for e in self.estimates])

    @property
    def solved(self) -> SolvedProblem:
        """The problem with the estimates: covariance by records, profiles, bootstrap."""
        return SolvedProblem(self.problem, self.values)

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The unknowns of the fit, in the order of the estimates."""
        return self.problem.unknowns

    @property
    def starts_at_optimum(self) -> int:
        """Number of searches that reached the lowest sum of squares, within 0.1 %."""
        return searches_at_lowest(self.costs)

    def with_scatter_of_records(self, common: Sequence[Mapping[str, float]]) -> "DynamicFit":
        """The fit whose standard errors contain the scatter of the records: `common` are the common
        parameters of the fits without each of them in turn, from `cross_predict`."""
        estimates, notes = scatter_of_records(self.estimates, common)
        return dataclasses.replace(self, estimates=estimates, notes=(*self.notes, *notes))

    def plant(self, record: int = 0) -> System:
        """The plant of one record with the estimated parameters."""
        model = self.problem.record_models[record]
        return tree.with_parameters(model.plant, [float(v) for v in model.leaves(self.values)])

    def modelled(self, record: int = 0) -> Recording:
        """The observed quantities of the fitted plant at the rows of one record [SI]."""
        model = self.problem.record_models[record]
        values = model.evaluate(self.values).values
        columns = {name: values[:, i] for i, name in enumerate(model.names)}
        return Recording(
            {"time": model.times, **columns}, f"fit to {model.experiment.recording.origin}"
        )

    def residuals(self, record: int = 0) -> Recording:
        """Residuals (model - measured) at the rows of one record [SI]."""
        model = self.problem.record_models[record]
        modelled = self.modelled(record)
        measured = model.experiment.recording
        differences = {name: modelled[name] - measured[name] for name in model.names}
        return Recording({"time": model.times, **differences}, f"residuals of {measured.origin}")

    def rms(self, name: str, record: int = 0) -> float:
        """Root mean square residual of an observed quantity in one record [SI]."""
        return float(np.sqrt(np.nanmean(self.residuals(record)[name] ** 2)))

    def profile(self, name: str, points: int = 9) -> DynamicProfile:
        """The profile likelihood of one estimate at `points` values to either side, from the
        optimum outwards; all others are fitted again."""
        index = self.estimates.index(self[name])
        problem = self.problem
        best = self.values
        low, high = (float(bound[index]) for bound in problem.bounds)
        stderr = self.estimates[index].stderr
        span = high - low
        if problem.unknowns[
            index
        ].paths:  # the zero of a clock or of an initial value gives no range
            span = min(span, 2.0 * abs(float(best[index])) or problem.unknowns[index].scale)
        distance = min(MAX_STANDARD_ERRORS * stderr, span) if np.isfinite(stderr) else span
        rows = [(best[index], self.costs[0], best)]
        for side in (-1.0, 1.0):
            values = best.copy()
            for step in range(1, points + 1):
                value = best[index] + side * distance * step / points
                if not low <= value <= high:
                    break
                values = values.copy()
                values[index] = value
                values, cost = problem.solve(values, fixed=(index,))
                rows.append((value, cost, values))
        rows.sort(key=lambda row: row[0])
        variance = max(self.residual_std, 1e-300) ** 2
        increase = np.array([(cost - self.costs[0]) / variance for _, cost, _ in rows])
        profiled = np.array([value for value, _, _ in rows])
        estimates = np.array([values for _, _, values in rows])
        return DynamicProfile(name, self.estimates[index].unit, profiled, increase, estimates)

    def plot(self, record: int = 0, *, ax: Any = None) -> Any:
        """Plot the observed quantities of one record, measured and modelled, one panel each. `ax`
        is an Axes, or a sequence of one for each quantity, and is returned; without it a figure is
        returned. Raises ParameterError if `ax` contains too few Axes."""
        model = self.problem.record_models[record]
        modelled = self.modelled(record)
        measured = model.experiment.recording
        names = model.names
        figure = None
        if ax is None:
            figure, axes = new_figure(
                len(names), 1, height=0.6 + 1.7 * len(names), sharex=True, squeeze=False
            )
            figure.suptitle(measured.origin, fontsize=9)
        panels = (
            list(axes[:, 0]) if ax is None else given_axes(ax, len(names), "plot of a dynamic fit")
        )
        for name, axis in zip(names, panels, strict=False):
            factor, unit = display_scale(name)
            dots = {"linestyle": "none", "marker": ".", "markersize": 2.5, "color": BLACK}
            axis.plot(modelled["time"], factor * measured[name], label="measured", **dots)
            axis.plot(
                modelled["time"], factor * modelled[name], color=RED, linewidth=1.0, label="model"
            )
            axis.set_ylabel(f"{name}\n[{unit}]" if unit else name)
            legend_outside(axis)
        panels[len(names) - 1].set_xlabel("time [s]")
        return figure if ax is None else ax

    def chapter(self) -> Chapter:
        """The description of the fit: estimates, residuals of each record, identifiability, the
        records' courses.
        """
        inner = self.identifiability.singular_values.size
        determined = inner - len(self.identifiability.undetermined)
        searches = self.costs.size
        reached = f"{self.starts_at_optimum} of {searches} searches reached this optimum"
        if searches == 1:
            reached = "one search, so other optima were not sought; increase the number of starts"
        summary = (
            f"Residual standard deviation {self.residual_std:.3g} times that of the sensors;"
            f" {determined} of {counted(inner, 'combination')} of the unknowns that are not on a"
            f" bound {'is' if determined == 1 else 'are'} determined; {reached}."
        )
        counts = {
            "determined combinations": determined,
            "unknowns not on a bound": inner,
            "searches": searches,
            "searches at the optimum": self.starts_at_optimum,
        }
        deviation = "residual standard deviation"
        remark = "relative to the sensors"
        relative = NamedValue(
            deviation, self.residual_std, "1", digits=3, remark=remark, brief=False
        )
        values = (
            relative,
            *(NamedValue(name, count, brief=False) for name, count in counts.items()),
        )
        rows = [
            (i, model.experiment.recording.origin, name)
            for i, model in enumerate(self.problem.record_models)
            for name in model.names
        ]
        columns: dict[str, Any] = {
            "record": [origin for _, origin, _ in rows],
            "quantity": [name for _, _, name in rows],
            "rms residual": TableColumn([self.rms(name, i) for i, _, name in rows], BY_ROW),
            "unit": unit_column([name for _, _, name in rows]),
        }
        residuals = Table("rms", "Residuals by record", columns, brief=BRIEF_ROWS)
        tables = (
            estimate_table(self.estimates, "estimates", "Estimates", brief=BRIEF_ROWS),
            residuals,
        )
        plots = (Plot("record", "First record, measured and modelled.", self.plot),)
        return Chapter(
            "dynamic",
            "Dynamic fit",
            summary,
            values=values,
            tables=tables,
            plots=plots,
            notes=self.notes,
        )


MIN_RELATIVE_RESIDUAL = 0.02
MIN_RESIDUAL_RATIO = 2.0
"""Rms residual relative to the pressure rise above which a model is rejected, and ratio of rms
residuals above which one model is better than another; chosen."""


@dataclasses.dataclass(frozen=True)
class SensorLocation:
    """Rms residuals [Pa] of one fill of a muscle with a growing volume and the sensor in it, and of
    a line and a muscle with the sensor in the line, and the pressure rise [Pa], from which the
    location follows."""

    rms_in_muscle: float
    rms_in_line: float
    pressure_rise: float

    @property
    def is_upstream(self) -> bool:
        """Whether the sensor is probably upstream of the muscle: the model with the line fits, the
        other does not.
        """
        rejected = self.rms_in_muscle > MIN_RELATIVE_RESIDUAL * self.pressure_rise
        return rejected and self.rms_in_line * MIN_RESIDUAL_RATIO < self.rms_in_muscle

    def __str__(self) -> str:
        rms = (
            f"rms residual {self.rms_in_muscle / 1e3:.2f} kPa for a growing volume with the sensor"
            f" in the muscle ({100 * self.rms_in_muscle / self.pressure_rise:.1f} % of the pressure"
            f" rise), {self.rms_in_line / 1e3:.2f} kPa for a line and a muscle"
        )
        if self.is_upstream:
            return f"the sensor is probably upstream of the muscle: {rms}"
        if self.rms_in_line * MIN_RESIDUAL_RATIO < self.rms_in_muscle:
            return (
                f"the sensor may be upstream of the muscle: {rms}; another model of the volume may"
                " fit as well. Record the length, or the pressure at both ends of the line"
            )
        return f"the record does not determine the location of the sensor: {rms}"


def locate_pressure_sensor(*, in_muscle: DynamicFit, in_line: DynamicFit) -> SensorLocation:
    """Locate the pressure sensor of one fill by two fits of it: sensor in the muscle, and sensor in
    the line. Both fits need physical bounds, because a valve with b = 0.9 or a muscle that grows
    tenfold would imitate a line. Raises IdentificationError where a fit is not of one pressure in
    one record, or the rows differ."""
    models = [fit.problem.record_models for fit in (in_muscle, in_line)]
    if any(len(record_models) != 1 or len(record_models[0].names) != 1 for record_models in models):
        raise IdentificationError(
            "locate_pressure_sensor compares two fits of one record with one observed pressure."
        )
    (first,), (second,) = models
    rows = first.measured[:, 0]
    line_rows = second.measured[:, 0]
    if not np.array_equal(rows, line_rows, equal_nan=True):
        difference = "but these have different rows"
        raise IdentificationError(
            f"locate_pressure_sensor compares two fits of the same record, {difference}."
        )
    rise = float(np.nanmax(rows) - np.nanmin(rows))
    return SensorLocation(in_muscle.rms(first.names[0]), in_line.rms(second.names[0]), rise)
