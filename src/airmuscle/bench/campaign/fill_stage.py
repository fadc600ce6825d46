"""Valve and enclosed volume of a campaign: a joint fit of all fills and discharges of the rig."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...core import AirmuscleError, Array, ShortRepr
from ...engine import Schedule
from ...physics import FillDischarge, Geometry, Plant, WithTubes
from ..dynamics import DynamicFit, Experiment, cross_predict, describe_ambient, fit_tube
from . import fill_records as fills
from .record import CampaignRecord
from .static_stage import VolumeChange
from .transient import LeftOutStage

Fitted = Callable[[Sequence[Experiment]], DynamicFit]
NAME = "fills and volume"
VOLUME = "muscle.geometry.enclosed_volume"
REMEDY = (
    "record a fill from ambient pressure and a discharge through the valve at a held length, at"
    " three lengths with the same valve and supply, at 100 rows per second or more, until the"
    " pressure has settled"
)
MAX_FOLLOWED = 2.0
MAX_NOISE_RATIO = 4.0
"""Ratio of the residual to the noise of the pressure sensor up to which the model follows a record,
and that above which it does not; between them, a supply whose pressure sinks and a tube are tried
(chosen)."""
MAX_VOLUME_ERROR = 0.3
MAX_TUBE_VOLUME = 1.5
"""Maximum relative standard error of a volume before the valve, and maximum volume of a tube in
relation to that of the muscle at rest (chosen)."""
MIN_MISFIT = 0.01
"""Minimum residual that is reported, as a fraction of the greatest change of the pressure
(chosen).
"""
MIN_RANGE = 0.02
"""Minimum range of the contractions of the fills from which the volume follows (chosen)."""


@dataclasses.dataclass(frozen=True)
class VolumeEstimate:
    """Factor s of the volumes that a fit found for an assumed conductance, and the volume at rest
    [m3].

    s v_i = V(0) + dV(eps_i): a fill determines the ratio of volume and conductance, and fills at
    several lengths, whose change of volume is known, determine both.
    """

    scale: float
    scale_stderr: float
    volume_at_rest: float
    volume_stderr: float
    residual: float
    """Root mean square residual of the volumes [m3]; 0 for two fills."""


def relate_volumes(
    relative: Array, standard_errors: Array, contractions: Array, change: VolumeChange
) -> VolumeEstimate | None:
    """The volume at rest and the scale of the relative volumes; None unless the contractions differ
    enough.
    """
    if relative.size < 2 or float(np.ptp(contractions)) < MIN_RANGE:
        return None
    matrix = np.column_stack([relative, -np.ones(relative.size)])
    target = np.asarray(change(contractions))
    inverse = np.linalg.pinv(matrix)
    scale, volume = inverse @ target
    if not (scale > 0 and volume > 0):
        return None
    residuals = matrix @ np.array([scale, volume]) - target
    freedom = relative.size - 2
    variance = (scale * standard_errors) ** 2
    if freedom:  # what the fills do not explain is an error of the curve, equal for all of them
        explained = float(variance @ (1.0 - np.sum(matrix * inverse.T, axis=1)))
        variance = variance + max(float(residuals @ residuals) - explained, 0.0) / freedom
    errors = np.sqrt(np.square(inverse) @ variance)
    rms = float(np.sqrt(np.mean(residuals**2))) if freedom else 0.0
    return VolumeEstimate(float(scale), float(errors[0]), float(volume), float(errors[1]), rms)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FillStage(ShortRepr):
    """The joint fit of all fills with common valves and one volume curve, and the prediction of
    each from the others. `estimate` is None where the geometry was given."""

    fit: DynamicFit
    records: tuple[CampaignRecord, ...]
    experiments: tuple[Experiment, ...]
    geometry: Geometry
    estimate: VolumeEstimate | None
    contractions: Array
    cross_rms: tuple[float, ...]
    """Rms error of the pressure of each fill, predicted by the parameters of the others [Pa]; empty
    for one fill.
    """
    baselines: tuple[Mapping[str, float], ...] = ()
    """Those of the baselines of each fill [Pa], by name; the ARX model is fitted to the others,
    too.
    """
    supposed: tuple[str, ...] = ()
    """What the records do not determine or state, and what is taken for it, as sentences."""

    @property
    def circuit(self) -> FillDischarge:
        """The circuit with the fitted valves and supply, without a tube."""
        return fills.valves_of(fills.plant_of(self.fit.plant()).circuit)

    def commands(self, record: CampaignRecord) -> Mapping[str, Sequence[tuple[float, float]]]:
        """The instants [s] and values of the commands of both valves in a record, with the
        estimated instants.
        """
        command = self.fit.problem.record_models[self.records.index(record)].command(
            self.fit.values
        )
        assert isinstance(command, Schedule)
        return command.changes

    @property
    def misfit(self) -> str:
        """The remark that the model does not follow the pressure of the records, with its cause;
        empty if it does.
        """
        noise = fills.pressure_deviation(self.records)
        change = max(abs(step.change) for record in self.records for step in record.steps)
        worst, rms = max(
            zip(self.records, fills.record_rms(self.fit), strict=True), key=lambda pair: pair[1]
        )
        if rms <= max(MAX_NOISE_RATIO * noise, MIN_MISFIT * change):
            return ""
        return (
            f"The rms residual of {worst.origin}, {rms / 1e3:.3g} kPa, is {rms / noise:.3g} times"
            " the noise of the pressure sensor: the model does not follow the records, and"
            " conductances, heat transfer and volume are not to be used. Check that the supply"
            " pressure was constant, that each change of the pressure goes through an open valve"
            " until it has settled, and that no tube or leak lies between valve and muscle."
        )

    @property
    def verdict(self) -> str:
        """Cross-prediction, volume and residuals, as sentences."""
        rms, cross = (
            [error / 1e3 for error in errors]
            for errors in (fills.record_rms(self.fit), self.cross_rms)
        )
        predicted = (
            f"Joint fit of {len(rms)} records: rms residual {min(rms):.3g} to {max(rms):.3g} kPa."
        )
        if cross:
            predicted = (
                f"Each fill predicted by the parameters of the others: rms error {min(cross):.3g}"
                f" to {max(cross):.3g} kPa{fills.describe_skills(self.cross_rms, self.baselines)}."
                f" {predicted}"
            )
        volume = "The volume is that of the given geometry."
        if self.estimate is not None:
            volume = (
                f"Volume at zero contraction {1e6 * self.estimate.volume_at_rest:.4g} cm3 (standard"
                f" error {1e6 * self.estimate.volume_stderr:.2g} cm3), from the change of the"
                " volume with contraction by virtual work and the fills at several lengths."
            )
        return " ".join(filter(None, (predicted, volume, self.misfit, *self.supposed)))


def _is_rising(record: CampaignRecord) -> bool:
    return any(step.change > 0 for step in record.steps)


def _why_no_volume(contractions: Array, change: VolumeChange | None) -> str:
    """The reason why fills at these contractions give no volume, as a phrase."""
    ratio = "the ratio of conductance and volume only"
    if change is None:
        return f"the fills determine {ratio}, and no static law gives the volume"
    ends = [100 * contractions.min(), 100 * contractions.max()]
    at = f"at contractions of {ends[0]:.3g} to {ends[1]:.3g} %"
    return f"the fills {at} determine {ratio}; give the braid of the muscle"


def fit_fill_stage(
    records: Sequence[CampaignRecord],
    geometry: Geometry | None,
    change: VolumeChange | None,
    progress: Callable[[float], None],
) -> FillStage | LeftOutStage:
    """Fit conductances, critical ratios, heat transfer and supply pressure to all fills together.

    Each record has the ambient air that it states, and its own instants of the valve commands. A
    valve that no record shows is supposed to be equal to the other one, and so is a critical ratio
    that the records do not determine.

    geometry  the given geometry of the muscle; then the conductance follows from it
    change    the change of the volume with contraction; then fills at several lengths determine the
              volume at rest
    """
    if not records:
        return LeftOutStage(NAME, "no record is a fill or a discharge at a held length", REMEDY)
    estimate = None
    try:
        rising = [record for record in records if _is_rising(record)] or list(records)
        relative = _fit_relative(rising)
        contractions = np.array([fills.held_contraction(record) for record in rising])
        of_volume = [e for e in relative.estimates if e.name.startswith(VOLUME)]
        volumes = np.array([e.value for e in of_volume])
        errors = np.array([e.stderr for e in of_volume])
        progress(0.5)
        if geometry is not None:  # the factor that makes the relative volumes its own
            known = np.array([float(geometry.volume(contraction)) for contraction in contractions])
            scale = float(known @ volumes / (volumes @ volumes))
        else:
            if change is not None:
                estimate = relate_volumes(volumes, errors, contractions, change)
            if estimate is None or change is None:
                return LeftOutStage(NAME, _why_no_volume(contractions, change), REMEDY)
            geometry = change.geometry(estimate.volume_at_rest)
            scale = estimate.scale
        experiments = _experiments(records, rising, relative, geometry, scale)
        return _fit_jointly(records, experiments, geometry, estimate, progress)
    except AirmuscleError as error:
        return LeftOutStage(NAME, str(error.message), REMEDY)


def _fit_relative(records: Sequence[CampaignRecord]) -> DynamicFit:
    """A fit of own volumes of the records for an assumed conductance of the valve of their first
    direction.
    """

    def fitted(experiments: Sequence[Experiment]) -> DynamicFit:
        valves = fills.ValveUnknowns.of(records, experiments[0].plant)
        free = [
            *valves.shared,
            *([f"{valves.circuit}.discharge.{fills.CONDUCTANCE}"] if valves.both else []),
        ]
        return fills.fit_pressure(records, experiments, free, (VOLUME,))

    detected = [fills.detected_experiment(record, fills.vessel_plant(record)) for record in records]
    return _with_supply(records, detected, fitted)[0]


def _experiments(
    records: Sequence[CampaignRecord],
    rising: Sequence[CampaignRecord],
    relative: DynamicFit,
    geometry: Geometry,
    scale: float,
) -> list[Experiment]:
    """All records with the volumes of a geometry, from the valves of the scaled relative fit and
    its instants.
    """
    scaled_plant = fills.rescaled(fills.plant_of(relative.plant()), scale)
    plants = [
        fills.at_record(
            scaled_plant, record, float(geometry.volume(fills.held_contraction(record)))
        )
        for record in records
    ]
    detected = list(map(fills.detected_experiment, records, plants))
    return [
        (
            fills.with_instants(experiment, relative, rising.index(record))
            if record in rising
            else experiment
        )
        for record, experiment in zip(records, detected, strict=True)
    ]


def _fit_jointly(
    records: Sequence[CampaignRecord],
    experiments: Sequence[Experiment],
    geometry: Geometry,
    estimate: VolumeEstimate | None,
    progress: Callable[[float], None],
) -> FillStage:
    """The fit with the volumes of one curve, and the prediction of each record from the others."""
    everything = range(len(records))
    common_ratio = ""

    def fitted(experiments: Sequence[Experiment], chosen: Sequence[int] = everything) -> DynamicFit:
        fitted_records = [records[i] for i in chosen]
        fitted_experiments = [experiments[i] for i in chosen]
        unknowns = fills.ValveUnknowns.of(fitted_records, experiments[0].plant, common_ratio)
        free = [*unknowns.shared, *unknowns.paths(fills.CONDUCTANCE)]
        # the noise and the sample time are those of all records, also in a fit to a part of them
        return fills.fit_pressure(records, fitted_experiments, free)

    fit, experiments = _with_supply(records, experiments, fitted)
    valves = fills.ValveUnknowns.of(records, experiments[0].plant)
    if valves.both and (common_ratio := fills.poor_ratios(fit)):
        valves = dataclasses.replace(valves, common_ratio=common_ratio)
        fit = fitted(experiments)

    def fit_to_others(chosen: Sequence[int]) -> DynamicFit:
        progress(0.5 + 0.5 * (sum(everything) - sum(chosen)) / len(records))
        return fitted(experiments, chosen)

    predictions = cross_predict(fit, fit_to_others)
    fit = fit.with_scatter_of_records([prediction.common for prediction in predictions])
    contractions = np.array([fills.held_contraction(record) for record in records])
    described = [(fills.describe_supply, valves.sinks), (fills.describe_tube, valves.tube)]
    supposed = [describe(fit) for describe, is_used in described if is_used]
    supposed += [*valves.supposed, *describe_ambient([record.recording for record in records])]
    cross = tuple(rms for prediction in predictions for rms in prediction.rms.values())
    baselines = fills.fill_baselines(fit) if len(cross) == len(records) else ()
    return FillStage(
        fit=fit,
        records=tuple(records),
        experiments=tuple(experiments),
        geometry=geometry,
        estimate=estimate,
        contractions=contractions,
        cross_rms=cross,
        baselines=baselines,
        supposed=tuple(supposed),
    )


def _with_supply(
    records: Sequence[CampaignRecord], experiments: Sequence[Experiment], fitted: Fitted
) -> tuple[DynamicFit, Sequence[Experiment]]:
    """The fit with a constant supply; where it does not follow the records, with a volume before
    the valve or a tube, if the records determine it and the fit then follows them. Too large a tube
    stands for an error of the model.
    """
    constant = fitted(experiments)
    valves = fills.ValveUnknowns.of(records, experiments[0].plant)
    limit = MAX_FOLLOWED * fills.pressure_deviation(records)
    if not valves.fill or valves.sinks or valves.tube or max(fills.record_rms(constant)) <= limit:
        return constant, experiments
    refined = [
        fills.with_instants(experiment, constant, i) for i, experiment in enumerate(experiments)
    ]
    for change, begun, volume in (
        (_with_volume, refined, "supply.volume"),
        (_with_tube, experiments, "tube.volume"),
    ):
        try:
            fit, changed = change(begun, fitted)
        except AirmuscleError:  # the simulation fails on the way
            continue
        estimate = next(candidate for candidate in fit.estimates if candidate.name.endswith(volume))
        determined = not estimate.on_bound and estimate.stderr <= MAX_VOLUME_ERROR * estimate.value
        muscle = fills.volume_at_rest(fills.plant_of(fit.plant()))
        possible = change is _with_volume or estimate.value <= MAX_TUBE_VOLUME * muscle
        if determined and possible and max(fills.record_rms(fit)) <= limit:
            return fit, changed
    return constant, experiments


def _with_volume(
    experiments: Sequence[Experiment], fitted: Fitted
) -> tuple[DynamicFit, list[Experiment]]:
    """The fit with a volume before the valve."""
    changed = list(map(fills.with_supply_volume, experiments))
    return fitted(changed), changed


def _with_tube(
    experiments: Sequence[Experiment], fitted: Fitted
) -> tuple[DynamicFit, list[Experiment]]:
    """The fit with a tube between valves and muscle, whose number of segments AICc chooses."""
    plant = fills.plant_of(experiments[0].plant)

    def divided(changed: Plant) -> list[Experiment]:
        return [fills.with_circuit(experiment, changed.circuits[0]) for experiment in experiments]

    guess = dataclasses.replace(
        plant, circuit=WithTubes(fills.valves_of(plant.circuit), fills.tube_guess(plant))
    )
    fit = fit_tube(guess, lambda changed, _: fitted(divided(changed)))
    return fit, divided(fills.plant_of(fit.plant()))
