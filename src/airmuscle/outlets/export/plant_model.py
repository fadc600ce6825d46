"""Whole plant for learning stacks: a joint or an arm with its muscles as functions of its inputs.

start(q, c, x)       states x at rest at q = (gauge pressures [Pa] of the muscles, coordinates)
rates(x, u, c, f)    rates f of the states under the inputs u, of which the stack makes steps of
                     the classical Runge-Kutta method, as `simulate` with RungeKutta4(h)
observe(x, u, c, o)  o = (coordinates, their speeds, gauge pressures [Pa], tensions [N], 1 within
                     the validity range, else 0)
prepare(p, c)        c, what these need of the parameters

An input beyond its range is limited. With an input that is not finite the rates are zero, so that
the states remain, and `observe` gives NaN and 0.
"""

import dataclasses
import functools
import itertools
from collections.abc import Iterator, Mapping

import numpy as np

from ...core import Input, Leaf, Node, ParameterError, TraceError, autodiff, leaves, nodes
from ...engine.compile import compile_system
from ...engine.compile.functions import Printer, TracedSystem
from ...engine.compile.ir.emission import TargetLanguage
from ...physics.plant import Plant
from .actuator import Expressions, all_finite, fastest_rate, longest_step
from .printed_system import make_labels

PRESSURE = 2.5e5
"""Usual gauge pressure [Pa] of a muscle (chosen)."""
TURNING = (0.0, 1.0)
"""Speeds of the coordinates at which the fastest rate is computed, in their SI units (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class PrintedPlant:
    """A plant with its mechanism, driven by its inputs alone; `step` is the longest step of the
    integrator [s].
    """

    plant: Plant
    step: float

    @property
    def parameters(self) -> list[Leaf]:
        """The parameters, in the order of their vector."""
        return list(leaves(self.plant))

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The commands, in the order of their vector."""
        return self.plant.input_variables

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the coordinates."""
        return tuple(coordinate.name for coordinate in self.plant.mechanism.coordinates)

    @property
    def observed(self) -> tuple[str, ...]:
        """Names of what `observe` gives before the flag."""
        coordinates = self.plant.mechanism.coordinates
        of_muscles = [
            f"{prefix}{name}" for name in ("pressure", "force") for prefix in self.plant.prefixes
        ]
        return (
            *self.coordinates,
            *(coordinate.speed for coordinate in coordinates),
            *of_muscles,
        )

    @functools.cached_property
    def _traced(self) -> TracedSystem:
        return compile_system(self.plant).program.traced

    @property
    def _usable(self) -> Node:
        """Whether all inputs are finite numbers, and with them their sum."""
        return all_finite(self._traced.u)

    def _driven(self, results: list[Node]) -> list[Node]:
        """Expressions of the plant under inputs that are limited to their ranges."""
        t = self._traced
        usable = self._usable
        limited = [
            nodes.limited(nodes.where(usable, value, known.minimum), known.minimum, known.maximum)
            for value, known in zip(t.u, self.inputs, strict=True)
        ]
        return nodes.replaced(results, t.u, limited)

    @functools.cached_property
    def rates(self) -> Expressions:
        """Arguments and result of `rates`."""
        t = self._traced
        usable = self._usable
        rates = [nodes.where(usable, rate, 0.0) for rate in self._driven(t.f)]
        return {"x": t.x, "u": t.u, "p": t.p}, rates

    @functools.cached_property
    def observe(self) -> Expressions:
        """Arguments and result of `observe`."""
        t = self._traced
        usable = self._usable
        known = self._known
        results = [known[name] for name in self.observed]
        valid = nodes.logical_and(usable, all_finite(results))
        for within in self._within_limits(known):
            valid = nodes.logical_and(valid, within)
        shown = [nodes.where(usable, result, np.nan) for result in results]
        return {"x": t.x, "u": t.u, "p": t.p}, [*shown, valid]

    @property
    def _known(self) -> dict[str, Node]:
        """States and outputs of the plant by name."""
        t = self._traced
        names = [state.name for state in self.plant.states]
        states = dict(zip(names, t.x, strict=True))
        outputs = dict(zip(t.output_names, self._driven(t.o), strict=True))
        return states | outputs

    def _within_limits(self, known: Mapping[str, Node]) -> Iterator[Node]:
        """Conditions that the quantities have a permitted value."""
        for limit in self.plant.column_limits:
            if limit.column not in known:
                continue
            value = known[limit.column]
            low, high = limit.bounds
            if np.isfinite(low):
                yield value >= low
            if np.isfinite(high):
                yield value <= high

    @functools.cached_property
    def start(self) -> Expressions:
        """Arguments and result of `start`."""
        model, p = autodiff.symbolic(self.plant)
        muscles = len(self.plant.muscles)
        q = nodes.symbols("q", muscles + len(self.coordinates))
        pressures = q[:muscles]
        motion = {c.speed: nodes.constant(0.0) for c in self.plant.mechanism.coordinates}
        motion |= dict(zip(self.coordinates, q[muscles:], strict=True))
        try:
            settled, volumes = model.settle_muscles(pressures, motion)
        except (TypeError, TraceError):
            raise ParameterError(
                "a muscle has a series spring, whose initial state is found by iteration and has no"
                " printed form; leave the series spring out."
            ) from None
        state = model.fill_muscles(pressures, volumes, settled)
        values = [nodes.as_node(state[s.name]) for s in self.plant.states]
        autodiff.check_finite(values, type(self.plant).__name__)
        return {"q": q, "p": p}, values

    @property
    def functions(self) -> dict[str, tuple[Expressions, str]]:
        """The functions by name, each with the array of its result."""
        return {
            "start": (self.start, "x"),
            "rates": (self.rates, "f"),
            "observe": (self.observe, "o"),
        }

    def print_functions(self, language: TargetLanguage) -> tuple[str, int]:
        """`prepare` and the functions in a language, and the length of c."""
        states = self.plant.states
        pressures = [f"{prefix}pressure" for prefix in self.plant.prefixes]
        labels = make_labels(
            {
                "x": [(s.name, s.unit, s.meaning) for s in states],
                "f": [(f"{s.name} rate", "", "") for s in states],
                "u": [(i.name, i.unit, i.meaning) for i in self.inputs],
                "q": [
                    *((f"initial {name}", "Pa", "gauge") for name in pressures),
                    *((f"initial {name}", "", "") for name in self.coordinates),
                ],
                "o": [*((name, "", "") for name in self.observed), ("valid", "", "")],
                "p": [
                    (leaf.path, leaf.declared.unit, leaf.declared.meaning)
                    for leaf in self.parameters
                ],
            }
        )
        printer = Printer(dataclasses.replace(language, labels=labels))  # type: ignore[type-var]
        for name, ((inputs, result), output) in self.functions.items():
            printer.add(name, inputs, {output: result})
        return printer.module(), printer.held


def plant_model(
    plant: Plant, step: float | None = None, pressure: float | None = None
) -> PrintedPlant:
    """A plant as functions; the default step is that for gauge pressures up to twice `pressure`
    [Pa]. Raises ParameterError for a step that is not positive.
    """
    step = _stable_step(plant, PRESSURE if pressure is None else pressure) if step is None else step
    if not 0.0 < step < 1.0:
        raise ParameterError(f"step is {step!r} s; allowed range: above 0 to 1 s.")
    return PrintedPlant(plant, step)


def _stable_step(plant: Plant, usual: float) -> float:
    """The longest step of 1 ms / 2^k that resolves the fastest rate at a few states, with commands
    at both ends, at rest and in motion.
    """
    compiled = compile_system(plant)
    speeds = [coordinate.speed for coordinate in plant.mechanism.coordinates]
    fastest = 1.0
    for pressure, opening, speed in itertools.product(
        (0.1 * usual, usual, 2.0 * usual), (0.0, 0.5, 1.0), TURNING
    ):
        pose = dict.fromkeys((c.name for c in plant.mechanism.coordinates), 0.0)
        state = plant.state_at(pressure=pressure, **pose)
        state |= dict.fromkeys(speeds, speed)
        inputs = [
            known.minimum + opening * (min(known.maximum, 2.0 * usual) - known.minimum)
            for known in plant.input_variables
        ]
        fastest = max(fastest, fastest_rate(compiled, list(state.values()), inputs))
    return longest_step(fastest)
