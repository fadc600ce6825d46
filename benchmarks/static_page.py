"""Page without a server: size of the folder that `airmuscle site` writes, and the time to its first
content from disk.

Run python benchmarks/static_page.py with the package playwright and Chromium; the first content is
the first paint with text, in a new profile of the browser for each of the rounds.
"""

from __future__ import annotations

import os
import shutil
import statistics
import tempfile
from pathlib import Path

from measure import Section, Target, format_time, print_section

from airmuscle.outlets import write_site

ROUNDS = 15
MEGABYTE = 1e6
TIMES = """
() => {
  const [paint] = performance.getEntriesByName("first-contentful-paint");
  return [paint.startTime / 1000, window.isobarsShown / 1000];
}
"""
MARK = """
new MutationObserver(() => {
  if (!window.isobarsShown && document.querySelector("#panel-muscle[data-shown]")) window.isobarsShown = performance.now();
}).observe(document, { subtree: true, childList: true, attributes: true });
"""  # noqa: E501
TEXT = (
    "The whole library in static files, opened from disk in a new profile of Chromium without a"
    " graphics processor; first content: the first paint with text; isobars: the chart of the first"
    " muscle."
)


def times_from_disk(page: Path) -> tuple[list[float], list[float]]:
    """Times from the opening to the first content and to the isobars [s], one of each round."""
    from playwright.sync_api import sync_playwright

    rounds = []
    with sync_playwright() as playwright:
        options = {"executable_path": shutil.which("chromium"), "args": ["--no-sandbox"]}
        with playwright.chromium.launch(**options) as browser:
            for _ in range(ROUNDS):
                context = browser.new_context(viewport={"width": 1280, "height": 900}, offline=True)
                context.add_init_script(MARK)
                view = context.new_page()
                view.goto(page.as_uri())
                view.wait_for_selector("html[data-ready]")
                rounds.append(view.evaluate(TIMES))
                context.close()
    first, isobars = zip(*rounds, strict=True)
    return list(first), list(isobars)


def section() -> Section:
    """Size and times of the page."""
    with tempfile.TemporaryDirectory() as folder:
        site = write_site(Path(folder) / "page")
        first, isobars = times_from_disk(site.page)
    rows = [
        ("first content", format_time(statistics.median(first)), format_time(min(first))),
        ("isobars", format_time(statistics.median(isobars)), format_time(min(isobars))),
    ]
    load = f" Load average at the end {os.getloadavg()[0]:.1f}; {site.models} models."
    targets = (
        Target("static page: size", site.size / MEGABYTE, 15.0, "MB"),
        Target("static page: first content from disk", min(first), 0.5, "s"),
    )
    return Section("Page without a server", TEXT + load, ("", "median", "minimum"), rows, targets)


if __name__ == "__main__":
    print_section(section())
