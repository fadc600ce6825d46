"""A kernel as its callers see it: machine code that is kept on this machine and runs without a start of numba.

numba takes 0.35 s to start, SciPy's linear algebra among it, before it runs what it compiled on another day. So a
kernel is compiled by numba once, its machine code is `kept` as a file, and every later process loads that alone. What
it is not compiled for, as an array that is not contiguous, goes to numba as ever.
"""

from __future__ import annotations

import importlib
import struct
import threading
from ctypes import CFUNCTYPE, c_char_p, c_int64
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import FileError
from . import numpy_layout, store
from .announce import announce, announce_compilation
from .entry_point import DTYPES, REFUSED

_DTYPES = {"q": np.dtype(np.int64), "d": np.dtype(np.float64)}
_FIRST_SLOTS = tuple(id(_DTYPES[letter]) for letter in DTYPES)
_NUMBERS = {int: "q", float: "d"}
_compiling = threading.RLock()
_ENTRY = CFUNCTYPE(c_int64, c_char_p)


class _Loaded(NamedTuple):
    """Machine code, how its arguments are packed, their types, and what must live as long as it is called."""

    run: Any
    pack: Any
    types: tuple[type[Any], ...]
    engine: Any


class Kernel:
    """A kernel that returns a status or nothing, by the name of it and of its module."""

    def __init__(self, name: str, module: str = "") -> None:
        self.name = name
        self.module = module or name
        self._loaded: _Loaded | None = None
        self._only_numba = False

    def __call__(self, *arguments: Any) -> Any:
        """Run it on whole numbers, floats and arrays of both."""
        if self._loaded is None and not self._only_numba:
            self._load(arguments)
        loaded = self._loaded
        if loaded is not None and tuple(map(type, arguments)) == loaded.types:
            slots = [id(a) if type(a) is np.ndarray else a for a in arguments]
            status = loaded.run(loaded.pack(*_FIRST_SLOTS, *slots))
            if status != REFUSED:
                return status
        return self._by_numba(arguments)

    def _by_numba(self, arguments: tuple[Any, ...]) -> Any:
        kernel = self.numba
        announce_compilation(kernel)
        return kernel(*arguments)

    @property
    def numba(self) -> Any:
        """The kernel as it is written, which numba compiles for whatever it is called with.

        Raises FileError where there is no folder to keep it in.
        """
        try:
            return getattr(importlib.import_module(f"...kernels.{self.module}", __name__), self.name)
        except RuntimeError as error:
            if "cannot cache" not in str(error):
                raise
            raise FileError(
                "there is no folder to keep compiled code in: neither the program's own nor the user's cache can be "
                "written to. Name one that can be in the environment variable NUMBA_CACHE_DIR."
            ) from None

    def _load(self, arguments: tuple[Any, ...]) -> None:
        """Find or make the machine code for arguments of these kinds; where there is none, numba is left."""
        kinds = _kinds(arguments)
        if kinds is None or not numpy_layout.as_known():
            return
        with _compiling:
            if self._loaded is not None:
                return
            code = store.load(self.name, kinds)
            if code is None:
                announce(self.name)
                code = store.save(self.name, kinds, self._made(kinds, arguments))
            self._only_numba = not code
            self._loaded = _in_memory(code, kinds, arguments) if code else None

    def _made(self, kinds: tuple[str, ...], arguments: tuple[Any, ...]) -> bytes:
        from .object_code import build

        return build(self.numba, kinds, arguments)


def _kinds(arguments: tuple[Any, ...]) -> tuple[str, ...] | None:
    """The letter of each number and array, the latter's dimensions behind it; nothing if one is of another kind."""
    found = []
    for a in arguments:
        if type(a) in _NUMBERS:
            found.append(_NUMBERS[type(a)])
        elif type(a) is np.ndarray and a.flags.num & numpy_layout.PLAIN == numpy_layout.PLAIN:
            found += [f"{letter}{a.ndim}" for letter, dtype in _DTYPES.items() if a.dtype is dtype]
    if len(found) < len(arguments):
        return None
    return tuple(found)


def _in_memory(code: bytes, kinds: tuple[str, ...], arguments: tuple[Any, ...]) -> _Loaded:
    from .object_code import load_engine

    engine = load_engine(code)
    row = struct.Struct("=" + "q" * len(DTYPES) + "".join(k if len(k) == 1 else "q" for k in kinds))
    return _Loaded(_ENTRY(engine.get_function_address("entry")), row.pack, tuple(map(type, arguments)), engine)


rodas4, fixed_step, evaluate = Kernel("rodas4"), Kernel("fixed_step"), Kernel("evaluate")
rates_of_each = Kernel("rates_of_each", "rates")
