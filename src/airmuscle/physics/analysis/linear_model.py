"""LinearModel: the linearisation of a system, x' = A x + B u, y = C x + D u, with names, units and
poles.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array, ParameterError, System, check_known
from ...core.system import check_system, state_vector
from ...engine.compile.function import Derivatives, derivatives
from ...engine.compile.program import CompiledSystem, compile_system
from ...recording.columns import column_units
from ..equilibrium import complete_inputs
from ..plant.plant import Plant
from . import sampled_model
from .frequency_figures import bode_figure
from .sampled_model import SampledModel, checked_frequencies, control_model, responses_at, sampled
from .static_stiffness import Stiffness, stiffness

ROUNDING = 1e-12
"""Part of the fastest pole below which real and imaginary parts are rounding errors."""
STEP = 1e-5
KINK = 1e-2
"""Part of the size of a number by which the sides of a kink are told apart, and relative difference
of the slopes of a plant there (chosen)."""
MAX_PADE = 10
"""Greatest order of a Pade approximation; higher ones lose digits."""


class Pole(NamedTuple):
    """One pole [1/s], its natural frequency |s|/(2 pi) [Hz] and damping ratio -Re s/|s| (nan for an
    integrator).
    """

    value: complex
    frequency: float
    damping_ratio: float


@dataclasses.dataclass(frozen=True, eq=False)
class LinearModel:
    """dx' = A dx + B du,  dy = C dx + D du: deviations from the operating point, a state and
    inputs.

    A, B, C, D      (n, n), (n, m), (k, n), (k, m)
    states, inputs, outputs    names, in the order of rows and columns; the states are among the
                               outputs
    units           unit of every name
    state, input_values, output_values    the operating point
    rates           (n,) rates of the states there: all zero at an equilibrium
    system          the system that was linearised
    stiffness       of a Plant: its stiffness at constant pressure and with closed valves; None for
                    another system
    delays          dead time [s] of inputs by name, before they act; none unless given
                    (`with_delay`)
    kinks           states and inputs by which the derivatives of the rates are those of one side
                    alone: even small oscillations about the operating point do not obey the model
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
    delays: Mapping[str, float] = dataclasses.field(default_factory=dict)
    kinks: tuple[str, ...] = ()

    @property
    def poles(self) -> tuple[Pole, ...]:
        """Eigenvalues of A, the slowest first. Enclosed air and friction at rest give poles at
        zero.
        """
        values = sorted(np.linalg.eigvals(self.A).tolist(), key=lambda s: (abs(s), s.imag))
        return tuple(
            Pole(complex(s), abs(s) / math.tau, -complex(s).real / abs(s) if s else math.nan)
            for s in values
        )

    def select(
        self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
    ) -> "LinearModel":
        """The model with only these inputs and outputs, in this order. Raises ParameterError for an
        unknown name.
        """
        rows = _places("output", outputs, self.outputs)
        columns = _places("input", inputs, self.inputs)
        return dataclasses.replace(
            self,
            B=self.B[:, columns],
            C=self.C[rows],
            D=self.D[np.ix_(rows, columns)],
            inputs=tuple(self.inputs[i] for i in columns),
            outputs=tuple(self.outputs[i] for i in rows),
            delays={
                name: self.delays[name]
                for name in (self.inputs[i] for i in columns)
                if name in self.delays
            },
        )

    def with_delay(self, delay: float | Mapping[str, float]) -> "LinearModel":
        """The model whose inputs act after a dead time [s] more: of all, or by name.

        Raises ParameterError for an unknown input, and for a delay that is negative or not finite.
        """
        further = delay if isinstance(delay, Mapping) else dict.fromkeys(self.inputs, delay)
        _places("input", tuple(further), self.inputs)
        for name, value in further.items():
            if not 0 <= value < math.inf:
                raise ParameterError(
                    f"with_delay: the delay of '{name}' is {value!r} s; it must be finite and not"
                    " negative."
                )
        total = {name: self.delays.get(name, 0.0) + float(value) for name, value in further.items()}
        return dataclasses.replace(self, delays={**self.delays, **total})

    def pade(self, order: int = 3) -> "LinearModel":
        """The model with Pade approximations of this order in place of the delays, as further
        states.
        """
        if not 1 <= order <= MAX_PADE:
            raise ParameterError(f"pade: the order is {order}; allowed range: 1 to {MAX_PADE}.")
        if not any(self.delays.values()):
            return self
        a = self.A
        b = self.B.copy()
        c = self.C
        d = self.D.copy()
        names = list(self.states)
        for name, delay in self.delays.items():
            if delay > 0:
                j = self.inputs.index(name)
                pa, pb, pc, pd = sampled_model.pade(delay, order)
                a = np.block([[a, np.outer(b[:, j], pc)], [np.zeros((order, len(a))), pa]])
                c = np.hstack([c, np.outer(d[:, j], pc)])
                b = np.vstack([b, np.zeros((order, b.shape[1]))])
                b[:, j] *= pd
                b[-order:, j] = pb
                d[:, j] *= pd
                names += [f"{name}.delay{i}" for i in range(order)]
        return dataclasses.replace(self, A=a, B=b, C=c, D=d, states=tuple(names), delays={})

    def sampled(self, sample_time: float) -> SampledModel:
        """The model at sampling instants, exact for inputs that are held over a sample time [s],
        with their delays.
        """
        return sampled(self, sample_time)

    def bode(self, frequencies: npt.ArrayLike) -> Any:
        """A Matplotlib figure of gain and phase of every output to every input at frequencies (F,)
        [Hz].
        """
        return bode_figure(self, checked_frequencies(frequencies))

    def frequency_response(self, frequencies: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """H(j 2 pi f) = (C (j 2 pi f I - A)^-1 B + D) exp(-j 2 pi f T) at frequencies (F,) [Hz], of
        shape (F, k, m).

        T are the delays of the inputs. Raises ParameterError for a frequency that is negative or
        not finite, and at a pole on the imaginary axis.
        """
        points = checked_frequencies(frequencies)
        late = np.array([self.delays.get(name, 0.0) for name in self.inputs])
        turns = np.asarray(2j * math.pi * points, dtype=complex)
        responses: npt.NDArray[np.complex128] = responses_at(self, turns, points) * np.exp(
            -turns[:, None, None] * late
        )
        return responses

    def to_scipy(self, *, pade: int = 3) -> Any:
        """A scipy.signal.StateSpace, delays as Pade approximations of this order; it carries no
        names.
        """
        from scipy.signal import StateSpace

        model = self.pade(pade)
        return StateSpace(model.A, model.B, model.C, model.D)

    def to_control(
        self, sample_time: float | None = None, *, nonlinear: bool = False, pade: int = 3
    ) -> Any:
        """A control.StateSpace with the names of states, inputs and outputs. Needs the package
        `control`.

        sample_time  of a discrete model [s], exact for held inputs and their delays; None: a
                     continuous one
        nonlinear    instead a control.NonlinearIOSystem of the system itself, with the same names:
                     its states, inputs and outputs are absolute values, not deviations from the
                     operating point, without delays
        pade         order of the Pade approximations of delays in the continuous model
        """
        if not nonlinear:
            return (
                control_model(self.pade(pade))
                if sample_time is None
                else self.sampled(sample_time).to_control()
            )
        control = sampled_model.imported_control()
        if self.system is None:
            raise ParameterError(
                "to_control: this model has no system; use the result of linearise."
            )
        name = type(self.system).__name__
        names = sampled_model.control_names(self)
        return control.NonlinearIOSystem(*_responses(self, self.system), name=name, **names)

    def __repr__(self) -> str:
        poles = np.array([pole.value for pole in self.poles])
        shown = []
        for s in poles[:6].tolist():  # without parts that cannot be told from zero
            real, imaginary = (
                0.0 if abs(x) <= ROUNDING * abs(poles[-1]) else x for x in (s.real, s.imag)
            )
            shown.append(f"{complex(real, imaginary):.4g}" if imaginary else f"{real:.4g}")
        more = ", ..." if len(self.states) > 6 else ""
        return (
            f"LinearModel({len(self.states)} states, inputs {', '.join(self.inputs) or 'none'}, "
            f"{len(self.outputs)} outputs; poles {', '.join(shown)}{more} 1/s"
            f"{'; one-sided by ' if self.kinks else ''}{', '.join(self.kinks)})"
        )


def _responses(
    model: LinearModel, system: System
) -> tuple[Callable[..., Array], Callable[..., Array]]:
    """Rates (n,) and outputs (k,) of the system of a model, as python-control calls them."""
    compiled, base = compile_system(system), np.array([*model.input_values.values(), 0.0])
    known = compiled.description
    sizes = compiled.sizes
    places = [known.input_names.index(name) for name in model.inputs]
    chosen = [[*known.state_names, *known.output_names].index(name) for name in model.outputs]

    def call(function: str, size: int, x: npt.ArrayLike, u: npt.ArrayLike) -> Array:
        result = np.zeros(size + 1)
        state = np.ascontiguousarray(x, dtype=float)
        inputs = base.copy()
        # python-control passes a number for one input
        values = np.atleast_1d(np.asarray(u, dtype=float))
        inputs[places] = values[: len(places)]
        compiled.call(function, state, inputs, compiled.precomputed, result)
        return result[:size]

    def rates(t: float, x: npt.ArrayLike, u: npt.ArrayLike, params: object) -> Array:
        return call("rhs", sizes.states, x, u)

    def outputs(t: float, x: npt.ArrayLike, u: npt.ArrayLike, params: object) -> Array:
        return np.concatenate([np.asarray(x, dtype=float), call("outputs", sizes.outputs, x, u)])[
            chosen
        ]

    return rates, outputs


def linearise(
    plant: System, state: Mapping[str, float], inputs: Mapping[str, float] | None = None
) -> LinearModel:
    """A system linearised at a state and inputs (0 unless given), by exact derivatives of the
    simulated equations.

    At a kink (a valve that starts to open, a muscle that becomes slack, an end stop in first
    contact) the derivatives are those of one side, and where two kinks coincide, as in the centre
    position of a valve without overlap, of one side of each: `kinks` names them; choose a state
    that is not at a kink. The state need not be an equilibrium; at an equilibrium, `rates` is zero.
    Raises ParameterError for an unknown or missing name, or an input beyond its range.
    """
    check_system("linearise", plant)
    x = state_vector(plant, state).tolist()
    plant.check_state(state)
    values = complete_inputs(plant, inputs)
    names = [s.name for s in plant.states]
    u = list(values.values())
    compiled = compile_system(plant)
    at = derivatives(compiled, x, u)
    further = [i for i, name in enumerate(compiled.output_names) if name not in names]
    return LinearModel(
        at.rates_by_state,
        at.rates_by_input,
        np.vstack([np.eye(len(names)), at.outputs_by_state[further]]),
        np.vstack([np.zeros((len(names), len(values))), at.outputs_by_input[further]]),
        tuple(names),
        tuple(values),
        (*names, *(compiled.output_names[i] for i in further)),
        column_units(plant, compiled.output_names),
        dict(zip(names, x, strict=True)),
        values,
        at.rates,
        stiffness(plant, state) if isinstance(plant, Plant) else None,
        {
            **dict(zip(compiled.output_names, at.outputs.tolist(), strict=True)),
            **dict(zip(names, x, strict=True)),
        },
        plant,
        kinks=_kinks(plant, compiled, np.array([*x, *u]), at),
    )


def _kinks(
    plant: System, compiled: CompiledSystem, point: Array, at: Derivatives
) -> tuple[str, ...]:
    """The states and inputs, other than those at an end of their range, on whose sides the slopes
    of rates differ.
    """
    n = len(plant.states)
    inputs = plant.input_variables
    sizes = np.maximum(
        np.abs(point), [*(abs(state.nominal) for state in plant.states), *[1e-3] * len(inputs)]
    )
    slopes = np.hstack([at.rates_by_state, at.rates_by_input])

    def rates(x: Array) -> Array:
        return derivatives(compiled, x[:n].tolist(), x[n:].tolist()).rates

    kinked = one_sided(rates, point, slopes, sizes, KINK)
    names = (*(state.name for state in plant.states), *(variable.name for variable in inputs))
    return tuple(
        names[i]
        for i in kinked
        if i < n or inputs[i - n].minimum < point[i] < inputs[i - n].maximum
    )


def one_sided(
    response: Callable[[Array], Array], point: Array, slopes: Array, sizes: Array, tolerance: float
) -> list[int]:
    """The coordinates of a point (k,), of these sizes (k,), on one of whose sides a response (r,)
    leaves its slopes.

    slopes     (r, k) of the response at the point
    tolerance  relative to the largest change of a row by any coordinate
    """
    here = response(point)
    moves = np.diag(STEP * sizes)
    expected = STEP * (slopes * sizes).T
    sides = np.array(
        [[response(point + move) - here, here - response(point - move)] for move in moves]
    )
    largest = np.maximum(np.abs(sides).max(axis=1), np.abs(expected).max(axis=0))
    missed = np.abs(sides - expected[:, None]).max(axis=1) > tolerance * largest
    return np.flatnonzero(missed.any(axis=1)).tolist()


def _places(kind: str, wanted: Sequence[str] | None, known: tuple[str, ...]) -> list[int]:
    if wanted is None:
        return list(range(len(known)))
    check_known(f"no {kind}", wanted, known)
    return [known.index(name) for name in wanted]
