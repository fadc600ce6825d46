"""A field annotated with a type alias is checked as one annotated with what the alias stands for:
NumPy 2.5 makes aliases of `NDArray` and `ArrayLike`, Python 3.12 has `type Lengths = ...`.
"""

from __future__ import annotations

import ast
import dataclasses
import sys
import typing
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
import numpy.typing as npt
import pytest
from typing_extensions import TypeAliasType

import airmuscle
from airmuscle.core import check_field_types
from airmuscle.errors import ParameterError

T = TypeVar("T", bound=np.generic)
U = TypeVar("U")
V = TypeVar("V")
make_alias: Any = getattr(typing, "TypeAliasType", TypeAliasType)

ALIASES = {
    "alias": (make_alias("Length", float), float),
    "alias of an alias": (make_alias("Span", make_alias("Length", float)), float),
    "array alias": (
        make_alias("Vector", np.ndarray[Any, np.dtype[T]], type_params=(T,))[np.float64],
        np.ndarray[Any, np.dtype[np.float64]],
    ),
    "NumPy's array": (npt.NDArray[np.float64], np.ndarray[Any, np.dtype[np.float64]]),
    "parameters in another order": (
        make_alias("Pair", tuple[V, U], type_params=(U, V))[int, str],
        tuple[str, int],
    ),
    "alias in a union": (make_alias("Length", float) | None, float | None),
    "alias of a union": (make_alias("Length", float | str) | None, float | str | None),
    "alias in a tuple": (tuple[make_alias("Length", float), ...], tuple[float, ...]),
    "alias of a tuple": (make_alias("Lengths", tuple[float, ...]), tuple[float, ...]),
    "metadata": (Annotated[float, "metres"], float),
    "ArrayLike": (make_alias("Samples", npt.ArrayLike), npt.ArrayLike),
}
"""Annotations with an alias, and without."""
VALUES = (3, 3.5, "3", None, (3,), (3.5, 4.5), ("3", 4), [3.5], np.ones(2), {"a": 1}, object())


def refusal(annotation: Any, value: object) -> str:
    """The message that refuses a value of a field; empty where the field takes it."""
    cls = dataclasses.make_dataclass("Sample", [("field", annotation)])
    try:
        check_field_types(cls(value))
    except ParameterError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("aliased", "plain"), ALIASES.values(), ids=ALIASES)
def test_an_alias_is_checked_as_what_it_stands_for(aliased: Any, plain: Any):
    said = [refusal(aliased, value) for value in VALUES]
    assert said == [refusal(plain, value) for value in VALUES]
    assert any(said)
    assert not all(said)


def test_a_number_and_a_text_are_no_array():
    assert "must be an array of numbers" in refusal(npt.NDArray[np.float64], 3)
    assert "must be an array of numbers" in refusal(npt.ArrayLike, "text")
    assert refusal(float | npt.ArrayLike | None, [1.0, 2.0]) == ""
    assert refusal(float | npt.ArrayLike | None, None) == ""
    assert "or None" in refusal(float | npt.ArrayLike | None, "text")


@pytest.mark.skipif(sys.version_info < (3, 12), reason="the statement `type` is of Python 3.12")
def test_an_alias_that_contains_itself_is_checked_and_described():
    namespace: dict[str, Any] = {}
    exec("type Tree = float | tuple[Tree, ...]", namespace)
    assert refusal(namespace["Tree"], (1.0, (2.0, (3.0,)))) == ""
    assert "must be a number or a tuple" in refusal(namespace["Tree"], (1.0, ("text",)))


def test_annotations_are_read_in_one_place():
    """Elsewhere, an alias would be overlooked; the parser of commands reads their signatures, in
    which requests are expanded to options.
    """
    root = Path(airmuscle.__file__).parent
    reading = {"get_origin", "get_args", "get_type_hints"}
    readers = set()
    for path in root.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        names = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        names |= {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        if names & reading:
            readers.add(path.relative_to(root).as_posix())
    assert readers == {
        "core/annotation_parts.py",
        "outlets/cli/requested.py",
        "outlets/cli/parser.py",
    }
