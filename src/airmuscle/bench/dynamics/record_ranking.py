"""Ranking of candidate records by how well they separate two parameters of a dynamic fit."""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import (
    AirmuscleError,
    Array,
    IdentificationError,
    ParameterError,
    System,
    alternatives,
    tree,
)
from ...report.chapter import Chapter, Table, TableColumn
from ..reported import Reported
from .candidate_records import CandidateRecord, candidate_records
from .experiment import StartTime, Unknown, make_unknowns
from .record_model import RecordModel
from .result import DynamicFit

VALVE = ("conductance", "critical_ratio", "subsonic_index")
"""Parameters of a valve, by the last part of their paths."""
WALL = (
    "heat_transfer",
    "exponent",
    "enclosed_volume",
    "rest_volume",
    "growth_volume",
    "radius",
    "resting_length",
)
"""Parameters of the wall of a muscle and of its volume, by the last part of their paths."""
PRIOR = 10.0
"""Standard deviation of the normal prior of each unknown, relative to its value, which keeps
undetermined ones finite (chosen)."""
START_MARGIN = 0.05
"""Standard deviation of the prior of the start time of a candidate [s] (chosen)."""
MIN_GAIN = 1.5
"""Least factor by which a record reduces the greater standard error of a pair to count as one that
separates it (chosen); a repeat reduces it by 1.41."""


class PairPrecision(NamedTuple):
    """Relative standard errors of two parameters and their correlation."""

    standard_errors: tuple[float, float]
    correlation: float

    @property
    def worst(self) -> float:
        """The greater of the two relative standard errors."""
        return max(self.standard_errors)


@dataclasses.dataclass(frozen=True)
class RankedRecord:
    """A candidate record, and the precision of the pair with it in addition to the records of the
    fit.
    """

    description: str
    precision: PairPrecision
    gain: float
    """Factor by which the greater relative standard error of the pair decreases."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RecordRanking(Reported):
    """Candidate records in the order of their gain for a pair of parameters; the first separates it
    best.
    """

    pair: tuple[str, str]
    now: PairPrecision
    ranking: tuple[RankedRecord, ...]
    failed: tuple[str, ...] = ()
    """Candidates that could not be simulated, with the reason."""

    @property
    def verdict(self) -> str:
        """What the records determine now, and which record would separate the pair, as
        sentences.
        """
        best = self.ranking[0]
        before, after = (
            [
                f"{precision.correlation:.2f}",
                " and ".join(f"{100.0 * error:.2g} %" for error in precision.standard_errors),
            ]
            for precision in (self.now, best.precision)
        )
        now = f"have a correlation of {before[0]} and relative standard errors of {before[1]}."
        then = f"None of the {len(self.ranking)} compared records would separate them."
        if best.gain >= MIN_GAIN:
            then = (
                f"To separate them, measure {best.description}: with it, the correlation is"
                f" expected to be {after[0]} and the relative standard errors {after[1]}."
            )
        return f"{' and '.join(self.pair)} {now} {then}"

    def chapter(self) -> Chapter:
        """The description of the ranking: verdict, and gain, correlation and standard errors with
        each record.
        """
        precisions = [self.now, *(ranked.precision for ranked in self.ranking)]
        columns: dict[str, Any] = {
            "record in addition": ["none", *(ranked.description for ranked in self.ranking)],
            "gain": TableColumn([1.0, *(ranked.gain for ranked in self.ranking)], digits=3),
            "correlation": TableColumn(
                [precision.correlation for precision in precisions], digits=3
            ),
        }
        for i, name in enumerate(self.pair):
            errors = [precision.standard_errors[i] for precision in precisions]
            columns[f"standard error of {name}"] = TableColumn(
                errors, "1", "%", digits=3, short=f"error of {i + 1}"
            )
        title = (
            f"Expected precision of 1, {self.pair[0]}, and 2, {self.pair[1]}, with one further"
            " record"
        )
        tables = (Table("ranking", title, columns, brief=len(precisions)),)
        notes = tuple(f"left out: {reason}" for reason in self.failed)
        return Chapter("ranking", "Next record", self.verdict, tables=tables, notes=notes)


def rank_records(fit: DynamicFit, pair: tuple[str, str] | None = None) -> RecordRanking:
    """Rank candidate records by the expected precision of a pair of parameters of a fit.

    The Fisher information of a candidate, from its sensitivities at the estimates, is added to that
    of the records of the fit. Each candidate has the rows and the residual standard deviation of
    the fit, and an unknown start time. What the fit keeps fixed counts as known, except a valve
    that only the candidate opens.

    pair  names of two estimates; by default the most correlated pair of a valve parameter
          (conductance, critical ratio) and a parameter of the wall or the gas (heat transfer,
          exponent, volume)

    Raises ParameterError for names that the fit lacks, IdentificationError without a pair.
    """
    common = [
        i for i, u in enumerate(fit.unknowns) if u.record is None and not fit.estimates[i].on_bound
    ]
    names = [fit.unknowns[i].name for i in common]
    information = _fit_information(fit, common)
    chosen = _check_pair(pair, names, fit) if pair else _most_correlated(information, names)
    now = _precision(information, names, chosen)
    ranked = list[RankedRecord]()
    failed = list[str]()
    for candidate in candidate_records(fit):
        try:
            added = _candidate_information(fit, candidate, common)
        except AirmuscleError as error:
            failed.append(f"{candidate.description}: {error.message}")
            continue
        after = _precision(information + added, names, chosen)
        ranked.append(RankedRecord(candidate.description, after, now.worst / after.worst))
    if not ranked:
        raise IdentificationError(f"no candidate record can be simulated: {'; '.join(failed)}")
    return RecordRanking(
        chosen, now, tuple(sorted(ranked, key=lambda record: -record.gain)), tuple(failed)
    )


def _fit_information(fit: DynamicFit, common: Sequence[int]) -> Array:
    """The Fisher information of the common unknowns from the records of the fit, with the prior;
    relative to their estimates, or scales if these are zero, and for start times and initial
    values, whose zero is arbitrary, margins.
    """
    problem = fit.problem
    jacobian = problem.weights[:, None] * problem.jacobian(fit.values)
    pairs = zip(fit.estimates, fit.unknowns, strict=True)
    magnitudes = [
        (abs(estimate.value) if unknown.paths else 0.0) or unknown.scale
        for estimate, unknown in pairs
    ]
    matrix = jacobian * np.array(magnitudes) / max(fit.residual_std, 1e-12)
    nuisance = [i for i, e in enumerate(fit.estimates) if i not in common and not e.on_bound]
    return _without(matrix[:, list(common)], matrix[:, nuisance]) + np.eye(len(common)) / PRIOR**2


def _without(matrix: Array, nuisance: Array, prior: Array | float = PRIOR) -> Array:
    """The information of the columns of a matrix, with nuisance unknowns of prior deviations
    estimated as well.
    """
    information = matrix.T @ matrix
    cross = matrix.T @ nuisance
    if not nuisance.shape[1]:
        return np.asarray(information)
    weight = nuisance.T @ nuisance + np.diag(1.0 / np.broadcast_to(prior, nuisance.shape[1]) ** 2)
    return np.asarray(information - cross @ np.linalg.solve(weight, cross.T))


def _unknowns_in_plant(
    fit: DynamicFit, plant: System, replaced: str, common: Sequence[int]
) -> list[int]:
    """The indices of the unknowns, common or of the first record, whose parameters a plant has
    outside a replaced part.
    """
    paths = {leaf.path for leaf in tree.leaves(plant)}
    if replaced:
        paths = {path for path in paths if not path.startswith(replaced)}
    of_record = [i for i, u in enumerate(fit.unknowns) if u.paths and u.record == 0]
    indices = []
    for i in (*common, *of_record):
        needed = fit.unknowns[i].paths
        if needed and paths.issuperset(needed):
            indices.append(i)
    return indices


def _candidate_information(
    fit: DynamicFit, candidate: CandidateRecord, common: Sequence[int]
) -> Array:
    """The information of a candidate on the relative common unknowns; those that it lacks have
    none.
    """
    plant = candidate.experiment.plant
    assert plant is not None
    known_unknowns = _unknowns_in_plant(fit, plant, candidate.replaced, common)
    unknowns = [dataclasses.replace(fit.unknowns[i], record=None) for i in known_unknowns]
    named = {path for unknown in unknowns for path in unknown.paths}
    further = [path for path in candidate.changed if path not in named]
    if further:
        unknowns += make_unknowns(plant, [candidate.experiment], further, (), {})
    matrix = _candidate_sensitivities(fit, candidate, unknowns)
    shared = []
    for k, i in enumerate(known_unknowns):
        if i in common and set(unknowns[k].paths).isdisjoint(candidate.changed):
            shared.append(k)
    nuisance = [k for k in range(len(unknowns) + 1) if k not in shared]
    prior = np.where(np.array(nuisance) == len(unknowns), START_MARGIN, PRIOR)
    information = np.zeros((len(common), len(common)))
    rows = [common.index(known_unknowns[k]) for k in shared]
    information[np.ix_(rows, rows)] = _without(matrix[:, shared], matrix[:, nuisance], prior)
    return information


def _candidate_sensitivities(
    fit: DynamicFit, candidate: CandidateRecord, unknowns: Sequence[Unknown]
) -> Array:
    """The scaled outputs of a candidate by its relative unknowns, and by its start time [1/s] in
    the last column.
    """
    plant = candidate.experiment.plant
    problem = fit.problem
    assert plant is not None
    start = Unknown(
        "start time", StartTime(START_MARGIN), 0, 0.0, -START_MARGIN, START_MARGIN, "s", "t_0", ""
    )
    names = problem.record_models[0].names
    method = problem.record_models[0].method
    observed = dict(zip(names, problem.sensor_deviations.tolist(), strict=True))
    model = RecordModel(plant, candidate.experiment, 0, [*unknowns, start], observed, method)
    leaves = {leaf.path: float(leaf.value) for leaf in tree.leaves(plant)}
    values = [leaves[unknown.paths[0]] for unknown in unknowns]
    outputs = model.evaluate(np.array([*values, 0.0]))
    scales = np.array(
        [*(abs(value) or u.scale for value, u in zip(values, unknowns, strict=True)), 1.0]
    )
    deviations = problem.sensor_deviations * max(fit.residual_std, 1e-12)
    matrix = (outputs.jacobian * scales / deviations[:, None]).reshape(-1, scales.size)
    if not np.isfinite(matrix).all():
        raise IdentificationError("its sensitivities are not finite.")
    return np.asarray(matrix)


def _precision(information: Array, names: Sequence[str], pair: tuple[str, str]) -> PairPrecision:
    covariance = np.linalg.inv(information)
    i = names.index(pair[0])
    k = names.index(pair[1])
    first = float(np.sqrt(covariance[i, i]))
    second = float(np.sqrt(covariance[k, k]))
    correlation = float(covariance[i, k] / (first * second))
    return PairPrecision((first, second), correlation)


def _most_correlated(information: Array, names: Sequence[str]) -> tuple[str, str]:
    """The most correlated pair of a valve and a wall parameter, else of any two. Raises
    IdentificationError.
    """
    if len(names) < 2:
        raise IdentificationError(
            f"the fit has {len(names)} common unknowns that are not on a bound; two are needed."
            " Free another one."
        )
    covariance = np.linalg.inv(information)
    deviations = np.sqrt(np.diag(covariance))
    strength = np.abs(covariance / np.outer(deviations, deviations))
    fields = [name.rpartition(".")[2].partition("[")[0] for name in names]
    valve, wall = (
        [i for i, field in enumerate(fields) if field in kinds] for kinds in (VALVE, WALL)
    )
    pairs = [(i, k) for i in valve for k in wall] or [
        (i, k) for i in range(len(names)) for k in range(i)
    ]
    i, k = max(pairs, key=lambda pair: strength[pair])
    return names[i], names[k]


def _check_pair(pair: tuple[str, str], names: Sequence[str], fit: DynamicFit) -> tuple[str, str]:
    for name in pair:
        if name not in names:
            bound = any(e.name == name and e.on_bound for e in fit.estimates)
            reason = "is on a bound" if bound else "is no common unknown of the fit"
            raise ParameterError(f"'{name}' {reason}{alternatives(name, names, 'allowed are')}")
    if pair[0] == pair[1]:
        raise ParameterError(f"'{pair[0]}' is named twice; a pair has two different parameters.")
    return pair
