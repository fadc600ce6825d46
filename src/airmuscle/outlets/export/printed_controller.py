"""Printed control law: a sample of it as a C99 function of its memory, and its replay by the
printed operations.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import Array, Leaf, Node, ParameterError, leaves, nodes
from ...engine import ControlLaw
from ...engine.compile.functions import Printer
from ...engine.compile.ir import emission
from ...engine.compile.ir.emission import TargetLanguage
from ...engine.compile.ir.instructions import instructions
from ...engine.compile.ir.interpreter import InterpretedBody
from ...engine.compile.text.languages import CLanguage
from ...engine.run.compiled_law import trace_sample
from ...engine.run.sampled_loop import SampledLoop
from .identifiers import (
    block_comment,
    c_number,
    c_strings,
    c_values,
    filled,
    make_identifiers,
    provenance,
    with_cmake,
)
from .parameter_bounds import ParameterBounds
from .printed_system import find_leaf, make_labels

SINGLE_TOLERANCE = 1e-4
"""Part of its range by which a command in single precision may differ from that in double precision
(chosen).
"""


@dataclasses.dataclass(frozen=True, eq=False)
class PrintedController:
    """A control law as expressions of measurement, set point, memory and tunable parameters."""

    name: str
    law: ControlLaw
    inputs: dict[str, Any]
    outputs: dict[str, Any]
    ranges: Sequence[tuple[float, float]]
    tunable: tuple[Leaf, ...]
    provenance: Sequence[str]
    number: str = "double"
    """Type of all numbers in C, double or float."""
    tolerance: float = 0.0
    """Part of its range by which a command of the replay may differ; 0: no bit differs."""

    @property
    def initial_memory(self) -> Array:
        """The memory at the first sample."""
        return np.array([float(value) for value in self.law.initial_memory.values()])

    @property
    def paths(self) -> tuple[str, ...]:
        """The paths of the tunable parameters."""
        return tuple(leaf.path for leaf in self.tunable)

    @property
    def defaults(self) -> Array:
        """The values of the tunable parameters."""
        return np.array([leaf.value for leaf in self.tunable], dtype=float)

    @property
    def bounds(self) -> ParameterBounds:
        """The bounds of the tunable parameters."""
        return ParameterBounds.of(self.tunable)

    @property
    def places(self) -> dict[str, str]:
        """The places of a header: numbers of memories, measurements and so on, enumerations,
        provenance.
        """
        keys = ("memory", "measurements", "setpoints", "commands", "parameters")
        counts = {
            key: str(len(names)) for key, names in zip(keys, self._kinds.values(), strict=True)
        }
        rows = {
            kind: enumerate(make_identifiers(names)) for kind, names in self._kinds.items() if names
        }
        words = [
            [f"{self.name}_{kind}_{word}".upper() + f" = {i}" for i, word in row]
            for kind, row in rows.items()
        ]
        enumerations = "".join(
            f"enum {{ {', '.join(words_of_kind)} }};\n" for words_of_kind in words
        )
        return counts | {
            "provenance": block_comment(self.provenance),
            "file": self.name,
            "enumerations": enumerations,
            "number": self.number,
            "initial_memory": c_values(self.initial_memory, 1, self.number),
            "parameter_values": c_values(self.defaults, 1, self.number),
            "parameter_names": c_strings(self.paths),
            **self.bounds.c_places(self.name, self.number),
        }

    def source_files(self) -> dict[str, str]:
        """Header and source, by file name."""
        places = {
            **self.places,
            "functions": self.sample_in(CLanguage(self.number, f"{self.name}_")),
        }
        return {
            f"{self.name}.{end}": filled(f"controller.{end}", places, self.name) for end in "hc"
        }

    def sample_in(self, language: TargetLanguage) -> str:
        """The function of a sample in another language; its arguments are measurement, set point,
        memory, parameters, and the arrays of the command and of the later memory, which MATLAB
        returns."""
        law = self.law
        names = {
            "measurement": law.measured_columns,
            "setpoint": [f"{name} set point" for name in law.setpoints],
            "memory": [f"memory {name}" for name in law.initial_memory],
            "command": law.inputs,
            "later": [f"next {name}" for name in law.initial_memory],
        }
        rows = {array: [(name, "", "") for name in signals] for array, signals in names.items()}
        of_law = [(leaf.path, leaf.declared.unit, leaf.declared.meaning) for leaf in self.tunable]
        labels = make_labels({**rows, "parameters": of_law})
        printer = Printer(dataclasses.replace(language, labels=labels))  # type: ignore[type-var]
        code = instructions(list(self.inputs.values()), list(self.outputs.values()))
        printer.add_code("sample", list(self.inputs), code, list(self.outputs))
        return printer.text[-1]

    def files(self, measured: Array, setpoints: Array, commands: Array) -> dict[str, str]:
        """Header, source and the program that replays measurements (K, m), set points (K, s) and
        commands (K, c) of a run, by file name."""
        number = self.number
        precision = "single" if self.tolerance else "double"
        limits = {
            "tolerance": c_number(self.tolerance),
            "ranges": c_values(self.ranges_of(commands), 1),
        }
        places = {
            "provenance": block_comment(self.provenance),
            "file": self.name,
            "samples": str(len(measured)),
            "number": number,
            "about": filled(f"about_{precision}.c", {}, self.name),
            "measured": c_values(measured, 1, number),
            "setpoints": c_values(setpoints, 1, number),
            "commands": c_values(commands, 1),
            "comparison": filled(f"replay_{precision}.c", limits, self.name),
        }
        return with_cmake(
            self.name, {**self.source_files(), "main.c": filled("replay.c", places, self.name)}
        )

    def arduino_files(self, sample_time: float, setpoints: Sequence[float]) -> dict[str, str]:
        """An Arduino library: properties, header and source in `src`, and an example sketch with
        the sample time [s] and the set points (s,) at the beginning of the run, by path."""
        name = self.name
        measured, points, commands = (
            [f"[{name}_{kind}_{word}]".upper() for word in make_identifiers(self._kinds[kind])]
            for kind in ("MEASUREMENT", "SETPOINT", "COMMAND")
        )
        places = {
            "provenance": block_comment(self.provenance),
            "file": name,
            "number": self.number,
            "period": str(round(1e6 * sample_time)),
            "law": type(self.law).__name__,
            "sample_time": f"{sample_time:g}",
            "reads": "\n".join(
                f"  measurement{word} = 0; /* scale and offset of analogRead(A{i}) */"
                for i, word in enumerate(measured)
            ),
            "writes": "\n".join(
                f"  (void)command{word}; /* {low!r} to {high!r}: analogWrite, say */"
                for word, (low, high) in zip(commands, self.ranges, strict=True)
            ),
            "setpoints": "\n".join(
                f"  setpoint{word} = {c_number(level, self.number)};"
                for word, level in zip(points, setpoints, strict=True)
            ),
        }
        return {
            "library.properties": filled("library.properties", places, name),
            **{f"src/{file}": text for file, text in self.source_files().items()},
            f"examples/{name}_loop/{name}_loop.ino": filled("sketch.ino", places, name),
        }

    def ranges_of(self, commands: Array) -> Array:
        """The width of the range of each command (c,); of one without limits its largest size in a
        run (K, c).
        """
        largest = np.abs(commands).max(axis=0, initial=0.0)
        width = np.array([high - low for low, high in self.ranges], dtype=float)
        return np.where(np.isfinite(width), width, np.where(largest > 0.0, largest, 1.0))

    @property
    def _kinds(self) -> dict[str, Sequence[str]]:
        """The names of the elements of the arrays, by the word of their enumeration."""
        return {
            "MEMORY": tuple(self.law.initial_memory),
            "MEASUREMENT": self.law.measured_columns,
            "SETPOINT": self.law.setpoints,
            "COMMAND": self.law.inputs,
            "PARAMETER": self.paths,
        }

    def replay(self, measured: Array, setpoints: Array, *, single: bool = False) -> Array:
        """The commands (K, c) to measurements (K, m) and set points (K, s), from the printed
        instructions themselves.

        single  every number is rounded to single precision
        """
        memory = self.initial_memory.tolist()
        parameters = self.defaults.tolist()
        code = instructions(list(self.inputs.values()), list(self.outputs.values()))
        rows = []
        names = list(self.inputs)
        for measurement, setpoint in zip(measured.tolist(), setpoints.tolist(), strict=True):
            arrays = {
                "measurement": measurement,
                "setpoint": setpoint,
                "memory": memory,
                "parameters": parameters,
            }
            body = InterpretedBody(arrays, single)
            values = emission.computed(body, code, names)
            for (output, index), value in values.items():
                body.store(list(self.outputs)[output], index, value)
            rows.append([body.stored["command", i] for i in range(len(self.law.inputs))])
            memory = [body.stored["later", i] for i in range(len(memory))]
        return np.array(rows)

    def check_single_precision(
        self, measured: Array, setpoints: Array, commands: Array, sample_time: float
    ) -> None:
        """Raise ParameterError where single precision changes a command of a run by more than
        SINGLE_TOLERANCE.
        """
        deviations = np.abs(
            self.replay(measured, setpoints, single=True) - commands
        ) / self.ranges_of(commands)
        wrong = np.argwhere(~(deviations <= SINGLE_TOLERANCE))
        if wrong.size:
            k, i = map(int, wrong[0])
            raise ParameterError(
                f"{type(self.law).__name__} in single precision: the command '{self.law.inputs[i]}'"
                f" differs by {deviations[k, i]:.2g} of its range from that in double precision,"
                f" {k * sample_time:.4g} s after the start of the run; {SINGLE_TOLERANCE:g} is"
                " allowed. Export it in double precision."
            )


def _limited_command(command: Node, least: float, most: float) -> Node:
    """A command within its range, whose ends may be infinite."""
    raised = nodes.where(command < least, least, command) if np.isfinite(least) else command
    return nodes.where(raised > most, most, raised) if np.isfinite(most) else raised


def print_controller(
    prepared: SampledLoop,
    name: str,
    title: str = "",
    tunable: Sequence[str] | None = (),
    number: str = "double",
    notes: Sequence[str] = (),
) -> PrintedController:
    """The control law of a prepared loop, with its sample time, ranges and fixed parameters as
    constants; the tunable ones (None: all) remain variables, and `notes` are further lines of the
    comment at the beginning.
    """
    loop = prepared.loop
    law = prepared.loop.controller
    assert isinstance(law, ControlLaw)
    sample = trace_sample(law)
    known = list(leaves(law))
    paths = [leaf.path for leaf in known] if tunable is None else dict.fromkeys(tunable)
    chosen = [find_leaf(law, known, path) for path in paths]
    p = nodes.symbols("parameters", len(chosen))
    parameters = [
        p[chosen.index(i)] if i in chosen else nodes.constant(leaf.value)
        for i, leaf in enumerate(known)
    ]
    ranges = [prepared.ranges[n] for n in law.inputs]
    low, high = ([limits[k] for limits in ranges] for k in (0, 1))
    old = [*sample.sample_time, *sample.minimum, *sample.maximum, *sample.parameters]
    new = [loop.sample_time, *low, *high, *parameters]
    results = nodes.replaced([*sample.commands, *sample.later], old, new)
    commands = results[: len(ranges)]
    later = results[len(ranges) :]
    limited = [
        _limited_command(command, *limits) for command, limits in zip(commands, ranges, strict=True)
    ]
    inputs = {
        "measurement": sample.measured,
        "setpoint": sample.setpoints,
        "memory": sample.memory,
        "parameters": p,
    }
    outputs = {"command": limited, "later": later}
    about = [
        f"Sample time {c_number(loop.sample_time)} s; set points"
        f" {', '.join(law.setpoints) or 'none'}; measured {', '.join(law.measured_columns)};"
        f" commanded {', '.join(law.inputs)}, limited to"
        f" {', '.join(f'{a!r} to {b!r}' for a, b in zip(low, high, strict=True))}."
    ]
    if loop.drivers:
        kinds = ", ".join(f"{key}: {value}" for key, value in loop.drivers.items())
        about.append(
            f"Not part of this program: the drivers between commands and openings ({kinds})."
        )
    lines = provenance(title or type(law).__name__, law, notes=[*about, *notes])
    tolerance = SINGLE_TOLERANCE if number == "float" else 0.0
    variables = tuple(known[i] for i in chosen)
    return PrintedController(
        name, law, inputs, outputs, ranges, variables, lines, number, tolerance
    )
