"""Terminal output: messages with the options for their hints, tables and JSON without control
characters, progress.
"""

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TextIO

from ...bench.readers.tables.missing_values import MISSING_VALUES
from ...bench.readers.tables.time_base import TIME_BASES
from ...core import Hint, printable
from ...report.chapter import Table
from ...report.data import as_json
from ...report.text import table_lines
from ..requests.declaration import Instruction, reworded
from .interruption import check_interrupted
from .streams import encodable

TIME_BASE_NAMES = {base: name for name, base in TIME_BASES.items()}
"""Names of the time bases of the option --time."""
MISSING_NAMES = {treatment: name for name, treatment in MISSING_VALUES.items()}
"""Names of the treatments of missing values of the option --missing."""


def _toml_table(hint: Hint) -> str:
    entries = (
        f"{json.dumps(key) if isinstance(key, str) else key} = {json.dumps(text)}"
        for key, text in hint.value.items()
    )
    return f"columns = {{ {', '.join(entries)} }}"


def _fix(hint: Hint) -> str:
    return "use " + (
        "--fix PARAMETER"
        if hint.value is ...
        else " ".join(f"--fix '{name}'" for name in hint.value)
    )


def _missing(hint: Hint) -> str:
    """The name of a treatment of missing values, with its codes."""
    codes = [f"{code:g}" if isinstance(code, float) else code for code in hint.value.codes]
    options = "".join(f" --missing-code '{code}'" for code in codes)
    return f"use --missing {MISSING_NAMES[type(hint.value)]}{options}"


_FILES: Mapping[str, Instruction] = {
    "units": lambda hint: "use " + " ".join(f"--unit '{name}=...'" for name in hint.value),
    "columns": (
        lambda hint: (
            "use " + " ".join(f'--column "{key}={text}"' for key, text in hint.value.items())
        )
    ),
    "constants": (
        lambda hint: (
            "use " + " ".join(f"--constant '{name}={value}'" for name, value in hint.value.items())
        )
    ),
    "file_name": lambda hint: f"use --file-name '{hint.value}'",
    "time": lambda hint: f"use --time {TIME_BASE_NAMES[hint.value]}",
    "decimal": lambda hint: f"use --decimal '{hint.value}'",
    "resting_length": lambda hint: 'use --resting-length "..."',
    "ambient": lambda hint: 'use --ambient "..."',
    "displacement_zero": lambda hint: f'use --displacement-zero "{hint.value}"',
    "skip_rows": lambda hint: "use --skip-rows N",
    "missing": _missing,
    "drop_outliers": lambda hint: "use --outliers drop",
}
_RECORDS: Mapping[str, Instruction] = {
    "units": lambda hint: "write it in the heading under [columns] of the record's mapping file",
    "columns": lambda hint: f"write {_toml_table(hint)} in the record's mapping file",
    "decimal": lambda hint: (
        f"write decimal = {json.dumps(hint.value)} in the record's mapping file"
    ),
    "resting_length": lambda hint: 'write resting_length = "..." under [[record]]',
    "ambient": lambda hint: 'write ambient = "..." under [[record]]',
    "displacement_zero": lambda hint: (
        f'write displacement_zero = "{hint.value}" in the mapping of the record'
    ),
    "skip_rows": lambda hint: "write skip_rows = N in the mapping of the record",
    "missing": lambda hint: (
        f'write missing = "{MISSING_NAMES[type(hint.value)]}" in the mapping of the record'
    ),
}
RUN_CODE = (
    "show",
    "evaluate",
    "fit",
    "approximate",
    "hysteresis",
    "predict",
    "plan",
    "simulate",
    "study",
    "tune",
    "benchmark",
    "export",
    "schema",
)
"""Commands with --allow-code."""
_CODE: Mapping[str, Instruction] = {"files.allow_code": lambda hint: "use --allow-code"}
INSTRUCTIONS: Mapping[str, Mapping[str, Instruction]] = {
    **dict.fromkeys(RUN_CODE, _CODE),
    "inspect": _FILES,
    "fit": {
        **_FILES,
        **_CODE,
        "fixed": _fix,
        "degree": lambda hint: f"use --degree {hint.value}",
        "censoring": lambda hint: (
            "use --uncensored" if hint.constant == "UNCENSORED" else "omit --uncensored"
        ),
        "loss": lambda hint: f"use --robust '{hint.value.scale:g} N'",
        "sigma": lambda hint: "use --equal-weights",
        **dict.fromkeys(("by", "leave_out"), lambda hint: f"use --leave-out {hint.value.quantity}"),
        "bench.fit_hysteresis": lambda hint: "run `airmuscle hysteresis`",
        "bench.estimate_length_error": lambda hint: "use --length-error SPECIMEN",
    },
    "hysteresis": {
        **_FILES,
        **_CODE,
        "all_rows": lambda hint: "use --all-rows",
        "law": lambda hint: "use --muscle NAME with --use-characteristic",
    },
    "campaign": _FILES,
    "predict": {**_FILES, **_CODE},
    "convert": _FILES,
    "plan": {"fixed": _fix, **_CODE},
    "fit-dynamic": {
        **_RECORDS,
        "free": lambda hint: f"write free = {json.dumps(list(hint.value))} under [fit]",
    },
}
"""Instructions by command and argument; a hint without an argument is found by its function."""


def in_options(text: str, command: str | None) -> str:
    """The text with hints in the words of a command; a hint for which the command has no remedy is
    omitted.
    """
    return reworded(text, INSTRUCTIONS.get(command or "", {}))


WIDE = 160
"""Width [characters] of a table that is written to a file or to another program."""


def echo(text: str = "", *, err: bool = False) -> None:
    """Print a message; every message of the command line passes through this function."""
    _print("\n".join(map(printable, text.split("\n"))), sys.stderr if err else sys.stdout)


def _print(text: str, stream: TextIO) -> None:
    """Write lines as they are; `click.echo` would write UTF-8 where ASCII is asked for."""
    stream.write(text + "\n")
    stream.flush()


warned: set[str] = set()
"""Texts of the warnings that this process has printed; the notes of a result on the same screen do
not repeat them.
"""


def on_one_screen() -> bool:
    """Whether warnings and results appear on one terminal."""
    return sys.stdout.isatty() and sys.stderr.isatty()


def print_json(content: Any) -> None:
    """Print standard JSON; numbers that are not finite are null."""
    lines = as_json(content).splitlines()
    _print("\n".join(map(_json_line, lines)), sys.stdout)


def _json_line(line: str) -> str:
    if line.isascii() and line.isprintable():
        return line
    return "".join(map(_json_character, line))


def _json_character(character: str) -> str:
    """A character of JSON, escaped where it is a control character or cannot be encoded."""
    shown = encodable(printable(character), sys.stdout)
    return character if shown == character else json.dumps(character)[1:-1]


def print_table(columns: Mapping[str, Sequence[Any]]) -> None:
    """Print a table of all its rows."""
    for line in table_lines(Table("table", "", columns, brief=sys.maxsize), terminal_width(), ""):
        echo(line)


def terminal_width() -> int:
    """The width of the terminal [characters], or of a file."""
    return (
        shutil.get_terminal_size().columns
        if sys.stdout.isatty() or "COLUMNS" in os.environ
        else WIDE
    )


def is_watched() -> bool:
    """Whether someone sees the progress of a command: whether stderr is a terminal."""
    return sys.stderr.isatty()


def _display(*columns: Any) -> Any:
    """The bars of a terminal with these columns, which disappear at the end."""
    from rich.console import Console
    from rich.progress import Progress

    return Progress(*columns, console=Console(stderr=True), transient=True)


@contextlib.contextmanager
def progress_bars(label: str = "reading") -> Iterator[Callable[[str, float], None]]:
    """Yield a callback (name, fraction done), such as `read(progress=...)` takes, which draws one
    bar per name on a terminal.
    """
    if not is_watched():
        yield lambda name, fraction: None
        return
    from rich.markup import escape
    from rich.progress import TaskID

    with _display() as display:
        tasks: dict[str, TaskID] = {}

        def show(name: str, fraction: float) -> None:
            task = tasks.get(name)
            if task is None:
                task = tasks[name] = display.add_task(
                    escape(printable(f"{label} {name}")), total=1.0
                )
            display.update(task, completed=fraction)

        yield show


@contextlib.contextmanager
def counted_progress(label: str) -> Iterator[Callable[[str, int, int], None]]:
    """Yield a callback (step, done, in total) that draws one bar on a terminal, with the number of
    its runs and the time left; it raises KeyboardInterrupt after Ctrl-C.
    """
    if not is_watched():
        yield lambda step, done, total: check_interrupted()
        return
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn

    description = TextColumn("{task.description}", markup=False)
    with _display(description, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()) as display:
        bar = display.add_task(label, total=None)

        def show(step: str, done: int, total: int) -> None:
            check_interrupted()
            display.update(bar, description=step, completed=done, total=total)

        yield show
