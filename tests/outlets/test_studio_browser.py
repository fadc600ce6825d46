"""Page of the studio in a browser: each tab as a user works with it, by mouse, by keyboard and
without a network.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

import airmuscle as am
from airmuscle.files import to_toml
from airmuscle.files.library import Location
from airmuscle.files.scenario import build_scenario

pytest.importorskip("starlette", reason="needs starlette")
pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
from studio_browser import PAGES, WAIT, address, browser, opened

__all__ = ["address", "browser"]
pytestmark = [
    pytest.mark.tool,
    pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning"),
]


def wait_for(page, tab, name):
    page.wait_for_selector(f'#panel-{tab}[data-shown="{name}"]', timeout=WAIT)


def downloaded(page, panel, name, folder):
    with page.expect_download() as download:
        page.locator(f"#panel-{panel}").get_by_role("button", name=name, exact=True).click()
    file = folder / download.value.suggested_filename
    download.value.save_as(file)
    return file


def number(page, label):
    return float(page.get_by_label(label, exact=True).input_value().replace("−", "-"))


@pytest.fixture
def muscle(browser, address):
    with opened(browser, address) as page:
        wait_for(page, "muscle", "dmsp-20-300")
        yield page


def test_two_of_three_quantities_give_the_third(muscle):
    law = am.load("dmsp-20-300").characteristic
    muscle.get_by_label("Pressure [bar]").fill("2.5")
    muscle.get_by_label("Force [N]").fill("150")
    assert number(muscle, "Contraction [%]") == pytest.approx(
        100 * law.contraction(2.5e5, 150.0), rel=1e-5
    )
    muscle.get_by_label("Solve for force").check()
    muscle.get_by_label("Contraction [%]").fill("10")
    assert number(muscle, "Force [N]") == pytest.approx(law.force(2.5e5, 0.10), rel=1e-5)
    muscle.get_by_label("Solve for pressure").check()
    muscle.get_by_label("Force [N]").fill("300")
    assert number(muscle, "Pressure [bar]") == pytest.approx(
        law.pressure(0.10, 300.0) / 1e5, rel=1e-5
    )
    muscle.get_by_label("Contraction [%]").fill("abc")
    assert muscle.get_by_label("Contraction [%]").get_attribute("aria-invalid") == "true"


def test_the_working_point_is_dragged_and_moved_by_keys(muscle):
    muscle.get_by_label("Solve for pressure").check()
    box = muscle.locator("#panel-muscle .first .chart .u-over").bounding_box()
    muscle.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    muscle.mouse.down()
    muscle.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.6 * box["height"], steps=5)
    muscle.mouse.up()
    muscle.wait_for_timeout(100)
    law = am.load("dmsp-20-300").characteristic
    contraction = number(muscle, "Contraction [%]") / 100
    force = number(muscle, "Force [N]")
    assert 0.05 < contraction < 0.15
    assert number(muscle, "Pressure [bar]") == pytest.approx(
        law.pressure(contraction, force) / 1e5, rel=1e-4
    )
    muscle.locator("#panel-muscle .first .chart").press("ArrowRight")
    assert number(muscle, "Contraction [%]") == pytest.approx(100 * contraction + 0.1, abs=2e-4)


def test_the_isobars_of_the_file_are_those_of_the_library(muscle, tmp_path):
    law = am.load("dmsp-20-300").characteristic
    rows = np.genfromtxt(
        downloaded(muscle, "muscle", "CSV", tmp_path), delimiter=",", skip_header=1
    )
    assert rows.shape == (1000, 7)
    for pressure, column in zip((1e5, 2e5, 3e5, 4e5, 5e5, 6e5), rows.T[1:], strict=True):
        inside = np.isfinite(column)
        np.testing.assert_allclose(
            column[inside], law.force(pressure, rows[inside, 0]), atol=1e-12 * 2000
        )
        assert inside.mean() > 0.95


def test_figures_and_muscle_file_are_downloaded(muscle, tmp_path):
    picture = downloaded(muscle, "muscle", "SVG", tmp_path).read_text(encoding="utf-8")
    assert picture.count("<path") > 15
    assert "contraction [%]" in picture
    assert downloaded(muscle, "muscle", "PNG", tmp_path).read_bytes().startswith(b"\x89PNG")
    file = downloaded(muscle, "muscle", "TOML", tmp_path)
    assert am.load(file).characteristic == am.load("dmsp-20-300").characteristic


def test_a_changed_parameter_reaches_chart_address_and_file(browser, address, muscle, tmp_path):
    field = muscle.locator("#panel-muscle .parameter input[type=text]").first
    field.fill("12")
    muscle.wait_for_timeout(400)
    changed = am.load(downloaded(muscle, "muscle", "TOML", tmp_path))
    assert changed.characteristic.geometry.radius == pytest.approx(0.012, rel=1e-15)
    force = changed.characteristic.contraction(3e5, 100.0)
    assert number(muscle, "Contraction [%]") == pytest.approx(100 * force, rel=1e-5)
    muscle.reload()
    muscle.wait_for_selector("html[data-ready]", timeout=WAIT)
    assert muscle.locator("#panel-muscle .parameter input[type=text]").first.input_value() == "12"
    muscle.locator("#panel-muscle .parameter input[type=text]").first.fill("-1")
    assert (
        muscle.locator("#panel-muscle .parameter input[type=text]").first.get_attribute(
            "aria-invalid"
        )
        == "true"
    )


def test_muscles_are_compared_and_own_files_are_read(muscle, tmp_path):
    muscle.get_by_label("Muscle or law of the library").select_option("chou-hannaford")
    wait_for(muscle, "muscle", "chou-hannaford")
    muscle.get_by_text("Own muscle file", exact=True).click()
    own = muscle.get_by_label("Muscle file (TOML)", exact=True)
    own.fill("title = ")
    muscle.get_by_role("button", name="Read this muscle").click()
    muscle.get_by_text("is not valid TOML").wait_for(timeout=WAIT)
    own.fill(to_toml(am.load("tondu-lopez")))
    muscle.get_by_role("button", name="Read this muscle").click()
    wait_for(muscle, "muscle", "chou-hannaford own muscle")
    heading = downloaded(muscle, "muscle", "CSV", tmp_path).read_text().partition("\n")[0]
    assert "force of own muscle at" in heading
    chosen = muscle.get_by_label("Muscle or law of the library").locator("option:checked")
    assert chosen.inner_text() == "own muscle – own file"
    muscle.get_by_label("Remove own muscle").click()
    wait_for(muscle, "muscle", "chou-hannaford")
    assert chosen.get_attribute("value") == "chou-hannaford"


def test_a_plant_runs_by_schedule_and_by_hand_and_is_simulated_from_its_file(
    browser, address, tmp_path
):
    with opened(browser, address) as page:
        page.get_by_role("tab", name="Muscle").press("ArrowRight")
        page.get_by_role("tab", name="Fit").press("ArrowRight")
        wait_for(page, "plant", "lift-dmsp-20")
        assert "steps" in page.locator("#panel-plant").inner_text()
        page.locator("#panel-plant .parameter", has_text="fill").first.get_by_role(
            "button", name="1"
        ).click()
        page.wait_for_timeout(1500)
        page.get_by_role("button", name="Run the schedule").click()
        rows = np.genfromtxt(downloaded(page, "plant", "CSV", tmp_path), delimiter=",", names=True)
        text = downloaded(page, "plant", "TOML", tmp_path).read_text(encoding="utf-8")
        plants = page.get_by_label("Plant of the library")
        panel = page.locator("#panel-plant")
        count = plants.locator("option").count()
        panel.get_by_text("Own scenario", exact=True).click()
        panel.get_by_label("Scenario (TOML)", exact=True).fill(text)
        panel.get_by_role("button", name="Read this scenario").click()
        wait_for(page, "plant", "own scenario")
        assert plants.locator("option:checked").inner_text().startswith("own scenario – ")
        plants.select_option("lift-dmsp-20")
        wait_for(page, "plant", "lift-dmsp-20")
        assert plants.locator("option").count() == count
    scenario = build_scenario(tomllib.loads(text), Location("page", "", Path()))
    recording = scenario.simulate()
    pressure = np.interp(recording["time"], rows["time_s"], rows["pressure_kPa"] * 1e3)
    assert scenario.problem.duration > 0.3
    assert pressure.max() > 5e4
    np.testing.assert_allclose(pressure, recording["pressure"], atol=2e-3 * pressure.max())


def test_a_saved_page_works_without_a_network(browser, address, tmp_path):
    with opened(browser, address) as page:
        wait_for(page, "muscle", "dmsp-20-300")
        page.get_by_label("Force [N]").fill("222")
        page.get_by_role("tab", name="Plant").click()
        wait_for(page, "plant", "lift-dmsp-20")
        with page.expect_download() as download:
            page.get_by_role("button", name="Save page").click()
        download.value.save_as(tmp_path / "saved.html")
    with opened(browser, (tmp_path / "saved.html").as_uri(), offline=True) as page:
        wait_for(page, "plant", "lift-dmsp-20")
        page.get_by_role("tab", name="Muscle").click()
        wait_for(page, "muscle", "dmsp-20-300")
        assert number(page, "Force [N]") == 222.0


def test_a_cold_page_shows_that_it_loads_and_obeys_the_first_click(browser, address):
    """The library arrives after the click; nothing takes the chosen tab back."""
    with browser.new_context() as context:
        page = context.new_page()
        held = []

        def hold(route):
            held.append(route)

        page.route("**/api/library*", hold)
        page.goto(address)
        shown = page.locator("#panel-muscle").evaluate(
            "(panel) => getComputedStyle(panel, '::before').content"
        )
        assert shown == '"Loading …"'
        assert not page.get_by_label("Muscle or law of the library").is_visible()
        page.get_by_role("tab", name="Plant").click()
        while not held:
            page.wait_for_timeout(20)
        held[0].continue_()
        page.wait_for_selector("html[data-ready]", timeout=WAIT)
        wait_for(page, "plant", "lift-dmsp-20")
        assert page.get_by_role("tab", selected=True).inner_text() == "Plant"
        assert page.locator("#panel-muscle").is_hidden()
        assert page.locator("[role=tabpanel][aria-busy]").count() == 0


def test_the_button_back_leads_to_the_tab_before_and_keeps_the_numbers(muscle):
    muscle.get_by_label("Force [N]").fill("123")
    muscle.get_by_role("tab", name="Size").click()
    muscle.get_by_role("tab", name="Plant").click()
    wait_for(muscle, "plant", "lift-dmsp-20")
    muscle.go_back()
    assert muscle.get_by_role("tab", selected=True).inner_text() == "Size"
    muscle.go_back()
    assert muscle.get_by_role("tab", selected=True).inner_text() == "Muscle"
    assert number(muscle, "Force [N]") == 123.0
    muscle.go_forward()
    assert muscle.get_by_role("tab", selected=True).inner_text() == "Size"


@pytest.mark.parametrize(
    ("text", "sentence"), [("4.5 bar", "“4.5 bar” is no number"), ("", "The field is empty")]
)
def test_a_wrong_number_has_a_sentence_and_no_results(muscle, text, sentence):
    panel = muscle.locator("#panel-muscle")
    before = number(muscle, "Contraction [%]")
    muscle.get_by_label("Pressure [bar]").fill(text)
    said = panel.get_by_role("status").inner_text()
    assert said.startswith(f"Pressure: {sentence}")
    assert "in bar, without the unit" in said
    assert muscle.get_by_label("Contraction [%]").input_value() == "–"
    assert panel.locator("dl.facts").inner_text() == ""
    muscle.get_by_label("Force [N]").fill("100")
    assert muscle.get_by_label("Pressure [bar]").input_value() == text
    muscle.get_by_label("Pressure [bar]").fill("3")
    assert number(muscle, "Contraction [%]") == before
    assert panel.get_by_role("status").inner_text() == ""


def test_a_wrong_parameter_has_a_sentence_that_says_what_is_shown(muscle):
    row = muscle.locator("#panel-muscle .parameter").first
    for text, sentence in (
        ("-1", "-1 is out of bounds, allowed: 0.1 to 200 mm."),
        ("1 cm", "“1 cm” is no number"),
    ):
        row.locator("input[type=text]").fill(text)
        assert row.get_by_role("alert").inner_text().startswith(sentence)
        assert row.get_by_role("alert").inner_text().endswith("What is shown belongs to 10 mm.")
    row.locator("input[type=text]").fill("11")
    assert row.get_by_role("alert").inner_text() == ""


def test_print_is_dark_on_white_in_dark_mode(browser, address):
    with opened(browser, address, scheme="dark") as page:
        wait_for(page, "muscle", "dmsp-20-300")
        page.evaluate(
            "addEventListener('beforeprint', () => { window.printed ="
            " document.documentElement.dataset.theme; })"
        )
        page.pdf()
        assert page.evaluate("window.printed") == "light"
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"
        page.emulate_media(media="print")
        assert not page.get_by_role("button", name="Save page").is_visible()


@pytest.mark.parametrize(("width", "scheme"), PAGES)
def test_the_page_fits_every_width(browser, address, width, scheme):
    with opened(browser, address, width=width, scheme=scheme) as page:
        assert page.evaluate("document.documentElement.dataset.theme") == scheme
        for tab, name in (("muscle", "dmsp-20-300"), ("plant", "lift-dmsp-20")):
            page.get_by_role("tab", name=tab.title()).click()
            wait_for(page, tab, name)
            assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_the_content_is_reached_by_keyboard(browser, address):
    """The first element leads to the content and keeps what is on the screen."""
    with opened(browser, address) as page:
        wait_for(page, "muscle", "dmsp-20-300")
        page.get_by_label("Force [N]").fill("321")
        page.get_by_text("Skip to the content").focus()
        page.keyboard.press("Enter")
        assert page.evaluate("document.activeElement.id") == "main"
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.tagName") == "SELECT"
        assert number(page, "Force [N]") == 321.0
        page.get_by_role("button", name="Dark").press("Enter")
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"
