"""`airmuscle submit`: a muscle and its records as a contribution to the library."""

from pathlib import Path
from typing import Annotated

from ...core import atomic_file, check_writable
from ...design.submission import (
    DECLARATION,
    REPORT_FOLDER,
    SubmissionVerdict,
    check_submission,
    declaration_toml,
    prepare_submission,
    propose_submission,
)
from ...files.library import to_toml
from .delivery import deliver
from .options import Json
from .parser import Argument, CommandOption
from .printing import Files
from .requested import with_requests
from .terminal import echo, print_json

Source = Annotated[Path, Argument("FOLDER", "Folder with the muscle file and its raw records.")]
ENTRY_FILE = "entry.toml"
"""The muscle as the library takes it, beside the report."""


Check = Annotated[
    bool,
    CommandOption("--check", "Accept or refuse the contribution; nothing is written."),
]
Downloads = Annotated[
    Path | None,
    CommandOption(
        "--downloads", "Folder with the records that the declaration states by address.", "DIR"
    ),
]


@with_requests
def submit(
    folder: Source, check: Check = False, downloads: Downloads = None, json: Json = False
) -> None:
    """Prepare a muscle and its records for the library.

    \b
    The first call writes FOLDER/submission.toml, with a question mark for what only you know:
    licence, rig, who measured, which records were held out. The next call fills in the hashes and
    the errors of the records that were held out, computed anew, and writes FOLDER/report with a
    page and the muscle as the library takes it. --check accepts or refuses the contribution, with
    reasons; the exit code is 1 where it is refused.

    \b
    Examples:
      airmuscle submit contribution
      airmuscle submit contribution --check
    """
    if not check and not (folder / DECLARATION).exists():
        _propose(folder, json)
        return
    if check:
        verdict = check_submission(folder, downloads)
        deliver("submit", verdict.chapters(), json=json)
    else:
        verdict = _prepared(folder, downloads, json)
    if not verdict.is_accepted:
        raise SystemExit(1)


def _propose(folder: Path, json: bool) -> None:
    """Write a declaration with question marks."""
    submission = propose_submission(folder)
    _write(submission.file, declaration_toml(submission))
    questions = list(submission.open_keys())
    if json:
        print_json({"declaration": str(submission.file), "questions": questions})
        return
    echo(f"declaration: {submission.file}")
    echo(f"Answer its {len(questions)} question marks, then: airmuscle submit {folder}")


def _prepared(folder: Path, downloads: Path | None, json: bool) -> SubmissionVerdict:
    """The verdict, with its declaration and its report written."""
    out = folder / REPORT_FOLDER
    check_writable(out)
    verdict = prepare_submission(folder, downloads)
    submission = verdict.submission
    _write(submission.file, declaration_toml(submission))
    files: Files = {}
    if verdict.is_accepted:
        files = {ENTRY_FILE: to_toml(verdict.library_entry())}
    else:
        (out / ENTRY_FILE).unlink(missing_ok=True)  # of an earlier verdict
    deliver(
        "submit",
        verdict.chapters(),
        json=json,
        out=out,
        title="Contribution",
        files=files,
        others={"declaration": submission.file},
    )
    return verdict


def _write(path: Path, text: str) -> None:
    with atomic_file(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")
