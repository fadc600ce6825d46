"""Files that are complete or unchanged, whatever happens while they are written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import pytest
from command_line import airmuscle
from widths import widened

from airmuscle.core import (
    atomic_file,
    atomic_folder,
    check_writable,
    exclusive_folders,
    temporary_folder,
)
from airmuscle.files.library import write_text


def test_a_file_is_unchanged_and_nothing_is_left_if_writing_fails(tmp_path: Path):
    path = tmp_path / "muscle.toml"
    path.write_text("complete", encoding="utf-8")

    def fail() -> None:
        with atomic_file(path) as unfinished:
            unfinished.write_text("half", encoding="utf-8")
            raise OSError("the disk is full")

    with pytest.raises(OSError, match="the disk is full"):
        fail()
    assert path.read_text(encoding="utf-8") == "complete"
    assert list(tmp_path.iterdir()) == [path]


WRITES = """
import pathlib, sys, time
from airmuscle.core import atomic_file
with atomic_file(pathlib.Path(sys.argv[1])) as unfinished:
    unfinished.write_text("half")
    print("ready", flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize("ending", ["SIGKILL", "SIGTERM"])
def test_what_a_killed_writer_has_left_is_removed_by_the_next_one(tmp_path: Path, ending: str):
    path = tmp_path / "run.csv"
    path.write_text("complete")
    writers = [
        subprocess.Popen(
            [sys.executable, "-c", WRITES, tmp_path / name], stdout=subprocess.PIPE, text=True
        )
        for name in ("run.csv", "other.csv")
    ]
    killed = writers[0]
    try:
        assert [writer.stdout.readline() for writer in writers] == ["ready\n"] * 2
        killed.send_signal(getattr(signal, ending))
        killed.wait()
        assert len(list(tmp_path.glob(".*.part"))) == 2
        with atomic_file(path) as unfinished:
            unfinished.write_text("new")
        (left,) = tmp_path.glob(".*.part")  # of the writer that still runs
        assert left.name.startswith(".other.csv.of-")
        assert path.read_text() == "new"
    finally:
        for writer in writers:
            writer.kill()
            writer.communicate()


CONVERTS = """
import sys, time
from unittest import mock
from airmuscle.__main__ import main
from airmuscle.bench.readers import writer

write = dict(writer._WRITERS)

def slow(recording, temporary, path, comments):
    write[path.suffix](recording, temporary, path, comments)
    print("ready", flush=True)
    time.sleep(60)

with mock.patch.dict(writer._WRITERS, dict.fromkeys(write, slow)):
    main()
"""


@pytest.mark.parametrize("ending", widened(["csv", "parquet", "h5"], lambda e: e == "h5"))
def test_a_conversion_that_is_killed_leaves_nothing(tmp_path: Path, ending: str):
    path = tmp_path / "run.csv"
    path.write_text("time [s],force [N]\n" + "".join(f"{t},{t}\n" for t in range(20)))
    command = [sys.executable, "-c", CONVERTS, "convert", path, tmp_path / f"new.{ending}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as converter:
        assert converter.stdout.readline() == "ready\n"
        assert len(list(tmp_path.glob(".*.part"))) == 1
        converter.terminate()
    assert converter.returncode == 143
    assert list(tmp_path.iterdir()) == [path]


def test_several_writers_of_one_file_leave_one_complete_text(tmp_path: Path):
    path = tmp_path / "muscle.toml"
    texts = [letter * 100_000 for letter in "abcd"]
    errors = []

    def write(text: str) -> None:
        try:
            for _ in range(10):
                write_text(path, text)
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=write, args=(text,)) for text in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert path.read_text(encoding="utf-8") in texts
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_whose_name_is_as_long_as_the_system_allows_is_written(tmp_path: Path):
    path = tmp_path / ("m" * 250 + ".toml")
    write_text(path, "text")
    assert path.read_text(encoding="utf-8") == "text"


SECOND = """
import sys
from airmuscle.core import check_writable, exclusive_folders
from airmuscle.errors import FileError
try:
    with exclusive_folders():
        check_writable(sys.argv[1])
except FileError as error:
    print(error)
"""


@pytest.mark.parametrize("name", ["", ".", "/"])
def test_a_path_that_names_no_file_is_an_error_of_the_operating_system(name):
    with pytest.raises(IsADirectoryError), atomic_file(Path(name)):
        pass
    done = airmuscle("approximate", "dmsp-20-300", "Sarosi2012", "--out", name)
    assert done.exit_code == 1
    assert done.stderr.startswith("error: "), done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no locks of folders")
@pytest.mark.skipif(not Path("/dev/null").is_char_device(), reason="has no device files")
def test_a_device_is_not_replaced_by_a_file():
    with pytest.raises(OSError, match="it is a device, not a file"), atomic_file(Path("/dev/null")):
        pass
    assert Path("/dev/null").is_char_device()


def test_the_second_of_two_commands_that_write_to_one_folder_is_refused(tmp_path):
    """The lock ends with the block, and what was created for it is removed where nothing was
    written.
    """
    folder = tmp_path / "deep" / "out"

    def second(name: Path) -> str:
        done = subprocess.run(
            [sys.executable, "-c", SECOND, name], capture_output=True, text=True, check=True
        )
        return done.stdout

    with exclusive_folders():
        check_writable(folder)
        check_writable(folder)
        assert (
            second(folder)
            == f"{folder}: another command is writing to this folder. Wait until it ends, or"
            " specify another folder.\n"
        )
        assert second(tmp_path / "other") == ""
        check_writable(tmp_path, shared=True)
        assert second(tmp_path) == ""
    assert second(folder) == ""
    assert list(tmp_path.iterdir()) == []
    with exclusive_folders():
        check_writable(folder)
        with atomic_folder(folder) as place:
            (place / "a.csv").touch()
    assert [path.name for path in folder.iterdir()] == ["a.csv"]


def test_what_a_killed_process_has_left_in_the_temporary_folder_is_removed_by_the_next_one(
    tmp_path, monkeypatch
):
    code = (
        "import os, signal; from airmuscle.core.atomic_output import temporary_folder\nwith"
        " temporary_folder() as folder:\n    (folder / 'a.c').touch(); os.kill(os.getpid(),"
        " signal.SIGTERM)"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], check=False, env=environment)
    assert len(list(tmp_path.iterdir())) == 1
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "airmuscle-of-somebody").mkdir()
    with temporary_folder() as mine, temporary_folder() as other:
        assert {path.name for path in tmp_path.iterdir()} == {
            mine.name,
            other.name,
            "airmuscle-of-somebody",
        }
    assert [path.name for path in tmp_path.iterdir()] == ["airmuscle-of-somebody"]
