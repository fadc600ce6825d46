"""Measurement files of every format with the same numbers, for tests of all readers."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
import pytest

ROWS = 60
STEP = 0.01
COLUMNS = {
    "time": STEP * np.arange(ROWS),
    "angle": 0.3 * np.sin(np.arange(ROWS) / 9.0),
    "p1": 1e5 + 5e4 * np.cos(np.arange(ROWS) / 7.0),
    "p2": 1e5 - 5e4 * np.cos(np.arange(ROWS) / 7.0),
    "force": 10.0 + np.arange(ROWS, dtype=float),
}
UNITS = {"time": "s", "angle": "rad", "force": "N"}
Write = Callable[[Path], None]


def _rows() -> list[list[object]]:
    return [[*COLUMNS], *np.transpose([*COLUMNS.values()]).tolist()]


def text(path: Path) -> None:
    path.write_text("\n".join(",".join(map(str, row)) for row in _rows()) + "\n")


def lvm(path: Path) -> None:
    names = [name for name in COLUMNS if name != "time"]
    head = (
        "LabVIEW Measurement\t\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
        "Multi_Headings\tNo\nX_Columns\tOne\n***End_of_Header***\t\n\t\n"
        f"Channels\t{len(names)}\n"
        + "\t".join(["X_Dimension", *["Time"] * len(names)])
        + "\n***End_of_Header***\t\n"
        + "\t".join(["X_Value", *names, "Comment"])
        + "\n"
    )
    rows = ("\t".join(map(repr, row)) for row in np.transpose([*COLUMNS.values()]).tolist())
    path.write_text(head + "\n".join(rows) + "\n")


def xlsx(path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in _rows():
        book.active.append(row)
    book.save(path)


def ods(path: Path) -> None:
    def cell(value: object) -> str:
        if isinstance(value, str):
            content = f'office:value-type="string"><text:p>{escape(value)}</text:p>'
        else:
            content = f'office:value-type="float" office:value="{value!r}">'
        return f"<table:table-cell {content}</table:table-cell>"

    rows = "".join(
        f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in _rows()
    )
    names = "urn:oasis:names:tc:opendocument:xmlns"
    content = (
        f'<office:document-content xmlns:office="{names}:office:1.0"'
        f' xmlns:table="{names}:table:1.0" xmlns:text="{names}:text:1.0"><office:body>'
        f'<office:spreadsheet><table:table table:name="a">{rows}</table:table>'
        "</office:spreadsheet></office:body></office:document-content>"
    )
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        file.writestr("content.xml", content)
        file.writestr("META-INF/manifest.xml", "<manifest/>")


def parquet(path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    pytest.importorskip("pyarrow.parquet").write_table(pyarrow.table(COLUMNS), path)


def hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, values in COLUMNS.items():
            file[name] = values


def mat_5(path: Path) -> None:
    pytest.importorskip("scipy.io").savemat(path, COLUMNS)


MAT_7_3_HEADER = b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM"


def mat_7_3(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in COLUMNS.items():
            data = file.create_dataset(name, data=values[None, :])
            data.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(MAT_7_3_HEADER)


def tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as file:
        file.write_segment(
            [nptdms.ChannelObject("run", name, values) for name, values in COLUMNS.items()]
        )


def mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    time = COLUMNS["time"]
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(c, time, name=n) for n, c in COLUMNS.items() if n != "time"])
        file.save(path, overwrite=True)


def bag(path: Path) -> None:
    rosbag1 = pytest.importorskip("rosbags.rosbag1", reason="needs the package rosbags")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    number = store.types["std_msgs/msg/Float64"]
    with rosbag1.Writer(path) as writer:
        topics = {
            name: writer.add_connection(f"/{name}", number.__msgtype__, typestore=store)
            for name in COLUMNS
            if name != "time"
        }
        for k, time in enumerate(COLUMNS["time"]):
            for name, topic in topics.items():
                message = store.serialize_ros1(number(COLUMNS[name][k]), number.__msgtype__)
                writer.write(topic, round(1e9 * (1.0 + time)), message)


def npz(path: Path) -> None:
    with path.open("wb") as file:
        np.savez(file, **COLUMNS)


def json_lists(path: Path) -> None:
    path.write_text(json.dumps({name: values.tolist() for name, values in COLUMNS.items()}))


WRITERS: dict[str, Write] = {
    "run.csv": text,
    "run.lvm": lvm,
    "run.xlsx": xlsx,
    "run.ods": ods,
    "run.parquet": parquet,
    "run.h5": hdf5,
    "five.mat": mat_5,
    "seven.mat": mat_7_3,
    "run.tdms": tdms,
    "run.mf4": mdf,
    "run.bag": bag,
    "run.npz": npz,
    "run.json": json_lists,
    "run.jsonl": json_lists,
}
"""Writers by the names of their files."""
FILES = [
    pytest.param(name, marks=pytest.mark.tool if name.endswith(".bag") else ()) for name in WRITERS
]
"""Names of the files as parameters of a test."""
EPISODE_MAPPING = """
time = "time"
[angles]
columns = ["angle"]
[pressures]
columns = ["p1", "p2"]
"""


def table_of_cells(path: Path, rows: list[list[object]]) -> None:
    """A text table or a workbook of these cells; None is an empty one."""
    if path.suffix == ".csv":
        path.write_text(
            "\n".join(",".join("" if c is None else str(c) for c in row) for row in rows) + "\n"
        )
        return
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    book.save(path)
