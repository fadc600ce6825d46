"""Fingerprints of the inputs that results depend on: model descriptions and the version of the program."""

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
EXCLUDED_ROOMS = ("outlets", "papers", "report")
"""Rooms of the program that do not affect a simulation."""
NUMERICAL_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "casadi")


def fingerprint(*objects: Any) -> str:
    """A SHA-256 digest (64 hexadecimal digits) of numbers, texts, tables and models; any change changes it."""
    text = json.dumps([_to_json(each) for each in objects], ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _to_json(value: Any) -> Any:
    """An object as JSON data, with bit-exact numbers."""
    if value is None or isinstance(value, bool | str | int):
        return value
    if isinstance(value, float):
        return float(value).hex()
    if isinstance(value, np.ndarray):
        return [str(value.dtype), value.shape, hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()]
    if isinstance(value, Mapping):
        return {"keys": [[_to_json(k), _to_json(v)] for k, v in value.items()]}
    if isinstance(value, list | tuple):
        return [_to_json(item) for item in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {f.name: _to_json(getattr(value, f.name)) for f in dataclasses.fields(value)}
        return [f"{type(value).__module__}.{type(value).__qualname__}", fields]
    return repr(value)  # such as a date in a TOML file


@functools.cache
def program_fingerprint(excluded: tuple[str, ...] = EXCLUDED_ROOMS) -> str:
    """The fingerprint of the program: its version, its source files, and the versions of the numerical packages.

    excluded  rooms of the program that do not affect the results; by default those of a simulation
    """
    files = [p for p in sorted(PACKAGE_ROOT.rglob("*.py")) if p.relative_to(PACKAGE_ROOT).parts[0] not in excluded]
    contents = [(p.relative_to(PACKAGE_ROOT).as_posix(), hashlib.sha256(p.read_bytes()).hexdigest()) for p in files]
    versions = [(name, metadata.version(name)) for name in NUMERICAL_PACKAGES]
    return fingerprint(metadata.version("airmuscle"), contents, versions)
