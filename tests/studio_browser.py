"""Browser for the tests of the studio: a server on a free port, and the page, which must report no
error.
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from widths import widened

playwright = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
OPTIONS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
WAIT = 180_000
PAGES = widened(
    [(width, scheme) for width in (360, 768, 1600) for scheme in ("light", "dark")],
    lambda width, scheme: (width == 768) == (scheme == "dark"),
)
"""Width and colours of a page: each width by default with one scheme, on which the layout does not
depend.
"""
REFUSED = "status of 422"
"""Message of the browser on a text that the server refused."""


@pytest.fixture(scope="module")
def address():
    """The address of a server on a free port."""
    command = [sys.executable, "-u", "-m", "airmuscle", "studio", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            yield server.stdout.readline().split()[1]
        finally:
            server.terminate()


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as p:
        if CHROMIUM is None and not Path(p.chromium.executable_path).exists():
            pytest.skip("needs chromium")
        running = p.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield running
        running.close()


@contextlib.contextmanager
def opened(browser, address, *, width=1280, height=900, scheme="light", offline=False, origin=None):
    """The page; it must report no error and request nothing from elsewhere than `origin`, by
    default its address.
    """
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=scheme, offline=offline
    )
    page = context.new_page()
    errors = []
    page.on(
        "console",
        lambda m: (
            errors.append(m.text)
            if m.type in ("error", "warning") and REFUSED not in m.text
            else None
        ),
    )
    page.on("pageerror", lambda e: errors.append(str(e)))
    origin = origin or address.partition("?")[0]
    page.on(
        "request",
        lambda r: None if r.url.startswith((origin, "data:", "blob:")) else errors.append(r.url),
    )
    page.goto(address)
    page.wait_for_selector("html[data-ready]", timeout=WAIT)
    yield page
    context.close()
    assert errors == []
