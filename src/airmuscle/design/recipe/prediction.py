"""Prediction of a muscle from its recipe: isobars, free contraction and dead zone, with the spread
that the tolerances of the recipe give them.
"""

import dataclasses
import functools
import math
from typing import Any

import numpy as np

from ...bench.reported import Reported
from ...core import Array, ParameterError, cite, plotting
from ...files.library import Entry
from ...physics import (
    GAS_CONSTANT,
    REFERENCE_DENSITY,
    Ambient,
    Isothermal,
    MooneyRivlinTube,
    ValidityRange,
    absolute_pressure,
)
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
from .muscle_recipe import TOLERANCES, MuscleRecipe
from .rubber_hardness import GENT_1958, QI_2003

SAMPLES = 256
"""Drawn muscles (chosen; a power of 2, as the sequence of Sobol asks for)."""
SEED = 1
BAND = (0.025, 0.975)
"""Quantiles of the band, 95 % of the drawn muscles."""
PRESSURES = 3
CONTRACTIONS = 61
"""Isobars, and points of each (chosen)."""
POINT_PRESSURES = (1.0 / 3.0, 2.0 / 3.0, 1.0)
POINT_CONTRACTIONS = (0.0, 0.25, 0.5, 0.75)
"""The twelve points to measure, as parts of the pressure and of the free contraction (chosen)."""
WIDE_BAND = 0.5
"""Width of the band of the free contraction over it, above which a note asks for measurements
(chosen)."""


@dataclasses.dataclass(frozen=True)
class PredictedValue:
    """A predicted quantity [SI] with its 95 % band."""

    value: float
    low: float
    high: float

    @property
    def band(self) -> tuple[float, float]:
        """Lower and upper limit."""
        return (self.low, self.high)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RecipePrediction(Reported):
    """What is known of a muscle before it is made.

    law             with the middle of each dimension
    pressures       gauge pressures [Pa], shape (P,)
    contractions    shape (C,)
    forces          tension [N] of the law, shape (P, C)
    low, high       95 % band of the tension [N], shape (P, C)
    free            free contraction [1] at each pressure
    blocked         tension at rest [N] at each pressure
    threshold       pressure [Pa] below which the muscle is slack at rest
    shares          part of the variance of the free contraction at the greatest pressure, by input
    """

    recipe: MuscleRecipe
    law: MooneyRivlinTube
    pressures: Array
    contractions: Array
    forces: Array
    low: Array
    high: Array
    free: tuple[PredictedValue, ...]
    blocked: tuple[PredictedValue, ...]
    threshold: PredictedValue
    shares: dict[str, float]

    @property
    def pressure(self) -> float:
        """Greatest gauge pressure [Pa]."""
        return float(self.pressures[-1])

    def points(self) -> tuple[Array, Array]:
        """Pressures [Pa] and contractions [1] of the twelve points that settle the law."""
        pressures = []
        contractions = []
        for share in POINT_PRESSURES:
            pressure = share * self.pressure
            free = _free_contraction(
                self.law.unclamped_force(pressure, self.contractions), self.contractions
            )
            for part in POINT_CONTRACTIONS:
                pressures.append(pressure)
                contractions.append(part * free)
        return np.array(pressures), np.array(contractions)

    def points_csv(self) -> str:
        """Table of the twelve points as a file in which the forces are to be filled in."""
        pressures, contractions = self.points()
        lengths = self.recipe.resting_length * (1.0 - contractions)
        lines = ["pressure [kPa],length [mm],force [N]"]
        for pressure, length in zip(pressures, lengths, strict=True):
            lines.append(f"{pressure / 1e3:.1f},{1e3 * length:.2f},")
        return "\n".join(lines) + "\n"

    def entry(self, name: str = "recipe") -> Entry:
        """The muscle as an entry of the library, which `save` writes."""
        free = self.free[-1]
        return Entry(
            name,
            f"Braided muscle of {1e3 * self.recipe.outer_diameter:.3g} mm, predicted from its"
            " recipe",
            "chosen",
            self.law,
            self.law.geometry,
            note=(
                "Predicted from dimensions, not measured: free contraction"
                f" {100 * free.value:.3g} % ({100 * free.low:.3g} to {100 * free.high:.3g} %) at"
                f" {self.pressure / 1e3:.4g} kPa. Friction of the threads is not contained."
            ),
            validity_range=ValidityRange(0.0, self.pressure, 0.0, max(free.high, 0.01)),
            evidence="geometric model",
        )

    def chapter(self) -> Chapter:
        """The description of the prediction."""
        return Chapter(
            "recipe",
            f"A braided muscle of {1e3 * self.recipe.outer_diameter:.3g} mm before it is made",
            self._summary(),
            values=self._values(),
            tables=(self._isobar_table(), self._input_table(), self._point_table()),
            plots=(
                Plot(
                    "recipe",
                    "Predicted isobars; the bands contain 95 % of the muscles within the"
                    " tolerances, on both branches of the hysteresis.",
                    functools.partial(_isobar_figure, self),
                ),
            ),
            notes=self._notes(),
            references=(*cite(self.law), *((GENT_1958, QI_2003) if self.recipe.hardness else ())),
            chosen=tuple(
                (f"tolerance of {name.replace('_', ' ')}", _tolerance_text(name), item.source)
                for name, item in self.recipe.tolerances.items()
            ),
            opening=True,
        )

    def _summary(self) -> tuple[str, ...]:
        free = self.free[-1]
        blocked = self.blocked[-1]
        first = (
            f"At {self.pressure / 1e3:.4g} kPa this muscle contracts by {100 * free.value:.2g} %"
            f" without load ({100 * free.low:.2g} to {100 * free.high:.2g} %) and pulls"
            f" {blocked.value:.3g} N at its resting length ({blocked.low:.3g} to"
            f" {blocked.high:.3g} N)."
        )
        second = (
            "The law is the virtual work of an inextensible braid on a thick wall of incompressible"
            " rubber. The bands are those of the tolerances below, and of the friction of the"
            " threads; they are no measurement. Make one muscle, measure the twelve points, and fit"
            " the law to them."
        )
        return (first, second)

    def _values(self) -> tuple[NamedValue, ...]:
        free = self.free[-1]
        blocked = self.blocked[-1]
        law = self.law
        widest = 2.0 * float(law.geometry.radius_at(free.value))
        values = [
            NamedValue("free contraction", free.value, "1", "%", 3, _band_text(free, 100.0, "%")),
            NamedValue("blocked force", blocked.value, "N", "N", 3, _band_text(blocked, 1.0, "N")),
            NamedValue(
                "dead zone",
                self.threshold.value,
                "Pa",
                "kPa",
                3,
                _band_text(self.threshold, 1e-3, "kPa"),
            ),
            NamedValue("outer diameter at free contraction", widest, "m", "mm", 3),
            NamedValue("modulus of the tube", 6.0 * law.c1, "Pa", "MPa", 3),
        ]
        if self.recipe.threads:
            values.append(
                NamedValue("circumference covered by threads", self.recipe.cover, "1", "%", 3)
            )
        return (*values, *self._cycle_values())

    def _cycle_values(self) -> tuple[NamedValue, ...]:
        """Air and efficiency of a cycle at constant load, at the load of the greatest work."""
        cycle = best_cycle(self.law, self.pressure)
        return (
            NamedValue("load of the greatest work", cycle.load, "N", "N", 3),
            NamedValue("work of a cycle", cycle.work, "J", "J", 3),
            NamedValue("air of a cycle", cycle.air / REFERENCE_DENSITY, "m3", "l", 3, "ISO 8778"),
            NamedValue("efficiency, isothermal", cycle.work / cycle.energy, "1", "%", 3),
        )

    def _isobar_table(self) -> Table:
        rows = range(len(self.pressures))
        columns = {
            "pressure": TableColumn(self.pressures, "Pa", "kPa"),
            "free contraction": TableColumn([self.free[row].value for row in rows], "1", "%", 3),
            "band of it": TableColumn([self.free[row].band for row in rows], "1", "%", 3),
            "blocked force": TableColumn([self.blocked[row].value for row in rows], "N", "N", 3),
            "band of the force": TableColumn([self.blocked[row].band for row in rows], "N", "N", 3),
        }
        return Table("pressures", "Free contraction and blocked force", columns, brief=PRESSURES)

    def _input_table(self) -> Table:
        names = list(self.shares)
        columns = {
            "input": [name.replace("_", " ") for name in names],
            "tolerance": [_tolerance_text(name) for name in names],
            "share": TableColumn([self.shares[name] for name in names], "1", "%", 2),
        }
        note = (
            "Share: part of the variance of the free contraction at the greatest pressure. Measure"
            " the first input more accurately first."
        )
        return Table("inputs", "What makes the band wide", columns, note, brief=len(names))

    def _point_table(self) -> Table:
        pressures, contractions = self.points()
        length = self.recipe.resting_length
        columns = {
            "pressure": TableColumn(pressures, "Pa", "kPa"),
            "contraction": TableColumn(contractions, "1", "%", 3),
            "length": TableColumn(length * (1.0 - contractions), "m", "mm"),
            "predicted force": TableColumn(self.law.force(pressures, contractions), "N", "N", 3),
        }
        note = (
            "Hold the length, raise the pressure from zero, read the force; then lower it again."
            " `airmuscle fit points.csv --characteristic muscle.toml --fix"
            " geometry.braid_angle` then fits the rubber and the ends."
        )
        return Table("points", "Twelve points to measure", columns, note)

    def _notes(self) -> tuple[str, ...]:
        notes = []
        free = self.free[-1]
        if free.high - free.low > WIDE_BAND * max(free.value, 1e-9):
            first = next(iter(self.shares)).replace("_", " ")
            notes.append(
                f"The free contraction is known within {100 * (free.high - free.low):.2g} points"
                f" only; most of it is due to the {first}."
            )
        if self.recipe.braid_angle > math.radians(45.0):
            angle = math.degrees(self.recipe.braid_angle)
            notes.append(
                f"The braid is at {angle:.3g} deg on the tube, and the ideal limit is 54.7 deg:"
                " push less of it onto the tube, or take a wider sleeve, for more contraction."
            )
        return tuple(notes)


@dataclasses.dataclass(frozen=True)
class LoadCycle:
    """A cycle at a constant load between no pressure and a gauge pressure: load [N], work [J], mass
    of the air [kg] and its available energy [J], m R T ln(p/p_amb).
    """

    load: float
    work: float
    air: float
    energy: float


def best_cycle(law: MooneyRivlinTube, pressure: float) -> LoadCycle:
    """The cycle of the greatest work at a gauge pressure [Pa]: the load is lifted from the resting
    length.
    """
    limit = law.contraction_range[1]
    contractions = np.linspace(0.0, limit, 201)
    forces = law.force(pressure, contractions)
    length = law.geometry.resting_length
    work = forces * contractions * length
    place = int(np.argmax(work))
    ambient = Ambient()
    empty, full = (
        float(
            Isothermal().air_mass(
                absolute_pressure(gauge, ambient), law.geometry.volume(at), ambient
            )
        )
        for gauge, at in ((0.0, 0.0), (pressure, float(contractions[place])))
    )
    ratio = absolute_pressure(pressure, ambient) / ambient.pressure
    air = full - empty
    energy = air * GAS_CONSTANT * ambient.temperature * math.log(ratio)
    return LoadCycle(float(forces[place]), float(work[place]), air, energy)


def predict_recipe(
    recipe: MuscleRecipe, pressure: float, samples: int = SAMPLES, seed: int = SEED
) -> RecipePrediction:
    """The muscle of a recipe up to a gauge pressure [Pa], with the spread of its tolerances.

    samples  drawn muscles, a power of 2
    seed     of the draws; equal seeds give equal bands

    Raises ParameterError for a pressure that is not positive, or dimensions of no muscle.
    """
    from scipy.stats import qmc

    if not (math.isfinite(pressure) and 0.0 < pressure <= 5e6):
        raise ParameterError(
            f"predict_recipe: pressure is {pressure:g} Pa (gauge); allowed range: above 0 to"
            " 5e+06 Pa."
        )
    if samples < 16 or samples & (samples - 1):
        raise ParameterError(
            f"predict_recipe: samples is {samples}; it must be a power of 2, 16 or more."
        )
    law = recipe.law()
    pressures = pressure * np.arange(1, PRESSURES + 1) / PRESSURES
    steepest = dataclasses.replace(
        recipe, braid_angle=max(recipe.braid_angle - TOLERANCES["braid_angle"].half_width, 0.05)
    )
    greatest = max(steepest.law().contraction_range[1], 0.02)
    contractions = np.linspace(0.0, greatest, CONTRACTIONS)
    uniform = qmc.Sobol(len(recipe.tolerances), seed=seed).random(samples)
    drawn = [_drawn_forces(recipe, row, pressures, contractions) for row in uniform]
    forces = np.array([item.forces for item in drawn])
    free = np.array([[_free_contraction(row, contractions) for row in item] for item in forces])
    thresholds = np.array([item.threshold for item in drawn])
    middle = law.unclamped_force(pressures[:, np.newaxis], contractions)
    low, high = np.maximum(np.quantile(forces, BAND, axis=0), 0.0)
    return RecipePrediction(
        recipe,
        law,
        pressures,
        contractions,
        np.maximum(middle, 0.0),
        low,
        high,
        tuple(
            _spread(_free_contraction(middle[row], contractions), free[:, row])
            for row in range(PRESSURES)
        ),
        tuple(
            _spread(max(float(middle[row, 0]), 0.0), np.maximum(forces[:, row, 0], 0.0))
            for row in range(PRESSURES)
        ),
        _spread(law.threshold_pressure, thresholds),
        _variance_shares(tuple(recipe.tolerances), uniform, free[:, -1]),
    )


@dataclasses.dataclass(frozen=True)
class _DrawnMuscle:
    """Forces [N] of a drawn muscle, shape (P, C), and its dead zone [Pa]."""

    forces: Array
    threshold: float


def _drawn_forces(
    recipe: MuscleRecipe, uniform: Array, pressures: Array, contractions: Array
) -> _DrawnMuscle:
    """A muscle drawn within the tolerances, with the friction of its threads."""
    law = recipe.drawn(uniform)
    forces = law.unclamped_force(pressures[:, np.newaxis], contractions)
    place = list(recipe.tolerances).index("friction")
    share = TOLERANCES["friction"].half_width * (2.0 * uniform[place] - 1.0)
    geometry = law.geometry
    ideal_area = (
        math.pi
        * geometry.radius**2
        * (3.0 / math.tan(geometry.braid_angle) ** 2 - 1.0 / math.sin(geometry.braid_angle) ** 2)
    )
    friction = share * max(ideal_area, 0.0) * pressures[:, np.newaxis]
    return _DrawnMuscle(np.asarray(forces + friction), law.threshold_pressure)


def _free_contraction(forces: Array, contractions: Array) -> float:
    """The contraction [1] at which a falling force [N] is zero; the ends where it is not."""
    if forces[0] <= 0.0:
        return 0.0
    below = np.flatnonzero(forces <= 0.0)
    if not below.size:
        return float(contractions[-1])
    last = int(below[0])
    fall = forces[last - 1] - forces[last]
    part = float(forces[last - 1] / fall)
    return float(contractions[last - 1] + part * (contractions[last] - contractions[last - 1]))


def _spread(value: float, drawn: Array) -> PredictedValue:
    low, high = np.quantile(drawn, BAND)
    return PredictedValue(value, min(float(low), value), max(float(high), value))


def _variance_shares(names: tuple[str, ...], uniform: Array, drawn: Array) -> dict[str, float]:
    """Part of the variance of a quantity that a linear model of each input explains, the greatest
    first.
    """
    centred = uniform - uniform.mean(axis=0)
    ones = np.ones(len(centred))
    design = np.column_stack((ones, centred))
    solution = np.linalg.lstsq(design, drawn, rcond=None)
    slopes = solution[0][1:]
    parts = slopes**2 * centred.var(axis=0)
    total = max(float(np.sum(parts)), 1e-300)
    order = np.argsort(-parts, kind="stable")
    return {names[place]: float(parts[place] / total) for place in order}


def _band_text(spread: PredictedValue, factor: float, unit: str) -> str:
    return f"{factor * spread.low:.3g} to {factor * spread.high:.3g} {unit}"


def _tolerance_text(name: str) -> str:
    item = TOLERANCES[name]
    scales = {"m": (1e3, " mm"), "rad": (math.degrees(1.0), " deg"), "1": (100.0, " %")}
    factor, unit = scales.get(item.unit, (1.0, f" {item.unit}"))
    return f"± {factor * item.half_width:.3g}{unit}"


def _isobar_figure(prediction: RecipePrediction) -> Any:
    """Predicted isobars with their bands."""
    figure, axes = plotting.new_figure()
    percent = 100.0 * prediction.contractions
    for row, pressure in enumerate(prediction.pressures):
        colour = plotting.LINES[row]
        axes.fill_between(
            percent, prediction.low[row], prediction.high[row], color=colour, alpha=0.2, linewidth=0
        )
        axes.plot(
            percent,
            prediction.forces[row],
            color=colour,
            linestyle=plotting.DASHES[row],
            label=f"{pressure / 1e3:.4g} kPa",
        )
    pressures, contractions = prediction.points()
    axes.plot(
        100.0 * contractions,
        prediction.law.force(pressures, contractions),
        linestyle="none",
        marker="o",
        markersize=3,
        color=plotting.BLACK,
        label="points to measure",
    )
    axes.set_xlabel("contraction in %")
    axes.set_ylabel("force in N")
    axes.set_xlim(0.0, 100.0 * min(prediction.free[-1].high * 1.05, prediction.contractions[-1]))
    axes.set_ylim(bottom=0.0)
    plotting.legend_outside(axes)
    return figure
