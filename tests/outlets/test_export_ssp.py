"""Controllers as FMUs: a master that follows the connections of an SSP package gives the closed
loop of the library.

At every sample it passes the outputs of the plant to the controller, and the commands to the plant,
and steps both. The error of a column is its greatest difference divided by its greatest value;
bound 1e-7, as for FMUs of plants.
"""

from __future__ import annotations

import zipfile

import numpy as np
import printed
import pytest
from command_line import airmuscle
from control_plants import LIFT, PRESSURE, SPLIT

from airmuscle.control import PID, Cascade, OnOffController, SuperTwisting, design_predictive
from airmuscle.engine import (
    PWM,
    ColumnSensor,
    ControlLoop,
    Problem,
    Rodas4,
    Schedule,
    WithSensors,
    solve,
)
from airmuscle.errors import ParameterError
from airmuscle.outlets import write_controller_fmu, write_ssp
from airmuscle.physics import linearise

pytestmark = pytest.mark.tool
SAMPLE = 0.005
CASCADE = Cascade(
    PID("position", "pressure", gain=4e6, integral_time=0.4, derivative_time=0.01),
    PRESSURE,
    (0.0,),
    (5e5,),
)
SENSED = (
    ColumnSensor("position", resolution=5e-5, delay=2, lag=3e-3),
    ColumnSensor("pressure", noise=500.0, delay=1),
)


def predictive_law():
    """Predictive control of the position, whose limits act within the run."""
    openings = {"fill": 0.05, "discharge": 0.05}
    model = linearise(LIFT, LIFT.state_at(pressure=2e5), openings)
    return design_predictive(
        model,
        SAMPLE,
        measured=("position",),
        controlled=("position",),
        disturbed=("air_mass",),
        horizon=12,
        permitted={"position": 1e-3, "speed": 0.1, "fill": 0.1, "discharge": 0.1},
        process_noise={"air_mass": 1e-6, "speed": 0.1, "air_mass.disturbance": 1e-5},
        measurement_noise={"position": 1e-4},
    )


LAWS = {
    "PI": (PRESSURE, "pressure", 3e5),
    "cascade": (CASCADE, "position", 0.01),
    "super-twisting": (SuperTwisting("position", SPLIT, 10.0, 1.0, 0.05, 5e-3), "position", 0.01),
    "on-off": (OnOffController("pressure", SPLIT, 1e4), "pressure", 3e5),
    "sensors with noise": (WithSensors(CASCADE, SENSED, 7.0), "position", 0.01),
    "predictive": (predictive_law(), "position", 0.01),
}


def problem_of(name, drivers=None):
    law, signal, goal = LAWS[name]
    loop = ControlLoop(law, SAMPLE, Schedule({signal: ((0.0, goal),)}), drivers=drivers or {})
    return Problem(
        LIFT, loop, 0.5, LIFT.state_at(pressure=1e5), integrator=Rodas4(1e-9), output_times=SAMPLE
    )


class Slave:
    """An FMU of either version in Co-Simulation, whose variables are read and set by name."""

    def __init__(self, path, folder):
        import fmpy

        about = fmpy.read_model_description(str(path))
        self.fmi = int(about.fmiVersion[0])
        kind = fmpy.fmi2.FMU2Slave if self.fmi == 2 else fmpy.fmi3.FMU3Slave
        self.references = {v.name: v.valueReference for v in about.modelVariables}
        self.unit = kind(
            guid=about.guid,
            unzipDirectory=fmpy.extract(str(path), str(folder)),
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName=path.stem,
        )
        self.unit.instantiate()
        if self.fmi == 2:
            self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()

    def get(self, name):
        read = self.unit.getReal if self.fmi == 2 else self.unit.getFloat64
        return read([self.references[name]])[0]

    def set(self, name, value):
        write = self.unit.setReal if self.fmi == 2 else self.unit.setFloat64
        write([self.references[name]], [value])

    def step(self, time):
        self.unit.doStep(currentCommunicationPoint=time, communicationStepSize=SAMPLE)


def unpacked(path, folder):
    """The FMUs of a package by name, and its connections between them."""
    from fmpy.ssp.ssd import read_ssd

    system = read_ssd(str(path)).system
    with zipfile.ZipFile(path) as files:
        files.extractall(folder)
    slaves = {c.name: Slave(folder / c.source, folder / c.name) for c in system.elements}
    return slaves, [c for c in system.connections if c.startElement]


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    "name", [n if n != "super-twisting" else pytest.param(n, marks=pytest.mark.slow) for n in LAWS]
)
def test_the_joined_fmus_give_the_closed_loop_of_the_library(name, fmi, tmp_path):
    pytest.importorskip("fmpy")
    printed.require("gcc")
    problem = problem_of(name)
    written = write_ssp(problem, tmp_path / "loop.ssp", fmi=fmi, name="lift")
    assert written.remark == ""
    slaves, connections = unpacked(written.path, tmp_path)
    exchanged = sorted(
        connections, key=lambda c: c.startElement == "controller"
    )  # measurements, then commands
    columns = [
        n
        for n in slaves["plant"].references
        if n in ("position", "pressure", "speed", "fill", "discharge")
    ]
    rows = []
    samples = round(0.5 / SAMPLE)
    for k in range(samples):
        for c in exchanged:
            slaves[c.endElement].set(c.endConnector, slaves[c.startElement].get(c.startConnector))
        if k == 0:
            for slave in slaves.values():
                slave.unit.exitInitializationMode()
        rows.append([slaves["plant"].get(n) for n in columns])
        for slave in slaves.values():
            slave.step(k * SAMPLE)
    recording = solve(problem).recording
    at = np.searchsorted(recording["time"], np.arange(samples) * SAMPLE - 1e-9)
    for column, values in zip(columns, np.transpose(rows), strict=True):
        expected = recording[column][at]
        assert np.abs(values - expected).max() <= 1e-7 * max(np.abs(expected).max(), 1e-3), column


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_description_of_a_controller_is_valid_and_its_command_can_be_read_before_a_step(
    fmi, tmp_path
):
    fmpy = pytest.importorskip("fmpy")
    printed.require("gcc")
    written = write_controller_fmu(problem_of("on-off"), tmp_path / "law.fmu", fmi=fmi, name="law")
    assert pytest.importorskip("fmpy.validation").validate_fmu(str(written.path)) == []
    about = fmpy.read_model_description(str(written.path))
    assert about.modelExchange is None
    assert float(about.defaultExperiment.stepSize) == SAMPLE
    slave = Slave(written.path, tmp_path / "law")
    before = slave.get("fill")
    slave.set("setpoint.pressure", 1e5)
    slave.set("parameters.hysteresis", 2e4)
    assert before > 0.0 == slave.get("fill")
    slave.unit.exitInitializationMode()
    slave.set("setpoint.pressure", 3e5)
    slave.step(0.0)
    assert slave.get("fill") > 0.0
    state = slave.unit.getFMUstate() if fmi == 2 else slave.unit.getFMUState()
    slave.set("pressure", 4e5)
    slave.step(SAMPLE)
    assert slave.get("discharge") > 0.0
    (slave.unit.setFMUstate if fmi == 2 else slave.unit.setFMUState)(state)
    assert slave.get("discharge") == 0.0
    with pytest.raises(Exception, match="error"):
        slave.set(
            "parameters.sample_time" if "parameters.sample_time" in slave.references else "fill",
            1.0,
        )


def test_fmpy_runs_a_package_to_the_band_of_an_on_off_law(tmp_path):
    simulation = pytest.importorskip("fmpy.ssp.simulation")
    printed.require("gcc")
    # its master begins with measurements of zero, to which a law without memory is indifferent, and
    # passes signals after each step, so that its steps are short
    path = write_ssp(problem_of("on-off"), tmp_path / "loop.ssp", name="lift").path
    result = simulation.simulate_ssp(
        str(path),
        stop_time=0.5,
        step_size=SAMPLE / 5,
        input={"setpoint.pressure": lambda time: 3e5},
    )
    name = next(n for n in result.dtype.names if n.endswith("plant.pressure"))
    assert abs(result[name][-1] - 3e5) < 2e4


def test_a_loop_with_drivers_is_refused_as_a_package(tmp_path):
    with pytest.raises(ParameterError, match="drivers of fill"):
        write_ssp(problem_of("PI", {"fill": PWM(20.0)}), tmp_path / "loop.ssp")


def test_the_commands_write_both(tmp_path):
    printed.require("gcc")
    loop = "examples/pressure_loop.toml"
    law = airmuscle(
        "export", loop, "--controller", "--to", "fmu", "--out", str(tmp_path / "law.fmu")
    )
    assert law.exit_code == 0, law.output
    assert "Co-Simulation" in law.stdout
    refused = airmuscle("export", loop, "--to", "ssp", "--out", str(tmp_path / "loop.ssp"))
    assert "drivers of fill" in refused.output
    both = airmuscle(
        "export", "examples/joint_cascade.toml", "--to", "ssp", "--out", str(tmp_path / "loop.ssp")
    )
    assert both.exit_code == 0, both.output
    assert zipfile.is_zipfile(tmp_path / "loop.ssp")
