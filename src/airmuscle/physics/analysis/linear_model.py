"""LinearModel: the linearisation of a system, x' = A x + B u, y = C x + D u, with names, units and poles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array
from ...core.errors import AirmuscleError, ParameterError, suggestion
from ...core.system import System
from ...engine.compile.jacobians import derivatives
from ...engine.compile.program import CompiledSystem, compile_system
from ...engine.state import check_system, column_units, state_vector
from ..equilibrium import complete_inputs
from ..plant.plant import Plant
from .static_stiffness import Stiffness, stiffness

ROUNDING = 1e-12
"""Part of the fastest pole below which real and imaginary parts are rounding errors."""


class Pole(NamedTuple):
    """One pole [1/s], its natural frequency |s|/(2 pi) [Hz] and damping ratio -Re s/|s| (nan for an integrator)."""

    value: complex
    frequency: float
    damping_ratio: float


@dataclasses.dataclass(frozen=True, eq=False)
class LinearModel:
    """dx' = A dx + B du,  dy = C dx + D du: deviations from the operating point, a state and inputs.

    A, B, C, D      (n, n), (n, m), (k, n), (k, m)
    states, inputs, outputs    names, in the order of rows and columns; the states are among the outputs
    units           unit of every name
    state, input_values, output_values    the operating point
    rates           (n,) rates of the states there: all zero at an equilibrium
    system          the system that was linearised
    stiffness       of a Plant: its stiffness at constant pressure and with closed valves; None for another system
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: Mapping[str, str]
    state: Mapping[str, float]
    input_values: Mapping[str, float]
    rates: Array
    stiffness: Stiffness | None = None
    output_values: Mapping[str, float] = dataclasses.field(default_factory=dict)
    system: System | None = None

    @property
    def poles(self) -> tuple[Pole, ...]:
        """Eigenvalues of A, the slowest first. Enclosed air and friction at rest give poles at zero."""
        values = sorted(np.linalg.eigvals(self.A).tolist(), key=lambda s: (abs(s), s.imag))
        return tuple(
            Pole(complex(s), abs(s) / (2 * math.pi), -complex(s).real / abs(s) if s else math.nan) for s in values
        )

    def select(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> LinearModel:
        """The model with only these inputs and outputs, in this order. Raises ParameterError for an unknown name."""
        rows, columns = _places("output", outputs, self.outputs), _places("input", inputs, self.inputs)
        return dataclasses.replace(
            self,
            B=self.B[:, columns],
            C=self.C[rows],
            D=self.D[np.ix_(rows, columns)],
            inputs=tuple(self.inputs[i] for i in columns),
            outputs=tuple(self.outputs[i] for i in rows),
        )

    def frequency_response(self, frequencies: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """H(j 2 pi f) = C (j 2 pi f I - A)^-1 B + D at frequencies (F,) [Hz], of shape (F, k, m).

        Raises ParameterError for a frequency that is negative or not finite, and at a pole on the imaginary axis.
        """
        responses = []
        for f in np.atleast_1d(np.asarray(frequencies, dtype=float)):
            if not (np.isfinite(f) and f >= 0):
                raise ParameterError(
                    f"frequency_response: a frequency is {f!r} Hz; it must be finite and not negative."
                )
            shifted = 2j * math.pi * f * np.eye(len(self.states)) - self.A
            try:
                responses.append(self.C @ np.linalg.solve(shifted, self.B) + self.D)
            except np.linalg.LinAlgError:
                raise ParameterError(
                    f"frequency_response: there is a pole at {f:g} Hz, and the response is infinite (for "
                    "enclosed air at 0 Hz). Choose another frequency."
                ) from None
        return np.array(responses, dtype=complex)

    def to_scipy(self) -> Any:
        """A scipy.signal.StateSpace; it carries no names."""
        from scipy.signal import StateSpace

        return StateSpace(self.A, self.B, self.C, self.D)

    def to_control(self, *, nonlinear: bool = False) -> Any:
        """A control.StateSpace with the names of states, inputs and outputs. Needs the package `control`.

        nonlinear  instead a control.NonlinearIOSystem of the system itself, with the same names: its states, inputs and
                   outputs are absolute values, not deviations from the operating point
        """
        try:
            import control
        except ImportError:
            raise AirmuscleError(
                "to_control needs the package 'control' (python-control); pip install control, or use to_scipy()."
            ) from None
        # python-control interprets a dot in a name as the separator of system and signal.
        names = {
            kind: [name.replace(".", "_") for name in given]
            for kind, given in (("states", self.states), ("inputs", self.inputs), ("outputs", self.outputs))
        }
        if not nonlinear:
            return control.StateSpace(self.A, self.B, self.C, self.D, **names)
        if self.system is None:
            raise ParameterError("to_control: this model has no system; use the result of linearise.")
        response = _Response(compile_system(self.system), self.inputs, self.outputs, dict(self.input_values))
        return control.NonlinearIOSystem(response.rates, response.outputs, name=type(self.system).__name__, **names)

    def __repr__(self) -> str:
        poles = [p.value for p in self.poles]
        slow = ", ".join(_as_text(value, ROUNDING * abs(poles[-1])) for value in poles[:6])
        more = ", ..." if len(self.states) > 6 else ""
        return (
            f"LinearModel({len(self.states)} states, inputs {', '.join(self.inputs) or 'none'}, {len(self.outputs)} "
            f"outputs; poles {slow}{more} 1/s)"
        )


def _as_text(pole: complex, smallest: float) -> str:
    """A pole with four digits, without parts that are not above the smallest that can be told from zero."""
    parts = [0.0 if abs(part) <= smallest else part for part in (pole.real, pole.imag)]
    return f"{complex(*parts):.4g}" if parts[1] else f"{parts[0]:.4g}"


class _Response:
    """Rates and outputs of a compiled system, as python-control calls them."""

    def __init__(
        self, compiled: CompiledSystem, inputs: Sequence[str], outputs: Sequence[str], values: Mapping[str, float]
    ) -> None:
        known = compiled.description
        self._compiled, self._u = compiled, np.array([*values.values(), 0.0])
        self._inputs = [known.input_names.index(name) for name in inputs]
        self._outputs = [[*known.state_names, *known.output_names].index(name) for name in outputs]

    def rates(self, t: float, x: npt.ArrayLike, u: npt.ArrayLike, params: object) -> Array:
        """The rates (n,)."""
        return self._call("rhs", self._compiled.sizes.states, x, u)

    def outputs(self, t: float, x: npt.ArrayLike, u: npt.ArrayLike, params: object) -> Array:
        """The chosen outputs (k,), of which the states are some."""
        state = np.asarray(x, dtype=float)
        return np.concatenate([state, self._call("outputs", self._compiled.sizes.outputs, x, u)])[self._outputs]

    def _call(self, function: str, size: int, x: npt.ArrayLike, u: npt.ArrayLike) -> Array:
        inputs, result = self._u.copy(), np.zeros(size + 1)
        inputs[self._inputs] = np.atleast_1d(np.asarray(u, dtype=float))[: len(self._inputs)]
        state = np.ascontiguousarray(x, dtype=float)
        self._compiled.call(function, state, inputs, self._compiled.precomputed, result)
        return result[:size]


def linearise(plant: System, state: Mapping[str, float], inputs: Mapping[str, float] | None = None) -> LinearModel:
    """A system linearised at a state and inputs (0 unless given), by exact derivatives of the simulated equations.

    At a kink (a valve that starts to open, a muscle that becomes slack, an end stop in first contact) the derivatives
    are those of one side, and where two kinks coincide, as in the centre position of a valve without overlap, of one
    side of each: choose a state that is not at a kink. The state need not be an equilibrium; at an equilibrium, `rates`
    is zero. Raises ParameterError for an unknown or missing name, or an input beyond its range.
    """
    check_system("linearise", plant)
    x = state_vector(plant, state).tolist()
    plant.check_state(state)
    values = complete_inputs(plant, inputs)
    names, u = [s.name for s in plant.states], list(values.values())
    compiled = compile_system(plant)
    at = derivatives(compiled, x, u)
    further = [i for i, name in enumerate(compiled.output_names) if name not in names]
    return LinearModel(
        at.rates_by_state, at.rates_by_input,
        np.vstack([np.eye(len(names)), at.outputs_by_state[further]]),
        np.vstack([np.zeros((len(names), len(values))), at.outputs_by_input[further]]),
        tuple(names), tuple(values), (*names, *(compiled.output_names[i] for i in further)),
        column_units(plant, compiled.output_names), dict(zip(names, x, strict=True)), values, at.rates,
        stiffness(plant, state) if isinstance(plant, Plant) else None,
        {**dict(zip(compiled.output_names, at.outputs.tolist(), strict=True)), **dict(zip(names, x, strict=True))},
        plant,
    )  # fmt: skip


def _places(kind: str, wanted: Sequence[str] | None, known: tuple[str, ...]) -> list[int]:
    if wanted is None:
        return list(range(len(known)))
    for name in wanted:
        if name not in known:
            raise ParameterError(f"no {kind} '{name}'; there are {', '.join(known)}.{suggestion(name, known)}")
    return [known.index(name) for name in wanted]
