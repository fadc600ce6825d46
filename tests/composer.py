"""Plants composed at random from the declarations of the models: the registry of models,
annotations and bounds.

The instances that stand in the plants of tests/plants.py are the stock. A component is an instance
from the stock with its parameters drawn anew within their declared bounds and its structural fields
exchanged for other components whose class conforms to the annotation of the field. A model that is
added by its recipe is therefore composed without a change here. All distributions are chosen.
"""

from __future__ import annotations

import dataclasses
import math
import typing

import numpy as np
from plants import EXAMPLES

from airmuscle.core import parameters
from airmuscle.core.annotation import conforms, type_hints
from airmuscle.engine import SampledSignal, Schedule
from airmuscle.engine.loop.inputs import CombinedSignal
from airmuscle.errors import AirmuscleError, ParameterError
from airmuscle.files.library import model_names
from airmuscle.physics import (
    AirSource,
    Ambient,
    Circuit,
    ExternalLoad,
    Gas,
    Mechanism,
    Muscle,
    Plant,
    SharedSupply,
)
from airmuscle.physics.mechanism import SHORTENING, SHORTENING_SPEED

ATTEMPTS = 40
"""Compositions of one component that its constructor may refuse."""
WIDEST = 1e4
"""Largest ratio of a drawn value to that of the stock."""
HIGHEST_COMMAND = 6e5
"""Magnitude [Pa] of a commanded pressure."""
LARGEST_SHORTENING = 0.02
"""Largest shortening [m] of an open plant; some geometries permit no lengthening."""


def models_in(thing):
    """Every model inside a model or a tuple, itself included."""
    if isinstance(thing, tuple):
        for item in thing:
            yield from models_in(item)
    elif dataclasses.is_dataclass(thing):
        yield thing
        for field in dataclasses.fields(thing):
            yield from models_in(getattr(thing, field.name))


def _stock():
    """The instances of the examples by class."""
    stock = {}
    for model in models_in(tuple(EXAMPLES.values())):
        found = stock.setdefault(type(model), [])
        if model not in found:
            found.append(model)
    return stock


STOCK = _stock()
NAMED = frozenset(model_names())


class Composer:
    """Composes plants, commands and initial pressures from one random sequence."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self._in_manifold = False

    def chance(self, share):
        return self.rng.random() < share

    def one_of(self, things):
        return things[self.rng.integers(len(things))]

    def plant(self):
        """A plant of one to three muscles; an AirmuscleError is a refusal."""
        mechanism = self.component(Mechanism)
        count = mechanism.muscle_count or int(self.rng.choice([1, 1, 1, 2, 2, 3]))
        muscles = tuple(
            dataclasses.replace(self.component(Muscle), name=f"muscle{k}") for k in range(count)
        )
        circuit = self._circuits(count)
        if mechanism.needs_held_pressures:
            circuit = tuple(self._attempted(self._regulator) for _ in range(count))
        return Plant(
            muscles if count > 1 else muscles[0],
            circuit,
            mechanism,
            self.component(Gas),
            self.component(Ambient),
        )

    def _circuits(self, count):
        """One circuit for all muscles, or one for each."""
        for _ in range(ATTEMPTS):
            circuit = self.component(Circuit)
            if circuit.port_count == count:
                return circuit
            if circuit.port_count == 1 and self.chance(0.5):
                break
        return tuple(self._with_one_port() for _ in range(count))

    def _regulator(self):
        """A circuit of one muscle that holds its pressure."""
        classes = [c for c in STOCK if issubclass(c, Circuit) and STOCK[c][0].holds_pressure]
        circuit = self.varied(self.one_of(STOCK[self.one_of(classes)]))
        if circuit.port_count != 1 or not circuit.holds_pressure:
            raise ParameterError("another attempt: a regulator of one muscle is needed")
        return circuit

    def _with_one_port(self):
        return next(
            c for c in (self.component(Circuit) for _ in range(ATTEMPTS)) if c.port_count == 1
        )

    def component(self, kind):
        """An instance of one of the classes that conform to an annotation."""
        if kind is AirSource and self._in_manifold:
            return SharedSupply()
        classes = [c for c in STOCK if issubclass(c, kind) and (c.__name__ in NAMED or c is kind)]
        classes = [c for c in classes if c is not SharedSupply]
        return self._attempted(lambda: self.varied(self.one_of(STOCK[self.one_of(classes)])))

    def _attempted(self, compose):
        """What `compose` returns; where the package refuses it, another attempt, and in the end the
        refusal.
        """
        for _ in range(ATTEMPTS):
            try:
                return compose()
            except AirmuscleError as error:
                refusal = error
        raise refusal

    def varied(self, model):
        """A model of the same class with parameters and components of its own."""
        declared = {p.name: p for p in parameters(model)}
        hints = type_hints(type(model))
        changes = {}
        for field in dataclasses.fields(model):
            value = getattr(model, field.name)
            if field.name in declared:
                changes[field.name] = self._parameter(declared[field.name], value)
            elif field.init:
                changes[field.name] = self._structure(hints.get(field.name), value)
        return dataclasses.replace(model, **changes)

    def _parameter(self, declared, value):
        if isinstance(value, tuple):
            return tuple(self._number(declared.bounds, v) for v in value)
        return self._number(declared.bounds, value)

    def _number(self, bounds, value):
        """A number within the bounds: mostly near the value of the stock, sometimes far from it, at
        times a bound.
        """
        low, high = bounds
        kind = self.rng.random()
        if kind < 0.3:
            return value
        drawn = value * 3.0 ** self.rng.uniform(-1, 1)
        if kind > 0.98 and math.isfinite(low) and math.isfinite(high):
            drawn = low if self.chance(0.5) else min(high, max(abs(value) * WIDEST, low))
        elif kind > 0.94:
            drawn = value * WIDEST ** self.rng.uniform(-1, 1)
        elif (
            kind > 0.9
            and math.isfinite(low)
            and math.isfinite(high)
            and abs(value) <= 1.0
            and high - low <= 2.0
        ):
            drawn = self.rng.uniform(low, high)
        return float(min(max(drawn, low), high))

    def _structure(self, hint, value):
        if isinstance(value, int) and not isinstance(value, bool):
            return max(1, value + int(self.rng.integers(-1, 2)))
        if isinstance(value, tuple) and value and all(dataclasses.is_dataclass(v) for v in value):
            return self._branches(typing.get_args(hint)[0], value)
        if not dataclasses.is_dataclass(value):
            return value
        kinds = [
            k
            for k in typing.get_args(hint) or (hint,)
            if isinstance(k, type) and conforms(value, k)
        ]
        if isinstance(value, SharedSupply) or (self._in_manifold and isinstance(value, AirSource)):
            return self.component(AirSource)
        if kinds and self.chance(0.6):
            return self.component(kinds[0])
        return self._attempted(lambda: self.varied(value))

    def _branches(self, kind, branches):
        """As many components; the circuits of a manifold all have its supply."""
        outer = self._in_manifold
        self._in_manifold = issubclass(kind, Circuit)
        try:
            return tuple(self.component(kind) for _ in branches)
        finally:
            self._in_manifold = outer

    def command(self, plant, duration):
        """A schedule of levels within the ranges of the inputs, at random instants; shortenings are
        moved.
        """
        changes = {}
        for given in plant.input_variables:
            low, high = (
                min(max(b, -HIGHEST_COMMAND), HIGHEST_COMMAND)
                for b in (given.minimum, given.maximum)
            )
            if given.unit not in ("1", "Pa") and high == HIGHEST_COMMAND:
                low = -5.0
                high = 5.0
            if given.name.endswith(SHORTENING):
                low = 0.0
                high = LARGEST_SHORTENING
            instants = np.cumsum(self.rng.uniform(0.02, duration / 5, 5))
            levels = self.rng.uniform(low, high, 5)
            levels = (
                np.round(levels)
                if high <= 1.0 and given.unit != "m" and self.chance(0.7)
                else levels
            )
            changes[given.name] = tuple(zip(instants.tolist(), levels.tolist(), strict=True))
        open_ports = [
            model for model in models_in(plant.mechanism) if isinstance(model, ExternalLoad)
        ]
        return _moved(changes, open_ports[0].shortenings) if open_ports else Schedule(changes)

    def state(self, plant):
        """An initial state at a random pressure, its coordinates drawn anew until every muscle is
        within its range.
        """
        for _ in range(ATTEMPTS):
            coordinates = {
                c.name: c.nominal * self.rng.uniform(-1, 3) for c in plant.mechanism.coordinates
            }
            at_rest = coordinates | {c.speed: 0.0 for c in plant.mechanism.coordinates}
            contractions = plant.mechanism.contractions(at_rest, plant.resting_lengths)
            ranges = [m.geometry.contraction_range for m in plant.muscles]
            if all(low < e < high for e, (low, high) in zip(contractions, ranges, strict=True)):
                break
        return plant.state_at(pressure=self.pressure(plant), **coordinates)

    def pressure(self, plant):
        """An initial gauge pressure [Pa], sometimes below absolute vacuum."""
        vacuum = plant.ambient.pressure
        return float(
            self.one_of((0.0, self.rng.uniform(-1.02 * vacuum, 0.0), self.rng.uniform(0.0, 4e5)))
        )


def _moved(changes, start):
    """The signal of a schedule in which the shortenings of an open plant are linear in pieces from
    those at the start, and their speeds the derivatives."""
    place = {}
    held = dict(changes)
    for name, first in zip(
        [name for name in changes if name.endswith(SHORTENING)], start, strict=True
    ):
        instants, levels = zip((0.0, first), *held.pop(name), strict=True)
        speeds = np.append(np.diff(levels) / np.diff(instants), 0.0)
        place[name] = tuple(zip(instants, levels, strict=True))
        held[name.removesuffix(SHORTENING) + SHORTENING_SPEED] = tuple(
            zip(instants, speeds.tolist(), strict=True)
        )
    return CombinedSignal(SampledSignal(place), Schedule(held))
