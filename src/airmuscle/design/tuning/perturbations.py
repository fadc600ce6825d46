"""Perturbations of a plant and its loop: the family of cases for which gains are tuned."""

import dataclasses
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...bench.prediction import PlantUncertainty
from ...core import (
    AirmuscleError,
    ParameterError,
    check_field_types,
    leaves,
    with_parameters,
    within,
)
from ...engine.loop import MAX_DELAY, ColumnSensor, ControlLaw, ControlLoop, WithSensors
from ...files.library import ParameterUncertainty, located_errors
from ...files.scenario.plant_uncertainty import SEPARATOR, parameter_uncertainty
from ...physics import Plant, Valve, WithLeak
from .case import LoopCase

LOAD = re.compile(r"^mechanism\.(.+\.)?(mass|inertia|weight_torque|payload|force)$")
"""Parameters of a mechanism that a factor of the load multiplies; where all are 0, as in an
identified joint, ROTOR.
"""
ROTOR = re.compile(r"^mechanism\.(.+\.)?rotor_inertia$")
LEAK_CRITICAL_RATIO = 0.3
"""Critical pressure ratio of the leak (chosen)."""
MAX_ATTEMPTS = 1000
"""Draws after which a distribution is considered impossible (chosen)."""
SUPPLY = re.compile(r"(^|\.)supply\.pressure$")
_CONDUCTANCE = re.compile(r"\.conductance$")
InitialState = Callable[[Plant], Mapping[str, float] | None]


@dataclasses.dataclass(frozen=True)
class Perturbations:
    """Perturbations of the nominal plant, each of which gives one case; all defaults are chosen.

    loads     factors of the load: mass, inertia, weight torque, payload and force of the mechanism
              together
    supplies  factors of the supply pressure
    leak      conductance of a leak at every muscle, as a share of the largest conductance of its
              circuit; 0: none
    delay     dead time of all measurements, in samples; 0: none
    draws     number of random draws of fitted parameters, from their covariance in the muscle files
    """

    loads: tuple[float, ...] = (0.5, 2.0)
    supplies: tuple[float, ...] = (0.8,)
    leak: float = within(0, 1, default=0.01)
    delay: int = within(0, MAX_DELAY, default=1)
    draws: int = within(0, 10_000, default=4)

    def __post_init__(self) -> None:
        check_field_types(self)
        for name in ("loads", "supplies"):
            for factor in getattr(self, name):
                if not 0 < factor < math.inf or factor == 1.0:
                    raise ParameterError(
                        f"Perturbations: {name} contains {factor:g}; a factor must be positive,"
                        " finite and not 1."
                    )


class PerturbedFamily(NamedTuple):
    """The cases of a family, the nominal one first, and notes on perturbations that the plant does
    not have.
    """

    cases: tuple[LoopCase, ...]
    notes: tuple[str, ...]


def perturbed_family(
    plant: Plant,
    loop: ControlLoop,
    perturbations: Perturbations = Perturbations(),
    *,
    initial_state: InitialState = lambda plant: None,
    uncertainties: Sequence[ParameterUncertainty | None] = (),
    fitted: PlantUncertainty | None = None,
    seed: int = 0,
) -> PerturbedFamily:
    """The nominal case and one case for each perturbation.

    initial_state   function from a perturbed plant to its initial state; None is equilibrium at
                    ambient pressure
    uncertainties   of the fitted parameters of each muscle, as `load(name).uncertainty`. Muscles
                    with equal uncertainty have equal deviations, because their parameters come from
                    one fit
    fitted          of the parameters of an identified plant, as `load_scenario(path).uncertainty`;
                    draws of them are limited to the declared ranges
    seed            of the random draws

    A perturbation that the plant does not have, such as the load of an isometric muscle, is stated
    in the notes. Raises ParameterError where a perturbed parameter is outside its declared range.
    """
    cases = [LoopCase("nominal", plant, loop, initial_state(plant))]
    notes = list[str]()
    changed = _scaled(plant, perturbations, notes)
    if perturbations.leak:
        changed += _leaking(plant, perturbations.leak, notes)
    drawn = list(parameter_draws(plant, uncertainties, fitted, perturbations.draws, seed))
    changed += drawn
    if perturbations.draws and not drawn:
        notes.append(
            "no drawn parameters: neither the scenario nor a muscle file states the uncertainty of"
            " parameters"
        )
    for name, varied in changed:
        with located_errors(f"case '{name}'"):
            cases.append(LoopCase(name, varied, loop, initial_state(varied)))
    if perturbations.delay and not isinstance(loop.controller, ControlLaw):
        notes.append("no case with a delay: the controller is no ControlLaw")
    elif perturbations.delay:
        law: Any = loop.controller
        sensors = tuple(
            ColumnSensor(name, delay=perturbations.delay) for name in law.measured_columns
        )
        delayed = dataclasses.replace(loop, controller=WithSensors(law, sensors))
        cases.append(
            LoopCase(f"delay {perturbations.delay}", plant, delayed, cases[0].initial_state, "law")
        )
    return PerturbedFamily(tuple(cases), tuple(notes))


def _scaled(
    plant: Plant, perturbations: Perturbations, notes: list[str]
) -> list[tuple[str, Plant]]:
    """Plants with other loads and supplies; a note where the plant has no such parameter."""
    changed = list[tuple[str, Plant]]()
    nonzero = [leaf.path for leaf in leaves(plant) if leaf.value != 0.0]
    loads, rotors, supplies = (set(filter(kind.search, nonzero)) for kind in (LOAD, ROTOR, SUPPLY))
    for factors, symbol, chosen in (
        (perturbations.loads, "load", loads or rotors),
        (perturbations.supplies, "supply", supplies),
    ):
        if factors and not chosen:
            notes.append(f"no case with another {symbol}: the plant has no parameter of that kind")
            continue
        for factor in factors:
            values = [
                leaf.value * (factor if leaf.path in chosen else 1.0) for leaf in leaves(plant)
            ]
            name = f"{symbol} x {factor:g}"
            with located_errors(name):
                changed.append((name, with_parameters(plant, values)))
    return changed


def _leaking(plant: Plant, share: float, notes: list[str]) -> list[tuple[str, Plant]]:
    """The plant with leaks whose conductance is a share of that of the valves, if it is known."""
    known = [
        [leaf.value for leaf in leaves(circuit) if _CONDUCTANCE.search(leaf.path)]
        for circuit in plant.circuits
    ]
    if not all(known):
        notes.append("no case with a leak: a circuit has no conductance")
        return []
    leaks = (Valve(share * max(conductances), LEAK_CRITICAL_RATIO) for conductances in known)
    circuits: Any = tuple(map(WithLeak, plant.circuits, leaks))
    circuit = circuits if isinstance(plant.circuit, tuple) else circuits[0]
    return [("leak", dataclasses.replace(plant, circuit=circuit))]


def parameter_draws(
    plant: Plant,
    uncertainties: Sequence[ParameterUncertainty | None],
    fitted: PlantUncertainty | None,
    count: int,
    seed: int,
) -> Iterator[tuple[str, Plant]]:
    """Plants whose fitted parameters deviate by draws of a normal distribution that are within the
    declared ranges.
    """
    if len(uncertainties) not in (0, len(plant.muscles)):
        raise ParameterError(
            f"perturbed_family: {len(uncertainties)} uncertainties for {len(plant.muscles)}"
            " muscles; give one for each."
        )
    of_plant = parameter_uncertainty(fitted) if fitted is not None and fitted.parameters else None
    if of_plant is None and not any(uncertainty is not None for uncertainty in uncertainties):
        return
    random = np.random.default_rng(seed)
    for number in range(count):
        yield f"drawn {number + 1}", _drawn(plant, uncertainties, of_plant, random)


def _drawn(
    plant: Plant,
    uncertainties: Sequence[ParameterUncertainty | None],
    of_plant: ParameterUncertainty | None,
    random: np.random.Generator,
) -> Plant:
    known = {leaf.path: leaf for leaf in leaves(plant)}
    message = "no draw"
    for _ in range(MAX_ATTEMPTS):
        deviations: dict[ParameterUncertainty, Any] = {}
        shifts: dict[str, float] = {}
        for i, uncertainty in enumerate(uncertainties):
            if uncertainty is None:
                continue
            if uncertainty not in deviations:
                deviates = random.standard_normal(len(uncertainty.parameters))
                deviations[uncertainty] = uncertainty.deviations(deviates)
            prefix = f"muscle[{i}]." if isinstance(plant.muscle, tuple) else "muscle."
            shifts |= dict(
                zip(
                    muscle_paths(uncertainty, prefix), deviations[uncertainty].tolist(), strict=True
                )
            )
        if of_plant is not None:
            deviates = random.standard_normal(len(of_plant.parameters))
            for name, shift in zip(of_plant.parameters, of_plant.deviations(deviates), strict=True):
                for leaf in map(
                    known.__getitem__, name.split(SEPARATOR)
                ):  # as far as the declared ranges permit
                    shifts[leaf.path] = (
                        float(np.clip(leaf.value + shift, *leaf.declared.bounds)) - leaf.value
                    )
        if unknown := [path for path in shifts if path not in known]:
            raise ParameterError(
                f"perturbed_family: the plant has no parameter '{unknown[0]}', of which an"
                " uncertainty is given; remove it from the uncertainty, or restore the part of the"
                " muscle that the plant replaces."
            )
        try:
            return with_parameters(
                plant, [leaf.value + shifts.get(path, 0.0) for path, leaf in known.items()]
            )
        except AirmuscleError as error:
            message = str(error)
    raise ParameterError(
        f"perturbed_family: {MAX_ATTEMPTS} draws of parameters are impossible; the last: {message}"
    )


def muscle_paths(uncertainty: ParameterUncertainty, prefix: str) -> list[str]:
    """The paths of uncertain parameters in a plant; in a muscle file the contractile element is the
    characteristic.
    """
    return [
        f"{prefix}{re.sub('^characteristic[.]', 'contractile.', name)}"
        for name in uncertainty.parameters
    ]
