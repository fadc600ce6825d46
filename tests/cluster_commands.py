"""The commands that distribute their work, and their input files."""

from pathlib import Path

import numpy as np
from arm_episodes import made_episodes
from scenario_files import HELD_FILL, HELD_STUDY, MUSCLE_FILE, PRESSURE_LOOP

from airmuscle import Recording, load, load_data
from airmuscle.bench import write

COMMANDS = {
    "compare": (
        "fit",
        "map.csv",
        "--compare",
        "--characteristic",
        "Sarosi2012",
        "--characteristic",
        "Hunt2017",
    ),
    "study": ("study", "study.toml"),
    "bootstrap": (
        "fit",
        "map.csv",
        "--characteristic",
        "Sarosi2012",
        "--bootstrap",
        20,
        "--leave-out",
        "pressure",
    ),
    "tune": ("tune", "loop.toml", "--simulations", 64, "--draws", 1),
    "compare-loops": ("compare", "loop.toml", "--spread", "mechanism.mass=20 %"),
    "campaign": ("campaign", "map.csv", "loop.csv", "--resting-length", "300 mm"),
    "size": ("size", "--load", "20 kg", "--stroke", "40 mm", "--supply", "6 bar", "--max-count", 1),
    "fit-joint": ("fit-joint", "episodes.npz", "--mapping", "arm.toml"),
}
FEW = ("study", "size")
"""The commands that run by default: the workers of the others start in three times the time."""


def write_inputs(folder: Path) -> None:
    """The input of all commands: a force map, a loop, a scenario with a controller, a study, and
    episodes of a joint.
    """
    contents = {
        "muscle": MUSCLE_FILE,
        "scenario": HELD_FILL,
        "loop": PRESSURE_LOOP,
        "study": HELD_STUDY.replace("48", "12"),
    }
    for name, content in contents.items():
        (folder / f"{name}.toml").write_text(content, encoding="utf-8")
    write(load_data("dmsp-20-300"), folder / "map.csv")
    time = np.linspace(0.0, 40.0, 401)
    contraction = 0.1 - 0.1 * np.cos(0.1 * np.pi * time)
    force = load("dmsp-20-300").characteristic.force(3e5, contraction) - 8.0 * np.sign(
        np.gradient(contraction)
    )
    columns = {"time": time, "pressure": np.full(401, 3e5), "contraction": contraction}
    noise = np.random.default_rng(1).standard_normal(401)
    write(Recording({**columns, "force": force + noise}, "loop"), folder / "loop.csv")
    _write_episodes(folder)


def _write_episodes(folder: Path) -> None:
    episodes = made_episodes(12)
    np.savez(
        folder / "episodes.npz",
        start=np.cumsum([0, *map(len, episodes.runs)]),
        q=episodes.rows("angle"),
        v=episodes.rows("speed"),
        p=episodes.rows("pressure"),
    )
    (folder / "arm.toml").write_text(
        'sample_time = "10 ms"\nstarts = "start"\n[angles]\ncolumns = ["q"]\n[speeds]\ncolumns ='
        ' ["v"]\n[pressures]\ncolumns = ["p"]\n[arm]\npairs = [[1, 2]]\n',
        encoding="utf-8",
    )
