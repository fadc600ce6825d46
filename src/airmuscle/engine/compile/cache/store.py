"""Kernel cache: machine code as files in the private cache folder of the user, verified before it is used.

Without such a folder, kernels are compiled anew in every process. A file begins with a hash of what it was compiled
from and a hash of its contents, so that code of other sources or versions, or a damaged file, is compiled anew.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import os
import pathlib
from collections.abc import Sequence

from ....core.atomic_output import atomic_file
from ....core.cache_folder import cache_folder, read_private, warn_not_stored

_PACKAGE = pathlib.Path(__file__).parents[1]
_SOURCES = [path for room in ("kernels", "cache", "llvm") for path in sorted((_PACKAGE / room).glob("*.py"))]
MAX_FILES = 4000
"""Number of stored codes, each of 10 to 500 kB and most of 15 kB (chosen); then a tenth of them goes, those that were
not used for the longest time. Fewer than a program uses in turn would be stored in vain: each would go before it is
used again."""
_HASH = hashlib.sha256().digest_size


def load(name: str, kinds: Sequence[str]) -> bytes | None:
    """The stored machine code of a kernel for arguments of these kinds; None where there is none that is valid."""
    folder = cache_folder()
    if folder is None:
        return None
    path = folder / _file_name(name, kinds)
    content = read_private(path)
    if content is None:
        return None
    with contextlib.suppress(OSError):  # the time of its last use, for `_remove_oldest`
        os.utime(path)
    origin, checksum, code = content[:_HASH], content[_HASH : 2 * _HASH], content[2 * _HASH :]
    return code if origin == _origin() and checksum == hashlib.sha256(code).digest() else None


def save(name: str, kinds: Sequence[str], code: bytes) -> bytes:
    """Store the machine code, if there is a folder for it, and return it."""
    folder = cache_folder()
    if folder is None:
        return code
    try:
        with atomic_file(folder / _file_name(name, kinds)) as unfinished:
            unfinished.write_bytes(_origin() + hashlib.sha256(code).digest() + code)
        _remove_oldest(folder)
    except OSError as error:
        warn_not_stored(f"{folder} cannot be written to ({error.strerror or error})")
    return code


def _remove_oldest(folder: pathlib.Path) -> None:
    """Where there are more than MAX_FILES, remove the codes that were not used for the longest time."""
    with contextlib.suppress(OSError):  # another process removes the same
        if len(os.listdir(folder)) <= MAX_FILES:
            return
        files = sorted(folder.glob("*.code"), key=lambda path: path.stat().st_mtime)
        for path in files[: -(MAX_FILES - MAX_FILES // 10)]:
            path.unlink()


@functools.cache
def _processor() -> str:
    import llvmlite.binding as llvm

    return f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"


def _file_name(name: str, kinds: Sequence[str]) -> str:
    """A name for each processor, kind of arguments and version of the program, so that none replaces the other."""
    key = f"{','.join(kinds)} {_processor()} {_origin().hex()}"
    return f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.code"


@functools.cache
def _origin() -> bytes:
    """Hash of the sources of kernels and cache, and of the versions of numba and LLVM."""
    import llvmlite

    numba = importlib.util.find_spec("numba")
    version = pathlib.Path(numba.origin).with_name("_version.py") if numba and numba.origin else None
    parts = [path.read_bytes() for path in _SOURCES]
    parts += [version.read_bytes() if version and version.exists() else b"", llvmlite.__version__.encode()]
    return hashlib.sha256(b"\0".join(parts)).digest()
