"""Remedies that name a Python argument, in the words of the command line."""

from __future__ import annotations

import re

_OPTIONS: tuple[tuple[str, str], ...] = (
    (r"fixed=\('([^']+)',\)", r"--fix '\1'"),
    (r"\bfixed=(?=[\s.,])", "--fix"),
    (r"give the range with censoring=", "take the rows as they stand with --uncensored"),
    (r"censoring=UNCENSORED treats", "--uncensored treats"),
    (r"give censoring=Censoring\(\) if", "leave out --uncensored if"),
    (r"sigma=1\.0 weights", "--equal-weights weights"),
    (r"units=\{'([^']+)': \.\.\.\}", r"--unit '\1=...'"),
    (r"columns=(\{[^}]*\})", r"[columns] in a --mapping file: \1"),
    (r"decimal=','", "decimal = \",\" in a --mapping file"),
    (r"leave out LevelSplit\('contraction'\) or LevelSplit\('pressure'\)", "choose --leave-out contraction or pressure"),
    (r"resample by LevelSplit\('(\w+)'\)", r"choose --leave-out \1"),
    (r"; give resting_length\.", "; give --resting-length."),
    (r"set all_rows=True", "use --all-rows"),
    (r"Give its characteristic\.", "Name the muscle with --muscle, and give --given."),
    (r"free=\('([^']+)',\)", r'free = ["\1"] under [fit]'),
)  # fmt: skip
"""What a message of the library says, and the option that does the same."""


def in_options(text: str) -> str:
    """A message of the library for someone who typed a command."""
    for said, option in _OPTIONS:
        text = re.sub(said, option, text)
    return text
