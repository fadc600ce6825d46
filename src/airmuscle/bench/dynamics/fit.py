"""Dynamic fit of plant parameters to transient records, `fit_dynamic`, and predictions of each
record by the others.
"""

import dataclasses
import os
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...core import AirmuscleError, Array, IdentificationError, ParameterError, check_whole
from ...engine import Integrator, Rodas4
from ...engine.compile import System
from ...engine.processes import thread_pool
from ...physics import Ambient, Plant, Tube, Valve, WithTubes
from ...recording.columns import displayed
from ..diagnosis import DataUse, support_of_transients
from ..estimation import (
    EQUIVALENT,
    Estimate,
    LeastSquares,
    ProblemSearch,
    aicc,
    analyse_identifiability,
    check_finite,
    lag_one_autocorrelation,
)
from .experiment import (
    Experiment,
    ParameterPaths,
    PriorValue,
    RecordUnknown,
    check_ambient,
    describe_ambient,
    make_unknowns,
)
from .problem import MAX_RUNS, DynamicFitProblem
from .record_model import RecordModel, count_readings, separate_residuals
from .reliability import describe_bounds, describe_flatness, describe_optima, distinct_optima
from .result import DynamicFit

MAX_AUTOCORRELATION = 0.3
"""Lag-1 autocorrelation of the residuals above which they are attributed to model error, not noise;
chosen.
"""
SEGMENTS = (1, 2, 3, 4, 5)
"""Numbers of segments of a tube that are compared (chosen)."""
SCREENING_RUNS = 20
SCREENING_RATIO = 1000.0
"""After this many simulations a search whose sum of squares exceeds the lowest one by this factor
is abandoned; chosen.

In nine problems with 40 to 100 initial guesses, every search that reached the best optimum was
within this factor of it after 14 simulations or fewer."""


def fit_dynamic(
    plant: System,
    experiments: Sequence[Experiment],
    *,
    free: Sequence[ParameterPaths],
    observed: Mapping[str, float],
    per_record: Sequence[RecordUnknown] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    prior: Mapping[str, PriorValue] | None = None,
    starts: int = 1,
    seed: int = 0,
    method: Integrator | None = None,
) -> DynamicFit:
    """Estimate plant parameters by weighted least squares over all records, with exact
    sensitivities.

    plant       structure and initial values; an experiment may replace it by a plant of the same
    structure free        paths of the parameters common to all records,
    ("circuit.fill.conductance",); a tuple of paths has one
                common value
    observed    the measured outputs, each with the standard deviation of its sensor [SI]
    per_record  unknowns with a separate value in every record: paths (supply pressure),
    StartTime(margin),
                CommandInstants(margin) or InitialValue(name, margin)
    bounds      by the first path; by default those declared
    prior       by the first path, what is known before: a parameter that the records do not
    determine then stays near that value
    starts      number of initial guesses of a multi-start: the values of the plant, and a Latin
    hypercube within a
                factor of three. A search whose sum of squares is a thousand times the lowest one
                after 20 simulations is abandoned
    seed        of the Latin hypercube
    method      by default Rodas4(rtol=1e-6)

    The standard errors are scaled by the standard deviation of the residuals. Combinations of
    parameters that the records do not determine are named in the notes. Raises IdentificationError
    where the records are none of a pulling muscle (`support_of_transients`), no initial guess can
    be simulated, or there are no more observations than unknowns,
    ParameterError where a record states another ambient air than its plant has.
    """
    if not experiments or not observed or starts < 1:
        raise ParameterError(
            "fit_dynamic needs at least one record, one observed quantity and one start."
        )
    for experiment in experiments:
        check_ambient(plant, experiment)
    records = [experiment.recording for experiment in experiments]
    support_of_transients(records, observed).check(DataUse.FIT)
    unknowns = make_unknowns(plant, experiments, free, per_record, bounds or {}, prior)
    method = method or Rodas4()
    models = tuple(
        RecordModel(plant, e, i, unknowns, observed, method) for i, e in enumerate(experiments)
    )
    problem = DynamicFitProblem(models, unknowns, np.array(list(observed.values()), dtype=float))
    count = count_readings(models)
    if count <= len(unknowns):
        raise IdentificationError(
            f"{count} observations cannot determine {len(unknowns)} unknowns. Give more rows, or"
            " free fewer parameters."
        )
    if not (problem.sensor_deviations > 0).all():
        raise ParameterError(
            "the standard deviation of an observed quantity must be positive, in SI."
        )
    check_whole("fit_dynamic", "seed", seed, 0)
    outcomes = sorted(
        _solve_all(problem, initial_guesses(problem, starts, seed)), key=lambda outcome: outcome[1]
    )
    if not np.isfinite(outcomes[0][1]):
        check_finite(problem, problem.initial_values)  # raises the cause, if there is one
        raise IdentificationError(
            "the plant cannot be simulated from any initial guess. Check the bounds and the initial"
            " conditions."
        )
    return _build_result(problem, *map(np.array, zip(*outcomes, strict=True)))


def fit_tube(
    plant: Plant, fitted: Callable[[Plant, str], DynamicFit], segments: Sequence[int] = SEGMENTS
) -> DynamicFit:
    """The fit with the number of segments of the tube of a plant by AICc, the fewest of equivalent
    ones.

    plant   a plant with a `Tube`, initial values
    fitted  the fit of a plant whose pressure sensor is in the first segment, `tube.pressure` or
            `tube1.pressure`

    Several segments have the flow law of friction, a critical ratio of 0, for which the division of
    a `Tube` is exact; the number is no further unknown. One with which no fit is found is left out.
    Raises ParameterError for a plant without such a tube, and the error of the last fit if there is
    none.
    """
    circuit = plant.circuit
    if not isinstance(circuit, WithTubes) or not isinstance(circuit.tube, Tube):
        raise ParameterError(
            "fit_tube: the plant has no Tube between valves and muscle; write WithTubes(circuit,"
            " Tube(...))."
        )
    candidates: list[tuple[float, DynamicFit]] = []
    failure: AirmuscleError | None = None
    for count in segments:
        tube = dataclasses.replace(circuit.tube, segment_count=count)
        if count > 1 and isinstance(tube.orifice, Valve):
            tube = dataclasses.replace(
                tube, orifice=dataclasses.replace(tube.orifice, critical_ratio=0.0)
            )
        sensor = f"{tube.prefixes[0]}pressure"
        try:
            fit = fitted(
                dataclasses.replace(plant, circuit=dataclasses.replace(circuit, tube=tube)), sensor
            )
        except AirmuscleError as error:
            failure = error
            continue
        size = count_readings(fit.problem.record_models)
        candidates.append((aicc(fit.residual_std**2, size, len(fit.estimates)), fit))
    if not candidates:
        raise failure or ParameterError("fit_tube: segments is empty; give at least one number.")
    lowest = min(value for value, _ in candidates)
    return next(fit for value, fit in candidates if value <= lowest + EQUIVALENT)


def _solve_all(problem: DynamicFitProblem, guesses: Sequence[Array]) -> list[tuple[Array, float]]:
    """Least squares from every initial guess, in parallel threads: compiled kernels release the
    interpreter lock.
    """
    if len(guesses) == 1:
        return [problem.solve(guesses[0])]

    def screened(number: int) -> ProblemSearch:
        name = f"start {number + 1} of {len(guesses)}"
        search = ProblemSearch(problem, LeastSquares(), guesses[number], name)
        return search.run(SCREENING_RUNS)

    with thread_pool(min(len(guesses), os.cpu_count() or 1)) as pool:
        searches = list(pool.map(screened, range(len(guesses))))
        lowest = min(search.cost for search in searches)
        continued = [
            s for s in searches if not s.is_finished and s.cost <= SCREENING_RATIO * lowest
        ]
        list(pool.map(lambda search: search.run(MAX_RUNS), continued))
        return [(search.values, search.cost) for search in searches]


def initial_guesses(problem: DynamicFitProblem, count: int, seed: int) -> list[Array]:
    """The values of the plant, then a Latin hypercube; logarithmic where the range is positive.
    SI, (P,) each.
    """
    rng = np.random.default_rng(seed)
    cells = count - 1
    columns = []
    for unknown in problem.unknowns:
        low, high = unknown.search_range
        fraction = (rng.permutation(cells) + rng.random(cells)) / max(cells, 1)
        columns.append(low * (high / low) ** fraction if low > 0 else low + fraction * (high - low))
    return [problem.initial_values, *np.column_stack(columns)]


def _build_result(problem: DynamicFitProblem, searches: Array, costs: Array) -> DynamicFit:
    """The result from the values (S, P) [SI] and sums of squares (S,) of all searches, the lowest
    first.
    """
    values = searches[0]
    coordinates = problem.coordinates
    scales = coordinates.sizes
    solution = problem.solution(values)
    residuals = problem.residuals(solution.modelled)
    jacobian = problem.weights[:, None] * solution.jacobian * scales
    scaled = coordinates.of(values)
    low, high = (coordinates.of(bound) for bound in problem.bounds)
    margin = 1e-6 * np.maximum(np.abs(scaled), 1.0)
    on_bound = (scaled - low <= margin) | (high - scaled <= margin)
    inner = np.flatnonzero(~on_bound)
    residual_std = float(np.sqrt(np.sum(residuals**2) / (residuals.size - inner.size)))
    names = [problem.unknowns[k].name for k in inner]
    # A prior is of the logarithm, so that the unknown is judged relative to its estimate.
    magnitudes = np.ones(scaled.size)
    magnitudes[problem.priors.indices] = np.abs(scaled)[problem.priors.indices]
    magnitudes = magnitudes[inner]
    known = residual_std * problem.priors.jacobian(values) * scales
    analysis = analyse_identifiability(
        np.concatenate([jacobian, known])[:, inner], names, magnitudes, residual_std
    )
    covariance = np.full((scaled.size, scaled.size), np.nan)
    inverse = analysis.inverse() * np.outer(magnitudes, magnitudes)
    covariance[np.ix_(inner, inner)] = inverse * residual_std**2
    standard_errors = np.sqrt(np.diag(covariance))
    estimates = tuple(
        Estimate(u.name, u.symbol, float(value), float(stderr), u.unit, u.meaning, bool(bound))
        for u, value, stderr, bound in zip(
            problem.unknowns,
            values,
            standard_errors * scales,
            on_bound,
            strict=True,
        )
    )
    correlations = covariance / np.outer(standard_errors, standard_errors)
    optima = distinct_optima(searches, costs, scales, problem.margins)
    airs = [
        (m.experiment.recording, getattr(m.plant, "ambient", None)) for m in problem.record_models
    ]
    notes = [
        *(str(combination) for combination in analysis.undetermined),
        *describe_bounds(estimates, jacobian, inverse, on_bound, scales, coordinates.origins),
        *describe_optima(optima, estimates, costs, problem.margins),
        *_describe_model_error(problem, residuals, estimates, inner.size),
        *describe_ambient(
            [record for record, air in airs if getattr(air, "pressure", None) == Ambient().pressure]
        ),
    ]
    return DynamicFit(
        problem, estimates, correlations, analysis, residual_std, costs, optima, tuple(notes)
    )


def _describe_model_error(
    problem: DynamicFitProblem, residuals: Array, estimates: Sequence[Estimate], unknowns: int
) -> list[str]:
    """Sentences on autocorrelated residuals (R,), which are a sign of model error, and on what they
    leave open.
    """
    autocorrelation = lag_one_autocorrelation(separate_residuals(problem.record_models, residuals))
    if autocorrelation <= MAX_AUTOCORRELATION:
        return []
    factor = np.sqrt((1 + autocorrelation) / (1 - autocorrelation))
    return [
        (
            f"the residuals are autocorrelated (lag 1: {autocorrelation:.2f}), which indicates"
            " model error rather than noise; the standard errors are too small by a factor of"
            f" about {factor:.1f}"
        ),
        *describe_flatness(estimates, residuals.size - unknowns, problem.margins),
    ]


OF_RECORD = " of record "
"""Part of the name of an unknown that has a value of its own in every record."""
MAX_RATIO = 3.0
"""Ratio of the cross-predicted to the fitted rms from which the parameters are a description only
(chosen).
"""


@dataclasses.dataclass(frozen=True)
class CrossPrediction:
    """A record predicted by the common parameters of a fit to the other records, with its own
    unknowns of the joint fit, such as start time and supply pressure: rms errors and rms residuals
    of the joint fit by quantity [SI], and those parameters."""

    record: str
    rms: Mapping[str, float]
    fitted: Mapping[str, float]
    common: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def ratio(self) -> float:
        """Maximum ratio of the rms error to the rms residual of the joint fit."""
        return max(self.rms[name] / max(self.fitted[name], 1e-300) for name in self.rms)

    def __str__(self) -> str:
        parts = [
            f"{name} {displayed(name, error, 3)} (joint fit"
            f" {displayed(name, self.fitted[name], 3)})"
            for name, error in self.rms.items()
        ]
        return (
            f"{self.record} predicted by the parameters of the other records: rms error"
            f" {', '.join(parts)}."
        )


def cross_predict(
    fit: DynamicFit, refit: Callable[[Sequence[int]], DynamicFit]
) -> tuple[CrossPrediction, ...]:
    """Each record of a joint fit, predicted without it, as far as the others give a fit; empty for
    one record or without common parameters. `refit` is the fit to the records of these numbers,
    from 0, with the same unknowns.
    """
    count = len(fit.problem.record_models)
    if count < 2 or all(OF_RECORD in estimate.name for estimate in fit.estimates):
        return ()
    predictions = []
    for i in range(count):
        model = fit.problem.record_models[i]
        try:
            part = refit([k for k in range(count) if k != i])
            common = {e.name: e.value for e in part.estimates if OF_RECORD not in e.name}
            estimates = tuple(
                dataclasses.replace(e, value=common.get(e.name, e.value)) for e in fit.estimates
            )
            predicted = dataclasses.replace(fit, estimates=estimates)
            rms, fitted = (
                {name: source.rms(name, i) for name in model.names} for source in (predicted, fit)
            )
        except (
            AirmuscleError
        ):  # the others give no fit, or one with which this record cannot be simulated
            continue
        predictions.append(CrossPrediction(model.experiment.recording.origin, rms, fitted, common))
    return tuple(predictions)


def describe_cross_predictions(predictions: Sequence[CrossPrediction]) -> str:
    """The meaning of the cross-predictions, as a sentence; empty without any."""
    if not predictions:
        return ""
    worst = max(predictions, key=lambda prediction: prediction.ratio)
    times = f"{worst.ratio:.3g} times the residual of the joint fit"
    if worst.ratio <= MAX_RATIO:
        return f"The records predict each other: the maximum rms error is {times}."
    return (
        f"The records do not predict each other: the rms error of {worst.record} is {times}, so"
        " that the parameters describe the records but do not identify the plant."
    )
