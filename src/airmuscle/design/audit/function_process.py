"""Function of a user, evaluated in a process of its own with a time limit."""

import dataclasses
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ...core import Array, HintedText, UnknownNameError, one_line
from ...core.errors import AirmuscleError, Hint
from ...files.library import is_code_allowed

PROGRAM = Path(__file__).with_name("evaluate_function.py")
TIME_LIMIT = 60.0
"""Time that all points of one call may take [s] (chosen)."""


class FunctionError(AirmuscleError):
    """A function that cannot be audited: it is missing, hangs, or raises at every point."""


@dataclasses.dataclass
class FunctionProcess:
    """A function `module:name` of two numbers, evaluated at arrays of points.

    time_limit  of the points of one call [s]
    evaluations, errors  number of points so far, and the errors of the function with their points
    """

    name: str
    time_limit: float = TIME_LIMIT
    evaluations: int = 0
    errors: list[tuple[tuple[float, ...], str]] = dataclasses.field(default_factory=list)

    def __post_init__(self) -> None:
        module, _, function = self.name.partition(":")
        if not module or not function:
            raise UnknownNameError(
                f"'{one_line(self.name)}' is no function; name it as module:function, such as"
                " mymodel:force."
            )
        if not is_code_allowed():
            raise UnknownNameError(
                HintedText(
                    f"'{one_line(self.name)}' is code of a user, which an audit runs.",
                    Hint("To run it because you trust it", function="files.allow_code"),
                )
            )

    def __call__(self, first: Any, second: Any) -> Array:
        """Values at points, broadcast; not a number where the function raises. Raises FunctionError
        for a function that is missing, hangs, or raises at every point.
        """
        points = np.broadcast_arrays(np.asarray(first, float), np.asarray(second, float))
        shape = points[0].shape
        rows = [(float(a), float(b)) for a, b in zip(*map(np.ravel, points), strict=True)]
        answers = self._answers(rows)
        self.evaluations += len(rows)
        values = []
        for row, answer in zip(rows, answers, strict=True):
            if "error" in answer:
                self.errors.append((row, answer["error"]))
            values.append(answer.get("value", math.nan))
        if answers and all("error" in answer for answer in answers):
            raise FunctionError(
                f"{self.name} raises at each of {len(rows)} points, at {rows[0]}:"
                f" {one_line(answers[0]['error'])}. It must take a gauge pressure [Pa] and a"
                " contraction [1], or for --kind orifice two absolute pressures [Pa], and return a"
                " number."
            )
        return np.array(values).reshape(shape)

    def _answers(self, rows: list[tuple[float, float]]) -> list[dict[str, Any]]:
        module, _, function = self.name.partition(":")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "request.json"
            request = {"module": module, "function": function, "points": rows}
            file.write_text(json.dumps(request), encoding="utf-8")
            try:
                done = subprocess.run(
                    [sys.executable, str(PROGRAM), str(file)],
                    capture_output=True,
                    text=True,
                    timeout=self.time_limit,
                    check=False,
                )
            except subprocess.TimeoutExpired as error:
                output = error.stdout or b""
                text = output.decode() if isinstance(output, bytes) else output
                number = text.count("\n")
                raise FunctionError(
                    f"{self.name} did not answer within {self.time_limit:g} s; it stopped at point"
                    f" {number + 1} of {len(rows)}, {rows[min(number, len(rows) - 1)]}."
                ) from None
        answers = [json.loads(line) for line in done.stdout.splitlines() if line]
        if answers and "missing" in answers[0]:
            raise FunctionError(
                f"{self.name} cannot be imported: {one_line(answers[0]['missing'])}. The module"
                " must be installed, or in the current folder."
            )
        if len(answers) != len(rows):
            place = rows[len(answers)] if len(answers) < len(rows) else rows[-1]
            raise FunctionError(
                f"{self.name} ended its process (code {done.returncode}) at the point {place}."
            )
        return answers
