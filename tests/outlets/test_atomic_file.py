"""Files that are complete or unchanged, whatever happens while they are written."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from airmuscle.core import atomic_file
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


def test_several_writers_of_one_file_leave_one_complete_text(tmp_path: Path):
    path, texts, errors = tmp_path / "muscle.toml", [letter * 100_000 for letter in "abcd"], []

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
