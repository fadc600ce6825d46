"""Datasets of LeRobot: Parquet files below `data`, of which `meta/info.json` names the features.

A file holds one episode or, since version 3 of the format, several with their `episode_index`.
Source: https://huggingface.co/docs/lerobot, LeRobotDataset.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..tables import Arrays

INFO = Path("meta") / "info.json"
EPISODE = "episode_index"
"""Column of the number of the episode."""
MAX_DEPTH = 4
"""Greatest number of folders between a file and its dataset (chosen; the format has two)."""


def is_dataset(folder: Path) -> bool:
    """Whether a folder is a dataset of LeRobot."""
    return (folder / INFO).is_file()


def dataset_files(folder: Path) -> list[Path]:
    """The files with the episodes of a dataset, in their order."""
    return sorted((folder / "data").rglob("*.parquet"))


def named_episodes(path: Path, arrays: Arrays) -> list[Arrays]:
    """The arrays of each episode in a file of a dataset, a column for each name of a feature;
    the arrays themselves for any other file.
    """
    folder = next((up for up in list(path.parents)[:MAX_DEPTH] if is_dataset(up)), None)
    if folder is None:
        return [arrays]
    info = json.loads((folder / INFO).read_text(encoding="utf-8"))
    columns = _with_names(arrays, info.get("features", {}))
    index = columns.get(EPISODE)
    if index is None:
        return [columns]
    episodes: list[Arrays] = []
    for number in np.unique(index):
        rows = index == number
        episodes.append({name: values[rows] for name, values in columns.items()})
    return episodes


def _with_names(arrays: Arrays, features: Mapping[str, Any]) -> dict[str, Any]:
    """The arrays, of which those with names have a column for each, `observation.state.elbow`."""
    columns = {}
    for name, values in arrays.items():
        names = _names(features.get(name, {}))
        is_named = values.ndim == 2 and len(names) == values.shape[1]
        if not is_named:
            columns[name] = values
            continue
        for i, part in enumerate(names):
            columns[f"{name}.{part}"] = values[:, i]
    return columns


def _names(feature: Mapping[str, Any]) -> list[str]:
    """The names of the elements of a feature: a list, or a list by the kind of its elements."""
    names = feature.get("names") or []
    if isinstance(names, Mapping):
        names = next(iter(names.values()), [])
    return [str(name) for name in names]
