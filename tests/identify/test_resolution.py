"""No detector depends on the last digits: readings that jitter by rounding, or by one count of their
column, give the same saturation, holds, levels, groups, branches and steps as those that do not.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from airmuscle.bench import inspection
from airmuscle.bench.diagnosis import contradictions, data_checks, matched_rows
from airmuscle.bench.dynamics import regulator_fit
from airmuscle.bench.estimation import LevelSplit, cross_validation, levels_of, weighting
from airmuscle.bench.hysteresis import find_holds, find_loops, loop_data
from airmuscle.bench.joint import episode_inspection
from airmuscle.recording import Recording

COUNTS = {"pressure": 200.0, "length": 1e-4, "force": 0.5, "setpoint": 500.0}
"""Steps of the readings [SI]."""
LIMIT = 300.0
"""Upper limit of the force sensor [N]."""
RESTING_LENGTH = 0.3
JITTERS = ("none", "rounding", "count")
ROWS = 1500


def isometric(jitter: str, seed: int = 0) -> Recording:
    """A triangle of the pressure at a held length; the force sensor saturates, a column names the
    two branches."""
    random = np.random.default_rng(seed)
    time = 0.02 * np.arange(ROWS)
    share = np.interp(time, [0.0, 15.0, 30.0], [0.0, 1.0, 0.0])
    columns = {
        "pressure": 6e5 * share + random.normal(0.0, 300.0, ROWS),
        "length": np.full(ROWS, 0.28),
        "force": 420.0 * share + 12.0 * np.sign(15.0 - time) + random.normal(0.0, 1.0, ROWS),
        "setpoint": 1e5 * np.floor(1e-9 + time / 5.0),
    }
    columns = {name: COUNTS[name] * np.round(v / COUNTS[name]) for name, v in columns.items()}
    columns["force"] = np.minimum(columns["force"], LIMIT)
    columns["label"] = np.where(time < 15.0, 1.0, 2.0)
    return with_jitter(Recording({"time": time, **columns}, "ramp"), jitter, seed)


def hold(jitter: str, seed: int = 0) -> Recording:
    """A motion at constant pressure, then two minutes at a held length."""
    random = np.random.default_rng(seed)
    time = 0.1 * np.arange(ROWS)
    contraction = 0.1 * np.clip((time - 2.0) / 0.5, 0.0, 1.0)
    force = 400.0 - 2000.0 * contraction + 20.0 * np.exp(-np.maximum(time - 2.5, 0.0) / 20.0)
    columns = {
        "pressure": np.full(ROWS, 3e5) + random.normal(0.0, 300.0, ROWS),
        "length": RESTING_LENGTH * (1.0 - contraction),
        "force": force + random.normal(0.0, 1.0, ROWS),
    }
    columns = {name: COUNTS[name] * np.round(v / COUNTS[name]) for name, v in columns.items()}
    return with_jitter(Recording({"time": time, **columns}, "hold"), jitter, seed)


def with_jitter(recording: Recording, jitter: str, seed: int) -> Recording:
    """The recording with each reading times 1 + 1e-12 N(0, 1); or with held lengths that drift by
    one count, forces at the limit that jitter by one, and a command that does."""
    random = np.random.default_rng([seed, 1])
    columns = dict(recording.columns)
    if jitter == "rounding":
        columns = {
            name: values * (1.0 + 1e-12 * random.standard_normal(len(recording)))
            for name, values in columns.items()
        }
    elif jitter == "count":
        down = random.random(len(recording)) < 0.5
        late = np.arange(len(recording)) > 0.7 * len(recording)
        force = columns["force"]
        columns["length"] = columns["length"] + COUNTS["length"] * late
        columns["force"] = force - COUNTS["force"] * (down & (force == LIMIT))
        if "setpoint" in columns:
            columns["setpoint"] = columns["setpoint"] + COUNTS["setpoint"] * down
    columns["contraction"] = 1.0 - columns["length"] / RESTING_LENGTH
    constants = {"resting_length": RESTING_LENGTH}
    return dataclasses.replace(recording, columns=columns, constants=constants)


def rows_near(value: float, scale: int = 10) -> int:
    """A number of rows, or a row, to a fraction of the record."""
    return round(value / scale)


def sensor_limits(jitter):
    sensors = inspection.estimate_sensors(isometric(jitter))
    return {
        name: (
            sensors[name].upper_limit == pytest.approx(LIMIT, abs=COUNTS["force"] * 1.01)
            if np.isfinite(sensors[name].upper_limit)
            else None,
            bool(np.isfinite(sensors[name].lower_limit)),
        )
        for name in ("pressure", "length", "force")
    }


def resolutions(jitter):
    sensors = inspection.estimate_sensors(isometric(jitter))
    return {name: float(f"{sensors[name].resolution:.4g}") for name in ("pressure", "force")}


def saturated_rows(jitter):
    recording = isometric(jitter)
    signs = inspection.estimate_sensors(recording)["force"].censoring(recording["force"])
    limits = weighting.force_limits([recording])
    assert np.array_equal(limits.signs(recording["force"]), signs)
    return rows_near(np.count_nonzero(signs == -1.0), 20), np.count_nonzero(signs == 1.0)


def saturation_findings(jitter):
    texts = [finding.text for finding in inspection.inspect(isometric(jitter)).findings]
    return [text.partition(" limit, ")[0] for text in texts]


def run_kinds(jitter):
    return [
        [(run.kind.name, run.constant_column, run.swept_columns) for run in inspection.find_runs(r)]
        for r in (isometric(jitter), hold(jitter))
    ]


def branch_names(jitter):
    return [
        [(b.name, rows_near(b.interval.start)) for b in inspection.find_branches(r)]
        for r in (isometric(jitter), hold(jitter))
    ]


def quasi_static(jitter):
    return [
        rows_near(np.count_nonzero(inspection.quasi_static_rows(r)), 15)
        for r in (isometric(jitter), hold(jitter))
    ]


def plateaus(jitter):
    return [
        [
            tuple(map(rows_near, (p.interval.start, p.interval.stop)))
            for p in inspection.find_plateaus(r, columns=("pressure", "length"))
        ]
        for r in (isometric(jitter), hold(jitter))
    ]


def rates(jitter):
    recording = isometric(jitter)
    return [float(f"{inspection.rate_of_change(recording, n):.1g}") for n in ("pressure", "length")]


def outliers(jitter):
    return [inspection.find_outliers(r) for r in (isometric(jitter), hold(jitter))]


def holds(jitter):
    return [
        (h.quantity, rows_near(h.interval.start), rows_near(h.interval.stop))
        for h in find_holds(hold(jitter))
    ]


def loop(jitter):
    (one,) = find_loops([isometric(jitter)])
    return one.run.kind.name, rows_near(np.count_nonzero(one.fitted_rows), 25)


def levels(jitter):
    held, share = cross_validation.held_levels(isometric(jitter)["contraction"])
    return len(held), round(share, 3), len(levels_of(isometric(jitter)["contraction"], 5))


def groups(jitter):
    labels = LevelSplit("contraction").labels([isometric(jitter), hold(jitter)])
    alone = LevelSplit("contraction").labels([isometric(jitter)])
    return len(np.unique(np.concatenate(labels))), len(np.unique(alone[0]))


def labels_of_rows(jitter):
    matches = matched_rows.match_rows([isometric(jitter), isometric(jitter, seed=5)])
    return [
        {name: round(value, 6) for name, value in run.first.labels.items()} for run in matches.runs
    ]


def repeated_rows(jitter):
    if jitter == "count":  # a copy has no other counts
        jitter = "none"
    recordings = [isometric("none"), isometric(jitter)]
    return [
        (r.recording, r.rows)
        for r in contradictions.find_repeated_rows(recordings, inspection.POINT_COLUMNS)
    ]


def command_changes(jitter):
    instants, values = regulator_fit._changes(isometric(jitter))
    return [(round(t, 6), round(v / 1e4)) for t, v in zip(instants, values, strict=True)]


def pressure_saturation(jitter):
    notes = data_checks.saturation_notes([clipped_pressure(jitter)])
    return [note.partition(" at ")[0] for note in notes]


def clipped_pressure(jitter: str) -> Recording:
    """An isometric ramp whose pressure sensor ends at 4 bar."""
    ramp = isometric("none")
    limited = np.minimum(ramp["pressure"], 4e5)
    random = np.random.default_rng(2)
    if jitter == "count":
        limited = limited - COUNTS["pressure"] * ((limited == 4e5) & (random.random(ROWS) < 0.5))
    if jitter == "rounding":
        limited = limited * (1.0 + 1e-12 * random.standard_normal(ROWS))
    return ramp.with_columns(
        pressure=limited, force=np.minimum(ramp["force"], 250.0 + ramp["force"] / 10.0)
    )


def end_of_an_episode(jitter):
    values = clipped_pressure(jitter)["pressure"]
    sensor = inspection.estimate_sensors(clipped_pressure(jitter))["pressure"]
    return round(episode_inspection._end_of_readings(values, sensor) / 1e3)


def stiffness(jitter):
    recording = hold("rounding" if jitter == "rounding" else "none")
    path = RESTING_LENGTH * recording["contraction"]
    return float(f"{loop_data.resolved_stiffness(path, recording['force']):.3g}")


def sampling(jitter):
    recording = isometric(jitter)
    doubled = np.repeat(recording["time"][::2], 2)[:ROWS]
    if jitter == "rounding":
        doubled = doubled * (1.0 + 1e-12 * np.random.default_rng(3).standard_normal(ROWS))
    both = (
        inspection.analyse_sampling(recording),
        inspection.analyse_sampling(recording.with_columns(time=doubled)),
    )
    return [(len(s.gaps), len(s.repeated_rows), len(s.backward_rows), s.rounded) for s in both]


DETECTORS = (
    sensor_limits,
    resolutions,
    saturated_rows,
    saturation_findings,
    run_kinds,
    branch_names,
    quasi_static,
    plateaus,
    rates,
    outliers,
    holds,
    loop,
    levels,
    groups,
    labels_of_rows,
    repeated_rows,
    command_changes,
    pressure_saturation,
    end_of_an_episode,
    stiffness,
    sampling,
)


@pytest.mark.parametrize("detector", DETECTORS, ids=lambda detector: detector.__name__)
@pytest.mark.parametrize("jitter", JITTERS[1:])
def test_a_detector_gives_the_same_with_and_without_jitter(detector, jitter):
    assert detector(jitter) == detector("none")


def test_the_records_show_what_the_detectors_look_for():
    assert saturated_rows("none")[0] > 5
    assert sensor_limits("none")["force"] == (True, False)
    assert sensor_limits("none")["pressure"] == (None, False)
    assert run_kinds("none")[0] == [("isometric", "contraction", ("pressure", "force"))]
    assert holds("none")[-1] == ("force", 3, 150)
    assert len(branch_names("none")[0]) == 2
    assert len(command_changes("none")) == 6
    assert pressure_saturation("none")
    assert end_of_an_episode("none") == 400
    assert repeated_rows("none")
    assert labels_of_rows("none")
    assert groups("none")[1] == 1
    assert sampling("none")[1][3]


@pytest.mark.parametrize("noise", [0.3, 0.5, 1.0, 3.0])
def test_a_hold_with_noise_is_no_saturation(noise):
    """Readings of a held value lie on both sides of it, some of them far above."""
    random = np.random.default_rng(4)
    level = np.interp(np.arange(2000), [0, 600, 1400, 2000], [0.0, 300.0, 300.0, 0.0])
    force = np.round(level + random.normal(0.0, noise, 2000))
    recording = Recording({"time": 0.01 * np.arange(2000), "force": force}, "hold")
    assert inspection.estimate_sensors(recording)["force"].upper_limit == np.inf
