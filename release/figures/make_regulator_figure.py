"""Figure docs/images/regulator.png and the errors of docs/guides/regulators.md: published
responses of a regulator and models.

Run python release/figures/make_regulator_figure.py. The published numbers are in
files/library/data/smc-itv2050.toml.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np

import airmuscle as am
from airmuscle.core.arrays import Array
from airmuscle.core.plotting import DASHES, LINES, MARKERS, new_figure, save
from airmuscle.engine import RungeKutta4
from airmuscle.files.library.folders import DATA

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "regulator.png"
FACTS = tomllib.loads((DATA / "smc-itv2050.toml").read_text(encoding="utf-8"))
STEP = 1e-3
HOLD = 0.02
"""Spacing of the computed pressures and of the commands [s]; the measured commands were sent at 50
Hz.
"""
AMBIENT = 0.1013
"""Ambient pressure of the published models [MPa]."""
REVERSAL_SPAN = 0.045
"""Time [s] after the end of a hold up to which a reversal is followed: with it model O gives its
printed 0.45.
"""
OFF_DIAGONAL = ~np.eye(7, dtype=bool)

Response = Callable[[Array], Array]
"""Pressures [MPa] every STEP for commands [MPa] every STEP, from rest at the first command."""


def plant_response(plant: am.Plant) -> Response:
    """Response of a plant with a pressure regulator."""

    def response(command: Array) -> Array:
        rows = np.flatnonzero(np.concatenate([[True], np.diff(command) != 0.0]))
        signal = am.Schedule({"setpoint": [(k * STEP, 1e6 * command[k]) for k in rows.tolist()]})
        start = plant.state_at(pressure=1e6 * float(command[0]))
        end = STEP * (len(command) - 1)
        run = am.simulate(
            plant,
            signal,
            duration=end,
            initial_state=start,
            integrator=RungeKutta4(STEP),
            output_times=STEP,
        )
        return 1e-6 * np.asarray(run["pressure"])

    return response


def _flow(upstream: float, downstream: float, critical_ratio: float) -> float:
    """Flow function of ISO 6358 of absolute pressures [MPa], without the conductance."""
    ratio = (downstream / upstream - critical_ratio) / (1.0 - critical_ratio)
    return (
        upstream * float(np.sqrt(max(1.0 - max(ratio, 0.0) ** 2, 0.0)))
        if downstream < upstream
        else 0.0
    )


def published_response(name: str) -> Response:
    """Response of a published model: S lag, O limited lag, B pilot with dead zone, BL the same with
    leak.
    """
    c = {"lag": 0.0, "leak": 0.0, "proportional": 0.0, **FACTS["models"][name]}

    def rate(p: float, w: float, e: float) -> float:
        x = w + c["proportional"] * e - p
        d = c["dead_zone"]
        leak = c["leak"]
        outside = c["gain_fill"] * max(x - d, 0.0) - c["gain_discharge"] * max(-x - d, 0.0)
        return outside + leak * min(max(x, -d), d)

    def response(command: Array) -> Array:
        late = round(1e-3 * c["dead_time"] / STEP)
        delayed = np.concatenate([np.full(late, command[0]), command])[: len(command)]
        p = w = float(command[0])
        pressures = []
        for u in delayed.tolist():
            pressures.append(p)
            wanted = (u - p) / (1e-3 * c["lag"]) if c["lag"] else rate(p, w, u - p)
            if "fill" in c:
                highest = c["fill"] * _flow(c["supply"] + AMBIENT, p + AMBIENT, c["critical_ratio"])
                lowest = -c["discharge"] * _flow(p + AMBIENT, AMBIENT, c["critical_ratio"])
                wanted = min(max(wanted, lowest), highest)
            w = min(max(w + STEP * c.get("integral", 0.0) * (u - p), 0.0), c.get("supply", 1.0))
            p += STEP * wanted
        return np.array(pressures)

    return response


def step_from(response: Response, first: float, second: float) -> Array:
    """Pressures every STEP for 2 s after a step that follows 1 s of rest."""
    rest = round(1.0 / STEP)
    return response(np.concatenate([np.full(rest, first), np.full(2 * rest, second)]))[rest:]


def time_to(pressures: Array, part: float, first: float, second: float) -> float:
    """Time [ms] until a part of a step is reached; NaN if it is not."""
    reached = np.flatnonzero((pressures - first) / (second - first) >= part)
    return 1e3 * STEP * float(reached[0]) if reached.size else float("nan")


def step_tables(response: Response) -> tuple[Array, Array]:
    """Time constants and dead times [ms] of all steps between the levels, (7, 7) each, zero on the
    diagonal.
    """
    levels = FACTS["steps"]["levels"]
    times = np.zeros((7, 7))
    dead = np.zeros((7, 7))
    for i, j in np.argwhere(OFF_DIAGONAL).tolist():
        pressures = step_from(response, levels[i], levels[j])
        last = float(pressures[-100:].mean())
        dead[i, j] = time_to(pressures, 0.1, float(pressures[0]), last)
        times[i, j] = time_to(pressures, 0.632, float(pressures[0]), last) - dead[i, j]
    return times, dead


def ratio_of(response: Response, frequency: float, amplitude: float) -> float:
    """Ratio of the amplitudes of pressure and command, of a sine of 3 s about 0.3 MPa that fades
    in, held at 50 Hz.
    """
    time = STEP * np.arange(round(3.0 / STEP))
    held = np.floor(time / HOLD + 1e-9) * HOLD
    command = 0.3 + amplitude * np.minimum(held / 0.5, 1.0) * np.sin(2.0 * np.pi * frequency * held)
    rows = time >= 3.0 - 2.0 / min(frequency, 1.5) - 1e-9
    turning = np.exp(2j * np.pi * frequency * time[rows])
    pressures = response(command)
    output, given = (np.mean((x[rows] - x[rows].mean()) * turning) for x in (pressures, command))
    return float(abs(output) / abs(given))


def amplitude_map(response: Response) -> Array:
    """The ratios at all frequencies and amplitudes of the map, shape (9, 9)."""
    given = FACTS["map"]
    return np.array(
        [[ratio_of(response, f, a) for a in given["amplitude"]] for f in given["frequency"]]
    )


def lag_ratio() -> Array:
    """Ratio of the lag to which the map is relative, shape (9, 1)."""
    frequency = np.array(FACTS["map"]["frequency"])[:, None]
    return 1.0 / np.hypot(1.0, 2.0 * np.pi * frequency * 1e-3 * FACTS["map"]["lag"])


def random_steps(seed: int, duration: float = 90.0) -> list[tuple[float, float]]:
    """Steps with holds of 40 to 400 ms, distributed as those of the record of the reversals: time
    [s], level [MPa].
    """
    rng = np.random.default_rng(seed)
    time = 1.0
    level = 0.3
    steps = [(0.0, level)]
    while time < duration:
        hold = rng.uniform(0.04, 0.4)
        kind = rng.random()
        sign = rng.choice([-1.0, 1.0])
        low, high = (0.005, 0.03) if kind < 0.55 else (0.03, 0.1) if kind < 0.9 else (0.1, 0.3)
        level = float(np.clip(level + sign * rng.uniform(low, high), 0.08, 0.55))
        steps.append((time, level))
        time += HOLD * max(2, round(hold / HOLD))
    return steps


def reversal_part(response: Response, seeds: tuple[int, ...] = (0, 3)) -> float:
    """Mean part that is reached of steps up to 30 kPa against the last change, at most 0.2 s after
    it.
    """
    parts = []
    for seed in seeds:
        steps = random_steps(seed)
        instants, levels = np.array(steps).T
        time = STEP * np.arange(round((instants[-1] + 0.5) / STEP))
        pressures = response(levels[np.searchsorted(instants, time + 1e-9, side="right") - 1])
        for k in range(2, len(steps) - 1):
            last = levels[k - 1] - levels[k - 2]
            size = levels[k] - levels[k - 1]
            if (
                0.004 <= abs(size) <= 0.03
                and last * size < 0
                and instants[k] - instants[k - 1] <= 0.2 + 1e-9
            ):
                rows = slice(
                    round(instants[k] / STEP), round((instants[k + 1] + REVERSAL_SPAN) / STEP) + 1
                )
                moved = np.sign(size) * pressures[rows]
                parts.append((moved[np.argmin(moved) :].max() - moved.min()) / abs(size))
    return float(np.mean(parts))


def small_steps(response: Response) -> list[float]:
    """Parts that steps of 20, 40 and 80 kPa up and down from 0.3 MPa reach 0.8 to 0.95 s after
    them.
    """
    sizes = [0.02, -0.02, 0.04, -0.04, 0.08, -0.08]
    rows = slice(round(0.8 / STEP), round(0.95 / STEP))
    return [float(step_from(response, 0.3, 0.3 + d)[rows].mean() - 0.3) / d for d in sizes]


def rms(differences: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(differences))))


def errors(response: Response) -> dict[str, float]:
    """Errors of a model by the published tables and map, and its values in the three tests."""
    times, dead = step_tables(response)
    ratios = amplitude_map(response)
    lag = lag_ratio()
    published = np.array(FACTS["map"]["value"])
    parts = small_steps(response)
    return {
        "time constant, rms [ms]": rms(
            (times - np.array(FACTS["steps"]["time_constant"]))[OFF_DIAGONAL]
        ),
        "dead time, rms [ms]": rms((dead - np.array(FACTS["steps"]["dead_time"]))[OFF_DIAGONAL]),
        "map, rms": rms(ratios / lag - published),
        "ratio, rms": rms(ratios - published * lag),
        "40 kPa at 4 Hz": float(ratios[5, 2]),
        "small step, lowest": min(parts),
        "small step, highest": max(parts),
        "reversal": reversal_part(response),
    }


def free_surface_errors() -> dict[str, float]:
    """Rms [ms, 1] that freely chosen surfaces leave of the published numbers: a bound for any
    smooth model.

    Of the step tables a value for each start and each command in both directions (22), of the map a
    cubic polynomial of the logarithms of frequency and amplitude (10).
    """
    i, j = np.nonzero(OFF_DIAGONAL)
    design = np.array(
        [(x == k) & side for side in (i < j, i > j) for x in (i, j) for k in range(7)], dtype=float
    ).T
    found = {}
    for name in ("time_constant", "dead_time"):
        found[name] = _residual(design, np.array(FACTS["steps"][name])[OFF_DIAGONAL])
    f, a = np.meshgrid(
        np.log(FACTS["map"]["frequency"]), np.log(FACTS["map"]["amplitude"]), indexing="ij"
    )
    cubic = np.array([f**m * a**n for m in range(4) for n in range(4 - m)]).reshape(10, -1).T
    return {**found, "map": _residual(cubic, np.array(FACTS["map"]["value"]).ravel())}


def _residual(design: Array, values: Array) -> float:
    return rms(design @ np.linalg.lstsq(design, values, rcond=None)[0] - values)


def figure(response: Response) -> None:
    """Draw time constants and dead times over the size of the step, and the ratios over the
    amplitude.
    """
    times, dead = step_tables(response)
    ratios = amplitude_map(response)
    levels = np.array(FACTS["steps"]["levels"])
    size = (levels[None, :] - levels[:, None])[OFF_DIAGONAL]
    shown, axes = new_figure(1, 2, width=9.5, height=3.8)
    pairs = (
        (FACTS["steps"]["time_constant"], times, "time constant"),
        (FACTS["steps"]["dead_time"], dead, "dead time"),
    )
    for (published, modelled, name), colour, marker in zip(pairs, LINES, MARKERS, strict=False):
        axes[0].plot(
            size,
            np.array(published)[OFF_DIAGONAL],
            marker,
            mfc="none",
            color=colour,
            label=f"{name}, published",
        )
        for steps in (0.1 * np.arange(-6, 0), 0.1 * np.arange(1, 7)):
            means = [modelled[OFF_DIAGONAL][np.isclose(size, d)].mean() for d in steps]
            axes[0].plot(
                steps, means, color=colour, label=f"{name}, model (mean)" if steps[0] > 0 else None
            )
    axes[0].set(xlabel="step of the command [MPa]", ylabel="time [ms]", title="Step table")
    amplitude = 1e3 * np.array(FACTS["map"]["amplitude"])
    published = np.array(FACTS["map"]["value"]) * lag_ratio()
    for k, colour, marker, dashes in zip((0, 2, 3, 4, 5), LINES, MARKERS, DASHES, strict=False):
        label = f"{FACTS['map']['frequency'][k]:g} Hz"
        axes[1].plot(amplitude, published[k], marker, mfc="none", color=colour)
        axes[1].plot(amplitude, ratios[k], linestyle=dashes, color=colour, label=label)
    axes[1].set(
        xlabel="amplitude of the command [kPa]",
        ylabel="pressure/command",
        title="Sines: published (markers), model",
    )
    axes[0].legend(fontsize=7)
    axes[1].set_ylim(-0.03, 1.38)
    axes[1].legend(fontsize=7, ncols=5, loc="upper center")
    save(shown, PICTURE)


if __name__ == "__main__":
    fitted = plant_response(am.load("vessel-smc-itv2050").plant)
    table = {name: errors(published_response(name)) for name in FACTS["models"] if name != "source"}
    table["PressureRegulator"] = errors(fitted)
    for quantity in table["PressureRegulator"]:
        print(
            f"{quantity:26}",
            "  ".join(f"{name} {row[quantity]:.3g}" for name, row in table.items()),
        )
    print(
        "freely chosen surfaces, rms:",
        {name: round(value, 3) for name, value in free_surface_errors().items()},
    )
    figure(fitted)
