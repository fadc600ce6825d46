"""Figures of a fit to isometric ramps: force over pressure by contraction and length, and titles of
any length.

The pressures of isobars are round where the pressure was swept. The names of many files are
abridged in figures, in the muscle file and in the report. Many markers are an image in SVG files,
whose size they would multiply.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle import load
from airmuscle.bench import Fit, fit, fit_chapter
from airmuscle.bench.estimation import is_pressure_ramp, levels_of
from airmuscle.bench.statics.static_fit_chapter import band_plot, ramp_plot
from airmuscle.core.plotting import MAX_VECTOR_MARKERS, new_figure, rendered, save
from airmuscle.files import Entry
from airmuscle.files.library import list_files
from airmuscle.physics import ContractileSurface
from airmuscle.physics.muscle import compute_isobars
from airmuscle.physics.muscle.isobars import isobar_figure
from airmuscle.recording import Recording

pytestmark = pytest.mark.drawn
LENGTHS = (0.083, 0.182, 0.382)
CONTRACTIONS = (0.0, 0.04, 0.08, 0.12)


def a_ramp(length: float, contraction: float) -> Recording:
    """A ramp up and down with one row before the valve opens, as pulsed valves give it; numbers are
    chosen.
    """
    scatter = np.random.default_rng(int(1e6 * (length + contraction))).uniform(-4e3, 4e3, 120)
    up = np.linspace(60e3, 620e3, 60)
    pressure = np.concatenate([[8180.0], np.concatenate([up, up[::-1]]) + scatter])
    force = np.maximum(0.0, 6e-4 * pressure * (1.0 - 6.0 * contraction) * (1.0 + length) - 20.0)
    columns = {
        "pressure": pressure,
        "contraction": np.full(pressure.size, contraction),
        "force": force,
    }
    name = f"rig_cut{100 * length:.1f}cm_held{100 * length * (1 - contraction):.3f}cm.csv"
    return Recording(columns, name, {"resting_length": length})


@pytest.fixture(scope="module")
def ramps() -> list[Recording]:
    return [a_ramp(length, contraction) for length in LENGTHS for contraction in CONTRACTIONS]


@pytest.fixture(scope="module")
def fitted(ramps: list[Recording]) -> Fit:
    return fit(ContractileSurface.blank(3, max_force=1e3), ramps)


def an_entry(fitted: Fit) -> Entry:
    return Entry(
        "muscle", "Ramps", "fitted", fitted.model, None, validity_range=fitted.validity_range
    )


def texts(figure: Any) -> str:
    return " ".join(
        t.get_text()
        for axes in figure.axes
        for t in (axes.get_legend() or axes).findobj(match=is_text)
    )


def is_text(artist: Any) -> bool:
    return hasattr(artist, "get_text")


def test_ramps_are_drawn_as_force_over_pressure_for_each_contraction_and_length(
    fitted: Fit,
) -> None:
    plot = ramp_plot(fitted)
    assert plot is not None
    panels = [axes for axes in plot.draw().axes if axes.get_visible()]
    assert [axes.get_title() for axes in panels] == [
        f"resting length {1e3 * x:.4g} mm" for x in LENGTHS
    ]
    for axes in panels:
        assert axes.get_xlabel() == "gauge pressure [kPa]"
        labels = [text.get_text() for text in axes.get_legend().get_texts()]
        assert labels == ["0 %", "4 %", "8 %", "12 %"]
        points = [line for line in axes.lines if line.get_linestyle() == "None"]
        assert [len(line.get_xdata()) for line in points] == [121] * 4


def test_the_curve_of_a_ramp_is_the_force_of_the_law_at_its_contraction(fitted: Fit) -> None:
    plot = ramp_plot(fitted)
    assert plot is not None
    curve = next(line for line in plot.draw().axes[1].lines if line.get_label() == "8 %")
    expected = fitted.model.force(1e3 * np.asarray(curve.get_xdata()), 0.08)
    assert curve.get_ydata() == pytest.approx(expected)


def test_isobars_of_ramps_have_round_pressures_and_neither_the_first_row_nor_a_median(
    fitted: Fit,
) -> None:
    plots = {plot.name: plot for plot in fit_chapter(fitted, an_entry(fitted)).plots}
    labels = texts(plots["isobars"].draw())
    assert "100 kPa" in labels
    assert "600 kPa" in labels
    assert "8.18" not in labels
    assert list(plots) == ["ramps", "isobars", "errors", "bands"]


def test_bands_of_ramps_are_drawn_over_the_pressure(fitted: Fit) -> None:
    plot = band_plot(fitted)
    assert plot is not None
    assert plot.draw().axes[0].get_xlabel() == "pressure [kPa]"
    assert plot.draw().axes[0].lines[0].get_label() == "0 %"


def test_a_ramp_beside_one_level_has_no_level_at_its_median() -> None:
    pressure = np.concatenate([[8180.0], np.linspace(60e3, 620e3, 500)])
    assert levels_of(pressure, 3) == pytest.approx([1.1e5, 3.4e5, 5.6e5])
    assert is_pressure_ramp(pressure, np.repeat([0.0, 0.05, 0.1], 167))
    assert not is_pressure_ramp(np.repeat([1e5, 2e5, 3e5], 167), np.linspace(0.0, 0.2, 501))


def test_points_at_levels_of_pressure_have_no_figure_of_ramps() -> None:
    pressure, contraction = (
        grid.ravel() for grid in np.meshgrid([1e5, 2e5, 3e5, 4e5], np.linspace(0, 0.1, 6))
    )
    columns = {
        "pressure": pressure,
        "contraction": contraction,
        "force": 1e-3 * pressure * (1.0 - 3.0 * contraction),
    }
    assert (
        ramp_plot(fit(ContractileSurface.blank(1, max_force=1e3), Recording(columns, "points")))
        is None
    )


def test_a_title_of_many_file_names_leaves_the_axes_their_place(
    fitted: Fit, tmp_path: Path
) -> None:
    title = "Law fitted to " + ", ".join(f"festo10_cut40cm_held38.2cm_test{i}" for i in range(24))
    entry = an_entry(fitted)
    curves = compute_isobars(fitted.model, entry.validity_range)
    figure = isobar_figure(
        fitted.model, title, curves, entry.validity_range, measured=fitted.recording
    )
    save(figure, tmp_path / "isobars.png")
    assert figure.axes[0].get_position().height > 0.6
    assert figure.axes[0].get_position().width > 0.5


def test_file_names_are_abridged_beyond_three() -> None:
    assert list_files(["a", "b", "c"]) == "a, b, c"
    assert list_files([f"run{i:02}" for i in range(24)]) == "24 files, run00 to run23"
    assert len(list_files(["x" * 300])) <= 61


def test_the_muscle_file_of_many_recordings_has_a_short_title_and_note(
    tmp_path: Path, ramps: list[Recording]
) -> None:
    paths = []
    for run in ramps:
        paths.append(tmp_path / run.origin)
        rows = zip(run["pressure"], run["contraction"], run["force"], strict=True)
        lines = [f"{p / 1e3},{c},{f}" for p, c, f in rows]
        paths[-1].write_text(
            "pressure [kPa],contraction [1],force [N]\n" + "\n".join(lines), encoding="utf-8"
        )
    options = [
        "--characteristic",
        "ContractileSurface",
        "--degree",
        "2",
        "--out",
        str(tmp_path / "fit"),
    ]
    result = airmuscle("fit", *map(str, paths), *options)
    assert result.exit_code == 0, result.output
    muscle = tomllib.loads((tmp_path / "fit" / "muscle.toml").read_text(encoding="utf-8"))
    assert len(muscle["title"]) < 160
    assert "12 files" in muscle["title"]
    assert muscle["note"].count(".csv") == 2
    assert load(tmp_path / "fit" / "muscle.toml").title == muscle["title"]


@pytest.mark.parametrize(
    ("count", "image"), [(MAX_VECTOR_MARKERS // 10, False), (MAX_VECTOR_MARKERS + 1, True)]
)
def test_many_markers_are_an_image_and_few_are_vectors(count, image):
    figure, axes = new_figure()
    axes.plot(np.arange(count), np.arange(count) % 7, "o")
    axes.plot([0, 1], [0, 1])
    svg = rendered(figure, ("svg",))["svg"]
    assert (b"<image" in svg) is image
    assert (svg.count(b"<use") > count) is not image
