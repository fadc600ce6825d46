"""Entry point of a compiled kernel, as LLVM text: `i64 entry(i64 *slots)`, a C signature.

Each argument of the kernel takes slots of eight bytes in turn: an integer or a float its value, an array the address of
its first element and then its dimensions. The kernel itself was compiled by numba, whose functions take an array as
its owner, its number of items, their size, its data, its shape and its strides; all arrays are C-contiguous.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence

_NUMBERS = {"q": "i64", "d": "double"}
_ITEM_SIZES = {"q": 8, "d": 8, "f": 4}


@functools.cache
def slot_count(kind: str) -> int:
    """Slots of an argument of this kind: "q" whole number, "d" float, "d2" array of doubles, "f1" of singles."""
    return 1 + int(kind[1:] or 0)


def numba_arguments(names: Sequence[str], kinds: Sequence[str]) -> Iterator[str]:
    """The argument names of a function compiled by numba."""
    for name, kind in zip(names, kinds, strict=True):
        if kind in _NUMBERS:
            yield f"arg.{name}"
            continue
        yield from (f"arg.{name}.{part}" for part in range(5))
        yield from (f"arg.{name}.{part}.{i}" for part in (5, 6) for i in range(int(kind[1:])))


def entry_point(function: str, kinds: Sequence[str]) -> str:
    """LLVM text of the entry point, which returns the status that `function` returns."""
    lines = ["%status = alloca i64", "store i64 0, ptr %status"]
    passed = ["ptr %status", "ptr null"]
    slot = 0
    for i, kind in enumerate(kinds):
        x = f"%x{i}"
        if kind in _NUMBERS:
            lines += _load(x, _NUMBERS[kind], slot)
            passed.append(f"{_NUMBERS[kind]} {x}")
        else:
            dimensions = int(kind[1:])
            item = _ITEM_SIZES[kind[0]]
            lines += _load_array(x, dimensions, item, slot)
            passed.append(f"ptr null, ptr null, i64 {x}.items, i64 {item}, ptr {x}.data")
            passed += [f"i64 {x}.shape{k}" for k in range(dimensions)]
            passed += [f"i64 {x}.stride{k}" for k in range(dimensions)]
        slot += slot_count(kind)
    lines += [f'call i32 @"{function}"({", ".join(passed)})', "%result = load i64, ptr %status", "ret i64 %result"]
    return "\n".join(["define i64 @entry(ptr %slots) {", *lines, "}\n"])


def _load(name: str, kind: str, slot: int) -> list[str]:
    return [
        f"{name}.at = getelementptr i8, ptr %slots, i64 {8 * slot}",
        f"{name} = load {kind}, ptr {name}.at",
    ]


def _load_array(x: str, dimensions: int, item: int, slot: int) -> list[str]:
    """Data, shape, and from these the strides and the number of items."""
    lines = _load(f"{x}.data", "ptr", slot)
    for k in range(dimensions):
        lines += _load(f"{x}.shape{k}", "i64", slot + 1 + k)
    stride = str(item)
    for k in reversed(range(dimensions)):
        lines.append(f"{x}.stride{k} = add i64 {stride}, 0")
        lines.append(f"{x}.size{k} = mul i64 {stride}, {x}.shape{k}")
        stride = f"{x}.size{k}"
    return [*lines, f"{x}.items = sdiv i64 {stride}, {item}"]
