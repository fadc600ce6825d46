"""LabVIEW measurement files: each segment is a recording with the units of its header.

The texts follow the Specification for the LabVIEW Measurement File of National Instruments: cells
of a header stand above the column that they describe, and the time of a channel is in the column
X_Value before it, or X0 + i Delta_X.
"""

from pathlib import Path

import numpy as np
import pytest

from airmuscle.bench import ColumnMapping, Decimation, read
from airmuscle.errors import ColumnError, FileError, InputError

NAMES = ("pressure", "force", "length")
UNITS = ("bar", "N", "mm")
TIME = 0.05 * np.arange(40)
VALUES = np.column_stack(
    [1.0 + 0.1 * np.arange(40), 12.5 * np.sqrt(np.arange(40)), np.full(40, 250.0)]
)


def lvm(
    path: Path,
    x_columns: str = "One",
    separator: str = "Tab",
    decimal: str = ".",
    segments: int = 1,
    tail: str = "",
    **tags: str,
) -> Path:
    """A file of LabVIEW; `tags` replace lines of the segment headers by their first cells."""
    sign = {"Tab": "\t", "Comma": ","}[separator]
    multi = x_columns == "Multi"

    def row(*cells: object) -> str:
        return sign.join(str(each).replace(".", decimal) for each in cells)

    def header(name: str, *cells: str) -> str:
        return tags.get(
            name, row(name, *(each for cell in cells for each in ([cell, ""] if multi else [cell])))
        )

    lines = [
        "LabVIEW Measurement",
        row("Writer_Version", 2),
        row("Separator", separator),
        sign.join(["Decimal_Separator", decimal]),
        row("Multi_Headings", "Yes"),
        row("X_Columns", x_columns),
        row("Date", "2026/11/20"),
        "***End_of_Header***" + sign,
        "",
    ]
    for _ in range(segments):
        lines += [
            row("Channels", 3),
            header("Samples", "40", "40", "40"),
            header("Y_Unit_Label", *UNITS),
            header("X_Dimension", *["Time"] * 3),
            header("X0", *["0.0E+0"] * 3),
            header("Delta_X", *["0.05"] * 3),
            "***End_of_Header***",
            row(
                *(
                    [each for name in NAMES for each in ("X_Value", name)]
                    if multi
                    else ["X_Value", *NAMES]
                ),
                "Comment",
            ),
        ]
        for i, (t, values) in enumerate(zip(TIME, VALUES, strict=True)):
            x = "" if x_columns == "No" else repr(float(t))
            cells = [
                each
                for v in values
                for each in ((x, repr(float(v))) if multi else (repr(float(v)),))
            ]
            lines.append(
                row(*([] if multi else [x]), *cells) + (sign + "a 250 mm muscle" if i == 0 else "")
            )
        lines.append(sign * 3)
    path.write_text("\r\n".join(lines) + tail, encoding="latin-1", newline="")
    return path


def same(recording) -> None:
    assert set(recording) == {"time", *NAMES}
    for name, values in zip(("time", *NAMES), (TIME, *(VALUES * (1e5, 1.0, 1e-3)).T), strict=True):
        assert recording[name] == pytest.approx(values, rel=1e-12, abs=1e-12), name


@pytest.mark.parametrize("x_columns", ["One", "No", "Multi"])
@pytest.mark.parametrize(("separator", "decimal"), [("Tab", "."), ("Tab", ","), ("Comma", ".")])
@pytest.mark.parametrize("ending", [".lvm", ".txt"])
def test_a_file_of_labview_is_read_with_its_units(tmp_path, x_columns, separator, decimal, ending):
    (recording,) = read(lvm(tmp_path / f"bench{ending}", x_columns, separator, decimal))
    same(recording)
    assert recording.constants["comment"] == "a 250 mm muscle"


def test_each_segment_is_a_recording_and_one_can_be_selected(tmp_path):
    path = lvm(tmp_path / "bench.lvm", segments=3)
    recordings = read(tmp_path)
    assert [each.origin for each in recordings] == [f"bench.lvm, segment {i}" for i in (1, 2, 3)]
    for each in recordings:
        same(each)
    same(*read(path, ColumnMapping(group="2")))
    with pytest.raises(FileError, match=r"bench\.lvm: no segment '4'; the segments are 1, 2, 3"):
        read(path, ColumnMapping(group="4"))


def test_the_column_of_time_counts_where_it_is_not_uniform(tmp_path):
    path = lvm(tmp_path / "bench.lvm")
    path.write_text(
        path.read_text(encoding="latin-1").replace("\n1.0\t", "\n1.02\t"), encoding="latin-1"
    )
    (recording,) = read(path)
    assert recording["time"][19:22].tolist() == pytest.approx([0.95, 1.02, 1.05])


def test_a_channel_with_fewer_samples_and_a_special_block_are_read(tmp_path):
    path = lvm(tmp_path / "bench.lvm", "Multi")
    lines = path.read_text(encoding="latin-1").splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("X_Value")) + 1
    for i in range(first + 35, first + 40):
        lines[i] = "\t".join(lines[i].split("\t")[:4])
    lines[first - 10 : first - 10] = ["***Start_Special***", "any\tthing", "***End_Special***"]
    path.write_text("\n".join(lines), encoding="latin-1")
    (recording,) = read(path)
    assert len(recording) == 35
    assert recording["force"] == pytest.approx(VALUES[:35, 1])


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        (
            {"Delta_X": "Delta_X\tfast\tfast\tfast", "x_columns": "No"},
            ColumnError,
            "Delta_X of 'pressure' is 'fast'",
        ),
        (
            {"tail": "\r\n1.95\tx\t1\t250"},
            ColumnError,
            "bench.lvm, line 59: pressure 'x' is not a number",
        ),
        ({"segments": 0}, FileError, "bench.lvm: no segment of data follows the header"),
        ({"Y_Unit_Label": "Y_Unit_Label\tVolts\tVolts\tVolts"}, InputError, "bench.lvm, .*Volts"),
        ({"decimal": ";"}, InputError, "decimal is ';'"),
    ],
)
def test_what_a_file_of_labview_lacks_is_named(tmp_path, options, kind, message):
    with pytest.raises(kind, match=message):
        read(lvm(tmp_path / "bench.lvm", **options))


def test_numbers_alone_are_a_table_of_text_and_long_files_are_reduced(tmp_path):
    header = "time [s]\tpressure [bar]\tforce [N]\tlength [mm]"
    np.savetxt(
        tmp_path / "plain.lvm",
        np.column_stack([TIME, VALUES]),
        delimiter="\t",
        header=header,
        comments="",
    )
    same(*read(tmp_path / "plain.lvm"))
    (few,) = read(lvm(tmp_path / "bench.lvm"), downsampling=Decimation(max_rows=10))
    assert few["force"] == pytest.approx(VALUES[::4, 1])
