"""Kernel: a numerical kernel by its name, compiled once per machine and called without importing
numba.

numba takes 0.35 s to import before it runs what it compiled on another day. So a kernel is compiled
by numba once, its machine code is stored (`store`), and every later process loads that alone. It is
called with addresses and lengths.
"""

import ctypes
import functools
import importlib
import itertools
import math
import pathlib
import re
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..llvm.engine_packages import numba_module
from ..llvm.jit import build, engine_of, slot_count
from . import store

_KERNELS = pathlib.Path(__file__).parents[1] / "kernels"
_ITEMS = {np.dtype(np.int64): "q", np.dtype(np.float64): "d", np.dtype(np.float32): "f"}
_KINDS = {
    (dtype, dimensions): f"{item}{dimensions}"
    for dtype, item in _ITEMS.items()
    for dimensions in range(5)
}
_compiling = threading.RLock()
_address = ctypes.addressof
_view = ctypes.c_char.from_buffer
_ENTRY = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)


def address_of(array: Any) -> int:
    """The address of the first element of a C-contiguous, writeable array."""
    return _address(_view(array)) if array.size else 0


ALIGNMENT = 64
"""Alignment of vectors in memory, in bytes."""


def aligned_array(shape: tuple[int, ...], dtype: Any = np.float64) -> Any:
    """An array of zeros that begins at a multiple of ALIGNMENT bytes."""
    kind = np.dtype(dtype)
    size = math.prod(shape) * kind.itemsize
    room = np.zeros(size + ALIGNMENT, np.uint8)
    begin = -room.ctypes.data % ALIGNMENT
    end = begin + size
    aligned = room[begin:end]
    return aligned.view(dtype).reshape(shape)


def _kind(argument: Any) -> str:
    """The kind of an argument: "q", "d", or the letter of an array's items with its dimensions."""
    if type(argument) is float:
        return "d"
    if type(argument) is int:
        return "q"
    return _KINDS[argument.dtype, argument.ndim]


class Kernel:
    """A kernel that returns a status, by its name and that of its module in `compile.kernels`.

    Callers name its arguments as its function declares them.
    """

    def __init__(self, name: str, module: str = "") -> None:
        self.name = name
        self.module = module or name
        self._entries: dict[tuple[str, ...], Any] = {}

    @functools.cached_property
    def places(self) -> dict[str, int]:
        """The arguments by name, in the order in which the kernel's function declares them.

        They are read from its source: to import the function takes numba.
        """
        text = (_KERNELS / f"{self.module}.py").read_text(encoding="utf-8")
        declared = re.search(rf"^def {self.name}\(([^)]*)\)", text, re.MULTILINE)
        assert declared is not None, f"{self.module}.py defines no {self.name}"
        names = [name.strip() for name in declared[1].split(",")]
        return {name: place for place, name in enumerate(filter(None, names))}

    def bind(self, **arguments: Any) -> "BoundKernel":
        """The kernel with its arguments by name: integers, floats, and C-contiguous arrays of
        int64, float64 or float32. Raises TypeError for an argument that is unknown or missing.
        """
        if arguments.keys() != self.places.keys():
            missing = [name for name in self.places if name not in arguments]
            unknown = [name for name in arguments if name not in self.places]
            raise TypeError(f"kernel {self.name}: missing {missing}, unknown {unknown}")
        return BoundKernel(self, tuple([arguments[name] for name in self.places]))

    def __call__(self, **arguments: Any) -> int:
        """Run it once."""
        return self.bind(**arguments)()

    @property
    def numba(self) -> Any:
        """The Python function of the kernel, which numba compiles for the types of its
        arguments. Raises MissingPackageError without numba.
        """
        numba_module()
        return getattr(importlib.import_module(f"...kernels.{self.module}", __name__), self.name)

    def entry(self, kinds: tuple[str, ...]) -> Any:
        """The machine code for arguments of these kinds, as a function of the address of slots;
        None without it.
        """
        if kinds not in self._entries:
            with _compiling:
                if kinds not in self._entries:
                    self._entries[kinds] = self._load(kinds)
        loaded = self._entries[kinds]
        return loaded and loaded[0]

    def _load(self, kinds: tuple[str, ...]) -> tuple[Any, Any] | None:
        """The entry point, and the engine that owns its machine code."""
        code = store.load(self.name, kinds)
        if code is None:
            print(
                f"compiling {self.name}, once on this machine (some seconds) ...",
                file=sys.stderr,
                flush=True,
            )
            code = store.save(self.name, kinds, build(self.numba, kinds))
        if not code:
            return None
        engine = engine_of(code)
        return _ENTRY(engine.get_function_address("entry")), engine


class BoundKernel:
    """A kernel with its arguments, for many runs; arrays are passed by address and referenced.

    Between two runs the contents of arrays may change, and arguments may be replaced by others of
    their kind; they are named as in `Kernel.bind`.
    """

    __slots__ = (
        "_address",
        "_arguments",
        "_floats",
        "_kernel",
        "_kinds",
        "_numba",
        "_offsets",
        "_places",
        "_run",
        "_slots",
    )

    def __init__(self, kernel: Kernel, arguments: tuple[Any, ...]) -> None:
        self._kinds = tuple(map(_kind, arguments))
        counts = map(slot_count, self._kinds)
        *self._offsets, count = itertools.accumulate(counts, initial=0)
        self._slots = (ctypes.c_int64 * count)()
        self._floats = (ctypes.c_double * count).from_buffer(self._slots)
        self._address = ctypes.addressof(self._slots)
        self._arguments = list(arguments)
        self._places = kernel.places
        for kind, offset, argument in zip(self._kinds, self._offsets, arguments, strict=True):
            self._set(kind, offset, argument)
        self._kernel = kernel  # its machine code must live as long
        entry = kernel.entry(self._kinds)
        self._run: Any = entry
        self._numba: Any = None if entry else kernel.numba

    def replace(self, name: str, argument: Any) -> None:
        """Take another argument of the same kind."""
        index = self._places[name]
        if self._arguments[index] is not argument:
            self._arguments[index] = argument
            self._set(self._kinds[index], self._offsets[index], argument)

    def replace_input(self, name: str, array: Any) -> None:
        """Take another array that the kernel only reads; it may be read-only."""
        index = self._places[name]
        if self._arguments[index] is array:
            return
        if array.flags.writeable:
            self.replace(name, array)
        elif not array.flags.c_contiguous or _kind(array) != self._kinds[index]:
            raise TypeError(
                f"argument {name} must be a C-contiguous array of kind {self._kinds[index]}"
            )
        else:
            self._arguments[index], offset = array, self._offsets[index]
            self._slots[offset : offset + 1 + array.ndim] = [array.ctypes.data, *array.shape]

    def _set(self, kind: str, offset: int, argument: Any) -> None:
        """Write an argument into its slots."""
        if kind == "d":
            self._floats[offset] = argument
        elif kind == "q":
            self._slots[offset] = argument
        else:
            slots = self._slots
            slots[offset] = address_of(argument)
            for length in argument.shape:
                offset += 1
                slots[offset] = length

    def point(self, addresses: Mapping[str, int], length: int) -> None:
        """Set the addresses of arrays, within live arrays, and their first dimension."""
        arguments = self._arguments
        for name, address in addresses.items():
            i = self._places[name]
            offset = self._offsets[i]
            self._slots[offset] = address
            self._slots[offset + 1] = length
            if self._numba is None:
                arguments[i] = address
                continue
            shape = length, *arguments[i].shape[1:]
            count = math.prod(shape)
            numbers = (
                np.ctypeslib.as_array((ctypes.c_double * count).from_address(address))
                if count
                else np.empty(0)
            )
            arguments[i] = numbers.reshape(shape)

    @property
    def entry_address(self) -> int | None:
        """The address of the entry point, for other kernels that call this one; None without
        machine code.
        """
        return None if self._numba else ctypes.cast(self._run, ctypes.c_void_p).value

    @property
    def slots(self) -> Any:
        """The slots of the arguments as an array of int64 that shares their memory."""
        return np.frombuffer(memoryview(self._slots), dtype=np.int64)

    def slot_of(self, name: str) -> int:
        """The place in the slots of an argument."""
        return self._offsets[self._places[name]]

    @property
    def runner(self) -> Callable[[], int]:
        """A function that runs the kernel with less overhead than the kernel itself, as long as the
        kernel lives.
        """
        return self if self._numba else functools.partial(self._run, self._address)

    def __call__(self) -> int:
        """Run the kernel; its status."""
        if self._numba is None:
            return self._run(self._address)  # type: ignore[no-any-return]
        return int(self._numba(*self._arguments) or 0)


rodas4 = Kernel("rodas4")
fixed_step = Kernel("fixed_step")
lanes = Kernel("lanes")
evaluate = Kernel("evaluate")
evaluate_rates = Kernel("evaluate_rates", "evaluate")
record = Kernel("record", "evaluate")
newton = Kernel("newton")
sampled_loop = Kernel("sampled_loop")
begin_step = Kernel("begin_step", "evaluate")
end_step = Kernel("end_step", "evaluate")
lane_blocks = Kernel("lane_blocks", "lanes")
loop_lanes = Kernel("loop_lanes")
