"""Hints of messages: a remedy as an argument of a Python function, which a command line writes as its option."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any


@dataclasses.dataclass(frozen=True)
class Hint:
    """A remedy: the argument of a public function that serves a purpose.

    purpose   what the argument is for, as the beginning of a sentence: "To fix one parameter"
    argument  name of the argument; empty if the remedy is the function itself
    value     its value; `...` if the user chooses it
    function  the public function that takes the argument, if it is not the one that was called
    constant  name of the value, if it is a named constant

    `str(hint)` is a sentence in the words of Python: "To fix one parameter, use fixed=('radius',)."
    """

    purpose: str
    argument: str = ""
    value: Any = ...
    function: str = ""
    constant: str = ""

    def __str__(self) -> str:
        if not self.argument:
            return f"{self.purpose}, use {self.function}."
        owner = f" of {self.function}" if self.function else ""
        return f"{self.purpose}, use {self.argument}={self.constant or _notation(self.value)}{owner}."


class HintedText(str):
    """Text with hints, a string in the words of Python; `written` gives it in the words of another interface.

    parts  texts, and hints as whole sentences; a hint is separated from the text before it by a space
    """

    parts: tuple[str | Hint, ...]

    def __new__(cls, *parts: str | Hint) -> HintedText:
        """The text of its parts; parts that are hinted texts are merged."""
        merged: list[str | Hint] = []
        for part in parts:
            merged += part.parts if isinstance(part, HintedText) else [part]
        text = super().__new__(cls, _joined(merged, str))
        text.parts = tuple(merged)
        return text

    def __reduce__(self) -> tuple[type[HintedText], tuple[str | Hint, ...]]:
        return HintedText, self.parts

    @property
    def hints(self) -> tuple[Hint, ...]:
        """The hints, in their order."""
        return tuple(part for part in self.parts if isinstance(part, Hint))

    def written(self, write: Callable[[Hint], str]) -> str:
        """The text with each hint as the sentence that `write` returns; a hint without a sentence is omitted."""
        return _joined(self.parts, write)

    def changed(self, change: Callable[[str], str]) -> HintedText:
        """The text with `change` applied to all parts that are not hints."""
        return HintedText(*(part if isinstance(part, Hint) else change(part) for part in self.parts))


def _joined(parts: list[str | Hint] | tuple[str | Hint, ...], write: Callable[[Hint], str]) -> str:
    text = ""
    for part in parts:
        if not isinstance(part, Hint):
            text += part
        elif sentence := write(part):
            text += f" {sentence}" if text else sentence
    return text


def _notation(value: Any) -> str:
    """A value as a Python expression; fields of a dataclass that have their default are omitted."""
    if value is ...:
        return "..."
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {_notation(item)}" for key, item in value.items()) + "}"
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [(field, getattr(value, field.name)) for field in dataclasses.fields(value)]
        given = [_notation(item) if field.default is dataclasses.MISSING else f"{field.name}={_notation(item)}"
                 for field, item in fields if item != field.default]  # fmt: skip
        return f"{type(value).__name__}({', '.join(given)})"
    return repr(value)
