"""Code of a user, a controller in a scenario file or a law that is fitted: it runs with an explicit
permission alone.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import write
from airmuscle.errors import UnknownNameError
from airmuscle.files import allow_code, load, load_scenario
from airmuscle.recording import Recording

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


@model
class Unresolved(Zone):
    """A law with an annotation of a name that is not imported."""

    limit: "Decimal | None" = None
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
    with pytest.raises(
        UnknownNameError, match=r"'user_laws:Zone' is code of a user.*use files.allow_code"
    ):
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
    """Also in worker processes, which import the module of the current folder."""
    options = (
        "--simulations",
        "8",
        "--draws",
        "0",
        "--loads",
        "",
        "--supplies",
        "",
        "--leak",
        "0",
        "--delay",
        "0",
    )
    options = (*options, "--workers", "2")
    tuned = airmuscle(
        "tune", scenario, "--allow-code", *options, "--bounds", "gain=0.1 1/bar:5 1/bar"
    )
    assert tuned.exit_code == 0, tuned.output
    assert 'model = "user_laws:Zone"' in (scenario.parent / "loop-tuned.toml").read_text()
    exported = airmuscle(
        "export",
        scenario,
        "--allow-code",
        "--controller",
        "--to",
        "c",
        "--out",
        "law",
        "--name",
        "law",
    )
    assert exported.exit_code == 0, exported.output
    assert "gain = 1e-05 1/Pa" in (scenario.parent / "law" / "law.h").read_text()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no_such_module:Zone", r"cannot be imported: ModuleNotFoundError.*in the current folder"),
        ("user_laws:Zones", r"cannot be imported: AttributeError"),
        ("user_laws:Plain", "is no class that is declared with @model"),
        (
            "user_laws:Unresolved",
            "the fields of 'user_laws:Unresolved' are unknown: an annotation is of a name",
        ),
    ],
)
def test_what_is_no_model_is_refused(scenario, name, message):
    scenario.write_text(scenario.read_text().replace("user_laws:Zone", name))
    with allow_code(), pytest.raises(UnknownNameError, match=message):
        load_scenario(scenario)


FITTED = '''"""Laws of a user that start themselves from data."""
import airmuscle as am
from airmuscle.core import model, parameter
from airmuscle.physics import DataScales, ForceLaw


@model
class Linear(ForceLaw):
    """F = p A (1 - eps/eps_max)."""

    area: float = parameter("m2", "A", "effective area at rest", bounds=(0.0, 0.1))
    max_contraction: float = parameter("1", "eps_max", "contraction without load", bounds=(0.01, 0.6))

    @classmethod
    def guess(cls, data):
        scales = DataScales.of(data)
        return cls(scales.force / scales.pressure, 1.5 * scales.contraction)

    def force(self, pressure, contraction):
        return pressure * self.area * (1.0 - contraction / self.max_contraction)


@model
class Bristle(am.friction.Dahl):
    """Dahl's law under another name."""


@model
class Unstarted(am.friction.Dahl):
    """A law that cannot be started."""

    @classmethod
    def guess(cls, scales):
        return None
'''


@pytest.fixture
def fitted_laws(tmp_path, monkeypatch):
    """A folder with the module `fitted_laws`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fitted_laws.py").write_text(FITTED)
    yield tmp_path
    sys.modules.pop("fitted_laws", None)


def test_a_law_of_a_user_takes_part_in_a_comparison_and_its_file_loads(fitted_laws):
    pressure, contraction = (
        each.ravel() for each in np.meshgrid(np.linspace(1e5, 6e5, 6), np.linspace(0.0, 0.2, 7))
    )
    force = 1.3e-3 * pressure * (1.0 - contraction / 0.31) + np.random.default_rng(1).normal(
        0.0, 0.5, pressure.size
    )
    write(
        Recording({"pressure": pressure, "contraction": contraction, "force": force}, "linear"),
        "linear.csv",
    )
    given = (
        "fit",
        "linear.csv",
        "--characteristic",
        "fitted_laws:Linear",
        "--compare",
        "--workers",
        "1",
    )
    assert "use --allow-code" in airmuscle(*given).output
    assert "fitted_laws" not in sys.modules
    done = airmuscle(*given, "--allow-code", "--out", "out")
    assert done.exit_code == 0, done.output
    assert "fitted_laws:Linear (named) with 2 parameters" in done.stdout.replace("\n", " ")
    with allow_code():
        law = load("out/muscle.toml").characteristic
    assert (type(law).__name__, law.area) == ("Linear", pytest.approx(1.3e-3, rel=2e-3))
    assert airmuscle("show", "out/muscle.toml", "--allow-code").exit_code == 0


def test_a_friction_law_of_a_user_is_fitted_beside_the_others(fitted_laws):
    contraction = np.concatenate([np.linspace(0.02, 0.14, 60), np.linspace(0.14, 0.02, 60)])
    sliding = np.where(np.arange(contraction.size) < 60, 1.0, -1.0)
    columns = {
        "time": 0.2 * np.arange(contraction.size),
        "pressure": np.full(contraction.size, 3e5),
    }
    columns |= {"contraction": contraction, "force": 900.0 - 4000.0 * contraction - 20.0 * sliding}
    write(Recording(columns, "loop"), "loop.csv")
    given = (
        "hysteresis",
        "loop.csv",
        "--resting-length",
        "300 mm",
        "--degree",
        "1",
        "--elements",
        "2",
    )
    done = airmuscle(*given, "--friction", "fitted_laws:Bristle", "--allow-code", "--json")
    assert done.exit_code == 0, done.output
    rms = {each["law"]: each["rms_error"] for each in json.loads(done.stdout)["friction"]["laws"]}
    assert rms["Bristle"] == pytest.approx(rms["Dahl"])
    refused = airmuscle(*given, "--friction", "fitted_laws:Unstarted", "--allow-code")
    assert "Unstarted is not started from data; define its guess(scales)." in refused.output
    assert (
        "is no friction law"
        in airmuscle(*given, "--friction", "fitted_laws:Linear", "--allow-code").output
    )
