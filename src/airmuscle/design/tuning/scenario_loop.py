"""Scenario of a control loop: its cases, the default ranges of its gains, and the same file with
other gains.
"""

import dataclasses
import math
import re
import tomllib
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...core import Leaf, ShortRepr, conversion, leaves, quantity
from ...core.errors import AirmuscleWarning, FileError, ParameterError, check_known
from ...engine.loop import ControlLoop, parameter_units
from ...files.library import Location, ParameterUncertainty, load_law, located_errors, write_text
from ...files.scenario import Scenario, build_scenario, path_keys, scenario_tables, signal_units
from ...physics.plant.plant import Plant
from .case import with_gains as controller_with_gains
from .perturbations import Perturbations, PerturbedFamily, muscle_paths, perturbed_family

SPAN = 10.0
"""Factor of the default range of a gain, below and above its present value (chosen)."""
ROUNDING = 1e-15
"""Relative difference by the conversion of a unit, within which a written gain is that which was
simulated.
"""
CONTROLLER_KEYS = ("input", "controller")
"""Keys of the controller in a scenario."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ScenarioLoop(ShortRepr):
    """A scenario file with a control loop whose gains are tuned: its path, text, tables and
    scenario.
    """

    path: Path
    text: str
    tables: Mapping[str, Any]
    scenario: Scenario

    @property
    def loop(self) -> ControlLoop:
        """The control loop of the scenario."""
        assert isinstance(self.scenario.problem.input, ControlLoop)
        return self.scenario.problem.input

    @property
    def location(self) -> Location:
        """The location of the file, for messages."""
        return Location.of_file(self.path)

    def family(self, perturbations: Perturbations, seed: int = 0) -> PerturbedFamily:
        """The cases of the perturbed plants, each with the initial state that the scenario gives
        it.
        """
        return perturbed_family(
            self.scenario.plant,
            self.loop,
            perturbations,
            initial_state=self.initial_state_of,
            uncertainties=self.uncertainties(),
            fitted=self.scenario.uncertainty,
            seed=seed,
        )

    def initial_state_of(self, plant: Plant) -> Mapping[str, float]:
        """The initial state that the scenario gives a plant of the same structure."""
        if plant is self.scenario.plant:
            return self.scenario.initial_state
        tables = {
            name: table for name, table in self.tables.items() if name != "uncertainty"
        }  # of the plant as fitted
        return build_scenario(tables, self.location, plant).initial_state

    def uncertainties(self) -> list[ParameterUncertainty | None]:
        """The uncertainty of each muscle, of the parameters that the scenario takes from the muscle
        file unchanged.
        """
        tables = self.tables["plant"].get("muscle", [])
        named = tables if isinstance(tables, list) else [tables]
        muscles = self.scenario.plant.muscles
        uncertainties: list[ParameterUncertainty | None] = [None] * len(muscles)
        for i, value in enumerate(
            named if len(named) == len(muscles) else []
        ):  # otherwise of a plant of the library
            name = value.get("library") if isinstance(value, Mapping) else value
            if not isinstance(name, str):
                continue
            with warnings.catch_warnings():
                warnings.simplefilter(
                    "ignore", AirmuscleWarning
                )  # it was issued when the scenario was loaded
                entry = load_law(self.path.parent / name if name.endswith(".toml") else name)
            if entry.uncertainty is not None:
                of_file, of_plant = (
                    {leaf.path: leaf.value for leaf in leaves(m)}
                    for m in (entry.muscle, muscles[i])
                )
                paths = muscle_paths(entry.uncertainty, "")
                uncertainties[i] = entry.uncertainty.part(
                    p in of_plant and of_file.get(p) == of_plant[p] for p in paths
                )
        return uncertainties

    def bounds(self, given: Sequence[str] = ()) -> dict[str, tuple[float, float]]:
        """The ranges [SI] of the tuned gains: those given as `gain=5 1/m:500 1/m`, or the default
        ranges.

        By default every gain (unit u/y) that is not 0 and every time (unit s) next to it that is
        not 0 and no filter is tuned, from a tenth of its present value to ten times it, within the
        declared range. Of a controller without such a gain, every parameter in the unit of the
        command or of the measured column that is not 0.
        """
        if given:
            return dict(self._read_bounds(text) for text in given)
        ranges = _default_ranges(list(leaves(self.loop.controller)))
        if not ranges:
            name = type(self.loop.controller).__name__
            raise ParameterError(
                f"{self.location.inside('input').inside('controller')}: no parameter of {name} with"
                " the unit u/y, u or y differs from 0; state the ranges of the gains as bounds."
            )
        return ranges

    def _read_bounds(self, text: str) -> tuple[str, tuple[float, float]]:
        path, equals, values = text.partition("=")
        low, colon, high = values.partition(":")
        if not (equals and colon):
            raise ParameterError(
                f"bounds '{text}' must be a gain, its minimum and its maximum: 'gain=5 1/m:500"
                " 1/m'."
            )
        known = {leaf.path: leaf for leaf in leaves(self.loop.controller)}
        path = path.strip()
        check_known(
            f"bounds '{text}': {type(self.loop.controller).__name__} has no parameter", path, known
        )
        unit = self.unit(known[path])
        ambient = self.scenario.plant.ambient.pressure
        read = list[float]()
        for value in (low, high):
            try:
                read.append(float(value))
            except ValueError:
                read.append(quantity(value, unit, ambient=ambient, where=f"bounds '{text}'"))
        return path, (read[0], read[1])

    def unit(self, leaf: Leaf) -> str:
        """The unit of a parameter of the controller or of a law inside it."""
        known = signal_units(self.scenario.plant, self.scenario.initial_state)
        return parameter_units(self.loop.controller, known)[leaf.path]

    def with_gains(self, gains: Mapping[str, float]) -> str:
        """The text of the file with other gains [SI]; all else, comments and units included, is
        unchanged.

        Raises ParameterError for a gain that the controller does not have, or a value that it does
        not accept.
        """
        import tomlkit

        controller_with_gains(self.loop.controller, gains)
        document = tomlkit.parse(self.text)
        known = {leaf.path: leaf for leaf in leaves(self.loop.controller)}
        for path, value in gains.items():
            *keys, last = (*CONTROLLER_KEYS, *path_keys(path))
            table: Any = document
            for key in keys:
                table = table[key]
            present = table[last] if isinstance(last, int) or last in table else None
            table[last] = _written(
                value, present, self.unit(known[path]), self.scenario.plant.ambient.pressure
            )
        return tomlkit.dumps(document)

    def save(self, gains: Mapping[str, float], path: Path) -> Path:
        """Write the file with other gains [SI]; the file is complete or unchanged.

        Files that the scenario names are relative to the new file. Raises FileError or, if these
        are not found there, what `load_scenario` raises.
        """
        text = self.with_gains(gains)
        self.check_target(path, text)
        return write_text(path, text)

    def check_target(self, path: Path, text: str = "") -> None:
        """Raise what `save` raises for a path that is a folder, or from which files of the scenario
        are not found.
        """
        if path.is_dir():
            raise FileError(f"{path}: is a folder; name a file in it.")
        with located_errors(f"{path} cannot take the place of {self.path}"):
            build_scenario(tomllib.loads(text or self.text), Location.of_file(path))


def load_scenario_loop(path: str | Path) -> ScenarioLoop:
    """The scenario file of a control loop.

    Raises FileError, ParameterError, UnitError or UnknownNameError with the location;
    ParameterError for a plant of the library, which is no file, and for a scenario without a
    controller.
    """
    tables, location = scenario_tables(path)
    scenario = build_scenario(tables, location)
    if not isinstance(scenario.problem.input, ControlLoop):
        raise ParameterError(
            f"{location}: there is no [input.controller]; give a controller with its gains,"
            " sample_time and setpoint. Of a plant of the library write a scenario file with"
            " [plant] library and [input.controller]."
        )
    return ScenarioLoop(Path(path), Path(path).read_bytes().decode("utf-8-sig"), tables, scenario)


def _default_ranges(known: Sequence[Leaf]) -> dict[str, tuple[float, float]]:
    """The ranges of the parameters that are tuned by default, by path."""
    nonzero = [leaf for leaf in known if leaf.value != 0.0]
    gains = [leaf for leaf in nonzero if leaf.declared.unit == "u/y"]
    gains = gains or [leaf for leaf in nonzero if leaf.declared.unit in ("u", "y")]
    laws = {leaf.path.rpartition(".")[0] for leaf in gains}
    times = [
        leaf
        for leaf in nonzero
        if leaf.declared.unit == "s"
        and "filter" not in leaf.path
        and leaf.path.rpartition(".")[0] in laws
    ]
    ranges = {}
    for leaf in (*gains, *times):
        low, high = sorted((leaf.value / SPAN, leaf.value * SPAN))
        smallest, greatest = leaf.declared.bounds
        ranges[leaf.path] = max(low, smallest), min(high, greatest)
    return ranges


def _written(value: float, present: Any, unit: str, ambient: float) -> Any:
    """A number [SI] in the form of the present entry: in the unit of its text, or as a number."""
    if not isinstance(present, str):
        return value
    written = re.sub(r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*", "", present)
    change = conversion(written, unit, ambient=ambient, where="gain")
    for digits in range(4, 18):
        number = f"{(value - change.offset) / change.factor:.{digits}g}"
        if math.isclose(change(float(number)), value, rel_tol=ROUNDING):
            break
    return f"{number} {written}".strip()
