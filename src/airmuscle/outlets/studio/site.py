"""Site of the studio: the page as a folder of static files, opened from disk or from any web space.

A page that is opened from disk may not read files, but it may run scripts beside it. The list of
the models is therefore a script, and each model is one, which is loaded when the page shows it:

    index.html      the page
    contents.js     names and titles of all models, with their files
    models/*.js     sheet and printed program of one model each
    web/            scripts and styles of the studio, without those that need a server
"""

import json
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

from ...core import AirmuscleWarning, ParameterError, TraceError, atomic_folder
from ...files.library.files import is_path
from ...files.library.folders import list_laws, list_plants
from .joint_sheet import joint_names, sheet_of_joint
from .page import LICENCE, SCRIPTS, STYLES, names_without_server, page_of, web_file
from .tasks import sheet_of_any, sheet_of_law, sheet_of_library_plant

POLICY = (
    "default-src 'none'; script-src 'self' file:; style-src 'self' file:; img-src data: blob:;"
    " base-uri 'none'; form-action 'none'"
)
"""Policy of the page: scripts and styles from its own folder, and no request elsewhere; browsers
differ in whether 'self' contains the files of a folder on disk."""
CONTENTS = "contents.js"
KINDS = ("law", "plant", "joint")
OMITTED = ("scripts/size-tab.js",)
"""Further scripts that a site has no use for: a server finds the sizings."""


class Model(NamedTuple):
    """A model of the site: its kind, one of KINDS, and its sheet with the program."""

    kind: str
    sheet: Mapping[str, Any]

    @property
    def file(self) -> str:
        """The address of its script beside the page."""
        return f"models/{self.kind}-{re.sub(r'[^A-Za-z0-9._-]', '_', self.sheet['name'])}.js"

    @property
    def script(self) -> str:
        """The text of the file: the sheet enters the table of the page, and then its program."""
        sheet = {key: value for key, value in self.sheet.items() if key != "script"}
        return (
            f"{self.sheet['script']}airmuscleSite.sheets[{json.dumps(self.file)}] ="
            f" {json.dumps(sheet)};\n"
        )


class Omission(NamedTuple):
    """A model of the library that the page cannot show, and the reason."""

    name: str
    reason: str


class WrittenSite(NamedTuple):
    """The page of a site, its number of models and size [bytes], and what is not in it."""

    page: Path
    models: int
    size: int
    omissions: tuple[Omission, ...]


def write_site(folder: str | Path, names: Sequence[str] = ()) -> WrittenSite:
    """Write the page with all muscles, laws, plants and joints of the library, and with the muscle
    files and scenarios that are named by their paths. Files of the same name are replaced.

    Raises the errors of the loaders, ParameterError for two models of one name, and FileError if
    the folder cannot be written.
    """
    own_models = [_own_model(name) for name in names]
    _check_distinct(own_models)
    models, omissions = _library_models()
    models = [*own_models, *models]
    _check_distinct(models)
    files = site_files(models)
    folder = Path(folder)
    with atomic_folder(folder) as staging:
        for name, text in files.items():
            path = staging / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    size = sum(len(text.encode()) for text in files.values())
    return WrittenSite(folder / "index.html", len(models), size, tuple(omissions))


def site_files(models: Sequence[Model]) -> dict[str, str]:
    """The texts of all files of a site by their names."""
    scripts = [name for name in names_without_server(SCRIPTS) if name not in OMITTED]
    styles = names_without_server(STYLES)
    files = {
        "index.html": page_of("", _head(scripts, styles), ""),
        CONTENTS: _contents(models),
    }
    for name in (*scripts, *styles, LICENCE):
        files[f"web/{name}"] = web_file(name)
    for model in models:
        files[model.file] = model.script
    return files


def _head(scripts: Sequence[str], styles: Sequence[str]) -> str:
    """The policy, the styles, and the scripts in the order in which the page runs them."""
    lines = [f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">']
    lines += [f'<link rel="stylesheet" href="web/{name}">' for name in styles]
    lines.append(f'<script src="{CONTENTS}" defer></script>')
    lines += [f'<script src="web/{name}" defer></script>' for name in scripts]
    return "\n".join(lines)


def _contents(models: Sequence[Model]) -> str:
    """The script that lists the models by their kind."""
    library: dict[str, Any] = {"version": metadata.version("airmuscle")}
    for kind in KINDS:
        library[f"{kind}s"] = [_list_row(model) for model in models if model.kind == kind]
    table = f"{{ library: {json.dumps(library)}, sheets: {{}} }}"
    return f'"use strict";\nconst airmuscleSite = {table};\n'


def _list_row(model: Model) -> dict[str, str]:
    row = {key: model.sheet[key] for key in ("name", "title", "provenance")}
    return {**row, "file": model.file}


def _library_models() -> tuple[list[Model], list[Omission]]:
    """All models of the library. Their warnings are shown in the page."""
    models = []
    omissions = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        for kind, name, task in _library_tasks():
            try:
                models.append(Model(kind, task(name)))
            except TraceError as error:
                omissions.append(Omission(name, str(error.message)))
    return models, omissions


def _library_tasks() -> Iterator[tuple[str, str, Callable[[str], dict[str, Any]]]]:
    for name in list_laws():
        yield "law", name, sheet_of_law
    for name in list_plants():
        yield "plant", name, sheet_of_library_plant
    for name in joint_names():
        yield "joint", name, sheet_of_joint


def _own_model(name: str) -> Model:
    """The model of a file of the user; in the list it stands beside the library."""
    if not is_path(name):
        raise ParameterError(
            f"'{name}' is no file; the page contains the whole library already. Name muscle files"
            " or scenarios by their paths, such as my/muscle.toml."
        )
    sheet = sheet_of_any(name)
    return Model("plant" if "plant" in sheet else "law", {**sheet, "own_text": ""})


def _check_distinct(models: Sequence[Model]) -> None:
    """Raise ParameterError for two models that would have one file."""
    known = set[str]()
    for model in models:
        if model.file in known:
            raise ParameterError(
                f"the page would have two models of the name '{model.sheet['name']}'; rename the"
                " file of one of them."
            )
        known.add(model.file)
