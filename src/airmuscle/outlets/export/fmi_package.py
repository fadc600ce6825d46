"""Functional Mock-up Units as files: modelDescription.xml of FMI 2.0 or 3.0, sources and binaries
in one ZIP file.
"""

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

from ...core import ParameterError
from ...engine.loop.control_loop import SETPOINT
from .compiler import Platform, this_platform
from .fmi_variables import Variable, add_units, has_unit
from .identifiers import LICENCE, block_comment, filled, template
from .write import write_files

_WORD = r"[A-Za-z_][A-Za-z0-9_]*(\[\d+\])?"
_STRUCTURED = re.compile(rf"{_WORD}(\.{_WORD})*|der\({_WORD}(\.{_WORD})*\)")
CATEGORIES = ("logStatusWarning", "logStatusError")
"""Categories of messages: a validity range that was left, and a failure."""


def xml_text(root: Element) -> str:
    """An element as the text of a file, indented."""
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def _kind(v: Variable) -> dict[str, str]:
    """Attributes of a variable that state what it is."""
    attributes = {
        "name": v.name,
        "valueReference": str(v.reference),
        "causality": v.causality,
        "variability": v.variability,
        "initial": v.initial,
        "description": v.description,
    }
    return {key: text for key, text in attributes.items() if text}


def _numbers(v: Variable) -> dict[str, str]:
    """Attributes of a variable that are numbers or units."""
    numbers = {"min": v.minimum, "max": v.maximum, "nominal": v.nominal, "start": v.start}
    attributes = {"unit": v.unit} if has_unit(v.unit) else {}
    for key, number in numbers.items():
        if number is not None and math.isfinite(number):
            attributes[key] = repr(float(number))
    return attributes


HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
"""Headers of the standard by version, with its 2-clause BSD licence in each."""


@dataclasses.dataclass(frozen=True)
class WrittenFmu:
    """An FMU that has been written.

    platforms  the folders of its binaries, such as `linux64`; none for an FMU that contains sources
               only
    remark     why there is no binary; empty if there is one
    """

    path: Path
    platforms: tuple[str, ...]
    remark: str


@dataclasses.dataclass(frozen=True, eq=False)
class FmuPackage:
    """An FMU without its binary.

    name          identifier of the model
    provenance    lines of the comment at the beginning of each file, of which the first is the
                  title
    token         text that an importer passes on, so that description and binary belong together
    dependencies  the value references of the states and inputs on which an unknown depends, by its
                  value reference
    indicators    number of event indicators
    experiment    the default one: startTime and stopTime [s], tolerance or stepSize of a sampled
                  controller [s]
    sources       C sources and headers by name, without those of the standard and of its functions
    has_states    whether it has states with derivatives, also adjoint ones, and can be used in
                  Model Exchange
    related       inputs.csv and results.csv, data of run.exp and the manifest of FMI-LS-REF
                  1.0.0-alpha.1; or none
    """

    name: str
    provenance: Sequence[str]
    token: str
    variables: Sequence[Variable]
    dependencies: Mapping[int, Sequence[int]]
    indicators: int
    experiment: Mapping[str, float]
    sources: Mapping[str, str]
    has_states: bool = True
    related: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def description(self, fmi: int) -> str:
        """The file modelDescription.xml."""
        structured = all(_STRUCTURED.fullmatch(v.name) for v in self.variables)
        tokens = {
            2: {"guid": self.token, "numberOfEventIndicators": str(self.indicators)},
            3: {"instantiationToken": self.token},
        }
        root = Element(
            "fmiModelDescription",
            {
                "fmiVersion": f"{fmi}.0",
                **tokens[fmi],
                "modelName": self.provenance[0],
                "generationTool": f"airmuscle {metadata.version('airmuscle')}",
                "license": " ".join(LICENCE),
                "variableNamingConvention": "structured" if structured else "flat",
            },
        )
        self._add_kinds(root, fmi)
        add_units(root, [v.unit for v in self.variables])
        categories = SubElement(root, "LogCategories")
        for name in CATEGORIES:
            SubElement(categories, "Category", name=name)
        SubElement(
            root, "DefaultExperiment", {key: repr(float(x)) for key, x in self.experiment.items()}
        )
        variables = SubElement(root, "ModelVariables")
        for v in self.variables:
            numbers = _numbers(v)
            if v.derivative_of is not None:
                numbers["derivative"] = str(
                    v.derivative_of + (1 if fmi == 2 else 0)
                )  # FMI 2.0 counts from 1
            if fmi == 2:
                SubElement(SubElement(variables, "ScalarVariable", _kind(v)), "Real", numbers)
            else:
                SubElement(variables, "Float64", {**_kind(v), **numbers})
        self._add_structure(SubElement(root, "ModelStructure"), fmi)
        return xml_text(root)

    def _add_kinds(self, root: Element, fmi: int) -> None:
        """The elements of Model Exchange and Co-Simulation, with what the FMU can."""
        if fmi == 2:
            can = [
                "canNotUseMemoryManagementFunctions",
                "canGetAndSetFMUstate",
                "canSerializeFMUstate",
            ]
            with_states = ["providesDirectionalDerivative"]
            stepping = ["canInterpolateInputs"]
        else:
            can = ["canGetAndSetFMUState", "canSerializeFMUState"]
            stepping = []
            with_states = ["providesDirectionalDerivatives", "providesAdjointDerivatives"]
        kinds = {"CoSimulation": ["canHandleVariableCommunicationStepSize"]}
        if self.has_states:
            can += with_states
            kinds = {"ModelExchange": [], "CoSimulation": [*kinds["CoSimulation"], *stepping]}
        for kind, more in kinds.items():
            attributes = {"modelIdentifier": self.name, **dict.fromkeys([*can, *more], "true")}
            element = SubElement(root, kind, attributes)
            if fmi == 2:
                files = SubElement(element, "SourceFiles")
                for file in self._units(2):
                    SubElement(files, "File", name=file)

    def _add_structure(self, structure: Element, fmi: int) -> None:
        """Outputs, rates and what is computed at the start, with the states and inputs on which
        they depend.
        """
        outputs = [v.reference for v in self.variables if v.causality == "output"]
        rates = [v.reference for v in self.variables if v.derivative_of is not None]
        calculated = [v.reference for v in self.variables if v.initial == "calculated"]
        unknowns = (
            ("Outputs", "Output", outputs),
            ("Derivatives", "ContinuousStateDerivative", rates),
            ("InitialUnknowns", "InitialUnknown", calculated),
        )
        first = 1 if fmi == 2 else 0  # FMI 2.0 counts from 1
        for group, element, references in unknowns:
            parent = SubElement(structure, group) if fmi == 2 and references else structure
            for reference in references:
                place = {"index" if fmi == 2 else "valueReference": str(first + reference)}
                known = " ".join(
                    str(first + k) for k in sorted(self.dependencies.get(reference, ()))
                )
                dependencies = {} if element == "InitialUnknown" else {"dependencies": known}
                SubElement(parent, "Unknown" if fmi == 2 else element, {**place, **dependencies})
        if fmi == 3:
            self._add_indicators(structure)

    def _add_indicators(self, structure: Element) -> None:
        """The event indicators, which FMI 2.0 counts alone."""
        for v in self.variables:
            if v.is_indicator:
                SubElement(structure, "EventIndicator", valueReference=str(v.reference))

    def _units(self, fmi: int) -> tuple[str, ...]:
        """The C sources that a compiler is given."""
        return (f"fmi{fmi}.c", *(file for file in self.sources if file.endswith(".c")))

    def terminals(self) -> str:
        """The file terminalsAndIcons.xml of FMI 3: buses of the signals that plant and controller
        exchange.
        """
        root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
        parent = SubElement(root, "Terminals")
        signals = [v for v in self.variables if v.causality in ("input", "output")]
        names = {
            "commands": [v.name for v in signals if (v.causality == "input") == self.has_states],
            "measurements": [
                v.name
                for v in signals
                if (v.causality == "output") == self.has_states and not v.name.startswith(SETPOINT)
            ],
            "setpoints": [v.name for v in signals if v.name.startswith(SETPOINT)],
        }
        for terminal, members in names.items():
            if members:
                bus = SubElement(parent, "Terminal", name=terminal, matchingRule="bus")
                for name in members:
                    attributes = {
                        "variableName": name,
                        "memberName": name,
                        "variableKind": "signal",
                    }
                    SubElement(bus, "TerminalMemberVariable", attributes)
        return xml_text(root)

    def files(self, fmi: int) -> dict[str, bytes]:
        """The files by their paths in the FMU."""
        name = self.name
        places = {"provenance": block_comment(self.provenance), "file": self.name}
        stated = {
            "title": html.escape(self.provenance[0]),
            "lines": html.escape("\n".join(self.provenance)),
        }
        page = filled("documentation.html", stated, name)
        files = {"modelDescription.xml": self.description(fmi), "documentation/index.html": page}
        texts = {**self.sources, **{file: template(f"fmi/{file}") for file in HEADERS[fmi]}}
        if fmi == 3:  # FMI 2.0 has no terminals
            places["adjoint"] = filled("adjoint.h", {}, name) if self.has_states else ""
            texts["fmi3_absent.h"] = filled("fmi3_absent.h", {}, name)
            sources = "\n".join(f'<SourceFile name="{unit}"/>' for unit in self._units(fmi))
            texts["buildDescription.xml"] = filled(
                "buildDescription.xml", {"file": name, "sources": sources}, name
            )
            files["terminalsAndIcons/terminalsAndIcons.xml"] = self.terminals()
        texts[f"fmi{fmi}.c"] = filled(f"fmi{fmi}.c", places, name)
        files |= {f"sources/{file}": text for file, text in texts.items()}
        if self.related:
            span = {key.removesuffix("Time"): repr(value) for key, value in self.experiment.items()}
            run = filled("run.exp", {**span, "title": html.escape(self.provenance[0])}, name)
            texts = {
                **self.related,
                "run.exp": run,
                "fmi-ls-manifest.xml": template("fmi-ls-manifest.xml"),
            }
            files |= {
                f"extra/org.fmi-standard.fmi-ls-ref/{file}": text for file, text in texts.items()
            }
        return {file: text.encode("utf-8", "replace") for file, text in files.items()}

    def content(
        self, fmi: int, binary: bool, platforms: Sequence[Platform]
    ) -> tuple[bytes, list[str], str]:
        """The bytes of the FMU, the folders of its binaries, and why there are none; without
        platforms the binary is that of this machine, if it can be compiled. Raises ParameterError
        and FileError."""
        files = self.files(fmi)
        name = self.name
        folders = list[str]()
        remark = "" if binary else "none was requested"
        sources = {
            file.removeprefix("sources/"): text
            for file, text in files.items()
            if file.startswith("sources/")
        }
        for target in (platforms or [this_platform()]) if binary else ():
            try:
                library = target.compile(sources, self._units(fmi), name)
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
    return WrittenFmu(write_files({target.name: content}, target.parent)[0], tuple(folders), remark)


def check_target(path: str | Path, fmi: int, suffix: str = ".fmu") -> Path:
    """The path of a file to write. Raises ParameterError for a version that FMI has not, and for
    another suffix.
    """
    target = Path(path)
    if fmi not in HEADERS:
        raise ParameterError(f"FMI {fmi} is not supported; allowed: 2 or 3.")
    if target.suffix != suffix:
        raise ParameterError(f"'{target.name[:80]}' must end in {suffix}, as importers expect.")
    return target


def token_of(*content: object) -> str:
    """The text that an importer passes on, so that description and binary belong together: a hash
    of the content.
    """
    return f"{{{hashlib.sha256(json.dumps([str(part) for part in content]).encode()).hexdigest()[:32]}}}"  # noqa: E501


def archive(files: Mapping[str, bytes], first: str) -> bytes:
    """A ZIP file of these files, with the description first; all times are those that ZIP begins
    with.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as zipped:
        for file in sorted(files, key=lambda file: (file != first, file)):
            entry = zipfile.ZipInfo(file)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            zipped.writestr(entry, files[file])
    return buffer.getvalue()
