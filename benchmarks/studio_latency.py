"""Latency of the studio: time from a key to the painted page, with ten isobars of 1000 points and with a joint; time
of a small request while two heavy ones run.

Run python benchmarks/studio_latency.py with the package playwright and Chromium; prints median and 95th percentile
[ms], and the time of the page's scripts and of its whole main thread for each key [ms], as thread CPU time.
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
from typing import Any
from urllib.parse import urlsplit

import airmuscle as am

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
OPTIONS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]


def measured(page: Any, control: Any, keys: tuple[str, str]) -> str:
    """One line of results for a control that takes two keys."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def durations() -> dict[str, float]:
        return {row["name"]: row["value"] for row in session.send("Performance.getMetrics")["metrics"]}

    control.focus()
    for i in range(20):
        control.press(keys[i // 10 % 2])
    page.evaluate("latencies.length = 0")
    before = durations()
    for i in range(KEYS):
        control.press(keys[i // 20 % 2])
        page.wait_for_timeout(20)
    after, found = durations(), sorted(page.evaluate("latencies"))
    script, task = (1e3 * (after[n] - before[n]) / KEYS for n in ("ScriptDuration", "TaskDuration"))
    return (
        f"median {statistics.median(found):.1f} ms, 95 % {found[int(0.95 * len(found))]:.1f} ms; "
        f"CPU of scripts {script:.1f} ms, of the main thread {task:.1f} ms"
    )


ROWS = 150_000
"""Rows of each of the two files that are read meanwhile, of 4 MB (chosen)."""


def beside_heavy_requests(address: str) -> str:
    """One line on the sheets of the library, each requested while two files are being read."""
    parts = urlsplit(address)

    def send(method: str, path: str, body: bytes | None = None, query: str = "") -> bytes:
        connection = http.client.HTTPConnection(str(parts.hostname), parts.port, timeout=300)
        connection.request(method, f"{path}?{parts.query}{query}", body, {"X-Airmuscle": "1"})
        answer = connection.getresponse()
        content = answer.read()
        if answer.status != 200:
            raise RuntimeError(f"{path}: {content!r}")
        connection.close()
        return content

    rows = (f"{0.01 * k:.2f},{3 + math.sin(0.001 * k):.4f},{400 + 90 * math.cos(0.001 * k):.2f}\n" for k in range(ROWS))
    table = ("time [s],pressure [bar],force [N]\n" + "".join(rows)).encode()
    sets = [json.loads(send("POST", "/api/fit/file", table, "&name=a.csv&set="))["set"] for _ in range(2)]
    durations, alone, running = [], [], True

    def read(name: str) -> None:
        while running:
            begin = time.perf_counter()
            send("POST", "/api/fit/read", json.dumps({"set": name, "settings": {}}).encode())
            alone.append(time.perf_counter() - begin)

    readers = [threading.Thread(target=read, args=(name,)) for name in sets]
    for reader in readers:
        reader.start()
    time.sleep(1.0)
    for name in am.files.list_laws():
        begin = time.perf_counter()
        if name != "saga2007-exact":  # no closed form and no validity range: refused
            send("GET", f"/api/law/{name}")
            durations.append(time.perf_counter() - begin)
    running = False
    for reader in readers:
        reader.join()
    return (
        f"median {statistics.median(durations):.2f} s, maximum {max(durations):.2f} s of {len(durations)} muscles and "
        f"laws; reading of a file of {ROWS} rows: {statistics.median(alone):.1f} s"
    )


def main() -> None:
    """Start a server and a browser, and print the lines."""
    from playwright.sync_api import sync_playwright

    command = [sys.executable, "-u", "-m", "airmuscle", "studio", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server, sync_playwright() as playwright:
        assert server.stdout is not None
        address = server.stdout.readline().split()[1]
        print("first sheet of a muscle while two files are read:", beside_heavy_requests(address))
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
        print("slider, ten isobars of 1000 points:", measured(page, slider, ("ArrowRight", "ArrowLeft")))
        print("working point:", measured(page, page.locator("#panel-muscle .chart"), ("ArrowUp", "ArrowDown")))
        page.get_by_role("tab", name="Joint").click()
        page.wait_for_selector("#panel-joint[data-shown]", timeout=120_000)
        gain = page.get_by_label("proportional gain, K")
        print("gain of a joint, step of 2.2 s:", measured(page, gain, ("ArrowRight", "ArrowLeft")))
        browser.close()
        server.terminate()


if __name__ == "__main__":
    main()
