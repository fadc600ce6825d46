"""Notebooks: results show a chart and a short table, their `repr` is short, and plots accept
Matplotlib axes.
"""

from __future__ import annotations

import base64
import dataclasses
import importlib
import inspect
import pickle
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from xml.dom import minidom

import numpy as np
import pytest

import airmuscle as am
from airmuscle.core import given_axes, new_figure
from airmuscle.core.short_repr import MAX_LINES, ShortRepr
from airmuscle.errors import ParameterError
from airmuscle.physics import ContractileSurface
from airmuscle.physics.muscle import compute_isobars
from airmuscle.physics.muscle.isobars import isobar_figure
from airmuscle.recording.notebook import MAX_NOTES, MAX_ROWS, Card, NotebookDisplay, render_card
from airmuscle.recording.plot import panels_of

MAX_BYTES = 200_000
BULKY = re.compile(
    r"\b(\w*Array|ndarray|Recording|\w*Fit|Problem|Plant|System|Comparison|Study|Entry|RankedModel)\b"
)
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
    return am.Recording(
        {**columns, "force": law.force(**columns) + noise}, TITLE, notes=("a <b>note</b>",)
    )


@pytest.fixture(scope="module")
def displayed(recording: am.Recording) -> dict[str, NotebookDisplay]:
    names = (
        "dmsp-20-300",
        "matrix-821",
        "festo-dmsp-20",
        "joint-dmsp-20-matrix",
        "borzikova-monotone",
    )
    entries = {name: am.load(name) for name in names}
    lift = am.design.LiftRequirement(stroke=0.03, force=300.0)
    return {
        **entries,
        "muscle": entries["dmsp-20-300"].muscle,
        "plant": entries["joint-dmsp-20-matrix"].plant,
        "recording": recording,
        "fit": am.fit(ContractileSurface.blank(2), recording),
        "inspection": am.bench.inspect(recording),
        "sizing": am.design.size_muscles(
            lift, am.design.SizingConditions(6e5, max_count=1), (entries[names[0]],)
        ),
    }


def test_the_display_is_well_formed_html_without_scripts_below_200_kB(
    displayed: dict[str, NotebookDisplay],
):
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


def test_a_table_states_the_default_name_of_a_muscle_once():
    muscle = am.load("dmsp-20-300").muscle
    valve = am.load("matrix-821").valve
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
    large = am.Recording(
        {"time": time, **{f"m{i}.pressure": 1e5 * np.sin(i + time) for i in range(3)}}, "large"
    )
    assert len(large._repr_html_()) < MAX_BYTES
    minidom.parseString(am.Recording({"pressure": np.array([])}, "empty")._repr_html_())
    minidom.parseString(am.Recording({"pressure": np.array([np.nan, 1.0])}, "gap")._repr_html_())


def test_the_repr_of_each_object_is_short(displayed: dict[str, NotebookDisplay]):
    wide = am.Recording({f"a{i}.pressure": np.zeros(2) for i in range(300)}, "wide")
    for thing in (*displayed.values(), wide):
        assert len(repr(thing).splitlines()) <= MAX_LINES
        assert len(repr(thing)) < 1000


def result_classes() -> Iterator[type]:
    """The dataclasses in the faces of the rooms that are no models and contain arrays or other
    results.
    """
    packages = [m.name for m in pkgutil.iter_modules(am.__path__, "airmuscle.") if m.ispkg]
    for package in map(importlib.import_module, packages):
        for name in getattr(package, "__all__", ()):
            thing = getattr(package, name)
            is_result = (
                inspect.isclass(thing)
                and dataclasses.is_dataclass(thing)
                and not hasattr(thing, "from_file")
            )
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


def test_too_few_axes_are_refused_with_the_number_that_is_needed(
    displayed: dict[str, NotebookDisplay],
):
    with pytest.raises(
        ParameterError, match=r"3 panels need 3 Axes, but 1 is given; allowed range: at least 3"
    ):
        displayed["recording"].plot(ax=axes(1)[0])


JOINT = (
    "angle",
    "left.pressure",
    "right.pressure",
    "left.fill",
    "right.discharge",
    "setpoint.angle",
    "measured.angle",
    "command.left.fill",
    "left.air_mass",
    "right.air_mass",
)


def test_one_panel_shows_a_quantity_with_set_point_and_measurement():
    panels = {
        panel.quantity: [curve.label for curve in panel.curves]
        for panel in panels_of(JOINT, {}, ordered=True)
    }
    assert panels == {
        "angle": ["angle", "set point", "measured"],
        "pressure": ["left", "right"],
        "opening": ["left.fill", "right.discharge", "command left.fill"],
        "air_mass": ["left", "right"],
    }


def test_the_set_point_of_a_pressure_regulator_is_in_the_panel_of_the_pressure():
    (panel,) = panels_of(("left.setpoint", "left.pressure"), {"left.setpoint": "Pa"}, ordered=True)
    assert [(curve.label, curve.role) for curve in panel.curves] == [
        ("left", ""),
        ("set point left", "set point"),
    ]


def test_a_run_of_27_columns_of_a_joint_fits_on_a_page():
    time = np.linspace(0.0, 1.0, 5)
    sides = [
        f"{side}.{q}"
        for side in ("left", "right")
        for q in (
            "pressure",
            "contraction",
            "force",
            "volume",
            "fill",
            "mass_flow",
            "air_mass",
            "discharge",
            "temperature",
        )
    ]
    loop = [
        "angle",
        "angular_speed",
        "angular_acceleration",
        "setpoint.angle",
        "measured.angle",
        "command.left.fill",
    ]
    figure = am.Recording({"time": time, **dict.fromkeys((*sides, *loop), time)}, "joint").plot()
    assert len(figure.axes) <= 12
    assert figure.get_figheight() <= 9.0
    assert all("[" in each.get_ylabel() for each in figure.axes)


def test_many_curves_are_named_by_colour_and_line_style():
    time = np.linspace(0.0, 1.0, 5)
    names = [f"m{i}.{quantity}" for i in range(6) for quantity in ("fill", "discharge")]
    (panel,) = am.Recording({"time": time, **dict.fromkeys(names, time)}, "arm").plot().axes
    assert [text.get_text() for text in panel.get_legend().get_texts()] == [
        *(f"m{i}" for i in range(6)),
        "fill",
        "discharge",
    ]


def test_a_plot_shows_its_picture_as_the_last_line_of_a_cell(recording: am.Recording):
    figure = recording.plot("pressure")
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert pickle.loads(pickle.dumps(figure))._repr_png_() == figure._repr_png_()


@pytest.mark.tool
def test_a_kernel_shows_the_picture_and_the_card(tmp_path: Path):
    nbclient = pytest.importorskip("nbclient", reason="needs the package nbclient")
    nbformat = pytest.importorskip("nbformat", reason="needs the package nbformat")
    pytest.importorskip("ipykernel", reason="needs the package ipykernel")
    cells = (
        "import airmuscle as am\nbench = am.load_data('dmsp-20-300')\nbench",
        "fit = am.fit(am.characteristic.ContractileSurface.blank(3), bench)\nfit.plot()",
        "import matplotlib.pyplot as plt\nfit.plot()",
    )
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in cells])
    nbclient.NotebookClient(
        notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    card, *plots = [
        [output["data"] for output in cell["outputs"] if "data" in output]
        for cell in notebook.cells
    ]
    assert "<table" in card[0]["text/html"]
    for shown in plots:
        assert len(shown) == 1
        assert base64.b64decode(shown[0]["image/png"]).startswith(b"\x89PNG")


def test_a_legend_is_inside_the_axes_of_a_caller(recording: am.Recording):
    """Unless its figure has a layout, which makes room for a legend outside."""
    import matplotlib.figure

    for layout, inside in ((None, True), ("constrained", False)):
        figure = matplotlib.figure.Figure(layout=layout)
        axes = figure.subplots()
        run = dataclasses.replace(
            recording, columns={"left.force": recording["force"], "right.force": recording["force"]}
        )
        run.plot(ax=axes)
        figure.draw_without_rendering()
        legend = axes.get_legend().get_window_extent()
        box = axes.get_window_extent()
        assert (legend.x1 <= box.x1 + 1) == inside
        assert legend.x1 <= figure.bbox.x1


def test_a_pulsed_input_is_drawn_as_duty_cycle_and_envelope():
    """Pulses of 30 % at 100 Hz for 2 s: the curve is 0.3, the envelope reaches from 0 to 1."""
    starts = np.arange(0.0, 2.0, 0.01)
    time = np.sort(np.concatenate([starts, starts + 0.003]))
    values = np.tile([1.0, 0.0], starts.size)
    axes = am.Recording({"time": time, "fill": values}, "pulses").plot().axes[0]
    middles, means = axes.get_lines()[0].get_data()
    assert len(means) <= 150
    assert np.mean(means[(middles > 0.05) & (middles < 1.9)]) == pytest.approx(0.3, rel=0.02)
    (envelope,) = axes.collections
    assert (
        envelope.get_paths()[0].vertices[:, 1].min(),
        envelope.get_paths()[0].vertices[:, 1].max(),
    ) == (0.0, 1.0)
    for other in (np.sin(20.0 * time), np.zeros_like(time)):
        axes = am.Recording({"time": time, "fill": other}, "no pulses").plot().axes[0]
        assert len(axes.get_lines()[0].get_xdata()) == len(time)
        assert len(axes.collections) == 0


def test_the_lines_of_a_model_are_over_the_points_of_many_rows(recording: am.Recording):
    law = am.load("dmsp-20-300").characteristic
    for rows in (32, 2720):
        given = recording.rows(np.tile(np.arange(32), rows // 32))
        curves = compute_isobars(law, pressures=np.unique(given["pressure"]))
        figure = isobar_figure(law, "isobars", curves, measured=given)
        lines = [line for line in figure.axes[0].get_lines() if len(line.get_xdata())]
        points = max(line.get_zorder() for line in lines if line.get_linestyle() == "None")
        curves = min(line.get_zorder() for line in lines if line.get_linestyle() != "None")
        assert (curves > points) == (rows > 500)
