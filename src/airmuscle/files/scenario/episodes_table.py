"""Table [episodes] of a scenario: the record from which its arm was identified, with what the
prediction of later episodes needs.

It is written by airmuscle fit-joint, and read by predict; docs/guides/prediction.md has its keys.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...bench.joint import EpisodeMapping, IdentifiedArm, RegulatorLag
from ...bench.joint.episode_files import mapping_of, mapping_tables
from ...core import ParameterError
from ...physics import Plant, PressureDriven, ProportionalRegulator, SecondOrderLag
from ..library import Location, build_plant, custom_field, located_errors
from ..library.files import read_table
from .scenario import scenario_tables
from .values import Number, required_table, table_reader

EPISODES = "episodes"
"""Name of the table."""
REFIT = (
    "write it with this version: airmuscle fit-joint EPISODES --mapping MAPPING.toml, whose"
    " DIR/scenario.toml states the record"
)


def read_record_mapping(value: Any, plant: Plant, where: Location) -> EpisodeMapping:
    """The mapping of the record. Raises FileError, ParameterError or UnitError."""
    return mapping_of(read_table(value, plant, where), where)


@dataclasses.dataclass(frozen=True)
class EpisodesTable:
    """Table [episodes] of a scenario, the record of an identified arm."""

    delay: int
    judged: int
    columns: tuple[int, ...]
    pairs: tuple[tuple[int, ...], ...]
    gains: tuple[float, ...]
    zeros: tuple[float, ...]
    angles: tuple[tuple[float, ...], ...]
    pressures: tuple[tuple[float, ...], ...]
    deviation: tuple[float, ...]
    band: tuple[tuple[float, ...], ...]
    sample_time: float = custom_field(Number("s", positive=True), "sample time of the record")
    regulators: tuple[RegulatorLag, ...] = ()
    mapping: EpisodeMapping | None = custom_field(
        read_record_mapping, "how the record was read, as in a mapping file", default=None
    )

    def check(self, plant: Plant) -> None:
        """Raise ParameterError where numbers of the table do not belong to the plant."""
        joints = len(plant.mechanism.coordinates)
        muscles = len(plant.muscles)
        lengths = {
            "columns": (self.columns, muscles),
            "gains": (self.gains, muscles),
            "zeros": (self.zeros, muscles),
            "pressures": (self.pressures, muscles),
            "pairs": (self.pairs, joints),
            "angles": (self.angles, joints),
            "deviation": (self.deviation, joints),
        }
        for name, (values, count) in lengths.items():
            if len(values) != count:
                raise ParameterError(
                    f"{name} has {len(values)} entries; {count} are needed, because the plant has"
                    f" {muscles} muscles and {joints} coordinates."
                )
        numbers = sorted(self.columns)
        if numbers != list(range(1, muscles + 1)) or sorted(sum(self.pairs, ())) != numbers:
            raise ParameterError(
                f"columns are {list(self.columns)} and pairs {[list(pair) for pair in self.pairs]};"
                f" each must name the pressures 1 to {muscles} once."
            )
        if not self.band or any(len(row) != joints for row in self.band):
            raise ParameterError(f"band must have rows of {joints} half widths [rad].")


def arm_record(arm: IdentifiedArm) -> dict[str, Any]:
    """The table [episodes] of an arm."""
    table = {
        "sample_time": arm.sample_time,
        "delay": arm.delay,
        "judged": arm.judged,
        "columns": arm.columns,
        "pairs": arm.pairs,
        "gains": arm.gains,
        "zeros": arm.zeros,
        "angles": arm.angles.tolist(),
        "pressures": arm.pressures.tolist(),
        "deviation": arm.deviation.tolist(),
        "band": arm.band.tolist(),
    }
    if arm.mapping is not None:
        table["mapping"] = mapping_tables(arm.mapping)
    if arm.regulators:
        table["regulators"] = [dataclasses.asdict(regulator) for regulator in arm.regulators]
    return table


def arm_file(path: str | Path) -> Path:
    """The scenario of an identified arm: the path, or the scenario in its folder."""
    path = Path(path)
    inside = path / "scenario.toml"
    return inside if path.is_dir() and inside.is_file() else path


def is_identified_arm(tables: Mapping[str, Any]) -> bool:
    """Whether the tables of a file are those of an arm identified from episodes."""
    return EPISODES in tables


def load_arm(path: str | Path) -> IdentifiedArm:
    """The identified arm in a scenario that fit-joint has written, or in its folder.

    Raises FileError, ParameterError, UnitError or UnknownNameError with the location.
    """
    tables, location = scenario_tables(arm_file(path))
    if not is_identified_arm(tables):
        raise ParameterError(
            f"{location}: the table [{EPISODES}] is missing, which states the record of the arm;"
            f" {REFIT}."
        )
    required_table(tables, "plant", location)
    plant = build_plant(tables["plant"], location.inside("plant"))
    place = location.inside(EPISODES)
    table: EpisodesTable = table_reader(plant).build(tables[EPISODES], place, kind=EpisodesTable)
    with located_errors(place):
        table.check(plant)
    return IdentifiedArm(
        PressureDriven(plant.muscles, plant.mechanism, _lags(plant, location)),
        table.columns,
        tuple((raising, lowering) for raising, lowering in table.pairs),
        table.gains,
        table.zeros,
        table.sample_time,
        table.delay,
        np.array(table.angles),
        np.array(table.pressures),
        np.array(table.deviation),
        np.array(table.band),
        table.judged,
        table.regulators,
        table.mapping,
    )


def _lags(plant: Plant, location: Location) -> tuple[float, ...]:
    """Time constants [s] of the pressures, which the regulators of the plant have."""
    circuits = plant.circuit if isinstance(plant.circuit, tuple) else (plant.circuit,)
    lags = []
    for circuit in circuits:
        if not isinstance(circuit, ProportionalRegulator) or not isinstance(
            circuit.lag, SecondOrderLag
        ):
            raise ParameterError(
                f"{location.inside('plant')}: the arm of a prediction has a ProportionalRegulator"
                f" with a SecondOrderLag for each muscle; {REFIT}."
            )
        lags.append(1 / (2 * np.pi * circuit.lag.frequency))
    return tuple(lags)
