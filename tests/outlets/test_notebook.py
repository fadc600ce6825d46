"""Notebooks: results show a chart and a short table, their `repr` is short, and plots accept Matplotlib axes."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from xml.dom import minidom

import numpy as np
import pytest

import airmuscle as am
from airmuscle.core import given_axes, new_figure
from airmuscle.core.short_repr import MAX_LINES, ShortRepr
from airmuscle.errors import ParameterError
from airmuscle.physics import ContractileSurface
from airmuscle.physics.muscle import parameter_rows
from airmuscle.recording.notebook import MAX_NOTES, MAX_ROWS, Card, NotebookDisplay, render_card
from airmuscle.recording.panels import panels_of

MAX_BYTES = 200_000
BULKY = re.compile(r"\b(\w*Array|NDArray|Recording|\w*Fit|Problem|Plant|System|Comparison|Study|Entry|RankedModel)\b")
"""Annotations of fields that may fill pages."""
TITLE = "<script>alert('1')</script> & \"quoted\".csv"


@pytest.fixture(scope="module")
def recording() -> am.Recording:
    law = am.load("dmsp-20-300").characteristic
    columns = {
        "pressure": np.repeat([1e5, 2e5, 3e5, 4e5], 8),
        "contraction": np.tile(np.linspace(0.0, 0.2, 8), 4),
    }
    noise = np.random.default_rng(1).normal(0.0, 3.0, 32)
    return am.Recording({**columns, "force": law.force(**columns) + noise}, TITLE, notes=("a <b>note</b>",))


@pytest.fixture(scope="module")
def displayed(recording: am.Recording) -> dict[str, NotebookDisplay]:
    names = ("dmsp-20-300", "matrix-821", "festo-dmsp-20", "joint-dmsp-20-matrix", "borzikova-monotone")
    entries = {name: am.load(name) for name in names}
    return {
        **entries,
        "muscle": entries["dmsp-20-300"].muscle,
        "plant": entries["joint-dmsp-20-matrix"].plant,
        "recording": recording,
        "fit": am.fit(ContractileSurface.blank(2), recording),
    }


def test_the_display_is_well_formed_html_without_scripts_below_200_kB(displayed: dict[str, NotebookDisplay]):
    for name, thing in displayed.items():
        html = thing._repr_html_()
        minidom.parseString(html)  # raises an error if it is not well-formed
        assert "<script" not in html, name
        assert "<b>note" not in html, name
        assert len(html.encode()) < MAX_BYTES, name
        assert ("<table" in html) or ("<img" in html), name


def test_texts_of_the_user_are_escaped(displayed: dict[str, NotebookDisplay]):
    html = displayed["recording"]._repr_html_()
    assert "&lt;script&gt;alert(&#x27;1&#x27;)&lt;/script&gt; &amp; &quot;quoted&quot;.csv" in html
    assert "a &lt;b&gt;note&lt;/b&gt;" in html


def test_a_table_states_the_meaning_of_a_list_once_and_the_default_name_of_a_muscle_once():
    law = ContractileSurface.blank(2)
    assert [row[-1] != "" for row in parameter_rows({"characteristic": law})] == [True, *5 * [False], *6 * [True]]
    muscle, valve = am.load("dmsp-20-300").muscle, am.load("matrix-821").valve
    plant = am.Plant(muscle, am.FillDischarge(am.Supply(6e5), valve, valve), am.HangingMass(5.0))
    assert ("muscle", "MartensBoblan2017, 300 mm") in [row[:2] for row in plant._card().table]


def test_a_card_counts_what_it_leaves_out():
    rows = [("name",), *((str(i),) for i in range(MAX_ROWS + 3))]
    html = render_card(Card("title", rows, None, ["note"] * (MAX_NOTES + 2)))
    assert "and 3 more" in html
    assert "and 2 more notes" in html


def test_a_chart_that_cannot_be_drawn_is_replaced_by_the_reason():
    def draw():
        raise ParameterError("no <chart>")

    assert "no chart: no &lt;chart&gt;" in render_card(Card("title", draw=draw))


def test_a_recording_of_a_million_rows_and_one_of_none_are_displayed():
    time = np.linspace(0.0, 1e3, 1_000_000)
    large = am.Recording({"time": time, **{f"m{i}.pressure": 1e5 * np.sin(i + time) for i in range(3)}}, "large")
    assert len(large._repr_html_()) < MAX_BYTES
    minidom.parseString(am.Recording({"pressure": np.array([])}, "empty")._repr_html_())
    minidom.parseString(am.Recording({"pressure": np.array([np.nan, 1.0])}, "gap")._repr_html_())


def test_the_repr_of_each_object_is_short(displayed: dict[str, NotebookDisplay]):
    wide = am.Recording({f"a{i}.pressure": np.zeros(2) for i in range(300)}, "wide")
    for thing in (*displayed.values(), wide):
        assert len(repr(thing).splitlines()) <= MAX_LINES
        assert len(repr(thing)) < 1000


def result_classes() -> Iterator[type]:
    """The dataclasses in the faces of the packages that are no models and contain arrays or other results."""
    packages = [m.name for m in pkgutil.walk_packages(am.__path__, "airmuscle.") if m.ispkg]
    for package in map(importlib.import_module, packages):
        for name in getattr(package, "__all__", ()):
            thing = getattr(package, name)
            is_result = inspect.isclass(thing) and dataclasses.is_dataclass(thing) and not hasattr(thing, "from_file")
            if is_result and any(BULKY.search(str(f.type)) for f in dataclasses.fields(thing)):
                yield thing


def test_each_public_result_has_a_short_repr():
    classes = set(result_classes())
    assert len(classes) > 30
    generated = {c for c in classes if hasattr(c.__dict__.get("__repr__"), "__wrapped__")}
    assert {c.__name__ for c in generated} == set()
    assert all(issubclass(c, ShortRepr) or "__repr__" in c.__dict__ for c in classes)


# Plots


def axes(count: int):
    return new_figure(count, 1, squeeze=False)[1][:, 0]


def test_a_plot_draws_into_given_axes_and_returns_them(displayed: dict[str, NotebookDisplay]):
    one = axes(1)[0]
    for name in ("muscle", "fit"):
        assert displayed[name].plot(ax=one) is one
    assert len(one.lines) > 5
    several = axes(3)
    assert displayed["recording"].plot(ax=several) is several
    assert [len(each.lines) for each in several] == [1, 1, 1]
    parity = tuple(axes(2))
    assert displayed["fit"].plot(ax=parity) is parity


@pytest.mark.parametrize("ax", [3, "axes", [1, 2, 3], None])
def test_axes_that_are_none_are_refused(ax):
    with pytest.raises(ParameterError, match="it must be a Matplotlib Axes or a sequence of Axes"):
        given_axes(ax, 1, "plot")


def test_too_few_axes_are_refused_with_the_number_that_is_needed(displayed: dict[str, NotebookDisplay]):
    with pytest.raises(ParameterError, match=r"3 panels need 3 Axes, but 1 is given; allowed range: at least 3"):
        displayed["recording"].plot(ax=axes(1)[0])


JOINT = ("angle", "left.pressure", "right.pressure", "left.fill", "right.discharge", "setpoint.angle", "measured.angle",
         "command.left.fill", "left.air_mass", "right.air_mass")  # fmt: skip


def test_one_panel_shows_a_quantity_with_set_point_and_measurement():
    panels = {panel.quantity: [curve.label for curve in panel.curves] for panel in panels_of(JOINT, {}, ordered=True)}
    assert panels == {
        "angle": ["angle", "set point", "measured"],
        "pressure": ["left", "right"],
        "opening": ["left.fill", "right.discharge", "command left.fill"],
        "air_mass": ["left", "right"],
    }


def test_the_set_point_of_a_pressure_regulator_is_in_the_panel_of_the_pressure():
    (panel,) = panels_of(("left.setpoint", "left.pressure"), {"left.setpoint": "Pa"}, ordered=True)
    assert [(curve.label, curve.role) for curve in panel.curves] == [("left", ""), ("set point left", "set point")]


def test_a_run_of_27_columns_of_a_joint_fits_on_a_page():
    time = np.linspace(0.0, 1.0, 5)
    sides = [f"{side}.{q}" for side in ("left", "right") for q in ("pressure", "contraction", "force", "volume", "fill",
             "mass_flow", "air_mass", "discharge", "temperature")]  # fmt: skip
    loop = ["angle", "angular_speed", "angular_acceleration", "setpoint.angle", "measured.angle", "command.left.fill"]
    figure = am.Recording({"time": time, **dict.fromkeys((*sides, *loop), time)}, "joint").plot()
    assert len(figure.axes) <= 12
    assert figure.get_figheight() <= 9.0
    assert all("[" in each.get_ylabel() for each in figure.axes)


def test_many_curves_are_named_by_colour_and_line_style():
    time = np.linspace(0.0, 1.0, 5)
    names = [f"m{i}.{quantity}" for i in range(6) for quantity in ("fill", "discharge")]
    (panel,) = am.Recording({"time": time, **dict.fromkeys(names, time)}, "arm").plot().axes
    assert [text.get_text() for text in panel.get_legend().get_texts()] == [*(f"m{i}" for i in range(6)), "fill",
                                                                            "discharge"]  # fmt: skip
