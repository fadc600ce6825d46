"""Tab Joint of the studio: what its scripts compute in the page is what the library computes."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from studio_pages import run_script, scripts
from widths import widened

from airmuscle.core import with_parameters
from airmuscle.design import STANDARD_TASKS
from airmuscle.engine import ControlLoop, Problem, SampledSignal, Schedule, solve
from airmuscle.files.library import plant_tables
from airmuscle.files.scenario import build_scenario
from airmuscle.outlets.studio import (
    joint_controllers,
    joint_tables,
    sheet_of_joint,
    statics_within_valves,
)
from airmuscle.physics import linearise

pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
SCRIPTS = ("plant-start", "plant-run", "joint-loop", "joint-statics", "joint-linear")
BEGIN = """
const {sheet, cases} = DATA, run = new airmuscle.PlantRun(sheet), statics = new airmuscle.JointStatics(run), linear = new airmuscle.JointLinear(statics);
const lawOf = (key) => new airmuscle.PrintedLaw(sheet, sheet.controllers.find((row) => row.key === key));
"""
FAST = ("joint-dmsp-20-regulators", "joint-dmsp-20-proportional")
SLOW_ONES = (
    "joint-dmsp-20-matrix",
    "joint-dmsp-20-itv2050",
    "joint-sam-30x290",
    "joint-straight-fibre",
)
JOINTS = [*FAST, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW_ONES)]


@functools.cache
def joint(name):
    """The sheet of a joint with its program, and its plant."""
    sheet = sheet_of_joint(name)
    tables, location = plant_tables(name)
    return (
        {k: v for k, v in sheet.items() if k != "script"},
        sheet["script"],
        build_scenario(joint_tables(tables), location).plant,
    )


def in_page(name, code, cases, folder):
    sheet, script, _ = joint(name)
    return run_script(
        scripts("numbers") + script + scripts(*SCRIPTS) + BEGIN + code,
        {"sheet": sheet, "cases": cases},
        folder,
    )


LOOP = """
console.log(JSON.stringify(cases.map(({key, task, gain, sampleTime, share, beside}) => {
  const law = lawOf(key), limits = statics.limits(0.1), point = statics.workingPoint(0.1, 0.5 * (limits[0] + limits[1])), times = airmuscle.loopInstants(0, task.duration, sampleTime);
  for (const {path} of law.row.gains) law.set(path, gain * law.get(path));
  if (law.row.bias) law.set(law.row.bias, 0.5 * (point.first - point.second));
  const setpoints = airmuscle.taskSignals(statics, task, point, share, times.slice(0, -1), { ahead: true, pressures: true });
  const {state} = statics.rest(point.angle, point.first, point.second), torque = task.torque.map(([t, v]) => [t, share * v]);
  run.program.states.forEach((name, i) => { if (/(air_mass|internal_energy)$/.test(name)) state[i] *= name.startsWith("left.") ? 1 + beside : 1 - beside; });
  const result = airmuscle.runLoop(run, law, { duration: task.duration, sampleTime, state, setpoints, torque, torqueInput: "external_torque" });
  return { ...result, point, times, setpoints: Object.fromEntries(Object.entries(setpoints).map(([k, v]) => [k, Array.from(v)])), state: Array.from(state), values: Array.from(law.values), torque };
})));
"""


def short(name, duration):
    task = next(task for task in STANDARD_TASKS if task.name == name)
    return next(row for row in joint(FAST[0])[0]["tasks"] if row["name"] == name) | {
        "duration": min(duration, task.duration)
    }


def laws_of(plant):
    return {each.key: each for each in joint_controllers(plant, statics_within_valves(plant))}


def run_of(plant, law, case, page):
    """The recording of the library at the instants of the page."""
    points = {
        n: list(zip(page["times"], page["setpoints"][n], strict=False)) for n in law.setpoints
    }
    torque = (
        SampledSignal({"external_torque": page["torque"]})
        if page["torque"]
        else Schedule({"external_torque": ()})
    )
    loop = ControlLoop(law, case["sampleTime"], SampledSignal(points), torque)
    start = dict(zip((s.name for s in plant.states), page["state"], strict=True))
    problem = Problem(plant, loop, case["task"]["duration"], start, output_times=case["sampleTime"])
    recording = solve(problem).raise_if_incomplete().recording
    rows = np.searchsorted(recording["time"], np.array(page["times"]) - 1e-9)
    return {column: recording[column][rows] for column in recording}


def cases_of(name, beside):
    keys = [row["key"] for row in joint(name)[0]["controllers"]]
    tasks = [
        short("step", 0.6),
        short("sine 1 Hz", 0.5),
        short("minimum jerk", 0.7),
        short("load change", 1.7),
        short("ramp", 0.5),
    ]
    return [
        {"key": key, "task": task, "gain": 0.8, "sampleTime": 0.005, "share": 0.4, "beside": beside}
        for key, task in zip(keys, tasks, strict=True)
    ]


@pytest.mark.parametrize(
    "name", widened((*FAST, *SLOW_ONES), lambda name: name.endswith("proportional"))
)
def test_a_loop_of_the_page_is_that_of_the_library(name, tmp_path):
    """Every controller, with other gains than those of the sheet, to 1e-9 of the greatest value of
    each column.

    The run begins beside the equilibrium: there the valves are at a kink, where rounding decides on
    the side.
    """
    cases = cases_of(name, 2e-3)
    plant = joint(name)[2]
    laws = laws_of(plant)
    for case, page in zip(cases, in_page(name, LOOP, cases, tmp_path), strict=True):
        wanted = run_of(plant, with_parameters(laws[case["key"]].law, page["values"]), case, page)
        assert page["status"] == 0
        assert np.ptp(page["columns"]["angle"]) > 0.01
        for column, values in page["columns"].items():
            error = np.abs(np.array(values) - wanted[column]).max()
            assert error <= 1e-9 * np.abs(wanted[column]).max() + 1e-15, (case["key"], column)


def test_a_loop_that_begins_at_rest_agrees_to_the_tolerance_of_the_integrator(tmp_path):
    cases = cases_of(FAST[0], 0.0)
    plant = joint(FAST[0])[2]
    laws = laws_of(plant)
    for case, page in zip(cases, in_page(FAST[0], LOOP, cases, tmp_path), strict=True):
        wanted = run_of(plant, with_parameters(laws[case["key"]].law, page["values"]), case, page)[
            "angle"
        ]
        assert (
            np.abs(np.array(page["columns"]["angle"]) - wanted).max() <= 1e-6 * np.abs(wanted).max()
        )


STATICS = """
console.log(JSON.stringify(cases.map(([angle, share]) => {
  const [least, greatest] = statics.limits(angle), point = statics.workingPoint(angle, least + share * (greatest - least)), {state, inputs} = statics.rest(point.angle, point.first, point.second);
  const at = statics.at(point.angle, point.first, point.second), outside = statics.workingPoint(9, 1e6);
  return {point, at, state: Array.from(state), inputs: Array.from(inputs), limits: [least, greatest], outside};
})));
"""


@pytest.mark.parametrize("name", JOINTS)
def test_working_points_are_those_of_the_statics_of_the_library(name, tmp_path):
    """Pressures, both stiffnesses and the state at rest; a point beyond the region is moved into
    it.
    """
    plant = joint(name)[2]
    statics = statics_within_valves(plant)
    cases = [(0.0, 0.5), (0.2, 0.3), (-0.3, 0.7)]
    for (angle, _), page in zip(cases, in_page(name, STATICS, cases, tmp_path), strict=True):
        point = page["point"]
        found = statics.pressures(angle, point["stiffness"])
        solution = int(np.nanargmin(np.abs(found.pressures[0, :, 0] - point["first"])))
        np.testing.assert_allclose(
            [point["first"], point["second"]], found.pressures[0, solution], rtol=1e-9
        )
        assert page["at"]["shut_valves"] == pytest.approx(found.shut_valves[0, solution], rel=1e-9)
        limits = [float(limit[0]) for limit in statics.stiffness_limits(angle)]
        np.testing.assert_allclose(page["limits"], limits, rtol=2e-2)
        equal = plant.state_at(
            pressure=(point["first"], point["second"]), angle=angle, angular_speed=0.0
        )
        for variable, value in zip(plant.states, page["state"], strict=True):
            assert value == pytest.approx(
                equal[variable.name], rel=1e-9, abs=1e-9 * variable.nominal
            ), variable.name
        low, high = statics.pressure_range
        assert low <= page["outside"]["first"] <= high
        assert low <= page["outside"]["second"] <= high


LINEAR = """
console.log(JSON.stringify(cases.map(({key, sampleTime, frequencies}) => {
  const law = lawOf(key), point = statics.workingPoint(0.1, 40), operating = linear.operatingPoint(point), table = (rows) => rows.map((row) => Array.from(row));
  const {rates, A, B, C} = linear.matrices(operating.state, operating.inputs), k = linear.lawMatrices(law, point, operating, sampleTime), loop = linear.openLoop(law, point, sampleTime);
  return {state: Array.from(operating.state), inputs: Array.from(operating.inputs), rates: Array.from(rates), A: table(A), B: table(B), C: table(C), law: table(k.table), response: linear.response(loop, frequencies, sampleTime)};
})));
"""


def open_loop(page, plant, law, sampleTime, frequencies, measured):
    """The response from the measured angle to the angle, negated, computed densely with SciPy."""
    from scipy.linalg import expm

    A, B, C, D = (np.array(page[key]) for key in ("A", "B", "C", "law"))
    own = [measured.index(n) for n in law.measured_columns]
    columns = [plant.inputs.index(n) for n in law.inputs]
    n = len(A)
    m = len(columns)
    y = len(own)
    block = np.zeros((n + m, n + m))
    block[:n, :n] = A * sampleTime
    block[:n, n:] = B[:, columns] * sampleTime
    step = expm(block)
    phi = step[:n, :n]
    gamma = step[:n, n:]
    rows = C[own]
    angle = list(law.measured_columns).index("angle")
    others = rows.copy()
    others[angle] = 0.0
    Dy = D[:, :y]
    Dm = D[:, y:]
    F = np.block([[phi + gamma @ Dy[:m] @ others, gamma @ Dm[:m]], [Dy[m:] @ others, Dm[m:]]])
    G = -np.concatenate([gamma @ Dy[:m, angle], Dy[m:, angle]])
    H = np.concatenate([rows[angle], np.zeros(D.shape[1] - y)])
    z = np.exp(2j * np.pi * np.array(frequencies) * sampleTime)
    return np.array([H @ np.linalg.solve(each * np.eye(len(F)) - F, G) for each in z])


@pytest.mark.parametrize("name", JOINTS)
def test_the_frequency_response_of_the_page_follows_from_the_linearisation_of_the_library(
    name, tmp_path
):
    """A, B and C to 1e-12 of their greatest entries in each row, the response to 1e-6 of that with
    SciPy.
    """
    sheet, _, plant = joint(name)
    frequencies = [0.2, 1.0, 5.0, 20.0, 60.0]
    cases = [
        {"key": row["key"], "sampleTime": 0.005, "frequencies": frequencies}
        for row in sheet["controllers"]
    ]
    laws = laws_of(plant)
    for case, page in zip(cases, in_page(name, LINEAR, cases, tmp_path), strict=True):
        names = [s.name for s in plant.states]
        model = linearise(
            plant,
            dict(zip(names, page["state"], strict=True)),
            dict(zip(plant.inputs, page["inputs"], strict=True)),
        )
        wanted = model.select(outputs=sheet["measured"])
        for key in ("A", "B", "C"):
            rows = getattr(wanted, key)
            scale = np.abs(rows).max(axis=1, keepdims=True) + 1e-300
            assert np.abs((np.array(page[key]) - rows) / scale).max() <= 1e-12, (case["key"], key)
        law = laws[case["key"]].averaged
        found = np.array(page["response"]) @ [1.0, 1.0j]
        np.testing.assert_allclose(
            found, open_loop(page, plant, law, 0.005, frequencies, sheet["measured"]), rtol=1e-6
        )
