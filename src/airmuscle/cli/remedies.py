"""Remedies of the library's messages, with Python arguments replaced by command-line options."""

from __future__ import annotations

import re

_LEVELS = r"Level(?:s|Split)\(['\"](\w+)['\"]\)"
_OPTIONS: tuple[tuple[str, str], ...] = (
    (r"fixed=\('([^']+)',\)", r"--fix '\1'"),
    (r"\bfixed=(?![\w('\"])", "--fix"),
    (r"\bgive (?:the range with )?censoring=(?=[\s.;,])", "treat the rows as measured values with --uncensored"),
    (r"\bcensoring=UNCENSORED\b", "--uncensored"),
    (r"\b(?:give|set|use) censoring=Censoring\(\)", "omit --uncensored"),
    (r"\bsigma=1(?:\.0)?\b", "--equal-weights"),
    (r"units=\{'([^']+)': \.\.\.\}", r"--unit '\1=...'"),
    (r"constants=\{'length': '([^']+)'\}", r"--constant 'length=\1'"),
    (r"file_name='([^']+)'", r"--file-name '\1'"),
    (r"time_base=UniformTime\(\)", "--time uniform"),
    (r"time_base=NoTime\(\)", "--time none"),
    (r"\bordered=False\b", "--time unordered"),
    (r"columns=\{'([^']+)': '([^']+)'\}", r"--column '\1=\2'"),
    (r"columns=(\{[^}]*\})", r"[columns] in a --mapping file: \1"),
    (r"decimal=','", "decimal = \",\" in a --mapping file"),
    (rf"\b(?:leave out|use|give) {_LEVELS} or {_LEVELS}", r"use --leave-out \1 or --leave-out \2"),
    (rf"\b(?:draw by|resample by|use|give) {_LEVELS}", r"use --leave-out \1"),
    (r"\b(give|set|state) resting_length\b(?!=)", r"\1 --resting-length"),
    (r"\blet all rows count\b|\b(?:give|set|use) all_rows=True", "use --all-rows"),
    (r"\bGive its characteristic\.", "Give the muscle with --muscle, and --use-characteristic."),
    (r"\buse identify\.hysteresis\.fit_hysteresis\b", "run `airmuscle hysteresis`"),
    (r"free=\('([^']+)',\)", r'free = ["\1"] under [fit]'),
)  # fmt: skip
"""Pattern of a Python argument in a message, and the option or key that replaces it."""


def in_options(text: str) -> str:
    """A message of the library in which remedies name command-line options."""
    for pattern, option in _OPTIONS:
        text = re.sub(pattern, option, text)
    return text
