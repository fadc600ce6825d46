"""Black boxes for the free run of a measured arm, judged on the windows of `real_arm.py`: random
features and a GRU.

    python benchmarks/real_arm_networks.py EPISODES.npz MAPPING.toml [--left-out 300] [--minutes 20]
        [--keep ERRORS.npz]

Both are fitted to the first episodes, see what `fit_joint` sees (the rows before the start of a
window, angle and speed at its start, and the pressures until its end), and are judged on the last
ones. Random features: ridge regression of the change of the angles in a row on 400 random tanh
features of four rows. The GRU of PyTorch (160 units) predicts accelerations and is trained on its
free run from all starts, for a given CPU time of one thread; its last iterate counts, no episode
chooses it.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch

import airmuscle as am

HISTORY = 10
ROWS = 40
DEPTH = 4
FEATURES = 400
UNITS = 160
BATCH = 128
Runs = list[dict[str, np.ndarray]]


def cut(runs: Runs, stride: int) -> dict[str, np.ndarray]:
    """Angles, speeds and pressures of the windows (N, HISTORY + 1 + ROWS, columns)."""
    found = [(e, k) for e in runs for k in range(HISTORY, len(e["angle"]) - ROWS - 1, stride)]
    return {
        name: np.array([e[name][k - HISTORY : k + ROWS + 1] for e, k in found]) for name in runs[0]
    }


def random_features(runs: Runs, judge: dict[str, np.ndarray]) -> np.ndarray:
    """Angles (N, ROWS, J) that a regression on random features predicts in free run; fitted to
    every third episode.
    """

    def regressors(angle: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [angle.reshape(len(angle), -1), pressure.reshape(len(angle), -1)], axis=1
        )

    pieces = [
        (
            e["angle"][k - DEPTH + 1 : k + 1],
            e["pressure"][k - DEPTH + 1 : k + 2],
            e["angle"][k + 1] - e["angle"][k],
        )
        for e in runs[::3]
        for k in range(DEPTH, len(e["angle"]) - 1)
    ]
    x = regressors(np.array([p[0] for p in pieces]), np.array([p[1] for p in pieces]))
    mean, spread = x.mean(axis=0), x.std(axis=0) + 1e-9
    inner = np.random.default_rng(0).normal(size=(x.shape[1], FEATURES)) / np.sqrt(x.shape[1])

    def lift(x: np.ndarray) -> np.ndarray:
        z = (x - mean) / spread
        return np.concatenate([z, np.ones((len(z), 1)), np.tanh(2 * z @ inner)], axis=1)

    design = lift(x)
    normal = design.T @ design + 1e-4 * len(design) * np.eye(design.shape[1])
    coefficients = np.linalg.solve(normal, design.T @ np.array([p[2] for p in pieces]))
    angle = judge["angle"][:, : HISTORY + 1].copy()
    for row in range(HISTORY, HISTORY + ROWS):
        seen = regressors(
            angle[:, row - DEPTH + 1 : row + 1], judge["pressure"][:, row - DEPTH + 1 : row + 2]
        )
        angle = np.concatenate(
            [angle, np.clip(angle[:, -1] + lift(seen) @ coefficients, -9, 9)[:, None]], axis=1
        )
    return angle[:, HISTORY + 1 :]


class Recurrent(torch.nn.Module):
    """GRU that sees angles, speeds and pressures of a row and adds a change of the speeds."""

    def __init__(self, runs: Runs, sample_time: float) -> None:
        super().__init__()
        rows = {name: np.concatenate([e[name] for e in runs]) for name in runs[0]}
        self.mean = {
            name: torch.tensor(x.mean(axis=0), dtype=torch.float32) for name, x in rows.items()
        }
        self.spread = {
            name: torch.tensor(x.std(axis=0), dtype=torch.float32) for name, x in rows.items()
        }
        self.sample_time = sample_time
        joints = len(self.mean["angle"])
        muscles = len(self.mean["pressure"])
        self.cell = torch.nn.GRUCell(4 * joints + 2 * muscles, UNITS)
        inner = torch.nn.Linear(UNITS + 2 * muscles, 96)
        self.head = torch.nn.Sequential(inner, torch.nn.Tanh(), torch.nn.Linear(96, joints))
        self.head[2].weight.data *= 0.1

    def forward(
        self, angle: torch.Tensor, speed: torch.Tensor, pressure: torch.Tensor, rows: int
    ) -> torch.Tensor:
        p = (pressure - self.mean["pressure"]) / self.spread["pressure"]

        def seen(q: torch.Tensor, v: torch.Tensor, k: int) -> torch.Tensor:
            scaled = [(q - self.mean["angle"]) / self.spread["angle"], torch.sin(q), torch.cos(q)]
            return torch.cat([*scaled, v / self.spread["speed"], p[:, k], p[:, k + 1]], dim=-1)

        memory = torch.zeros(len(angle), UNITS)
        for k in range(HISTORY):
            memory = self.cell(seen(angle[:, k], speed[:, k], k), memory)
        q = angle[:, HISTORY]
        v = speed[:, HISTORY]
        found = []
        for k in range(HISTORY, HISTORY + rows):
            memory = self.cell(seen(q, v, k), memory)
            v = (
                v
                + self.head(torch.cat([memory, p[:, k], p[:, k + 1]], dim=-1))
                * self.spread["speed"]
            )
            q = q + v * self.sample_time
            found.append(q)
        return torch.stack(found, dim=1)


def train(runs: Runs, sample_time: float, minutes: float) -> Recurrent:
    """The network after this CPU time: short free runs first, Adam with a falling step, clipped
    errors.
    """
    starts = [(e, k) for e in runs for k in range(HISTORY, len(e["angle"]) - ROWS - 1)]
    rng = np.random.default_rng(0)
    network = Recurrent(runs, sample_time)
    size = 0.15 * network.spread["angle"]
    optimiser = torch.optim.Adam(network.parameters(), 2e-3)
    begin = time.process_time()
    count = 0
    while (share := (time.process_time() - begin) / (60 * minutes)) < 1.0:
        rate = 2e-3 * min(1.0, count / 100 + 0.05) * (0.5 * (1 + np.cos(np.pi * share)) + 0.01)
        optimiser.param_groups[0]["lr"] = rate
        rows = min(ROWS, int(8 + 80 * share))
        chosen = [starts[i] for i in rng.integers(0, len(starts), BATCH)]
        batch = {
            name: torch.tensor(
                np.array([e[name][k - HISTORY : k + ROWS + 1] for e, k in chosen]),
                dtype=torch.float32,
            )
            for name in ("angle", "speed", "pressure")
        }
        error = (
            network(**batch, rows=rows) - batch["angle"][:, HISTORY + 1 : HISTORY + 1 + rows]
        ) / size
        loss = (
            torch.nn.functional.smooth_l1_loss(error, torch.zeros_like(error))
            if share < 0.5
            else ((error**2).clamp(max=25).mean())
        )
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        count += 1
        if count % 500 == 0:
            print(
                f"{time.process_time() - begin:5.0f} s  iteration {count}, loss {loss.item():.4f}",
                flush=True,
            )
    return network


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("episodes", type=Path)
    parser.add_argument("mapping", type=Path)
    parser.add_argument("--left-out", type=int, default=300)
    parser.add_argument("--minutes", type=float, default=20.0, help="CPU time of the training")
    parser.add_argument("--keep", type=Path, help="file for the errors of every window (NPZ)")
    given = parser.parse_args()
    torch.manual_seed(0)
    torch.set_num_threads(1)
    episodes = am.bench.read_episodes(given.episodes, am.bench.read_episode_mapping(given.mapping))
    runs = [
        {n: getattr(run, n).astype(np.float64) for n in ("angle", "speed", "pressure")}
        for run in episodes.runs
    ]
    first = runs[: -given.left_out]
    judge = cut(runs[-given.left_out :], ROWS)
    truth = judge["angle"][:, HISTORY + 1 :]
    errors = {"random features": random_features(first, judge) - truth}
    network = train(first, episodes.sample_time, given.minutes)
    with torch.no_grad():
        found = network(
            **{n: torch.tensor(x, dtype=torch.float32) for n, x in judge.items()}, rows=ROWS
        )
    errors["GRU"] = found.double().numpy() - truth
    for name, error in errors.items():
        level = np.degrees(np.sqrt(np.mean(error**2, axis=(0, 1))))
        print(
            f"{name}: {', '.join(f'{e:.2f}' for e in level)} deg over {len(error)} windows",
            flush=True,
        )
    if given.keep:
        np.savez(given.keep, **errors)


if __name__ == "__main__":
    main()
