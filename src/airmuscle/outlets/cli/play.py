"""`airmuscle play`: planned signals on a test rig, and their record."""

import contextlib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import click
import numpy as np

from ...bench import SignalLimits, read_csv
from ...bench.readers import write
from ...core import check_writable, counted
from ...files.library import list_plants
from ...files.scenario import load_scenario
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue
from ..requests.declaration import RequestError, Where, option, optional, request
from ..rig import Rig, Ros2Rig, SerialRig, SimulatedRig, check_commands, play
from .delivery import deliver
from .options import Folder, Json
from .parser import Argument
from .requested import with_requests

RECORD_FILE = "record.csv"
PlanFile = Annotated[Path, Argument("PLAN.csv", "Signals of airmuscle plan.")]


@request
class PlayRequest:
    """The rig, its limits, and the start."""

    serial: Path | None = optional("Serial port of the rig, such as /dev/ttyUSB0.", metavar="PORT")
    baud: int = option("Rate of the serial port.", default=115200)
    ros2: str | None = optional("Namespace of the topics of the rig.", metavar="NAMESPACE")
    sensors: str = option(
        "With --ros2: names of the readings, between commas.", default="pressure", metavar="NAMES"
    )
    simulate: str | None = optional(
        "A plant of the library or a scenario in place of a rig.",
        metavar="PLANT",
        complete=lambda incomplete: [name for name in list_plants() if name.startswith(incomplete)],
    )
    max_pressure: float = option("Maximum pressure of a command, such as '6 bar'.", unit="Pa")
    min_pressure: float = option("Minimum pressure of a command.", unit="Pa", default="0 kPa")
    max_rate: float | None = optional(
        "Greatest rate of a command, such as '20 bar/s'.", unit="Pa/s"
    )
    min_angle: float | None = optional("Least measured angle, '-30 deg'.", unit="rad")
    max_angle: float | None = optional("Greatest measured angle.", unit="rad")
    start: bool = option("Start: without it nothing moves.", default=False)

    def check(self, where: Where) -> None:
        """Raise RequestError for no rig, several rigs, or half a travel."""
        rigs = [name for name in ("serial", "ros2", "simulate") if getattr(self, name) is not None]
        if len(rigs) != 1:
            raise RequestError(
                f"give one of {where('serial')}, {where('ros2')} and {where('simulate')};"
                f" {counted(len(rigs), 'rig')} given."
            )
        if (self.min_angle is None) != (self.max_angle is None):
            raise RequestError(f"give {where('min_angle')} together with {where('max_angle')}.")


class _Connected(NamedTuple):
    """A rig, and the names of its readings."""

    rig: Rig
    sensors: tuple[str, ...]


@with_requests
def play_signals(
    plan: PlanFile, request: PlayRequest, out: Folder = Path("record"), json: Json = False
) -> None:
    """Play planned signals on a test rig and record them.

    \b
    Without --start the signals are checked, and nothing moves. The rig is vented at the end, at
    Ctrl-C, and whatever else ends the run: a reading beyond --max-pressure (by more than 30 kPa)
    or the angles, a lost connection, a row that is 100 ms late. DIR/record.csv contains what was
    measured until then; the exit code is 1 if it ended early. The device itself must vent when
    commands stay out; the page "A day at the rig" states the protocol of its serial line.

    \b
    Examples:
      airmuscle play next/plan.csv --simulate vessel-smc-itv2050 --max-pressure "5 bar"
      airmuscle play next/plan.csv --serial /dev/ttyUSB0 --max-pressure "5 bar" --start
      airmuscle play next/plan.csv --ros2 /airmuscle --sensors left.pressure,right.pressure,angle
          --max-pressure "4 bar" --min-angle "-30 deg" --max-angle "30 deg" --start
    """
    signals = read_csv(plan)
    if not request.start:
        check_commands(signals, _limits(request, ()))
        deliver("play", [_announced(signals)], json=json)
        return
    check_writable(out)
    with _connected(signals, request) as connected:
        limits = _limits(request, connected.sensors)
        options: dict[str, Any] = _jumping_clock() if request.simulate is not None else {}
        played = play(connected.rig, signals, limits, start=True, **options)
    files = {RECORD_FILE: lambda path: write(played.recording, path)}
    deliver("play", [played.chapter()], json=json, out=out, title="Played signals", files=files)
    if played.reason or not played.is_vented:
        raise click.exceptions.Exit(1)


def _announced(signals: Recording) -> Chapter:
    """What would be played."""
    time = signals["time"]
    names = [name for name in signals if name.rpartition(".")[2] == "setpoint"]
    highest = max(float(np.max(signals[name])) for name in names)
    values = (
        NamedValue("duration", float(time[-1] - time[0]), "s"),
        NamedValue("rows", len(time)),
        NamedValue("greatest command", highest, "Pa", "kPa"),
    )
    summary = "The signals keep the limits. Nothing was moved: start them with --start."
    return Chapter("play", "Signals to play", summary, values=values)


def _limits(request: PlayRequest, sensors: tuple[str, ...]) -> SignalLimits:
    """The limits, those of the angle for every reading of one. Raises RequestError for angles
    without limits.
    """
    angles = [name for name in sensors if "angle" in name]
    if request.min_angle is None or request.max_angle is None:
        if angles:
            raise RequestError(
                f"the rig measures {', '.join(angles)}; give its limits with --min-angle and"
                " --max-angle."
            )
        travel = {}
    else:
        travel = dict.fromkeys(angles, (request.min_angle, request.max_angle))
    rate = math.inf if request.max_rate is None else request.max_rate
    return SignalLimits(request.max_pressure, request.min_pressure, rate, travel)


@contextlib.contextmanager
def _connected(signals: Recording, request: PlayRequest) -> Iterator[_Connected]:
    """The rig of the request, which is closed at the end."""
    if request.serial is not None:
        with SerialRig(request.serial, request.baud) as line:
            yield _Connected(line, line.sensors)
    elif request.ros2 is not None:
        commands = [name for name in signals if name.rpartition(".")[2] == "setpoint"]
        sensors = tuple(name.strip() for name in request.sensors.split(","))
        node = Ros2Rig(commands, sensors, request.ros2)
        with contextlib.closing(node):
            yield _Connected(node, sensors)
    else:
        assert request.simulate is not None
        step = float(np.min(np.diff(signals["time"])))
        rig = SimulatedRig(load_scenario(request.simulate).plant, step)
        yield _Connected(rig, rig.sensors)


def _jumping_clock() -> dict[str, Any]:
    """A clock that jumps on instead of waiting, for a simulated rig."""
    now = [0.0]

    def pause(duration: float) -> None:
        now[0] += duration

    return {"clock": lambda: now[0], "pause": pause}
