"""Fills and discharges of a campaign: their plants, a held muscle behind valves with a supply and
perhaps a tube, and their experiments with valve commands, initial pressure and unknowns."""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...core import tree
from ...engine.loop.inputs import Schedule
from ...physics import Isometric, Muscle, Plant, Vessel
from ...physics.pneumatics import (
    Circuit,
    EnergyBalance,
    FillDischarge,
    Supply,
    Tank,
    Tube,
    Valve,
    WithTubes,
)
from .. import dynamics
from ..prediction import ARX, PERSISTENCE, TimedRecord, baseline_errors, skill
from .record import CampaignRecord
from .transient import thin

ASSUMED_CONDUCTANCE = 1e-8
"""Conductance [m3/(s Pa)] for which the relative volumes are fitted (chosen)."""
HEAT_TRANSFER = "gas.heat_transfer"
HEAT_TRANSFER_BOUNDS = (1e-3, 1e3)
"""Path of the heat transfer, and its bounds [W/K] (chosen)."""
CONDUCTANCE = "conductance"
RATIO = "critical_ratio"
TUBE_VOLUME = "circuit.tube.volume"
TUBE_CONDUCTANCE = "circuit.tube.orifice.conductance"
MAX_RATIO_ERROR = 0.1
"""Standard error of a critical ratio from which it counts as not determined (chosen)."""
TUBE_STARTS = 16
TUBE_AREA = math.pi * 0.002**2
"""Number of initial guesses of a fit with a tube, which has several optima, and area of a tube of 4
mm of inner diameter [m2], which makes a volume comparable (chosen)."""
FIT_ROWS = 250
MIN_DEVIATION = 100.0
"""Maximum number of rows of a fill, and least standard deviation of the pressure sensor [Pa]
(chosen).
"""


def held_contraction(record: CampaignRecord) -> float:
    """The contraction at which the muscle is held."""
    return float(np.median(record.recording["contraction"]))


def vessel_plant(record: CampaignRecord) -> Plant:
    """The plant of a held muscle, with initial values from the steps of the record and the ambient
    air it states.
    """
    rising = [step for step in record.steps if step.change > 0]
    top = (
        max(step.final_pressure for step in record.steps)
        if rising
        else float(record.recording["pressure"][0])
    )
    duration = float(np.mean([step.duration for step in record.steps]))
    volume = ASSUMED_CONDUCTANCE * 1e5 * duration / 1.2
    vessel = Vessel(min(max(volume, 2e-7), 5e-2), record.resting_length or 0.2)
    valve = Valve(ASSUMED_CONDUCTANCE, 0.35)
    mechanism = Isometric(held_contraction(record))
    circuit = FillDischarge(Supply(top + 5e3), valve, valve)
    ambient = dynamics.stated_ambient(record.recording)
    return Plant(Muscle.ideal(vessel), circuit, mechanism, EnergyBalance(1.0), ambient)


def plant_of(plant: object) -> Plant:
    """The plant of a fill, which the records of a fit keep as any system."""
    assert isinstance(plant, Plant)
    return plant


def valves_of(circuit: object) -> FillDischarge:
    """The circuit of the valves, without a tube."""
    valves = circuit.circuit if isinstance(circuit, WithTubes) else circuit
    assert isinstance(valves, FillDischarge)
    return valves


def rescaled(plant: Plant, scale: float) -> Plant:
    """The plant with its conductances, heat transfer and volumes of supply and tube multiplied by
    the scale.
    """
    values = {leaf.path: leaf.value for leaf in tree.leaves(plant)}
    for path, value in values.items():
        if path == HEAT_TRANSFER:
            values[path] = float(np.clip(value * scale, *HEAT_TRANSFER_BOUNDS))
        elif path.startswith("circuit.") and path.endswith(("conductance", "volume")):
            values[path] = value * scale
    return tree.with_parameters(plant, list(values.values()))


def at_record(plant: Plant, record: CampaignRecord, volume: float) -> Plant:
    """The plant with this volume [m3], at the held length and in the ambient air of a record."""
    muscle = Muscle.ideal(Vessel(volume, plant.muscles[0].geometry.resting_length))
    mechanism = Isometric(held_contraction(record))
    ambient = dynamics.stated_ambient(record.recording)
    return dataclasses.replace(plant, muscle=muscle, mechanism=mechanism, ambient=ambient)


def tube_guess(plant: Plant) -> Tube:
    """Initial guess of a tube for a plant without one (chosen): a tenth of its volume, twice the
    conductance.
    """
    valve = valves_of(plant.circuit).fill
    assert isinstance(valve, Valve)
    return Tube(
        Valve(2.0 * valve.conductance, 0.3), min(max(0.1 * volume_at_rest(plant), 1e-9), 1e-2)
    )


def volume_at_rest(plant: Plant) -> float:
    """Volume of the first muscle of a plant at its resting length [m3]."""
    return float(plant.muscles[0].geometry.volume(0.0))


def sensor_of(plant: Plant) -> str:
    """The output at the pressure sensor of a plant, which is behind the valves: in the first
    segment of a tube.
    """
    circuit = plant.circuit
    return f"{circuit.tube.prefixes[0]}pressure" if isinstance(circuit, WithTubes) else "pressure"


@dataclasses.dataclass(frozen=True)
class ValveUnknowns:
    """The valves that the steps of the records show, and the reason for a common critical ratio,
    empty without one. `sinks`: the supply has a volume (`Tank`), so that its pressure sinks.
    `tube`: one lies between valves and muscle."""

    fill: bool
    discharge: bool
    common_ratio: str = ""
    sinks: bool = False
    tube: bool = False

    @classmethod
    def of(
        cls, records: Sequence[CampaignRecord], plant: object, common_ratio: str = ""
    ) -> "ValveUnknowns":
        """The valves through which the air of these records flows, with the supply and the tube of
        a plant.
        """
        changes = [step.change for record in records for step in record.steps]
        circuit = plant_of(plant).circuit
        sinks = isinstance(valves_of(circuit).supply, Tank)
        tube = isinstance(circuit, WithTubes)
        return cls(max(changes) > 0, min(changes) < 0, common_ratio, sinks, tube)

    @property
    def circuit(self) -> str:
        """The path of the circuit with the valves."""
        return "circuit.circuit" if self.tube else "circuit"

    @property
    def both(self) -> bool:
        """Whether the records show both valves."""
        return self.fill and self.discharge

    def paths(self, name: str) -> list[str | tuple[str, ...]]:
        """The paths of a parameter of the valves: one for each valve, or a pair with one common
        value.
        """
        paths = [f"{self.circuit}.{valve}.{name}" for valve in ("fill", "discharge")]
        if self.both and not (name == RATIO and self.common_ratio):
            return [*paths]
        return [tuple(paths if self.fill else paths[::-1])]

    @property
    def shared(self) -> list[str | tuple[str, ...]]:
        """The paths of critical ratios, the tube and, with a fill, of the supply."""
        paths = list(self.paths(RATIO))
        if self.tube:
            paths += [TUBE_VOLUME, TUBE_CONDUCTANCE]
        if self.fill:
            of_volume = ["supply.pressure", "feed.conductance", "volume"]
            names = of_volume if self.sinks else ["pressure"]
            paths += [f"{self.circuit}.supply.{name}" for name in names]
        return paths

    @property
    def supposed(self) -> list[str]:
        """What is supposed of the valves, as sentences."""
        if self.common_ratio:
            return [
                f"{self.common_ratio} Both valves are supposed to have the same critical ratio."
            ]
        if self.both:
            return []
        missing, shown = ("discharge", "fill") if self.fill else ("fill", "discharge")
        return [
            f"No record is a {missing}: the {missing} valve is supposed to be equal to the {shown}"
            " valve."
        ]


def poor_ratios(fit: dynamics.DynamicFit) -> str:
    """The critical ratios that a fit does not determine, as a sentence; empty if there are none."""
    poor = []
    for e in fit.estimates:
        is_poor = e.on_bound or not e.stderr <= MAX_RATIO_ERROR
        if is_poor and e.name.endswith(RATIO) and "orifice" not in e.name:
            reason = (
                f"standard error {e.stderr:.2g}"
                if np.isfinite(e.stderr)
                else "it has no effect on them"
            )
            reason = f"on its bound, {e.value:.3g}" if e.on_bound else reason
            poor.append(f"{e.name.split('.')[-2]} valve ({reason})")
    return (
        f"The records do not determine the critical ratio of the {' and the '.join(poor)}."
        if poor
        else ""
    )


def pressure_deviation(records: Sequence[CampaignRecord]) -> float:
    """Standard deviation of the pressure sensor [Pa]."""
    return max(
        float(np.median([r.inspection.sensors["pressure"].std for r in records])), MIN_DEVIATION
    )


def with_supply_volume(experiment: dynamics.Experiment) -> dynamics.Experiment:
    """The experiment with a volume before its valve that is fed from the supply; initial guess
    (chosen).
    """
    plant = plant_of(experiment.plant)
    circuit = valves_of(plant.circuit)
    assert isinstance(circuit.fill, Valve)
    tank = Tank(
        circuit.supply, Valve(3.0 * circuit.fill.conductance, 0.3), 3.0 * volume_at_rest(plant)
    )
    return with_circuit(experiment, dataclasses.replace(circuit, supply=tank))


def with_circuit(experiment: dynamics.Experiment, circuit: Circuit) -> dynamics.Experiment:
    """The experiment with another circuit; the recorded pressure is that behind the valves."""
    plant = dataclasses.replace(plant_of(experiment.plant), circuit=circuit)
    initial = dynamics.InitialConditions.at_rest(
        plant, experiment.initial_conditions.known["pressure"]
    )
    recording = experiment.recording.with_columns(
        **{sensor_of(plant): experiment.recording["pressure"]}
    )
    return dataclasses.replace(
        experiment, recording=recording, plant=plant, initial_conditions=initial
    )


def describe_tube(fit: dynamics.DynamicFit) -> str:
    """The tube between valves and muscle, as a sentence."""
    volume = fit[TUBE_VOLUME]
    conductance = fit[TUBE_CONDUCTANCE]
    circuit = plant_of(fit.plant()).circuit
    assert isinstance(circuit, WithTubes)
    count = circuit.tube.segment_count
    along = (
        f"fills along its length ({count} segments by AICc)"
        if count > 1
        else "fills evenly (one segment by AICc)"
    )
    return (
        f"A tube between valves and muscle, with the pressure sensor at the valves, {along}: its"
        f" volume of {1e6 * volume.value:.3g} cm3 (standard error {1e6 * volume.stderr:.2g} cm3)"
        f" and conductance of {conductance.value:.3g} m3/(s Pa) explain the records, which a muscle"
        " without a tube does not. Compare it with that of the rig (4 mm of inner diameter:"
        f" {volume.value / TUBE_AREA:.2g} m), for other causes look alike."
    )


def describe_supply(fit: dynamics.DynamicFit) -> str:
    """The volume before the valve, as a sentence."""
    names = ("supply.volume", "supply.feed.conductance")
    volume, feed = (next(e for e in fit.estimates if e.name.endswith(name)) for name in names)
    return (
        f"The supply pressure sinks during a fill: a volume of {1e6 * volume.value:.3g} cm3"
        f" (standard error {1e6 * volume.stderr:.2g} cm3) before the valve, fed through a"
        f" conductance of {feed.value:.3g} m3/(s Pa), explains the records, which a constant supply"
        " pressure does not."
    )


def valve_commands(record: CampaignRecord) -> dict[str, tuple[tuple[float, float], ...]]:
    """The detected instants [s] and values of the commands of both valves, counted from the start
    of the first step.
    """
    start = record.steps[0].start
    points: dict[str, tuple[tuple[float, float], ...]] = {"fill": (), "discharge": ()}
    for step in record.steps:
        opened, closed = ("fill", "discharge") if step.change > 0 else ("discharge", "fill")
        instant = max(step.start - start, 0.0)
        points[opened] += ((instant, 1.0),)
        points[closed] += ((instant, 0.0),) if points[closed] else ()
    return {name: values for name, values in points.items() if values}


def detected_experiment(record: CampaignRecord, plant: Plant) -> dynamics.Experiment:
    """The record with the detected instants of its steps."""
    began = record.steps[0].start
    pressure = record.recording["pressure"]
    before = record.recording["time"] < began
    initial = float(np.median(pressure[before])) if before.sum() >= 3 else float(pressure[0])
    conditions = dynamics.InitialConditions.at_rest(plant, initial)
    complete = record.recording.with_columns(**{sensor_of(plant): pressure})
    command = Schedule(valve_commands(record))
    return dynamics.Experiment(thin(complete, FIT_ROWS), command, conditions, began, plant)


def with_instants(
    experiment: dynamics.Experiment, fit: dynamics.DynamicFit, number: int
) -> dynamics.Experiment:
    """The experiment with the instants that a fit has found for it as its record of this number."""
    model = fit.problem.record_models[number]
    return dataclasses.replace(
        experiment, command=model.command(fit.values), start_time=model.start_time(fit.values)
    )


def fit_pressure(
    records: Sequence[CampaignRecord],
    experiments: Sequence[dynamics.Experiment],
    free: Sequence[str | tuple[str, ...]],
    record_unknowns: tuple[str, ...] = (),
) -> dynamics.DynamicFit:
    """A fit with the heat transfer, and own instants of the valve commands, because the detected
    ones are inexact: by a quarter of the shortest step, and two rows at least."""
    first = plant_of(experiments[0].plant)
    sample = max(float(np.median(np.diff(r.recording["time"]))) for r in records)
    margin = max(0.25 * min(step.duration for r in records for step in r.steps), 2.0 * sample)
    return dynamics.fit_dynamic(
        first,
        experiments,
        free=(HEAT_TRANSFER, *free),
        observed={sensor_of(first): pressure_deviation(records)},
        per_record=(*record_unknowns, dynamics.StartTime(margin), dynamics.CommandInstants(margin)),
        bounds={HEAT_TRANSFER: HEAT_TRANSFER_BOUNDS},
        starts=TUBE_STARTS if TUBE_VOLUME in free else 1,
    )


def record_rms(fit: dynamics.DynamicFit) -> tuple[float, ...]:
    """Rms residual of the pressure of each record [Pa]."""
    return tuple(fit.rms(model.names[0], i) for i, model in enumerate(fit.problem.record_models))


def fill_baselines(fit: dynamics.DynamicFit) -> tuple[dict[str, float], ...]:
    """Rms errors [Pa] of the pressure of each record by persistence and by an ARX model of the
    others.
    """
    records = []
    values = fit.values
    for model in fit.problem.record_models:
        commands = dynamics.commands_at(
            model.plant, model.command(values), model.times - model.start_time(values)
        )
        records.append(TimedRecord(model.times, model.measured, commands, model.valid))
    return tuple(
        {name: float(rms[0]) for name, rms in record_errors.items()}
        for record_errors in baseline_errors(records)
    )


def describe_skills(errors: Sequence[float], baselines: Sequence[Mapping[str, float]]) -> str:
    """The errors of the baselines and the skill of predictions with these errors, as a phrase;
    empty without them.
    """
    parts = []
    for name in (PERSISTENCE, ARX):
        known = [baseline[name] for baseline in baselines if name in baseline]
        if known:
            parts.append(f"{name} {min(known) / 1e3:.3g} to {max(known) / 1e3:.3g} kPa")
    pairs = zip(errors, baselines, strict=True) if baselines else ()
    values = [skill(rms, baseline) for rms, baseline in pairs]
    skills = [value for value in values if value is not None]
    if not skills:
        return ""
    return f" ({', '.join(parts)}; skill {min(skills):.2g} to {max(skills):.2g})"
