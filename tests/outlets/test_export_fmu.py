"""FMUs: two checkers accept them, and FMPy, a simulator of others, runs them to the results of the
library.

The error of a column is the greatest difference divided by the greatest value of the column; rows
at a jump of an input are left out, because programs differ in the side of the jump that they store.

In Co-Simulation the error is at most 1e-7, or that of the library at the same tolerance, which
contacts amplify. In Model Exchange it is at most 1e-6, or the change of the result of CVode, the
integrator of the importer, from ten times its tolerance to its tolerance: the absolute tolerance of
a position times the stiffness of a contact is an error of its force.
"""

from __future__ import annotations

import hashlib
import itertools
import re
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import plants
import printed
import pytest
from command_line import airmuscle

from airmuscle.control import PID
from airmuscle.engine import ControlLoop, Problem, Rodas4, RungeKutta4, Schedule, solve
from airmuscle.errors import FileError, ParameterError
from airmuscle.outlets import write_controller_fmu, write_fmu
from airmuscle.outlets.export import compiler
from airmuscle.outlets.export.fmi_variables import BASE, base_powers
from airmuscle.physics import ValidityRange

pytestmark = pytest.mark.tool
JUMPS = ((0.0, 0.0), (0.1, 0.5), (0.3, 0.1), (0.4, 0.4))
SOME = ("dmsp-20-300", "overlap")
PORTS = "load in another program"
"""A plant whose shortening is an input: it cannot jump as the inputs do here."""
ALL = [
    pytest.param(name, marks=() if name in SOME else pytest.mark.slow)
    for name in plants.EXAMPLES
    if name != PORTS
]


def problem_of(name="dmsp-20-300", integrator=Rodas4(1e-9), schedule=JUMPS):
    plant = plants.EXAMPLES[name]
    inputs = Schedule(dict.fromkeys(plant.inputs, schedule) if schedule else {})
    places = (
        {"angle": 0.1} if name == "joint with stops" else {}
    )  # at rest it is symmetric: all columns are rounding
    state = plant.state_at(pressure=1e5, **places)
    return Problem(plant, inputs, 0.5, state, integrator=integrator, output_times=0.01)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """The path of the FMU of a plant, built once."""
    folder = tmp_path_factory.mktemp("fmu")
    built = {}

    def path(name, fmi):
        printed.require("gcc")
        if (name, fmi) not in built:
            file = folder / f"{fmi}_{hashlib.sha1(name.encode()).hexdigest()[:8]}.fmu"
            written = write_fmu(problem_of(name), file, fmi=fmi, name="plant")
            assert written.remark == ""
            built[name, fmi] = written.path
        return built[name, fmi]

    return path


def signal_of(inputs):
    """The schedule as the table that FMPy reads: two rows at a jump."""
    rows = [(0.0, 0.0)]
    for (_, before), (time, value) in itertools.pairwise(JUMPS):
        rows += [(time, before), (time, value)]
    rows.append((9.0, JUMPS[-1][1]))
    return np.array(
        [(t, *(v,) * len(inputs)) for t, v in rows], dtype=[(n, float) for n in ("time", *inputs)]
    )


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", ALL)
def test_fmpy_finds_no_error_and_reproduces_the_run(name, fmi, fmus):
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    validation = pytest.importorskip("fmpy.validation", reason="needs the packages of fmpy")
    path, problem = fmus(name, fmi), problem_of(name, Rodas4(1e-10))
    assert validation.validate_fmu(str(path)) == []
    expected = solve(problem).recording
    inputs = problem.system.inputs
    if (
        expected["time"][-1] < 0.5
    ):  # the run of the library ends early, which the FMU reports as well
        with pytest.raises(Exception, match=r"fmi[23]DoStep failed"):
            fmpy.simulate_fmu(
                str(path), fmi_type="CoSimulation", stop_time=0.5, input=signal_of(inputs)
            )
        return
    columns = [c for c in expected if c not in ("time", *inputs)]
    clear = ~np.isin(np.round(expected["time"], 6), [t for t, _ in JUMPS])
    own = solve(problem_of(name)).recording

    def run_of(kind, tolerance):
        run = fmpy.simulate_fmu(
            str(path),
            fmi_type=kind,
            stop_time=0.5,
            output_interval=0.01,
            relative_tolerance=tolerance,
            output=columns,
            input=signal_of(inputs) if inputs else None,
            record_events=True,
        )
        rows = [np.flatnonzero(np.abs(run["time"] - t) < 1e-9)[-1] for t in expected["time"]]
        return {column: run[column][rows] for column in columns}

    def difference(a, b, column):
        return np.abs(a[column] - b[column])[clear].max() / (np.abs(expected[column]).max() or 1.0)

    by_slave = run_of("CoSimulation", 1e-9)
    by_cvode = run_of("ModelExchange", 1e-9)
    coarser = None
    for column in columns:
        bar = max(1e-7, difference(own, expected, column))
        assert difference(by_slave, expected, column) <= bar, column
        if difference(by_cvode, expected, column) > 1e-6:
            coarser = coarser or run_of("ModelExchange", 1e-8)
            assert difference(by_cvode, expected, column) <= difference(
                coarser, by_cvode, column
            ), column


def test_the_integrator_of_the_importer_stops_where_a_contact_begins_and_ends(fmus):
    """Without event indicators it would stop at the jumps of the inputs only."""
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    name = "pulley with stops"
    run = fmpy.simulate_fmu(
        str(fmus(name, 3)),
        fmi_type="ModelExchange",
        stop_time=0.3,
        output_interval=0.01,
        relative_tolerance=1e-7,
        output=["position", "speed"],
        input=signal_of(plants.EXAMPLES[name].inputs),
        record_events=True,
    )
    at_events = run[np.abs(100 * run["time"] - np.round(100 * run["time"])) > 1e-6]
    at_stop = at_events[
        np.abs(at_events["position"] - plants.EXAMPLES[name].mechanism.upper_stop) <= 1e-9
    ]
    assert (at_stop["speed"] < 0).any()
    assert (at_stop["speed"] > 0).any()


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_second_checker_finds_no_error(fmi, fmus):
    pytest.importorskip(
        "fmu_manipulation_toolbox", reason="needs the package fmu-manipulation-toolbox"
    )
    script = (
        "import sys; from fmu_manipulation_toolbox.cli.fmutool import fmutool; sys.exit(fmutool())"
    )
    command = [sys.executable, "-c", script, "-input", str(fmus("overlap", fmi)), "-check"]
    done = subprocess.run(command, capture_output=True, text=True)
    text = done.stdout + done.stderr
    if "ModuleNotFoundError" in text:
        pytest.skip("needs the packages of fmu-manipulation-toolbox")
    assert f"compliant with FMI-{fmi}.0" in text
    assert f"No semantic error against the FMI-{fmi} standard" in text


class Instance:
    """An FMI 3 instance for Co-Simulation, through FMPy; messages are collected."""

    def __init__(self, path, folder, logging=True, tolerance=None, start=None):
        fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
        from fmpy.fmi3 import FMU3Slave

        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
        self.about = fmpy.read_model_description(str(path), validate=False)
        self.number = {v.name: v.valueReference for v in self.about.modelVariables}
        self.log = []
        self.fmu = FMU3Slave(
            guid=self.about.guid,
            unzipDirectory=str(folder),
            instanceName="test",
            modelIdentifier=self.about.coSimulation.modelIdentifier,
        )
        log = lambda e, status, category, text: self.log.append((status, text.decode()))  # noqa: E731
        self.fmu.instantiate(loggingOn=logging, logMessage=log)
        self.set(**(start or {}))
        self.fmu.enterInitializationMode(tolerance=tolerance, startTime=0.0)

    def get(self, *names):
        return np.array(self.fmu.getFloat64([self.number[n] for n in names]))

    def set(self, **values):
        self.fmu.setFloat64(
            [self.number[n.replace("__", ".")] for n in values], list(values.values())
        )

    def step(self, t, h, count=1):
        for k in range(count):
            self.fmu.doStep(currentCommunicationPoint=t + k * h, communicationStepSize=h)


@pytest.fixture
def instance(fmus, tmp_path):
    made = Instance(fmus("dmsp-20-300", 3), tmp_path / "unzipped")
    made.fmu.exitInitializationMode()
    yield made
    made.fmu.freeInstance()


def test_derivatives_are_those_of_the_rates(instance):
    """Directional derivatives equal central differences, and the adjoint ones their transposed."""
    instance.set(fill=0.3)
    n = instance.number
    rates = [n[v.name] for v in instance.about.modelVariables if v.derivative is not None]
    outputs = [n["pressure"], n["force"]]
    knowns = [n["air_mass"], n["position"], n["fill"]]
    unknowns = [*rates, *outputs]
    table = np.array(
        [instance.fmu.getDirectionalDerivative(unknowns, knowns, list(row)) for row in np.eye(3)]
    ).T
    for k, known in enumerate(knowns):
        (value,) = instance.fmu.getFloat64([known])
        step = 1e-6 * max(abs(value), 1e-3)
        sides = []
        for sign in (1, -1):
            instance.fmu.setFloat64([known], [value + sign * step])
            sides.append(np.array(instance.fmu.getFloat64(unknowns)))
        instance.fmu.setFloat64([known], [value])
        difference = (sides[0] - sides[1]) / (2 * step)
        assert np.abs(table[:, k] - difference).max() <= 1e-5 * np.abs(table[:, k]).max()
    for k in range(len(unknowns)):
        seed = [float(i == k) for i in range(len(unknowns))]
        found = instance.fmu.getAdjointDerivative(unknowns, knowns, seed, len(knowns))
        assert found == pytest.approx(list(table[k]), rel=1e-14)


def test_a_stored_state_is_continued_bit_by_bit(instance):
    instance.set(fill=1.0)
    instance.step(0.0, 0.01, 5)
    stored = instance.fmu.getFMUState()
    text = instance.fmu.serializeFMUState(stored)
    instance.step(0.05, 0.01, 5)
    end = instance.get("air_mass", "position", "speed", "time")
    instance.step(0.1, 0.02, 3)
    for state in (stored, instance.fmu.deserializeFMUState(text)):
        instance.fmu.setFMUState(state)
        instance.step(0.05, 0.01, 5)
        assert (instance.get("air_mass", "position", "speed", "time") == end).all()
        instance.fmu.freeFMUState(state)


def test_a_parameter_can_be_tuned_between_steps(instance):
    assert (
        instance.get("parameters.mechanism.mass")[0]
        == plants.EXAMPLES["dmsp-20-300"].mechanism.mass
    )
    before = instance.get("der(speed)")[0]
    instance.set(parameters__mechanism__mass=2 * instance.get("parameters.mechanism.mass")[0])
    assert instance.get("der(speed)")[0] != before
    instance.step(0.0, 0.01)


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_pressure_at_the_start_gives_the_air_mass(fmi, fmus):
    """The other states are kept; the run is that of the library from this state."""
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    problem = problem_of()
    plant = problem.system
    state = dict(problem.initial_state)
    state["air_mass"] *= (3e5 + plant.ambient.pressure) / (
        1e5 + plant.ambient.pressure
    )  # an ideal gas
    expected = solve(replace(problem, initial_state=state)).recording
    options = {"start_values": {"start.pressure": 3e5}, "stop_time": 0.5, "output_interval": 0.01}
    run = fmpy.simulate_fmu(
        str(fmus("dmsp-20-300", fmi)),
        output=["pressure", "position"],
        fmi_type="CoSimulation",
        input=signal_of(problem.system.inputs),
        relative_tolerance=1e-9,
        **options,
    )
    assert run["pressure"][0] == pytest.approx(3e5, abs=1e-3)
    rows = [np.flatnonzero(np.abs(run["time"] - t) < 1e-9)[-1] for t in expected["time"]]
    for column in ("pressure", "position"):
        clear = ~np.isin(np.round(expected["time"], 6), [t for t, _ in JUMPS])
        assert (
            np.abs(run[column][rows] - expected[column])[clear].max()
            <= 1e-7 * np.abs(expected[column]).max()
        )


def test_a_pressure_at_the_start_is_refused_after_it(instance):
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        instance.set(start__pressure=2e5)
    assert any("until the end of the initialization only" in text for _, text in instance.log)
    assert instance.get("start.pressure") == pytest.approx(1e5, abs=1e-3)


def test_terminals_are_valid_and_those_of_a_plant_and_its_controller_match(fmus, tmp_path):
    etree = pytest.importorskip("lxml.etree", reason="needs the package lxml")
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    schema = etree.XMLSchema(
        file=str(Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd")
    )
    loop = ControlLoop(PID("pressure", "fill", 1e-5), 0.01, Schedule({"pressure": ((0.0, 2e5),)}))
    problem = replace(problem_of(), input=loop)
    controller = write_controller_fmu(
        problem, tmp_path / "controller.fmu", name="controller", binary=False
    ).path
    members = []
    for path in (fmus("dmsp-20-300", 3), controller):
        with zipfile.ZipFile(path) as file:
            tree = etree.fromstring(file.read("terminalsAndIcons/terminalsAndIcons.xml"))
        schema.assertValid(tree)
        names = {e.get("name"): {m.get("memberName") for m in e} for e in tree.iter("Terminal")}
        described = {v.name for v in fmpy.read_model_description(str(path)).modelVariables}
        assert set().union(*names.values()) <= described
        members.append(names)
    plant, control = members
    assert plant["commands"] >= control["commands"] == {"fill"}
    assert plant["measurements"] >= control["measurements"] == {"pressure"}
    assert control["setpoints"] == {"setpoint.pressure"}
    with zipfile.ZipFile(fmus("dmsp-20-300", 2)) as file:
        assert not [name for name in file.namelist() if "terminals" in name]


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_reference_results_are_met_with_the_inputs_beside_them(fmi, fmus, tmp_path):
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    path = fmus("overlap", fmi)
    extra = "extra/org.fmi-standard.fmi-ls-ref"
    with zipfile.ZipFile(path) as file:
        file.extractall(tmp_path)
    manifest = ElementTree.parse(tmp_path / extra / "fmi-ls-manifest.xml").getroot()
    assert (
        manifest.get("{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name")
        == "org.fmi-standard.fmi-ls-ref"
    )
    sources = {e.get("role"): e.get("source") for e in manifest}
    assert sources == {"experiment": "run.exp", "testcase": "inputs.csv", "result": "results.csv"}
    (experiment,) = ElementTree.parse(tmp_path / extra / "run.exp").getroot()
    span, *tables = experiment
    assert [e.tag for e in experiment] == ["TransientSimulation", "Stimuli", "References"]
    inputs, results = (
        np.genfromtxt(tmp_path / extra / e.get("source"), delimiter=",", names=True, deletechars="")
        for e in tables
    )
    columns = [name for name in results.dtype.names if name != "time"]
    assert float(experiment.get("tolerance")) == 1e-9
    run = fmpy.simulate_fmu(
        str(path),
        fmi_type="CoSimulation",
        start_time=float(span.get("startTime")),
        stop_time=float(span.get("stopTime")),
        relative_tolerance=float(experiment.get("tolerance")),
        output_interval=0.01,
        input=inputs,
        output=columns,
        record_events=True,
    )
    rows = [np.flatnonzero(np.abs(run["time"] - t) < 1e-9)[-1] for t in results["time"]]
    clear = ~np.isin(np.round(results["time"], 6), [t for t, _ in JUMPS])
    for column in columns:
        assert (
            np.abs(run[column][rows] - results[column])[clear].max()
            <= 1e-7 * np.abs(results[column]).max()
        ), column


def test_the_log_states_once_what_left_its_validity_range(tmp_path):
    printed.require("gcc")
    plant = plants.EXAMPLES["dmsp-20-300"]
    limited = replace(plant.muscle, validity_range=ValidityRange(0.0, 1.5e5, 0.0, 0.3))
    problem = replace(problem_of(), system=replace(plant, muscle=limited))
    instance = Instance(
        write_fmu(problem, tmp_path / "a.fmu", name="plant").path, tmp_path / "unzipped"
    )
    instance.fmu.exitInitializationMode()
    instance.set(fill=1.0)
    instance.step(0.0, 0.01, 200)
    instance.fmu.freeInstance()
    (warning,) = [text for status, text in instance.log if status == 1]
    assert "outside the validity range of its characteristic in pressure (0 to 150 kPa)" in warning
    assert re.search(r"extrapolated \(1[5-9]\d{4}(\.\d+)? at 0\.\d+ s\)$", warning)


def test_an_input_outside_its_range_is_limited_and_reported_once(instance):
    """The input keeps the number that was set; the plant has that of the limit."""
    before = instance.fmu.getFMUState()
    pressures = {}
    for opening in (1.0, 1.5):
        instance.fmu.setFMUState(before)
        instance.set(fill=opening)
        instance.step(0.0, 0.001, 20)
        pressures[opening] = instance.get("pressure")
        assert instance.get("fill") == opening
    assert pressures[1.5] == pressures[1.0]
    (text,) = [text for _, text in instance.log if "the input fill" in text]
    assert "the input fill is limited to its range, 0 to 1 (" in text


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("fill", float("nan")),
        ("pressure", 1.0),
        ("relative_tolerance", -1.0),
        ("relative_tolerance", 1.0),
    ],
)
def test_what_cannot_be_set_is_refused(instance, name, value):
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        instance.set(**{name: value})
    assert any("cannot be set, or its value is not finite" in text for _, text in instance.log)


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_tolerance_of_the_scenario_is_that_of_a_run(fmi, fmus):
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    for given, expected in (
        ({}, 1e-9),
        ({"relative_tolerance": 1e-7}, 1e-7),
        ({"start_values": {"relative_tolerance": 1e-10}}, 1e-10),
    ):
        result = fmpy.simulate_fmu(
            str(fmus("dmsp-20-300", fmi)),
            fmi_type="CoSimulation",
            stop_time=0.02,
            output=["relative_tolerance"],
            **given,
        )
        assert result["relative_tolerance"][-1] == expected, given


@pytest.mark.parametrize("value", [-5.0, 0.0, 1e9])
def test_a_parameter_beyond_its_bounds_is_refused(instance, value):
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        instance.set(parameters__mechanism__mass=value)
    assert re.search(
        r"mechanism\.mass is .*; allowed are 0\.0001 to 100000 kg", instance.log[-1][1]
    )


def test_after_a_step_that_failed_the_instance_stands_where_it_stood(instance):
    right = instance.get("air_mass")[0]
    instance.step(0.0, 0.01)
    instance.set(air_mass=-1e-3)
    with pytest.raises(Exception, match="fmi3DoStep"):
        instance.step(0.01, 0.01)
    assert instance.get("time", "air_mass").tolist() == [0.01, -1e-3]
    instance.set(air_mass=right)
    instance.step(0.01, 0.01)
    assert instance.get("time")[0] == 0.02


def test_only_parameters_that_act_on_the_run_are_tunable(tmp_path):
    plant = plants.EXAMPLES["dmsp-20-300"]
    limited = replace(plant.muscle, validity_range=ValidityRange(0.0, 1.5e5, 0.0, 0.3))
    write_fmu(
        replace(problem_of(), system=replace(plant, muscle=limited)),
        tmp_path / "a.fmu",
        binary=False,
    )
    with zipfile.ZipFile(tmp_path / "a.fmu") as archive:
        text = archive.read("modelDescription.xml").decode()
    names = re.findall(r'name="parameters\.([^"]+)"', text)
    assert "mechanism.mass" in names
    assert "muscle.validity_range.max_contraction" in names, "beyond it the muscle is slack"
    assert not [name for name in names if "ratings" in name]


def test_warnings_are_logged_on_request_only(fmus, tmp_path):
    quiet = Instance(fmus("dmsp-20-300", 3), tmp_path / "unzipped", logging=False)
    quiet.fmu.exitInitializationMode()
    quiet.set(fill=1.5)
    quiet.step(0.0, 0.001)
    quiet.fmu.freeInstance()
    assert quiet.log == []


def test_units_are_those_that_importers_know(fmus):
    with zipfile.ZipFile(fmus("dmsp-20-300", 3)) as archive:
        text = archive.read("modelDescription.xml").decode()
    assert re.search(r'name="der\(speed\)"[^>]* unit="m/s2"', text)
    assert re.search(r'name="pressure"[^>]* description="gauge pressure in the muscle"', text)
    assert "Pa(a)" not in text
    assert re.search(r'name="der\(air_mass\)"[^>]* unit="kg/s"', text)
    assert 'tolerance="1e-09"' in text


def test_a_state_of_another_fmu_is_refused(instance):
    with pytest.raises(Exception, match="fmi3DeserializeFMUState"):
        instance.fmu.deserializeFMUState(b"x" * 100)
    assert any("that of another FMU" in text for _, text in instance.log)


def test_a_step_that_does_not_continue_the_last_is_refused(instance):
    for start, size in ((0.5, 0.1), (0.0, -0.1), (0.0, 0.0), (0.0, float("inf"))):
        with pytest.raises(Exception, match="fmi3DoStep"):
            instance.step(start, size)
    assert any("must begin where the last one ended" in text for _, text in instance.log)


def test_a_wrong_token_is_refused(fmus, tmp_path):
    fmi3 = pytest.importorskip("fmpy.fmi3", reason="needs the package fmpy")
    with zipfile.ZipFile(fmus("dmsp-20-300", 3)) as archive:
        archive.extractall(tmp_path)
    fmu = fmi3.FMU3Slave(
        guid="{0}", unzipDirectory=str(tmp_path), instanceName="test", modelIdentifier="plant"
    )
    with pytest.raises(Exception, match="instantiate"):
        fmu.instantiate()


def test_the_sources_cause_no_warning_and_export_only_fmi_functions(fmus, tmp_path):
    for fmi in (2, 3):
        with zipfile.ZipFile(fmus("overlap", fmi)) as archive:
            archive.extractall(tmp_path / str(fmi))
        command = [
            "gcc",
            "-std=c99",
            "-pedantic",
            "-Wall",
            "-Wextra",
            "-Wshadow",
            "-Werror",
            "-fsyntax-only",
        ]
        sources = sorted((tmp_path / str(fmi) / "sources").glob("*.c"))
        done = subprocess.run([*command, *map(str, sources)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[:2000]
        library = next((tmp_path / str(fmi) / "binaries").rglob("plant*"))
        names = subprocess.run(
            [printed.require("nm"), "-D", "--defined-only", str(library)],
            capture_output=True,
            text=True,
        ).stdout.split()[2::3]
        assert names
        assert all(name.startswith(f"fmi{fmi}") for name in names)
        needed = subprocess.run(
            [printed.require("readelf"), "-d", str(library)], capture_output=True, text=True
        ).stdout
        assert set(re.findall(r"NEEDED.*\[(\w+)", needed)) <= {"libc", "libm"}


@pytest.mark.slow
def test_the_same_problem_gives_the_same_bytes(tmp_path):
    files = [
        write_fmu(problem_of(), tmp_path / f"{k}.fmu", name="plant").path.read_bytes()
        for k in range(2)
    ]
    assert files[0] == files[1]


@pytest.mark.slow
def test_fixed_steps_are_exported(tmp_path):
    fmpy = pytest.importorskip("fmpy", reason="needs the package fmpy")
    printed.require("gcc")
    problem = problem_of("heat", RungeKutta4(1e-2))
    path = write_fmu(problem, tmp_path / "a.fmu", name="plant").path
    expected = solve(problem).recording
    run = fmpy.simulate_fmu(
        str(path),
        fmi_type="CoSimulation",
        stop_time=0.5,
        output_interval=0.01,
        output=["pressure"],
        input=signal_of(problem.system.inputs),
    )
    assert run["pressure"][-1] == pytest.approx(expected["pressure"][-1], rel=1e-12)


# What is refused, and what is offered instead


def test_without_a_compiler_the_fmu_contains_sources_and_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None)
    written = write_fmu(problem_of(), tmp_path / "a.fmu", name="plant")
    assert written.platforms == ()
    assert (
        "no C compiler (gcc, clang, cc) was found; install the package gcc or clang"
        in written.remark
    )
    with zipfile.ZipFile(written.path) as archive:
        names = archive.namelist()
    assert names[0] == "modelDescription.xml"
    assert not [n for n in names if n.startswith("binaries")]
    assert {"sources/fmi3.c", "sources/plant.c", "sources/buildDescription.xml"} <= set(names)


def test_a_compiler_that_fails_leaves_no_file(tmp_path, monkeypatch):
    printed.require("gcc")
    monkeypatch.setattr(compiler, "OPTIONS", ("-fno-such-option",))
    with pytest.raises(FileError, match=r"failed with exit code 1: .*no-such-option"):
        write_fmu(problem_of(), tmp_path / "a.fmu")
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_target_is_named(tmp_path):
    (tmp_path / "file").write_text("here")
    with pytest.raises(FileError, match="cannot be written to"):
        write_fmu(problem_of(), tmp_path / "file" / "a.fmu", binary=False)


@pytest.mark.parametrize(
    ("path", "fmi", "message"),
    [
        ("a.zip", 3, r"'a\.zip' must end in \.fmu"),
        ("a.fmu", 1, "FMI 1 is not supported; allowed: 2 or 3"),
    ],
)
def test_another_file_or_version_is_refused(path, fmi, message, tmp_path):
    with pytest.raises(ParameterError, match=message):
        write_fmu(problem_of(), tmp_path / path, fmi=fmi)


def test_a_controller_is_refused_by_name(tmp_path):
    plant = plants.EXAMPLES["dmsp-20-300"]
    loop = ControlLoop(PID("pressure", "fill", 1e-5), 0.01, Schedule({"pressure": ((0.0, 2e5),)}))
    with pytest.raises(
        ParameterError, match="the controller PID cannot be exported to this target"
    ):
        write_fmu(Problem(plant, loop, 0.1, plant.state_at(pressure=1e5)), tmp_path / "a.fmu")


def test_parameters_that_are_not_tunable_are_constants(tmp_path):
    path = write_fmu(
        problem_of(), tmp_path / "a.fmu", tunable=["mechanism.mass"], binary=False
    ).path
    with zipfile.ZipFile(path) as archive:
        text = archive.read("modelDescription.xml").decode()
    assert re.findall(r'name="(parameters\.[^"]*)"', text) == ["parameters.mechanism.mass"]
    with pytest.raises(ParameterError, match=r"has no parameter 'mechanism\.mas'"):
        write_fmu(problem_of(), tmp_path / "b.fmu", tunable=["mechanism.mas"])


def test_units_are_powers_of_base_units():
    assert base_powers("m3/(s Pa)") == {"m": 4, "kg": -1, "s": 1}
    assert base_powers("N/") is None
    assert base_powers("N m/rad") == {"kg": 1, "m": 2, "s": -2, "rad": -1}
    assert base_powers("Pa/m^2") == {"kg": 1, "m": -3, "s": -2}
    assert base_powers("N/m/Pa") == {"m": 1}
    assert base_powers("u/y") is None


# The command


EXAMPLE = Path(__file__).parents[2] / "examples" / "fill_discharge.toml"


def test_the_command_writes_an_fmu(tmp_path):
    (tmp_path / "left arm.toml").write_text(EXAMPLE.read_text())
    done = airmuscle(
        "export",
        tmp_path / "left arm.toml",
        "--to",
        "fmu",
        "--fmi",
        "2",
        "--sources-only",
        "--out",
        tmp_path,
    )
    assert done.exit_code == 0, done.output
    assert (tmp_path / "left_arm.fmu").exists()
    assert "sources without a binary: none was requested" in done.output


def test_a_start_without_equilibrium_is_named_and_nothing_is_written(tmp_path):
    text = (
        EXAMPLE.read_text().replace('"10 kg"', '"500 kg"').replace("dmsp-20-300", "chou-hannaford")
    )
    (tmp_path / "heavy.toml").write_text(text)
    done = airmuscle(
        "export", tmp_path / "heavy.toml", "--to", "fmu", "--out", tmp_path / "new" / "heavy.fmu"
    )
    assert done.exit_code != 0
    assert "HangingMass has no stable equilibrium" in done.output
    assert [path.name for path in tmp_path.iterdir()] == ["heavy.toml"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--to", "c", "--fmi", "2"), "--fmi, --sources-only and --platforms belong"),
        (("--to", "fmu", "--law"), "fmu contains a plant"),
        (("--to", "simulink"), "allowed range: c, js, octave, arduino, fmu, ssp, mujoco"),
    ],
)
def test_options_that_do_not_fit_are_refused(options, message, tmp_path):
    done = airmuscle("export", "dmsp-20-300", *options, "--out", tmp_path)
    assert done.exit_code == 2
    assert message in done.output


def test_the_base_units_of_an_fmu_are_those_of_the_international_system():
    import pint

    registry = pint.UnitRegistry()
    names = {"[length]": "m", "[mass]": "kg", "[time]": "s", "[temperature]": "K"}
    for unit, powers in BASE.items():
        dimensions = registry.parse_units(unit).dimensionality
        expected = (
            {"rad": 1}
            if unit == "rad"
            else {names[key]: int(power) for key, power in dimensions.items()}
        )
        assert powers == expected, unit
        assert registry.Quantity(1.0, unit).to_base_units().magnitude == 1.0
