"""The loop of 1 kHz plays the table of a plan, counts missed deadlines, and vents whatever ends it."""

from __future__ import annotations

import signal
import subprocess
import time

import numpy as np
import pytest

from airmuscle.bench import SignalLimits, SignalPlan
from airmuscle.outlets import signal_files

RIG = """
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
static float last = 0.0f;
static long calls = 0;
int rig_write(const float *command, int count) { (void)count; last = command[0]; return 0; }
int rig_read(float *pressure, int count) {
    (void)count;
    calls++;
    if (getenv("FAIL_AT") && calls == atol(getenv("FAIL_AT"))) return 1;
    pressure[0] = getenv("BURST_AT") && calls >= atol(getenv("BURST_AT")) ? 9e5f : last;
    if (getenv("SLEEP_AT") && calls == atol(getenv("SLEEP_AT"))) {
        struct timespec t = {0, atol(getenv("SLEEP_NS"))};
        nanosleep(&t, NULL);
    }
    return 0;
}
void rig_stop(void) { fprintf(stderr, "vented after %ld\\n", calls); }
"""


@pytest.fixture(scope="module")
def loop(tmp_path_factory):
    """The program that plays 300 ms of a plan."""
    folder = tmp_path_factory.mktemp("loop")
    commands = 1e5 + 5e4 * np.sin(np.arange(60) / 5.0)[:, None]
    plan = SignalPlan(
        ("setpoint",), commands, 0.005, (), (), SignalLimits(2e5, max_rate=1e7), 1.0, {}
    )
    for name, content in signal_files(plan).items():
        if isinstance(content, str):
            (folder / name).write_text(content)
    (folder / "my_rig.c").write_text("#define _POSIX_C_SOURCE 200809L\n" + RIG)
    program = folder / "rig_loop"
    flags = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror"]
    sources = [folder / "rig_loop.c", folder / "my_rig.c"]
    subprocess.run(["cc", *flags, *sources, "-o", program], check=True)
    return program, commands


def played(program, *arguments, **environment):
    return subprocess.run(
        [program, *arguments], capture_output=True, text=True, env=environment, timeout=20
    )


def test_nothing_moves_without_a_start(loop):
    result = played(loop[0])
    assert result.returncode == 2
    assert result.stdout == ""
    assert "--start" in result.stderr


def test_the_loop_plays_each_row_for_its_time(loop):
    result = played(loop[0], "--start")
    assert result.returncode == 0, result.stderr
    rows = np.array([line.split(",") for line in result.stdout.splitlines()[1:]], float)
    places = np.floor(rows[:, 0] / 0.005 + 1e-6).astype(int)
    assert rows[:, 1] == pytest.approx(loop[1][places, 0], abs=0.1)
    assert "vented" in result.stderr
    periods, missed = (
        int(word) for word in result.stderr.split("\n")[-2].split() if word.isdigit()
    )
    assert periods + missed == pytest.approx(300, abs=2)


def test_a_missed_deadline_is_counted(loop):
    result = played(loop[0], "--start", SLEEP_AT="50", SLEEP_NS="20000000")
    missed = int(result.stderr.split(" missed")[0].split()[-1])
    assert missed >= 18


@pytest.mark.parametrize(
    ("environment", "reason"),
    [
        ({"FAIL_AT": "20"}, "rig_read failed"),
        ({"BURST_AT": "30"}, "beyond its limit"),
        ({"SLEEP_AT": "40", "SLEEP_NS": "150000000"}, "watchdog"),
    ],
)
def test_a_fault_vents(loop, environment, reason):
    result = played(loop[0], "--start", **environment)
    assert result.returncode == 1
    assert reason in result.stderr
    assert "vented" in result.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_vents(loop, number):
    process = subprocess.Popen(
        [loop[0], "--start"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    time.sleep(0.1)
    process.send_signal(number)
    _, errors = process.communicate(timeout=10)
    assert process.returncode == 1
    assert "vented" in errors
    assert f"stopped by signal {int(number)}" in errors
