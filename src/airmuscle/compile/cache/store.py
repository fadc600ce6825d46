"""Machine code of kernels as files: where it is kept, and how it is known to be that of these very sources.

The folders are those of numba's own cache: the one that NUMBA_CACHE_DIR names, or else beside the sources, or else the
user's. A file begins with what it was made from and with its own checksum, so that code of other sources or versions,
or a file cut short, is made anew.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import pathlib
import sys
import threading
from collections.abc import Iterator, Sequence

_HERE = pathlib.Path(__file__).parent
_KERNELS = _HERE.parent / "kernels"
_SIZE = hashlib.sha256().digest_size


def load(name: str, kinds: Sequence[str]) -> bytes | None:
    """The machine code that is kept of a kernel for arguments of these kinds."""
    file = _file(name, kinds)
    for folder in _folders():
        try:
            content = (folder / file).read_bytes()
        except OSError:
            continue
        made_from, checksum, code = content[:_SIZE], content[_SIZE : 2 * _SIZE], content[2 * _SIZE :]
        if made_from == _origin() and checksum == hashlib.sha256(code).digest():
            return code
    return None


def save(name: str, kinds: Sequence[str], code: bytes) -> bytes:
    """Keep the machine code in the first folder that can be written to, and return it."""
    content = _origin() + hashlib.sha256(code).digest() + code
    for folder in _folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            temporary = folder / f"{_file(name, kinds)}.{os.getpid()}.{threading.get_ident()}"
            temporary.write_bytes(content)
            os.replace(temporary, folder / _file(name, kinds))
        except OSError:
            continue
        break
    return code


def _folders() -> Iterator[pathlib.Path]:
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        yield pathlib.Path(named) / "airmuscle"
        return
    yield _HERE / "__pycache__"
    of_user = {"win32": os.environ.get("LOCALAPPDATA"), "darwin": "~/Library/Caches"}
    folder = of_user.get(sys.platform) or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    yield pathlib.Path(folder).expanduser() / "airmuscle"


def _file(name: str, kinds: Sequence[str]) -> str:
    """A name of its own for each processor and each kind of arguments, so that none drives out the other."""
    import llvmlite.binding as llvm

    key = f"{','.join(kinds)} {llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"
    return f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.code"


@functools.cache
def _origin() -> bytes:
    """What machine code is made from: the sources of the kernels and of what keeps them, numba and LLVM."""
    import llvmlite

    numba = importlib.util.find_spec("numba")
    version = pathlib.Path(numba.origin).with_name("_version.py") if numba and numba.origin else None
    parts = [path.read_bytes() for folder in (_HERE, _KERNELS) for path in sorted(folder.glob("*.py"))]
    parts += [version.read_bytes() if version and version.exists() else b"", llvmlite.__version__.encode()]
    return hashlib.sha256(b"\0".join(parts)).digest()
