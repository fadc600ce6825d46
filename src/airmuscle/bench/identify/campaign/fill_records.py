"""Fills and discharges of a campaign as experiments: plant of a held muscle, valve commands, initial pressure, and the
unknowns of both valves."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ....engine.loop.inputs import Schedule
from ....physics.mechanism import Isometric
from ....physics.muscle import Muscle
from ....physics.muscle.geometry import Vessel
from ....physics.plant.plant import Plant
from ....physics.pneumatics import EnergyBalance, FillDischarge, Supply, Tank, Valve
from ...baselines import ARX, PERSISTENCE, TimedRecord, baseline_errors, skill
from ..dynamic import (
    CommandInstants,
    DynamicFit,
    Experiment,
    InitialConditions,
    StartTime,
    commands_at,
    fit_dynamic,
    stated_ambient,
)
from ..result import Estimate
from .record import CampaignRecord
from .transient import thin

FILL, DISCHARGE = "circuit.fill", "circuit.discharge"
SUPPLY = "circuit.supply"
CONDUCTANCE, RATIO = "conductance", "critical_ratio"
MAX_RATIO_ERROR = 0.1
"""Standard error of a critical ratio from which it counts as not determined (chosen)."""


@dataclasses.dataclass(frozen=True)
class ValveUnknowns:
    """The valves that the steps of the records show, and the reason for a common critical ratio, empty without one.

    `sinks`: the supply has a volume (`Tank`), so that its pressure sinks.
    """

    fill: bool
    discharge: bool
    common_ratio: str = ""
    sinks: bool = False

    @classmethod
    def of(cls, records: Sequence[CampaignRecord], common_ratio: str = "", sinks: bool = False) -> "ValveUnknowns":
        """The valves through which the air of these records flows."""
        changes = [step.change for record in records for step in record.steps]
        return cls(any(change > 0 for change in changes), any(change < 0 for change in changes), common_ratio, sinks)

    @property
    def both(self) -> bool:
        """Whether the records show both valves."""
        return self.fill and self.discharge

    def paths(self, name: str) -> list[str | tuple[str, ...]]:
        """The paths of a parameter of the valves: one for each valve, or a pair with one common value."""
        paths = [f"{valve}.{name}" for valve in (FILL, DISCHARGE)]
        if self.both and not (name == RATIO and self.common_ratio):
            return [*paths]
        return [tuple(paths if self.fill else paths[::-1])]

    @property
    def shared(self) -> list[str | tuple[str, ...]]:
        """The paths of critical ratios and, with a fill, of the supply."""
        constant, sinking = ["pressure"], ["supply.pressure", "feed.conductance", "volume"]
        names = [f"{SUPPLY}.{name}" for name in (sinking if self.sinks else constant)]
        return [*self.paths(RATIO), *(names if self.fill else [])]

    @property
    def supposed(self) -> list[str]:
        """What is supposed of the valves, as sentences."""
        if self.common_ratio:
            return [f"{self.common_ratio} Both valves are supposed to have the same critical ratio."]
        if self.both:
            return []
        missing, shown = ("discharge", "fill") if self.fill else ("fill", "discharge")
        return [f"No record is a {missing}: the {missing} valve is supposed to be equal to the {shown} valve."]


def poor_ratios(fit: DynamicFit) -> str:
    """The critical ratios that a fit does not determine, as a sentence; empty if there are none."""
    poor = [e for e in fit.estimates if e.name.endswith(RATIO) and (e.on_bound or not e.stderr <= MAX_RATIO_ERROR)]
    if not poor:
        return ""
    parts = [f"{estimate.name.split('.')[1]} valve ({_reason(estimate)})" for estimate in poor]
    return f"The records do not determine the critical ratio of the {' and the '.join(parts)}."


def _reason(estimate: Estimate) -> str:
    if estimate.on_bound:
        return f"on its bound, {estimate.value:.3g}"
    return f"standard error {estimate.stderr:.2g}" if np.isfinite(estimate.stderr) else "it has no effect on them"


FIT_ROWS = 250
"""Maximum number of rows of a fill (chosen)."""
ASSUMED_CONDUCTANCE = 1e-8
"""Conductance [m3/(s Pa)] for which the relative volumes are fitted (chosen)."""
MIN_DEVIATION = 100.0
"""Least standard deviation of the pressure sensor [Pa] (chosen)."""
HEAT_TRANSFER = "gas.heat_transfer"
HEAT_TRANSFER_BOUNDS = (1e-3, 1e3)
"""Bounds of the heat transfer [W/K] (chosen)."""


def held_contraction(record: CampaignRecord) -> float:
    """The contraction at which the muscle is held."""
    return float(np.median(record.recording["contraction"]))


def pressure_deviation(records: Sequence[CampaignRecord]) -> float:
    """Standard deviation of the pressure sensor [Pa]."""
    return max(float(np.median([r.inspection.sensors["pressure"].std for r in records])), MIN_DEVIATION)


def instant_margin(records: Sequence[CampaignRecord]) -> float:
    """Maximum error of the detected start of a step [s]: a quarter of the shortest step, at least two rows."""
    sample = max(float(np.median(np.diff(r.recording["time"]))) for r in records)
    return max(0.25 * min(step.duration for r in records for step in r.steps), 2.0 * sample)


def vessel_plant(record: CampaignRecord) -> Plant:
    """The plant of a held muscle, with initial values from the steps of the record and the ambient air it states."""
    rising = [step for step in record.steps if step.change > 0]
    top = max(step.final_pressure for step in record.steps) if rising else float(record.recording["pressure"][0])
    duration = float(np.mean([step.duration for step in record.steps]))
    volume = ASSUMED_CONDUCTANCE * 1e5 * duration / 1.2
    muscle = Muscle.ideal(Vessel(min(max(volume, 2e-7), 5e-2), record.resting_length or 0.2))
    valve = Valve(ASSUMED_CONDUCTANCE, 0.35)
    circuit = FillDischarge(Supply(top + 5e3), valve, valve)
    return Plant(
        muscle, circuit, Isometric(held_contraction(record)), EnergyBalance(1.0), stated_ambient(record.recording)
    )


def rescaled(plant: object, scale: float) -> Plant:
    """The plant with its conductances, heat transfer and volume of the supply multiplied by the scale."""
    assert isinstance(plant, Plant)
    circuit, gas = plant.circuit, plant.gas
    assert isinstance(circuit, FillDischarge)
    assert isinstance(gas, EnergyBalance)
    supply = circuit.supply
    if isinstance(supply, Tank) and isinstance(supply.feed, Valve):
        feed = dataclasses.replace(supply.feed, conductance=supply.feed.conductance * scale)
        supply = dataclasses.replace(supply, feed=feed, volume=supply.volume * scale)
    fill, discharge = (
        dataclasses.replace(valve, conductance=valve.conductance * scale)
        for valve in (circuit.fill, circuit.discharge)
        if isinstance(valve, Valve)
    )
    return dataclasses.replace(
        plant,
        circuit=dataclasses.replace(circuit, supply=supply, fill=fill, discharge=discharge),
        gas=dataclasses.replace(gas, heat_transfer=float(np.clip(gas.heat_transfer * scale, *HEAT_TRANSFER_BOUNDS))),
    )


def at_record(plant: Plant, record: CampaignRecord, volume: float) -> Plant:
    """The plant with this volume [m3], at the held length and in the ambient air of a record."""
    vessel = Vessel(volume, plant.muscles[0].geometry.resting_length)
    return dataclasses.replace(
        plant, muscle=Muscle.ideal(vessel), mechanism=Isometric(held_contraction(record)),
        ambient=stated_ambient(record.recording),
    )  # fmt: skip


def with_supply_volume(experiment: Experiment) -> Experiment:
    """The experiment with a volume before its valve that is fed from the supply; initial guess (chosen)."""
    plant = experiment.plant
    assert isinstance(plant, Plant)
    circuit = plant.circuit
    assert isinstance(circuit, FillDischarge)
    assert isinstance(circuit.fill, Valve)
    feed = Valve(3.0 * circuit.fill.conductance, 0.3)
    tank = Tank(circuit.supply, feed, 3.0 * float(plant.muscles[0].geometry.volume(0.0)))
    plant = dataclasses.replace(plant, circuit=dataclasses.replace(circuit, supply=tank))
    initial = experiment.initial_conditions.known["pressure"]
    return dataclasses.replace(experiment, plant=plant, initial_conditions=InitialConditions.at_rest(plant, initial))


def has_supply_volume(plant: object) -> bool:
    """Whether the supply of a plant has a volume, so that its pressure sinks."""
    return isinstance(plant, Plant) and any(isinstance(circuit.supply, Tank) for circuit in plant.circuits)


def describe_supply(fit: DynamicFit) -> str:
    """The volume before the valve, as a sentence."""
    volume, feed = fit[f"{SUPPLY}.volume"], fit[f"{SUPPLY}.feed.conductance"]
    return (
        f"The supply pressure sinks during a fill: a volume of {1e6 * volume.value:.3g} cm3 (standard error "
        f"{1e6 * volume.stderr:.2g} cm3) before the valve, fed through a conductance of {feed.value:.3g} m3/(s Pa), "
        "explains the records, which a constant supply pressure does not."
    )


def valve_commands(record: CampaignRecord) -> dict[str, tuple[tuple[float, float], ...]]:
    """The detected instants [s] and values of the commands of both valves, counted from the start of the first step."""
    start = record.steps[0].start
    points: dict[str, list[tuple[float, float]]] = {"fill": [], "discharge": []}
    for step in record.steps:
        opened, closed = ("fill", "discharge") if step.change > 0 else ("discharge", "fill")
        instant = max(step.start - start, 0.0)
        if points[closed]:
            points[closed].append((instant, 0.0))
        points[opened].append((instant, 1.0))
    return {name: tuple(values) for name, values in points.items() if values}


def detected_experiment(record: CampaignRecord, plant: Plant) -> Experiment:
    """The record with the detected instants of its steps."""
    recording = thin(record.recording, FIT_ROWS)
    began = record.steps[0].start
    before = record.recording["time"] < began
    pressure = record.recording["pressure"]
    initial = float(np.median(pressure[before])) if before.sum() >= 3 else float(pressure[0])
    conditions = InitialConditions.at_rest(plant, initial)
    return Experiment(recording, Schedule(valve_commands(record)), conditions, began, plant)


def with_instants(experiment: Experiment, fit: DynamicFit, number: int) -> Experiment:
    """The experiment with the instants that a fit has found for it as its record of this number."""
    model = fit.problem.record_models[number]
    return dataclasses.replace(experiment, command=model.command(fit.values), start_time=model.start_time(fit.values))


def fit_pressure(
    records: Sequence[CampaignRecord], experiments: Sequence[Experiment], free: Sequence[str | tuple[str, ...]],
    own: tuple[str, ...] = (),
) -> DynamicFit:  # fmt: skip
    """A fit with the heat transfer, and own instants of the valve commands, because the detected ones are inexact."""
    first, margin = experiments[0].plant, instant_margin(records)
    assert first is not None
    return fit_dynamic(
        first, experiments, free=(HEAT_TRANSFER, *free), observed={"pressure": pressure_deviation(records)},
        per_record=(*own, StartTime(margin), CommandInstants(margin)), bounds={HEAT_TRANSFER: HEAT_TRANSFER_BOUNDS},
    )  # fmt: skip


def fill_baselines(fit: DynamicFit) -> tuple[dict[str, float], ...]:
    """Rms errors [Pa] of the pressure of each record by persistence and by an ARX model of the others."""
    records, values = [], fit.values
    for model in fit.problem.record_models:
        commands = commands_at(model.plant, model.command(values), model.times - model.start_time(values))
        records.append(TimedRecord(model.times, model.measured, commands, model.valid))
    return tuple({name: float(rms[0]) for name, rms in each.items()} for each in baseline_errors(records))


def describe_skills(errors: Sequence[float], baselines: Sequence[Mapping[str, float]]) -> str:
    """The errors of the baselines and the skill of predictions with these errors, as a phrase; empty without them."""
    parts = [
        f"{name} {min(known) / 1e3:.3g} to {max(known) / 1e3:.3g} kPa"
        for name in (PERSISTENCE, ARX)
        if (known := [each[name] for each in baselines if name in each])
    ]
    pairs = zip(errors, baselines, strict=True) if baselines else ()
    skills = [value for rms, each in pairs if (value := skill(rms, each)) is not None]
    return f" ({', '.join(parts)}; skill {min(skills):.2g} to {max(skills):.2g})" if skills else ""
