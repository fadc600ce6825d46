"""Predictive control in a scenario file: the table states the design, from which the law follows
that Python designs; the file is written and read back equal, and `tune`, `study` and `export` take
it."""

from __future__ import annotations

import io
import re
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import printed
import pytest
from command_line import airmuscle
from scenario_files import writer_of

from airmuscle.control import PredictiveControl, design_predictive
from airmuscle.design import load_scenario_loop
from airmuscle.engine import ControlLoop
from airmuscle.errors import AirmuscleError, ParameterError
from airmuscle.files import load_scenario, save_scenario, scenario_text
from airmuscle.physics import find_equilibrium, linearise

EXAMPLE = Path(__file__).parents[2] / "examples" / "predictive_lift.toml"
written = writer_of(EXAMPLE.read_text(encoding="utf-8"))
SHORT = ('duration = "1.3 s"', 'duration = "0.1 s"')
OPEN = {"fill": 0.05, "discharge": 0.05}


@pytest.fixture(scope="module")
def example():
    return load_scenario(EXAMPLE)


def test_the_table_is_the_design_in_python(example):
    """The same commands but for the rounding of units, with the limits of a column and of rates at
    work.
    """
    plant = example.plant
    state = find_equilibrium(plant, pressure=2e5, inputs=OPEN)
    law = design_predictive(
        linearise(plant, state, OPEN),
        0.01,
        measured=("position", "pressure"),
        controlled=("position",),
        disturbed=("air_mass", "speed"),
        blocks=(1, 2, 4, 8),
        permitted={"position": 1e-3, "speed": 0.1, "fill": 0.1, "discharge": 0.1},
        process_noise={
            "air_mass": 1e-6,
            "speed": 0.1,
            "air_mass.disturbance": 1e-5,
            "speed.disturbance": 1.0,
        },
        measurement_noise={"position": 1e-4, "pressure": 500.0},
        limits={"pressure": (1e5, 2.3e5)},
        max_rate={"fill": 20.0, "discharge": 20.0},
    )
    loop = replace(example.problem.input, controller=law)
    run, expected = (
        replace(example, problem=replace(example.problem, input=each)).simulate()
        for each in (example.problem.input, loop)
    )
    for column in ("position", "command.fill", "command.discharge"):
        assert run[column] == pytest.approx(expected[column], rel=1e-9, abs=1e-9)
    assert abs(np.interp(0.79, run["time"], run["position"]) - 0.03) < 3e-4
    assert 2.2e5 < run["pressure"].max() < 2.33e5
    assert np.ptp(run["command.fill"]) > 0.3


def test_the_file_is_written_and_read_back_equal_with_the_plant_once(example, tmp_path):
    again = load_scenario(save_scenario(example, tmp_path / "again.toml"))
    assert again.problem.input.controller == example.problem.input.controller
    assert again.plant == example.plant
    assert "input.controller.plant" not in scenario_text(example)


def test_another_plant_of_the_law_is_written(example, tmp_path):
    """The plant of the law is that of [plant] unless the table gives another, which remains another
    one.
    """
    path = written(
        tmp_path,
        (
            "[input.controller.setpoint]",
            (
                '[input.controller.plant]\nlibrary = "lift-dmsp-20"\nmechanism = { model ='
                ' "HangingMass", mass = "12 kg" }\n\n[input.controller.setpoint]'
            ),
        ),
    )
    scenario = load_scenario(path)
    law = scenario.problem.input.controller
    assert (law.plant.mechanism.mass, scenario.plant.mechanism.mass) == (12.0, 10.0)
    assert (
        load_scenario(save_scenario(scenario, tmp_path / "again.toml")).problem.input.controller
        == law
    )


@pytest.mark.parametrize(
    ("was", "becomes", "message"),
    [
        (
            'permitted = ["1 mm"',
            'permitted = ["1 kg"',
            r"permitted\[0\]: unit 'kg' cannot be converted to 'm'",
        ),
        (
            ", 0.1, 0.1]",
            ", 0.1]",
            "permitted has 3 numbers; it must have 4, one for each of 'weighted': position, speed",
        ),
        (
            ", 0.1, 0.1]",
            ', 0.1, 0.1, "1 N"]',
            "permitted has 5 numbers; it must have 4, one for each of 'weighted'",
        ),
        (
            'noisy = ["air_mass"',
            'noisy = ["air_mas"',
            "the signal 'air_mas' is not known, because it is no column",
        ),
        (
            'pressures = ["2 bar"]',
            'pressures = ["2 bar", 0]',
            "pressure has 2 values; the plant has 1 muscle",
        ),
        (
            'maximum = ["2.3 bar"]',
            'maximum = ["0.3 bar"]',
            "limits of 'pressure' are 100000 and 30000; the minimum must",
        ),
        (
            "blocks = [1, 2, 4, 8]",
            "blocks = [1, 2.5]",
            r"blocks\[1\] is 2.5; it must be an integer",
        ),
        (
            "blocks = [1, 2, 4, 8]",
            "horizon = 300",
            "horizon is 300; allowed range: 1 to 200 samples",
        ),
        (
            'limited = ["pressure"]',
            'limited = ["mass_flow"]',
            "unit 'bar' cannot be converted to 'kg/s'",
        ),
        (
            'sample_time = "10 ms"\n',
            "",
            "'sample_time' is missing: sample time, such as sample_time = \"10 ms\"",
        ),
        (
            'commanded = ["fill", "discharge"]',
            'commanded = ["fill"]',
            "2 numbers; it must have 1, one for each of 'comma",
        ),
    ],
)
def test_a_fault_is_told_with_file_and_key(tmp_path, was, becomes, message):
    path = written(tmp_path, (was, becomes))
    with pytest.raises(
        AirmuscleError, match=rf"{re.escape(path.name)}, \[input.controller\].*{message}"
    ) as raised:
        load_scenario(path)
    assert raised.type is not AirmuscleError


def test_a_sample_time_of_the_law_that_is_not_that_of_the_loop_is_refused(example):
    loop = example.problem.input
    slower = ControlLoop(loop.controller, 0.02, loop.setpoint)
    with pytest.raises(
        ParameterError,
        match=r"the sample time of the loop is 0\.02 s and that of the estimator 0\.01 s",
    ):
        replace(example, problem=replace(example.problem, input=slower)).simulate()


def test_weights_are_tuned_in_the_units_of_their_signals(tmp_path):
    """The gains of a file are its texts; a set of gains is designed anew."""
    case = load_scenario_loop(EXAMPLE)
    bounds = case.bounds(
        [
            "permitted[0]=0.2 mm:5 mm",
            "process_noise[3]=0.1 m/s2:10 m/s2",
            "max_rate[0]=1 1/s:50 1/s",
        ]
    )
    assert bounds["permitted[0]"] == pytest.approx((2e-4, 5e-3))
    with pytest.raises(
        ParameterError,
        match="no parameter of PredictiveControl with the unit u/y, u or y differs from 0; state",
    ):
        case.bounds()
    text = case.with_gains({"permitted[0]": 4e-4, "process_noise[3]": 2.0})
    assert 'permitted = ["0.4 mm", "0.1 m/s", 0.1, 0.1]' in text
    assert '"2 m/s2"]' in text
    path = tmp_path / "other.toml"
    path.write_text(text, encoding="utf-8")
    present, other = (load_scenario(each).problem.input.controller for each in (EXAMPLE, path))
    assert other == replace(
        present, permitted=(4e-4, 0.1, 0.1, 0.1), process_noise=(*present.process_noise[:3], 2.0)
    )
    assert not np.array_equal(other.law.problem.hessian, present.law.problem.hessian)


def test_the_command_tunes_it(tmp_path):
    path = written(tmp_path, SHORT)
    done = airmuscle(
        "tune",
        str(path),
        "--bounds",
        "permitted[0]=0.2 mm:5 mm",
        "--simulations",
        "8",
        "--loads",
        "",
        "--supplies",
        "",
        "--leak",
        "0",
        "--delay",
        "0",
        "--out",
        str(tmp_path / "t"),
    )
    assert done.exit_code == 0, done.output
    assert isinstance(
        load_scenario(path.with_name(f"{path.stem}-tuned.toml")).problem.input.controller,
        PredictiveControl,
    )


def test_a_study_varies_weights_and_the_sample_time(tmp_path):
    path = written(tmp_path, SHORT)
    study = tmp_path / "study.toml"
    study.write_text(
        f'scenario = "{path.name}"\n[vary]\n"input.controller.permitted[0]" = ["0.5 mm", "2 mm"]\n'
        '"input.controller.sample_time" = ["10 ms", "20 ms"]\n[design]\nmodel = "Grid"\n'
        '[metrics]\nend = { model = "Final", column = "position", end = "0.1 s" }\n',
        encoding="utf-8",
    )
    done = airmuscle("study", str(study), "--workers", "1", "--out", str(tmp_path / "s"))
    assert done.exit_code == 0, done.output
    rows = (tmp_path / "s" / "results.csv").read_text(encoding="utf-8").splitlines()
    ends = {line.split(",")[3] for line in rows[1:]}
    assert len(ends) == 4, rows


def test_the_command_exports_it_as_c(tmp_path):
    done = airmuscle(
        "export", str(EXAMPLE), "--controller", "--to", "c", "--out", str(tmp_path / "c")
    )
    assert done.exit_code == 0, done.output
    compiler = printed.require("cc")
    folder = tmp_path / "c"
    subprocess.run(
        [compiler, "-std=c99", "-O2", *map(str, folder.glob("*.c")), "-lm", "-o", "replay"],
        cwd=folder,
        check=True,
    )
    replay = subprocess.run(["./replay"], cwd=folder, capture_output=True, text=True, check=False)
    assert replay.returncode == 0, replay.stdout + replay.stderr
    assert re.match(
        r"130 samples, 0 commands differ by more than 1e-09 of their range", replay.stdout
    )


REMEDIES = {
    "C": ("c", "*_controller.c"),
    "JavaScript": ("js", "*.run.mjs"),
    "Octave": ("octave", "run_*.m"),
    "FMUs of an SSP package": ("ssp", "*.ssp"),
}
"""What the refusal of an export as one FMU names, with the target of the command and a file."""


def test_the_refusal_of_one_fmu_names_what_the_command_then_writes(tmp_path):
    """Each named target, with the sources alone."""
    refused = airmuscle("export", EXAMPLE, "--to", "fmu", "--out", tmp_path / "lift.fmu")
    assert refused.exit_code == 1
    for name, (target, pattern) in REMEDIES.items():
        assert name in refused.stderr, name
        out = tmp_path / ("lift.ssp" if target == "ssp" else target)
        done = airmuscle("export", EXAMPLE, "--to", target, "--out", out)
        assert done.exit_code == 0, done.output
        found = list(tmp_path.glob(pattern)) if target == "ssp" else list(out.glob(pattern))
        assert found, name


def test_a_package_states_the_start_of_every_signal_between_its_fmus(tmp_path):
    """Of FMI 2.0 unless another version is asked for; measurements as at the first sample."""
    path = tmp_path / "lift.ssp"
    done = airmuscle("export", EXAMPLE, "--to", "ssp", "--sources-only", "--out", path)
    assert done.exit_code == 0, done.output
    first = load_scenario(EXAMPLE).simulate()
    with zipfile.ZipFile(path) as package:
        root = ElementTree.fromstring(package.read("SystemStructure.ssd"))
        with zipfile.ZipFile(io.BytesIO(package.read("resources/controller.fmu"))) as fmu:
            about = ElementTree.fromstring(fmu.read("modelDescription.xml"))
    assert about.attrib["fmiVersion"] == "2.0"
    stated = {
        parameter.attrib["name"]: float(parameter[0].attrib["value"])
        for parameter in root.iter()
        if parameter.tag.endswith("}Parameter")
    }
    for column in ("position", "pressure"):
        assert stated[column] == first[f"measured.{column}"][0], column
    assert stated["setpoint.position"] == first["setpoint.position"][0]
    assert stated["fill"] == first["command.fill"][0]
