"""Examination of a contribution: declaration, licence, records and hashes, diagnoses, figures of
records that were held out, computed anew, and the audit of the law.
"""

import dataclasses
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...bench import RecordPrediction
from ...bench.diagnosis import VALUE_RULES, apply_rules, bench_data, check_record, read
from ...bench.readers import ColumnMapping, read_mapping
from ...core import AirmuscleError, one_line, units
from ...files.library import Entry, list_library, load_law, predict_with_entry
from ...recording import Recording, quantity_of
from ..audit import AuditResult, audit_law, law_of_entry
from .declaration import (
    FIT,
    HELD_OUT,
    LICENCES,
    OPEN,
    USES,
    Submission,
    SubmittedRecord,
    is_open,
    read_submission,
)
from .proposal import sha256_of
from .verdict import HeldOutFigure, Refusal, SubmissionVerdict

TOLERANCE = 1.02
"""Ratio of computed to stated error up to which the figure holds: versions and processors differ
(chosen)."""
DIGITS = 3
"""Significant digits to which a figure is rounded up when it is stated (chosen)."""
NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
SHA256 = re.compile(r"[0-9a-f]{64}")
RecordingsOfRecords = Sequence[tuple[SubmittedRecord, Sequence[Recording]]]
"""Records with what was read from their files."""


def check_submission(folder: Path, downloads: Path | None = None) -> SubmissionVerdict:
    """The verdict on the contribution of a folder; nothing is written.

    downloads  folder of the records that the declaration states by address

    Raises FileError and ParameterError for a declaration of another form.
    """
    submission = read_submission(folder)
    return _Examination(submission, downloads).verdict(submission)


def prepare_submission(folder: Path, downloads: Path | None = None) -> SubmissionVerdict:
    """The verdict on a contribution whose missing hashes and figures are filled in; the declaration
    of the verdict is to be written. Raises as `check_submission`.
    """
    submission = _with_hashes(read_submission(folder), downloads)
    examination = _Examination(submission, downloads)
    return examination.verdict(examination.with_figures())


def path_of(submission: Submission, record: SubmittedRecord, downloads: Path | None) -> Path | None:
    """The file of a record, in the folder of the contribution or among the downloads; None where it
    is in neither.
    """
    for folder in (submission.folder, downloads):
        if folder is None:
            continue
        path = folder / record.file
        if path.is_file() and path.resolve().is_relative_to(folder.resolve()):
            return path
    return None


def _with_hashes(submission: Submission, downloads: Path | None) -> Submission:
    records = []
    for record in submission.records:
        path = path_of(submission, record, downloads)
        if path is not None and is_open(record.sha256):
            record = dataclasses.replace(record, sha256=sha256_of(path))
        records.append(record)
    return dataclasses.replace(submission, records=tuple(records))


class _Examination:
    """What is computed once from the files of a contribution."""

    def __init__(self, submission: Submission, downloads: Path | None) -> None:
        self.submission = submission
        self.downloads = downloads
        self.refusals: list[Refusal] = []
        self.notes: list[str] = []
        self.figures: dict[str, HeldOutFigure] = {}
        self.predictions: list[RecordPrediction] = []
        self.refusals += _refusals_of_declaration(submission)
        self.refusals += _refusals_of_uses(submission)
        paths = self._verified_paths()
        self.entry = self._loaded_entry()
        recordings = self._read_recordings(paths)
        self._diagnose(recordings)
        self._predict(recordings)
        self.audit = self._audited()

    def verdict(self, submission: Submission) -> SubmissionVerdict:
        """The verdict, with the figures that a declaration states."""
        refusals = [*self.refusals, *self._refusals_of_figures(submission)]
        return SubmissionVerdict(
            submission,
            self.entry,
            tuple(refusals),
            self.figures,
            tuple(self.predictions),
            self.audit,
            tuple(self.notes),
        )

    def with_figures(self) -> Submission:
        """The contribution with the figures of those records for which it states none."""
        records = []
        for record in self.submission.records:
            figure = self.figures.get(record.file)
            if figure is not None and is_open(record.rms_error):
                record = dataclasses.replace(record, rms_error=_rounded_up(figure))
            records.append(record)
        return dataclasses.replace(self.submission, records=tuple(records))

    def _refuse(self, rule: str, text: str, remedy: str) -> None:
        self.refusals.append(Refusal(rule, text, remedy))

    def _verified_paths(self) -> dict[str, Path]:
        """The files of the records that are present and have the stated hash."""
        paths = {}
        for record in self.submission.records:
            path = path_of(self.submission, record, self.downloads)
            if path is None:
                self._refuse_missing(record)
                continue
            computed = sha256_of(path)
            if computed != record.sha256:
                stated = "no SHA-256" if is_open(record.sha256) else f"SHA-256 {record.sha256}"
                self._refuse(
                    "hashes",
                    f"{record.file} has SHA-256 {computed}; the declaration states"
                    f" {one_line(stated)}",
                    "Restore the file; if it was meant to change, delete the line sha256 and run"
                    " airmuscle submit again.",
                )
                continue
            paths[record.file] = path
        return paths

    def _refuse_missing(self, record: SubmittedRecord) -> None:
        is_addressed = record.address and SHA256.fullmatch(record.sha256)
        if is_addressed and record.use == FIT:
            self.notes.append(f"{record.file} is at {record.address}; it was not examined")
            return
        if is_addressed:
            remedy = f"Download it from {record.address} and name its folder by --downloads."
        else:
            remedy = "Put it into the folder, or state address and sha256 of a record of the fit."
        self._refuse("records present", f"{record.file} is missing", remedy)

    def _loaded_entry(self) -> Entry | None:
        muscle = self.submission.muscle
        if is_open(muscle):
            return None
        path = self.submission.folder / muscle
        if not path.resolve().is_relative_to(self.submission.folder.resolve()):
            self._refuse("muscle file", f"{muscle} is not in the folder", "Put it there.")
            return None
        try:
            return load_law(path)
        except AirmuscleError as error:
            self._refuse("muscle file", _sentence(error), "Correct the muscle file.")
            return None

    def _read_recordings(self, paths: dict[str, Path]) -> RecordingsOfRecords:
        mapping = ColumnMapping()
        recordings = []
        try:
            if not is_open(self.submission.mapping):
                mapping = read_mapping(self.submission.folder / self.submission.mapping)
        except AirmuscleError as error:
            self._refuse("readable records", _sentence(error), "Correct the mapping file.")
            return []
        for record in self.submission.records:
            if record.file not in paths:
                continue
            try:
                recordings.append((record, read(paths[record.file], mapping)))
            except AirmuscleError as error:
                remedy = "airmuscle inspect proposes a mapping file; name it as mapping."
                self._refuse("readable records", _sentence(error), remedy)
        return recordings

    def _diagnose(self, recordings: RecordingsOfRecords) -> None:
        for record, parts in recordings:
            for recording in parts:
                for text, remedy in _faults(recording):
                    self._refuse("diagnoses", f"{record.file}: {text}", remedy)

    def _predict(self, recordings: RecordingsOfRecords) -> None:
        if self.entry is None:
            return
        for record, parts in recordings:
            if record.use != HELD_OUT:
                continue
            try:
                predictions = [predict_with_entry(self.entry, recording) for recording in parts]
            except AirmuscleError as error:
                remedy = "A record that is held out has pressure, contraction or length, and force."
                self._refuse("held-out figures", _sentence(error), remedy)
                continue
            for prediction in predictions:
                if prediction.misfit is not None:
                    self._refuse(
                        "law follows records",
                        f"{record.file}: {str(prediction.misfit).rstrip('.')}",
                        "Remove the cause, or fit the law to records of this kind.",
                    )
                self.notes += [f"{record.file}: {note}" for note in prediction.notes]
            self.figures[record.file] = _figure(predictions)
            self.predictions += predictions

    def _audited(self) -> AuditResult | None:
        if self.entry is None:
            return None
        result = audit_law(law_of_entry(self.entry))
        for finding in result.findings:
            text = f"{finding.rule}: {finding.text.rstrip('.')}"
            remedy = f"airmuscle audit {self.submission.muscle} shows the points."
            self._refuse("audit", text, remedy)
        return result

    def _refusals_of_figures(self, submission: Submission) -> Iterator[Refusal]:
        for record in submission.records:
            figure = self.figures.get(record.file)
            if figure is None:
                continue
            computed = f"{figure.rms_error:.4g} {figure.unit}"
            if is_open(record.rms_error):
                yield Refusal(
                    "held-out figures",
                    f"{record.file} states no rms_error; computed are {computed}",
                    "airmuscle submit FOLDER writes it.",
                )
                continue
            try:
                stated = units.quantity(record.rms_error, figure.unit, where="rms_error")
            except AirmuscleError as error:
                yield Refusal(
                    "held-out figures", f"{record.file}: {_sentence(error)}", "Correct the unit."
                )
                continue
            if not figure.rms_error <= TOLERANCE * stated:
                yield Refusal(
                    "held-out figures",
                    f"{record.file} is predicted with an rms error of {computed}, which is worse"
                    f" than the stated {record.rms_error}",
                    "Send the muscle file to which the figure belongs; if the new figure is right,"
                    " delete the line rms_error and run airmuscle submit again.",
                )


def _sentence(error: AirmuscleError) -> str:
    return str(error).rstrip(".")


def _refusals_of_declaration(submission: Submission) -> Iterator[Refusal]:
    """What the declaration lacks, and a name or a licence that cannot be taken."""
    for key in submission.open_keys():
        if key != "licence":
            text = f"{key} is not answered in {submission.file.name}"
            yield Refusal("declaration", text, f"Replace {OPEN} by the answer.")
    name = submission.name
    if not is_open(name):
        if not NAME.fullmatch(name):
            text = f"name is '{one_line(name)}'"
            remedy = "Write lower-case letters, digits and hyphens, such as smith-pam-12-200."
            yield Refusal("declaration", text, remedy)
        elif name in list_library():
            text = f"the library has an entry of the name {name}"
            yield Refusal("declaration", text, "Choose another name.")
    if is_open(submission.licence):
        remedy = f"State one of {', '.join(LICENCES)}, to which all who own the records agree."
        yield Refusal("licence", "no licence is stated", remedy)
    elif submission.licence not in LICENCES:
        text = f"'{one_line(submission.licence)}' is no licence under which the library passes on"
        yield Refusal("licence", text, f"Allowed are {', '.join(LICENCES)}.")


def _refusals_of_uses(submission: Submission) -> Iterator[Refusal]:
    """What is wrong with the division into records of the fit and records that were held out."""
    rule = "records of fit and held out"
    for record in submission.records:
        if not is_open(record.use) and record.use not in USES:
            text = f"use of {record.file} is '{one_line(record.use)}'"
            yield Refusal(rule, text, f"Write '{FIT}' or '{HELD_OUT}'.")
    for use in USES:
        if not any(record.use == use for record in submission.records):
            yield Refusal(rule, f"no record has use = '{use}'", "One of each is needed.")
    yield from _refusals_of_copies(submission, rule)


def _refusals_of_copies(submission: Submission, rule: str) -> Iterator[Refusal]:
    """Records that are called held out and are copies of a record of the fit."""
    hashed = [record for record in submission.records if not is_open(record.sha256)]
    fitted = {record.sha256: record.file for record in hashed if record.use == FIT}
    for record in hashed:
        twin = fitted.get(record.sha256)
        if record.use == HELD_OUT and twin is not None:
            text = f"{record.file} has the same bytes as {twin}, to which the law was fitted"
            yield Refusal(rule, text, "Hold out a record that the fit has not seen.")


def _faults(recording: Recording) -> Iterator[tuple[str, str]]:
    """Faults of a recording with what to do: of the record in time, or of the values of a map."""
    if "time" in recording:
        for fault in check_record(recording).faults:
            yield f"{fault.rule}: {fault.text.rstrip('.')}", fault.remedy
        return
    remedies = {rule.name: rule.remedy for rule in VALUE_RULES}
    for diagnosis in apply_rules(VALUE_RULES, bench_data([recording])):
        remedy = remedies[diagnosis.rule]
        yield diagnosis.text.rstrip("."), f"{remedy[0].upper()}{remedy[1:]}."


def _figure(predictions: Sequence[RecordPrediction]) -> HeldOutFigure:
    """The error of all recordings of a file, over all their rows that are compared."""
    quantities = [prediction.quantities[0] for prediction in predictions]
    errors = np.concatenate([quantity.errors[quantity.compared] for quantity in quantities])
    rows = [int(quantity.compared.sum()) for quantity in quantities]
    shares = [quantity.share for quantity in quantities]
    stated = [share for share in shares if share is not None]
    name = quantities[0].name
    declared = quantity_of(name)
    return HeldOutFigure(
        name,
        "" if declared is None else declared.unit,
        float(np.sqrt(np.mean(errors**2))),
        float(np.average(stated, weights=rows)) if len(stated) == len(shares) else None,
    )


def _rounded_up(figure: HeldOutFigure) -> str:
    """The error, rounded up so that it holds, with its unit."""
    if not figure.rms_error > 0.0:
        return f"0 {figure.unit}"
    step = 10.0 ** (math.floor(math.log10(figure.rms_error)) - DIGITS + 1)
    number = math.ceil(figure.rms_error / step) * step
    return f"{number:.{DIGITS}g} {figure.unit}"
