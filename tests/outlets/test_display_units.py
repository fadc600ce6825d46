"""Display units: plots, tables and texts are in the units that the user chooses; values and files
are not affected.
"""

from __future__ import annotations

import re
import threading
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.core import display as module
from airmuscle.core.display import (
    CONFIG_FILE,
    chosen_scale,
    contraction_text,
    current_units,
    heading_scale,
    level_text,
    quantity_text,
    scaled_numbers,
)
from airmuscle.core.plotting import new_figure, rendered
from airmuscle.design import process_pool
from airmuscle.errors import FileError, UnitError
from airmuscle.units import display


@pytest.fixture(autouse=True)
def _default_units():
    yield
    display()


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A function that writes the configuration file of this process."""
    monkeypatch.setenv("AIRMUSCLE_CONFIG_DIR", str(tmp_path))
    monkeypatch.setattr(module, "_process", [None])
    module._configured.cache_clear()
    yield lambda text: (tmp_path / CONFIG_FILE).write_bytes(
        text if isinstance(text, bytes) else text.encode()
    )
    module._configured.cache_clear()


def run() -> am.Recording:
    time = np.linspace(0.0, 1.0, 11)
    return am.Recording(
        {"time": time, "pressure": 1e5 * time, "angle": 0.1 * time, "contraction": 0.1 * time},
        "run",
    )


def labels(figure) -> list[str]:
    return [axes.get_ylabel() for axes in figure.axes]


def test_a_plot_is_in_the_chosen_units_and_the_values_are_not():
    display("bar", "deg", "1")
    figure = run().plot()
    assert labels(figure) == ["angle\n[deg]", "pressure\n[bar]", "contraction\n[-]"]
    assert figure.axes[1].lines[0].get_ydata() == pytest.approx(run()["pressure"] / 1e5)
    assert run()["pressure"][-1] == 1e5


def test_without_a_choice_the_units_are_the_usual_ones():
    assert labels(run().plot()) == ["angle\n[rad]", "pressure\n[kPa]", "contraction\n[%]"]
    assert (quantity_text(3e5, "Pa", "kPa"), contraction_text(0.125)) == ("300 kPa", "12.50 %")
    assert heading_scale("pressure [kPa]") == (1.0, "pressure [kPa]")


def test_a_level_of_noisy_values_is_written_as_the_level_that_was_set():
    assert [level_text("contraction", each, 0.24) for each in (-6e-6, 0.03001, 0.1195)] == [
        "0 %",
        "3 %",
        "11.95 %",
    ]
    assert level_text("pressure", 299_987.0, 6e5) == "300 kPa"
    assert level_text("length", 0.2, 0.0) == "200 mm"


def test_a_call_replaces_the_previous_choice_and_no_units_are_the_usual_ones():
    display("bar", "mm")
    display("psi")
    assert (quantity_text(3e5, "Pa", "kPa"), quantity_text(0.3, "m", "cm")) == (
        "43.51 psi",
        "30 cm",
    )
    display()
    assert quantity_text(3e5, "Pa", "kPa") == "300 kPa"


def test_a_block_has_its_own_units_and_ends_with_the_earlier_ones():
    display("bar")
    with display("psi"):
        with display("MPa"):
            assert quantity_text(3e5, "Pa", "kPa") == "0.3 MPa"
        assert quantity_text(3e5, "Pa", "kPa") == "43.51 psi"
    assert quantity_text(3e5, "Pa", "kPa") == "3 bar"


def test_a_block_holds_in_its_thread_only_and_a_call_in_all_threads():
    seen: list[str] = []
    display("bar")
    with display("psi"):
        thread = threading.Thread(target=lambda: seen.append(quantity_text(3e5, "Pa", "kPa")))
        thread.start()
        thread.join()
    assert seen == ["3 bar"]


def test_a_block_that_begins_after_another_call_leaves_that_call_in_force():
    block = display("psi")
    _ = display("bar")
    with block:
        assert quantity_text(3e5, "Pa", "kPa") == "43.51 psi"
    assert quantity_text(3e5, "Pa", "kPa") == "3 bar"


@pytest.mark.slow  # starts a process
def test_worker_processes_have_the_units_of_their_parent():
    display("bar")
    with process_pool(2) as pool:
        assert pool is not None
        assert pool.submit(current_units).result() == ("bar",)


@pytest.mark.parametrize(
    ("units", "said"),
    [
        (("bar", "kPa"), "'bar' and 'kPa' are units of the same quantity; choose one"),
        (("foo",), "'foo' is not a known unit"),
        (("bara",), "'bara' is absolute, but displayed pressures are gauge pressures; write 'bar'"),
        (("degC",), "'degC' cannot be chosen. Allowed are units of Pa, m, rad"),
        (("m2",), "'m2' cannot be chosen"),
        ((3,), "3 is not a unit; write texts, such as 'bar'"),
        (("",), "'' is not a unit"),
        (("x" * 300,), "cannot be chosen"),
        (("0 m",), "not a known unit"),
    ],
)
def test_wrong_and_contradictory_units_are_named_and_change_nothing(units: tuple, said: str):
    display("bar")
    with pytest.raises(UnitError, match=said):
        display(*units)
    assert current_units() == ("bar",)


def test_the_configuration_file_is_used_until_a_call_replaces_it(config):
    config('[display]\nunits = ["bar", "deg"]\n')
    assert (quantity_text(3e5, "Pa", "kPa"), labels(run().plot("angle"))) == (
        "3 bar",
        ["angle\n[deg]"],
    )
    display("psi")
    assert (quantity_text(3e5, "Pa", "kPa"), labels(run().plot("angle"))) == (
        "43.51 psi",
        ["angle\n[rad]"],
    )


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        (
            '[display]\nunits = ["bar", "psi"]',
            UnitError,
            r"config.toml: \[display\] units: 'bar' and 'psi'",
        ),
        ('[display]\nunits = "bar"', FileError, r'write \[display\] and under it units = \["bar"'),
        ("[display]\nunit = []", FileError, "unknown key 'unit'"),
        ("[colours]\na = 1", FileError, "unknown key 'colours'"),
        ("display = 3", FileError, "units must be a list"),
        ("[display", FileError, "is not valid TOML"),
        (b"\xff\xfe", FileError, "is not valid TOML"),
    ],
)
def test_an_invalid_configuration_file_is_named_with_what_to_write(
    config, text, error: type[Exception], said: str
):
    config(text)
    with pytest.raises(error, match=said):
        quantity_text(3e5, "Pa", "kPa")


def test_headings_of_other_quantities_and_ratios_that_are_no_contraction_are_kept():
    display("bar", "1", "mm")
    assert heading_scale("gauge pressure [kPa]") == (pytest.approx(0.01), "gauge pressure [bar]")
    assert heading_scale("contraction [%]") == (pytest.approx(0.01), "contraction [-]")
    for kept in (
        "rows of the record [%]",
        "pressure [kPa(a)]",
        "force [N]",
        "title",
        "rate [Pa/s]",
    ):
        assert heading_scale(kept) == (1.0, kept)


def test_declared_values_and_numbers_in_a_text_are_converted():
    display("mm")
    assert chosen_scale("m", 1.0, "m") == (pytest.approx(1000.0), "mm")
    assert scaled_numbers("1 to 2.5", 0.01) == "0.01 to 0.025"


@pytest.mark.drawn  # looks at the axes, which are relabelled as they are drawn
def test_the_axes_of_a_report_have_round_numbers_in_the_chosen_unit():
    figure, axes = new_figure()
    axes.plot([0.0, 700.0], [0.0, 1.0])
    axes.set_xlabel("gauge pressure [kPa]")
    display("psi")
    rendered(figure, ("svg",))
    assert axes.get_xlabel() == "gauge pressure [psi]"
    assert [tick.get_text() for tick in axes.get_xticklabels()][1:4] == ["0", "20", "40"]
    assert axes.lines[0].get_xdata()[-1] == 700.0


def test_tables_of_the_command_line_are_in_the_chosen_units_and_json_in_si():
    display("bar", "mm")
    point = ["evaluate", "dmsp-20-300", "--pressure", "300 kPa", "--force", "100 N"]
    shown = airmuscle(*point).stdout
    assert "3 bar" in shown
    assert "kPa" not in shown
    assert '"pressure": 300000.0' in airmuscle(*point, "--json").stdout
    table = airmuscle("show", "dmsp-20-300").stdout
    assert "geometry.radius" not in table or " mm " in table
    assert " 300 " in table


def test_files_keep_their_declared_units(tmp_path: Path):
    display("bar", "1")
    text = am.write(run(), tmp_path / "run.csv").read_text(encoding="utf-8")
    assert "pressure [Pa]" in text
    assert "bar" not in text


def test_the_code_of_the_page_runs():
    page = (Path(__file__).resolve().parents[2] / "docs" / "guides/display.md").read_text(
        encoding="utf-8"
    )
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(block, names)
    assert current_units() == ()


def test_a_user_without_a_home_folder_has_no_configuration(config, monkeypatch: pytest.MonkeyPatch):
    pwd = pytest.importorskip("pwd")

    def unknown(uid: int) -> None:
        raise KeyError(uid)

    for name in ("HOME", "XDG_CONFIG_HOME", "AIRMUSCLE_CONFIG_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(pwd, "getpwuid", unknown)
    assert module.chosen_scale("Pa", 1e-3, "kPa") == (1e-3, "kPa")


def test_a_configuration_in_a_folder_of_another_user_is_not_read(
    config, monkeypatch: pytest.MonkeyPatch
):
    def denied(self: Path, *args: object, **options: object) -> str:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_text", denied)
    with pytest.raises(FileError, match="cannot be read"):
        module.chosen_scale("Pa", 1e-3, "kPa")
    monkeypatch.setattr(module.os, "access", lambda folder, mode: False)
    assert module.chosen_scale("Pa", 1e-3, "kPa") == (1e-3, "kPa")


def test_an_angular_speed_in_hertz_is_in_turns_per_second():
    with display("Hz"):
        assert chosen_scale("rad/s", 1.0, "rad/s") == (pytest.approx(0.5 / np.pi), "Hz")
    with display("rpm"):
        assert chosen_scale("rad/s", 1.0, "rad/s") == (pytest.approx(30.0 / np.pi), "rpm")
