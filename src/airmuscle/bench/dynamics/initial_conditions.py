"""Start of a record: initial state from known values and equilibrium conditions, and rows on the
clock of the run.
"""

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import (
    Array,
    IdentificationError,
    ParameterError,
    Status,
    System,
    autodiff,
    check_known,
    nodes,
    slopes,
    tree,
)
from ...engine import InputSignal, PiecewiseLinear
from ...engine.compile.cache.kernel import newton
from ...engine.compile.function import Function
from ...physics import Plant
from ...physics.equilibrium import nearest_equilibrium
from ...physics.plant.validation import check_pressures

PRESSURE_STEP = 100.0
"""Increase of gauge pressure [Pa] by which states that depend on the pressure are detected."""
NOMINAL_VOLUME = 1e-4
"""Volume of a muscle [m3] at which circuits are settled; the state of a supply does not depend on
it.
"""
MusclePressures = float | str | Sequence[float | str]
"""Gauge pressure [Pa] of all muscles, or one for each; also as texts with a unit."""
_compiled_conditions: dict[Any, Function] = {}


@dataclasses.dataclass(frozen=True, eq=False)
class InitialConditions:
    """Conditions that determine an initial state, one for each state; the inputs are zero.

    known       values of states or outputs [SI]
    guess       initial guess of every state for Newton's method [SI]
    stationary  states whose time derivative is zero
    equal       pairs of outputs that are equal
    settled     states of supplies and regulators in the steady state that follows from their
                parameters
    """

    known: Mapping[str, float]
    guess: Mapping[str, float]
    stationary: tuple[str, ...] = ()
    equal: tuple[tuple[str, str], ...] = ()
    settled: tuple[str, ...] = ()

    @classmethod
    def at_rest(cls, plant: Plant, pressure: MusclePressures) -> "InitialConditions":
        """Equilibrium at gauge pressures [Pa], one for all muscles or one for each; walls, tubes
        and tanks are settled. Raises ParameterError for another number of pressures than muscles,
        EquilibriumError where there is none.
        """
        pressures = check_pressures(pressure, len(plant.muscles), plant.ambient)
        return _steady_conditions(
            plant, nearest_equilibrium(plant, pressure=tuple(pressures)), pressures, at_rest=True
        )

    @classmethod
    def at_coordinates(
        cls, plant: Plant, pressure: MusclePressures, **coordinates: float
    ) -> "InitialConditions":
        """A plant at gauge pressures [Pa], one for all muscles or one for each, and given
        coordinates [SI]. Speeds are zero unless given. Walls and tubes are in steady state at these
        pressures, tanks and regulators at their supply, also where their parameters are unknowns.
        Raises ParameterError for another number of pressures than muscles, or an unknown name."""
        pressures = check_pressures(pressure, len(plant.muscles), plant.ambient)
        return _steady_conditions(
            plant, plant.state_at(pressure=pressures, **coordinates), pressures, at_rest=False
        )

    def check_plant(self, system: System, values: Mapping[str, Any]) -> None:
        """Raise ParameterError for a name that the system lacks, or where the number of conditions
        is wrong.
        """
        names = [s.name for s in system.states]
        of_states = (*self.stationary, *self.settled)
        for name in (*self.known, *of_states, *itertools.chain(*self.equal)):
            allowed = names if name in of_states else values
            check_known("the initial conditions name", name, allowed, "the system has")
        if len(self.known) + len(of_states) + len(self.equal) != len(names) or set(
            self.guess
        ) != set(names):
            raise ParameterError(
                "the initial conditions must give as many conditions as there are states"
                f" ({', '.join(names)}), and a guess of each state; known are"
                f" {', '.join(self.known) or 'none'}, stationary are"
                f" {', '.join(self.stationary) or 'none'}."
            )


def _states_at_raised_pressure(
    plant: Plant, pressures: Sequence[float], motion: Mapping[str, float]
) -> Iterator[Mapping[str, float]]:
    """The states of a plant with the pressure of one muscle after the other raised by a step."""
    for k, pressure in enumerate(pressures):
        raised = [*pressures[:k], pressure + PRESSURE_STEP, *pressures[k + 1 :]]
        yield plant.state_at(pressure=raised, **motion)


def _steady_conditions(
    plant: Plant, state: Mapping[str, float], pressures: Sequence[float], at_rest: bool
) -> InitialConditions:
    """The gauge pressures [Pa] of the muscles, and one condition for each state but the air masses:
    settled or known if no pressure changes it, equal pressure of a tube, else stationary, as the
    speeds of a mechanism at rest are.
    """
    coordinates = plant.mechanism.coordinates
    names = [c.name for c in coordinates]
    speeds = [c.speed for c in coordinates]
    motion = {name: state[name] for name in (*names, *speeds)}
    varied_states = list(_states_at_raised_pressure(plant, pressures, motion))
    outputs = plant.outputs(state, dict.fromkeys(plant.inputs, 0.0))
    of_circuits = _circuit_states(plant)
    muscles = zip(plant.prefixes, pressures, strict=True)
    known = {f"{prefix}pressure": pressure for prefix, pressure in muscles}
    left_out = {f"{prefix}air_mass" for prefix in plant.prefixes}
    if at_rest:
        left_out |= motion.keys()
    stationary = list[str]()
    equal = list[tuple[str, str]]()
    settled = list[str]()
    for name, value in state.items():
        if name in left_out:
            continue
        if all(varied[name] == value for varied in varied_states):
            if name in of_circuits:
                settled.append(name)
            else:
                known[name] = value
        elif (tube_pressure := f"{name.removesuffix('air_mass')}pressure") in outputs:
            prefix = next(prefix for prefix in plant.prefixes if name.startswith(prefix))
            equal.append((tube_pressure, f"{prefix}pressure"))
        else:
            stationary.append(name)
    if at_rest:
        known |= dict.fromkeys(speeds, 0.0)
        stationary += speeds
    return InitialConditions(known, state, tuple(stationary), tuple(equal), tuple(settled))


def _circuit_states(plant: Plant) -> dict[str, Any]:
    """Steady states of the circuits with ambient pressure in the muscles; those of supplies do not
    depend on it.
    """
    count = len(plant.muscles)
    air = {
        f"{prefix}{name}" for prefix in plant.prefixes for name in ("air_mass", "internal_energy")
    }
    states = plant.fill_muscles([0.0] * count, [NOMINAL_VOLUME] * count, {})
    return {name: value for name, value in states.items() if name not in air}


def compile_conditions(system: System, initial: InitialConditions) -> Function:
    """The compiled function (state, leaves) -> (known values and rates, their derivatives by state
    and by leaf).
    """
    key = (
        tree.structure(system),
        tuple(initial.known),
        initial.stationary,
        initial.equal,
        initial.settled,
    )
    if key not in _compiled_conditions:
        model, p = autodiff.symbolic(system)
        x = nodes.symbols("x", len(system.states))
        state = {s.name: symbol for s, symbol in zip(system.states, x, strict=True)}
        inputs = dict.fromkeys(system.inputs, 0.0)
        values = {**model.outputs(state, inputs), **state}
        initial.check_plant(system, values)
        rates = model.rates(state, inputs)
        steady = _circuit_states(model) if initial.settled else {}
        g = nodes.as_nodes(
            [
                *(values[n] for n in initial.known),
                *(rates[n] for n in initial.stationary),
                *(values[a] - values[b] for a, b in initial.equal),
                *(state[n] - steady[n] for n in initial.settled),
            ]
        )
        outputs = {
            "values": g,
            "by_state": slopes.by_row(slopes.jacobian(g, x)),
            "by_leaf": slopes.by_row(slopes.jacobian(g, p)),
        }
        _compiled_conditions[key] = Function({"x": x, "leaves": p}, outputs)
    return _compiled_conditions[key]


class SolvedInitialState(NamedTuple):
    """An initial state (n,), and its derivatives by the known values (n, k) and by the leaves of
    the plant (n, p).
    """

    state: Array
    by_known: Array
    by_leaf: Array


def solve_initial_state(
    function: Function,
    initial: InitialConditions,
    leaves: Array,
    known: Array,
    guess: Array,
    nominal: Array,
) -> SolvedInitialState:
    """The initial state by `compile_conditions` for states of `nominal` size, and its derivatives
    (implicit function theorem). Raises IdentificationError if there is none.
    """
    n = guess.size
    x = guess.copy()
    target = np.concatenate([known, np.zeros(n - known.size)])
    values = np.empty(n)
    by_state = np.empty((n, n))
    by_leaf = np.empty((n, leaves.size))
    status = Status(
        newton(
            function=function.address,
            p=leaves,
            target=target,
            sizes=nominal,
            x=x,
            values=values,
            by_x=by_state,
            by_p=by_leaf,
            a=np.zeros((n, n)),
            b=np.zeros(n),
        )
    )
    if status != Status.DONE:
        conditions = [
            f"{name} = {value:.4g}"
            for name, value in zip(initial.known, known.tolist(), strict=True)
        ]
        conditions += [f"{name} stationary" for name in initial.stationary]
        conditions += [f"{a} = {b}" for a, b in initial.equal]
        conditions += [f"{name} settled" for name in initial.settled]
        raise IdentificationError(
            f"no state satisfies the initial conditions ({', '.join(conditions)}; SI):"
            f" {status.message}. Change the conditions or the guess."
        )
    inverse = nominal[:, None] * np.linalg.inv(by_state * nominal)
    return SolvedInitialState(x, inverse[:, : known.size], -inverse @ by_leaf)


MIN_DURATION = 1e-9
"""Least duration of a run [s] (chosen)."""


class CommandInterval(NamedTuple):
    """Segments of a command from `begin` [s] on, rows within them (K,), and column of their first
    instant or None.
    """

    begin: float
    segments: PiecewiseLinear
    times: Array
    column: int | None


class TimeGrid(NamedTuple):
    """The rows of a record relative to the start of the run, shape (N,), with the inputs there (N,
    m); `instants` are those of the command that are unknowns [s], by those of the command of the
    experiment."""

    start_time: float
    instants: Mapping[float, float]
    times: Array
    before_start: npt.NDArray[np.bool_]
    inputs: Array
    intervals: tuple[CommandInterval, ...]


def make_time_grid(
    times: Array,
    start_time: float,
    command: InputSignal,
    inputs: tuple[str, ...],
    instants: Mapping[float, float],
    columns: Mapping[float, int],
) -> TimeGrid:
    """The grid of rows at `times` (N,) on the clock of the record; `instants` has the estimate of
    each instant of the experiment's command that is an unknown, `columns` its sensitivity
    column."""
    elapsed = times - start_time
    rows = np.maximum(elapsed, 0.0)
    segments = command.checked_segments(inputs, 0.0, max(float(elapsed[-1]), MIN_DURATION))
    at_rows = np.ascontiguousarray(segments.inputs_at(rows, 0.0))
    intervals = _split(
        segments, rows, {instants[instant]: column for instant, column in columns.items()}
    )
    return TimeGrid(start_time, instants, rows, elapsed < 0, at_rows, intervals)


def _split(
    segments: PiecewiseLinear, rows: Array, switches: Mapping[float, int]
) -> tuple[CommandInterval, ...]:
    """The segments and rows between the instants that are unknowns."""
    inner = segments.ends[:-1].tolist()
    cuts = [i + 1 for i, end in enumerate(inner) if end in switches]
    if not cuts:
        return (CommandInterval(0.0, segments, rows, None),)
    begins = [inner[i - 1] for i in cuts]
    first_rows = [0, *np.searchsorted(rows, begins).tolist(), rows.size]
    columns = [None, *(switches[begin] for begin in begins)]
    parts = [slice(*ends) for ends in itertools.pairwise([0, *cuts, segments.ends.size])]
    rows_of_parts = [slice(*ends) for ends in itertools.pairwise(first_rows)]
    intervals = []
    for begin, column, part, of_part in zip(
        [0.0, *begins], columns, parts, rows_of_parts, strict=True
    ):
        course = PiecewiseLinear(segments.ends[part], segments.values[part], segments.slopes[part])
        intervals.append(CommandInterval(begin, course, rows[of_part], column))
    return tuple(intervals)
