"""`airmuscle tune SCENARIO`: the same file with the new gains, which `simulate` runs, and a report.

All of the file but the gains stays as it is, byte by byte: comments, units, line ends. A scenario
that has nothing to tune is refused by name, and an interruption writes the best gains so far.
"""

from __future__ import annotations

import contextlib
import json
import re
from pathlib import Path

import pytest
from command_line import airmuscle
from scenario_files import MUSCLE_FILE
from scenario_files import PRESSURE_LOOP as SCENARIO

from airmuscle.design import Perturbations, load_scenario_loop, tune
from airmuscle.errors import AirmuscleError, FileError, ParameterError
from airmuscle.files import load_scenario
from airmuscle.outlets.cli import tune as command

MUSCLE = f"""{MUSCLE_FILE}
[damper]
model = "LinearDamper"
damping = "200 N s/m"
[uncertainty]
parameters = ["damper.damping"]
standard_errors = [10.0]
correlations = [[1.0]]
"""
FEW = ["--simulations", "64", "--draws", "1"]
"""Eight sets of gains in seven cases."""


@pytest.fixture(autouse=True)
def working_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The default folder of a command is in the working directory."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    (tmp_path / "muscle.toml").write_text(MUSCLE, encoding="utf-8")
    path = tmp_path / "lift.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


def run(*arguments: object):
    return airmuscle(*arguments)


def refused(*arguments: object) -> str:
    result = run("tune", *arguments)
    assert result.exit_code in (1, 2)
    return " ".join(result.stderr.split())


def test_the_command_writes_the_same_file_with_other_gains_and_a_report(scenario):
    out = scenario.parent / "out"
    result = run("tune", scenario, *FEW, "--rules", "--out", out)
    assert result.exit_code == 0, result.stderr
    tuned = scenario.with_name("lift-tuned.toml")
    before = SCENARIO.splitlines()
    after = tuned.read_text(encoding="utf-8").splitlines()
    changed = [line for old, line in zip(before, after, strict=True) if old != line]
    assert len(changed) == 2
    assert re.fullmatch(r'gain = "[\d.e-]+ 1/bar"          # a careful gain', changed[0])
    assert re.fullmatch(r"integral_time = [\d.]+", changed[1])
    assert {path.name for path in out.iterdir()} >= {"report.html", "history.csv", "figures"}
    assert {path.stem for path in (out / "figures").glob("*.png")} == {
        "convergence",
        "pareto",
        "response",
    }
    report = (out / "report.html").read_text(encoding="utf-8")
    for text in (
        "Hansen",
        "Skogestad",
        "drawn 1",
        "load x 0.5",
        "Pareto",
        "RootMeanSquareError",
        "index, tuned gains [Pa]",
    ):
        assert text in report
    assert len((out / "history.csv").read_text(encoding="utf-8").splitlines()) == 1 + 8
    assert "objective" in result.stdout
    assert "gains [Pa]" in result.stdout
    assert run("simulate", tuned, "--out", scenario.parent / "run").exit_code == 0


def test_the_printed_gains_are_those_of_the_file_and_of_the_search_in_python(scenario):
    printed = json.loads(
        run("tune", scenario, *FEW, "--json", "--save", scenario.with_name("a.toml")).stdout
    )["tuning"]
    gains = {row["gain"]: row["tuned"] for row in printed["gains"]}
    controller = load_scenario(scenario.with_name("a.toml")).problem.input.controller
    assert controller.gain == pytest.approx(gains["gain"], rel=1e-14)
    assert controller.integral_time == gains["integral_time"]
    assert printed["objective"] <= printed["objective_with_the_present_gains"]
    assert {row["case"] for row in printed["cases"]} == {
        "nominal",
        "load x 0.5",
        "load x 2",
        "supply x 0.8",
        "leak",
        "drawn 1",
        "delay 1",
    }
    loaded = load_scenario_loop(scenario)
    cases = loaded.family(Perturbations(draws=1)).cases
    again = tune(cases, loaded.bounds(), duration=0.3, simulations=64)
    assert again.gains == gains
    copy = loaded.save(again.gains, scenario.with_name("b.toml"))
    assert copy.read_bytes() == scenario.with_name("a.toml").read_bytes()


@pytest.mark.parametrize("text", [SCENARIO, SCENARIO.replace("\n", "\r\n")], ids=["LF", "CRLF"])
def test_a_file_with_its_own_gains_is_unchanged_byte_by_byte(scenario, text):
    scenario.write_bytes(text.encode())
    loaded = load_scenario_loop(scenario)
    controller = loaded.loop.controller
    copy = loaded.save(
        {"gain": controller.gain, "integral_time": 0.6}, scenario.with_name("copy.toml")
    )
    assert copy.read_bytes() == scenario.read_bytes()
    assert not list(scenario.parent.glob("*.part"))


def test_a_gain_that_the_file_does_not_state_is_added(scenario):
    loaded = load_scenario_loop(scenario)
    text = loaded.with_gains({"derivative_time": 0.0125})
    assert "derivative_time = 0.0125" in text
    saved = loaded.save({"derivative_time": 0.0125}, scenario.with_name("more.toml"))
    assert load_scenario(saved).problem.input.controller.derivative_time == 0.0125


def test_default_bounds_are_a_decade_on_both_sides_of_gains_and_times_that_are_not_zero(scenario):
    loaded = load_scenario_loop(scenario)
    assert loaded.bounds() == {
        "gain": (pytest.approx(1.5e-6), pytest.approx(1.5e-4)),
        "integral_time": (pytest.approx(0.06), pytest.approx(6.0)),
    }
    text = ["gain=0.5 1/bar:5 1/bar", "integral_time=0.05:500 ms", "initial_output=-1:1"]
    expected = [(5e-6, 5e-5), (0.05, 0.5), (-1.0, 1.0)]
    assert [pytest.approx(each) for each in expected] == list(loaded.bounds(text).values())
    negative = SCENARIO.replace('gain = "1.5 1/bar"', 'gain = "-1.5 1/bar"')
    scenario.write_text(negative, encoding="utf-8")
    assert load_scenario_loop(scenario).bounds()["gain"] == (
        pytest.approx(-1.5e-4),
        pytest.approx(-1.5e-6),
    )
    relay = SCENARIO.replace('model = "PID"', 'model = "OnOffController"').replace(
        "integral_time = 0.6\n", ""
    )
    scenario.write_text(re.sub("gain = .*", 'hysteresis = "0.1 bar"', relay), encoding="utf-8")
    assert load_scenario_loop(scenario).bounds() == {
        "hysteresis": (pytest.approx(1e3), pytest.approx(1e5))
    }


def test_drawn_parameters_are_those_that_the_scenario_takes_from_the_muscle_file(scenario):
    cases = load_scenario_loop(scenario).family(Perturbations(draws=3)).cases
    dampings = [case.plant.muscle.damper.damping for case in cases if case.name.startswith("drawn")]
    assert len(set(dampings)) == 3
    assert all(0 < abs(damping - 200.0) < 50.0 for damping in dampings)
    table = (
        '[plant.muscle]\nlibrary = "muscle.toml"\ndamper = { model = "LinearDamper", damping = "300'
        ' N s/m" }\n'
    )
    own = SCENARIO.replace('[plant]\nmuscle = "muscle.toml"\n', table)
    scenario.write_text(own, encoding="utf-8")
    family = load_scenario_loop(scenario).family(Perturbations(draws=3))
    assert not [case for case in family.cases if case.name.startswith("drawn")]
    assert any(
        "neither the scenario nor a muscle file states the uncertainty" in note
        for note in family.notes
    )


def test_every_case_starts_at_the_pressure_of_the_scenario(scenario):
    cases = load_scenario_loop(scenario).family(Perturbations()).cases
    positions = {case.name: case.initial_state["position"] for case in cases}
    assert positions["load x 2"] < positions["nominal"] < positions["load x 0.5"]
    pressures = {
        case.name: case.plant.outputs(case.initial_state, {"fill": 0.0, "discharge": 0.0})[
            "pressure"
        ]
        for case in cases
    }
    assert all(pressure == pytest.approx(1e5, rel=1e-6) for pressure in pressures.values())


def test_an_interruption_writes_the_best_gains_so_far(scenario, monkeypatch):
    @contextlib.contextmanager
    def stopped(label):
        def show(name, fraction):
            if fraction > 0.4:
                raise KeyboardInterrupt

        yield show

    monkeypatch.setattr(command, "progress_bars", stopped)
    result = run(
        "tune", scenario, "--simulations", "128", "--draws", "0", "--out", scenario.parent / "out"
    )
    assert result.exit_code == 130
    assert "the best gains so far are written" in result.stderr
    assert load_scenario(scenario.with_name("lift-tuned.toml")).problem.input.controller.gain > 0
    assert "interrupted" in (scenario.parent / "out" / "report.html").read_text(encoding="utf-8")


def test_a_scenario_that_cannot_be_tuned_is_refused(scenario):
    without = SCENARIO[: SCENARIO.index("[input.controller]")] + SCENARIO[SCENARIO.index("[run]") :]
    scenario.write_text(without, encoding="utf-8")
    assert "there is no [input.controller]; give a controller with its gains" in refused(scenario)
    assert "Of a plant of the library write a scenario file with [plant] library and" in refused(
        "joint-dmsp-20-matrix"
    )
    assert "there is no such file" in refused(scenario.with_name("missing.toml"))
    zero = SCENARIO.replace('"1.5 1/bar"', "0.0").replace("integral_time = 0.6\n", "")
    scenario.write_text(zero, encoding="utf-8")
    assert (
        "[input.controller]: no parameter of PID with the unit u/y, u or y differs from 0"
        in refused(scenario)
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--bounds", "gain"], "bounds 'gain' must be a gain, its minimum and its maximum"),
        (["--bounds", "gian=1:2"], "PID has no parameter 'gian'"),
        (["--bounds", "gain=1 m:2 m"], "bounds 'gain=1 m:2 m': unit 'm' cannot be converted"),
        (["--bounds", "gain=5 1/bar:1 1/bar"], "the minimum must be below the maximum"),
        (
            ["--index", "mse"],
            "--index is 'mse'; allowed range: rmse, iae, itae. Did you mean 'rmse'?",
        ),
        (["--loads", "0.5;2"], "--loads is '0.5;2'; it must be factors with commas between them"),
        (["--loads", "0"], "loads contains 0; a factor must be positive"),
        (["--quantile", "2"], "--quantile is 2; allowed range: 0 to 1"),
        (["--simulations", "9" * 30], "Invalid value for '--simulations'"),
        (["--budget", "64"], "To limit the number of simulated loops: --simulations 4000"),
        (["--simulations", "20"], "simulations is 20; it must be a whole number of at least 80"),
    ],
)
def test_bad_options_are_refused_with_one_line(scenario, options, message):
    text = refused(scenario, *options)
    assert message in text
    assert not scenario.with_name("lift-tuned.toml").exists()


def test_a_file_that_cannot_be_written_is_refused_before_the_search(scenario):
    (scenario.parent / "file").write_text("", encoding="utf-8")
    assert "cannot be written to" in refused(scenario, "--out", scenario.parent / "file")
    assert "cannot be written to" in refused(
        scenario, "--save", scenario.parent / "file" / "new.toml"
    )
    loaded = load_scenario_loop(scenario)
    other = scenario.parent / "elsewhere"
    other.mkdir()
    with pytest.raises(
        AirmuscleError, match=r"cannot take the place of .*muscle.toml: there is no such file"
    ):
        loaded.save({"gain": 1e-5}, other / "new.toml")
    assert not list(other.iterdir())
    folder = scenario.with_name("folder.toml")
    folder.mkdir()
    with pytest.raises(FileError, match=r"folder.toml: is a folder; name a file in it"):
        loaded.save({"gain": 1e-5}, folder)
    assert "is a folder" in refused(scenario, "--save", folder)
    assert "cannot take the place of" in refused(scenario, "--save", other / "new.toml")
    with pytest.raises(ParameterError, match="gain"):
        loaded.save({"gain": float("nan")}, scenario.with_name("nan.toml"))


@pytest.mark.parametrize(
    "option", ["--quantile 1.5", "--leak 2", "--delay 1001", "--draws -1", "--air-weight -1"]
)
def test_an_option_has_the_range_of_the_field_that_it_sets(scenario, option):
    refused = run("tune", scenario, *option.split())
    assert refused.exit_code == 2
    assert "Invalid value" in refused.stderr
    assert option.split()[0] in refused.stderr
