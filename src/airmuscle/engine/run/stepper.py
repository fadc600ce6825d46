"""Stepper: a plant that is advanced by hand, step after step, for hardware in the loop, other
simulators and ROS.
"""

import numbers
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, ColumnLimit, DiagnosticCode, Status, System, one_line, tree
from ...core.errors import ParameterError, SimulationError, check_known
from ...core.system import check_system, state_vector
from ..compile.cache.kernel import begin_step, end_step
from ..compile.program import CompiledSystem, compile_system
from .integrators import Integrator, default_integrator
from .problem import LARGEST, check_inputs, default_state, initial_vector

_RANGES = {
    DiagnosticCode.EXTRAPOLATION: "the validity range",
    DiagnosticCode.RATING: "the rating",
    DiagnosticCode.GEOMETRY_LIMIT: "the range of the geometry",
    DiagnosticCode.FRICTION_EXTRAPOLATION: "the range of the friction data",
}


class Snapshot(NamedTuple):
    """Everything that the further steps of a Stepper depend on: time [s], states and inputs in
    their order.

    It can be pickled and restored in another process.
    """

    time: float
    state: tuple[float, ...]
    inputs: tuple[float, ...]


class Stepper:
    """A plant with its present state, advanced by `step(inputs, dt)` in real time or by another
    program.

    plant           any System: a Plant, or a user-defined one
    initial_state   values by state; by default a Plant's equilibrium at ambient pressure
    integrator      Rodas4(rtol=1e-6) by default; RungeKutta4(step) takes the same time for every
                    step
    start_time      [s]
    check_validity  whether a step that leaves a validity range, a rating of a muscle, or the range
                    of a geometry raises SimulationError; otherwise only impossible states do

    state_names, input_names, output_names   order of the arrays
    state (n,), inputs (m,), outputs (k,)    present values [SI]; `state` may be written to, for
                                             instance by an observer

    Equal steps from equal states give equal results to the last bit. A step allocates no arrays. A
    Stepper is for one thread at a time; a copy, also a pickled one, goes on from the present state
    by itself. Raises ParameterError for an unknown or impossible initial state.
    """

    def __init__(
        self,
        plant: System,
        initial_state: Mapping[str, float] | None = None,
        *,
        integrator: Integrator | None = None,
        start_time: float = 0.0,
        check_validity: bool = False,
    ) -> None:
        check_system("Stepper", plant)
        self.integrator = default_integrator(integrator)
        self.check_validity = check_validity
        known = compile_system(plant).description
        self.state_names = known.state_names
        self.input_names = known.input_names
        self.output_names = known.output_names
        sizes = known.program.sizes
        self.state, self.inputs = np.zeros(sizes.states), np.zeros(sizes.inputs)
        self.outputs, self._found = np.zeros(sizes.outputs), np.zeros(sizes.outputs)
        self._always = np.zeros(1, dtype=np.int64)
        self._initial: Array | None = None
        kinds = {
            "state": self.state_names,
            "outputs": self.output_names,
            "inputs": self.input_names,
        }
        self._index = {
            name: (kind, i) for kind, names in kinds.items() for i, name in enumerate(names)
        }
        self._bind(compile_system(plant))
        self.reset(initial_state, start_time=start_time)

    def reset(
        self,
        initial_state: Mapping[str, float] | None = None,
        *,
        start_time: float = 0.0,
        plant: System | None = None,
    ) -> Array:
        """Return to an initial state, by default that of the first time, with all inputs 0; the
        outputs (k,).

        `plant` is another plant of the same structure, with other parameter values. Raises
        ParameterError for a plant of another structure or an impossible state.
        """
        if plant is not None:
            check_system("Stepper.reset", plant)
            if tree.structure(plant) is not tree.structure(self.plant):
                raise ParameterError(
                    "Stepper.reset: the plant has another structure; give one that differs in"
                    " parameter values only, or make a new Stepper."
                )
            self._bind(compile_system(plant))
            self._initial = None
        if initial_state is not None:
            self._initial = initial_vector(self._compiled, initial_state)
        elif self._initial is None:
            self._initial = default_state(self._compiled).copy()
        self.state[:], self.time = self._initial, float(start_time)
        self._given[:] = 0.0
        return self._settle()

    def begin(self, parameters: Array, state: Array) -> Array:
        """Begin at a state (n,) with other parameters (P,), in the order of `core.tree.leaves`, at
        time 0 with all inputs 0; the outputs (k,). Nothing is checked: for callers that draw both
        often."""
        self._bind(self._compiled.at(parameters, self._compiled.nominal))
        self.state[:] = state
        self.time = 0.0
        return self._settle()

    def step(self, inputs: Any, dt: float) -> Array:
        """Advance by `dt` [s] with the inputs held; the outputs (k,) at the end, the array
        `outputs` itself.

        inputs  (m,) in the order of `input_names`, or by name: a mapping keeps the present values
                of the other inputs

        Raises ParameterError for a number of inputs, an input or a time step that is impossible,
        SimulationError where the step fails or leads to an impossible state. The state is then that
        before the step.
        """
        if not isinstance(dt, (float, numbers.Real)) or not 0.0 < dt <= LARGEST:
            raise ParameterError(
                f"Stepper: dt is {one_line(dt)} s; it must be positive and finite."
            )
        if hasattr(inputs, "keys"):
            named_inputs = inputs
            inputs = self.inputs.tolist()
            for name, value in named_inputs.items():  # the others keep their present values
                if name not in self.input_names:
                    check_known("Stepper: no input", name, self.input_names)
                inputs[self.input_names.index(name)] = value
        try:
            if len(inputs) != self._given.size:
                raise ValueError
            self._given[:] = inputs
        except (TypeError, ValueError):
            raise ParameterError(
                f"Stepper: inputs are {one_line(inputs)}; give {self._given.size} numbers in the"
                f" order of {', '.join(self.input_names)}, or values by name."
            ) from None
        if self._begin():
            check_inputs(self._compiled, self._given, f"at {self.time:g} s")
        status = self._bound.proceed(dt)
        if status is not Status.DONE:
            raise SimulationError(
                f"a step of {dt:g} s from {self.time:.6g} s on failed because {status.message}, at"
                f" {_listed(self.state_names, self._next)}. The stepper is in the state before the"
                " step."
            )
        defect = self._end()
        if defect:
            name = (*self.state_names, *self.output_names)[defect - 1]
            value = [*self._next, *self._found][defect - 1]
            raise SimulationError(
                f"the step of {dt:g} s from {self.time:.6g} s on led to {name} {value:.4g}:"
                f" {self._limits.meaning(defect - 1, value)} The stepper is in the state before the"
                " step."
            )
        self.time += dt
        return self.outputs

    def __getitem__(self, name: str) -> float:
        """The present value of a state, an output or an input [SI]. Raises ParameterError for an
        unknown name.
        """
        if name not in self._index:
            check_known("Stepper: no state, output or input", name, self._index)
        kind, i = self._index[name]
        return float(getattr(self, kind)[i])

    def values(self) -> dict[str, float]:
        """Time [s], states, outputs and inputs by name."""
        return {"time": self.time, **{name: self[name] for name in self._index}}

    def snapshot(self) -> Snapshot:
        """The present state, for `restore`."""
        return Snapshot(self.time, tuple(self.state.tolist()), tuple(self.inputs.tolist()))

    def restore(self, snapshot: Snapshot) -> Array:
        """Return to a snapshot; the outputs (k,). Raises ParameterError for one of another
        plant.
        """
        if not isinstance(snapshot, Snapshot) or (len(snapshot.state), len(snapshot.inputs)) != (
            self.state.size,
            self.inputs.size,
        ):
            raise ParameterError(
                f"Stepper.restore: {one_line(snapshot)} is no snapshot of this plant, which has"
                f" {self.state.size} states and {self.inputs.size} inputs."
            )
        state_vector(self.plant, dict(zip(self.state_names, snapshot.state, strict=True)))
        self.state[:], self._given[:], self.time = (
            snapshot.state,
            snapshot.inputs,
            float(snapshot.time),
        )
        return self._settle()

    def __getstate__(self) -> dict[str, Any]:
        """Arguments, parameters and present state; kernels and addresses belong to a process."""
        options = {"integrator": self.integrator, "check_validity": self.check_validity}
        initial = (
            None
            if self._initial is None
            else dict(zip(self.state_names, self._initial.tolist(), strict=True))
        )
        parameters = self._compiled.parameters, self._compiled.nominal
        return {
            "arguments": (self.plant, initial),
            "options": options,
            "at": parameters,
            "present": self.snapshot(),
        }

    def __setstate__(self, stored: dict[str, Any]) -> None:
        self.__init__(*stored["arguments"], **stored["options"])  # type: ignore[misc]
        self._bind(self._compiled.at(*stored["at"]))
        self.restore(stored["present"])

    @property
    def plant(self) -> System:
        """The plant."""
        return self._compiled.system

    def __repr__(self) -> str:
        present = _listed(self.state_names, self.state)
        return (
            f"Stepper({type(self.plant).__name__} at {self.time:.6g} s: {present};"
            f" {self.integrator})"
        )

    def _bind(self, compiled: CompiledSystem) -> None:
        """Bind integrator and kernels to a plant; `_next` and `_given` are the state and the inputs
        of a step.
        """
        self._compiled, self._bound = compiled, self.integrator.bind(compiled)
        self._limits = _Limits(compiled, self.check_validity)
        self._next = self._bound.state
        self._given = self._bound.held
        known = compiled.description
        begin = begin_step.bind(
            given=self._given,
            lower=known.input_lower_limits,
            upper=known.input_upper_limits,
            state=self.state,
            start=self._next,
        )
        end = end_step.bind(
            function=compiled.address["outputs"],
            c=compiled.precomputed,
            end=self._next,
            given=self._given,
            values=self._found,
            **self._limits.arrays,
            state=self.state,
            inputs=self.inputs,
            outputs=self.outputs,
            always=self._always,
        )
        self._kernels = (begin, end)
        self._begin = begin.runner
        self._end = end.runner

    def _settle(self) -> Array:
        """Compute the outputs at the present state and the given inputs."""
        self._next[:] = self.state
        self._always[0] = 1
        self._end()
        self._always[0] = 0
        return self.outputs


class _Limits:
    """Limits of states (n,) and outputs (k,): those of possible states and, if wanted, of the
    validity of the model.
    """

    def __init__(self, compiled: CompiledSystem, check_validity: bool) -> None:
        known = compiled.description
        n = compiled.sizes.states
        self.names = (*known.state_names, *known.output_names)
        count = len(self.names)
        self.lower = np.full(count, -LARGEST)
        self.upper = np.full(count, LARGEST)
        self.lower[:n] = np.maximum(known.lower_bounds, -LARGEST)
        self.lower[n + known.positive_outputs] = np.nextafter(0.0, 1.0)
        self.validity: dict[int, ColumnLimit] = {}
        for limit in compiled.system.column_limits if check_validity else ():
            if limit.column in self.names:
                self._narrow(self.names.index(limit.column), limit)
        self.arrays = {
            "lower": self.lower[:n],
            "upper": self.upper[:n],
            "low": self.lower[n:],
            "high": self.upper[n:],
        }
        """The limits of states and of outputs, as the kernel `end_step` calls them."""

    def _narrow(self, i: int, limit: ColumnLimit) -> None:
        """Take over a limit of validity of column `i` where it is narrower, with a slack for
        rounding.
        """
        low, high = limit.bounds
        width = high - low
        slack = 1e-9 * (width if np.isfinite(width) else 0.0)
        low -= slack
        high += slack
        if low > self.lower[i] or high < self.upper[i]:
            self.lower[i] = max(self.lower[i], low)
            self.upper[i] = min(self.upper[i], high)
            self.validity[i] = limit

    def meaning(self, i: int, value: npt.ArrayLike) -> str:
        """What it means that column `i` has this value beyond its limits."""
        if not np.isfinite(value):
            return f"{Status.NOT_FINITE.message}."
        limit = self.validity.get(i)
        if limit is None:
            return "it must be positive." if self.lower[i] > 0 else "it must not be negative."
        return (
            f"allowed range: {self.lower[i]:.4g} to {self.upper[i]:.4g} ({_RANGES[limit.code]} of"
            f" {limit.subject}; check_validity=False continues beyond it)."
        )


def _listed(names: Sequence[str], values: Array) -> str:
    return ", ".join(
        f"{name} {value:.4g}" for name, value in zip(names, values.tolist(), strict=True)
    )
