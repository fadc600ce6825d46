"""Forty kinds of laboratory files are read, at once or with the mapping that the program proposes;
no number is wrong and no row is lost. Half of them were written before the vocabulary.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from field_files import DEVELOPMENT, HELD_BACK, KINDS, FieldFile

from airmuscle.bench import read
from airmuscle.errors import AirmuscleError
from airmuscle.recording import Recording

AT_ONCE = "at once"
MAPPED = "with the proposed mapping"
NOT_READ = "not"
TOLERANCE = 2e-3
"""Relative error that the digits of the files leave."""
READ = {name: AT_ONCE for name, _ in KINDS} | {
    "mat_matrix": MAPPED,
    "grid_with_corner": MAPPED,
    "rig_names": MAPPED,
    "units_alone_in_tabs": MAPPED,
    "outputs_and_inputs": MAPPED,
    "tensile_station": NOT_READ,
}


def is_complete(recordings: Sequence[Recording], file: FieldFile) -> bool:
    """Whether the recordings contain what is in the file; raises AssertionError for wrong
    numbers.
    """
    columns: dict[str, list[np.ndarray]] = {}
    for recording in recordings:
        for name, values in recording.columns.items():
            columns.setdefault(name.rpartition(".")[2], []).append(values)
    for name, true in file.truth.items():
        quantity = name.rpartition(".")[2]
        if quantity not in columns:
            return False
        parts = [*columns[quantity], np.concatenate(columns[quantity])]
        assert any(_equal(quantity, part, true) for part in parts), f"{file.name}: wrong {name}"
    return True


def _equal(quantity: str, values: np.ndarray, true: np.ndarray) -> bool:
    if len(values) != len(true):
        return False
    if quantity == "time":
        values, true = values - values[0], true - true[0]
    return bool(np.max(np.abs(values - true)) <= TOLERANCE * np.max(np.abs(true)))


def answered(text: str, file: FieldFile) -> str:
    """A proposed mapping file in which the user has answered the questions."""
    tables = tomllib.loads(text)
    lines = []
    if "grid" in tables:
        grid = tables["grid"].replace("force [?]", file.answers["cells"])
        lines.append(f"grid = {json.dumps(grid)}")
    lines.append("[columns]")
    for key, reading in tables.get("columns", {}).items():
        answer = file.answers.get(key)
        if "?" in reading and answer is not None:
            reading = reading.replace("?", answer) if answer and "[" not in answer else answer
        lines.append(f"{json.dumps(key)} = {json.dumps(reading)}")
    return "\n".join(lines)


def outcome(file: FieldFile, folder: Path) -> str:
    """How a file is read, by the commands that a new user has."""
    path = folder / file.name
    path.write_bytes(file.content)
    try:
        if is_complete(read(path), file):
            return AT_ONCE
    except AirmuscleError:
        pass
    mapping = folder / "rig.toml"
    airmuscle("inspect", path, "--save-mapping", mapping)
    if not mapping.exists():
        return NOT_READ
    mapping.write_text(answered(mapping.read_text("utf-8"), file), encoding="utf-8")
    try:
        return MAPPED if is_complete(read(path, mapping), file) else NOT_READ
    except AirmuscleError:
        return NOT_READ


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("name", "make"), KINDS, ids=[name for name, _ in KINDS])
def test_a_kind_of_file_is_read(tmp_path: Path, name: str, make):
    assert outcome(make(), tmp_path) == READ[name]


def test_the_kinds_that_are_held_back_are_as_many():
    assert len(DEVELOPMENT) == len(HELD_BACK) == 20
