"""Valve and enclosed volume of a campaign: a joint fit of all fills and discharges of the rig."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ...control.inputs import Schedule
from ...core.arrays import Array
from ...core.errors import AirmuscleError
from ...core.short_repr import ShortRepr
from ...mechanism import Isometric
from ...muscle import Muscle
from ...muscle.geometry import Geometry, Vessel
from ...plant.plant import Plant
from ...pneumatics import FillDischarge, Supply, Valve
from ...pneumatics.gas import EnergyBalance
from ..dynamic import DynamicFit, Experiment, InitialConditions, StartTime, fit_dynamic
from .record import CampaignRecord
from .rows import thin
from .stage import LeftOutStage
from .volume import VolumeChange, VolumeEstimate, relate_volumes

NAME = "fills and volume"
FIT_ROWS = 250
"""Maximum number of rows of a fill (chosen)."""
ASSUMED_CONDUCTANCE = 1e-8
"""Conductance of the fill valve [m3/(s Pa)] for which the relative volumes are fitted (chosen)."""
MIN_DEVIATION = 100.0
"""Least standard deviation of the pressure sensor [Pa] (chosen)."""
FILL, DISCHARGE = "circuit.fill", "circuit.discharge"
RATIOS = (f"{FILL}.critical_ratio", f"{DISCHARGE}.critical_ratio")
VOLUME = "muscle.geometry.enclosed_volume"
SUPPLY = "circuit.supply.pressure"
REMEDY = (
    "record a fill from ambient pressure and a discharge through the valve at a held length, at three lengths with the "
    "same valve and supply, at 100 rows per second or more, until the pressure has settled"
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FillStage(ShortRepr):
    """The joint fit of all fills with common valves and one volume curve, and the prediction of each from the others.

    `estimate` is None where the geometry was given.
    """

    fit: DynamicFit
    records: tuple[CampaignRecord, ...]
    experiments: tuple[Experiment, ...]
    geometry: Geometry
    estimate: VolumeEstimate | None
    contractions: Array
    volumes: Array
    """Relative volumes times the scale [m3], shape (K,): what each fill alone says with the common valve."""
    cross_rms: tuple[float, ...]
    """Rms error of the pressure of each fill, predicted by the parameters of the others [Pa]; empty for one fill."""

    @property
    def circuit(self) -> FillDischarge:
        """The circuit with the fitted valves and supply."""
        plant = self.fit.plant()
        assert isinstance(plant, Plant)
        assert isinstance(plant.circuit, FillDischarge)
        return plant.circuit

    @property
    def verdict(self) -> str:
        """Cross-prediction, volume and residuals, as sentences."""
        rms = [self.fit.rms("pressure", i) / 1e3 for i in range(len(self.records))]
        text = ""
        if self.cross_rms:
            text = (
                f"Each fill predicted by the parameters of the others: rms error {min(self.cross_rms) / 1e3:.3g} to "
                f"{max(self.cross_rms) / 1e3:.3g} kPa. "
            )
        text += f"Joint fit of {len(rms)} records: rms residual {min(rms):.3g} to {max(rms):.3g} kPa."
        if self.estimate is not None:
            text += (
                f" Volume at zero contraction {1e6 * self.estimate.volume_at_rest:.4g} cm3 (standard error "
                f"{1e6 * self.estimate.volume_stderr:.2g} cm3), from the change of the volume with contraction by "
                "virtual work and the fills at several lengths."
            )
        else:
            text += " The volume is that of the given geometry."
        return text


def fit_fill_stage(
    records: Sequence[CampaignRecord],
    geometry: Geometry | None,
    change: VolumeChange | None,
    progress: Callable[[float], None],
) -> FillStage | LeftOutStage:
    """Fit conductances, critical ratio, heat transfer and supply pressure to all fills together.

    geometry  the given geometry of the muscle; then the conductance follows from it
    change    the change of the volume with contraction; then fills at several lengths determine the volume at rest
    """
    if not records:
        return LeftOutStage(NAME, "no record is a fill or a discharge at a held length", REMEDY)
    try:
        relative = _fit_relative(records)
        progress(0.5)
        values = np.array([e.value for e in relative.estimates if e.name.startswith(VOLUME)])
        errors = np.array([e.stderr for e in relative.estimates if e.name.startswith(VOLUME)])
        contractions = np.array([_contraction(record) for record in records])
        estimate = None
        if geometry is None:
            estimate = None if change is None else relate_volumes(values, errors, contractions, change)
            if estimate is None or change is None:
                return LeftOutStage(NAME, _no_volume(contractions, change), REMEDY)
            geometry, scale = change.geometry(estimate.volume_at_rest), estimate.scale
        else:
            known = np.array([float(geometry.volume(c)) for c in contractions])
            scale = float(known @ values / (values @ values))
        return _fit_jointly(records, relative, geometry, estimate, contractions, scale * values, scale, progress)
    except AirmuscleError as error:
        return LeftOutStage(NAME, str(error.message), REMEDY)


def _no_volume(contractions: Array, change: VolumeChange | None) -> str:
    if change is None:
        return "the fills determine the ratio of conductance and volume only, and no static law gives the volume"
    return (
        f"the fills at contractions of {100 * contractions.min():.3g} to {100 * contractions.max():.3g} % determine "
        "the ratio of conductance and volume only; give the braid of the muscle"
    )


def _fit_relative(records: Sequence[CampaignRecord]) -> DynamicFit:
    """The volumes of the fills for the assumed conductance of the fill valve, and what the records share."""
    experiments = [_experiment(record, _vessel_plant(record, 1.0)) for record in records]
    first = experiments[0].plant
    assert isinstance(first, Plant)
    shared: list[str | tuple[str, ...]] = ["gas.heat_transfer", RATIOS]
    if any(step.change < 0 for record in records for step in record.steps):
        shared.append(f"{DISCHARGE}.conductance")
    if any(step.change > 0 for record in records for step in record.steps):
        shared.append(SUPPLY)
    return fit_dynamic(
        first, experiments, free=shared, observed={"pressure": _deviation(records)},
        per_record=(VOLUME, StartTime(_margin(records))), bounds={"gas.heat_transfer": (1e-3, 1e3)},
    )  # fmt: skip


def _fit_jointly(
    records: Sequence[CampaignRecord],
    relative: DynamicFit,
    geometry: Geometry,
    estimate: VolumeEstimate | None,
    contractions: Array,
    volumes: Array,
    scale: float,
    progress: Callable[[float], None],
) -> FillStage:
    """The fit with the volumes of one curve, and the prediction of each record from the others."""
    own = [float(geometry.volume(c)) for c in contractions]
    experiments = [
        _experiment(record, _rescaled(relative.plant(i), scale, volume), _start(relative, i))
        for i, (record, volume) in enumerate(zip(records, own, strict=True))
    ]
    fit = _fit_common(records, experiments, range(len(records)))
    cross = []
    if len(records) > 1:
        for i in range(len(records)):
            others = [k for k in range(len(records)) if k != i]
            part = _fit_common(records, experiments, others)
            cross.append(_prediction_rms(fit, part, i))
            progress(0.5 + 0.5 * (i + 1) / len(records))
    return FillStage(fit, tuple(records), tuple(experiments), geometry, estimate, contractions, volumes, tuple(cross))


def _fit_common(
    records: Sequence[CampaignRecord], experiments: Sequence[Experiment], chosen: Sequence[int]
) -> DynamicFit:
    used = [experiments[i] for i in chosen]
    steps = [step for i in chosen for step in records[i].steps]
    free: list[str | tuple[str, ...]] = ["gas.heat_transfer", RATIOS]
    if any(step.change > 0 for step in steps):
        free += [f"{FILL}.conductance", SUPPLY]
    if any(step.change < 0 for step in steps):
        free.append(f"{DISCHARGE}.conductance")
    first = used[0].plant
    assert first is not None
    return fit_dynamic(
        first, used, free=free, observed={"pressure": _deviation(records)}, per_record=(StartTime(_margin(records)),),
        bounds={"gas.heat_transfer": (1e-3, 1e3)},
    )  # fmt: skip


def _prediction_rms(fit: DynamicFit, part: DynamicFit, record: int) -> float:
    """Rms error [Pa] of a record for the common parameters of another fit, with its own start time."""
    values = fit.values.copy()
    names = [estimate.name for estimate in fit.estimates]
    for estimate in part.estimates:
        if "record" not in estimate.name:
            values[names.index(estimate.name)] = estimate.value
    model = fit.problem.record_models[record]
    differences = model.evaluate(values).values[:, 0] - model.experiment.recording["pressure"]
    return float(np.sqrt(np.mean(differences**2)))


def _contraction(record: CampaignRecord) -> float:
    return float(np.median(record.recording["contraction"]))


def _deviation(records: Sequence[CampaignRecord]) -> float:
    """Standard deviation of the pressure sensor [Pa]."""
    return max(float(np.median([r.inspection.sensors["pressure"].std for r in records])), MIN_DEVIATION)


def _margin(records: Sequence[CampaignRecord]) -> float:
    """Maximum error of the detected start of a step [s]: a quarter of the shortest step, at least two rows."""
    sample = max(float(np.median(np.diff(r.recording["time"]))) for r in records)
    return max(0.25 * min(step.duration for r in records for step in r.steps), 2.0 * sample)


def _start(fit: DynamicFit, record: int) -> float:
    return fit.problem.record_models[record].start_time(fit.values)


def _vessel_plant(record: CampaignRecord, scale: float) -> Plant:
    """The plant of a held muscle, with initial values from the steps of the record."""
    rising = [step for step in record.steps if step.change > 0]
    top = max(step.final_pressure for step in record.steps) if rising else float(record.recording["pressure"][0])
    duration = float(np.mean([step.duration for step in record.steps]))
    volume = ASSUMED_CONDUCTANCE * 1e5 * duration / 1.2
    muscle = Muscle.ideal(Vessel(min(max(volume, 2e-7), 5e-2), record.resting_length or 0.2))
    valve = Valve(ASSUMED_CONDUCTANCE, 0.35)
    circuit = FillDischarge(Supply(top + 5e3), valve, valve)
    return Plant(muscle, circuit, Isometric(_contraction(record)), gas=EnergyBalance(1.0 * scale))


def _rescaled(plant: object, scale: float, volume: float) -> Plant:
    """The plant with this volume [m3], its conductances and heat transfer multiplied by the scale."""
    assert isinstance(plant, Plant)
    circuit, gas = plant.circuit, plant.gas
    assert isinstance(circuit, FillDischarge)
    assert isinstance(gas, EnergyBalance)
    fill, discharge = (
        dataclasses.replace(valve, conductance=valve.conductance * scale)
        for valve in (circuit.fill, circuit.discharge)
        if isinstance(valve, Valve)
    )
    vessel = Vessel(volume, plant.muscles[0].geometry.resting_length)
    return dataclasses.replace(
        plant,
        muscle=Muscle.ideal(vessel),
        circuit=dataclasses.replace(circuit, fill=fill, discharge=discharge),
        gas=dataclasses.replace(gas, heat_transfer=float(np.clip(gas.heat_transfer * scale, 1e-3, 1e3))),
    )


def valve_commands(record: CampaignRecord) -> dict[str, tuple[tuple[float, float], ...]]:
    """The instants [s] and values of the commands of both valves, counted from the start of the first step."""
    start = record.steps[0].start
    points: dict[str, list[tuple[float, float]]] = {"fill": [], "discharge": []}
    for step in record.steps:
        opened, closed = ("fill", "discharge") if step.change > 0 else ("discharge", "fill")
        instant = max(step.start - start, 0.0)
        if points[closed]:
            points[closed].append((instant, 0.0))
        points[opened].append((instant, 1.0))
    return {name: tuple(values) for name, values in points.items() if values}


def _experiment(record: CampaignRecord, plant: Plant, start: float | None = None) -> Experiment:
    recording = thin(record.recording, FIT_ROWS)
    began = record.steps[0].start if start is None else start
    before = record.recording["time"] < record.steps[0].start
    pressure = record.recording["pressure"]
    initial = float(np.median(pressure[before])) if before.sum() >= 3 else float(pressure[0])
    conditions = InitialConditions.at_rest(plant, initial)
    return Experiment(recording, Schedule(valve_commands(record)), conditions, began, plant)
