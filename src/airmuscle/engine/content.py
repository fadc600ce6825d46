"""Digests of what determines the result of a task: functions, models, arrays and plain data."""

import dataclasses
import functools
import hashlib
import inspect
import pickle
import sys
from pathlib import Path
from types import FunctionType, MappingProxyType
from typing import Any

import numpy as np

from ..core import InputError
from ..core.annotation import is_model
from ..core.tree import NUMERICAL_PACKAGES, PACKAGE_ROOT

PROGRAM = PACKAGE_ROOT.name
_KNOWN = frozenset({PROGRAM, *NUMERICAL_PACKAGES, *sys.stdlib_module_names})
"""Packages whose versions are in the fingerprint of the program, or that belong to Python."""


def content_digest(*contents: Any) -> str:
    """A SHA-256 digest (64 hexadecimal digits); any change of a value changes it.

    It does not depend on the process, nor on what models have derived from their fields. A function
    or class counts by its name, and by the text of its module where that is not of this program.
    Raises InputError for what cannot be named or read: a function within another, an open file.
    """
    digest = hashlib.sha256()
    try:
        _ContentPickler(_Digester(digest)).dump(contents)
    except (pickle.PicklingError, TypeError, AttributeError, ValueError, RecursionError) as error:
        raise InputError(f"what determines the result cannot be read: {error}") from None
    return digest.hexdigest()


class _Digester:
    """A file that passes on what is written."""

    def __init__(self, digest: Any) -> None:
        self._digest = digest

    def write(self, content: Any) -> int:
        """Add bytes to the digest."""
        self._digest.update(content)
        return memoryview(content).nbytes


class _ContentPickler(pickle.Pickler):
    """A pickler whose output depends on values alone: not on identities, orders of sets, layouts of
    arrays, nor on values that a model derives.
    """

    def __init__(self, file: Any) -> None:
        super().__init__(file, protocol=5)
        # Without a memo an object that occurs twice is written like two equal ones.
        self.fast = True

    def persistent_id(self, obj: Any) -> Any:
        """What stands for a function, a class or a set; None for anything else."""
        if isinstance(obj, type | FunctionType):
            return _named(obj)
        if isinstance(obj, set | frozenset):
            return "set", sorted(content_digest(item) for item in obj)
        return None

    def reducer_override(self, obj: Any) -> Any:
        """Models by their fields, arrays by their values, objects without what properties keep."""
        if is_model(obj):
            # A field that is no argument follows from the others.
            names = [field.name for field in dataclasses.fields(obj) if field.init]
            return _record, (type(obj), tuple(getattr(obj, name) for name in names))
        kind: type = type(obj)
        if _is_plain(kind):
            state = {name: value for name, value in vars(obj).items() if not _is_cache(obj, name)}
            return _record, (type(obj), tuple(state.items()))
        if type(obj) is np.ndarray and not obj.dtype.hasobject:
            return np.ndarray, (obj.shape, obj.dtype.str, np.ascontiguousarray(obj).tobytes())
        if isinstance(obj, MappingProxyType):
            return dict, (dict(obj),)
        return NotImplemented


def _record(kind: type, values: tuple[Any, ...]) -> None:
    """The name of a model in a digest; it is never called."""


@functools.cache
def _is_plain(kind: type) -> bool:
    """Whether objects of a class are pickled by their attributes, and properties keep values in
    them."""
    has_caches = any(
        isinstance(value, functools.cached_property)
        for base in kind.__mro__
        for value in vars(base).values()
    )
    reduction = ("__reduce__", "__reduce_ex__", "__getstate__")
    return has_caches and all(getattr(kind, name) is getattr(object, name) for name in reduction)


def _is_cache(obj: Any, name: str) -> bool:
    """Whether an attribute is a value that a property keeps."""
    return isinstance(getattr(type(obj), name, None), functools.cached_property)


def _named(obj: Any) -> tuple[str, str, str]:
    if "<" in obj.__qualname__:
        raise TypeError(f"{obj.__qualname__} is defined within a function")
    return obj.__module__, obj.__qualname__, module_digest(obj.__module__)


@functools.cache
def module_digest(name: str) -> str:
    """The digest of the text of a module that is not of this program; empty for all others."""
    if name.partition(".")[0] in _KNOWN and name != "__main__":
        return ""
    module = sys.modules.get(name)
    try:
        source = inspect.getsourcefile(module) if module is not None else None
        text = Path(source).read_bytes() if source is not None else b""
    except (OSError, TypeError):
        text = b""
    return hashlib.sha256(text).hexdigest()


def function_name(function: Any) -> str:
    """Module and name of a function."""
    return f"{function.__module__}:{function.__qualname__}"
