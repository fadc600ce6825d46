"""A table of text on the standard input, such as that of a pipe, is read to its end within a
bounded memory: the rows that are kept are those of the file, and where there are too many, one in
2, 4, 8, ... of them.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import BlockMeans, ColumnMapping, Decimation, read
from airmuscle.bench.readers.formats import raw_csv
from airmuscle.errors import ColumnError, FileError
from airmuscle.recording import Recording

ROWS = 20_000


def text(rows: int = ROWS, comment: bool = True) -> str:
    """A table with a constant, and a comment between its rows."""
    lines = [f"{i * 0.001:.3f},{100 + i % 7},{i}" for i in range(rows)]
    lines.insert(rows // 2, "# a comment" if comment else "")
    return (
        "\n".join(["# resting_length [mm] = 300", "time [s],pressure [kPa],force [N]", *lines])
        + "\n"
    )


class Pipe:
    """A standard input of these bytes, of which a request returns at most a few."""

    def __init__(self, content: bytes) -> None:
        self.buffer = io.BufferedReader(io.BytesIO(content), 4096)  # type: ignore[arg-type]


def piped(
    monkeypatch: pytest.MonkeyPatch, content: str | bytes, *arguments: object, **options: object
) -> Recording:
    monkeypatch.setattr(
        "sys.stdin", Pipe(content if isinstance(content, bytes) else content.encode())
    )
    return read("-", *arguments, **options)[0]  # type: ignore[arg-type]


@pytest.mark.parametrize("rows", [20, ROWS])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_pipe_contains_what_the_file_contains(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows: int, encoding: str
):
    content = text(rows).replace("\n", "\r\n").encode(encoding)
    (tmp_path / "run.csv").write_bytes(content)
    recording = piped(monkeypatch, content)
    (expected,) = read(tmp_path / "run.csv")
    assert recording.origin == "standard input"
    assert recording.constants == expected.constants
    for name in ("time", "pressure", "force"):
        assert np.array_equal(recording[name], expected[name])


@pytest.mark.parametrize("chunk", [1000, 1001, 100_000])
@pytest.mark.parametrize("most", [ROWS, ROWS - 1, ROWS // 4, 1000, 37])
def test_of_too_many_rows_every_second_one_is_kept_until_they_are_few(
    monkeypatch: pytest.MonkeyPatch, chunk: int, most: int
):
    monkeypatch.setattr(raw_csv, "_CHUNK_ROWS", chunk)
    recording = piped(monkeypatch, text(), downsampling=Decimation(most))
    step = 2 ** int(np.ceil(np.log2(ROWS / most)))
    assert np.array_equal(recording["force"], np.arange(0, ROWS, step))
    noted = [note for note in recording.notes if "rows; one in" in note]
    assert noted == (
        [
            f"The file has {ROWS} rows; one in {step} is kept as measured, {len(recording)} in"
            " total (max_rows)."
        ]
        if step > 1
        else []
    )


def test_means_of_blocks_and_a_mapping_are_those_of_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "run.csv").write_text(text(), encoding="utf-8")
    mapping = ColumnMapping(columns={"force": ""}, resting_length="200 mm")
    means = BlockMeans(1000)
    (expected,) = read(tmp_path / "run.csv", mapping, downsampling=means)
    recording = piped(monkeypatch, text(), mapping, downsampling=means)
    assert list(recording) == ["time", "pressure"]
    assert recording.constants["resting_length"] == 0.2
    assert np.array_equal(recording["pressure"], expected["pressure"])


def test_a_damaged_line_and_an_empty_or_binary_input_are_refused(monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(ColumnError, match="standard input, line 15003: the line must have 3 cells"):
        piped(monkeypatch, text().replace("\n14.999,", "\n14.999;"))
    with pytest.raises(FileError, match="standard input: it contains nothing"):
        piped(monkeypatch, " \n")
    with pytest.raises(FileError, match="standard input: the file is"):
        piped(monkeypatch, bytes(range(256)) * 400)


def test_commands_read_a_pipe_and_convert_keeps_all_rows(tmp_path: Path):
    assert "standard input: 20000 rows" in airmuscle("inspect", "-", input=text()).stdout
    done = airmuscle("convert", "-", tmp_path / "all.csv", input=text())
    assert done.exit_code == 0, done.stderr
    assert np.array_equal(read(tmp_path / "all.csv")[0]["force"], np.arange(ROWS))
