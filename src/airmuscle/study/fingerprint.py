"""The fingerprint of what results depend on: descriptions of models, and of the program that computes with them."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

PACKAGE_ROOT = Path(__file__).parents[1]
EXCLUDED_PACKAGES = ("cli", "report", "reproduce", "studio", "export", "identify")
"""Parts of the program on which no run depends."""
NUMERICAL_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "casadi")


def fingerprint(*things: Any) -> str:
    """Sixty-four hexadecimal digits that change with anything in the things: numbers, texts, tables, models."""
    text = json.dumps([_to_json(thing) for thing in things], ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _to_json(thing: Any) -> Any:
    """A thing in JSON's words, every bit of its numbers kept."""
    if thing is None or isinstance(thing, bool | str | int):
        return thing
    if isinstance(thing, float):
        return float(thing).hex()
    if isinstance(thing, np.ndarray):
        return [str(thing.dtype), thing.shape, hashlib.sha256(np.ascontiguousarray(thing).tobytes()).hexdigest()]
    if isinstance(thing, Mapping):
        return {"keys": [[_to_json(k), _to_json(v)] for k, v in thing.items()]}
    if isinstance(thing, list | tuple):
        return [_to_json(item) for item in thing]
    if dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        fields = {f.name: _to_json(getattr(thing, f.name)) for f in dataclasses.fields(thing)}
        return [f"{type(thing).__module__}.{type(thing).__qualname__}", fields]
    return repr(thing)  # a date of a TOML file; what no part of a scenario should be is told apart by its words


@functools.cache
def program_fingerprint() -> str:
    """The fingerprint of this program: its version and its own files, and the versions of what computes for it."""
    files = [
        p for p in sorted(PACKAGE_ROOT.rglob("*.py")) if p.relative_to(PACKAGE_ROOT).parts[0] not in EXCLUDED_PACKAGES
    ]
    contents = [(p.relative_to(PACKAGE_ROOT).as_posix(), hashlib.sha256(p.read_bytes()).hexdigest()) for p in files]
    return fingerprint(
        metadata.version("airmuscle"), contents, [(name, metadata.version(name)) for name in NUMERICAL_PACKAGES]
    )
