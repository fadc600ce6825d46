"""Simulation of a control loop: from one sampling instant to the next, each met exactly.

Runs of compiled loops are kept with the system for the next loop of the same form. Loops have the same form if they
differ in the parameters of the control law alone: the sampling instants, the set points and the segments of the other
inputs are then the same, and so is the kernel with its arrays.
"""

from collections.abc import Hashable

from ...core import Diagnostic, DiagnosticCode, Status, tree
from ...recording.columns import column_units
from ..loop import ControlLaw, ControlLoop, Schedule
from .compiled_law import parameters_of
from .compiled_loop import CompiledLoop, CompiledRun
from .problem import Problem
from .sampled_loop import prepare_loop
from .solution import Solution, make_solution, recorded_rows, truncate_at_invalid_row

MAX_KEPT_ROWS = 100_000
"""Rows up to which a run is kept (chosen)."""


def solve_closed_loop(problem: Problem, loop: ControlLoop) -> Solution:
    """The solution of a problem with a ControlLoop, and the state from which the run can be continued.

    The recording also has `setpoint.`, `measured.` and `command.` columns: the set points in time, and the controller's
    measurements and commands at the last sample. Every sampling instant is a row. Measurements are taken just before
    the command of the same instant: an output that jumps with an input has not jumped yet. Split at a sampling instant
    and continued, a run equals the run in one, to the last bit; split between two, to the integrator's tolerance.
    """
    compiled, form, law = problem.compiled, form_of(problem), loop.controller
    control_state = problem.control_state or loop.init(problem.start_time)
    pool = compiled.description.cache.loops
    run: CompiledRun | None = pool.borrow(form)
    if run is None:
        assert problem.integrator is not None
        prepared = CompiledLoop(compiled, prepare_loop(problem, control_state))
        run = CompiledRun(prepared, compiled, problem.integrator, problem.initial_vector, control_state)
    else:
        assert isinstance(law, ControlLaw)
        run.restart(compiled, problem.initial_vector, parameters_of(law), control_state)
    run.integrate()
    solution = _solution(problem, loop, run)
    if form is not None and run.status == Status.DONE and run.room <= MAX_KEPT_ROWS:
        pool.give_back(form, run)  # it holds the signals, which the form names by their identity
    return solution


def _solution(problem: Problem, loop: ControlLoop, run: CompiledRun) -> Solution:
    """The rows of all intervals as one solution."""
    compiled, segments, (times, states) = problem.compiled, run.signal, run.rows
    times, states = times.copy(), states.copy()  # the next run may be in the same arrays
    raw = run.raw(states)
    table = recorded_rows(compiled, states, times, segments, problem.start_time)
    raw, table = truncate_at_invalid_row(compiled, raw, table, times)
    way = "compiled with the plant" if run.loop.law is not None else "called from Python at each sample"
    measured = [name for name in loop.controller.measured_columns if name in compiled.output_names]
    note = f"controlled by {loop.describe(column_units(problem.system, measured))}; {way}"
    remark = Diagnostic(DiagnosticCode.CONTROLLER, type(loop.controller).__name__, note)
    control_state = run.control_state
    notes = loop.controller.notes(control_state.controller)
    remarks = (remark, *(Diagnostic(DiagnosticCode.CONTROLLER, remark.subject, text) for text in notes))
    reached = times[: raw.reached]
    at, setpoints = run.prepared.at(reached) if loop.drivers else run.prepared.at_times  # drivers add rows
    more = run.columns(at[: reached.size], setpoints[: reached.size])
    return make_solution(problem, raw, table, times, (run.time, run.state), more, remarks, control_state)


def form_of(problem: Problem) -> Hashable | None:
    """The form of a problem's loop; None where a part of it may change, or where the run continues another one."""
    loop = problem.input
    assert isinstance(loop, ControlLoop)
    law, given = loop.controller, problem.output_times
    signals = type(loop.setpoint) is Schedule and type(loop.other_inputs) is Schedule
    if not signals or problem.control_state is not None or not isinstance(law, ControlLaw):
        return None
    if not (given is None or type(given) in (float, int)):
        return None
    form = (
        tree.structure(law), id(loop.setpoint), id(loop.other_inputs), tuple(loop.drivers.items()), loop.sample_time,
        problem.start_time, problem.duration, given, problem.integrator,
    )  # fmt: skip
    try:
        hash(form)
    except TypeError:  # a driver or an integrator that can change
        return None
    return form
