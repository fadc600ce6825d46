"""A controller of a user in a scenario file: its code runs with an explicit permission alone."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from command_line import airmuscle

from airmuscle.errors import UnknownNameError
from airmuscle.files import allow_code, load_scenario

EXAMPLE_FILES = Path(__file__).parents[2] / "examples"
LAW = '''"""A law of a user."""
from airmuscle.core import model, ops, parameter
from airmuscle.engine import ControlLaw

print("the module runs")


@model
class Zone(ControlLaw):
    """Proportional filling and discharging outside a zone."""

    gain: float = parameter("1/Pa", "K", "gain", bounds=(0.0, 1.0))
    zone: float = parameter("Pa", "Z", "zone", bounds=(0.0, 1e6), default=1e3)
    measured_columns = setpoints = ("pressure",)
    inputs = ("fill", "discharge")
    initial_memory = {}

    def step(self, memory, measurement, dt):
        error = measurement.setpoints["pressure"] - measurement.columns["pressure"]
        share = ops.clip(self.gain * ops.where(abs(error) > self.zone, error, 0.0), -1.0, 1.0)
        return {"fill": ops.maximum(share, 0.0), "discharge": ops.maximum(-share, 0.0)}, {}


class Plain:
    pass
'''


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    """A scenario whose controller is the class `Zone` of a module in the current folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "user_laws.py").write_text(LAW)
    text = (EXAMPLE_FILES / "pressure_loop.toml").read_text()
    head, _, rest = text.partition("[input.controller]")
    kept = rest[rest.index("[input.controller.setpoint]") :]
    law = '[input.controller]\nmodel = "user_laws:Zone"\ngain = "1 1/bar"\nsample_time = "5 ms"\n\n'
    (tmp_path / "loop.toml").write_text(f"{head}{law}{kept}")
    yield tmp_path / "loop.toml"
    sys.modules.pop("user_laws", None)


def test_without_permission_nothing_runs_and_the_error_says_why(scenario, capsys):
    with pytest.raises(UnknownNameError, match=r"'user_laws:Zone' is code of a user.*use files.allow_code"):
        load_scenario(scenario)
    assert "user_laws" not in sys.modules
    for command in ("simulate", "tune"):
        done = airmuscle(command, scenario)
        assert done.exit_code == 1
        assert "refused. To run it because you trust it, use --allow-code." in done.output
    assert "the module runs" not in capsys.readouterr().out


def test_the_permission_ends_with_its_block(scenario):
    with allow_code():
        law = load_scenario(scenario).problem.input.controller
    assert (type(law).__name__, law.gain, law.zone) == ("Zone", pytest.approx(1e-5), 1e3)
    with pytest.raises(UnknownNameError):
        load_scenario(scenario)
    assert airmuscle("simulate", "--allow-code", scenario).exit_code == 0
    assert airmuscle("simulate", scenario).exit_code == 1


def test_tune_and_export_take_it(scenario):
    options = ("--budget", "8", "--draws", "0", "--loads", "", "--supplies", "", "--leak", "0", "--delay", "0")
    tuned = airmuscle("tune", scenario, "--allow-code", *options, "--bounds", "gain=0.1 1/bar:5 1/bar")
    assert tuned.exit_code == 0, tuned.output
    assert 'model = "user_laws:Zone"' in (scenario.parent / "loop-tuned.toml").read_text()
    exported = airmuscle(
        "export", scenario, "--allow-code", "--controller", "--to", "c", "--out", "law", "--name", "law"
    )
    assert exported.exit_code == 0, exported.output
    assert "gain = 1e-05 1/Pa" in (scenario.parent / "law" / "law.h").read_text()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no_such_module:Zone", r"cannot be imported: ModuleNotFoundError.*in the current folder"),
        ("user_laws:Zones", r"cannot be imported: AttributeError"),
        ("user_laws:Plain", "is no class that is declared with @model"),
    ],
)
def test_what_is_no_model_is_refused(scenario, name, message):
    scenario.write_text(scenario.read_text().replace("user_laws:Zone", name))
    with allow_code(), pytest.raises(UnknownNameError, match=message):
        load_scenario(scenario)
