"""Volume identification: one volume law of a muscle from a water column, or from fills at held
lengths.

A water column gives the volume at every contraction. A fill at a held contraction gives one volume
from the mass of air that enters between two settled pressures, V = Delta m R T/Delta p. A fill
without the mass of air determines only the ratio of volume and valve conductance: see
`bench.dynamics`.
"""

import dataclasses
import functools
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...core import Array, ColumnError, IdentificationError, ParameterError, cite, plotting
from ...physics.muscle.characteristic import Characteristic, ValidityRange
from ...physics.muscle.characteristic.energy_defect import EnergyDefect
from ...physics.muscle.geometry import Braid, ChebyshevGeometry, Geometry
from ...physics.pneumatics.gas import GAS_CONSTANT
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Plot, Table, TableColumn
from ...report.parameter_tables import parameter_table
from ..estimation import (
    EQUIVALENT,
    FreeParameter,
    LeastSquares,
    MeasuredProblem,
    SolvedProblem,
    aicc,
    solve_least_squares,
)
from ..inspection import level_intervals
from ..reported import Reported
from .energy_defect_values import defect_values

HELD = 0.005
"""Range of the contraction within which it is held during a fill (chosen)."""
LEVEL_BAND = 1e-4
"""Range of the contractions that count as one (chosen)."""
MIN_RISE = 2e4
"""Minimum pressure rise of a fill [Pa] (chosen)."""
SETTLED = 0.05
"""Fraction of the rows at either end of a fill over which mass and pressure are averaged
(chosen).
"""
MAX_DEGREE = 4
"""Maximum degree of a polynomial (chosen)."""
RESOLUTION = 1e-6
"""Residual relative to the volume below which laws are not distinguished (chosen)."""
LEVELS = 3
VOLUMES = 11
"""Pressures at which the reciprocity is drawn, and contractions of the table of volumes
(chosen).
"""


class VolumePoints(NamedTuple):
    """Measured volumes [m3] at contractions [1], shape (N,) each, and the number of fills among
    them.
    """

    contraction: Array
    volume: Array
    fills: int


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class VolumeFit(Reported):
    """Volume law of a muscle with its covariance, and the AICc of every law that was compared."""

    geometry: Geometry
    points: VolumePoints
    rmse: float
    """Root mean square of the residuals [m3]."""
    aicc: dict[str, float]
    covariance: Array
    """Covariance of the linear coefficients, shape (P, P)."""

    @property
    def solved(self) -> SolvedProblem:
        """The problem of the linear coefficients: covariance, profiles, bootstrap."""
        return _solve(_design(self.geometry, self.points.contraction), self.points)

    def standard_deviation(self, contraction: Array) -> Array:
        """Standard deviation of the fitted volume [m3] at contractions (N,)."""
        design = _design(self.geometry, np.asarray(contraction, dtype=float))
        return np.asarray(np.sqrt(np.sum(design @ self.covariance * design, axis=1)))

    @property
    def largest_deviation(self) -> float:
        """The greatest standard deviation of the volume [m3] at the measured contractions."""
        return float(self.standard_deviation(self.points.contraction).max())

    @property
    def summary(self) -> str:
        """The law with its residual and its standard deviation."""
        return (
            f"{type(self.geometry).__name__}, rms residual {1e6 * self.rmse:.4g} cm3, standard"
            f" deviation of the volume at most {1e6 * self.largest_deviation:.4g} cm3"
        )

    def chapter(
        self,
        title: str = "Volume of the muscle",
        law: Characteristic | None = None,
        validity_range: ValidityRange | None = None,
        defect: EnergyDefect | None = None,
    ) -> Chapter:
        """The description of the fit; with a force law also dF/dp against -dV/dL and the Maxwell
        defect.
        """
        caption = "Measured volumes, and the law with two standard deviations."
        plots = [Plot("volume", caption, partial(_volume_figure, self))]
        if law is not None and validity_range is not None:
            caption = (
                "Reciprocity: dF/dp of the force law (lines, at several pressures) and -dV/dL of"
                " the volume law (thick). They are equal if force and volume derive from one"
                " potential."
            )
            plots.append(
                Plot(
                    "reciprocity", caption, partial(_reciprocity_figure, self, law, validity_range)
                )
            )
        model = type(self.geometry).__name__
        values = (
            NamedValue("law", model, brief=False),
            NamedValue("points", len(self.points.contraction), brief=False),
            NamedValue("fills", self.points.fills, brief=False),
            NamedValue("rms residual", self.rmse, "m3", "cm3", brief=False),
            NamedValue(
                "maximum standard deviation", self.largest_deviation, "m3", "cm3", brief=False
            ),
            *([] if defect is None else defect_values(defect)),
        )
        tables = (
            *_tables(self),
            parameter_table(self.geometry, "volume-parameters", f"Parameters of {model}"),
        )
        return Chapter(
            "volume",
            title,
            f"{self.summary}.",
            values=values,
            tables=tables,
            plots=tuple(plots),
            references=tuple(cite(self.geometry)),
        )


def volume_points(recordings: Sequence[Recording], temperature: float = 293.15) -> VolumePoints:
    """The volumes of recordings with a column `volume`, or with `pressure` and `air_mass` or
    `mass_flow` of a fill.

    `temperature` [K] is that of the air before and after a fill, for which the muscle must come to
    rest. Raises ColumnError for a recording with neither, a contraction that was not held, or a
    fill without a rise of pressure.
    """
    if not recordings:
        raise IdentificationError("a volume fit needs at least one recording.")
    contractions, volumes = zip(
        *(_measured(recording, temperature) for recording in recordings), strict=True
    )
    fills = sum("volume" not in recording.columns for recording in recordings)
    return VolumePoints(np.concatenate(contractions), np.concatenate(volumes), fills)


def _measured(recording: Recording, temperature: float) -> tuple[Array, Array]:
    """Contractions and volumes [m3] of a water column, or the one contraction and volume of a fill,
    from the mass of air and the pressures at both ends."""
    if not len(recording):
        raise ColumnError(
            f"{recording.origin}: the recording has no rows. Give one with measured values."
        )
    contraction = recording["contraction"]
    if "volume" in recording.columns:
        return contraction, recording["volume"]
    if np.ptp(contraction) > HELD:
        raise ColumnError(
            f"{recording.origin}: the contraction varies by {100 * np.ptp(contraction):.2f} %"
            f" during the fill; it must be held within {100 * HELD:.1f} %. Hold the muscle, or"
            " measure the volume in a water column (a column 'volume')."
        )
    if "air_mass" in recording.columns:
        mass = recording["air_mass"]
    elif "mass_flow" in recording.columns:
        flow = recording["mass_flow"]
        time = recording["time"]
        mass = np.concatenate([[0.0], np.cumsum((flow[1:] + flow[:-1]) / 2 * np.diff(time))])
    else:
        raise ColumnError(
            f"{recording.origin}: neither a column 'volume' (water column) nor the mass of air of a"
            " fill ('air_mass' or 'mass_flow'). A fill without it determines only the ratio of"
            " volume and conductance: use airmuscle fit-dynamic."
        )
    pressure = recording["pressure"]
    count = max(1, round(SETTLED * len(recording)))
    rise = float(np.mean(pressure[-count:]) - np.mean(pressure[:count]))
    if rise < MIN_RISE:
        raise ColumnError(
            f"{recording.origin}: the pressure rises by {rise / 1e3:.4g} kPa; a volume needs a rise"
            f" of at least {MIN_RISE / 1e3:g} kPa between settled ends."
        )
    entered = float(np.mean(mass[-count:]) - np.mean(mass[:count]))
    volume = entered * GAS_CONSTANT * temperature / rise
    return np.array([float(np.mean(contraction))]), np.array([volume])


def fit_volume(points: VolumePoints, resting_length: float) -> VolumeFit:
    """The volume law by AICc: a Braid, or a polynomial of degree 1 to 4 in the contraction; the
    simplest of equivalent ones.

    `resting_length` [m]. The standard deviation follows from the residuals; that of the muscle's
    own reproducibility is contained if the points are of several runs. Raises ParameterError for a
    length that is not positive, and IdentificationError for a value that is not finite, fewer than
    four points, or fewer than three contractions.
    """
    if not resting_length > 0.0:
        raise ParameterError(
            f"fit_volume: the resting length is {resting_length:g} m; it must be greater than zero."
        )
    if missing := int(np.count_nonzero(~np.isfinite(points.contraction + points.volume))):
        raise IdentificationError(
            f"fit_volume: {missing} of {points.volume.size} points have no finite contraction and"
            " volume. Remove them."
        )
    levels = sum(1 for _ in level_intervals(np.sort(points.contraction), LEVEL_BAND))
    if points.volume.size < 4 or levels < 3:
        raise IdentificationError(
            "a volume law needs four points at three contractions or more; there are"
            f" {points.volume.size} at {levels}. Fill the muscle at further lengths."
        )
    degrees = range(1, min(MAX_DEGREE, levels - 2, points.volume.size - 3) + 1)
    braid = _braid(points, resting_length)
    ends = (float(points.contraction.min()), float(points.contraction.max()))
    laws: dict[str, Geometry] = {} if braid is None else {"Braid": braid}
    for n in degrees:
        terms = _solve(_chebyshev_terms(points.contraction, *ends, n), points).values
        laws[f"polynomial of degree {n}"] = ChebyshevGeometry(
            tuple(terms.tolist()), *ends, resting_length
        )
    criteria = dict[str, float]()
    size = points.volume.size
    resolution = RESOLUTION * float(np.abs(points.volume).max())
    for (
        name,
        law,
    ) in laws.items():  # residuals below the resolution of the volumes do not distinguish laws
        squares = float(np.sum((np.asarray(law.volume(points.contraction)) - points.volume) ** 2))
        parameters = _design(law, points.contraction).shape[1]
        criteria[name] = aicc(max(squares, size * resolution**2) / size, size, parameters)
    equivalent = [
        laws[name]
        for name, value in criteria.items()
        if value <= min(criteria.values()) + EQUIVALENT
    ]
    best = min(equivalent, key=lambda law: _design(law, points.contraction).shape[1])
    residuals = np.asarray(best.volume(points.contraction)) - points.volume
    design = _design(best, points.contraction)
    variance = float(residuals @ residuals) / max(points.volume.size - design.shape[1], 1)
    covariance = variance * np.linalg.pinv(design.T @ design)
    return VolumeFit(best, points, float(np.sqrt(np.mean(residuals**2))), criteria, covariance)


def _braid(points: VolumePoints, resting_length: float) -> Braid | None:
    """The braid of least squares, V = A s - B s^3 with s = 1 - eps; None if no braid has these
    coefficients.
    """
    a, b = _solve(_braid_terms(points.contraction), points).values.tolist()
    cosine_squared = float(b / a)
    if not a > 0.0 or not 0.0 < cosine_squared < 1.0:
        return None
    radius = float(np.sqrt(a * (1.0 - cosine_squared) / (np.pi * resting_length)))
    try:
        return Braid(radius, float(np.arccos(np.sqrt(cosine_squared))), resting_length)
    except ParameterError:
        return None


@dataclasses.dataclass(frozen=True, eq=False)
class VolumeProblem(MeasuredProblem):
    """Measured volumes (N,) [m3] that are linear in coefficients (P,)."""

    terms: Array
    """Columns (N, P) of the coefficients."""
    target: Array
    name = "volume"
    origin = "volume fit"
    quantity = "volume"

    @functools.cached_property
    def parameters(self) -> tuple[FreeParameter, ...]:
        names = [f"coefficients[{i}]" for i in range(self.terms.shape[1])]
        bounds = (-np.inf, np.inf)
        return tuple(
            FreeParameter(name, name, 0.0, bounds, "m3", "coefficient", is_linear=True)
            for name in names
        )

    def predict(self, values: Array) -> Array:
        return np.asarray(self.terms @ values)

    def jacobian(self, values: Array, which: Sequence[int] | None = None) -> Array:
        return self.terms if which is None else self.terms[:, list(which)]


def _solve(terms: Array, points: VolumePoints) -> SolvedProblem:
    """The volumes by least squares in the coefficients of these terms (N, P)."""
    problem = VolumeProblem(terms, points.volume)
    return SolvedProblem(problem, solve_least_squares(problem, LeastSquares()).values)


def _design(law: Geometry, contraction: Array) -> Array:
    """Terms of the law, in whose coefficients the volume is linear, shape (N, P)."""
    if isinstance(law, ChebyshevGeometry):
        return _chebyshev_terms(
            contraction, law.min_contraction, law.max_contraction, len(law.coefficients) - 1
        )
    return _braid_terms(contraction)


def _braid_terms(contraction: Array) -> Array:
    stretch = 1.0 - contraction
    return np.column_stack([stretch, -(stretch**3)])


def _chebyshev_terms(contraction: Array, low: float, high: float, degree: int) -> Array:
    scaled = np.clip((2 * contraction - low - high) / (high - low), -1.0, 1.0)
    return np.asarray(np.polynomial.chebyshev.chebvander(scaled, degree))


def _tables(fit: VolumeFit) -> tuple[Table, Table]:
    """The fitted volumes, and the ranking of the laws."""
    contraction = np.linspace(fit.points.contraction.min(), fit.points.contraction.max(), VOLUMES)
    volumes = {
        "contraction": TableColumn(contraction, "1", "%"),
        "volume": TableColumn(np.asarray(fit.geometry.volume(contraction)), "m3", "cm3"),
        "standard deviation": TableColumn(
            fit.standard_deviation(contraction), "m3", "cm3", digits=2
        ),
    }
    names = sorted(fit.aicc, key=lambda name: fit.aicc[name])
    least = min(fit.aicc.values())
    laws = {"law": names, "AICc above the best": [fit.aicc[name] - least for name in names]}
    brief = (0, VOLUMES // 2, VOLUMES - 1)
    return Table("volume", "Volume of the muscle", volumes, brief=brief), Table(
        "volume-laws", "Volume laws", laws
    )


def _volume_figure(fit: VolumeFit) -> Any:
    figure, axes = plotting.new_figure()
    contraction = np.linspace(fit.points.contraction.min(), fit.points.contraction.max(), 201)
    volume = np.asarray(fit.geometry.volume(contraction))
    error = 2 * fit.standard_deviation(contraction)
    axes.plot(
        100 * contraction, 1e6 * volume, color=plotting.LINES[0], label=type(fit.geometry).__name__
    )
    axes.fill_between(
        100 * contraction,
        1e6 * (volume - error),
        1e6 * (volume + error),
        color=plotting.LINES[0],
        alpha=0.25,
        linewidth=0,
    )
    axes.plot(
        100 * fit.points.contraction,
        1e6 * fit.points.volume,
        ".",
        color=plotting.BLACK,
        label="measured",
    )
    axes.set(xlabel="contraction [%]", ylabel="volume [cm³]")
    axes.legend()
    return figure


def _reciprocity_figure(fit: VolumeFit, law: Characteristic, validity_range: ValidityRange) -> Any:
    figure, axes = plotting.new_figure()
    low, high = validity_range.contraction
    measured = fit.points.contraction
    contraction = np.linspace(
        max(low, float(measured.min())), min(high, float(measured.max())), 121
    )
    for i, pressure in enumerate(np.linspace(*validity_range.pressure, LEVELS + 2)[1:-1]):
        pressures = np.full(contraction.size, pressure)
        taut = np.asarray(law.force(pressures, contraction)) > 0
        slope = np.where(taut, law.slopes(pressures, contraction).by_pressure, np.nan)
        axes.plot(
            100 * contraction,
            1e4 * slope,
            color=plotting.LINES[i + 1],
            label=f"dF/dp, {pressure / 1e3:.4g} kPa",
        )
    geometry = fit.geometry
    area = np.asarray(geometry.volume_derivative(contraction)) / geometry.resting_length
    axes.plot(100 * contraction, 1e4 * area, color=plotting.BLACK, linewidth=2, label="-dV/dL")
    axes.set(xlabel="contraction [%]", ylabel="area [cm²]")
    axes.legend()
    return figure
