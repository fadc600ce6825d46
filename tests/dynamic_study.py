"""Files of dynamic identification that several tests use: a muscle between two valves, its runs,
and noisy records.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from airmuscle.files import load_scenario

VALVES = '["circuit.fill.conductance", "circuit.discharge.conductance"]'

HELD = 'model = "Isometric"\ncontraction = 0.05'
"""A muscle of constant length, as the mechanism of a plant."""
STUDY = f"""
[input]
fill = [["0.1 s", 1], ["1 s", 0]]
discharge = [["1.3 s", 1]]
[observed]
pressure = "500 Pa"
[fit]
free = [{VALVES}, "gas.exponent"]
"""
"""Filling and discharge, from which the valves and the exponent of the gas are identified."""


def plant_table(
    mechanism: str,
    *,
    exponent: float,
    conductance: float,
    damping: float | None = None,
    supply: float = 5,
) -> str:
    """The table of a plant with two valves of one conductance [m3/(s Pa)] at a supply [bar]."""
    damper = (
        "" if damping is None else f'damper = {{ model = "LinearDamper", damping = {damping} }}\n'
    )
    return f"""
[plant]
gas = {{ model = "Polytropic", exponent = {exponent} }}
[plant.muscle]
library = "dmsp-20-300"
{damper}[plant.circuit]
model = "FillDischarge"
supply = {{ model = "Supply", pressure = "{supply} bar" }}
fill = {{ model = "Valve", conductance = {conductance}, critical_ratio = 0.3 }}
discharge = {{ model = "Valve", conductance = {conductance}, critical_ratio = 0.3 }}
[plant.mechanism]
{mechanism}
"""


def run_table(pressure: str) -> str:
    """The table of a run of 2 s from a pressure."""
    return (
        '[run]\nduration = "2 s"\noutput_times = "10 ms"\ninitial_state = { pressure ='
        f' "{pressure}" }}\n'
    )


def noisy_run(
    scenario: Path, rng: np.random.Generator, deviations: Mapping[str, float]
) -> dict[str, Any]:
    """Time and noisy columns of the run of a scenario; `deviations` are the standard deviations of
    their noise.
    """
    run = load_scenario(scenario).simulate()
    noisy = {
        name: run[name] + deviation * rng.standard_normal(len(run))
        for name, deviation in deviations.items()
    }
    return {"time": run["time"], **noisy}


def variant(folder: Path, **changes: str) -> Path:
    """The study with pieces of its text replaced, in a file of its own beside the records."""
    text = (folder / "study.toml").read_text(encoding="utf-8")
    for was, becomes in changes.values():
        assert was in text
        text = text.replace(was, becomes)
    path = folder / "variant.toml"
    path.write_text(text, encoding="utf-8")
    return path
