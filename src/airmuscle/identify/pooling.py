"""Partial pooling: fits of a PooledLengthLaw, from the fit of its population law to all specimens."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from ..core.errors import IdentificationError
from ..muscle.characteristic import Characteristic, ContractileSurface, PooledLengthLaw
from ..recording import Recording
from .candidates import UNREACHED_FORCE
from .correlation_index import correlation_index
from .cross_validation import specimen_name
from .fit_points import POINT_COLUMNS, FitPoints
from .problem import SPECIMEN, FitProblem, evaluate
from .result import Fit, WorstPoint
from .solver import design_matrix
from .specimen_effects import SpecimenEffects, Sums, predict_effects

Rows = npt.NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class Specimens:
    """The specimens of N rows: names, resting lengths [m], and the index of the specimen of each row (N,)."""

    names: tuple[str, ...]
    lengths: tuple[float, ...]
    member: npt.NDArray[np.intp]

    @classmethod
    def of(cls, points: FitPoints) -> Specimens:
        """The specimens of the complete rows. Raises IdentificationError for fewer than two, or without a length."""
        names = [specimen_name(run) for run in points.recordings]
        lengths = _lengths(points.recordings, names)
        if len(lengths) < 2:
            raise IdentificationError(
                f"{points.joined.origin}: partial pooling needs two specimens or more, but there is one, "
                f"{names[0] if names else 'none'}. Give recordings of several muscles of the type, or a law of one.",
                cause="it needs recordings of two specimens or more",
            )
        order = list(lengths)
        member = np.repeat([order.index(name) for name in names], [len(run) for run in points.recordings])
        return cls(tuple(order), tuple(lengths.values()), member[~points.missing])


def _lengths(recordings: Sequence[Recording], names: Sequence[str]) -> dict[str, float]:
    """The resting length [m] of each specimen. Raises IdentificationError where it is missing or has two values."""
    lengths: dict[str, float] = {}
    for run, name in zip(recordings, names, strict=True):
        stated = run.constants.get("resting_length")
        if stated is None or abs(lengths.setdefault(name, float(stated)) - float(stated)) > 1e-6:
            what = "no resting length" if stated is None else f"two resting lengths, {lengths[name]:g} and {stated:g} m"
            raise IdentificationError(
                f"{run.origin}: specimen {name} has {what}. State one resting length for each specimen, or different "
                "names of specimens.",
                cause=f"specimen {name} has {what}",
            )
    return lengths


@dataclasses.dataclass(frozen=True, eq=False)
class Pooling:
    """The rows from which effects of specimens are predicted: the problem of the population law and the specimens."""

    problem: FitProblem
    specimens: Specimens
    effect: ContractileSurface
    """Structure of the effect of one specimen."""

    def predict(self, values: Array, rows: Rows | None = None) -> tuple[SpecimenEffects, ContractileSurface]:
        """The effects for these population parameters (P,) from all rows, or those of a mask (N,), and the surface
        whose scaling they have. Censored rows count where the population law violates their bound."""
        problem, (pressure, contraction) = self.problem, self.problem.arguments
        matrix, constant = self._design
        modelled = matrix @ values + constant
        used = problem.active_rows(modelled) & (np.ones(len(modelled), dtype=bool) if rows is None else rows)
        ranges = [(float(x[used].min()), float(x[used].max())) for x in (pressure, contraction)]
        surface = self.effect.with_validity_range(*ranges)
        weights = np.where(used, problem.weights, 0.0)  # no sum changes with a row of zeros
        basis = (weights * np.array(surface.basis(pressure, contraction))).T
        residuals = weights * (problem.target - modelled)
        members = self.specimens.member, len(self.specimens.names)
        sums = Sums.of(weights[:, None] * matrix, basis, residuals, *members, int(np.count_nonzero(used)))
        return predict_effects(sums, self.specimens.names), surface

    @property
    def _design(self) -> tuple[Array, Array]:
        stored: tuple[Array, Array] | None = self.__dict__.get("_stored_design")
        if stored is None:
            stored = self.__dict__["_stored_design"] = design_matrix(self.problem)
        return stored

    def law(self, population: Any, values: Array, rows: Rows | None = None) -> PooledLengthLaw:
        """The pooled law of a population law with these parameters."""
        return _pooled(population, self.specimens, *self.predict(values, rows))


def _pooled(
    population: Any, specimens: Specimens, predicted: SpecimenEffects, surface: ContractileSurface
) -> PooledLengthLaw:
    limits: dict[str, Any] = {"min_force": -UNREACHED_FORCE, "max_force": UNREACHED_FORCE}
    rows = predicted.coefficients.tolist()
    effects = tuple(dataclasses.replace(surface, coefficients=tuple(row), **limits) for row in rows)
    return PooledLengthLaw(population, effects, specimens.names, specimens.lengths)


def check_poolable(law: PooledLengthLaw, points: FitPoints) -> Specimens:
    """The specimens of the points. Raises IdentificationError for fewer than two, or an effect that is no surface."""
    if not isinstance(law.effects[0], ContractileSurface):
        raise IdentificationError(
            f"{points.joined.origin}: the effects of a PooledLengthLaw are {type(law.effects[0]).__name__}; only those "
            "of a ContractileSurface can be fitted. Give ContractileSurface.blank(2)."
        )
    return Specimens.of(points)


def make_pooling(law: PooledLengthLaw, points: FitPoints, problem: FitProblem) -> Pooling:
    """The rows of the fit of a population law. Raises IdentificationError as `check_poolable`."""
    effect: Any = law.effects[0]
    return Pooling(problem, check_poolable(law, points), effect)


def pool(law: PooledLengthLaw, population: Fit, points: FitPoints) -> Fit:
    """The fit of a pooled law, from the fit of its population law to the same points.

    Estimates and correlations are those of the population parameters, with the scatter of the specimens; `effects` has
    those of the specimens. The problem remains that of the population law.
    """
    pooling = make_pooling(law, points, population.problem)
    effects, surface = pooling.predict(population.values)
    model = _pooled(population.model, pooling.specimens, effects, surface)
    data = population.recording.with_columns(**{SPECIMEN: pooling.specimens.member.astype(float)})
    residuals, measured = _residuals(model, population, data)
    worst = int(np.argmax(np.abs(np.where(measured, residuals, 0.0))))
    deviations = np.sqrt(np.diag(effects.population_covariance))
    estimates = zip(population.estimates, deviations.tolist(), strict=True)
    target = data["force"]
    return dataclasses.replace(
        population,
        model=model,
        estimates=tuple(dataclasses.replace(each, stderr=error) for each, error in estimates),
        correlations=effects.population_covariance / np.outer(deviations, deviations),
        sigma=effects.sigma,
        rmse=float(np.sqrt(np.mean(residuals[measured] ** 2))),
        max_error=WorstPoint(float(residuals[worst]), *(float(data[name][worst]) for name in POINT_COLUMNS)),
        correlation_index=correlation_index(target[measured], (target + residuals)[measured]),
        recording=data,
        effects=effects,
        notes=(*population.notes, *_notes(effects)),
    )


def _residuals(model: PooledLengthLaw, fit: Fit, data: Recording) -> tuple[Array, Rows]:
    """The residuals [N] of all rows and the mask of the uncensored ones, shape (N,) each."""
    modelled = evaluate(model, "force", fit.fitted_quantity.arguments, data)
    return modelled - data["force"], np.asarray(fit.censoring == 0)


def _notes(effects: SpecimenEffects) -> tuple[str, ...]:
    count = len(effects.specimens)
    return (
        f"Partial pooling of {count} specimens: coefficients of the specimen effects with a standard deviation of "
        f"{effects.deviation:.3g} N (restricted maximum likelihood) and {effects.degrees_of_freedom:.3g} effective "
        f"parameters of {effects.coefficients.size}. The standard errors of the population parameters contain this "
        "scatter.",
    )


def band_terms(fit: Fit, points: Recording, jacobian: Array) -> tuple[Array, Array]:
    """The offset (N,) of the specimen that `points` state from the population, and the variance (N,) of the force.

    A specimen that the fit does not know has the mean of the prior, and the variance of the prior is added.
    """
    effects, model = fit.effects, fit.model
    assert effects is not None
    assert isinstance(model, PooledLengthLaw)
    surface: Any = model.effects[0]
    basis = np.array(surface.basis(points["pressure"], points["contraction"])).T
    name, size = specimen_name(points), basis.shape[1]
    gradient = np.zeros((len(points), len(effects.covariance)))
    gradient[:, : jacobian.shape[1]] = jacobian
    offset, extra = np.zeros(len(points)), effects.deviation**2 * np.sum(basis**2, axis=1)
    if name in effects.specimens:
        index = effects.specimens.index(name)
        start = jacobian.shape[1] + index * size
        gradient[:, start : start + size] = basis
        offset, extra = basis @ effects.coefficients[index], np.zeros(len(points))
    return offset, np.einsum("ni,ij,nj->n", gradient, effects.covariance, gradient) + extra


def population_of(law: Any) -> Any:
    """The population law of a pooled law; any other law unchanged."""
    return law.population if isinstance(law, PooledLengthLaw) else law


def refit_pooled(law: PooledLengthLaw, population: Characteristic, points: FitPoints) -> PooledLengthLaw:
    """The pooled law of a population law that was refitted to these points."""
    problem = points.problem(population)
    return make_pooling(law, points, problem).law(population, problem.initial_values)
