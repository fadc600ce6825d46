"""Check of a record: every planted fault is named, and no good record is blamed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from planted_faults import FAULTS, GOOD, Columns, recording, regulator, simulated

from airmuscle.bench import check_record, diagnose, fit_regulator
from airmuscle.errors import IdentificationError

pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.mark.parametrize("name", GOOD)
def test_a_good_record_is_not_blamed(name: str):
    check = check_record(recording(GOOD[name]()))
    assert check.is_usable, check.faults
    assert diagnose(check) == ()


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_named(name: str):
    rule, make = FAULTS[name]
    check = check_record(recording(make()))
    assert rule in [fault.rule for fault in check.faults], check.faults
    found = {diagnosis.rule: diagnosis.text for diagnosis in diagnose(check)}
    remedies = {fault.rule: fault.remedy for fault in check.faults}
    assert found.keys() == remedies.keys()
    assert all(text.endswith(remedies[name]) for name, text in found.items())


@pytest.mark.parametrize("noisy", [True, False])
@pytest.mark.parametrize("plant", ["joint-dmsp-20-itv2050", "joint-straight-fibre"])
def test_a_simulated_record_is_not_blamed(plant: str, noisy: bool):
    check = check_record(recording(simulated(plant, noisy)))
    assert check.is_usable, check.faults


def saved(folder: Path, columns: Columns) -> Path:
    path = folder / "record.csv"
    units = {"time": "s", "setpoint": "Pa", "pressure": "Pa"}
    rows = np.column_stack(list(columns.values()))
    header = ",".join(f"{name} [{units[name]}]" for name in columns)
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.9g")
    return path


def test_the_command_says_usable_or_not_and_why(tmp_path: Path):
    good = airmuscle("check", saved(tmp_path, regulator()))
    assert "Usable: no fault was found." in good.output
    path = saved(tmp_path, FAULTS["zero of the pressure"][1]())
    bad = airmuscle("check", path)
    assert (good.exit_code, bad.exit_code) == (0, 1)
    assert "Not usable as it is." in bad.output
    assert "Set the zero of the sensor." in " ".join(bad.output.split())
    answer = json.loads(airmuscle("check", path, "--json").stdout)
    assert answer["check"]["faults"][0]["fault"] == "zero"


def test_exchanged_columns_are_refused_before_a_fit():
    exchanged = recording(FAULTS["command and pressure exchanged"][1]())
    with pytest.raises(IdentificationError, match=r"precedes its command by .* exchanged"):
        fit_regulator([exchanged], supply_pressure=6e5)
