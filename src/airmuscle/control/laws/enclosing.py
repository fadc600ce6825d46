"""Laws around another one: sampling, delays and limits of its signals, manual operation, and the
fault of a valve.
"""

from collections.abc import Mapping
from typing import ClassVar

from ...core import (
    ParameterError,
    Reference,
    Value,
    check_known,
    model,
    ops,
    parameter,
    select_prefix,
    with_prefix,
)
from ...core.annotation import within
from ...engine.loop import (
    LECUYER1999,
    STATE,
    ControlLaw,
    EnclosingLaw,
    Measurement,
    Memory,
    Sampled,
    drawn,
    seeded,
)
from .pid_and_sliding_mode import ASTROM_HAGGLUND1995
from .state_feedback import FRANKLIN1998

MAX_SAMPLES = 1000


@model
class WithSetpointDelay(EnclosingLaw):
    """u_k = law(y_k, r_(k-n)): every set point reaches the law n samples later; before, the first
    set point.

    y measurements that are n samples old, r set points, n `samples`. Set point and measurement that
    the law compares then belong to one instant. Without the delay the error of a motion with the
    speed r' contains n h r', h sample time, which feedback cannot remove and integral action turns
    into a lead of the motion. It is the set-point part of a controller with two degrees of freedom,
    for the feedback beside a feed-forward. Reference: Åström and Hägglund (1995), chapter 7.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    law: ControlLaw
    samples: int = within(0, MAX_SAMPLES)

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started (0 or 1), the waiting set points, the oldest first, and the values
        of the law.
        """
        waiting = {
            f"{name}.delayed{i}": 0.0 for name in self.setpoints for i in range(self.samples)
        }
        return {"started": 0.0, **waiting, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        delayed: dict[str, Value] = {}
        later: dict[str, Value] = {"started": 1.0}
        for name in self.setpoints:
            now = measurement.setpoints[name]
            waiting = [
                ops.where(memory["started"] > 0, memory[f"{name}.delayed{i}"], now)
                for i in range(self.samples)
            ]
            moved = [*waiting, now]
            delayed[name] = moved[0]
            later |= {f"{name}.delayed{i}": each for i, each in enumerate(moved[1:])}
        commands, law = self.law.step(
            select_prefix("law.", memory), measurement._replace(setpoints=delayed), dt
        )
        return commands, {**later, **with_prefix("law.", law)}


@model
class Multirate(EnclosingLaw):
    """A law that is sampled at every n-th sample of its loop; between its samples it holds its
    commands.

        Cascade(Multirate(PID("position", "pressure", ...), 10), PID("pressure", ...), (0.0,),
            (5e5,))

    in a loop of 1 kHz has a pressure control of 1 kHz and a position control of 100 Hz. n `every`;
    the law sees the sample time n h. Its first sample is that of the loop. Reference: Franklin,
    Powell and Workman (1998), chapter 11.
    """

    references: ClassVar[tuple[Reference, ...]] = (FRANKLIN1998,)

    law: ControlLaw
    every: int = within(1, MAX_SAMPLES)

    @property
    def initial_memory(self) -> dict[str, float]:
        """The samples since that of the law, the held commands, and the values of the law."""
        held = dict.fromkeys(self.inputs, 0.0)
        return {
            "phase": 0.0,
            **with_prefix("held.", held),
            **with_prefix("law.", self.law.initial_memory),
        }

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        before = select_prefix("law.", memory)
        due = memory["phase"] < 0.5
        wanted, after = self.law.step(before, measurement, dt * self.every)
        commands = {
            name: ops.where(due, wanted[name], memory[f"held.{name}"]) for name in self.inputs
        }
        law = {name: ops.where(due, after[name], value) for name, value in before.items()}
        phase = ops.where(memory["phase"] > self.every - 1.5, 0.0, memory["phase"] + 1.0)
        return commands, {
            "phase": phase,
            **with_prefix("held.", commands),
            **with_prefix("law.", law),
        }


@model
class WithCommandDelay(EnclosingLaw):
    """The commands of a law arrive late, by n samples and up to m more at random; some are lost.

    n `samples`, m `jitter`: the age of the applied command is uniform from n to n + m samples, a
    command is lost with the probability p_l `lost`, and the last one is then held. Before the first
    command arrives, inputs are those that the law gives without an error at the first sample, such
    as the initial output of a PID. The computing time of a controller is a part of its sample time
    where the loop is sampled faster: `WithCommandDelay(Multirate(law, 5), 2)` is a delay of 0.4 of
    the sample time of the law. Seed as in WithSensors.
    """

    references: ClassVar[tuple[Reference, ...]] = (LECUYER1999,)

    law: ControlLaw
    samples: int
    jitter: int = 0
    lost: float = parameter(
        "1", "p_l", "probability that a command is lost", bounds=(0.0, 1.0), default=0.0
    )
    seed: float = parameter(
        "1", "seed", "seed of the sequence", bounds=(0.0, 2147483644.0), fitted=False, default=0.0
    )

    def check(self) -> None:
        if not (
            self.samples >= 0 and self.jitter >= 0 and self.samples + self.jitter <= MAX_SAMPLES
        ):
            raise ParameterError(
                f"WithCommandDelay: samples and jitter are {self.samples} and {self.jitter};"
                f" allowed range: from 0, together {MAX_SAMPLES} at most."
            )

    @property
    def irregular(self) -> str:
        """Why the law is not linearised: its commands are late or lost at random."""
        if not self.lost and not self.jitter:
            return ""
        return (
            f"the commands of WithCommandDelay are late or lost at random (jitter {self.jitter},"
            f" lost {self.lost:g}), so that the loop has no margins. Set jitter and lost to 0: with"
            f" samples={self.samples + self.jitter} every command has the longest delay."
        )

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started, the last commands (the newest first), those applied, generator
        and law.
        """
        ages = range(1, self.samples + self.jitter + 1)
        late = {f"late.{name}.{age}": 0.0 for name in self.inputs for age in ages}
        own = {"started": 0.0, **late, **with_prefix("applied.", dict.fromkeys(self.inputs, 0.0))}
        random = with_prefix("random.", dict.fromkeys(STATE, 0.0))
        return {**own, **random, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        inner = select_prefix("law.", memory)
        wanted, law = self.law.step(inner, measurement, dt)
        resting = self.law.commands_at_rest(inner, measurement, dt)
        kept = select_prefix("random.", memory)
        fresh = seeded(self.seed)
        state = {name: ops.where(memory["started"] > 0, kept[name], fresh[name]) for name in STATE}
        chance, state = drawn(state)
        turn, state = drawn(state)
        more = ops.floor(turn * (self.jitter + 1.0))

        def before(stored: str, name: str) -> Value:
            return ops.where(memory["started"] > 0, memory[stored], resting[name])

        commands: dict[str, Value] = {}
        later: dict[str, Value] = {"started": 1.0}
        for name in self.inputs:
            ages = [
                wanted[name],
                *(
                    before(f"late.{name}.{age}", name)
                    for age in range(1, self.samples + self.jitter + 1)
                ),
            ]
            arrived = ages[self.samples]
            for extra in range(1, self.jitter + 1):
                arrived = ops.where(more > extra - 0.5, ages[self.samples + extra], arrived)
            last = before(f"applied.{name}", name)
            commands[name] = ops.where(chance < self.lost, last, arrived)
            later |= {f"late.{name}.{age}": value for age, value in enumerate(ages[:-1], 1)}
        random = with_prefix("random.", state)
        return commands, {
            **later,
            **with_prefix("applied.", commands),
            **random,
            **with_prefix("law.", law),
        }


@model
class WithRateLimit(EnclosingLaw):
    """|u_k - u_(k-1)| <= R h: commands whose rate is limited, and a law that knows it.

    R `max_rate`, one for each input, in its unit over 1 s. The law sees the range that it can reach
    in this sample, so that its anti-windup acts. The first command is not limited. Reference:
    Åström and Hägglund (1995), chapter 3.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    law: ControlLaw
    max_rate: tuple[float, ...] = parameter(
        "u/s", "R", "maximum rates of the commands", bounds=(0.0, 1e12)
    )

    def check(self) -> None:
        if len(self.max_rate) != len(self.law.inputs):
            raise ParameterError(
                f"WithRateLimit: {len(self.max_rate)} rates for {len(self.law.inputs)} inputs "
                f"({', '.join(self.law.inputs)}); give one for each."
            )

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether it has started, the last commands, and the values of the law."""
        last = with_prefix("last.", dict.fromkeys(self.inputs, 0.0))
        return {"started": 0.0, **last, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        ranges = dict(measurement.ranges)
        for name, rate in zip(self.inputs, self.max_rate, strict=True):
            low, high = ranges[name]
            last = memory[f"last.{name}"]
            reach = ops.where(memory["started"] > 0, rate * dt, high - low)
            ranges[name] = ops.clip(last - reach, low, high), ops.clip(last + reach, low, high)
        wanted, law = self.law.step(
            select_prefix("law.", memory), measurement._replace(ranges=ranges), dt
        )
        commands = {name: ops.clip(wanted[name], *ranges[name]) for name in self.inputs}
        return commands, {
            "started": 1.0,
            **with_prefix("last.", commands),
            **with_prefix("law.", law),
        }


@model
class WithManual(EnclosingLaw):
    """u = u_m while the set point `manual` is at least 0.5, then u = u_l + b, b' = -b/T: by hand
    and by a law.

    u_m are the set points `manual.<input>`, u_l commands of the law; b is chosen so that the first
    automatic command is the last one by hand, whatever the law is, and fades with the time constant
    T. In manual operation the law sees u_m as the only command that is possible, so that its
    anti-windup acts. Reference: Åström and Hägglund (1995), chapter 3.
    """

    references: ClassVar[tuple[Reference, ...]] = (ASTROM_HAGGLUND1995,)

    law: ControlLaw
    transfer_time: float = parameter(
        "s",
        "T",
        "time constant of the change to automatic operation",
        bounds=(1e-6, 1e6),
        default=0.5,
    )

    signal_units: ClassVar[Mapping[str, str]] = {"manual": "1"}

    @property
    def setpoints(self) -> tuple[str, ...]:
        return (*self.law.setpoints, "manual", *(f"manual.{name}" for name in self.inputs))

    @property
    def initial_memory(self) -> dict[str, float]:
        """Whether the last sample was by hand, last commands, offsets b, and the values of the
        law.
        """
        own = {f"{kind}.{name}": 0.0 for kind in ("last", "offset") for name in self.inputs}
        return {"by_hand": 0.0, **own, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        wanted = measurement.setpoints
        by_hand = measurement.setpoints["manual"] >= 0.5
        given = {n: ops.clip(wanted[f"manual.{n}"], *measurement.ranges[n]) for n in self.inputs}
        ranges = {
            name: tuple(ops.where(by_hand, given[name], end) for end in measurement.ranges[name])
            for name in given
        }
        free, law = self.law.step(
            select_prefix("law.", memory), measurement._replace(ranges=ranges), dt
        )
        fade = ops.exp(-dt / self.transfer_time)
        commands: dict[str, Value] = {}
        later: dict[str, Value] = {"by_hand": ops.where(by_hand, 1.0, 0.0)}
        for name in self.inputs:
            begun = memory[f"last.{name}"] - free[name]
            offset = ops.where(memory["by_hand"] > 0.5, begun, fade * memory[f"offset.{name}"])
            automatic = ops.clip(free[name] + offset, *measurement.ranges[name])
            commands[name] = ops.where(by_hand, given[name], automatic)
            later |= {f"last.{name}": commands[name], f"offset.{name}": offset}
        return commands, {**later, **with_prefix("law.", law)}


@model
class WithStuckValve(EnclosingLaw):
    """u_i = law for t < t_f,   u_i = u_f for t >= t_f:  a fault that the law does not know.

    t time since the first sample, u_i the command of one input. With u_f = 0 a valve remains
    closed, with a small u_f it leaks. All other inputs receive what the law commands.
    """

    simulated: ClassVar[bool] = True

    law: ControlLaw
    stuck_input: str
    stuck_time: float = parameter(
        "s", "t_f", "time from which the valve sticks", bounds=(0.0, 1e9), fitted=False
    )
    stuck_opening: float = parameter(
        "1", "u_f", "opening of the stuck valve", bounds=(-1.0, 1.0), default=0.0
    )

    def check(self) -> None:
        check_known(
            "WithStuckValve: the law does not command",
            self.stuck_input,
            self.law.inputs,
            "it commands",
        )

    @property
    def initial_memory(self) -> dict[str, float]:
        """The number of samples so far, and the values of the law."""
        return {"samples": 0.0, **with_prefix("law.", self.law.initial_memory)}

    def step(self, memory: Memory, measurement: Measurement, dt: Value) -> Sampled:
        wanted, later = self.law.step(select_prefix("law.", memory), measurement, dt)
        sticks = (memory["samples"] + 1e-6) * dt > self.stuck_time  # the product is rounded
        held = ops.where(sticks, self.stuck_opening, wanted[self.stuck_input])
        return {**wanted, self.stuck_input: held}, {
            "samples": memory["samples"] + 1.0,
            **with_prefix("law.", later),
        }
