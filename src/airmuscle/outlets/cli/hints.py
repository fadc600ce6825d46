"""Remedies of messages as the options of a command."""

import json
from collections.abc import Mapping

from ...bench.readers.tables.missing_values import MISSING_VALUES
from ...bench.readers.tables.time_base import TIME_BASES
from ...core import Hint
from ..requests.declaration import Instruction, reworded
from .commands import RUN_CODE

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
    "grid": lambda hint: f'use --grid "{hint.value}"',
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
_CODE: Mapping[str, Instruction] = {"files.allow_code": lambda hint: "use --allow-code"}
INSTRUCTIONS: Mapping[str, Mapping[str, Instruction]] = {
    **dict.fromkeys(RUN_CODE, _CODE),
    "inspect": _FILES,
    "check": _FILES,
    "fit-regulator": _FILES,
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
    "compare": {
        **_CODE,
        "rig": lambda hint: "use --rig SCENARIO.toml",
        "spreads": lambda hint: f"use --spread '{hint.value[0]}'",
    },
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
