"""Texts of muscle and scenario files that several tests use: a braid, two valves at a supply, a
lift of the library; and files that are one of these texts with some of it replaced."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

BRAID = '{ model = "Braid", radius = "10 mm", braid_angle = "25 deg", resting_length = "300 mm" }'
MUSCLE_FILE = f"""
title = "A braid"
provenance = "example"
geometry = {BRAID}
[characteristic]
model = "ChouHannaford1996"
geometry = {BRAID}
"""
CIRCUIT = """
[plant.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "5 bar" }
fill = { model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }
discharge = { model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }
"""
LIFT = """
[plant]
muscle = "dmsp-20-300"
circuit = { model = "FillDischarge", supply = { model = "Supply", pressure = "6 bar" }, fill = { library = "matrix-821" }, discharge = { library = "matrix-821" } }
mechanism = { model = "HangingMass", mass = "5 kg" }
[input]
fill = [["1 s", 1]]
[run]
duration = "2 s"
"""


def writer_of(whole: str) -> Callable[..., Path]:
    """`written(folder, *changes)`: a text with some of it replaced, as the file scenario.toml of
    the folder.
    """

    def written(folder: Path, *changes: tuple[str, str], text: str = whole) -> Path:
        for was, becomes in changes:
            assert was in text, was
            text = text.replace(was, becomes, 1)
        path = folder / "scenario.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written


HELD_FILL = f"""
[plant]
muscle = "muscle.toml"
{CIRCUIT}
[plant.mechanism]
model = "Isometric"
contraction = 0.05
[input]
fill = [["0.1 s", 1], ["0.3 s", 0]]
[run]
duration = "0.5 s"
output_times = "5 ms"
initial_state = {{ pressure = "0.5 bar" }}
"""
"""Scenario file of a fill at a held length; the muscle is `muscle.toml` beside it."""
PRESSURE_LOOP = f"""# A comment at the top
title = "Pressure of a lifted load"
[plant]
muscle = "muscle.toml"
{CIRCUIT}
[plant.mechanism]
model = "HangingMass"
mass = "5 kg"   # the load

[input.controller]
model = "PID"
measured = "pressure"
commanded = {{ model = "SplitRange", positive = "fill", negative = "discharge" }}
gain = "1.5 1/bar"          # a careful gain
integral_time = 0.6
sample_time = "10 ms"

[input.controller.setpoint]
pressure = [["0 s", "1 bar"], ["0.1 s", "2 bar"]]
[run]
duration = "0.3 s"
initial_state = {{ pressure = "1 bar" }}
"""

HELD_STUDY = """
scenario = "scenario.toml"
chunk_size = 4
[vary]
"mechanism.contraction" = { model = "Uniform", low = "2 %", high = "10 %" }
[design]
model = "MonteCarlo"
count = 48
[metrics]
pressure = { model = "Final", column = "pressure" }
"""
"""A study of the scenario HELD_FILL in scenario.toml."""
