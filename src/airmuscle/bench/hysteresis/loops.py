"""Hysteresis loops found in recordings, their rows and repeated runs, and the fit of all friction
laws to one.
"""

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...core import AirmuscleWarning, Array, Hint, HintedText, IdentificationError, check_whole
from ...physics import Characteristic, Friction, LoopScales
from ...physics.muscle import friction as laws
from ...recording import Recording, resting_length_of
from .. import inspection
from ..diagnosis import DataUse, support_of
from ..estimation import in_order
from ..inspection import CONTRACTION_BAND, RELATIVE_BAND, branch_name
from . import loop_data as data
from .loop_result import HysteresisLoop, LoopFit
from .result import HysteresisFit, assess_fit
from .search import LoopSeries, free_parameters, make_loop_series, search_parameters

CURVE_DEGREE = 5
"""Degree of the polynomial static curve of a loop, in `hysteresis` as in `campaign` (chosen)."""


def find_loops(
    recordings: Sequence[Recording],
    *,
    law: Characteristic | None = None,
    degree: int = CURVE_DEGREE,
    all_rows: bool = False,
) -> tuple[HysteresisLoop, ...]:
    """The loops in the runs of recordings, one for each kind and level; a second run at a level
    validates the first.

    Each run with both branches gives a loop; if a recording has several runs, the
    loop is named after the file and the rows of the run, and runs of one direction are left out. A
    muscle of another resting length or another specimen gives no repeat. A recording without a
    usable run is left out with an AirmuscleWarning if another one has a loop.

    The static curve is a polynomial of `degree` in the swept quantity, fitted with the friction, or
    `law` with an offset. The fitted rows have a positive force below the limit of the sensor and,
    unless `all_rows`, are quasi-static. Raises IdentificationError if no run gives a loop: each has
    one branch, or is neither isobaric nor isometric while no characteristic is given; and where the
    rows support no fit (`support_of`).
    """
    support_of(recordings).check(DataUse.FIT)
    sensors = inspection.estimate_sensors(recordings)
    loops = list[HysteresisLoop]()
    muscles = list[Sequence[object]]()
    empty = [recording.origin for recording in recordings if not len(recording)]
    failed = [
        IdentificationError(f"{origin}: the recording has no rows. Give one with a loop.")
        for origin in empty
    ]
    for recording, run in (
        pair for source in recordings if len(source) for pair in _separate_runs(source, sensors)
    ):
        try:
            loop = _make_loop(recording, run, sensors, law, degree, all_rows)
        except IdentificationError as error:
            failed.append(error)
            continue
        muscle = [resting_length_of(recording), recording.constants.get("specimen")]
        at_level = [i for i, earlier in enumerate(loops) if _is_same_level(earlier.run, run)]
        same = next((i for i in at_level if muscles[i] == muscle), None)
        if same is None:
            muscles.append(muscle)
            loops.append(loop)
        elif loops[same].repeat is None:
            loops[same] = dataclasses.replace(loops[same], repeat=(recording, loop.fitted_rows))
    if failed and not loops:
        raise failed[0]
    for reason in failed:
        warnings.warn(AirmuscleWarning(HintedText("left out: ", reason.message)), stacklevel=2)
    return tuple(loops)


def _separate_runs(
    recording: Recording, sensors: Mapping[str, inspection.Sensor]
) -> list[tuple[Recording, inspection.Run]]:
    """The runs of a recording with two directions and their rows, else the longest run; all rows of
    a single level.
    """
    runs = inspection.find_runs(recording, sensors)
    longest = max(runs, key=lambda run: len(run.interval))
    if all(_is_same_level(longest, run) for run in runs) or longest.kind not in (
        inspection.ISOBARIC,
        inspection.ISOMETRIC,
    ):
        return [(recording, longest)]
    parts = [(rows_of(recording, run.interval), run) for run in runs]
    both = [
        (part, run) for part, run in parts if {1.0, -1.0} <= set(_directions(part, _path_of(run)))
    ]
    return both or [(rows_of(recording, longest.interval), longest)]


def rows_of(recording: Recording, interval: inspection.Interval) -> Recording:
    """The rows of an interval, named after the file and the rows."""
    origin = f"{recording.origin}, rows {interval.start + 1} to {interval.stop}"
    return dataclasses.replace(recording.rows(interval.rows), origin=origin)


def _path_of(run: inspection.Run) -> data.FrictionPath:
    return data.PressurePath() if run.kind == inspection.ISOMETRIC else data.ContractionPath()


def _directions(recording: Recording, friction_path: data.FrictionPath) -> Array:
    return inspection.motion_direction(
        friction_path.displacement(recording), recording.columns.get("time")
    )


def _make_loop(
    recording: Recording,
    run: inspection.Run,
    sensors: Mapping[str, inspection.Sensor],
    law: Characteristic | None,
    degree: int,
    all_rows: bool,
) -> HysteresisLoop:
    friction_path = _path_of(run)
    if law is not None:
        static_curve: data.StaticCurve = data.FixedCharacteristic(law)
    elif run.kind in (inspection.ISOBARIC, inspection.ISOMETRIC):
        static_curve = data.PolynomialCurve(
            "contraction" if run.kind == inspection.ISOBARIC else "pressure", degree
        )
    else:
        raise IdentificationError(
            f"{recording.origin}: the run is {run.kind.name}, so pressure and contraction change"
            " together and the static curve cannot be a polynomial in one of them.",
            hint=Hint("To take the muscle's characteristic as the static curve", "law"),
        )
    force = recording["force"]
    transient = 0
    rows = (force > 0) & np.isfinite(force)
    if "force" in sensors:
        rows &= sensors["force"].censoring(force) == 0
    rows = rows if all_rows else rows & inspection.quasi_static_rows(recording, sensors)
    direction = _directions(recording, friction_path)
    varied = "pressure" if isinstance(friction_path, data.PressurePath) else "contraction"
    for sign in (1, -1):
        if not np.any((direction == sign) & rows):
            count = np.count_nonzero(direction == sign)
            excluded = (
                f" ({count} are excluded: not quasi-static, without force, or saturated)"
                if count
                else ""
            )
            raise IdentificationError(
                f"{recording.origin}: the {branch_name(varied, sign)} branch has no rows to"
                f" fit{excluded}, but a loop needs both branches, {branch_name(varied, 1)} and"
                f" {branch_name(varied, -1)}. Give such a run, or run it more slowly where its rows"
                " are not quasi-static.",
                hint=Hint("To fit all rows, if only the length changes quickly", "all_rows", True),
            )
    if (
        run.kind != inspection.ISOBARIC
    ):  # rows in which the pressure changes quickly, whatever the length does
        columns = {name: recording[name] for name in ("time", "pressure") if name in recording}
        steady = inspection.quasi_static_rows(
            dataclasses.replace(recording, columns=columns), sensors
        )
        transient = int(np.count_nonzero(rows & ~steady))
    return HysteresisLoop(recording, run, friction_path, static_curve, rows, transient)


def _is_same_level(run: inspection.Run, reference: inspection.Run) -> bool:
    """Whether two runs have the same constant quantity and level, within the tolerance of one
    run.
    """
    same_kind = run.kind is reference.kind and run.constant_column == reference.constant_column
    if not same_kind or run.constant_value is None or reference.constant_value is None:
        return False
    size = max(abs(run.constant_value), abs(reference.constant_value))
    bands = {"contraction": CONTRACTION_BAND, "length": CONTRACTION_BAND * size}
    band = bands.get(run.constant_column or "", RELATIVE_BAND * size)
    return abs(run.constant_value - reference.constant_value) <= band


def initial_friction_laws(
    path: Array, force: Array, elements: int = 8, others: Sequence[type[Friction]] = ()
) -> tuple[Friction, ...]:
    """Every law of `friction` with a `guess`, its initial parameters scaled by a path [m] and the
    forces [N] along it. `elements` is the number of elements of MaxwellSlip and PrandtlIshlinskii,
    `others` are classes of a user. Raises IdentificationError for a constant path, and for one of
    the `others` without a `guess`."""
    check_whole("initial_friction_laws", "elements", elements, 1)
    scales = LoopScales.of(path, force, elements)
    known = [
        cls
        for name in dir(laws)
        if isinstance(cls := getattr(laws, name), type) and issubclass(cls, Friction)
    ]
    started = {cls: cls.guess(scales) for cls in (*known, *others)}
    for cls in (law_type for law_type in others if started[law_type] is None):
        raise IdentificationError(
            f"{cls.__name__} is not started from data; define its guess(scales)."
        )
    return tuple(law for law in started.values() if law is not None)


def fit_hysteresis(
    friction: Friction,
    recording: Recording,
    *,
    static_curve: data.StaticCurve,
    friction_path: data.FrictionPath = data.ContractionPath(),
    fitted_rows: inspection.Mask | None = None,
    repeat: tuple[Recording, inspection.Mask | None] | None = None,
) -> HysteresisFit:
    """Fit a friction law to the difference between a loop and its static curve, and test whether
    the data justify it.

    friction       the law with its initial parameters, see `initial_friction_laws`
    static_curve   the force without friction; its coefficients are fitted with the friction, and
                   once more without it for a fair comparison
    friction_path  the displacement along which the friction slides
    fitted_rows    mask of the rows whose residuals are minimised: quasi-static rows with a positive
                   force. The path includes all rows from the first, where the bristles are relaxed
    repeat         a second run of the same loop with its mask, for the repeatability and the error
                   on other data

    Raises IdentificationError where there are too few rows or the path is constant.
    """
    run = make_loop_series(recording, static_curve, friction_path, fitted_rows)
    second_run = (
        make_loop_series(repeat[0], static_curve, friction_path, repeat[1]) if repeat else None
    )
    return fit_series(friction, run, second_run)


def fit_series(friction: Friction, run: LoopSeries, second_run: LoopSeries | None) -> HysteresisFit:
    """The fit of `fit_hysteresis` to the series of a run, and of a second run of the same loop."""
    free = free_parameters(friction)
    rows = int(run.fitted_rows.sum())
    length = float(np.ptp(run.path)) if run.path.size else 0.0
    if rows <= free + run.design_matrix.shape[1] + 2 or not length > 0:
        raise IdentificationError(
            f"{run.origin}: {rows} fitted rows along a path of {length:.3g} m cannot determine"
            f" {free} parameters of {type(friction).__name__} and {run.design_matrix.shape[1]} of"
            " the static curve. Give a run with both branches, or include more"
            " rows."
        )
    fitted, undetermined = search_parameters(friction, (run,))
    return assess_fit(fitted, undetermined, run, second_run)


def fit_loop(
    loop: HysteresisLoop,
    *,
    elements: int = 8,
    others: Sequence[type[Friction]] = (),
    progress: Callable[[str], None] | None = None,
) -> LoopFit:
    """Fit every friction law to a loop and sort the fits by AICc; laws with terms of speed need a
    speed that varies. `elements` and `others` are those of `initial_friction_laws`; `progress` is
    called with the name of each law.
    """
    run = dataclasses.replace(
        loop.series(loop.recording, loop.fitted_rows), transient_rows=loop.transient_rows
    )
    second_run = None if loop.repeat is None else loop.series(*loop.repeat)
    fits = list[HysteresisFit]()
    failed = dict[str, HintedText]()
    for initial in initial_friction_laws(
        run.path[loop.fitted_rows], run.fitted_residuals(None), elements, others
    ):
        name = type(initial).__name__
        too_uniform = (
            "" if initial.rate_independent else data.speed_reservation(run.limits, run.axis)
        )
        if too_uniform:
            failed[name] = HintedText(too_uniform)
            continue
        if progress is not None:
            progress(name)
        try:
            fits.append(fit_series(initial, run, second_run))
        except IdentificationError as error:
            failed[name] = error.message
    ordered = in_order(
        fits, lambda fit: -fit.aicc_reduction, lambda fit: free_parameters(fit.friction)
    )
    return LoopFit(loop, tuple(ordered), failed)
