"""Signals to play next: their Fisher information reduces the standard errors of the undetermined
parameters more than random signals of the same length do, and all of them keep the limits of
pressure, rate and travel.
"""

from __future__ import annotations

import dataclasses
import json
import subprocess

import numpy as np
import pytest
from command_line import airmuscle
from hypothesis import given
from hypothesis import strategies as st

import airmuscle as am
from airmuscle.bench import SignalLimits, plan_signals, read_csv
from airmuscle.core import tree
from airmuscle.engine import Schedule, simulate
from airmuscle.errors import ParameterError

STEP = 0.01
REGULATOR = am.load("vessel-smc-itv2050").plant
JOINT = am.load("joint-dmsp-20-regulators").plant
KNOWN = ("circuit.fill.conductance", "circuit.discharge.conductance", "circuit.overlap")
WEAK = ("circuit.pilot_time", "circuit.dead_time", "circuit.sensitivity", "circuit.integral_rate")
LIMITS = SignalLimits(4.5e5, 5e4, 3e6)
ARM_LIMITS = SignalLimits(4e5, 5e4, 2e6, {"angle": (-0.4, 0.5)})
ARM_WEAK = ("mechanism.damping", "mechanism.weight_torque")


def values_of(plant, paths):
    leaves = {leaf.path: float(leaf.value) for leaf in tree.leaves(plant)}
    return np.array([leaves[path] for path in paths])


def planned(plant, limits, known, weak):
    """The plan after a fit that knows some parameters to 2 % and others to 100 %."""
    paths = (*known, *weak)
    errors = np.abs(values_of(plant, paths)) * np.repeat([0.02, 1.0], [len(known), len(weak)])
    return plan_signals(
        plant,
        limits,
        parameters=paths,
        covariance=np.diag(errors**2),
        deviations={"angle": 0.01} if plant is JOINT else {"pressure": 1e3},
        duration=20.0,
        sample_time=STEP,
    )


@pytest.fixture(scope="module")
def regulator_plan():
    return planned(REGULATOR, LIMITS, KNOWN, WEAK)


@pytest.fixture(scope="module")
def arm_plan():
    return planned(JOINT, ARM_LIMITS, ("mechanism.radius", "mechanism.inertia"), ARM_WEAK)


def changed(plant, factors):
    leaves = [leaf.value * factors.get(leaf.path, 1.0) for leaf in tree.leaves(plant)]
    return tree.with_parameters(plant, leaves)


def response(plant, commands, column):
    times = STEP * np.arange(len(commands))
    points = {
        name: tuple(zip(times.tolist(), values.tolist(), strict=True))
        for name, values in zip(plant.inputs, commands.T, strict=True)
    }
    start = plant.state_at(pressure=float(commands[0, 0]))
    run = simulate(
        plant, Schedule(points), duration=float(times[-1]), initial_state=start, output_times=times
    )
    return run[column][np.searchsorted(run["time"], times - 1e-9)]


def determinant(plant, commands, column, deviation, prior):
    """ln det of the covariance of the weak parameters on a plant that is not that of the plan."""
    slopes = np.stack(
        [
            (
                response(changed(plant, {path: 1.03}), commands, column)
                - response(changed(plant, {path: 0.97}), commands, column)
            )
            / (0.06 * deviation)
            for path in prior
        ],
        axis=1,
    )
    information = 0.2 * slopes.T @ slopes + np.diag([1.0 / s**2 for s in prior.values()])
    covariance = np.linalg.inv(information)
    weak = [k for k, sigma in enumerate(prior.values()) if sigma > 0.5]
    return np.linalg.slogdet(covariance[np.ix_(weak, weak)])[1]


def random_signals(plan, plant, seed):
    """Uniform levels, held for 50 to 500 ms, over the length and within the limits of the plan;
    those of a joint are shrunk until its motion keeps the travel.
    """
    rng = np.random.default_rng(seed)
    rows = len(plan.commands)
    limits = plan.limits
    values = np.concatenate(
        [
            np.repeat(
                rng.uniform(limits.min_pressure, limits.max_pressure, (1, len(plan.inputs))),
                rng.integers(5, 50),
                axis=0,
            )
            for _ in range(rows)
        ]
    )[:rows]
    middle = 0.5 * (limits.min_pressure + limits.max_pressure)
    for scale in 0.8 ** np.arange(30):
        commands = limits.limited(middle + scale * (values - middle), plan.commands[0], STEP)
        if not limits.travel:
            return commands
        angle = response(plant, commands, "angle")
        if limits.allows({"angle": angle[None]}, margin=0.0)[0]:
            return commands
    raise AssertionError("no random signal keeps the travel")


@pytest.mark.parametrize("kind", ["regulator", "arm"])
def test_the_plan_determines_more_than_the_median_of_random_signals(kind, regulator_plan, arm_plan):
    if kind == "regulator":
        plan, plant, column, deviation = regulator_plan, REGULATOR, "pressure", 1e3
        prior = dict.fromkeys(KNOWN, 0.02) | dict.fromkeys(WEAK, 1.0)
    else:
        plan, plant, column, deviation = arm_plan, JOINT, "angle", 0.01
        prior = {"mechanism.radius": 0.02, "mechanism.inertia": 0.02}
        prior |= dict.fromkeys(ARM_WEAK, 1.0)
    true = changed(plant, dict(zip(prior, [0.9, 1.1, 0.95, 1.15, 0.9, 1.2, 0.85], strict=False)))
    chosen = determinant(true, plan.commands, column, deviation, prior)
    random = [
        determinant(true, random_signals(plan, true, seed), column, deviation, prior)
        for seed in range(5)
    ]
    print(kind, chosen, sorted(random))
    assert chosen < np.median(random)


def keeps(plan):
    limits = plan.limits
    commands = plan.commands
    rates = np.abs(np.diff(commands, axis=0)) / plan.sample_time
    assert commands.min() >= limits.min_pressure - 1e-6
    assert commands.max() <= limits.max_pressure + 1e-6
    assert rates.max() <= limits.max_rate * (1.0 + 1e-9)
    assert np.all(commands[0] == limits.min_pressure)
    assert commands[-1] == pytest.approx(limits.min_pressure)


def test_a_plan_keeps_pressure_rate_and_travel(regulator_plan, arm_plan):
    keeps(regulator_plan)
    keeps(arm_plan)
    angle = response(JOINT, arm_plan.commands, "angle")
    low, high = ARM_LIMITS.travel["angle"]
    assert low <= angle.min() < angle.max() <= high
    assert regulator_plan.times[-1] <= 20.0


@given(
    st.floats(0.0, 2e5),
    st.floats(1e3, 5e5),
    st.floats(1e4, 1e8),
    st.integers(0, 1000),
)
def test_limited_commands_and_ramps_keep_every_limit(low, span, rate, seed):
    limits = SignalLimits(low + span, low, rate)
    rng = np.random.default_rng(seed)
    start = rng.uniform(low, low + span, 2)
    wanted = rng.normal(low, 2.0 * span, (40, 2))
    end = rng.uniform(low, low + span, 2)
    for rows in (limits.limited(wanted, start, STEP), limits.ramp(start, end, 0.05, STEP)):
        path = np.concatenate([start[None], rows])
        assert path.min() >= low - 1e-6
        assert path.max() <= low + span + 1e-6
        assert np.abs(np.diff(path, axis=0)).max() <= rate * STEP * (1.0 + 1e-9) + 1e-9
    assert limits.ramp(start, end, 0.05, STEP)[-1] == pytest.approx(end)


def test_a_signal_that_would_leave_the_travel_is_played_smaller():
    narrow = dataclasses.replace(ARM_LIMITS, travel={"angle": (-0.15, 0.2)})
    plan = plan_signals(JOINT, narrow, duration=12.0, sample_time=STEP, determine=ARM_WEAK[:1])
    low, high = plan.motions["angle"]
    assert -0.15 <= low < high <= 0.2


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"duration": 2.0}, "Give a longer duration"),
        ({"sample_time": 0.1}, "at most 0.02 s"),
        ({"determine": ("circuit.bend",)}, "has no parameter 'circuit.bend'"),
        ({"limits": SignalLimits(4e5, 0.0, 1e6, {"angle": (-1.0, 1.0)})}, "limits of angle"),
    ],
)
def test_what_cannot_be_planned_is_refused(change, text):
    arguments = {"limits": LIMITS, "duration": 15.0, **change}
    limits = arguments.pop("limits")
    with pytest.raises(ParameterError, match=text):
        plan_signals(REGULATOR, limits, **arguments)


def test_limits_without_a_range_are_refused():
    with pytest.raises(ParameterError, match="below the maximum"):
        SignalLimits(1e5, 2e5)
    with pytest.raises(ParameterError, match="must be positive"):
        SignalLimits(1e5, 0.0, 0.0)
    with pytest.raises(ParameterError, match="lower end first"):
        SignalLimits(1e5, travel={"angle": (1.0, 0.0)})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The files of the command for the regulator of the library."""
    out = tmp_path_factory.mktemp("plan") / "next"
    result = airmuscle(
        "plan",
        "vessel-smc-itv2050",
        "--max-pressure",
        "4.5 bar",
        "--max-rate",
        "30 bar/s",
        "--duration",
        "12 s",
        "--sample-rate",
        "100 Hz",
        "--out",
        str(out),
        "--json",
    )
    assert result.exit_code == 0, result.output
    assert "signals" in json.loads(result.stdout)
    return out


def test_all_files_of_a_plan_contain_the_same_commands(folder):
    table = read_csv(folder / "plan.csv")
    namespace = {"__file__": str(folder / "plan.py"), "__name__": "plan"}
    exec((folder / "plan.py").read_text(), namespace)
    rows = list(namespace["signals"]())
    assert [time for time, _ in rows] == pytest.approx(table["time"].tolist())
    assert [values[0] for _, values in rows] == pytest.approx(table["setpoint"].tolist())
    program = folder / "print.c"
    program.write_text(
        '#include <stdio.h>\n#include "plan.h"\nint main(void) {\n'
        'for (int i = 0; i < PLAN_ROWS; i++) printf("%.9g\\n", (double)plan_pressure_pa[i][0]);\n'
        "return 0; }\n"
    )
    binary = folder / "print"
    subprocess.run(["cc", "-std=c99", "-Wall", "-Werror", program, "-o", binary], check=True)
    printed = subprocess.run([binary], capture_output=True, text=True, check=True).stdout
    assert np.array(printed.split(), float) == pytest.approx(table["setpoint"], abs=0.1)


def test_the_generator_vents_after_every_exception(folder):
    namespace = {"__file__": str(folder / "plan.py"), "__name__": "plan"}
    exec((folder / "plan.py").read_text(), namespace)
    now = [0.0]
    for row in (0, 1, 40):
        calls = []

        def write(pressures, row=row, calls=calls):
            calls.append(pressures)
            if len(calls) > row:
                raise KeyboardInterrupt

        stopped = []
        with pytest.raises(KeyboardInterrupt):
            namespace["play"](
                write,
                lambda: None,
                lambda stopped=stopped: stopped.append(True),
                clock=lambda: now[0],
                pause=lambda wait: now.__setitem__(0, now[0] + wait),
            )
        assert stopped == [True]


def test_the_command_names_what_is_missing():
    result = airmuscle("plan", "vessel-smc-itv2050")
    assert result.exit_code == 2
    assert "--max-pressure" in result.output
    result = airmuscle("plan", "joint-dmsp-20-regulators", "--max-pressure", "4 bar")
    assert result.exit_code == 2
    assert "--min-angle" in result.output
    pressure = ("--max-pressure", "4 bar")
    result = airmuscle("plan", "vessel-smc-itv2050", *pressure, "--duration", "5 s")
    assert "--duration is 5 s; allowed range: 10 to 3600 s." in result.output
