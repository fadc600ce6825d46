"""Tabs Joint and Size in a browser: as a user works with them, by mouse, by keyboard and without a
network.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from airmuscle.design import LiftRequirement, SizingConditions, size_muscles
from airmuscle.files.library import Location, plant_tables
from airmuscle.files.scenario import build_scenario
from airmuscle.outlets import export_page
from airmuscle.physics import joint_statics

pytest.importorskip("starlette", reason="needs starlette")
pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
from studio_browser import PAGES, address, browser, opened

__all__ = ["address", "browser"]
pytestmark = [
    pytest.mark.tool,
    pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning"),
]
FIRST = "joint-dmsp-20-proportional"
WAIT = 180_000


def shown(page, tab, name=None):
    page.get_by_role("tab", name=tab).click()
    chosen = f'="{name}"' if name else ""
    page.wait_for_selector(f"#panel-{tab.lower()}[data-shown{chosen}]", timeout=WAIT)
    return page.locator(f"#panel-{tab.lower()}")


def saved(page, panel, name, folder):
    with page.expect_download() as download:
        panel.get_by_role("button", name=name, exact=True).click()
    file = folder / download.value.suggested_filename
    download.value.save_as(file)
    return file


def after_next_run(page, panel, action):
    before = panel.get_attribute("data-runs")
    action()
    page.wait_for_function(
        "([id, n]) => document.getElementById(id).dataset.runs !== n",
        arg=["panel-joint", before],
        timeout=WAIT,
    )


def columns(page, panel, folder):
    return np.genfromtxt(
        saved(page, panel, "CSV", folder), delimiter=",", names=True, deletechars=""
    )


def test_a_gain_and_the_feed_forward_change_the_step_and_the_frequency_response(
    browser, address, tmp_path
):
    with opened(browser, address) as page:
        panel = shown(page, "Joint", FIRST)
        first = columns(page, panel, tmp_path)
        text = panel.locator("section", has_text="Open loop of the angle").inner_text()
        slider = panel.get_by_label("proportional gain, K")
        box = slider.bounding_box()
        page.mouse.move(box["x"] + 0.61 * box["width"], box["y"] + box["height"] / 2)
        page.mouse.down()
        after_next_run(
            page,
            panel,
            lambda: page.mouse.move(
                box["x"] + 0.3 * box["width"], box["y"] + box["height"] / 2, steps=4
            ),
        )
        page.mouse.up()
        page.wait_for_timeout(300)
        second = columns(page, panel, tmp_path)
        assert panel.locator("section", has_text="Open loop of the angle").inner_text() != text
        assert np.ptp(first["angle_[deg]"] - second["angle_[deg]"]) > 0.5
        after_next_run(page, panel, lambda: panel.get_by_label("Feed-forward").uncheck())
        third = columns(page, panel, tmp_path)
        begun = third["time_[s]"] > 0.2
        assert (
            np.abs(third["angle_[deg]"] - 15.0)[begun].mean()
            > np.abs(second["angle_[deg]"] - 15.0)[begun].mean()
        )
        after_next_run(page, panel, lambda: slider.press("ArrowRight"))
        after_next_run(page, panel, lambda: panel.get_by_role("button", name="Reset gains").click())
        assert panel.get_by_label("K proportional gain").input_value() == "2"


def test_the_working_point_is_dragged_and_moved_by_keys_within_the_region(
    browser, address, tmp_path
):
    tables, location = plant_tables(FIRST)
    statics = joint_statics(
        build_scenario({k: tables[k] for k in ("plant", "run")}, location).plant
    )
    with opened(browser, address) as page:
        panel = shown(page, "Joint", FIRST)
        chart = panel.get_by_role("application")
        chart.scroll_into_view_if_needed()
        box = chart.locator(".u-over").bounding_box()
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        page.mouse.down()
        after_next_run(
            page,
            panel,
            lambda: page.mouse.move(
                box["x"] + 0.62 * box["width"], box["y"] + 0.6 * box["height"], steps=3
            ),
        )
        page.mouse.up()
        page.wait_for_timeout(300)
        rows = columns(page, panel, tmp_path)
        angle = np.radians(rows["angle_[deg]"][0])
        stiffness = rows["stiffness_[N_m/rad]"][0]
        found = statics.pressures(angle, stiffness).pressures[0, 0] / 1e3
        np.testing.assert_allclose(
            [rows["left.pressure_[kPa]"][0], rows["right.pressure_[kPa]"][0]], found, rtol=1e-6
        )
        assert 5.0 < rows["angle_[deg]"][0] < 20.0
        after_next_run(page, panel, lambda: chart.press("ArrowRight"))
        assert columns(page, panel, tmp_path)["angle_[deg]"][0] == pytest.approx(
            np.degrees(angle) + 1.0
        )
        after_next_run(page, panel, lambda: chart.press("Shift+ArrowUp"))
        for _ in range(12):
            chart.press("Shift+ArrowUp")
        page.wait_for_timeout(500)
        stiffest = float(statics.stiffness_limits(angle + np.radians(1.0))[1][0])
        assert columns(page, panel, tmp_path)["stiffness_[N_m/rad]"][0] <= stiffest


def test_every_joint_controller_and_task_runs(browser, address):
    with opened(browser, address) as page:
        panel = shown(page, "Joint", FIRST)
        for name in ("joint-dmsp-20-matrix", "joint-dmsp-20-regulators"):
            panel.get_by_label("Joint of the library").select_option(name)
            page.wait_for_selector(f'#panel-joint[data-shown="{name}"]', timeout=WAIT)
            for controller in ("cascade", "stiffness", "pid"):
                after_next_run(
                    page,
                    panel,
                    lambda key=controller: panel.get_by_label("Controller").select_option(key),
                )
            for task in ("sine 2 Hz", "load change", "stiffness change"):
                after_next_run(
                    page, panel, lambda each=task: panel.get_by_label("Task").select_option(each)
                )
                assert "ended" not in panel.locator(".facts").first.inner_text()


def test_muscles_are_found_shown_and_simulated_from_their_file(browser, address, tmp_path):
    with opened(browser, address) as page:
        panel = shown(page, "Size")
        panel.get_by_label("Load", exact=True).fill("15 kg")
        panel.get_by_label("Maximum length").fill("350 mm")
        panel.get_by_role("button", name="Find muscles").click()
        page.wait_for_selector('#panel-size[data-shown^="15 kg (147.1 N)"]', timeout=WAIT)
        names = panel.locator(".choices tbody tr td:first-child").all_inner_texts()
        wanted = size_muscles(
            LiftRequirement(stroke=0.04, mass=15.0), SizingConditions(6e5, max_length=0.35)
        )
        assert names == [choice.entry.name for choice in wanted.choices]
        lengths = [
            float(t) for t in panel.locator(".choices tbody tr td:nth-child(3)").all_inner_texts()
        ]
        np.testing.assert_allclose(
            lengths, [1e3 * choice.length for choice in wanted.choices], rtol=5e-4
        )
        text = saved(page, panel, "Scenario (TOML)", tmp_path).read_text(encoding="utf-8")
        recording = build_scenario(tomllib.loads(text), Location("page", "", Path())).simulate()
        assert np.ptp(recording["position"]) == pytest.approx(0.04, rel=0.03)
        panel.get_by_label("Stroke").fill("4 m")
        panel.get_by_role("button", name="Find muscles").click()
        panel.get_by_text("Reachable:").wait_for(timeout=WAIT)
        panel.get_by_label("Stroke").fill("40")
        panel.get_by_role("button", name="Find muscles").click()
        panel.get_by_role("alert").filter(has_text="stroke: ").wait_for(timeout=WAIT)


def test_a_saved_page_contains_joint_and_sizing(browser, address, tmp_path):
    with opened(browser, address) as page:
        choices = shown(page, "Size").locator(".choices").inner_text()
        assert "dmsp-20" in choices
        panel = shown(page, "Joint", FIRST)
        after_next_run(
            page,
            panel,
            lambda: (
                panel.get_by_label("T_d, derivative time")
                .or_(panel.get_by_label("derivative time; 0: no derivative, T_d"))
                .press("ArrowRight")
            ),
        )
        facts = panel.locator(".facts").first.locator("dd").first.inner_text()
        with page.expect_download() as download:
            page.get_by_role("button", name="Save page").click()
        download.value.save_as(tmp_path / "saved.html")
    with opened(browser, (tmp_path / "saved.html").as_uri(), offline=True) as page:
        panel = shown(page, "Joint", FIRST)
        assert panel.locator(".facts").first.locator("dd").first.inner_text() == facts
        assert shown(page, "Size").locator(".choices").inner_text() == choices


def test_a_page_is_written_with_the_tab_joint(browser, tmp_path):
    file = export_page(["joint-dmsp-20-regulators"], tmp_path / "page.html")
    with opened(browser, file.as_uri(), offline=True) as page:
        panel = shown(page, "Joint", "joint-dmsp-20-regulators")
        after_next_run(page, panel, lambda: panel.get_by_label("Task").select_option("sine 1 Hz"))
        assert "rms error" in panel.inner_text()


@pytest.mark.parametrize(("width", "scheme"), PAGES)
def test_both_tabs_fit_every_width(browser, address, width, scheme):
    with opened(browser, address, width=width, scheme=scheme) as page:
        for tab in ("Joint", "Size"):
            shown(page, tab)
            assert page.evaluate("document.documentElement.scrollWidth") <= width
