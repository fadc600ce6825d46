"""A growing file or a serial log is read row by row; damaged rows are left out; the surface and the
next point follow.

The replay has the data rate of a logger at 1 kHz by its stamps; computing time is measured in
benchmarks/live.py.
"""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import ColumnMapping, RowReader, follow_lines, read_csv
from airmuscle.bench.readers import MAX_UNREADABLE
from airmuscle.errors import ColumnError, FileError
from airmuscle.files import load

RIG = ("--max-pressure", "6 bar", "--max-force", "1.5 kN")


def replay(count: int = 6000, decimal: str = ".") -> str:
    """A log at 1 kHz: contraction swept slowly and pressure in triangles, with noise."""
    rng = np.random.default_rng(1)
    time = np.arange(count) / 1000.0
    pressure = 6.0 * np.abs((time / 0.7) % 2 - 1)
    contraction = 12.5 * (1 - np.cos(2 * np.pi * time / 5.3))
    force = 2.2e2 * pressure * (1 - 0.035 * contraction) - 4 * contraction + rng.normal(0, 2, count)
    rows = (
        f"{t:.3f};{p:.5f};{c:.4f};{f:.2f}"
        for t, p, c, f in zip(time, pressure, contraction, force, strict=True)
    )
    text = "Zeit [s];Druck [bar];Kontraktion [%];Kraft [N]\n" + "\n".join(rows) + "\n"
    return text.replace(".", decimal)


def bench(*arguments: str, **options):
    return airmuscle("fit-live", *arguments, **options)


def test_rows_as_they_come_are_those_of_the_complete_file(tmp_path: Path):
    text = replay(200, decimal=",")
    (tmp_path / "log.csv").write_text(text)
    whole = read_csv(tmp_path / "log.csv")
    reader = RowReader("log")
    rows = [row for line in text.splitlines() if (row := reader.read(line))]
    for name in ("time", "pressure", "contraction", "force"):
        assert [row[name] for row in rows] == pytest.approx(list(whole[name]), rel=1e-14)
    assert reader.skipped == 0


@pytest.mark.parametrize(
    "text",
    [
        "time [s]  pressure [kPa]  force [N]\n0.0    1.5   5\n  0.1  1.6 6\n",
        "time [s],pressure [kPa],force [N],\n0.0,1.5,5,\n0.1,1.6,6,\n",
        "time [s];pressure [kPa];force [N]\n0,0;1,5;5;\n0,1;1,6;6;\n",
        'time [s],pressure [kPa],force [N]\n"0.0","1.5","5"\n0.1,1.6,6\n',
    ],
    ids=[
        "several blanks",
        "delimiter at the end of each line",
        "delimiter at the end of numbers",
        "quotation marks",
    ],
)
def test_a_stream_is_split_into_cells_as_a_file_is(tmp_path: Path, text: str):
    (tmp_path / "log.csv").write_text(text)
    whole = read_csv(tmp_path / "log.csv")
    reader = RowReader("log")
    rows = [row for line in text.splitlines() if (row := reader.read(line))]
    assert reader.skipped == 0
    assert [list(row.values()) for row in rows] == np.transpose(
        list(whole.columns.values())
    ).tolist()


def test_a_growing_file_is_read_as_it_comes_and_a_partial_line_waits_for_its_rest(tmp_path: Path):
    file = tmp_path / "log.csv"
    pieces = [
        "pressure [kPa],contraction [%],fo",
        "rce [N]\n100,1",
        "0,200\n110,11,210\n",
        "120,12,2",
        "20\n",
    ]
    file.write_text("")
    clock = itertools.count()
    feed = iter(pieces)

    def pause(_: float) -> None:
        with file.open("a") as log:
            log.write(next(feed, ""))

    reader = RowReader("log")
    rows = [
        row
        for line in follow_lines(file, idle=20, clock=lambda: next(clock), pause=pause)
        if (row := reader.read(line))
    ]
    assert [row["force"] for row in rows] == [200.0, 210.0, 220.0]
    assert rows[0]["pressure"] == 1e5


def test_a_stream_whose_beginning_is_no_table_is_refused():
    """More headings than numbers, and a carriage return within a line of the header."""
    wide = RowReader("log")
    wide.read("time [s],pressure [kPa],force [N]," + ",".join(f"c{i}" for i in range(3000)))
    with pytest.raises(
        ColumnError, match=r"log, line 2: the line must have 3003 cells .*more\); it has 3\."
    ) as refused:
        wide.read("0,100,5")
    assert len(str(refused.value)) < 600
    binary = RowReader("port")
    assert binary.read("\x00time\r,pressure [kPa]\r\n") is None
    row = binary.read("0,1")
    assert row is not None
    assert row["pressure"] == 1e3


@pytest.mark.parametrize(
    "lines",
    [
        ["time_[s] force_[N] valve x y", "0 1,5 A 2,5 3,5", "0,1 2,5 1 2,5 3,5"],
        ["time [s];force [N]", "0,5"],
    ],
)
def test_a_stream_whose_numbers_are_not_separated_as_its_headings_is_refused(lines: list[str]):
    reader = RowReader("port")
    assert not any(map(reader.read, lines[:-1]))
    with pytest.raises(
        ColumnError,
        match=rf"port, line {len(lines)}: the numbers are separated by '.', the headings",
    ):
        reader.read(lines[-1])


def test_damaged_rows_of_a_serial_log_are_left_out_and_counted():
    reader = RowReader(
        "port",
        ColumnMapping(
            columns={"1": "pressure [bar]", "2": "length [mm]", "3": "force [N]"},
            constants={"resting_length": "200 mm"},
        ),
    )
    rows = [
        reader.read(line)
        for line in (
            "3.0,180,500",
            "3.0,1",
            "\x00\x02,180,5x",
            "nan,180,500",
            "3.0,\r180,500",
            "# a remark",
            "3.1,178,510",
        )
    ]
    assert [row is not None for row in rows] == [True, False, False, False, False, False, True]
    assert rows[0]["contraction"] == pytest.approx(0.1)
    assert reader.skipped == 4


@pytest.mark.parametrize(
    ("row", "is_read"),
    [
        ("-0.94,0.1", True),
        ("-0.96,0.1", False),
        ("1,1.01", False),
        ("1,-0.51", False),
        ("1e30,0.1", False),
    ],
)
def test_a_row_of_numbers_that_no_sensor_measures_is_left_out(row: str, is_read: bool):
    reader = RowReader(
        "port",
        ColumnMapping(
            columns={"1": "pressure [barg]", "2": "contraction"}, constants={"ambient": "950 mbar"}
        ),
    )
    rows = [reader.read("1,0.1"), reader.read(row)]
    assert [each is not None for each in rows] == [True, is_read]
    assert reader.skipped == (0 if is_read else 1)


def test_a_stream_of_noise_is_refused():
    reader = RowReader("port")
    for line in ("pressure [bar],contraction [%],force [N]", "1,2,3"):
        reader.read(line)
    for _ in range(MAX_UNREADABLE):
        assert reader.read("garbage,") is None
    with pytest.raises(
        ColumnError, match=r"successive lines are no rows of 3 numbers. Check the baud rate"
    ):
        reader.read("garbage,")
    with pytest.raises(ColumnError, match="no column '7'; the columns are 1, 2"):
        RowReader("port", ColumnMapping(columns={"1": "pressure [bar]", "7": "force [N]"})).read(
            "1,2"
        )
    with pytest.raises(FileError, match="cannot be read"):
        list(follow_lines("no/such.csv", idle=0))


def test_a_replay_at_1_khz_gives_the_surface_and_a_next_point(tmp_path: Path):
    (tmp_path / "log.csv").write_text(replay())
    result = bench(
        "--follow",
        str(tmp_path / "log.csv"),
        *RIG,
        "--idle",
        "0",
        "--degree",
        "3",
        "--out",
        str(tmp_path / "live"),
        "--json",
    )
    assert result.exit_code == 0, result.stderr
    reports = [json.loads(line) for line in result.stdout.splitlines()]
    assert [report["samples"] for report in reports[:3]] == [1000, 2000, 3000]
    assert reports[-1]["rmse"] == pytest.approx(2.0, rel=0.1)
    assert reports[-1]["determined"] == 1.0
    assert set(reports[-1]["next"]) == {"pressure", "contraction", "force", "standard_error"}
    law = load(tmp_path / "live" / "muscle.toml").characteristic
    assert float(law.force(3e5, 0.1)) == pytest.approx(220 * 3 * 0.65 - 40, abs=2.0)


def test_standard_input_is_followed_to_its_end():
    result = bench("--follow", "-", *RIG, "--degree", "2", input=replay(1500))
    assert result.exit_code == 0, result.stderr
    assert result.stdout.count("samples, rms residual") == 2
    assert "next:" in result.stdout


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "pressure [bar],force [N]\n1,2\n",
            (
                "there is no contraction or a length with --resting-length; the columns are"
                " pressure, force"
            ),
        ),
        (
            "pressure [bar],contraction [%],force [N]\n9,2,3\n",
            r"no row lies within the limits of the test rig \(1 outside",
        ),
        ("u,w\n1,2\n", "no column is a known quantity"),
    ],
)
def test_a_stream_without_what_is_needed_is_refused(text: str, message: str):
    result = bench("--follow", "-", *RIG, input=text)
    assert result.exit_code == 1
    assert re.search(message, result.stderr)
