"""Latency of the studio: time from a key to the painted page, with ten isobars of 1000 points and
with a joint; time of a small request while two heavy ones run.

Run python benchmarks/studio_latency.py with the package playwright and Chromium; prints median and
95th percentile [ms], and the time of the page's scripts and of its whole main thread for each key
[ms], as thread CPU time.
"""

from __future__ import annotations

import http.client
import json
import math
import shutil
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

from measure import Section, Target, format_time, print_section

KEYS = 200
PRESSURES = "0.5; 1; 1.5; 2; 2.5; 3; 3.5; 4; 4.5; 5"
MEASURE = """
window.latencies = [];
addEventListener("keydown", (event) => {
  const begin = event.timeStamp;
  requestAnimationFrame(() => {
    const channel = new MessageChannel();  // its message arrives after the frame has been painted
    channel.port1.onmessage = () => latencies.push(performance.now() - begin);
    channel.port2.postMessage(0);
  });
}, true);
"""
OPTIONS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
]


def measured(page: Any, control: Any, keys: tuple[str, str]) -> str:
    """One line of results for a control that takes two keys."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def durations() -> dict[str, float]:
        return {
            row["name"]: row["value"] for row in session.send("Performance.getMetrics")["metrics"]
        }

    control.focus()
    for i in range(20):
        control.press(keys[i // 10 % 2])
    page.evaluate("latencies.length = 0")
    before = durations()
    for i in range(KEYS):
        control.press(keys[i // 20 % 2])
        page.wait_for_timeout(20)
    after = durations()
    found = sorted(page.evaluate("latencies"))
    script, task = (1e3 * (after[n] - before[n]) / KEYS for n in ("ScriptDuration", "TaskDuration"))
    return (
        f"median {statistics.median(found):.1f} ms, 95 % {found[int(0.95 * len(found))]:.1f} ms; "
        f"CPU of scripts {script:.1f} ms, of the main thread {task:.1f} ms"
    )


ROWS = 150_000
"""Rows of each of the two files that are read meanwhile, of 4 MB (chosen)."""
SMALL = (
    "tondu-lopez",
    "dmsp-10-250",
    "sarosi-dmsp-10",
    "hunt2017-festo-10",
    "reynolds2003",
    "chou-hannaford",
)
"""Muscles and laws, each sheet of which alone takes less than 0.2 s."""
TEXT = (
    "Time from the request for the sheet of a muscle, which the server has not computed before, to"
    f" its answer, while two requests that read files of {ROWS} rows are being answered without a"
    " pause."
)


def served(use: Callable[[str], Any]) -> Any:
    """What a function makes of the address of a server, which is ended afterwards."""
    command = [sys.executable, "-u", "-m", "airmuscle", "studio", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            return use(server.stdout.readline().split()[1])
        finally:
            server.terminate()


def beside_heavy_requests(address: str) -> tuple[list[float], list[float]]:
    """Times [s] of the small requests, and of the heavy ones that run meanwhile."""
    parts = urlsplit(address)

    def send(method: str, path: str, body: bytes | None = None, query: str = "") -> bytes:
        connection = http.client.HTTPConnection(str(parts.hostname), parts.port, timeout=300)
        connection.request(method, f"{path}?{parts.query}{query}", body, {"X-Airmuscle": "1"})
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        if answer.status != 200:
            raise RuntimeError(f"{path}: {content!r}")
        return content

    rows = (
        f"{0.01 * k:.2f},{3 + math.sin(0.001 * k):.4f},{400 + 90 * math.cos(0.001 * k):.2f}\n"
        for k in range(ROWS)
    )
    file = ("time [s],pressure [bar],force [N]\n" + "".join(rows)).encode()
    send("GET", "/api/law/dmsp-20-300")  # the first worker process has started
    sets = [
        json.loads(send("POST", "/api/fit/file", file, "&name=a.csv&set="))["set"] for _ in range(2)
    ]
    small = []
    heavy = []
    running = True

    def read(name: str) -> None:
        while running:
            begin = time.perf_counter()
            send("POST", "/api/fit/read", json.dumps({"set": name, "settings": {}}).encode())
            heavy.append(time.perf_counter() - begin)

    readers = [threading.Thread(target=read, args=(name,)) for name in sets]
    for reader in readers:
        reader.start()
    time.sleep(1.0)
    for name in SMALL:
        begin = time.perf_counter()
        send("GET", f"/api/law/{name}")
        small.append(time.perf_counter() - begin)
    running = False
    for reader in readers:
        reader.join()
    return small, heavy


def section(rounds: int = 1) -> Section:
    """The small requests, without a browser."""
    small, heavy = served(beside_heavy_requests)
    rows = (
        ("sheet of a muscle", format_time(statistics.median(small)), format_time(max(small))),
        ("reading of a file", format_time(statistics.median(heavy)), format_time(max(heavy))),
    )
    target = Target("page: a small request while two heavy ones run", max(small), 1.0, "s")
    return Section(
        "Page beside two heavy requests", TEXT, ("request", "median", "maximum"), rows, (target,)
    )


def measure_keys(address: str) -> None:
    """Print the lines of the keys."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=OPTIONS)
        context = browser.new_context(viewport={"width": 1280, "height": 1000})
        context.add_init_script(MEASURE)
        page = context.new_page()
        page.goto(address)
        page.wait_for_selector('#panel-muscle[data-shown="dmsp-20-300"]')
        isobars = page.get_by_label("Pressures of the isobars [bar]")
        isobars.fill(PRESSURES)
        isobars.press("Enter")
        slider = page.locator("#panel-muscle input[type=range]").first
        print(
            "slider, ten isobars of 1000 points:",
            measured(page, slider, ("ArrowRight", "ArrowLeft")),
        )
        print(
            "working point:",
            measured(page, page.locator("#panel-muscle .first .chart"), ("ArrowUp", "ArrowDown")),
        )
        page.get_by_role("tab", name="Joint").click()
        page.wait_for_selector("#panel-joint[data-shown]", timeout=120_000)
        gain = page.get_by_label("proportional gain, K")
        print("gain of a joint, step of 2.2 s:", measured(page, gain, ("ArrowRight", "ArrowLeft")))
        browser.close()


if __name__ == "__main__":
    print_section(section())
    served(measure_keys)
