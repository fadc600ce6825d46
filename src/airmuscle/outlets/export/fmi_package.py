"""Functional Mock-up Units as files: modelDescription.xml of FMI 2.0 or 3.0, sources and binaries in one ZIP file."""

import dataclasses
import hashlib
import html
import io
import json
import math
import re
import zipfile
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ...core import ParameterError, atomic_folder
from ...engine.loop.control_loop import SETPOINT
from .compiler import Platform, this_platform
from .fmi_variables import Variable, add_units, has_unit
from .identifiers import LICENCE, block_comment, filled, template

_WORD = r"[A-Za-z_][A-Za-z0-9_]*(\[\d+\])?"
_STRUCTURED = re.compile(rf"{_WORD}(\.{_WORD})*|der\({_WORD}(\.{_WORD})*\)")
CATEGORIES = ("logStatusWarning", "logStatusError")
"""Categories of messages: a validity range that was left, and a failure."""


@dataclasses.dataclass(frozen=True)
class FmuExperiment:
    """The default experiment: times [s], relative tolerance, and the step of a sampled controller [s]; 0: none."""

    start: float
    stop: float
    tolerance: float = 0.0
    step: float = 0.0


@dataclasses.dataclass(frozen=True, eq=False)
class FmuDescription:
    """What modelDescription.xml states of an FMU.

    name       identifier of the model
    token      text that an importer passes on, so that description and binary belong together
    dependencies  the value references of the states and inputs on which an unknown depends, by its value reference
    indicators  number of event indicators
    sources    C sources next to that of the functions of FMI
    has_states  whether it has states and derivatives, and can be used in Model Exchange
    """

    name: str
    title: str
    token: str
    variables: Sequence[Variable]
    dependencies: Mapping[int, Sequence[int]]
    indicators: int
    experiment: FmuExperiment
    sources: tuple[str, ...] = ()
    has_states: bool = True

    def units(self, version: int) -> tuple[str, ...]:
        """The C sources that a compiler is given."""
        return (f"fmi{version}.c", *self.sources)

    def text(self, version: int) -> str:
        """The file for FMI 2 or 3."""
        return xml_text((self._fmi2 if version == 2 else self._fmi3)())

    def terminals(self) -> str:
        """The file terminalsAndIcons.xml of FMI 3: buses of the signals that plant and controller exchange."""
        root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
        parent = SubElement(root, "Terminals")
        signals = [v for v in self.variables if v.causality in ("input", "output")]
        names = {
            "commands": [v.name for v in signals if (v.causality == "input") == self.has_states],
            "measurements": [v.name for v in signals if (v.causality == "output") == self.has_states
                             and not v.name.startswith(SETPOINT)],
            "setpoints": [v.name for v in signals if v.name.startswith(SETPOINT)],
        }  # fmt: skip
        for terminal, members in names.items():
            if members:
                bus = SubElement(parent, "Terminal", name=terminal, matchingRule="bus")
                for name in members:
                    attributes = {"variableName": name, "memberName": name, "variableKind": "signal"}
                    SubElement(bus, "TerminalMemberVariable", attributes)
        return xml_text(root)

    def _root(self, attributes: Mapping[str, str]) -> Element:
        structured = all(_STRUCTURED.fullmatch(v.name) for v in self.variables)
        common = {
            "modelName": self.title, "generationTool": f"airmuscle {metadata.version('airmuscle')}",
            "license": " ".join(LICENCE), "variableNamingConvention": "structured" if structured else "flat",
        }  # fmt: skip
        return Element("fmiModelDescription", {**attributes, **common})

    def _variables(self, root: Element) -> Element:
        """The element of the variables, after units, categories of messages, and experiment."""
        add_units(root, [v.unit for v in self.variables])
        categories, given = SubElement(root, "LogCategories"), self.experiment
        for name in CATEGORIES:
            SubElement(categories, "Category", name=name)
        attributes = {"startTime": given.start, "stopTime": given.stop}
        attributes |= {key: x for key, x in (("tolerance", given.tolerance), ("stepSize", given.step)) if x}
        SubElement(root, "DefaultExperiment", {key: repr(float(x)) for key, x in attributes.items()})
        return SubElement(root, "ModelVariables")

    def _fmi2(self) -> Element:
        root = self._root({"fmiVersion": "2.0", "guid": self.token, "numberOfEventIndicators": str(self.indicators)})
        can = {
            "modelIdentifier": self.name, "canNotUseMemoryManagementFunctions": "true", "canGetAndSetFMUstate": "true",
            "canSerializeFMUstate": "true",
        }  # fmt: skip
        stepping = {"canHandleVariableCommunicationStepSize": "true"}
        kinds = {"CoSimulation": stepping}
        if self.has_states:
            can["providesDirectionalDerivative"] = "true"
            kinds = {"ModelExchange": {}, "CoSimulation": {**stepping, "canInterpolateInputs": "true"}}
        for kind, more in kinds.items():
            files = SubElement(SubElement(root, kind, {**can, **more}), "SourceFiles")
            for file in self.units(2):
                SubElement(files, "File", name=file)
        variables = self._variables(root)
        for v in self.variables:
            scalar = SubElement(variables, "ScalarVariable", _kind(v))
            derivative = {} if v.derivative_of is None else {"derivative": str(v.derivative_of + 1)}
            SubElement(scalar, "Real", {**_numbers(v), **derivative})
        structure = SubElement(root, "ModelStructure")
        for group, references in zip(("Outputs", "Derivatives", "InitialUnknowns"), self._unknowns, strict=True):
            parent = SubElement(structure, group) if references else structure
            for reference in references:
                given = self._dependencies(reference, 1) if group != "InitialUnknowns" else {}
                SubElement(parent, "Unknown", {"index": str(reference + 1), **given})
        return root

    def _fmi3(self) -> Element:
        root = self._root({"fmiVersion": "3.0", "instantiationToken": self.token})
        can = {"modelIdentifier": self.name, "canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
        if self.has_states:
            can |= {"providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true"}
            SubElement(root, "ModelExchange", can)
        SubElement(root, "CoSimulation", {**can, "canHandleVariableCommunicationStepSize": "true"})
        variables = self._variables(root)
        for v in self.variables:
            derivative = {} if v.derivative_of is None else {"derivative": str(v.derivative_of)}
            SubElement(variables, "Float64", {**_kind(v), **_numbers(v), **derivative})
        structure = SubElement(root, "ModelStructure")
        elements = ("Output", "ContinuousStateDerivative", "InitialUnknown")
        for element, references in zip(elements, self._unknowns, strict=True):
            for reference in references:
                given = self._dependencies(reference, 0) if element != "InitialUnknown" else {}
                SubElement(structure, element, {"valueReference": str(reference), **given})
        for v in (each for each in self.variables if each.is_indicator):
            SubElement(structure, "EventIndicator", valueReference=str(v.reference))
        return root

    @property
    def _unknowns(self) -> tuple[list[int], list[int], list[int]]:
        """The value references of outputs, of rates, and of what is computed at the start."""
        return (
            [v.reference for v in self.variables if v.causality == "output"],
            [v.reference for v in self.variables if v.derivative_of is not None],
            [v.reference for v in self.variables if v.initial == "calculated"],
        )

    def _dependencies(self, reference: int, offset: int) -> dict[str, str]:
        """The states and inputs on which an unknown depends; of a state, itself."""
        return {"dependencies": " ".join(str(k + offset) for k in sorted(self.dependencies.get(reference, ())))}


def xml_text(root: Element) -> str:
    """An element as the text of a file, indented."""
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def _kind(v: Variable) -> dict[str, str]:
    """Attributes of a variable that state what it is."""
    given = {
        "name": v.name, "valueReference": str(v.reference), "causality": v.causality, "variability": v.variability,
        "initial": v.initial, "description": v.description,
    }  # fmt: skip
    return {key: text for key, text in given.items() if text}


def _numbers(v: Variable) -> dict[str, str]:
    """Attributes of a variable that are numbers or units."""
    numbers = {"min": v.minimum, "max": v.maximum, "nominal": v.nominal, "start": v.start}
    attributes = {key: repr(float(x)) for key, x in numbers.items() if x is not None and math.isfinite(x)}
    return ({"unit": v.unit} if has_unit(v.unit) else {}) | attributes


# The package

HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
"""Headers of the standard by version, with its 2-clause BSD licence in each."""


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
    related     inputs.csv and results.csv, data of run.exp and the manifest of FMI-LS-REF 1.0.0-alpha.1; or none
    """

    about: FmuDescription
    provenance: Sequence[str]
    sources: Mapping[str, str]
    adjoint: bool = False
    related: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def files(self, fmi: int) -> dict[str, bytes]:
        """The files by their paths in the FMU."""
        name, places = self.about.name, {"provenance": block_comment(self.provenance), "file": self.about.name}
        stated = {"title": html.escape(self.about.title), "lines": html.escape("\n".join(self.provenance))}
        page = filled("documentation.html", stated, name)
        files = {"modelDescription.xml": self.about.text(fmi), "documentation/index.html": page}
        texts = {**self.sources, **{file: template(f"fmi/{file}") for file in HEADERS[fmi]}}
        if fmi == 3:  # FMI 2.0 has no terminals
            places["adjoint"] = filled("adjoint.h", {}, name) if self.adjoint else ""
            texts["fmi3_absent.h"] = filled("fmi3_absent.h", {}, name)
            sources = "\n".join(f'<SourceFile name="{unit}"/>' for unit in self.about.units(fmi))
            texts["buildDescription.xml"] = filled("buildDescription.xml", {"file": name, "sources": sources}, name)
            files["terminalsAndIcons/terminalsAndIcons.xml"] = self.about.terminals()
        texts[f"fmi{fmi}.c"] = filled(f"fmi{fmi}.c", places, name)
        files |= {f"sources/{file}": text for file, text in texts.items()}
        if self.related:
            span = {key: repr(value) for key, value in dataclasses.asdict(self.about.experiment).items()}
            run = filled("run.exp", {**span, "title": html.escape(self.about.title)}, name)
            texts = {**self.related, "run.exp": run, "fmi-ls-manifest.xml": template("fmi-ls-manifest.xml")}
            files |= {f"extra/org.fmi-standard.fmi-ls-ref/{file}": text for file, text in texts.items()}
        return {file: text.encode("utf-8", "replace") for file, text in files.items()}

    def content(self, fmi: int, binary: bool, platforms: Sequence[Platform]) -> tuple[bytes, list[str], str]:
        """The bytes of the FMU, the folders of its binaries, and why there are none; without platforms the binary is
        that of this machine, if it can be compiled. Raises ParameterError and FileError."""
        files, name, folders = self.files(fmi), self.about.name, list[str]()
        remark = "" if binary else "none was requested"
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


def write_archive(target: Path, content: bytes, folders: Sequence[str], remark: str) -> WrittenFmu:
    """Write the bytes of an FMU or of a package of FMUs. Raises FileError."""
    with atomic_folder(target.parent) as staging:
        (staging / target.name).write_bytes(content)
    return WrittenFmu(target, tuple(folders), remark)


def check_target(path: str | Path, fmi: int, suffix: str = ".fmu") -> Path:
    """The path of a file to write. Raises ParameterError for a version that FMI has not, and for another suffix."""
    target = Path(path)
    if fmi not in HEADERS:
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
