"""Free run of an arm identified from measured episodes, beside persistence and ARX.

    python benchmarks/real_arm.py EPISODES.npz MAPPING.toml [--left-out 300] [--residual] [--figure
        horizon.png]

The episodes are read by `read_episodes`; the last ones judge. Windows of 40 rows begin at rows 10,
50, ... of each episode; a model is given angles and speeds at their start and the pressures until
their end. Errors are rms over all windows and rows, in degrees. The time is that of reading,
inspection, fit and judgement.
"""

from __future__ import annotations

import argparse
import os
import pickle
import time
from pathlib import Path

import numpy as np

import airmuscle as am
from airmuscle.core.plotting import save


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("episodes", type=Path)
    parser.add_argument("mapping", type=Path)
    parser.add_argument("--left-out", type=int, default=300)
    parser.add_argument(
        "--uncoupled", action="store_true", help="ignore the axes of the mapping file"
    )
    parser.add_argument(
        "--residual", action="store_true", help="fit a hybrid law to what physics leaves"
    )
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--pickle", type=Path, help="file for the fit itself (pickle)")
    parser.add_argument("--keep", type=Path, help="file for the errors of every window (NPZ)")
    given = parser.parse_args()
    start, spent = time.perf_counter(), time.process_time()

    def say(text: str) -> None:
        print(f"{time.perf_counter() - start:5.0f} s  {text}", flush=True)

    mapping = am.bench.read_episode_mapping(given.mapping)
    episodes = am.bench.read_episodes(given.episodes, mapping)
    fit = am.bench.fit_joint(
        episodes,
        pairs=mapping.pairs,
        axes=() if given.uncoupled else mapping.axes,
        left_out=given.left_out / len(episodes),
        residual=given.residual,
        progress=say,
    )
    print(fit)
    wall = time.perf_counter() - start
    used = time.process_time() - spent
    print(
        f"{len(episodes)} episodes: {wall:.0f} s, {used:.0f} s of this process on {os.cpu_count()}"
        " cores"
    )
    for row in (9, 19, 29, 39):
        errors = np.degrees(np.sqrt(np.mean(fit.errors[:, row] ** 2, axis=0)))
        print(f"after {fit.horizon[row]:.3f} s: {', '.join(f'{e:.2f}' for e in errors)} deg")
    for each in fit.regulators:
        print(each)
    judged = episodes[-given.left_out :]
    for any_pose in (False, True):
        print(f"from {'any pose' if any_pose else 'the poses in which episodes begin'}:")
        print(am.bench.estimate_angles(fit, judged, any_pose=any_pose))
    if given.pickle:
        given.pickle.write_bytes(pickle.dumps(fit))
    if given.keep:
        np.savez(
            given.keep, errors=fit.errors, band=fit.band, episode=fit.episode, **fit.by_baseline
        )
    if given.figure:
        save(fit.chapter().plots[0].draw(), given.figure)


if __name__ == "__main__":
    main()
