"""Loops in recordings: what kind each is, which rows count, which runs repeat it, and the friction that explains it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...characteristic.base import Characteristic
from ...core.errors import IdentificationError
from ...recording import Recording
from ...recording.segment import (
    ISOBARIC,
    ISOMETRIC,
    Run,
    Sensor,
    estimate_sensors,
    find_runs,
    motion_direction,
    quasi_static_rows,
)
from ...recording.segment.runs import BAND, STROKE
from .fit import (
    ContractionPath,
    FixedCharacteristic,
    FrictionPath,
    PolynomialCurve,
    PressurePath,
    RowMask,
    StaticCurve,
    fit_hysteresis,
    initial_friction_laws,
    make_loop_series,
)
from .result import HysteresisFit


@dataclasses.dataclass(frozen=True, eq=False)
class HysteresisLoop:
    """One run that goes up and down: what is held, what rubs, the curve without friction, and the rows that count."""

    recording: Recording
    run: Run
    friction_path: FrictionPath
    static: StaticCurve
    fitted_rows: RowMask
    repeat: tuple[Recording, RowMask] | None = None
    """Another run of the same kind at the same level, which judges."""

    @property
    def description(self) -> str:
        """`isobaric at 300 kPa`, as the recording shows it."""
        if self.run.column is None or self.run.value is None:
            return self.run.kind.name
        shown = {"pressure": f"{self.run.value / 1e3:.4g} kPa", "force": f"{self.run.value:.4g} N",
                 "contraction": f"{self.run.value:.2%}"}  # fmt: skip
        return f"{self.run.kind.name} at {shown.get(self.run.column, f'{self.run.value:.4g} m')}"


@dataclasses.dataclass(frozen=True, eq=False)
class LoopFit:
    """All friction laws on one loop, the most telling first, and those that could not be fitted, with the reason."""

    loop: HysteresisLoop
    fits: tuple[HysteresisFit, ...]
    failed: Mapping[str, str]

    @property
    def recommended(self) -> HysteresisFit | None:
        """The law with the least AICc among those that the data justify; None where they justify none."""
        return next((fit for fit in self.fits if fit.justified), None)

    @property
    def usable_in_plant(self) -> bool:
        """Whether what rubs is the muscle's motion: friction on the pressure describes isometric loops only."""
        return isinstance(self.loop.friction_path, ContractionPath)


def find_loops(
    recordings: Sequence[Recording],
    *,
    characteristic: Characteristic | None = None,
    degree: int = 3,
    all_rows: bool = False,
) -> tuple[HysteresisLoop, ...]:
    """The loops in recordings, one for each kind and level; a second run at a level is the judge of the first.

    The curve without friction is a polynomial in what is swept, found along with the friction, or the
    `characteristic` with an offset. Rows count where the muscle pulls, no sensor is cut off and, unless `all_rows`,
    pressure and length are quiet. Raises IdentificationError for a run that does not come back, or is neither
    isobaric nor isometric while no characteristic is given.
    """
    sensed, found = estimate_sensors(recordings), list[HysteresisLoop]()
    for recording in recordings:
        loop = _make_loop(recording, sensed, characteristic, degree, all_rows)
        twin = next((i for i, other in enumerate(found) if _is_same_level(other.run, loop.run)), None)
        if twin is None:
            found.append(loop)
        elif found[twin].repeat is None:
            found[twin] = dataclasses.replace(found[twin], repeat=(recording, loop.fitted_rows))
    return tuple(found)


def _make_loop(
    recording: Recording, sensed: Mapping[str, Sensor], law: Characteristic | None, degree: int, all_rows: bool
) -> HysteresisLoop:
    longest = max(find_runs(recording, sensed), key=lambda run: len(run.stretch))
    slide: FrictionPath = PressurePath() if longest.kind is ISOMETRIC else ContractionPath()
    if law is not None:
        static: StaticCurve = FixedCharacteristic(law)
    elif longest.kind in (ISOBARIC, ISOMETRIC):
        static = PolynomialCurve("contraction" if longest.kind is ISOBARIC else "pressure", degree)
    else:
        raise IdentificationError(
            f"{recording.origin}: the run is {longest.kind.name}, so that pressure and contraction move together and "
            "no curve in one of them stands for the muscle without friction. Give its characteristic."
        )
    chosen = _select_rows(recording, sensed, all_rows)
    _check_two_directions(
        recording, motion_direction(slide.displacement(recording), recording.columns.get("time")), chosen
    )
    return HysteresisLoop(recording, longest, slide, static, chosen)


def _select_rows(recording: Recording, sensed: Mapping[str, Sensor], all_rows: bool) -> RowMask:
    force = recording["force"]
    pulls = (force > 0) & np.isfinite(force)
    if "force" in sensed:
        pulls &= sensed["force"].sides(force) == 0
    return pulls if all_rows else pulls & quasi_static_rows(recording, sensed)


def _check_two_directions(recording: Recording, way: np.ndarray, chosen: RowMask) -> None:
    for direction, word in ((1, "rises"), (-1, "falls")):
        rows, counting = np.count_nonzero(way == direction), np.count_nonzero((way == direction) & chosen)
        if not counting:
            less = f", and of the {rows} rows where it does none counts (quiet, pulling, not cut off)" if rows else ""
            raise IdentificationError(
                f"{recording.origin}: no branch along which the path {word}{less}: a loop goes up and down. Give a run "
                "that does, slower where its rows are not quiet, or let all rows count."
            )


def _is_same_level(one: Run, other: Run) -> bool:
    """Whether two runs hold the same quantity at the same level, as closely as one run holds it."""
    if one.kind is not other.kind or one.column != other.column or one.value is None or other.value is None:
        return False
    band = STROKE if one.column == "contraction" else BAND * max(abs(one.value), abs(other.value))
    return abs(one.value - other.value) <= band


def fit_loop(loop: HysteresisLoop, *, elements: int = 8, progress: Callable[[str], None] | None = None) -> LoopFit:
    """Every friction law fitted to a loop, by AICc. `progress` is called with the name of each law."""
    plain = make_loop_series(loop.recording, loop.static, loop.friction_path, loop.fitted_rows)
    fits, failed = list[HysteresisFit](), dict[str, str]()
    for start in initial_friction_laws(plain.path[loop.fitted_rows], plain.fitted_residuals(None), elements):
        name = type(start).__name__
        if progress is not None:
            progress(name)
        try:
            fits.append(
                fit_hysteresis(start, loop.recording, static=loop.static, slide=loop.friction_path, chosen=loop.fitted_rows,
                               repeat=loop.repeat)
            )  # fmt: skip
        except IdentificationError as error:
            failed[name] = str(error)
    return LoopFit(loop, tuple(sorted(fits, key=lambda fit: -fit.aicc_gain)), failed)
