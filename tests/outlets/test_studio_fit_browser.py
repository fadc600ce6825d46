"""Tab Fit in a browser: files are dropped, corrected, selected on the chart and fitted, as a user
does it.
"""

from __future__ import annotations

import base64
import contextlib
import io
import time
import zipfile

import numpy as np
import pytest

import airmuscle as am

pytest.importorskip("starlette", reason="needs starlette")
pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
from arm_episodes import made_episodes
from studio_browser import PAGES, WAIT, address, browser, opened

__all__ = ["address", "browser"]
pytestmark = pytest.mark.tool
FIT = 600_000
"""Limit [ms] of a fit on a machine that is occupied."""
DROP = """([name, content]) => {
    const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0)), data = new DataTransfer();
    data.items.add(new File([bytes], name));
    const place = document.querySelector("#panel-fit .drop");
    for (const type of ["dragenter", "dragover", "drop"]) place.dispatchEvent(new DragEvent(type, { dataTransfer: data, bubbles: true, cancelable: true }));
}"""


def table(seed=0, rows=12):
    """Isobars of a muscle as a CSV file whose pressure has no unit."""
    law = am.load("dmsp-20-300").characteristic
    noise = np.random.default_rng(seed)
    lines = ["time [s],pressure,contraction [%],force [N]"]
    for i, (pressure, contraction) in enumerate(
        (p, c) for p in (1, 2, 3, 4) for c in np.linspace(0, 0.17, rows)
    ):
        force = max(float(law.force(pressure * 1e5, contraction)), 0.0) + noise.normal(0, 1)
        lines.append(f"{i},{pressure},{100 * contraction:.3f},{force:.2f}")
    return "\n".join(lines).encode()


def drop(page, name, content):
    count = reads(page)
    page.evaluate(DROP, [name, base64.b64encode(content).decode()])
    wait_for_read(page, count)


def reads(page):
    return int(page.locator("#panel-fit").get_attribute("data-read") or 0)


def wait_for_read(page, count):
    """Wait until the server has read the files once more; the policy of the page permits no
    function of a test.
    """
    end = time.monotonic() + WAIT / 1e3
    while reads(page) <= count:
        assert time.monotonic() < end, "the files were not read"
        page.wait_for_timeout(50)


def correct(page, label, text):
    count = reads(page)
    field = page.get_by_label(label, exact=True)
    field.fill(text)
    field.press("Enter")
    wait_for_read(page, count)


@contextlib.contextmanager
def fit_tab(browser, address, **options):
    with opened(browser, address, **options) as page:
        page.get_by_role("tab", name="Fit").click()
        yield page


def panel_text(page):
    return page.locator("#panel-fit").inner_text()


def test_a_user_fits_a_file_and_downloads_the_muscle(browser, address, tmp_path):
    """Drop, correct a unit, leave rows out, fit, reload in the middle, look, download."""
    with fit_tab(browser, address) as page:
        drop(page, "bench.csv", table())
        start = page.get_by_role("button", name="Fit and compare all laws")
        assert start.is_disabled()
        assert "unit of 'pressure' (pressure) is not stated" in panel_text(page)
        correct(page, "Unit of pressure", "barr")
        assert "Did you mean 'bar'?" in panel_text(page)
        assert (
            page.get_by_label("Unit of pressure", exact=True).get_attribute("aria-invalid")
            == "true"
        )
        correct(page, "Unit of pressure", "bar")
        assert "48 of 48 shown rows are used" in panel_text(page)
        count = reads(page)
        box = page.locator("#panel-fit .u-over").first.bounding_box()
        page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 2)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] - 2, box["y"] + box["height"] - 2, steps=4)
        page.mouse.up()
        wait_for_read(page, count)
        assert "left out: contraction" in panel_text(page)
        assert "40 of 48 shown rows are used" in panel_text(page)
        assert start.is_enabled()
        start.click()
        page.get_by_role("button", name="Cancel").wait_for(timeout=WAIT)
        page.reload()
        page.wait_for_selector("html[data-ready]", timeout=WAIT)
        assert page.get_by_label("Unit of pressure", exact=True).input_value() == "bar"
        page.wait_for_selector("#panel-fit[data-task=done]", timeout=FIT)
        assert "Recommended:" in panel_text(page)
        assert page.locator("#panel-fit math").count() > 0
        assert page.get_by_text("40 rows were used").is_visible()
        with page.expect_download() as download:
            page.get_by_role("link", name="Muscle (TOML)").click()
        download.value.save_as(tmp_path / "muscle.toml")
        shown = page.locator("#panel-fit .headline strong").inner_text()
        page.reload()
        page.wait_for_selector("#panel-fit[data-task=done]", timeout=WAIT)
        assert page.locator("#panel-fit .headline strong").inner_text() == shown
    muscle = am.load(tmp_path / "muscle.toml")
    assert muscle.provenance == "fitted"
    assert muscle.characteristic.force(2.5e5, 0.06) == pytest.approx(
        am.load("dmsp-20-300").characteristic.force(2.5e5, 0.06), rel=0.1
    )


def test_a_fit_is_cancelled_and_started_again(browser, address):
    with fit_tab(browser, address) as page:
        drop(page, "bench.csv", table().replace(b"pressure", b"pressure [bar]"))
        page.get_by_role("button", name="Fit and compare all laws").click()
        page.get_by_role("button", name="Cancel").click()
        page.wait_for_selector("#panel-fit[data-task=cancelled]", timeout=WAIT)
        assert "The fit was cancelled." in panel_text(page)
        assert page.get_by_role("button", name="Fit and compare all laws").is_enabled()


def test_rows_are_selected_by_click_by_numbers_and_by_run(browser, address):
    with fit_tab(browser, address) as page:
        drop(page, "bench.csv", table().replace(b"pressure", b"pressure [bar]"))
        count = reads(page)
        page.get_by_label("Selection from").fill("10")
        page.get_by_label("Selection to").fill("17,5")
        page.get_by_role("button", name="Apply").click()
        wait_for_read(page, count)
        assert "28 of 48 shown rows are used" in panel_text(page)
        count = reads(page)
        page.get_by_text("Runs (4)").click()
        page.get_by_label("Use isobaric pressure 100 kPa, bench.csv, rows 1 to 12").uncheck()
        wait_for_read(page, count)
        assert "21 of 48 shown rows are used" in panel_text(page)
        count = reads(page)
        page.get_by_role("button", name="Use all rows").click()
        wait_for_read(page, count)
        assert "48 of 48 shown rows are used" in panel_text(page)
        plot = page.locator("#panel-fit .u-over").first
        margin = 0.05 / 1.1
        plot.scroll_into_view_if_needed()
        count = reads(page)
        box = plot.bounding_box()
        page.mouse.click(box["x"] + margin * box["width"], box["y"] + margin * box["height"])
        wait_for_read(page, count)
        assert "47 of 48 shown rows are used" in panel_text(page)


def test_two_users_do_not_see_each_others_files(browser, address):
    with fit_tab(browser, address) as one, fit_tab(browser, address) as other:
        drop(one, "mine.csv", table())
        assert "mine.csv" in panel_text(one)
        assert "mine.csv" not in panel_text(other)
        drop(other, "theirs.csv", table())
        assert "mine.csv" not in panel_text(other)


def test_bad_files_and_lost_sets_are_explained(browser, address):
    with fit_tab(browser, address) as page:
        drop(page, "picture.csv", b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
        assert "the file is a PNG image" in panel_text(page)
        page.get_by_label("Remove picture.csv").click()
        page.get_by_text("picture.csv").first.wait_for(state="detached", timeout=WAIT)


@pytest.mark.parametrize(("width", "scheme"), PAGES)
def test_the_tab_fits_every_width(browser, address, width, scheme):
    with fit_tab(browser, address, width=width, scheme=scheme) as page:
        drop(
            page,
            "bench with a long name of many words in it.csv",
            table().replace(b"pressure", b"pressure [bar]"),
        )
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_user_identifies_an_arm_from_an_archive_of_episodes(browser, address):
    """Drop, look at what the record contains and at the proposed mapping, cancel, fit, look at the
    result.
    """
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as file:
        for number, run in enumerate(made_episodes(20).runs):
            rows = [
                ",".join(f"{v:.7g}" for v in row)
                for row in np.column_stack([run.angle, run.pressure / 1e3])
            ]
            file.writestr(f"{number:02d}.csv", "angle,p1,p2\n" + "\n".join(rows))
    with fit_tab(browser, address) as page:
        drop(page, "episodes.zip", data.getvalue())
        mapping = page.get_by_label("Mapping (TOML)")
        assert 'columns = ["p1", "p2"]' in mapping.input_value()
        count = reads(page)
        mapping.fill(mapping.input_value().replace('unit = "?"', 'unit = "kPa"'))
        mapping.blur()
        wait_for_read(page, count)
        assert "pressure 1 raises angle 1" in panel_text(page)
        correct_lines = mapping.input_value().replace('"angle"', '"angel"')
        count = reads(page)
        mapping.fill(correct_lines)
        mapping.blur()
        wait_for_read(page, count)
        assert "no column 'angel'" in panel_text(page)
        count = reads(page)
        mapping.fill(correct_lines.replace("angel", "angle"))
        mapping.blur()
        wait_for_read(page, count)
        start = page.get_by_role("button", name="Identify the arm")
        start.click()
        page.get_by_role("button", name="Cancel").click(timeout=WAIT)
        page.wait_for_selector("#panel-fit[data-task=cancelled]", timeout=WAIT)
        start.click()
        page.wait_for_selector("#panel-fit[data-task=done]", timeout=FIT)
        assert "Skill, 1 - error/error of the best baseline: joint 1: 0." in panel_text(page)
        assert "the record does not separate" in panel_text(page)
        assert page.get_by_alt_text("Root mean square error against the horizon").is_visible()
        assert page.get_by_role("link", name="Arm (TOML)").is_visible()
