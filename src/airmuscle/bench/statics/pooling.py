"""Partial pooling: fits of a PooledLengthLaw, from the fit of its population law to all
specimens.
"""

import dataclasses
import functools
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, IdentificationError, tree
from ...physics.muscle.characteristic import ContractileSurface, PooledLengthLaw
from ...recording import Recording
from ..estimation import (
    EffectRows,
    PooledCovariance,
    Runs,
    batch_sample_size,
    estimate_pooled_covariance,
    normalised,
    specimen_name,
)
from .candidates import UNREACHED_FORCE
from .fit_points import FitPoints
from .fit_problem import RESTING_LENGTH, SPECIMEN, FitProblem, evaluate, of_length
from .goodness import goodness_of_fit
from .slack import PULL_RATIO, Slackness
from .specimen_effects import BoundedRows, SpecimenEffects, bounded_coefficients, predict_effects
from .static_fit_result import Fit

Rows = npt.NDArray[np.bool_]
DECAY_RANGE = 0.05
"""Force below zero of the population, as a fraction of the greatest measured force, at which the
effects have decayed (chosen): where the population is far from pulling, no specimen pulls."""


class Specimens(NamedTuple):
    """The specimens of N rows: names, resting lengths [m], and the index of the specimen of each
    row (N,).
    """

    names: tuple[str, ...]
    lengths: tuple[float, ...]
    member: npt.NDArray[np.intp]


class PredictedEffects(NamedTuple):
    """The effects of the specimens, the surface whose scaling they have, their decay [1/N] below
    zero force, and the ratio of the residual variance of a row to theirs."""

    effects: SpecimenEffects
    surface: ContractileSurface
    decay: float
    ratio: float


def _decayed(basis: Array, population: Array, decay: float) -> Array:
    """The basis (N, K) of the effects with their share at these unclamped forces of the population
    (N,) [N].
    """
    return np.asarray(basis * np.clip(1.0 + decay * population, 0.0, 1.0)[:, None])


@dataclasses.dataclass(frozen=True, eq=False)
class Pooling:
    """The rows from which effects of specimens are predicted: the problem of the population law and
    the specimens.
    """

    problem: FitProblem
    specimens: Specimens
    effect: ContractileSurface
    """Structure of the effect of one specimen."""

    def predict(self, values: Array, rows: Rows | None = None) -> PredictedEffects:
        """The effects for these population parameters (P,) from all rows, or those of a mask (N,).

        The variances follow from the rows that are active in the population law. Rows of one run
        are correlated: the likelihood counts them with their effective number, so that effects are
        shrunk as by independent rows. With these variances the effects of each specimen are limited
        by its slack rows: a bound counts where the law of the specimen violates it.
        """
        problem = self.problem
        pressure, contraction = self.problem.arguments
        matrix, constant = self._design
        modelled = matrix @ values + constant
        selected = np.ones(len(modelled), dtype=bool) if rows is None else rows
        ranges = [
            (float(x[selected].min()), float(x[selected].max())) for x in (pressure, contraction)
        ]
        surface = self.effect.with_validity_range(*ranges)
        decay = 1.0 / (DECAY_RANGE * max(float(np.max(problem.data["force"][selected])), 1e-9))
        basis = _decayed(np.array(surface.basis(pressure, contraction)).T, modelled, decay)
        used = problem.active_rows(modelled) & selected
        weights = np.where(used, problem.weights, 0.0)  # no sum changes with a row of zeros
        members = self.specimens.member, len(self.specimens.names)
        rest = problem.target - modelled
        weighted = EffectRows(
            weights[:, None] * matrix, weights[:, None] * basis, weights * rest, *members
        )
        sums = weighted.sums(number=int(np.count_nonzero(used)))
        effects = predict_effects(sums, self.specimens.names)
        left = (weights * (rest - np.sum(basis * effects.coefficients[members[0]], axis=1)))[used]
        effects = predict_effects(
            sums.scaled(batch_sample_size(left) / left.size), self.specimens.names
        )
        ratio = (effects.sigma / effects.deviation) ** 2 * left.size / batch_sample_size(left)
        predicted = PredictedEffects(effects, surface, decay, ratio)
        if not (problem.censoring > 0).any():
            return predicted
        limited = []
        for i, start in enumerate(effects.coefficients):
            of_specimen = selected & (self.specimens.member == i)
            measured = BoundedRows(
                basis[of_specimen],
                rest[of_specimen],
                problem.censoring[of_specimen],
                problem.weights[of_specimen],
            )
            bounds = self._slack_region(i, predicted, values, selected)
            joined = BoundedRows(*map(np.concatenate, zip(measured, bounds, strict=True)))
            limited.append(bounded_coefficients(joined, ratio, start))
        effects = dataclasses.replace(effects, coefficients=np.array(limited))
        return predicted._replace(effects=effects)

    def _slack_region(
        self, index: int, predicted: PredictedEffects, values: Array, selected: Rows
    ) -> BoundedRows:
        """The bounds in the slack region of one specimen, which weigh together as much as its
        rows.
        """
        problem = self.problem
        of_specimen = selected & (self.specimens.member == index)
        surface = predicted.surface
        pressure, contraction = (x[of_specimen] for x in problem.arguments)
        side = problem.censoring[of_specimen]
        weights = problem.weights[of_specimen]
        force = problem.data["force"][of_specimen]
        pulls = (side == 0) & (force > PULL_RATIO * predicted.effects.sigma)
        steps = Slackness.of(pressure, contraction, side > 0, pulls)
        region = steps.region(surface.min_pressure, surface.max_contraction)
        law = tree.with_parameters(problem.law, problem.leaf_values(values))
        modelled = np.asarray(
            of_length(law, self.specimens.lengths[index]).unclamped_force(*region)
        )
        equal = np.full(modelled.size, np.sqrt(float(weights @ weights) / max(modelled.size, 1)))
        basis = _decayed(np.array(surface.basis(*region)).T, modelled, predicted.decay)
        return BoundedRows(basis, -modelled, np.ones(modelled.size), equal)

    def covariance(
        self, values: Array, predicted: PredictedEffects, runs: Runs
    ) -> PooledCovariance:
        """The covariance of the errors of the population parameters (P,) and of the effects
        predicted for them.
        """
        problem = self.problem
        matrix, constant = self._design
        effects = predicted.effects
        modelled = matrix @ values + constant
        basis = _decayed(
            np.array(predicted.surface.basis(*problem.arguments)).T, modelled, predicted.decay
        )
        used = problem.active_rows(modelled)
        member = self.specimens.member[used]
        weights = problem.weights[used]
        left = (problem.target - modelled)[used] - np.sum(
            basis[used] * effects.coefficients[member], axis=1
        )
        matrix = weights[:, None] * matrix[used]
        basis = weights[:, None] * basis[used]
        count = len(effects.specimens)
        rows = EffectRows(matrix, basis, weights * left, member, count)
        return estimate_pooled_covariance(
            rows, runs.rows(used), predicted.ratio, effects.deviation, effects.degrees_of_freedom
        )

    @functools.cached_property
    def _design(self) -> tuple[Array, Array]:
        return self.problem.design_matrix()

    def law(self, population: Any, predicted: PredictedEffects) -> PooledLengthLaw:
        """The pooled law of a population law and the effects of the specimens."""
        limits: dict[str, Any] = {"min_force": -UNREACHED_FORCE, "max_force": UNREACHED_FORCE}
        rows = predicted.effects.coefficients.tolist()
        surface = predicted.surface
        effects = tuple(
            dataclasses.replace(surface, coefficients=tuple(row), **limits) for row in rows
        )
        names, lengths, _ = self.specimens
        return PooledLengthLaw(population, effects, names, lengths, effect_decay=predicted.decay)


def check_poolable(law: PooledLengthLaw, points: FitPoints) -> Specimens:
    """The specimens of the complete rows. Raises IdentificationError for fewer than two, a resting
    length that is missing or has two values, or an effect that is no surface."""
    if not isinstance(law.effects[0], ContractileSurface):
        raise IdentificationError(
            f"{points.joined.origin}: the effects of a PooledLengthLaw are"
            f" {type(law.effects[0]).__name__}; only those of a ContractileSurface can be fitted."
            " Give ContractileSurface.blank(2)."
        )
    names = [specimen_name(run) for run in points.recordings]
    lengths = dict[str, float]()
    for run, name in zip(points.recordings, names, strict=True):
        stated = run.constants.get(RESTING_LENGTH)
        if stated is None or abs(lengths.setdefault(name, float(stated)) - float(stated)) > 1e-6:
            what = (
                f"two resting lengths, {lengths[name]:g} and {stated:g} m"
                if stated
                else "no resting length"
            )
            raise IdentificationError(
                f"{run.origin}: specimen {name} has {what}. State one resting length for each"
                " specimen, or different names of specimens.",
                cause=f"specimen {name} has {what}",
            )
    if len(lengths) < 2:
        raise IdentificationError(
            f"{points.joined.origin}: partial pooling needs two specimens or more, but there is"
            f" one, {names[0] if names else 'none'}. Give recordings of several muscles of the"
            " type, or a law of one.",
            cause="data of two specimens or more are required",
        )
    order = list(lengths)
    member = np.repeat(
        [order.index(name) for name in names], [len(run) for run in points.recordings]
    )
    return Specimens(tuple(order), tuple(lengths.values()), member[~points.missing])


def make_pooling(law: PooledLengthLaw, points: FitPoints, problem: FitProblem) -> Pooling:
    """The rows of the fit of a population law. Raises IdentificationError as `check_poolable`."""
    effect: Any = law.effects[0]
    return Pooling(problem, check_poolable(law, points), effect)


def pool(law: PooledLengthLaw, population: Fit, points: FitPoints) -> Fit:
    """The fit of a pooled law, from the fit of its population law to the same points. Estimates and
    correlations are those of the population parameters, with the scatter of the specimens;
    `effects` has those of the specimens. The problem remains that of the population law."""
    pooling = make_pooling(law, points, population.problem)
    predicted = pooling.predict(population.values)
    covariance = pooling.covariance(population.values, predicted, points.runs)
    effects = dataclasses.replace(predicted.effects, covariance=covariance)
    count = len(population.estimates)
    model = pooling.law(population.model, predicted)
    data = population.recording.with_columns(**{SPECIMEN: pooling.specimens.member.astype(float)})
    modelled = evaluate(model, "force", population.fitted_quantity.arguments, data)
    estimates = zip(population.estimates, covariance.standard_errors[:count].tolist(), strict=True)
    return dataclasses.replace(
        population,
        model=model,
        recording=data,
        effects=effects,
        sigma=effects.sigma,
        estimates=tuple(
            dataclasses.replace(estimate, stderr=error) for estimate, error in estimates
        ),
        correlations=normalised(covariance.matrix[:count, :count]),
        **goodness_of_fit(population.problem, modelled, data),
    )


def pooled_band(fit: Fit, points: Recording, jacobian: Array, level: float) -> tuple[Array, Array]:
    """The offset (N,) of the specimen that `points` state from the population, and the half width
    (N,) of the band of the force. A specimen that the fit does not know has the mean of the prior,
    and the variance of the prior is added."""
    effects = fit.effects
    model = fit.model
    assert effects is not None
    assert effects.covariance is not None
    assert isinstance(model, PooledLengthLaw)
    surface: Any = model.effects[0]
    state = points["pressure"], points["contraction"]
    length = points.constants.get(RESTING_LENGTH)
    law = of_length(model.population, None if length is None else float(length))
    basis = (
        np.array(surface.basis(*state)).T
        * np.asarray(model.effect_share(law.unclamped_force(*state)))[:, None]
    )
    name = specimen_name(points)
    count = len(points)
    by_specimen = np.zeros((count, *effects.coefficients.shape))
    offset = np.zeros(count)
    scatter = effects.deviation**2 * np.sum(basis**2, axis=1)
    if name in effects.specimens:
        index = effects.specimens.index(name)
        by_specimen[:, index] = basis
        offset = basis @ effects.coefficients[index]
        scatter = np.zeros(count)
    gradient = np.hstack([jacobian, by_specimen.reshape(count, effects.coefficients.size)])
    return offset, effects.covariance.half_widths(gradient, level, scatter)
