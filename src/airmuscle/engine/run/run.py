"""Simulation of a problem, with a control loop from one sampling instant to the next, each met
exactly; short ways in.

Runs of compiled loops are kept with the system for the next loop of the same form. Loops have the
same form if they differ in the parameters of the control law alone: the sampling instants, the set
points and the segments of the other inputs are then the same, and so is the kernel with its arrays.
"""

import functools
import operator
from collections.abc import Hashable, Mapping

import numpy as np
import numpy.typing as npt

from ...core import NUMBERS, ParameterError, SimulationError, System, as_float, one_line, tree
from ...core.diagnostics import Diagnostic, DiagnosticCode, Status
from ...core.system import check_system, state_vector
from ...recording import Recording
from ...recording.columns import column_units
from ..compile.program import CompiledSystem, compile_system
from ..loop import ControlLaw, ControlLoop, InputSignal, PiecewiseLinear, Schedule
from .compiled_law import parameters_of
from .compiled_loop import CompiledLoop, CompiledRun
from .integrators import (
    INTERRUPT_CHECK_STEPS,
    BoundIntegrator,
    Integrator,
    RawSolution,
    default_integrator,
)
from .problem import MAX_KEPT_ROWS, Problem, check_input_range, plain_numbers
from .sampled_loop import prepare_loop
from .solution import Solution, early_end, make_solution, possible_rows, status_of_state

_AT_POSSIBLE_STATE = {Status.DONE, Status.INTERRUPTED, Status.TOO_MANY_STEPS}
"""How a run ends at a possible state."""
INSTANTS = 1000
"""Instants between two rows at which the first impossible state is looked for (chosen)."""
_NO_TIMES = np.empty(0)
_NO_INPUT = -1, (np.inf, -np.inf)


def solve(problem: Problem) -> Solution:
    """The solution of a problem; a run that ended early is returned as far as it was computed, with
    its status.

    With a ControlLoop the recording also has `setpoint.`, `measured.` and `command.` columns: the
    set points in time, and the controller's measurements and commands at the last sample. Every
    sampling instant is a row. Measurements are taken just before the command of the same instant:
    an output that jumps with an input has not jumped yet. Split at a sampling instant and
    continued, a run equals the run in one, to the last bit; split between two, to the tolerance.
    """
    compiled = problem.compiled
    integrator = problem.integrator
    assert integrator is not None
    if isinstance(problem.input, ControlLoop):
        return _solve_closed_loop(problem, problem.input)
    segments = problem.segments
    times = problem.times
    pool = compiled.description.cache.integrators
    bound: BoundIntegrator = pool.borrow(integrator) or integrator.bind(compiled)
    check = functools.partial(status_of_state, compiled, segments, problem.start_time)
    raw = bound.run(segments, problem.start_time, problem.initial_vector, times, check=check)
    pool.give_back(integrator, bound)
    raw, table = possible_rows(compiled, raw, times, segments, problem.start_time)
    if (
        raw.status not in _AT_POSSIBLE_STATE
        and raw.reached > 0
        and raw.steps < INTERRUPT_CHECK_STEPS
    ):  # a short run
        raw = _end_between_rows(problem, raw)
    return make_solution(problem, raw, table, times, (raw.time, raw.state), {})


def _end_between_rows(problem: Problem, raw: RawSolution) -> RawSolution:
    """The solution, which ended early, cut at the first impossible one of many instants since its
    last row, if any.
    """
    compiled = problem.compiled
    integrator = problem.integrator
    assert integrator is not None
    instants = np.linspace(problem.times[raw.reached - 1], raw.time, INSTANTS + 1)[1:]
    again = integrator.run(
        compiled, problem.segments, problem.start_time, problem.initial_vector, instants
    )
    end, _ = possible_rows(compiled, again, instants, problem.segments, problem.start_time)
    return raw if end is again else raw._replace(time=end.time, state=end.state, status=end.status)


def _solve_closed_loop(problem: Problem, loop: ControlLoop) -> Solution:
    """The solution of a problem with a ControlLoop, and the state from which the run can be
    continued.
    """
    compiled = problem.compiled
    form = form_of(problem)
    law = loop.controller
    control_state = problem.control_state or loop.init(problem.start_time)
    pool = compiled.description.cache.loops
    run: CompiledRun | None = pool.borrow(form)
    if run is None:
        assert problem.integrator is not None
        prepared = CompiledLoop(compiled, prepare_loop(problem, control_state))
        run = CompiledRun(
            prepared, compiled, problem.integrator, problem.initial_vector, control_state
        )
    else:
        assert isinstance(law, ControlLaw)
        run.restart(compiled, problem.initial_vector, parameters_of(law), control_state)
    run.integrate()
    solution = _loop_solution(problem, loop, run)
    if form is not None and run.status == Status.DONE and len(solution.recording) <= MAX_KEPT_ROWS:
        pool.give_back(form, run)  # it holds the signals, which the form names by their identity
    return solution


def _loop_solution(problem: Problem, loop: ControlLoop, run: CompiledRun) -> Solution:
    """The rows of all intervals as one solution."""
    compiled = problem.compiled
    segments = run.signal
    times, states = run.rows
    # the next run may be in the same arrays
    times = times.copy()
    states = states.copy()
    raw, table = possible_rows(compiled, run.raw(states), times, segments, problem.start_time)
    way = (
        "compiled with the plant"
        if run.loop.law is not None
        else "called from Python at each sample"
    )
    measured = [name for name in loop.controller.measured_columns if name in compiled.output_names]
    note = f"controlled by {loop.describe(column_units(problem.system, measured))}; {way}"
    remark = Diagnostic(DiagnosticCode.CONTROLLER, type(loop.controller).__name__, note)
    control_state = run.control_state
    notes = loop.controller.notes(control_state.controller)
    remarks = (
        remark,
        *(Diagnostic(DiagnosticCode.CONTROLLER, remark.subject, text) for text in notes),
    )
    reached = times[: raw.reached]
    at, setpoints = (
        run.prepared.at(reached) if loop.drivers else run.prepared.at_times
    )  # drivers add rows
    more = run.columns(at[: reached.size], setpoints[: reached.size])
    return make_solution(
        problem, raw, table, times, (run.time, run.state), more, remarks, control_state
    )


def form_of(problem: Problem) -> Hashable | None:
    """The form of a problem's loop; None where a part of it may change, or where the run continues
    another one.
    """
    loop = problem.input
    assert isinstance(loop, ControlLoop)
    law = loop.controller
    requested = problem.output_times
    signals = type(loop.setpoint) is Schedule and type(loop.other_inputs) is Schedule
    if not signals or problem.control_state is not None or not isinstance(law, ControlLaw):
        return None
    if not (requested is None or type(requested) in (float, int)):
        return None
    form = (
        tree.structure(law),
        id(loop.setpoint),
        id(loop.other_inputs),
        tuple(loop.drivers.items()),
        loop.sample_time,
        problem.start_time,
        problem.duration,
        requested,
        problem.integrator,
    )
    try:
        hash(form)
    except TypeError:  # a driver or an integrator that can change
        return None
    return form


def simulate(
    plant: System,
    input: InputSignal | ControlLoop,
    *,
    duration: float,
    initial_state: Mapping[str, float] | None = None,
    start_time: float = 0.0,
    output_times: float | npt.ArrayLike | None = None,
    integrator: Integrator | None = None,
    complete: bool = True,
) -> Recording:
    """Simulate a plant for `duration` [s]; its states, outputs and inputs as a Recording.

    plant          any System: a Plant, or a user-defined one
    input          an InputSignal such as a Schedule, or a ControlLoop
    initial_state  values by state; by default a Plant's equilibrium at ambient pressure
    output_times   spacing [s] or times [s] of the rows; by default 1/1000 of the run, at most 10
                   ms. The instants of the input are always among the rows, with the inputs that
                   begin there
    integrator     Rodas4(rtol=1e-6) by default
    complete       whether a run that ends early raises SimulationError (its `.recording` holds what
                   was computed); otherwise that part is returned, with the reason in its notes

    The short form of `solve(Problem(...)).recording`. The result does not depend on `output_times`.
    Raises ParameterError for an input or state that the plant does not have.
    """
    solution = solve(
        Problem(plant, input, duration, initial_state, start_time, output_times, integrator)
    )
    return (solution.raise_if_incomplete() if complete else solution).recording


def advance(
    plant: System,
    state: Mapping[str, float],
    inputs: Mapping[str, float] | PiecewiseLinear,
    dt: float,
    integrator: Integrator | None = None,
    *,
    start_time: float = 0.0,
) -> dict[str, float]:
    """The state of a plant `dt` [s] later, with the inputs held.

    Inputs that vary meanwhile are given as PiecewiseLinear from `start_time` on:
    `segments, states = WithDrivers(signal, drivers).step(states, plant.inputs, start_time, dt)`.
    For many steps of one plant a `Stepper` is quicker. Raises SimulationError where the step fails,
    ParameterError for an unknown name or an input beyond its range.
    """
    check_system("advance", plant)
    dt = as_float("advance: dt", dt)
    start_time = as_float("advance: start_time", start_time)
    if not 0 < dt < float("inf"):
        raise ParameterError(f"advance: dt is {dt!r} s; it must be positive and finite.")
    compiled = compile_system(plant)
    integrator = default_integrator(integrator)
    final = _hold(compiled, integrator, state, inputs, dt) if isinstance(inputs, Mapping) else None
    if final is not None:
        return dict(zip(compiled.description.state_names, final, strict=True))
    segments = _segments(compiled, inputs, start_time, dt)
    pool = compiled.description.cache.integrators
    bound: BoundIntegrator = pool.borrow(integrator) or integrator.bind(compiled)
    raw = bound.run(segments, start_time, state_vector(plant, state), _NO_TIMES)
    pool.give_back(integrator, bound)
    if raw.status == Status.DONE and (raw.state < compiled.description.lower_bounds).any():
        raw = raw._replace(status=Status.NEGATIVE_AIR_MASS)
    if raw.status != Status.DONE:
        raise SimulationError(str(early_end(compiled, raw, start_time + dt)))
    return dict(zip(compiled.description.state_names, raw.state.tolist(), strict=True))


def _hold(
    compiled: CompiledSystem,
    integrator: Integrator,
    state: Mapping[str, float],
    inputs: Mapping[str, float],
    dt: float,
) -> list[float] | None:
    """The state after a step with held inputs; None if `advance` must check the arguments or report
    a failure.
    """
    known = compiled.description
    x = plain_numbers(state, known.state_limits)
    if x is None:
        return None
    held_inputs = [0.0] * len(known.input_names)
    for name, value in inputs.items():
        column, (low, high) = known.input_limits.get(name, _NO_INPUT)
        if type(value) not in NUMBERS or not low <= value <= high:
            return None
        held_inputs[column] = value
    pool = known.cache.holders
    bound: BoundIntegrator = pool.borrow(integrator) or integrator.bind(compiled)
    bound.state[:] = x
    bound.held[:] = held_inputs
    status = bound.proceed(dt)
    final: list[float] = bound.state.tolist()
    pool.give_back(integrator, bound)
    if status is not Status.DONE or any(map(operator.lt, final, known.state_limits.values())):
        return None
    return final


def _segments(
    compiled: CompiledSystem, inputs: Mapping[str, float] | PiecewiseLinear, start: float, dt: float
) -> PiecewiseLinear:
    """The inputs of one step, checked."""
    known = compiled.description
    if isinstance(inputs, PiecewiseLinear):
        inputs.check_shape(len(known.input_names), start, dt)
        segments = inputs.as_floats()
    elif isinstance(inputs, Mapping):
        hold = Schedule({name: ((start, value),) for name, value in inputs.items()})
        segments = hold.segments(known.input_names, start, dt)
    else:
        raise ParameterError(
            f"advance: inputs are {one_line(inputs)}; give a value for each name, or"
            " PiecewiseLinear."
        )
    check_input_range(compiled, segments, start)
    return segments
