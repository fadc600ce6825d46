"""Actuator for learning stacks: one muscle with its circuit as functions of a command, its length
and its speed.

start(q, c, x)       states x at q = (gauge pressure [Pa], length [m])
step(x, z, c, h, y)  states y after a time h [s] under z = (command, length [m], speed [m/s]): the
                     command is held, the length moves at its speed; classical Runge-Kutta method,
                     as `simulate` with RungeKutta4(h)
observe(x, z, c, o)  o = (tension [N], gauge pressure [Pa], 1 within the validity range of the
                     muscle, else 0)
prepare(p, c)        c, what these need of the parameters

A command beyond its range is limited. With a number in z or a step h that is not finite, `step`
returns the states as they are, and `observe` gives NaN, NaN and 0, which it also gives after a
start at a pressure or length that is not finite.
"""

import dataclasses
import functools
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import Input, Leaf, Node, ParameterError, TraceError, autodiff, leaves, nodes
from ...engine.compile import compile_system, derivatives
from ...engine.compile.functions import Printer, TracedSystem, explicit_step
from ...engine.compile.ir.emission import TargetLanguage
from ...engine.run.integrators import RungeKutta4
from ...physics.mechanism import SHORTENING, SHORTENING_SPEED, ExternalLoad
from ...physics.plant import Plant, open_plant
from .printed_system import make_labels

Expressions = tuple[dict[str, list[Node]], list[Node]]
"""Arguments by name, and the results."""
SAFETY = 1.0
MAX_STEP = 1e-3
"""Largest product of the default step and the fastest rate of the plant, of which 2.8 is the limit
of the method, and longest default step [s] (chosen)."""
LARGEST = float(np.finfo(np.float32).max)
"""Largest sum of inputs that counts as finite: that of single precision, in which an actuator may
compute."""


@dataclasses.dataclass(frozen=True, eq=False)
class ActuatorModel:
    """One muscle of a plant, open towards its load, with one command.

    part       the plant with length and speed of the muscle as inputs
    controls   inputs that the command opens: one, or two of which a negative command opens the
               second
    step       the longest step of the integrator [s]
    """

    part: Plant
    controls: tuple[Input, ...]
    step: float

    @property
    def parameters(self) -> list[Leaf]:
        """The parameters, in the order of their vector."""
        return list(leaves(self.part))

    @functools.cached_property
    def _traced(self) -> TracedSystem:
        return compile_system(self.part).program.traced

    def _rest(self, p: Sequence[Node]) -> Node:
        """The resting length of the muscle."""
        model, vector = autodiff.symbolic(self.part)
        return nodes.replaced([nodes.as_node(model.resting_lengths[0])], vector, p)[0]

    def _replaced(self, z: Sequence[Node], usable: Node, p: Sequence[Node]) -> list[Node]:
        """Command, length and speed, or usual numbers where these are not usable, so that no
        derivative of the choice in `step` and `observe` is NaN.
        """
        low, _ = control_range(self.controls)
        usual = (low, self._rest(p), 0.0)
        return [nodes.where(usable, value, number) for value, number in zip(z, usual, strict=True)]

    def _inputs(self, z: Sequence[Node], p: Sequence[Node]) -> list[Node]:
        """The inputs of the plant at a finite command, length and speed."""
        command, length, speed = z
        low, high = control_range(self.controls)
        command = nodes.limited(command, low, high)
        values = {SHORTENING: self._rest(p) - length, SHORTENING_SPEED: -speed}
        filling = nodes.larger(command, 0.0)
        discharging = nodes.larger(-command, 0.0)
        openings = [filling, discharging] if len(self.controls) == 2 else [command]
        # a muscle without a control has no opening
        for control, opening in zip(self.controls, openings, strict=False):
            values[control.name] = opening
        return [values[name] for name in self.part.inputs]

    @functools.cached_property
    def step_of_time(self) -> Expressions:
        """Arguments and result of `step`."""
        t = self._traced
        z = nodes.symbols("z", 3)
        h = nodes.symbol("h")
        rows, weights = RungeKutta4(self.step).tableau()
        usable = all_finite([z[0], z[1] + h * z[2], z[2]])
        command, length, speed = self._replaced(z, usable, t.p)

        def inputs(node: float) -> list[Node]:
            return self._inputs([command, length + node * h * speed, speed], t.p)

        later = explicit_step(t, rows, weights, h, inputs)
        states = [
            nodes.where(usable, after, before) for after, before in zip(later, t.x, strict=True)
        ]
        return {"x": t.x, "z": z, "p": t.p, "h": [h]}, states

    @functools.cached_property
    def observe(self) -> Expressions:
        """Arguments and result of `observe`."""
        t = self._traced
        z = nodes.symbols("z", 3)
        usable = all_finite(z)
        motion = self._replaced(z, usable, t.p)
        inputs = self._inputs(motion, t.p)
        outputs = nodes.replaced(t.o, t.u, inputs)
        state_names = [state.name for state in self.part.states]
        known = dict(zip(state_names, t.x, strict=True))
        known |= dict(zip(t.output_names, outputs, strict=True))
        results = [known["force"], known["pressure"]]
        valid = nodes.logical_and(usable, all_finite(results))
        for limit in self.part.column_limits:
            if limit.column not in known:
                continue
            value = known[limit.column]
            low, high = limit.bounds
            valid = nodes.logical_and(valid, value >= low) if np.isfinite(low) else valid
            valid = nodes.logical_and(valid, value <= high) if np.isfinite(high) else valid
        # a comparison with a pressure that is NaN, after a start without a number, would be slack
        known_pressure = nodes.logical_and(usable, all_finite([known["pressure"]]))
        shown = [nodes.where(known_pressure, result, np.nan) for result in results]
        return {"x": t.x, "z": z, "p": t.p}, [*shown, valid]

    @functools.cached_property
    def start(self) -> Expressions:
        """Arguments and result of `start`."""
        model, p = autodiff.symbolic(self.part)
        q = nodes.symbols("q", 2)
        pressure, length = q
        shortening = model.resting_lengths[0] - length
        try:
            settled, volumes = model.settle_muscles((pressure,), {SHORTENING: shortening})
        except (TypeError, TraceError):
            raise ParameterError(
                f"actuator: {self.part.muscles[0].name} has a series spring, whose initial state is"
                " found by iteration and has no printed form; leave the series spring out."
            ) from None
        state = model.fill_muscles((pressure,), volumes, settled)
        values = [nodes.as_node(state[s.name]) for s in self.part.states]
        autodiff.check_finite(values, type(self.part).__name__)
        return {"q": q, "p": p}, values

    def print_functions(self, language: TargetLanguage) -> tuple[str, int]:
        """`prepare` and the functions in a language, and the length of c."""
        states = [(s.name, s.unit, s.meaning) for s in self.part.states]
        unit = self.controls[0].unit if self.controls else ""
        labels = make_labels(
            {
                "x": states,
                "y": [(f"next {name}", unit, "") for name, unit, _ in states],
                "z": [
                    ("command", unit, ""),
                    ("length", "m", "of the muscle"),
                    ("speed", "m/s", "of the length"),
                ],
                "q": [
                    ("initial pressure", "Pa", "gauge"),
                    ("initial length", "m", "of the muscle"),
                ],
                "o": [
                    ("tension", "N", ""),
                    ("pressure", "Pa", "gauge"),
                    ("valid", "", "1 within the validity range"),
                ],
                "p": [
                    (leaf.path, leaf.declared.unit, leaf.declared.meaning)
                    for leaf in self.parameters
                ],
            }
        )
        printer = Printer(dataclasses.replace(language, labels=labels))  # type: ignore[type-var]
        functions = (
            ("start", self.start, "x"),
            ("step", self.step_of_time, "y"),
            ("observe", self.observe, "o"),
        )
        for name, (inputs, result), output in functions:
            printer.add(name, inputs, {output: result}, ["h"] if "h" in inputs else ())
        return printer.module(), printer.held


def actuator_model(plant: Plant, *, muscle: str = "", step: float | None = None) -> ActuatorModel:
    """One muscle of a plant with its circuit, without the load; arguments as for `write_actuator`.
    Raises ParameterError for a plant that has not one command, and a step that is not positive."""
    part = open_plant(single_muscle(plant, muscle))
    controls = controls_of(part)
    step = _stable_step(part) if step is None else step
    if not 0.0 < step < 1.0:
        raise ParameterError(f"actuator: step is {step!r} s; allowed range: above 0 to 1 s.")
    return ActuatorModel(part, controls, step)


def single_muscle(plant: Plant, muscle: str) -> Plant:
    """The plant with one of its muscles and the circuit of this muscle. Raises ParameterError."""
    names = [m.name for m in plant.muscles]
    if len(names) == 1:
        if muscle and muscle != names[0]:
            raise ParameterError(f"there is no muscle '{muscle}'; the plant has {names[0]}.")
        return plant
    if len(plant.circuits) != len(names):
        raise ParameterError(
            f"the muscles {', '.join(names)} share the circuit {type(plant.circuits[0]).__name__}"
            " and cannot be separate actuators; give each muscle a circuit of its own."
        )
    if muscle not in names:
        raise ParameterError(
            f'choose one of the muscles {", ".join(names)}, such as muscle="{names[0]}" (--muscle'
            f" {names[0]}); given: '{muscle}'."
        )
    k = names.index(muscle)
    return dataclasses.replace(
        plant, muscle=plant.muscles[k], circuit=plant.circuits[k], mechanism=ExternalLoad()
    )


def controls_of(part: Plant) -> tuple[Input, ...]:
    """The inputs of an open plant that one command sets. Raises ParameterError for more than
    two.
    """
    controls = tuple(
        i for i in part.input_variables if i.name not in (SHORTENING, SHORTENING_SPEED)
    )
    if len(controls) > 2 or (len(controls) == 2 and any(i.minimum != 0.0 for i in controls)):
        raise ParameterError(
            "an actuator has one control; a circuit with a single input, or two valves that open"
            f" from 0, can be exported, but the inputs are {', '.join(i.name for i in controls)}."
        )
    return controls


def control_range(controls: Sequence[Input]) -> tuple[float, float]:
    """Lowest and highest command of these inputs; of two, a negative one opens the second."""
    if len(controls) == 2:
        return -controls[1].maximum, controls[0].maximum
    return (controls[0].minimum, controls[0].maximum) if controls else (0.0, 0.0)


def all_finite(values: Sequence[Node]) -> Node:
    """Whether all values are finite numbers, and with them their sum, as a condition."""
    total = functools.reduce(nodes.add, values)
    return nodes.less_equal(abs(total), nodes.constant(LARGEST))


def _stable_step(part: Plant) -> float:
    """The longest step of 1 ms / 2^k that resolves the fastest rate at a few states, with valves
    open and closed.
    """
    compiled = compile_system(part)
    fastest = 1.0
    for pressure, contraction, opening in itertools.product(
        (2e4, 2e5, 5e5), (0.0, 0.1, 0.2), (0.0, 0.5, 1.0)
    ):
        shortening = contraction * part.resting_lengths[0]
        try:
            state = open_plant(part, (shortening,)).state_at(pressure=pressure)
        except ParameterError:
            continue
        motion = {SHORTENING: shortening, SHORTENING_SPEED: 0.0}
        inputs = [
            motion.get(i.name, i.minimum + opening * (min(i.maximum, 1e6) - i.minimum))
            for i in part.input_variables
        ]
        fastest = max(fastest, fastest_rate(compiled, list(state.values()), inputs))
    return longest_step(fastest)


def fastest_rate(compiled: Any, state: list[float], inputs: list[float]) -> float:
    """The greatest magnitude [1/s] of the eigenvalues of the rates by the states, in their nominal
    sizes; 0 where a slope is not finite.
    """
    sizes = compiled.nominal
    slopes = derivatives(compiled, state, inputs).rates_by_state
    if not np.isfinite(slopes).all():
        return 0.0
    eigenvalues = np.linalg.eigvals(slopes * sizes / sizes[:, None])
    return float(np.abs(eigenvalues).max(initial=0.0))


def longest_step(fastest: float) -> float:
    """The longest step [s] of 1 ms / 2^k that resolves a rate [1/s]."""
    step = MAX_STEP
    while step * fastest > SAFETY:
        step /= 2.0
    return step
