"""Kernel cache: machine code as files in the private cache folder of the user, verified before it
is used.

Without such a folder, kernels are compiled anew in every process. A file begins with a hash of what
it was compiled from and a hash of its name and contents, so that code of other sources or versions,
of another kernel, or a damaged file, is compiled anew.
"""

import contextlib
import functools
import hashlib
import importlib.util
import os
import pathlib
import stat
import warnings
from collections.abc import Sequence
from typing import Any

from ....core import AirmuscleWarning, atomic_file, user_folder
from ....core.private_files import read_private
from ..llvm.jit import engine_of, object_code
from ..llvm.processor import processor

_POSIX = hasattr(os, "getuid")
_PACKAGE = pathlib.Path(__file__).parents[1]
_SOURCES = [
    path for room in ("kernels", "cache", "llvm") for path in sorted((_PACKAGE / room).glob("*.py"))
]
MAX_FILES = 4000
"""Number of stored codes, each of 10 to 500 kB and most of 15 kB (chosen); then a tenth of them
goes, those that were not used for the longest time. Fewer than a program uses in turn would be
stored in vain: each would go before it is used again."""
_HASH = hashlib.sha256().digest_size


def cache_folder() -> pathlib.Path | None:
    """The private cache folder, created if it is missing; None, with one warning, if there is none.

    It is `AIRMUSCLE_CACHE_DIR`, or else `airmuscle/kernels` in the user's cache folder. It must
    belong to the user, and nobody else may write to it, because what is in it is executed;
    otherwise it is not used.
    """
    try:
        named = os.environ.get("AIRMUSCLE_CACHE_DIR")
        folder = pathlib.Path(named) if named else user_folder("cache") / "kernels"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        state = folder.stat()
    except (OSError, RuntimeError) as error:  # RuntimeError: the user has no home folder
        warn_not_stored(f"there is no cache folder ({error})")
        return None
    if _POSIX and (state.st_uid != os.getuid() or state.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        warn_not_stored(f"other users may write to {folder}")
        return None
    return folder


@functools.cache
def warn_not_stored(reason: str) -> None:
    """Warn that compiled kernels are not stored."""
    warnings.warn(
        f"compiled kernels are not stored: {reason}. Every process compiles them anew, which takes"
        " some seconds. Name a private folder in the environment variable AIRMUSCLE_CACHE_DIR.",
        AirmuscleWarning,
        stacklevel=2,
    )


def load(name: str, kinds: Sequence[str]) -> bytes | None:
    """The stored machine code of a kernel for arguments of these kinds; None where there is none
    that is valid.
    """
    folder = cache_folder()
    if folder is None:
        return None
    path = folder / _file_name(name, kinds)
    content = read_private(path).content
    if content is None:
        return None
    with contextlib.suppress(OSError):  # the time of its last use, for `_remove_oldest`
        os.utime(path)
    origin = content[:_HASH]
    checksum = content[_HASH : 2 * _HASH]
    code = content[2 * _HASH :]
    return code if origin == _origin() and checksum == _checksum(path.name, code) else None


def save(name: str, kinds: Sequence[str], code: bytes) -> bytes:
    """Store the machine code, if there is a folder for it, and return it."""
    folder = cache_folder()
    if folder is None:
        return code
    try:
        with atomic_file(folder / _file_name(name, kinds)) as unfinished:
            unfinished.write_bytes(_origin() + _checksum(_file_name(name, kinds), code) + code)
        _remove_oldest(folder)
    except OSError as error:
        warn_not_stored(f"{folder} cannot be written to ({error.strerror or error})")
    return code


def _checksum(name: str, code: bytes) -> bytes:
    """Hash of a code and of the name of its file, because the code of another kernel would read
    other arguments.
    """
    return hashlib.sha256(name.encode() + b"\0" + code).digest()


def _remove_oldest(folder: pathlib.Path) -> None:
    """Where there are more than MAX_FILES, remove the codes that were not used for the longest
    time.
    """
    with contextlib.suppress(OSError):  # another process removes the same
        if len(os.listdir(folder)) <= MAX_FILES:
            return
        files = sorted(folder.glob("*.code"), key=lambda path: path.stat().st_mtime)
        for path in files[: -(MAX_FILES - MAX_FILES // 10)]:
            path.unlink()


def _file_name(name: str, kinds: Sequence[str]) -> str:
    """A name for each processor, kind of arguments and version of the program, so that none
    replaces the other.
    """
    made_for = processor()
    key = f"{','.join(kinds)} {made_for.name} {made_for.features} {_origin().hex()}"
    return f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.code"


@functools.cache
def _origin() -> bytes:
    """Hash of the sources of kernels and cache, and of the versions of numba and LLVM."""
    import llvmlite

    numba = importlib.util.find_spec("numba")
    version = (
        pathlib.Path(numba.origin).with_name("_version.py") if numba and numba.origin else None
    )
    parts = [path.read_bytes() for path in _SOURCES]
    parts += [
        version.read_bytes() if version and version.exists() else b"",
        llvmlite.__version__.encode(),
    ]
    return hashlib.sha256(b"\0".join(parts)).digest()


def load_module(text: str) -> Any:
    """An engine with the machine code of LLVM text; it must stay alive as long as its addresses are
    used.

    Code generation takes two thirds of the time in which a system is compiled. The name of a stored
    module is the hash of its text, so that a system of the same structure finds it.
    """
    name = "module-" + hashlib.sha256(text.encode()).hexdigest()[:40]
    code = load(name, ())
    if code is None:
        code = save(name, (), object_code(text))
    return engine_of(code)
