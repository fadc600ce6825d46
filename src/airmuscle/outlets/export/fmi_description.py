"""Description of an FMU: the file modelDescription.xml of FMI 2.0 and 3.0."""

import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from importlib import metadata
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ...engine.loop.control_loop import SETPOINT
from .fmi_variables import Variable, add_units, has_unit
from .identifiers import LICENCE

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
        program = metadata.version("airmuscle")
        structured = all(_STRUCTURED.fullmatch(v.name) for v in self.variables)
        common = {
            "modelName": self.title, "generationTool": f"airmuscle {program}", "license": " ".join(LICENCE),
            "variableNamingConvention": "structured" if structured else "flat",
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
        derivatives = {"providesDirectionalDerivative": "true"} if self.has_states else {}
        interpolation = {"canInterpolateInputs": "true"} if self.has_states else {}
        stepping = {"canHandleVariableCommunicationStepSize": "true", **interpolation}
        for kind, more in (("ModelExchange", {}), ("CoSimulation", stepping))[0 if self.has_states else 1 :]:
            files = SubElement(SubElement(root, kind, {**can, **derivatives, **more}), "SourceFiles")
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
        can = {
            "modelIdentifier": self.name, "canGetAndSetFMUState": "true", "canSerializeFMUState": "true",
        }  # fmt: skip
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
        for v in self.variables:
            if v.is_indicator:
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
        known = self.dependencies.get(reference, ())
        return {"dependencies": " ".join(str(k + offset) for k in sorted(known))}


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
