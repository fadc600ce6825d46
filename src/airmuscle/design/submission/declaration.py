"""Declaration of a contribution, the file submission.toml: what it states, reading and writing."""

import dataclasses
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ...core import FileError, ParameterError, abridged
from ...files.library import Location, check_keys, read_table, read_text, read_toml

DECLARATION = "submission.toml"
"""Name of the declaration in the folder of a contribution."""
OPEN = "?"
"""What stands for a value that only a person knows."""
LICENCES = (
    "CC0-1.0",
    "CC-BY-4.0",
    "PDDL-1.0",
    "ODC-By-1.0",
    "MIT",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "Apache-2.0",
)
"""SPDX identifiers of the licences under which the library can pass on a muscle and its records."""
FIT = "fit"
HELD_OUT = "held out"
USES = (FIT, HELD_OUT)
"""What a record was used for: the muscle was fitted to it, or never saw it."""
TEXTS = {
    "name": "name in the library: lower-case letters, digits and hyphens, such as smith-pam-12-200",
    "muscle": "muscle file, as airmuscle fit or campaign writes it",
    "licence": f"SPDX identifier, of muscle and records: {', '.join(LICENCES)}",
    "contributor": "who sends it, with an address or an ORCID",
    "measured_by": "who measured, with laboratory and year",
    "mapping": "mapping file of the records; empty where they state columns and units themselves",
}
"""The texts of a declaration with their meaning."""
RIG = {
    "pressure": "sensor, range and place of the pressure",
    "force": "sensor and range of the force",
    "motion": "sensor of the length or contraction",
    "procedure": "what was held, what was moved and how fast",
}
"""The texts of the table [rig] with their meaning."""
OPTIONAL = ("mapping",)
RECORD_KEYS = ("file", "sha256", "use", "address", "rms_error")


@dataclasses.dataclass(frozen=True)
class SubmittedRecord:
    """A raw record of a contribution.

    file       path below the folder of the contribution
    sha256     of its bytes, 64 hexadecimal digits
    use        a word of USES
    address    where the record can be had if it is not in the folder
    rms_error  of a record that was held out: greatest rms error that is stated, such as "4.2 N"
    """

    file: str
    sha256: str = ""
    use: str = OPEN
    address: str = ""
    rms_error: str = ""


@dataclasses.dataclass(frozen=True)
class Submission:
    """A contribution as its declaration states it; `?` and empty texts are open."""

    folder: Path
    name: str = OPEN
    muscle: str = OPEN
    licence: str = OPEN
    contributor: str = OPEN
    measured_by: str = OPEN
    mapping: str = ""
    rig: Mapping[str, str] = dataclasses.field(default_factory=dict)
    records: tuple[SubmittedRecord, ...] = ()

    @property
    def file(self) -> Path:
        """The declaration."""
        return self.folder / DECLARATION

    def open_keys(self) -> Iterator[str]:
        """The keys that wait for an answer."""
        for key in TEXTS:
            if key not in OPTIONAL and is_open(getattr(self, key)):
                yield key
        for key in RIG:
            if is_open(self.rig.get(key, "")):
                yield f"rig.{key}"
        for record in self.records:
            if is_open(record.use):
                yield f"use of {record.file}"


def is_open(text: str) -> bool:
    """Whether a text waits for an answer."""
    return text.strip() in ("", OPEN)


def read_submission(folder: Path) -> Submission:
    """The contribution of a folder. Raises FileError and ParameterError for another form."""
    path = folder / DECLARATION
    tables = read_toml(path)
    location = Location.of_file(path)
    check_keys(tables, (*TEXTS, "rig", "record"), location)
    rig = read_table(tables.get("rig", {}), None, location.at("rig"))
    in_rig = location.inside("rig")
    check_keys(rig, tuple(RIG), in_rig)
    rows = tables.get("record", [])
    if not isinstance(rows, list):
        raise ParameterError(
            f"{location}: record is {abridged(rows)}; write each record as a table [[record]]."
        )
    return Submission(
        folder,
        **{key: read_text(tables, key, location, needed=False) for key in TEXTS},
        rig={key: read_text(rig, key, in_rig, needed=False) for key in RIG},
        records=tuple(
            _record(row, location.inside(f"record {number}")) for number, row in enumerate(rows, 1)
        ),
    )


def _record(row: Any, location: Location) -> SubmittedRecord:
    table = read_table(row, None, location)
    check_keys(table, RECORD_KEYS, location)
    texts = {
        key: read_text(table, key, location, needed=key == "file").strip() for key in RECORD_KEYS
    }
    path = Path(texts["file"])
    if path.is_absolute() or ".." in path.parts or "\\" in texts["file"]:
        raise FileError(
            f"{location}: file is {abridged(texts['file'])}; it must be a path below the folder of"
            " the contribution, with '/' between folders. Put the record there."
        )
    texts["sha256"] = texts["sha256"].lower()
    return SubmittedRecord(**texts)


def declaration_toml(submission: Submission) -> str:
    """The text of the declaration, with the meaning of each key as a comment."""
    lines = [
        "# Contribution of a muscle to the library of airmuscle.",
        '# "?" stands for what only you know; airmuscle submit FOLDER fills in the rest.',
    ]
    lines += _texts(TEXTS, {key: getattr(submission, key) for key in TEXTS})
    lines += ["", "[rig]", *_texts(RIG, {key: submission.rig.get(key, OPEN) for key in RIG})]
    for record in submission.records:
        lines += ["", "[[record]]", f"file = {_quoted(record.file)}"]
        lines.append(f"sha256 = {_quoted(record.sha256)}")
        lines.append(f"use = {_quoted(record.use)}  # {FIT}, or {HELD_OUT}: never used in a fit")
        if record.address:
            lines.append(f"address = {_quoted(record.address)}")
        if record.rms_error:
            lines.append(f"rms_error = {_quoted(record.rms_error)}  # greatest one that is stated")
    return "\n".join(lines) + "\n"


def _texts(meanings: Mapping[str, str], values: Mapping[str, str]) -> list[str]:
    return [f"{key} = {_quoted(values[key])}  # {meaning}" for key, meaning in meanings.items()]


def _quoted(text: str) -> str:
    """A basic string of TOML, whose escapes are those of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
