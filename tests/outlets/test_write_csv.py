"""Writer of recordings: reading a written file gives bit-identical numbers, and writing is
atomic.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airmuscle.bench import read_csv, write
from airmuscle.errors import FileError
from airmuscle.recording import QUANTITIES, Recording


def run(rows: int = 50) -> Recording:
    random = np.random.default_rng(2)
    return Recording(
        {
            "time": np.cumsum(random.uniform(1e-3, 1e-2, rows)),
            "left.pressure": random.uniform(0, 6e5, rows),
            "contraction": random.uniform(-0.05, 0.3, rows),
            "force": random.normal(0, 1e3, rows),
            "acceleration": random.normal(0, 1.0, rows) * 1e-300,
            "valve, raw": random.normal(0, 1.0, rows),
        },
        origin="a simulation",
        constants={
            "resting_length": 0.1 + 0.2,
            "ambient": 98_000.0,
            "specimen": 'DMSP-20 "ü" 1',
            "seed": 7,
        },
        notes=("The first note.", "The\nsecond."),
    )


def test_a_written_recording_is_read_back_bit_identical(tmp_path: Path):
    written = run()
    back = read_csv(write(written, tmp_path / "run.csv"))
    assert list(back) == list(written)
    for name in written:
        assert np.array_equal(back[name], written[name]), name
    assert back.constants == written.constants


@given(
    force=st.lists(st.floats(-1e15, 1e15), min_size=1, max_size=5),
    rest=st.floats(1e-3, 20.0),
)
def test_any_number_is_read_back_bit_identical(tmp_path_factory, force: list[float], rest: float):
    path = tmp_path_factory.getbasetemp() / "any.csv"
    recording = Recording({"force": np.array(force)}, "any", {"resting_length": rest})
    back = read_csv(write(recording, path))
    assert np.array_equal(back["force"], force)
    assert back.constants["resting_length"] == rest


def test_every_quantity_is_written_in_a_unit_that_is_read(tmp_path: Path):
    """But an elongation, which is read as a shortening of the opposite sign."""
    names = [name for name in QUANTITIES if name != "elongation"]
    back = read_csv(
        write(
            Recording({name: np.array([0.25, 0.5]) for name in names}, "all"), tmp_path / "all.csv"
        )
    )
    assert all(np.array_equal(back[name], [0.25, 0.5]) for name in names)
    stretched = Recording(
        {"force": np.array([1.0, 2.0]), "elongation": np.array([0.25, 0.5])}, "stretched"
    )
    assert read_csv(write(stretched, tmp_path / "stretched.csv"))["shortening"].tolist() == [
        -0.25,
        -0.5,
    ]


def test_the_file_shows_units_origin_constants_and_notes(tmp_path: Path):
    lines = write(run(1), tmp_path / "run.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "# a simulation"
    assert "# resting_length [m] = 0.30000000000000004" in lines
    assert "# Note: The second." in lines
    assert lines[-2].startswith(
        'time [s],left.pressure [Pa],contraction [1],force [N],acceleration [m/s^2],"valve, raw"'
    )


@pytest.mark.parametrize("place", ["no such folder/run.csv", "a file/run.csv"])
def test_a_folder_that_cannot_be_written(tmp_path: Path, place: str):
    (tmp_path / "a file").write_text("here")
    with pytest.raises(FileError) as caught:
        write(run(), tmp_path / place)
    assert str(tmp_path / place) in str(caught.value)
    assert "cannot be written" in str(caught.value)
    assert "Choose an existing folder" in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["a file"]


def test_a_failed_write_leaves_the_existing_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = write(run(3), tmp_path / "run.csv")
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(FileError, match="No space left on device"):
        write(run(30), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_the_plot_of_a_recording_has_units():
    figure = run().plot("left.pressure", "contraction")
    assert [axis.get_ylabel() for axis in figure.axes] == [
        "left.pressure\n[kPa]",
        "contraction\n[%]",
    ]
    assert figure.axes[-1].get_xlabel() == "time [s]"
    assert figure.axes[0].lines[0].get_ydata() == pytest.approx(run()["left.pressure"] / 1e3)
    assert len(run().plot().figure.axes) == 5
