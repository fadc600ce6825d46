"""Control loop as a JAX function of the parameters of plant and controller, with classical
Runge-Kutta steps.
"""

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...core import AirmuscleError, ParameterError, System, install_command, ops, tree
from ..loop import COMMAND, ControlLaw, ControlLoop, Measurement
from .problem import Problem
from .sampled_loop import SampledLoop, prepare_loop


def loop_in_jax(
    plant: System,
    loop: ControlLoop,
    *,
    duration: float,
    step: float,
    initial_state: Mapping[str, float],
) -> Callable[[Any, Any], dict[str, Any]]:
    """A control loop as a pure JAX function, for `jit`, `vmap`, `grad` and `jacfwd` in a user's own
    program.

    duration       of the run [s]
    step           of the integrator between two samples [s], as RungeKutta4(step)
    initial_state  a value for each state of the plant [SI]; it does not depend on the parameters

    The function takes the parameters of the plant and of the control law, `tree.flatten(plant)` and
    `tree.flatten(loop.controller)` or JAX arrays in their place, and returns arrays: `time` (K +
    1,), every state of the plant at the sampling instants and at the end (K + 1,), and
    `command.<input>` (K,) of every sample. With the steps and commands of `simulate(...,
    integrator=RungeKutta4(step))` its derivatives are those of `differentiate_loop`. JAX must be in
    double precision (`jax_enable_x64`).

    Raises ParameterError for a controller that is no ControlLaw, drivers, inputs beside the
    controller that change between two samples, or a step that is not positive; AirmuscleError
    without JAX or in single precision.
    """
    try:
        import jax
    except ImportError:
        raise AirmuscleError(
            f"loop_in_jax needs the package 'jax'; {install_command('jax')}."
        ) from None
    if jax.numpy.zeros(0).dtype != float:
        raise AirmuscleError(
            'loop_in_jax: JAX is in single precision; write jax.config.update("jax_enable_x64",'
            " True) first."
        )
    law = loop.controller
    jnp = jax.numpy
    if not isinstance(law, ControlLaw) or loop.drivers:
        what = (
            "the loop has drivers"
            if isinstance(law, ControlLaw)
            else f"{type(law).__name__} is no ControlLaw"
        )
        raise ParameterError(f"loop_in_jax: {what}; give a loop of a ControlLaw without drivers.")
    if not 0.0 < step < math.inf:
        raise ParameterError(f"loop_in_jax: step is {step!r} s; it must be positive and finite.")
    problem = Problem(plant, loop, duration, dict(initial_state))
    prepared = prepare_loop(problem, loop.init(0.0))
    start = {state.name: jnp.asarray(float(initial_state[state.name])) for state in plant.states}
    rows = tuple(
        jnp.asarray(table)
        for table in (
            prepared.setpoint_values,
            _constant_inputs(prepared),
            _step_lengths(prepared, step),
        )
    )

    def run(plant_parameters: Any, law_parameters: Any) -> dict[str, Any]:
        varied, commanding = (
            tree.unflatten(plant, list(plant_parameters)),
            tree.unflatten(law, list(law_parameters)),
        )
        memory = {name: _number(value) for name, value in commanding.initial_memory.items()}
        applied = {name: _number(0.0) for name in law.inputs}
        before = start, memory, applied
        interval = functools.partial(_interval, varied, commanding, prepared)
        (final, _, _), (states, commands) = jax.lax.scan(interval, before, rows)
        columns = {"time": jnp.asarray(prepared.instants)}
        for name in start:
            columns[name] = jnp.append(states[name], final[name])
        for name, values in commands.items():
            columns[f"{COMMAND}{name}"] = values
        return columns

    return run


def _interval(plant: System, law: ControlLaw, prepared: SampledLoop, carry: Any, row: Any) -> Any:
    """State, memory and commands after a sample and the steps after it; and the state before it and
    its commands.
    """
    import jax

    state, memory, applied = carry
    setpoints, beside, steps = row
    ranges = prepared.ranges
    constant = dict(zip(prepared.input_names, beside, strict=True))
    columns = {**plant.outputs(state, {**constant, **applied}), **state}
    measured = {name: columns[name] for name in law.measured_columns}
    measurement = Measurement(measured, dict(zip(law.setpoints, setpoints, strict=True)), ranges)
    commands, later = law.step(memory, measurement, prepared.loop.sample_time)
    applied_now = {name: ops.clip(_number(commands[name]), *ranges[name]) for name in law.inputs}
    inputs = {**constant, **applied_now}

    def step(x: Any, h: Any) -> tuple[Any, None]:
        return runge_kutta4(plant, x, inputs, h), None

    after, _ = jax.lax.scan(step, state, steps)
    memory = {name: _number(later[name]) for name in memory}
    return (after, memory, applied_now), (state, applied_now)


def _number(value: Any) -> Any:
    import jax

    return jax.numpy.asarray(value, dtype=float)


def runge_kutta4(
    plant: System, state: Mapping[str, Any], inputs: Mapping[str, Any], h: Any
) -> dict[str, Any]:
    """The states of a plant after a step of h [s] of the classical method with held inputs."""

    def moved(rates: Mapping[str, Any], length: Any) -> dict[str, Any]:
        return {name: value + length * rates[name] for name, value in state.items()}

    first = plant.rates(state, inputs)
    second = plant.rates(moved(first, 0.5 * h), inputs)
    third = plant.rates(moved(second, 0.5 * h), inputs)
    fourth = plant.rates(moved(third, h), inputs)
    mean = {
        name: (first[name] + 2.0 * second[name] + 2.0 * third[name] + fourth[name]) / 6.0
        for name in state
    }
    return moved(mean, h)


def _constant_inputs(prepared: SampledLoop) -> Any:
    """Values (K, m) of the inputs that the controller does not command, held over each interval."""
    first = prepared.first_segments
    if (np.diff(first) > 1).any() or prepared.inputs.slopes.any():
        raise ParameterError(
            "loop_in_jax: an input that the controller does not command changes between two"
            " samples; let it change at sampling instants only, and hold it in between."
        )
    return prepared.inputs.values[first[:-1]]


def _step_lengths(prepared: SampledLoop, step: float) -> Any:
    """Lengths (K, s) of the steps of each interval; the last one of an interval is shortened, as in
    RungeKutta4.
    """
    intervals = np.diff(prepared.instants)
    counts = np.ceil(intervals / step - 1e-6).astype(int)
    lengths = np.zeros((intervals.size, counts.max()))
    for i, (interval, count) in enumerate(zip(intervals, counts, strict=True)):
        lengths[i, : count - 1] = step
        lengths[i, count - 1] = interval - step * (count - 1)
    return lengths
