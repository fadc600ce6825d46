"""XML text of a body, with the files that it includes and the lines of its elements, checked before
MuJoCo reads it.

Refused are a document type (the definitions of an XML bomb), files outside the folder of the body,
and missing files.
"""

import dataclasses
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.parsers import expat

from ...core import FileError, ShortRepr, quotable

MAX_BYTES = 64 * 2**20
"""Greatest size of one XML file (chosen)."""
MAX_ELEMENTS = 1_000_000
"""Greatest number of elements of a body (chosen)."""
MAX_DEPTH = 20
"""Greatest depth of files that include one another (chosen)."""
ASSET_FOLDERS = {"mesh": "meshdir", "hfield": "meshdir", "skin": "meshdir", "texture": "texturedir"}
"""Elements that name a file, with the attribute of <compiler> that gives its folder."""
_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
"""Comments, in which MuJoCo permits two hyphens, unlike the standard of XML."""


class XmlElement(NamedTuple):
    """An element of a body: tag, attributes, file and line."""

    tag: str
    attributes: Mapping[str, str]
    file: Path
    line: int

    @property
    def place(self) -> str:
        """File, line and element, for a message."""
        name = self.attributes.get("name", "")
        return f"{self.file}:{self.line}: {self.tag}{f' {quotable(name)!r}' if name else ''}"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class XmlSource(ShortRepr):
    """A body as text: its main file, the folder that it may read, and all its elements.

    missing  assets whose file does not exist
    """

    path: Path
    folder: Path
    elements: tuple[XmlElement, ...]
    missing: tuple[XmlElement, ...]

    @property
    def is_urdf(self) -> bool:
        """Whether it is a URDF."""
        return self.elements[0].tag == "robot"

    def of(self, *tags: str) -> Iterator[XmlElement]:
        """The elements with one of these tags."""
        return (element for element in self.elements if element.tag in tags)

    def place(self, name: str, *tags: str) -> str:
        """File, line and element of a name; the main file and the name where it has no element."""
        for element in self.of(*tags):
            if element.attributes.get("name") == name:
                return element.place
        return f"{self.path}: {tags[0]} {quotable(name)!r}"


def read_source(path: Path, folder: Path | None = None) -> XmlSource:
    """The text of a body and of all that it includes.

    `folder` is the one from which it may read files, by default that of the main file. Raises
    FileError.
    """
    limit = (folder or path.parent).resolve()
    elements: list[XmlElement] = []
    _read(path, path, limit, elements, ())
    if not elements or elements[0].tag not in ("mujoco", "robot"):
        tag = elements[0].tag if elements else "nothing"
        raise FileError(
            f"{path}: the first element is <{quotable(tag)}>; it must be <mujoco> of an MJCF or"
            " <robot> of a URDF."
        )
    source = XmlSource(path, limit, tuple(elements), ())
    return dataclasses.replace(source, missing=tuple(_missing_assets(source)))


def _read(
    file: Path, main: Path, limit: Path, elements: list[XmlElement], open_files: tuple[Path, ...]
) -> None:
    """Append the elements of a file, those of an included one in place of <include>."""
    parser = expat.ParserCreate()

    def refuse_definition(*_: object) -> None:
        raise FileError(
            f"{file}:{parser.CurrentLineNumber}: the file has a document type (<!DOCTYPE>), whose"
            " definitions can expand without limit; remove it, bodies need none."
        )

    def append(tag: str, attributes: dict[str, str]) -> None:
        element = XmlElement(tag, attributes, file, parser.CurrentLineNumber)
        if tag == "include":
            included = _included(element, main, limit, (*open_files, file))
            _read(included, main, limit, elements, (*open_files, file))
            return
        elements.append(element)
        if len(elements) > MAX_ELEMENTS:
            raise FileError(f"{element.place}: the body has more than {MAX_ELEMENTS} elements.")

    parser.StartDoctypeDeclHandler = refuse_definition
    parser.StartElementHandler = append
    parser.buffer_text = True
    try:
        parser.Parse(_COMMENT.sub(_lines_alone, _bytes(file)), True)
    except expat.ExpatError as error:
        raise FileError(
            f"{file}:{error.lineno}: the file is not valid XML: {expat.ErrorString(error.code)}."
        ) from None


def _lines_alone(comment: re.Match[bytes]) -> bytes:
    """The line ends of a comment, so that the numbers of lines remain."""
    return b"\n" * comment[0].count(b"\n")


def _bytes(file: Path) -> bytes:
    """The contents of a file. Raises FileError."""
    try:
        if file.is_dir():
            raise FileError(f"{file}: is a folder; give the XML file of the body.")
        if file.stat().st_size > MAX_BYTES:
            raise FileError(
                f"{file}: has {file.stat().st_size / 2**20:.4g} MiB; a body has at most"
                f" {MAX_BYTES // 2**20} MiB of XML."
            )
        return file.read_bytes()
    except FileNotFoundError:
        raise FileError(f"{file}: there is no such file.") from None
    except (OSError, ValueError) as error:
        raise FileError(f"{file}: cannot be read: {getattr(error, 'strerror', error)}.") from None


def _included(element: XmlElement, main: Path, limit: Path, open_files: tuple[Path, ...]) -> Path:
    """The file of an <include>, relative to the folder of the main file, as in MuJoCo. Raises
    FileError.
    """
    name = element.attributes.get("file", "")
    if not name:
        raise FileError(f"{element.place}: it has no attribute file.")
    included = main.parent / name
    _check_inside(element, included, limit)
    if included.resolve() in {file.resolve() for file in open_files} or len(open_files) > MAX_DEPTH:
        raise FileError(f"{element.place}: {quotable(name)} includes itself.")
    if not included.is_file():
        raise FileError(f"{element.place}: there is no file {included}.")
    return included


def _check_inside(element: XmlElement, file: Path, limit: Path) -> None:
    """Raise FileError for a file outside the folder of the body."""
    if not file.resolve().is_relative_to(limit):
        raise FileError(
            f"{element.place}: {file} is outside {limit}, the only folder from which this body may"
            " read. If you trust the file, give the folder above with --folder (folder=...)."
        )


def _missing_assets(source: XmlSource) -> Iterator[XmlElement]:
    """The elements whose file does not exist. Raises FileError for one outside the folder."""
    settings: dict[str, str] = {}
    for element in source.of("compiler"):
        settings |= element.attributes
    is_name_alone = settings.get("strippath", "true" if source.is_urdf else "false") == "true"
    for element in source.of(*ASSET_FOLDERS):
        name = element.attributes.get("file") or element.attributes.get("filename")
        if not name:
            continue
        name = name.replace("\\", "/")
        if is_name_alone:
            name = name.rsplit("/", 1)[-1]
        subfolder = settings.get(ASSET_FOLDERS[element.tag]) or settings.get("assetdir") or ""
        file = source.path.parent / subfolder / name
        _check_inside(element, file, source.folder)
        if not file.is_file():
            yield element
