"""The entry of a compiled kernel, as LLVM text: one pointer comes in, and the kernel's many arguments come out.

The pointer is that of a row of slots of eight bytes: the addresses of the two dtypes that an array may have, then the
kernel's arguments, numbers as they are and arrays as the addresses of their Python objects. numba's functions take an
array apart into what holds it alive, its number of items, their size, its data, its shape and its strides.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from . import numpy_layout

REFUSED = -(1 << 62)
"""What the entry returns where an array is not of the kind that the kernel was compiled for."""
DTYPES = "qd"
"""The letters of the dtypes, whole numbers and floats of eight bytes, in the order of their slots."""
_NUMBERS = {"q": "i64", "d": "double"}


def parts(names: Sequence[str], kinds: Sequence[str]) -> Iterator[str]:
    """The arguments of a function of numba's, by the names that it gives them."""
    for name, kind in zip(names, kinds, strict=True):
        if kind in _NUMBERS:
            yield f"arg.{name}"
            continue
        yield from (f"arg.{name}.{part}" for part in range(5))
        yield from (f"arg.{name}.{part}.{i}" for part in (5, 6) for i in range(int(kind[1:])))


def entry(function: str, kinds: Sequence[str]) -> str:
    """`i64 entry(ptr slots)`: the status that `function` returns, or REFUSED."""
    looks, reads, passed, fit = [], [], ["ptr %status", "ptr null"], "true"
    for slot, kind in enumerate(kinds, len(DTYPES)):
        if kind in _NUMBERS:
            reads += _loaded(f"%x{slot}", _NUMBERS[kind], "%slots", 8 * slot)
            passed.append(f"{_NUMBERS[kind]} %x{slot}")
            continue
        looks += [*_looked_at(slot, kind), f"%fit{slot} = and i1 {fit}, %x{slot}.is"]
        reads += _taken_apart(f"%x{slot}", int(kind[1:]))
        passed += [f"ptr null, ptr null, i64 %x{slot}.items, i64 8, ptr %x{slot}.data"]
        passed += [f"i64 %x{slot}.{part}{i}" for part in ("shape", "strides") for i in range(int(kind[1:]))]
        fit = f"%fit{slot}"
    lines = [
        *("%status = alloca i64", *looks, f"br i1 {fit}, label %fits, label %refused"),
        *("fits:", *reads, f'call i32 @"{function}"({", ".join(passed)})'),
        *("%found = load i64, ptr %status", "ret i64 %found", "refused:", f"ret i64 {REFUSED}"),
    ]
    return "\n".join(["define i64 @entry(ptr %slots) {", *lines, "}\n"])


def _loaded(name: str, kind: str, base: str, offset: int) -> list[str]:
    return [f"{name}.at = getelementptr i8, ptr {base}, i64 {offset}", f"{name} = load {kind}, ptr {name}.at"]


def _looked_at(slot: int, kind: str) -> list[str]:
    """Whether an array has the dtype and the dimensions, and lies as one block that may be written to."""
    x = f"%x{slot}"
    return [
        *_loaded(x, "ptr", "%slots", 8 * slot),
        *_loaded(f"{x}.dtype", "i64", x, numpy_layout.DTYPE),
        *_loaded(f"{x}.asked", "i64", "%slots", 8 * DTYPES.index(kind[0])),
        f"{x}.same = icmp eq i64 {x}.dtype, {x}.asked",
        *_loaded(f"{x}.flags", "i32", x, numpy_layout.FLAGS),
        f"{x}.bits = and i32 {x}.flags, {numpy_layout.PLAIN}",
        f"{x}.plain = icmp eq i32 {x}.bits, {numpy_layout.PLAIN}",
        *_loaded(f"{x}.dimensions", "i32", x, numpy_layout.DIMENSIONS),
        f"{x}.full = icmp eq i32 {x}.dimensions, {kind[1:]}",
        f"{x}.both = and i1 {x}.same, {x}.plain",
        f"{x}.is = and i1 {x}.both, {x}.full",
    ]


def _taken_apart(x: str, dimensions: int) -> list[str]:
    lines, items = _loaded(f"{x}.data", "ptr", x, numpy_layout.DATA), "1"
    for part, offset in (("shape", numpy_layout.SHAPE), ("strides", numpy_layout.STRIDES)):
        lines += _loaded(f"{x}.{part}", "ptr", x, offset)
        for i in range(dimensions):
            lines += _loaded(f"{x}.{part}{i}", "i64", f"{x}.{part}", 8 * i)
    for i in range(dimensions):
        lines.append(f"{x}.items{i} = mul i64 {items}, {x}.shape{i}")
        items = f"{x}.items{i}"
    return [*lines, f"{x}.items = mul i64 {items}, 1"]
