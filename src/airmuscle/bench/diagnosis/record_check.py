"""Check of a record after it was measured: whether it is usable, by a table of rules, each with its
condition, its text and its remedy.
"""

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ...core import Array, counted
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Table
from ..inspection import Sampling, analyse_sampling, inspect
from ..reported import Reported
from .response_to_command import CommandResponse, command_response
from .rules import Diagnosis, apply_rules
from .value_rules import VALUE_RULES, bench_data

MIN_ROWS = 30
MAX_JITTER = 0.3
"""Least number of rows, and greatest jitter as a fraction of the sample time (chosen)."""
MIN_LEAD = 2.0
"""Rows by which a pressure precedes its command, from which the columns count as exchanged
(chosen)."""
MIN_LEAD_GAIN = 1e-3
"""Least gain of the correlation by that lead (chosen)."""
MAX_DEAD_TIME = 0.2
"""Greatest dead time of a pressure regulator [s] (chosen; published ones are below 0.06 s)."""
MIN_CORRELATION = 0.7
MAX_DEVIATION = 0.1
"""Least correlation of a pressure with its command, and greatest deviation in settled rows as a
fraction of the range of the command (chosen)."""
MAX_ZERO = 0.03
MAX_DROOP = 0.06
MAX_SUPPLY_DROOP = 0.15
"""Greatest zero of a pressure, greatest loss between holds of one command, both as fractions of the
range, and greatest loss of the supply pressure (chosen)."""
LEVEL_STEP = 0.02
"""Width of a level of the command, as a fraction of its range (chosen)."""
LEAST_SPAN = 0.25
"""Least range to which deviations refer, as a fraction of the greatest command (chosen)."""
MIN_SETTLED = 20
"""Least number of settled rows that are judged (chosen)."""
MIN_STUCK = 30
"""Least number of successive equal readings of a noisy sensor that show a stuck one (chosen)."""
SPIKE = 0.05
SPIKE_DEVIATIONS = 10.0
"""Least size of a spike, as a fraction of the range and in standard deviations of the noise
(chosen)."""
MAX_NOISE = 0.05
"""Greatest noise as a fraction of the greatest reading (chosen)."""
REVERSED = -0.85
"""Correlation of motion and pressure from which the sign counts as reversed (chosen)."""
MIN_STOP_SHARE = 0.1
MIN_STOP_PRESSURE = 0.25
STOP_SLOPE = 0.5
"""Least share of rows at an end stop, least share of the range of pressure over which the motion
stands still there, and least slope before it, as a fraction of the mean slope (chosen)."""
PRESSURES = (2e3, 2e6)
"""Usual range of the greatest pressure of a record [Pa] (chosen)."""
SUPPLIES = ("supply", "tank", "source", "res")
"""Beginnings of the names of pressures of a supply."""
MEASURED = ("pressure", "force", "contraction", "length", "shortening", "position", "angle")
"""Quantities of sensors."""
CONTRACTING = ("contraction", "shortening", "position")
"""Motions that rise with the pressure."""


@dataclasses.dataclass(frozen=True)
class RecordFault:
    """A fault of a record: its rule, what was found, and what to do."""

    rule: str
    text: str
    remedy: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RecordCheck(Reported):
    """Result of the check of a record; it is usable without a fault."""

    recording: Recording
    faults: tuple[RecordFault, ...]
    sampling: Sampling | None
    responses: dict[str, CommandResponse]

    @property
    def is_usable(self) -> bool:
        """Whether no fault was found."""
        return not self.faults

    @property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """The faults as the findings of their rules, each with its remedy."""
        return tuple(Diagnosis(f.rule, f"{f.text}. {f.remedy}") for f in self.faults)

    def chapter(self) -> Chapter:
        """The description of the check."""
        verdict = "Usable: no fault was found." if self.is_usable else "Not usable as it is."
        values = [NamedValue("usable", "yes" if self.is_usable else "no")]
        if self.sampling is not None:
            values.append(NamedValue("duration", self.sampling.duration, "s"))
            values.append(NamedValue("rows per second", self.sampling.rate, "1/s"))
        for name, response in self.responses.items():
            values.append(NamedValue(f"delay of the {name}", response.delay, "s", "ms", 3))
        columns = {
            "fault": [fault.rule for fault in self.faults],
            "found": [fault.text for fault in self.faults],
            "what to do": [fault.remedy for fault in self.faults],
        }
        tables = (Table("faults", "Faults", columns, brief=len(self.faults)),)
        return Chapter(
            "check",
            f"Check of {self.recording.origin}",
            verdict,
            values=tuple(values),
            tables=tables if self.faults else (),
        )


@dataclasses.dataclass(frozen=True, eq=False)
class _Subject:
    """What the rules look at: a record, its sampling, and pressures with their commands."""

    recording: Recording
    sampling: Sampling | None
    pairs: dict[str, tuple[str, str]]
    responses: dict[str, CommandResponse]

    def sensors(self) -> Iterator[tuple[str, Array]]:
        """Names and readings of the sensors."""
        for name, values in self.recording.columns.items():
            if name.rpartition(".")[2] in MEASURED and len(values):
                yield name, values


Rule = Callable[[_Subject], Iterator[RecordFault]]


def check_record(recording: Recording) -> RecordCheck:
    """The check of a record: length, gaps, sample time, delay, supply, exchanged columns, signs,
    zeros, saturation, pressures that do not follow their commands, end stops.
    """
    pairs = _pairs(recording)
    responses = {}
    if "time" in recording:
        for command, pressure in pairs.values():
            response = command_response(recording["time"], recording[command], recording[pressure])
            if response is not None:
                responses[pressure] = response
    subject = _Subject(recording, analyse_sampling(recording), pairs, responses)
    faults = tuple(itertools.chain.from_iterable(rule(subject) for rule in RULES))
    return RecordCheck(recording, faults, subject.sampling, responses)


def _pairs(recording: Recording) -> dict[str, tuple[str, str]]:
    """Commands with the pressures of the same name, by this name."""
    pairs = {}
    for name in recording.columns:
        prefix, _, quantity = name.rpartition(".")
        pressure = f"{prefix}.pressure" if prefix else "pressure"
        if quantity == "setpoint" and pressure in recording.columns:
            pairs[prefix] = (name, pressure)
    return pairs


def _length(subject: _Subject) -> Iterator[RecordFault]:
    rows = len(subject.recording)
    if rows < MIN_ROWS:
        yield RecordFault("length", f"{counted(rows, 'row')}", "Record longer.")
        return
    if any(_moves_at_end(subject.recording[command]) for command, _ in subject.pairs.values()):
        return  # the command has not come to rest either
    for finding in inspect(subject.recording).findings:
        if "ends before the pressure has settled" in finding.text and finding.serious:
            yield RecordFault(
                "length", "it ends before the pressure has settled", "Record until it has."
            )


def _moves_at_end(command: Array) -> bool:
    """Whether a command changes in the last tenth of a record."""
    return bool(np.ptp(command[-max(len(command) // 10, 3) :]) > 0.0)


def _times(subject: _Subject) -> Iterator[RecordFault]:
    sampling = subject.sampling
    if "time" not in subject.recording:
        yield RecordFault("sample time", "there is no time", "Record it, or use --sample-rate.")
    if sampling is None:
        return
    if sampling.backward_rows or sampling.repeated_rows:
        count = len(sampling.backward_rows) + len(sampling.repeated_rows)
        text = f"time repeats or decreases in {counted(count, 'row')}"
        yield RecordFault("sample time", text, "Write each run to a file of its own.")
    if sampling.gaps:
        longest = max(sampling.gaps, key=lambda gap: gap.duration)
        text = (
            f"{counted(len(sampling.gaps), 'gap')}, the longest of {longest.duration:.3g} s after"
            f" row {longest.row + 1}"
        )
        yield RecordFault("gap", text, "Check the load of the logger, and record again.")
    if sampling.jitter > MAX_JITTER:
        text = f"the intervals differ by {100 * sampling.jitter:.0f} % of the sample time"
        yield RecordFault("sample time", text, "Sample by a timer, or use --sample-rate.")


def _exchanged(subject: _Subject) -> Iterator[RecordFault]:
    """Exchanged command and pressure, and exchanged pressures of two pairs."""
    for name, response in subject.responses.items():
        if is_exchanged(response, subject.sampling):
            text = f"the {name} precedes its command by {-1e3 * response.delay:.3g} ms"
            yield RecordFault(
                "exchanged columns",
                text,
                "Exchange command and pressure; else the command was logged late.",
            )
    for first, second in itertools.combinations(subject.pairs.values(), 2):
        recording = subject.recording
        straight = _agreement(recording, first, first) + _agreement(recording, second, second)
        crossed = _agreement(recording, first, second) + _agreement(recording, second, first)
        if crossed > straight + 0.3:
            text = f"{first[1]} follows the command of {second[1]}, and the reverse"
            yield RecordFault("exchanged columns", text, "Exchange the two sensors.")


def is_exchanged(response: CommandResponse, sampling: Sampling | None) -> bool:
    """Whether a pressure precedes its command, which no pressure does."""
    step = sampling.sample_time if sampling is not None else 0.0
    leads = -response.delay >= MIN_LEAD * step > 0.0
    return leads and response.lead_gain > MIN_LEAD_GAIN and response.correlation > MIN_CORRELATION


def _agreement(
    recording: Recording, commanded: tuple[str, str], measured: tuple[str, str]
) -> float:
    command = recording[commanded[0]]
    pressure = recording[measured[1]]
    if np.ptp(command) == 0.0 or np.ptp(pressure) == 0.0:
        return 0.0
    return float(np.corrcoef(command, pressure)[0, 1])


def _following(subject: _Subject) -> Iterator[RecordFault]:
    """A pressure that does not follow, or does not reach, its command; its zero and its delay."""
    for command_name, name in subject.pairs.values():
        command = subject.recording[command_name]
        pressure = subject.recording[name]
        response = subject.responses.get(name)
        if response is None:
            if np.ptp(command) > 0.0:
                text = f"the {name} does not change with its command"
                yield RecordFault("following", text, "Check the valve, the tube and the sensor.")
            continue
        if is_exchanged(response, subject.sampling):
            continue
        if response.correlation < MIN_CORRELATION:
            text = (
                f"the {name} does not follow its command (correlation {response.correlation:.2f})"
            )
            yield RecordFault("following", text, "Check the valve, the tube and the sensor.")
            continue
        yield from _delay(name, response)
        yield from _settled_rows(name, command, pressure, response.settled)


def _delay(name: str, response: CommandResponse) -> Iterator[RecordFault]:
    if response.dead_time is not None and response.dead_time > MAX_DEAD_TIME:
        text = f"the {name} answers a step of its command after {1e3 * response.dead_time:.3g} ms"
        yield RecordFault("delay", text, "Check that command and sensor have one clock.")


def _settled_rows(
    name: str, command: Array, pressure: Array, settled: Array
) -> Iterator[RecordFault]:
    """What the rows say whose command has not changed for a while."""
    greatest = float(np.max(np.abs(command)))
    span = max(float(np.ptp(command)), LEAST_SPAN * greatest)
    rows = np.flatnonzero(settled)
    if len(rows) < MIN_SETTLED:
        return
    deviation = (pressure - command)[rows] / span
    level = np.round((command[rows] - command.min()) / (LEVEL_STEP * span))
    droop = _droop(deviation, level)
    if droop > MAX_DROOP:
        text = f"at one command, the {name} falls by {100 * droop:.0f} % of the range"
        yield RecordFault("supply", text, "Check the supply, and the tightness.")
        return
    at_lowest = deviation[level == level.min()]
    at_highest = deviation[level == level.max()]
    zero = float(np.median(at_lowest))
    gain = float(np.median(at_highest)) - zero
    typical = float(np.median(np.abs(deviation)))
    if abs(zero) > MAX_ZERO and abs(gain) < MAX_ZERO:
        text = f"the {name} differs from its command by {100 * zero:.1f} % of the range everywhere"
        yield RecordFault("zero", text, "Set the zero of the sensor.")
    elif max(typical, abs(gain)) > MAX_DEVIATION:
        worst = float(deviation[np.argmax(np.abs(deviation))])
        text = f"settled, the {name} differs by up to {100 * worst:.0f} % of the range"
        yield RecordFault("following", text, "Check the supply pressure and the scale.")


def _droop(deviation: Array, level: Array) -> float:
    """The greatest fall of a pressure from the first to the last holds of one command, as a
    fraction of the range.
    """
    droop = 0.0
    for value in np.unique(level[level > 0]):
        of_level = deviation[level == value]
        if len(of_level) < MIN_SETTLED:
            continue
        quarter = max(len(of_level) // 4, 3)
        first = float(np.median(of_level[:quarter]))
        last = float(np.median(of_level[-quarter:]))
        droop = max(droop, first - last)
    return droop


def _supply(subject: _Subject) -> Iterator[RecordFault]:
    """A supply whose pressure falls."""
    for name, values in subject.recording.columns.items():
        prefix, _, quantity = name.rpartition(".")
        is_supply = prefix.startswith(SUPPLIES)
        if quantity != "pressure" or not is_supply:
            continue
        low, high = np.quantile(values, [0.02, 0.98])
        if not high > 0.0:
            continue
        loss = float((high - low) / high)
        if loss > MAX_SUPPLY_DROOP:
            text = f"the {name} falls from {high / 1e3:.4g} to {low / 1e3:.4g} kPa"
            remedy = "Use a larger tank or tube, or slower steps."
            yield RecordFault("supply", text, remedy)


def _readings(subject: _Subject) -> Iterator[RecordFault]:
    """Stuck sensors, saturation, spikes and noise."""
    for name, values in subject.sensors():
        if len(values) < MIN_ROWS:
            continue
        noise = _noise(values)
        yield from _stuck(name, values, noise)
        yield from _spikes(name, values, noise)
        top = float(np.max(np.abs(values)))
        smooth = float(np.ptp(np.convolve(values, np.ones(9) / 9, mode="valid")))
        if noise > MAX_NOISE * top and smooth > 3.0 * noise:
            text = f"the noise of the {name} is {100 * noise / top:.0f} % of its greatest reading"
            yield RecordFault("noise", text, "Check the shield and the earth of the cable.")


def _noise(values: Array) -> float:
    """Standard deviation of the noise, by the median magnitude of the second differences."""
    return float(1.4826 * np.median(np.abs(np.diff(values, 2))) / np.sqrt(6.0))


def _stuck(name: str, values: Array, noise: float) -> Iterator[RecordFault]:
    """A long interval of one reading of a sensor that is noisy elsewhere."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    starts = np.concatenate([[0], edges])
    lengths = np.diff(np.concatenate([starts, [len(values)]]))
    longest = int(np.argmax(lengths))
    count = int(lengths[longest])
    others = np.delete(lengths, longest)
    repeats = 1.0 - len(others) / max(len(values) - count, 1)
    if count == len(values):
        if values[0] != 0.0:  # a length, load or pressure that was held and written in every row
            return
        text = f"the {name} is zero in all {count} rows"
        yield RecordFault("dead sensor", text, "Check that the sensor is connected.")
    elif count >= MIN_STUCK and repeats < 0.5 and _alternates(values):
        value = values[starts[longest]]
        is_limit = value in (values.max(), values.min())
        rule = "saturation" if is_limit else "stuck sensor"
        text = (
            f"the {name} has one reading in {count} successive rows from row {starts[longest] + 1}"
        )
        remedy = (
            "Use a sensor or a range that reaches further."
            if is_limit
            else "Check the cable of the sensor and the logger."
        )
        yield RecordFault(rule, text, remedy)


def _alternates(values: Array) -> bool:
    """Whether the readings have noise: their differences change sign from row to row."""
    steps = np.diff(values)
    steps = steps[steps != 0.0]
    return len(steps) > 10 and float(np.mean(steps[1:] * steps[:-1] < 0.0)) > 0.3


def _spikes(name: str, values: Array, noise: float) -> Iterator[RecordFault]:
    """Single readings far from those before and after, which agree."""
    before = values[:-2]
    after = values[2:]
    low, high = np.quantile(values, [0.01, 0.99])
    size = np.abs(values[1:-1] - 0.5 * (before + after))
    steps = np.abs(np.diff(values))
    quiet = 0.3 * size
    is_alone = np.abs(after - before) < quiet
    is_alone[1:] &= steps[:-2] < quiet[1:]  # ripple is no spike
    is_alone[:-1] &= steps[2:] < quiet[:-1]
    limit = max(SPIKE * float(high - low), SPIKE_DEVIATIONS * noise)
    if limit == 0.0:
        return
    rows = np.flatnonzero((size > limit) & is_alone) + 2
    if len(rows):
        count = counted(len(rows), "spike")
        text = f"{count} of the {name}, the first in row {rows[0]}"
        remedy = "Check plugs and cables, or use --outliers drop."
        yield RecordFault("spike", text, remedy)


def _signs(subject: _Subject) -> Iterator[RecordFault]:
    """A motion that has the reverse sign of that of the pressure."""
    recording = subject.recording
    if "pressure" not in recording:
        return
    pressure = recording["pressure"]
    if np.ptp(pressure) < 0.2 * float(np.max(np.abs(pressure))):
        return
    for name in (*CONTRACTING, "length"):
        if name not in recording or _is_still(recording[name]):
            continue
        direction = -1.0 if name == "length" else 1.0
        correlation = direction * float(np.corrcoef(pressure, recording[name])[0, 1])
        if correlation < REVERSED:
            verb = "rises" if name == "length" else "falls"
            text = f"the {name} {verb} as the pressure rises"
            yield RecordFault("sign", text, "Reverse the sign, or map the column to its opposite.")
            break


def _is_still(values: Array) -> bool:
    return float(np.ptp(values)) < 20.0 * _noise(values) or np.ptp(values) == 0.0


def _same_twice(subject: _Subject) -> Iterator[RecordFault]:
    for (first, values), (second, further) in itertools.combinations(subject.sensors(), 2):
        if np.ptp(values) > 0.0 and np.array_equal(values, further):
            text = f"{first} and {second} have equal readings in all rows"
            yield RecordFault("one sensor twice", text, "Check the channels of the logger.")


def _stops(subject: _Subject) -> Iterator[RecordFault]:
    """A motion that ends abruptly while the pressure goes on: an end stop or a limit switch."""
    recording = subject.recording
    if "pressure" not in recording:
        return
    pressure = recording["pressure"]
    span = float(np.ptp(pressure))
    for name, values in subject.sensors():
        quantity = name.rpartition(".")[2]
        if quantity in ("pressure", "force") or _is_still(values) or span == 0.0:
            continue
        motion = -values if quantity == "length" else values
        band = max(4.0 * _noise(values), 0.004 * float(np.ptp(values)))
        at_end = motion > motion.max() - 2.0 * band
        if at_end.mean() < MIN_STOP_SHARE:
            continue
        travel = float(np.ptp(pressure[at_end])) / span
        below = motion.max() - motion
        near = (below > 2.0 * band) & (below < 2.0 * band + 0.15 * float(np.ptp(motion)))
        if travel < MIN_STOP_PRESSURE or near.sum() < 8 or np.ptp(pressure[near]) == 0.0:
            continue
        slope = float(np.polyfit(pressure[near], motion[near], 1)[0])
        mean = float(np.ptp(motion)) / span
        if slope > STOP_SLOPE * mean:
            text = (
                f"the {name} stands still in {100 * at_end.mean():.0f} % of the rows, while the"
                f" pressure changes by {100 * travel:.0f} % of its range"
            )
            yield RecordFault("end stop", text, "Check end stops, limit switches and the sensor.")


def _sizes(subject: _Subject) -> Iterator[RecordFault]:
    """Pressures of a size that no muscle has."""
    lowest, highest = PRESSURES
    for name, values in subject.sensors():
        if name.rpartition(".")[2] != "pressure":
            continue
        top = float(np.max(np.abs(values)))
        if top > 0.0 and not lowest <= top <= highest:
            text = f"the greatest {name} is {top / 1e3:.4g} kPa"
            remedy = "Check its unit."
            yield RecordFault("unit", text, remedy)


def _suspicious(subject: _Subject) -> Iterator[RecordFault]:
    """What no muscle explains, by the checks of a bench."""
    remedies = {}
    for rule in VALUE_RULES:
        first = rule.remedy[:1].upper()
        remedies[rule.name] = f"{first}{rule.remedy[1:]}."
    bench = bench_data([subject.recording])
    for finding in apply_rules(VALUE_RULES, bench):
        remedy = remedies[finding.rule]
        yield RecordFault("value", finding.text, remedy)


RULES: Sequence[Rule] = (
    _length,
    _times,
    _exchanged,
    _following,
    _supply,
    _readings,
    _signs,
    _same_twice,
    _stops,
    _sizes,
    _suspicious,
)
"""All rules, in the order of the report."""
