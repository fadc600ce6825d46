"""Figures docs/images/studio-*.png: the page of `airmuscle studio` in Chromium.

Run python release/figures/make_studio_figures.py with the packages playwright and Pillow, while
a server runs, and its address as the argument: http://127.0.0.1:8765/
"""

from __future__ import annotations

import io
import shutil
import sys
import zipfile
from pathlib import Path
from typing import Any

IMAGES = Path(__file__).parents[2] / "docs" / "images"
COLOURS = 255


def save(page: Any, name: str) -> None:
    """Write what is visible as a PNG with few colours."""
    from PIL import Image

    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    picture.quantize(COLOURS).save(IMAGES / f"studio-{name}.png", optimize=True)
    print(f"wrote {IMAGES / f'studio-{name}.png'}")


def opened(browser: Any, address: str, tab: str, name: str, **options: Any) -> Any:
    """The page with a tab, as soon as it shows a muscle, a plant or a sizing."""
    page = browser.new_context(**options).new_page()
    page.goto(address)
    page.wait_for_selector("html[data-ready]")
    page.get_by_role("tab", name=tab).click()
    page.wait_for_selector(f'#panel-{tab.lower()}[data-shown="{name}"]')
    return page


def bench_table() -> bytes:
    """A recording that is computed: isobars of dmsp-20-300 with friction of 12 N, noise of 2 N
    (both chosen).
    """
    import numpy as np

    import airmuscle as am

    law = am.load("dmsp-20-300").characteristic
    noise = np.random.default_rng(1)
    lines = ["time [s],pressure [bar],contraction [%],force [N]"]
    there = np.linspace(0.0, 0.2, 25)
    for level in range(1, 6):
        for sign, contraction in [(1, c) for c in there] + [(-1, c) for c in there[::-1]]:
            force = float(law.force(level * 1e5, contraction)) - 6.0 * sign + noise.normal(0.0, 2.0)
            if force > 0:
                lines.append(f"{0.5 * len(lines):.1f},{level},{100 * contraction:.2f},{force:.1f}")
    return "\n".join(lines).encode()


def save_fit(page: Any) -> None:
    """Write the figure of the tab Fit: measured rows with a selection, and the result."""
    file = {"name": "bench.csv", "mimeType": "text/csv", "buffer": bench_table()}
    page.get_by_label("Measurement files").set_input_files(file)
    page.wait_for_selector("#panel-fit[data-read='1']")
    page.get_by_label("Selection from").fill("18.5")
    page.get_by_label("Selection to").fill("21")
    page.get_by_role("button", name="Apply").click()
    page.wait_for_selector("#panel-fit[data-read='2']")
    page.get_by_role("button", name="Fit and compare all laws").click()
    page.wait_for_selector("#panel-fit[data-task=done]", timeout=1_200_000)
    page.mouse.move(0, 0)
    page.locator("#panel-fit h2", has_text="Measured rows").scroll_into_view_if_needed()
    page.evaluate(
        "document.querySelector('#panel-fit .chart').scrollIntoView({ block: 'start' });"
        " scrollBy(0, -100)"
    )
    page.wait_for_timeout(300)
    save(page, "fit")


def episodes() -> bytes:
    """A computed record of a joint of two muscles of the library, 60 episodes of 0.95 s as a ZIP
    archive of CSV files; random pressures, noise of the angle 0.03 deg (both chosen)."""
    import numpy as np

    import airmuscle as am

    plant = am.load("joint-dmsp-20-matrix").plant
    rng = np.random.default_rng(0)
    rows = 0.01 * np.arange(95)
    truth = am.physics.PressureDriven(plant.muscles, plant.mechanism, (0.03, 0.03))
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for number in range(60):
            levels = rng.uniform(1e5, 4e5, (2, 12))
            signal = {
                f"{p}measured_pressure": list(zip(np.linspace(0, 0.94, 12), row, strict=True))
                for p, row in zip(truth.prefixes, levels, strict=True)
            }
            start = dict.fromkeys((s.name for s in truth.states), 0.0)
            start |= {
                f"{p}pressure": level for p, level in zip(truth.prefixes, levels[:, 0], strict=True)
            }
            run = am.simulate(
                truth,
                am.SampledSignal(signal),
                duration=0.95,
                initial_state=start,
                output_times=rows,
                integrator=am.RungeKutta4(1e-3),
            )
            at = np.searchsorted(run["time"], rows - 1e-9)
            angle = np.degrees(run["angle"][at]) + 0.03 * rng.standard_normal(95)
            columns = (angle, *(run[name][at] / 1e3 for name in signal))
            lines = [",".join(f"{v:.6g}" for v in row) for row in zip(*columns, strict=True)]
            archive.writestr(f"{number:02d}.csv", "\n".join(["angle,p1,p2", *lines]))
    return data.getvalue()


def save_arm(page: Any) -> None:
    """Write the figure of the tab Fit with the episodes of an arm."""
    file = {"name": "episodes.zip", "mimeType": "application/zip", "buffer": episodes()}
    page.get_by_label("Measurement files").set_input_files(file)
    page.wait_for_selector("#panel-fit[data-read='1']")
    page.get_by_role("button", name="Identify the arm").click()
    page.wait_for_selector("#panel-fit[data-task=done]", timeout=1_200_000)
    page.evaluate("scrollTo(0, 0)")
    page.wait_for_timeout(300)
    save(page, "arm")


def main(address: str) -> None:
    """Write the figures of the tabs, in light, dark and on a phone."""
    from playwright.sync_api import sync_playwright

    wide = {"viewport": {"width": 1200, "height": 800}}
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        page = opened(browser, address, "Muscle", "dmsp-20-300", **wide)
        page.evaluate(
            "document.querySelector('#panel-muscle select').value = 'sarosi-dmsp-20-400n'"
        )
        page.get_by_role("button", name="Compare").click()
        page.wait_for_selector('#panel-muscle[data-shown="dmsp-20-300 sarosi-dmsp-20-400n"]')
        page.get_by_role("button", name="dmsp-20-300", exact=True).click()
        page.get_by_label("Force [N]").fill("250")
        page.wait_for_timeout(300)
        save(page, "muscle")
        save_fit(opened(browser, address, "Fit", "ready", viewport={"width": 1200, "height": 1250}))
        save_arm(opened(browser, address, "Fit", "ready", viewport={"width": 1200, "height": 1460}))
        page = opened(browser, address, "Plant", "lift-dmsp-20", color_scheme="dark", **wide)
        page.get_by_label("Plant of the library").select_option("joint-dmsp-20-proportional")
        page.wait_for_selector('#panel-plant[data-shown="joint-dmsp-20-proportional"]')
        page.locator("#panel-plant").get_by_label("Instant of the run").fill("400")
        page.wait_for_timeout(300)
        save(page, "plant")
        page = opened(
            browser, address, "Plant", "lift-dmsp-20", viewport={"width": 390, "height": 800}
        )
        page.locator("#panel-plant").get_by_label("Instant of the run").fill("300")
        page.wait_for_timeout(300)
        save(page, "phone")
        draw_joint_and_sizing(browser, address)


def draw_joint_and_sizing(browser: Any, address: str) -> None:
    """The figures of the tabs Joint and Size."""
    wide = {"viewport": {"width": 1200, "height": 1275}}
    page = opened(browser, address, "Joint", "joint-dmsp-20-proportional", **wide)
    panel = page.locator("#panel-joint")
    panel.get_by_label("Task").select_option("minimum jerk")
    panel.get_by_label("Instant of the run").fill("240")
    gain = panel.get_by_label("proportional gain, K")
    for key in ("ArrowRight", "ArrowLeft") * 10:  # the browser compiles the programs meanwhile
        gain.press(key)
        page.wait_for_timeout(50)
    save(page, "joint")
    wide = {"viewport": {"width": 1280, "height": 1290}}
    page = opened(
        browser, address, "Size", "20 kg (196.1 N) over 40 mm, air", color_scheme="dark", **wide
    )
    page.locator("#panel-size .choices button").nth(1).click()
    page.wait_for_timeout(1000)
    save(page, "size")


if __name__ == "__main__":
    main(sys.argv[1])
