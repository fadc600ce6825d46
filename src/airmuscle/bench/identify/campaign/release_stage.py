"""Damping of a campaign: a dynamic fit of the quick releases of a hanging load."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ....core import STANDARD_GRAVITY, AirmuscleError, ShortRepr
from ....engine.loop.inputs import Schedule
from ....physics.mechanism import HangingMass, WithLatch
from ....physics.muscle import LinearDamper, Muscle
from ....physics.plant.plant import Plant
from ....physics.pneumatics import ClosedChamber, Polytropic
from ..dynamic import DynamicFit, Experiment, InitialConditions, StartTime, fit_dynamic, stated_ambient
from .record import CampaignRecord
from .transient import LeftOutStage, displacement, find_motion, thin

NAME = "release"
FIT_ROWS = 300
"""Maximum number of rows of a release (chosen)."""
INITIAL_DAMPING = 100.0
"""Initial damping of the search [N s/m] (chosen)."""
MIN_DEVIATIONS = {"position": 2e-5, "pressure": 100.0}
"""Least standard deviations of the sensors [m], [Pa] (chosen)."""
SETTLED_SHARE = 0.1
"""Share of the rows at the end of a release from which the load follows (chosen)."""
DAMPING = "muscle.damper.damping"
REMEDY = (
    "hold the muscle at its resting length with a latch at constant air mass, release it with a hanging mass, and "
    "record pressure, length and force at 500 rows per second or more until it is at rest"
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
        rms = ", ".join(f"{1e3 * self.fit.rms('position', i):.3g} mm" for i in range(len(self.records)))
        loads = ", ".join(f"{mass:.4g} kg" for mass in self.masses)
        return (
            f"Damping {damping.value:.4g} N s/m (2 standard errors {damping.format_interval()}), with a load of "
            f"{loads}; rms residual of the position {rms}. The damping is that of this speed and load."
        )


def fit_release_stage(records: Sequence[CampaignRecord], muscle: Muscle | None) -> ReleaseStage | LeftOutStage:
    """Fit the damping of the muscle to the position and the pressure after the release of a hanging mass.

    The muscle has its static law, friction and volume. The mass is the constant `mass` [kg] of the file, or follows
    from the force at the end of the record.
    """
    if not records:
        return LeftOutStage(NAME, "no record is a release", REMEDY)
    if muscle is None:
        return LeftOutStage(NAME, "the enclosed volume of the muscle is not known", "identify the volume from fills")
    usable = [record for record in records if _mass(record) is not None]
    if not usable:
        return LeftOutStage(
            NAME, "the moving mass is neither stated nor determined by a force at the end", "state the mass in the file"
        )
    masses = tuple(float(_mass(record) or 0.0) for record in usable)
    try:
        experiments = [_experiment(record, muscle, mass) for record, mass in zip(usable, masses, strict=True)]
        first = experiments[0].plant
        assert first is not None
        deviations = {name: _deviation(usable, name) for name in ("position", "pressure")}
        fit = fit_dynamic(
            first, experiments, free=(DAMPING, "gas.exponent"), observed=deviations,
            per_record=(StartTime(0.02),), bounds={DAMPING: (0.1, 1e5)},
        )  # fmt: skip
    except AirmuscleError as error:
        return LeftOutStage(NAME, str(error.message), REMEDY)
    return ReleaseStage(fit, tuple(usable), masses)


def _mass(record: CampaignRecord) -> float | None:
    """Moving mass [kg]: stated in the file, or from the force at the end, when the load hangs at rest."""
    stated = record.recording.constants.get("mass")
    if isinstance(stated, float | int) and stated > 0:
        return float(stated)
    if "force" not in record.recording:
        return None
    rows = max(int(SETTLED_SHARE * len(record.recording)), 3)
    mass = float(np.median(record.recording["force"][-rows:])) / STANDARD_GRAVITY
    return mass if mass > 0.01 else None


def _deviation(records: Sequence[CampaignRecord], name: str) -> float:
    column = "length" if name == "position" else name
    sensors = [record.inspection.sensors.get(column) for record in records]
    values = [sensor.std for sensor in sensors if sensor is not None]
    return max([MIN_DEVIATIONS[name], *values])


def _experiment(record: CampaignRecord, muscle: Muscle, mass: float) -> Experiment:
    whole = record.recording
    motion = find_motion(whole)
    assert motion is not None
    path = displacement(whole)
    before = whole["time"] < motion.start
    count = max(int(before.sum()), 3)
    plant = Plant(
        dataclasses.replace(muscle, damper=LinearDamper(INITIAL_DAMPING)),
        ClosedChamber(),
        WithLatch(HangingMass(mass)),
        gas=Polytropic(1.2),
        ambient=stated_ambient(whole),
    )
    rest = {"position": float(np.median(path[:count])), "speed": 0.0}
    conditions = InitialConditions.at_coordinates(plant, float(np.median(whole["pressure"][:count])), **rest)
    recording = thin(whole.with_columns(position=path), FIT_ROWS)
    command = Schedule({"latched": ((0.0, 0.0),)})
    return Experiment(recording, command, conditions, max(motion.start - 0.005, float(whole["time"][0])), plant)
