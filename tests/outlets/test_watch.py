"""A watched folder: complete files are read and checked, broken ones named, unfinished ones awaited."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import ColumnMapping
from airmuscle.outlets.cli import watch
from airmuscle.physics import Braid, TonduLopez2000

LAW = TonduLopez2000(Braid(0.01, 0.4363, 0.3), 1.25)
HEADING = "pressure [kPa],contraction [%],force [N]\n"


def isobar(kilopascal, seed=0):
    """The text of a file with an isobaric run."""
    rng = np.random.default_rng(seed)
    contraction = np.linspace(0.0, 0.2, 40)
    force = np.asarray(LAW.force(1e3 * kilopascal, contraction)) + rng.normal(0.0, 1.0, 40)
    rows = [f"{kilopascal},{100 * x:.4f},{f:.3f}" for x, f in zip(contraction, force, strict=True)]
    return HEADING + "\n".join(rows) + "\n"


@pytest.fixture
def today(tmp_path):
    folder = tmp_path / "today"
    folder.mkdir()
    return folder


def lines(files, now):
    return list(files.look(now))


def test_an_unfinished_file_is_awaited(today):
    files = watch.WatchedFiles(today, ColumnMapping(), settle=2.0)
    text = isobar(200)
    (today / "a.csv").write_text(text[:300])
    assert lines(files, 0.0) == []
    assert files.waiting == 1
    (today / "a.csv").write_text(text[:600])
    assert lines(files, 1.9) == []
    assert lines(files, 3.8) == []
    (today / "a.csv").write_text(text)
    assert lines(files, 4.0) == []
    assert lines(files, 6.0) == ["a.csv: usable, 40 rows"]
    assert lines(files, 9.0) == []
    assert files.waiting == 0


def test_a_broken_file_is_named_once_and_read_again_when_it_changes(today):
    files = watch.WatchedFiles(today, ColumnMapping(), settle=0.0)
    (today / "a.csv").write_text("nothing\nof\nuse\n")
    (today / "b.csv").write_text(isobar(200))
    first = lines(files, 0.0)
    assert first[0].startswith("a.csv: not read")
    assert first[1:] == ["b.csv: usable, 40 rows"]
    assert lines(files, 1.0) == []
    (today / "a.csv").write_text(isobar(300))
    assert lines(files, 2.0) == ["a.csv: usable, 40 rows"]
    assert files.refused == {}


def test_a_faulty_record_does_not_join(today):
    files = watch.WatchedFiles(today, ColumnMapping(), settle=0.0)
    text = HEADING + "".join(f"200,{x},{-100 + x}\n" for x in range(20))
    (today / "a.csv").write_text(text)
    (line,) = lines(files, 0.0)
    assert line.startswith("a.csv: not usable")
    assert files.recordings == {}


def test_a_removed_file_leaves_the_campaign(today):
    files = watch.WatchedFiles(today, ColumnMapping(), settle=0.0)
    (today / "a.csv").write_text(isobar(200))
    lines(files, 0.0)
    (today / "a.csv").unlink()
    assert lines(files, 1.0) == ["a.csv: removed"]
    assert files.recordings == {}


def test_the_command_identifies_what_is_there_and_says_what_to_measure_next(today, tmp_path):
    for kilopascal in (100, 200, 300, 400):
        (today / f"{kilopascal}.csv").write_text(isobar(kilopascal, kilopascal))
    (today / "broken.csv").write_text("nothing\nof\nuse\n")
    out = tmp_path / "watched"
    arguments = (
        "watch",
        today,
        "--settle",
        "0 s",
        "--every",
        "10 ms",
        "--idle",
        "10 ms",
        "--out",
        out,
        "--resting-length",
        "300 mm",
    )
    result = airmuscle(*arguments)
    assert result.exit_code == 0, result.output
    assert "400.csv: usable" in result.output
    assert "broken.csv: not read" in result.output
    assert "What to measure next" in result.output
    assert "4 of 4 records are used" in result.output
    assert 'content="5"' in (out / "watch.html").read_text()
    assert "broken.csv" in (out / "report.html").read_text()
    again = airmuscle(*arguments)
    assert again.exit_code == 0
    assert "resuming from the results" in again.output


def test_a_file_without_a_muscle_says_why_there_is_no_campaign(today, tmp_path):
    (today / "a.csv").write_text(
        "time [s],temperature [°C]\n" + "".join(f"{t},20\n" for t in range(40))
    )
    result = airmuscle(
        "watch",
        today,
        "--settle",
        "0 s",
        "--idle",
        "0 s",
        "--every",
        "10 ms",
        "--out",
        tmp_path / "o",
    )
    assert result.exit_code == 0
    assert "No campaign yet" in result.output or "not usable" in result.output


def test_a_missing_folder_is_named(tmp_path):
    result = airmuscle("watch", tmp_path / "no", "--out", tmp_path / "o")
    assert result.exit_code == 1
    assert "there is no such folder" in result.output


def test_an_interruption_ends_cleanly(today, tmp_path):
    command = [sys.executable, "-m", "airmuscle", "watch", str(today), "--out", str(tmp_path / "o")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ})
    assert "watching" in process.stderr.readline()
    time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "ended with 0 usable files" in errors
