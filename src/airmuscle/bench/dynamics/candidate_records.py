"""Candidate records of a next experiment: fills and discharges of the same rig that differ from
those of a fit.
"""

import contextlib
import dataclasses
import itertools
from collections.abc import Iterator

import numpy as np

from ...core import Array, EquilibriumError, tree
from ...engine import Schedule
from ...physics import (
    EnergyBalance,
    FillDischarge,
    Isometric,
    Muscle,
    Plant,
    Valve,
    Vessel,
    WallHeatTransfer,
)
from ...recording import Recording
from .experiment import Experiment
from .initial_conditions import InitialConditions
from .result import DynamicFit

SUPPLY_FACTORS = (0.6, 1.4)
THROTTLE = 0.2
LONGER = 4.0
"""Absolute supply pressures of candidates, conductance of a throttled fill valve, and duration of a
longer record, relative to those of the fit (chosen)."""
CONTRACTION_STEP = 0.08
MAX_CONTRACTION = 0.2
"""Difference of the contraction of candidates at another held length, and maximum contraction
(chosen).
"""
PULSE_SHARE = 0.5
"""Share of the pressure rise at which a valve is closed again (chosen)."""
VALVE_PARAMETERS = ("conductance", "critical_ratio")
"""Parameters of a valve that its flow depends on, by the last part of their paths."""
FILL = Schedule({"fill": ((0.0, 1.0),)})


@dataclasses.dataclass(frozen=True, eq=False)
class CandidateRecord:
    """A record that could be measured: what it is, its simulated experiment, and what it does not
    share with the fit. `changed` are parameters that are unknowns of its own: those whose values
    differ from the fit by an unknown amount, such as the conductance of a throttled valve, and
    those that the records of the fit do not use. `replaced` is the beginning of the paths of a part
    of the plant that this record replaces by a known one."""

    description: str
    experiment: Experiment
    changed: tuple[str, ...] = ()
    replaced: str = ""


def candidate_records(fit: DynamicFit) -> tuple[CandidateRecord, ...]:
    """The records to compare for a fit: a repeat of its first record, a longer one, and further
    ones for a plant, as far as circuit and mechanism allow; each has as many rows as the first
    record."""
    plant = fit.plant(0)
    model = fit.problem.record_models[0]
    begun = dataclasses.replace(model.experiment, plant=plant, start_time=0.0)
    times = model.times - model.start_time(fit.values)
    candidates = [
        CandidateRecord("a repeat of the record", _with_times(begun, times, model.names)),
        CandidateRecord(
            f"the same record, {LONGER:g} times as long",
            _with_times(begun, LONGER * times, model.names),
        ),
    ]
    if not isinstance(plant, Plant):
        return tuple(candidates)
    pressure = float(begun.initial_conditions.known.get("pressure", 0.0))
    identified = frozenset(path for unknown in fit.unknowns for path in unknown.paths)
    context = _Context(plant, begun, times, model.names, pressure, identified)
    candidates += [*context.supplies(), *context.lengths()]
    if isinstance(plant.circuit, FillDischarge) and len(plant.muscles) == 1:
        with contextlib.suppress(
            EquilibriumError
        ):  # a hanging load does not rest at ambient pressure
            candidates.extend(context.valve_records(plant.circuit))
        candidates += context.tank(plant.circuit)
    return tuple(candidates)


@dataclasses.dataclass(frozen=True, eq=False)
class _Context:
    """The first record of a fit, from which the candidates are changed."""

    plant: Plant
    experiment: Experiment
    times: Array
    names: tuple[str, ...]
    pressure: float
    identified: frozenset[str]

    def supplies(self) -> Iterator[CandidateRecord]:
        """The same record from other supply pressures, which are measured."""
        ambient = float(self.plant.ambient.pressure)
        leaves = list(tree.leaves(self.plant))
        supplies = [leaf for leaf in leaves if leaf.path.endswith("supply.pressure")]
        for leaf, factor in itertools.product(supplies, SUPPLY_FACTORS):
            changed = factor * (leaf.value + ambient) - ambient
            values = [
                changed if parameter.path == leaf.path else parameter.value for parameter in leaves
            ]
            text = f"the same record from a supply of {changed / 1e3:.3g} kPa, which is measured"
            yield CandidateRecord(text, self._of(tree.with_parameters(self.plant, values)))

    def lengths(self) -> Iterator[CandidateRecord]:
        """The same record at other held lengths."""
        mechanism = self.plant.mechanism
        if not isinstance(mechanism, Isometric):
            return
        for contraction in {0.0, min(mechanism.contraction + CONTRACTION_STEP, MAX_CONTRACTION)}:
            if abs(contraction - mechanism.contraction) > 0.25 * CONTRACTION_STEP:
                changed = dataclasses.replace(self.plant, mechanism=Isometric(contraction))
                text = f"the same record at a contraction of {100 * contraction:.3g} %"
                yield CandidateRecord(text, self._of(changed))

    def valve_records(self, circuit: FillDischarge) -> Iterator[CandidateRecord]:
        """A discharge, a fill that stops halfway, and a fill through a throttle."""
        end = float(self.times[-1])
        high = float(tree.flatten(circuit.supply)[0])
        discharge = self._of(self.plant, Schedule({"discharge": ((0.0, 1.0),)}), high)
        flow = [
            leaf.path
            for leaf in tree.leaves(self.plant)
            if leaf.path.startswith("circuit.discharge.")
        ]
        unknown = tuple(
            path for path in flow if path.endswith(VALVE_PARAMETERS) and path not in self.identified
        )
        yield CandidateRecord("a discharge from the supply pressure", discharge, unknown)
        ambient = float(self.plant.ambient.pressure)
        volume = float(self.plant.muscles[0].geometry.volume(0.0))
        conductance = circuit.fill.conductance if isinstance(circuit.fill, Valve) else 1e-8
        rate = (
            conductance * (high + ambient) * 1e5 / volume
        )  # [Pa/s] at the reference pressure of ISO 8778
        half = float(np.clip(PULSE_SHARE * high / rate, 0.02 * end, 0.5 * end))  # of a choked fill
        closed = Schedule({"fill": ((0.0, 1.0), (half, 0.0))})
        text = (
            f"a fill whose valve is closed after {half:.2g} s, and the pressure until {end:.2g} s"
        )
        yield CandidateRecord(text, self._of(self.plant, closed, 0.0))
        if isinstance(circuit.fill, Valve):
            throttled = dataclasses.replace(
                circuit.fill, conductance=THROTTLE * circuit.fill.conductance
            )
            plant = dataclasses.replace(
                self.plant, circuit=dataclasses.replace(circuit, fill=throttled)
            )
            slow = dataclasses.replace(self, times=self.times / THROTTLE)._of(plant, FILL, 0.0)
            yield CandidateRecord(
                "a slow fill through a throttle", slow, ("circuit.fill.conductance",)
            )

    def tank(self, circuit: FillDischarge) -> Iterator[CandidateRecord]:
        """A fill of a rigid tank whose volume is known, at the valve of the muscle; its wall is
        another one.
        """
        volume = float(self.plant.muscles[0].geometry.volume(0.0))
        length = float(self.plant.muscles[0].geometry.resting_length)
        vessel = Muscle.ideal(Vessel(float(np.clip(volume, 2e-7, 5e-2)), length))
        plant = dataclasses.replace(
            self.plant, muscle=vessel, circuit=circuit, mechanism=Isometric(0.0)
        )
        coefficients = {
            EnergyBalance: ("gas.heat_transfer",),
            WallHeatTransfer: ("gas.coefficient",),
        }
        changed = coefficients.get(type(plant.gas), ())
        text = (
            f"a fill of a rigid tank of known volume, about {1e6 * volume:.3g} cm3, through the"
            " same valve"
        )
        yield CandidateRecord(text, self._of(plant, FILL, 0.0), changed, "muscle.")

    def _of(
        self, plant: Plant, command: Schedule | None = None, pressure: float | None = None
    ) -> Experiment:
        conditions = self.experiment.initial_conditions
        if pressure is not None or plant.mechanism is not self.plant.mechanism:
            conditions = InitialConditions.at_rest(
                plant, self.pressure if pressure is None else pressure
            )
        experiment = dataclasses.replace(
            self.experiment,
            plant=plant,
            command=command or self.experiment.command,
            initial_conditions=conditions,
        )
        return _with_times(experiment, self.times, self.names)


def _with_times(experiment: Experiment, times: Array, names: tuple[str, ...]) -> Experiment:
    columns = {"time": times, **{name: np.zeros(times.size) for name in names}}
    return dataclasses.replace(experiment, recording=Recording(columns, "candidate"))
