"""Packages of Functional Mock-up Units: description, sources and binaries in one ZIP file."""

import dataclasses
import hashlib
import html
import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...core import ParameterError, atomic_folder
from .compiler import Platform, this_platform
from .fmi_description import FmuDescription
from .identifiers import block_comment, filled, template

VERSIONS = (2, 3)
NOT_REQUESTED = "none was requested"
HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
"""Headers of the standard by version, with its 2-clause BSD licence in each."""
REFERENCES = "extra/org.fmi-standard.fmi-ls-ref"
"""Folder of reference data, whose manifest FMI-LS-REF 1.0.0-alpha.1 defines."""
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{0}</title></head>
<body><pre>{1}</pre></body></html>
"""
"""The documentation of an FMU."""


@dataclasses.dataclass(frozen=True)
class WrittenFmu:
    """An FMU that has been written.

    platforms  the folders of its binaries, such as `linux64`; none for an FMU that contains sources only
    remark     why there is no binary; empty if there is one
    """

    path: Path
    platforms: tuple[str, ...]
    remark: str


@dataclasses.dataclass(frozen=True, eq=False)
class FmuPackage:
    """An FMU without its binary.

    provenance  lines of the comment at the beginning of each file
    sources     C sources and headers by name, without those of the standard
    adjoint     whether the instance has adjoint derivatives
    related     inputs.csv and results.csv, reference data of run.exp and the manifest of FMI-LS-REF; or none
    """

    about: FmuDescription
    provenance: Sequence[str]
    sources: Mapping[str, str]
    adjoint: bool = False
    related: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def files(self, fmi: int) -> dict[str, bytes]:
        """The files by their paths in the FMU."""
        name, places = self.about.name, {"provenance": block_comment(self.provenance), "file": self.about.name}
        page = PAGE.format(html.escape(self.about.title), html.escape("\n".join(self.provenance)))
        files = {"modelDescription.xml": self.about.text(fmi), "documentation/index.html": page}
        texts = {**self.sources, **{file: template(f"fmi/{file}") for file in HEADERS[fmi]}}
        if fmi == 3:  # FMI 2.0 has no terminals
            places["adjoint"] = filled("adjoint.h", {}, name) if self.adjoint else ""
            texts["fmi3_absent.h"] = filled("fmi3_absent.h", {}, name)
            texts["buildDescription.xml"] = _build_description(name, self.about.units(fmi))
            files["terminalsAndIcons/terminalsAndIcons.xml"] = self.about.terminals()
        texts[f"fmi{fmi}.c"] = filled(f"fmi{fmi}.c", places, name)
        files |= {f"sources/{file}": text for file, text in texts.items()}
        if self.related:
            span = {key: repr(value) for key, value in dataclasses.asdict(self.about.experiment).items()}
            run = filled("run.exp", {**span, "title": html.escape(self.about.title)}, name)
            texts = {**self.related, "run.exp": run, "fmi-ls-manifest.xml": template("fmi-ls-manifest.xml")}
            files |= {f"{REFERENCES}/{file}": text for file, text in texts.items()}
        return {file: text.encode("utf-8", "replace") for file, text in files.items()}

    def write(
        self, path: str | Path, fmi: int, binary: bool = True, platforms: Sequence[Platform] = ()
    ) -> WrittenFmu:  # fmt: skip
        """Write the FMU, with binaries for this machine or for platforms. Raises ParameterError and FileError."""
        content, folders, remark = self.content(fmi, binary, platforms)
        return write_archive(path, content, folders, remark)

    def content(
        self, fmi: int, binary: bool = True, platforms: Sequence[Platform] = ()
    ) -> tuple[bytes, list[str], str]:
        """The bytes of the FMU, the folders of its binaries, and why there are none; without platforms the binary is
        that of this machine, if it can be compiled."""
        files, name, folders, remark = self.files(fmi), self.about.name, list[str](), "" if binary else NOT_REQUESTED
        sources = {file.removeprefix("sources/"): text for file, text in files.items() if file.startswith("sources/")}
        for target in (platforms or [this_platform()]) if binary else ():
            try:
                library = target.compile(sources, self.about.units(fmi), name)
            except ParameterError as reason:
                if platforms:
                    raise
                remark = str(reason)
            else:
                folders.append(target.folder(fmi))
                files[f"binaries/{folders[-1]}/{name}{target.suffix}"] = library
        return archive(files, "modelDescription.xml"), folders, remark


def write_archive(path: str | Path, content: bytes, folders: Sequence[str], remark: str) -> WrittenFmu:
    """Write the bytes of an FMU or of a package of FMUs. Raises FileError."""
    target = Path(path)
    with atomic_folder(target.parent) as staging:
        (staging / target.name).write_bytes(content)
    return WrittenFmu(target, tuple(folders), remark)


def check_target(path: str | Path, fmi: int, suffix: str = ".fmu") -> Path:
    """The path of a file to write. Raises ParameterError for a version that FMI has not, and for another suffix."""
    target = Path(path)
    if fmi not in VERSIONS:
        raise ParameterError(f"FMI {fmi} is not supported; allowed: 2 or 3.")
    if target.suffix != suffix:
        raise ParameterError(f"'{target.name[:80]}' must end in {suffix}, as importers expect.")
    return target


def token_of(*content: object) -> str:
    """The text that an importer passes on, so that description and binary belong together: a hash of the content."""
    return f"{{{hashlib.sha256(json.dumps([str(each) for each in content]).encode()).hexdigest()[:32]}}}"


def archive(files: Mapping[str, bytes], first: str) -> bytes:
    """A ZIP file of these files, with the description first; all times are those that ZIP begins with."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as zipped:
        for file in sorted(files, key=lambda file: (file != first, file)):
            entry = zipfile.ZipInfo(file)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            zipped.writestr(entry, files[file])
    return buffer.getvalue()


def _build_description(name: str, units: Sequence[str]) -> str:
    lines = "".join(f'      <SourceFile name="{unit}"/>\n' for unit in units)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'  <BuildConfiguration modelIdentifier="{name}">\n    <SourceFileSet language="C99">\n{lines}'
        "    </SourceFileSet>\n  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )
