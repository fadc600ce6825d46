"""Values in the names of files: a pattern such as `cut{specimen}_held{length [cm]}cm` states them."""

from __future__ import annotations

import re
from pathlib import Path

from ...core.errors import ColumnError
from ...recording.heading import parse_heading
from .constants import CONSTANT_UNITS, parse_constant_name

TEXT_NAMES = ("specimen", "run")
"""Values that are texts."""
_PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
_NUMBER = r"([-+]?\d+(?:[.,]\d+)?)"


class FileNamePattern:
    """A pattern for the names of files without extension; the text around a value may be any part of the name.

    `{length [cm]}`, `{pressure [bar]}` or `{resting_length [mm]}` is a number in this unit, `{specimen}` and `{run}`
    are texts, `{}` is any text that is not used. Raises ColumnError for other placeholders.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        parts = _PLACEHOLDER.split(text)
        self._names = tuple(name.strip() for name in parts[1::2])
        expressions = [re.escape(parts[0])]
        for name, literal in zip(self._names, parts[2::2], strict=True):
            expressions += [self._expression(name), re.escape(literal)]
        named = [name for name in self._names if name]
        if not named or len(set(named)) < len(named):
            raise ColumnError(
                f"file name pattern '{text}': it must contain each value once, such as 'held{{length [cm]}}cm'."
            )
        self._expression_of_name = re.compile("".join(expressions))

    def _expression(self, name: str) -> str:
        if not name:
            return "(.*?)"
        if name in TEXT_NAMES:
            return "([^_ ]+?)" if not self.text.endswith(f"{{{name}}}") else "([^_ ]+)"
        heading, constant = parse_heading(name), parse_constant_name(name)
        unit = constant[1] if constant else heading.unit
        if not (constant or heading.known) or not (unit or heading.target == "1"):
            raise ColumnError(
                f"file name pattern '{self.text}': '{{{name}}}' is not a quantity with its unit. Write "
                f"'{{length [cm]}}', {', '.join(f'{{{each} [{u}]}}' for each, u in CONSTANT_UNITS.items())}, "
                "{specimen}, {run}, or {} for any text."
            )
        return _NUMBER

    def values(self, path: Path) -> dict[str, float | str]:
        """The values in the name of a file, by placeholder. Raises ColumnError where the name does not match."""
        match = self._expression_of_name.search(path.stem)
        if match is None:
            raise ColumnError(
                f"{path.name}: the name does not match the pattern '{self.text}'. Correct the pattern, or give the "
                "values of this file as constants."
            )
        for group, (name, text) in enumerate(zip(self._names, match.groups(), strict=True), 1):
            start = match.start(group)
            if name and name not in TEXT_NAMES and text[0] == "-" and path.stem[start - 1 : start].isalnum():
                raise ColumnError(
                    f"{path.name}: the hyphen of '{path.stem[start - 1]}{text}' may be a minus sign or a separator. "
                    f"A separator belongs into the pattern: '-{{{name}}}'. Give a negative value as a constant."
                )
        pairs = zip(self._names, match.groups(), strict=True)
        return {name: text if name in TEXT_NAMES else float(text.replace(",", ".")) for name, text in pairs if name}
