"""Friction of all loops of a campaign, dependent on the pressure; damping by the quick releases of
a hanging load; the force of friction and creep along a recorded motion."""

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from concurrent.futures import Executor

import numpy as np

from ...core import STANDARD_GRAVITY, AirmuscleError, ShortRepr
from ...engine.distribution import DistributedCalls
from ...engine.loop.inputs import Schedule
from ...physics import (
    ClosedChamber,
    CreepElements,
    HangingMass,
    LinearDamper,
    Muscle,
    Plant,
    Polytropic,
    WithLatch,
)
from ...physics.muscle.friction import Friction, NoFriction
from ...recording import Recording
from .. import hysteresis
from ..dynamics import (
    DynamicFit,
    Experiment,
    InitialConditions,
    StartTime,
    fit_dynamic,
    stated_ambient,
)
from ..prediction import creep_force, displacement, has_path, path_rows, thinned_rows
from .record import CampaignRecord, RecordKind
from .transient import (
    LeftOutStage,
    find_motion,
    thin,
    with_force,
)

FIT_ROWS = 300
INITIAL_DAMPING = 100.0
"""Maximum number of rows of a release, and initial damping of the search [N s/m] (chosen)."""
MIN_DEVIATIONS = (("position", "length", 2e-5), ("pressure", "pressure", 100.0))
"""Quantities, their columns, and least standard deviations of the sensors [m], [Pa] (chosen)."""
SETTLED_SHARE = 0.1
"""Share of the rows at the end of a release from which the load follows (chosen)."""
DAMPING = "muscle.damper.damping"
REMEDY = (
    "hold the muscle at its resting length with a latch at constant air mass, release it with a"
    " hanging mass, and record pressure, length and force at 500 rows per second or more until it"
    " is at rest"
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ReleaseStage(ShortRepr):
    """The damping and the polytropic exponent from all releases together."""

    fit: DynamicFit
    records: tuple[CampaignRecord, ...]
    masses: tuple[float, ...]
    """Moving mass of each release [kg]."""

    @property
    def damper(self) -> LinearDamper:
        """The fitted damper."""
        return LinearDamper(self.fit[DAMPING].value)

    @property
    def verdict(self) -> str:
        """Damping and residuals, as sentences."""
        damping = self.fit[DAMPING]
        rms = ", ".join(
            f"{1e3 * self.fit.rms('position', i):.3g} mm" for i in range(len(self.records))
        )
        loads = ", ".join(f"{mass:.4g} kg" for mass in self.masses)
        return (
            f"Damping {damping.value:.4g} N s/m (2 standard errors {damping.format_interval()}),"
            f" with a load of {loads}; rms residual of the position {rms}. The damping is that of"
            " this speed and load."
        )


def fit_release_stage(
    records: Sequence[CampaignRecord], muscle: Muscle | None
) -> ReleaseStage | LeftOutStage:
    """Fit the damping of the muscle to the position and the pressure after the release of a hanging
    mass. The muscle has its static law, friction and volume. The mass is the constant `mass` [kg]
    of the file, or follows from the force at the end of the record."""
    if not records:
        return LeftOutStage("release", "no record is a release", REMEDY)
    if muscle is None:
        reason = "the enclosed volume of the muscle is not known"
        remedy = "identify the volume from fills"
        return LeftOutStage("release", reason, remedy)
    masses = {record: mass for record in records if (mass := _mass(record)) is not None}
    if not masses:
        reason = "the moving mass is neither stated nor determined by a force at the end"
        return LeftOutStage("release", reason, "state the mass in the file")
    try:
        damped = dataclasses.replace(muscle, damper=LinearDamper(INITIAL_DAMPING))
        experiments = [_experiment(record, damped, mass) for record, mass in masses.items()]
        sensors = [record.inspection.sensors for record in masses]
        deviations = {
            name: max(
                [
                    least,
                    *(
                        record_sensors[column].std
                        for record_sensors in sensors
                        if column in record_sensors
                    ),
                ]
            )
            for name, column, least in MIN_DEVIATIONS
        }
        first = experiments[0].plant
        assert first is not None
        fit = fit_dynamic(
            first,
            experiments,
            free=(DAMPING, "gas.exponent"),
            observed=deviations,
            per_record=(StartTime(0.02),),
            bounds={DAMPING: (0.1, 1e5)},
        )
    except AirmuscleError as error:
        return LeftOutStage("release", str(error.message), REMEDY)
    return ReleaseStage(fit, tuple(masses), tuple(masses.values()))


def _mass(record: CampaignRecord) -> float | None:
    """Moving mass [kg]: stated in the file, or from the force at the end, when the load hangs at
    rest.
    """
    stated = record.recording.constants.get("mass")
    if isinstance(stated, float | int) and stated > 0:
        return float(stated)
    if "force" not in record.recording:
        return None
    rows = max(int(SETTLED_SHARE * len(record.recording)), 3)
    mass = float(np.median(record.recording["force"][-rows:])) / STANDARD_GRAVITY
    return mass if mass > 0.01 else None


def _experiment(record: CampaignRecord, muscle: Muscle, mass: float) -> Experiment:
    measured = record.recording
    mechanism = WithLatch(HangingMass(mass))
    ambient = stated_ambient(measured)
    plant = Plant(muscle, ClosedChamber(), mechanism, gas=Polytropic(1.2), ambient=ambient)
    motion = find_motion(measured)
    path = displacement(measured)
    assert motion is not None
    count = max(int((measured["time"] < motion.start).sum()), 3)
    pressure, position = (
        float(np.median(column[:count])) for column in (measured["pressure"], path)
    )
    conditions = InitialConditions.at_coordinates(plant, pressure, position=position, speed=0.0)
    recording = thin(measured.with_columns(position=path), FIT_ROWS)
    command = Schedule({"latched": ((0.0, 0.0),)})
    return Experiment(
        recording, command, conditions, max(motion.start - 0.005, float(measured["time"][0])), plant
    )


MAX_LOOPS = 6
"""Maximum number of loops that are fitted, of more those at evenly spaced pressures (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FrictionStage(ShortRepr):
    """The friction of all loops, and the fits of the single loops and of all laws."""

    friction: Friction
    """With the range of its data; no friction where the loops justify none."""
    loops: tuple[hysteresis.LoopFit, ...]
    joint: tuple[hysteresis.JointFit, ...]
    left_out: int = 0
    """Number of loops that were not fitted, because there are more than `MAX_LOOPS`."""

    @property
    def selected(self) -> hysteresis.JointFit | None:
        """The joint fit whose friction is used; None without one."""
        return hysteresis.preferred_fit(self.joint)

    @property
    def verdict(self) -> str:
        """The friction and whether the loops justify it, as sentences."""
        if self.selected is not None:
            return self.selected.verdict
        if self.joint:
            return f"{self.joint[0].verdict} The muscle is written without friction."
        if len(self.loops) > 1:
            return (
                "Fewer than two loops can be fitted together; the muscle is written without"
                " friction."
            )
        best = self.loops[0].recommended
        if best is None:
            return "The loops justify no friction; the muscle is written without friction."
        return (
            f"{best.verdict} A single loop does not show the dependence of the friction on the"
            " pressure."
        )


def fit_friction_stage(
    records: Sequence[CampaignRecord],
    creep: CreepElements,
    progress: Callable[[float], None],
    executor: Executor | None = None,
) -> FrictionStage | LeftOutStage:
    """Fit every friction law to the loops at constant pressure of all specimens together. The force
    of the creep elements is added before, so that it is not taken for friction. Each loop has its
    own static curve, a polynomial in the contraction."""
    loops, failed = _find_loops(records, creep)
    if not loops:
        reason = (
            failed[0]
            if failed
            else "no record at constant pressure has a contracting and an extending branch"
        )
        remedy = (
            "shorten and lengthen the muscle slowly at constant pressure, at three pressures or"
            " more"
        )
        return LeftOutStage("hysteresis", reason, remedy)
    ordered = sorted(loops, key=lambda loop: loop.run.constant_value or 0.0)
    selected = [ordered[i] for i in thinned_rows(len(ordered), MAX_LOOPS)]
    fits = DistributedCalls(executor, _fit_loop, None).results(
        selected, lambda done: progress(0.5 * done / len(selected))
    )
    laws = itertools.count(1)
    joint = hysteresis.fit_jointly(
        fits,
        progress=lambda _: progress(0.5 + 0.5 * min(next(laws) / 5.0, 1.0)),
        workers=executor or 1,
    )
    best = hysteresis.preferred_fit(joint)
    runs = () if best is None else best.series
    if best is None and len(fits) == 1 and (only := fits[0].recommended) is not None:
        best = only
        runs = (only.series,)
    friction = NoFriction() if best is None else hysteresis.identified_friction(best.friction, runs)
    return FrictionStage(friction, tuple(fits), joint, len(loops) - len(selected))


def _fit_loop(_: None, loop: hysteresis.HysteresisLoop) -> hysteresis.LoopFit:
    return hysteresis.fit_loop(loop)


def _find_loops(
    records: Sequence[CampaignRecord], creep: CreepElements
) -> tuple[list[hysteresis.HysteresisLoop], list[str]]:
    """The loops of each specimen; loops of different specimens are not repeats of each other."""
    usable: dict[float, list[Recording]] = {}
    failed = list[str]()
    for record in records:
        if record.kind is RecordKind.ISOBARIC and record.resting_length is not None:
            recording = with_force(record.recording, creep_force(creep, record.recording))
            recording = recording.rows(path_rows(recording))
            specimen_runs = usable.setdefault(record.resting_length, [])
            try:
                hysteresis.find_loops([recording], all_rows=True)
            except AirmuscleError as error:
                failed.append(error.message)
            else:
                specimen_runs.append(recording)
    lengths = [specimen_runs for specimen_runs in usable.values() if specimen_runs]
    return [
        loop
        for specimen_runs in lengths
        for loop in hysteresis.find_loops(specimen_runs, all_rows=True)
    ], failed


def free_of_creep(elements: CreepElements, recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings with the force of the creep elements along their motion added to the measured
    force.
    """
    return [
        (
            with_force(recording, creep_force(elements, recording))
            if elements.stiffnesses and has_path(recording)
            else recording
        )
        for recording in recordings
    ]
