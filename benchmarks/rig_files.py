"""Synthetic measurement files of a rig as laboratories have them: slack rows, loops, uneven runs,
resolution.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

LENGTHS = (0.1, 0.2, 0.4)
"""Resting lengths [m] of the muscles (chosen)."""
CONTRACTIONS = (0.0, 0.04, 0.08, 0.12)
"""Held contractions of each muscle; they differ by up to 10 % between muscles (chosen)."""
ROWS = 500
MAX_PRESSURE = 6.2e5
LOWER_LIMIT = -7.0
"""Reading [N] of the force sensor with a slack muscle: its lower limit (chosen)."""


def true_force(pressure: np.ndarray, contraction: float, length: float, seed: int) -> np.ndarray:
    """Force [N] of a muscle, which pulls above a threshold of pressure; no law of the library."""
    scatter = np.random.default_rng(seed).standard_normal(3)
    free = 0.24 + 0.02 * np.log(length / 0.2) + 0.005 * scatter[0]
    gain = 7.5e-4 * (1 + 0.08 * np.log(length / 0.2) + 0.02 * scatter[1])
    threshold = 4e4 + 1.1e6 * contraction * (1 + 0.1 * scatter[2])
    return np.asarray(gain * (pressure - threshold) * (1 - contraction / free) ** 1.3)


def make_columns(length: float, contraction: float, repeat: int) -> dict[str, np.ndarray]:
    """One sweep of pressure, up and down in steps of a pulsed valve, of unequal speed."""
    muscle = LENGTHS.index(length)
    random = np.random.default_rng([muscle, int(1e3 * contraction), repeat])
    speed = np.cumsum(random.uniform(0.2, 1.8, ROWS))
    phase = (speed - speed[0]) / (speed[-1] - speed[0])
    share = 1 - np.abs(2 * phase - 1)
    pressure = 8e3 + (MAX_PRESSURE * random.uniform(0.96, 1.0) - 8e3) * share
    held = contraction * (1 + 0.05 * (muscle - 1))
    force = true_force(pressure, held, length, muscle)
    width = random.uniform(0.05, 0.1) * true_force(np.array([MAX_PRESSURE]), 0.0, length, muscle)[0]
    loop = (
        width
        / 2
        * np.where(phase < 0.5, -1.0, 1.0)
        * np.minimum(1.0, 12 * np.minimum(share, 1.05 - share))
    )
    measured = (
        force + loop * (force > 0) + 1.5 * random.standard_normal(ROWS) + random.normal(0.0, 1.5)
    )
    return {
        "time [s]": np.round(60 * phase, 2),
        "pressure [kPa]": np.round((pressure + 500 * random.standard_normal(ROWS)) / 1e3, 1),
        "contraction [%]": np.full(ROWS, round(100 * held, 2)),
        "force [N]": np.round(np.maximum(measured, LOWER_LIMIT + random.normal(0.0, 0.3)), 1),
    }


def write_files(folder: Path) -> list[Path]:
    """24 CSV files: three muscles, four held contractions, two repeats."""
    paths = []
    for length in LENGTHS:
        for contraction in CONTRACTIONS:
            for repeat in range(2):
                columns = make_columns(length, contraction, repeat)
                path = folder / f"{1e3 * length:.0f}mm_{100 * contraction:.0f}_{repeat + 1}.csv"
                rows = "\n".join(
                    ",".join(f"{x:g}" for x in row) for row in zip(*columns.values(), strict=True)
                )
                heading = f"# resting_length [mm] = {1e3 * length:g}\n{','.join(columns)}\n"
                path.write_text(f"{heading}{rows}\n", encoding="utf-8")
                paths.append(path)
    return paths
