"""Task of the tab Fit on episodes of an arm: what the record contains, and the fit, report and
scenarios of the arm.

The computation is that of `airmuscle fit-joint`. A ZIP archive is a folder of episodes. A mapping
is proposed.
"""

import contextlib
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ...bench import propose_mapping
from ...bench.readers.tables.file_kind import parse_toml
from ...core import AirmuscleError, FileError, atomic_folder, suggestion
from ...files.library import list_plants
from ...report.data import as_sheet
from ...report.json_text import as_json
from ...report.write import write_into
from ..requests import (
    JointFitRequest,
    RequestError,
    build,
    fit_requested_arm,
    form_fields,
    inspect_requested,
)
from .fit_reading import without_folder
from .fit_uploads import FILES
from .plant_sheet import svg_uri
from .tasks import check_self_contained

ARCHIVE = ".zip"
MAPPING = "mapping.toml"
KNOWN = "known.toml"
MAX_UNPACKED = 512 * 10**6
MAX_ENTRIES = 20_000
"""Largest size [bytes] and number of the files of an archive (chosen)."""
MAX_TEXT = 20_000
"""Largest size of a mapping and of a scenario [characters] (chosen)."""
FIELDS = ("mapping", *(option["name"] for option in form_fields(JointFitRequest)))
"""Fields of the page; each is a text, and may be empty."""


ArmTexts = Mapping[str, str]
"""What the user states about episodes: the texts of FIELDS, that of the mapping file among them."""


def _request(texts: ArmTexts, folder: Path) -> JointFitRequest:
    """The request, whose mapping file and known joint are written to a folder. Raises
    InputError.
    """
    stated: dict[str, Any] = {**texts, "mapping": _written(folder / MAPPING, texts["mapping"])}
    known = texts["known"].strip()
    if known and ("=" in known or "[" in known):
        try:
            check_self_contained(parse_toml(known, KNOWN))
        except AirmuscleError as error:
            raise RequestError(str(error.message), "known") from None
        stated["known"] = str(_written(folder / KNOWN, known))
    elif known and known not in list_plants():
        raise RequestError(
            f"'{known[:60]}' is no plant of the library; write the name of one, or the text of a"
            f" scenario.{suggestion(known, list_plants())}",
            "known",
        )
    return build(JointFitRequest, stated, lambda name: name.replace("_", " "))


def _written(path: Path, text: str) -> Path:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def read_arm_settings(data: dict[str, Any]) -> ArmTexts:
    """The settings in a request of the page. Raises RequestError."""
    values = {name: data.get(name, "") for name in FIELDS}
    for name in (
        n for n, value in values.items() if not isinstance(value, str) or len(value) > MAX_TEXT
    ):
        raise RequestError(f"{name} must be a text of at most {MAX_TEXT} characters.", name)
    return values


def sheet_of_episodes(folder: str, texts: ArmTexts) -> dict[str, Any]:
    """What was understood of the episodes of a set; problems are part of the sheet, and no
    exception.
    """
    names = sorted(path.name for path in (Path(folder) / FILES).iterdir())
    sheet: dict[str, Any] = {
        "files": [{"name": name, "columns": []} for name in names],
        "recordings": [],
        "remarks": [],
        "problems": [],
        "mapping": texts["mapping"],
        "lines": [],
        "ready": False,
    }
    try:
        with _opened(Path(folder)) as (source, place):
            sheet["mapping"] = sheet["mapping"] or propose_mapping(source)
            inspection = inspect_requested(
                source, _request({**texts, "mapping": sheet["mapping"]}, place)
            )
            sheet["lines"] = [
                line for line in str(inspection).splitlines() if not line.startswith("error: ")
            ]
            sheet["problems"] = [{"field": "mapping", "text": text} for text in inspection.errors]
    except RequestError as error:
        sheet["problems"] = [{"field": error.field or "mapping", "text": error.message}]
    sheet["ready"] = not sheet["problems"]
    return sheet


def run_arm_fit(
    folder: str,
    out: str,
    texts: ArmTexts,
    report: Callable[[float, str], None],
    pack: Callable[[Path], list[str]],
) -> None:
    """Fit an arm to the episodes of a set, and write its result into `out`; `pack` returns the
    files that are offered. Raises RequestError."""
    report(0.0, "reading the episodes")
    lines: list[str] = []

    def progress(text: str) -> None:
        lines.append(text)
        report(1.0 - 0.9 ** len(lines) ** 1.5, text)  # the number of joints is not known before

    with _opened(Path(folder), "fit") as (source, place):
        chapter, files = fit_requested_arm(source, _request(texts, place), progress)
    report(0.95, "report")
    with atomic_folder(out) as staging:
        write_into(staging, [chapter], title="Identified arm")
        for name, text in files.items():
            _written(staging / name, text)
        figures = [{"src": svg_uri(plot.draw()), "caption": plot.caption} for plot in chapter.plots]
        sheet = {"arm": as_sheet(chapter), "figures": figures, "files": pack(staging)}
        (staging / "result.json").write_text(as_json(sheet), encoding="utf-8")


@contextlib.contextmanager
def _opened(folder: Path, field: str = "mapping") -> Iterator[tuple[Path, Path]]:
    """The file or the folder of the episodes of a set, and a folder for the mapping; errors do not
    name them.
    """
    files = sorted((folder / FILES).iterdir())
    with tempfile.TemporaryDirectory(dir=folder) as made:
        place = Path(made)
        try:
            if not files:
                raise RequestError("there is no file; drop the episodes first.", "files")
            source = files[0] if len(files) == 1 else folder / FILES
            yield (
                (
                    _unpacked(source, place / "episodes")
                    if source.suffix.lower() == ARCHIVE
                    else source
                ),
                place,
            )
        except AirmuscleError as error:
            text = without_folder(without_folder(str(error.message), place), folder / FILES)
            named_field = getattr(error, "field", "") or next(
                (n for n in ("mapping", "known") if f"{n}.toml" in text), field
            )
            raise RequestError(text, named_field) from None


def _unpacked(archive: Path, folder: Path) -> Path:
    """The folder of the files of an archive: the innermost one that alone holds all. Raises
    FileError.
    """
    try:
        with zipfile.ZipFile(archive) as file:
            entries = file.infolist()
            if (
                len(entries) > MAX_ENTRIES
                or sum(entry.file_size for entry in entries) > MAX_UNPACKED
            ):
                raise FileError(
                    f"{archive.name}: the archive holds more than {MAX_ENTRIES} files or"
                    f" {MAX_UNPACKED // 10**6} MB; give fewer episodes."
                )
            file.extractall(folder)  # names that lead out of the folder are changed
    except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError) as reason:
        raise FileError(
            f"{archive.name}: cannot be read as a ZIP archive ({reason}). Write it again."
        ) from None
    inner = list(folder.iterdir())
    while len(inner) == 1 and inner[0].is_dir() and not (inner[0] / "metadata.yaml").exists():
        folder = inner[0]
        inner = list(inner[0].iterdir())
    return folder
