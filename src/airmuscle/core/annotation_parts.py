"""Parts of an annotation: alternatives, class and arguments, behind type aliases.

Every reader of annotations takes them from here: NumPy's `ArrayLike` is a union up to NumPy 2.4
and an alias from 2.5 on, `NDArray[float64]` a class or an alias with arguments, and a user's
field may be annotated with an alias of Python 3.12 (`type Lengths = tuple[float, ...]`).
"""

import functools
import inspect
import sys
import types
import typing
from collections.abc import Iterator, Mapping
from typing import Any

import numpy.typing as npt


class AnyArray:
    """NumPy's `ArrayLike` among the alternatives of an annotation."""


_PROGRAM = __name__.partition(".")[0]
_UNIONS = (typing.Union, types.UnionType)
_ARRAY_LIKE = frozenset(typing.get_args(npt.ArrayLike))
"""Members of `ArrayLike` where it is a union; empty where it is an alias."""


def type_hints(cls: Any) -> Mapping[str, Any]:
    """The annotations of a class or function as types; empty if they contain names imported for
    type checking only.

    Those of a class of this package are evaluated one by one when they are asked for, so that the
    classes in a quoted annotation are imported for the fields that are in use.
    """
    if isinstance(cls, type) and cls.__module__.startswith(f"{_PROGRAM}."):
        return _deferred(cls)
    try:
        return _resolved(cls)
    except NameError:
        return {}


@functools.cache
def _resolved(cls: Any) -> dict[str, Any]:
    return {name: unaliased(hint) for name, hint in typing.get_type_hints(cls).items()}


class DeferredHints(Mapping[str, Any]):
    """The annotations of a class, each of which is evaluated when it is asked for."""

    def __init__(self, cls: type[Any]) -> None:
        self._written = {
            name: (vars(sys.modules[base.__module__]), hint)
            for base in reversed(cls.__mro__)
            for name, hint in inspect.get_annotations(base).items()
        }
        self._evaluated: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._evaluated:
            namespace, hint = self._written[name]
            value = eval(hint, namespace) if isinstance(hint, str) else hint
            self._evaluated[name] = unaliased(type(None) if value is None else value)
        return self._evaluated[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._written)

    def __len__(self) -> int:
        return len(self._written)


_deferred = functools.cache(DeferredHints)


def unaliased(hint: Any) -> Any:
    """What an annotation stands for: of a type alias its value, with arguments in their places."""
    while (alias := typing.get_origin(hint) or hint) is not None:
        if hint is npt.ArrayLike:
            return AnyArray
        if alias is typing.Annotated:
            hint = typing.get_args(hint)[0]
        elif type(alias).__name__ == "TypeAliasType":  # of typing, or of typing_extensions
            hint = _value(alias, typing.get_args(hint))
        else:
            break
    return hint


def _value(alias: Any, arguments: tuple[Any, ...]) -> Any:
    """The value of an alias, its type parameters replaced by arguments."""
    value = alias.__value__
    places = getattr(value, "__parameters__", ())
    by_parameter = dict(zip(alias.__type_params__, arguments, strict=False))
    if not places or not all(place in by_parameter for place in places):
        return value
    return value[tuple(by_parameter[place] for place in places)]


def alternatives(hint: Any) -> tuple[Any, ...]:
    """The alternatives of a union, also of unions behind aliases; the annotation alone if it is no
    union. `ArrayLike` is one of them, `AnyArray`, and then the first.
    """
    try:
        return _alternatives(hint)
    except TypeError:  # arguments that have no hash, such as a list
        return _alternatives.__wrapped__(hint)


@functools.cache
def _alternatives(hint: Any) -> tuple[Any, ...]:
    hint = unaliased(hint)
    if typing.get_origin(hint) not in _UNIONS:
        return (hint,)
    members: list[Any] = []
    for member in typing.get_args(hint):
        members += alternatives(member)
    if _ARRAY_LIKE and set(members) >= _ARRAY_LIKE:
        members = [AnyArray, *(member for member in members if member not in _ARRAY_LIKE)]
    if AnyArray in members:
        members = [AnyArray, *(member for member in members if member is not AnyArray)]
    return tuple(dict.fromkeys(members))


def origin(hint: Any) -> Any:
    """The class of an annotation without its arguments: `tuple` of `tuple[float, ...]`."""
    hint = unaliased(hint)
    return typing.get_origin(hint) or hint


def arguments_of(hint: Any) -> tuple[Any, ...]:
    """The arguments of an annotation: `(float, ...)` of `tuple[float, ...]`; none of a union."""
    hint = unaliased(hint)
    return () if typing.get_origin(hint) in _UNIONS else typing.get_args(hint)


def item_type(hint: Any) -> Any:
    """The type of the items of a tuple, which may be an alternative of a union; None if there is no
    tuple.
    """
    tuples = (option for option in alternatives(hint) if origin(option) is tuple)
    return next((arguments_of(option)[0] for option in tuples), None)


def depth(hint: Any) -> int:
    """The depth of tuples: 0 of a number, 1 of `tuple[float, ...]`, 2 of tuples of tuples."""
    item = item_type(hint)
    return 0 if item is None else 1 + depth(item)
