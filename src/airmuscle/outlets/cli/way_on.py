"""The way on after an inspection: what can be done with the files now, what is missing for it, and
the mapping for what was not understood."""

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from ...bench.diagnosis import support_of
from ...bench.readers import ColumnMapping, Failure, Proposal, merged, propose
from ...core import AirmuscleError, listed
from ...recording import Recording
from ...recording.columns import MOVED
from ...report.chapter import Chapter, Table

MAPPING_FILE = "rig.toml"
"""Name under which a proposed mapping is saved in the lines that are printed."""


class Use(NamedTuple):
    """What files can be used for: a command, and the quantities that it needs as alternatives."""

    command: str
    purpose: str
    needed: tuple[tuple[str, ...], ...]


USES = (
    Use(
        "fit {files} --compare",
        "static law",
        (("pressure",), ("contraction",), ("force",)),
    ),
    Use("hysteresis {files}", "friction", (("time",), ("pressure",), MOVED, ("force",))),
    Use(
        'fit-regulator {files} --supply "6 bar"',
        "pressure regulator",
        (("time",), ("setpoint",), ("pressure",)),
    ),
    Use("fit-joint {files}", "joint", (("angle",), ("pressure", "setpoint"))),
    Use("campaign {files}", "one muscle from all files", (("pressure",), MOVED, ("force",))),
)
"""Uses of measurement files, in the order in which they are proposed."""


def way_on(files: Sequence[str], recordings: Sequence[Recording]) -> Chapter:
    """The chapter of what can be done with the recordings now, and what is missing for the rest."""
    names = " ".join(shlex.quote(name) for name in files)
    rows: dict[str, list[str]] = {"purpose": [], "command": [], "missing": []}
    for use in USES:
        lacking = _lacking_of_all(use, recordings)
        if lacking is None:
            continue
        command = f"airmuscle {use.command.format(files=names)}"
        rows["purpose"].append(use.purpose)
        rows["command"].append("" if lacking else command)
        rows["missing"].append(", ".join(lacking))
    if not rows["purpose"]:
        summary = f"No quantity of a muscle: {_quantities(recordings)}."
        return Chapter("way-on", "The way on", summary)
    summary = ""
    if not any(rows["command"]):
        summary = "No fit is possible yet: the table says what is missing."
    table = Table("uses", "Possible now", rows, brief=len(USES))
    return Chapter("way-on", "The way on", summary, tables=(table,))


def possible_commands(recordings: Sequence[Recording]) -> list[str]:
    """The names of the commands that the recordings are sufficient for."""
    return [use.command.split()[0] for use in USES if _lacking_of_all(use, recordings) == []]


def _lacking_of_all(use: Use, recordings: Sequence[Recording]) -> list[str] | None:
    """What the recording that is closest to a use lacks, or the cause for which all together
    support no law; None where all lack everything.
    """
    if use.command.startswith("campaign") and len(recordings) < 2:
        return None
    candidates = [_lacking(use, _known(use, recording)) for recording in recordings]
    closest = min(candidates, key=len)
    if not closest and use.command.startswith("fit "):
        cause = support_of(recordings).cause
        return [] if cause is None else [f"{cause.name}: {cause.remedy}"]
    return None if len(closest) == len(use.needed) else closest


def _known(use: Use, recording: Recording) -> set[str]:
    """The quantities of a use that a recording has, or gives with its resting length; those of a
    joint are in the columns of its muscles.
    """
    if use.command.startswith("fit-joint"):
        return {name.rpartition(".")[2] for name in recording}
    return {name for alternatives in use.needed for name in alternatives if name in recording}


def _lacking(use: Use, known: set[str]) -> list[str]:
    """The quantities that a use needs and a recording lacks."""
    lacking = []
    for alternatives in use.needed:
        if not known & set(alternatives):
            is_convertible = alternatives == ("contraction",) and known & set(MOVED)
            lacking.append("resting length" if is_convertible else " or ".join(alternatives[:2]))
    return lacking


def _quantities(recordings: Sequence[Recording]) -> str:
    names = dict.fromkeys(name for recording in recordings for name in recording)
    return listed(list(names)) or "nothing was read"


def proposed_mapping(
    failures: Sequence[Failure], paths: Sequence[Path], mapping: ColumnMapping
) -> Proposal:
    """One mapping for what the files do not state: those that cannot be read, and the open columns
    of the others.
    """
    proposals = []
    for path in [*(failure.path for failure in failures), *dict.fromkeys(paths)]:
        try:
            proposals.append(propose(path, mapping.of_file(path)))
        except AirmuscleError:  # without a table, for which the error states the remedy
            continue
    return merged(proposals)


def print_mapping(
    proposal: Proposal, files: Sequence[str], saved: Path | None, echo: Callable[[str], None]
) -> None:
    """Print a proposed mapping, and the command that takes it."""
    if not proposal:
        return
    names = " ".join(shlex.quote(name) for name in files)
    target = str(saved or MAPPING_FILE)
    verb = f"saved as {target}" if saved else f"save it as {target}, or use --save-mapping {target}"
    open_count = proposal.questions
    ask = f"; answer its {open_count} question marks" if open_count else ""
    echo(f"\nA mapping for what the files do not state ({verb}{ask}):\n")
    echo(proposal.toml)
    answers = " ".join(f"--unit {quantity}=..." for quantity in proposal.open_units)
    then = f"then: airmuscle inspect {names} --mapping {shlex.quote(target)}"
    echo(f"{then} {answers}  # one answer for all columns of a quantity" if answers else then)
    echo(f"or:   airmuscle inspect {names} {proposal.options}")
