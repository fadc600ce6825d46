"""Figure docs/images/tubes.png: lumped tubes compared with a distributed tube. Run python
release/figures/make_tubes_figure.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from airmuscle.core.plotting import DASHES, LINES, MARKERS, new_figure, save
from airmuscle.engine import simulate
from airmuscle.engine.loop.inputs import Schedule
from airmuscle.engine.run.integrators import Rodas4
from airmuscle.physics import (
    Braid,
    DistributedTube,
    FillDischarge,
    Isometric,
    Muscle,
    Supply,
    Tube,
    Valve,
    VirtualWork,
    WithTubes,
)
from airmuscle.physics.plant.plant import Plant
from airmuscle.physics.pneumatics.gas import Air, Isothermal

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "tubes.png"
DIAMETER = 4e-3
PRESSURE = 6e5
LENGTHS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
SMALL = "C = 0.26 dm³/(s bar)"
LARGE = "C = 1 dm³/(s bar)"
VALVES = {SMALL: 2.6167e-9, LARGE: 1e-8}
REFERENCE_SEGMENTS = 40
"""Number of segments of the distributed reference tube."""


def fill(
    tube: Tube | DistributedTube, conductance: float, duration: float = 0.6, spacing: float = 5e-4
) -> Any:
    """Simulated filling of a muscle of 20 mm and 300 mm, fixed at 10 %, from 6 bar through a valve
    and a tube.
    """
    braid = Braid(0.010, 0.426, 0.300)
    valve = Valve(conductance, 0.433)
    circuit = WithTubes(FillDischarge(Supply(PRESSURE), valve, valve), tube)
    plant = Plant(Muscle(VirtualWork(braid), braid), circuit, Isometric(0.1), Isothermal())
    start = plant.state_at(pressure=0.0)
    opened = Schedule({"fill": ((0.0, 1.0),)})
    return simulate(
        plant,
        opened,
        duration=duration,
        initial_state=start,
        integrator=Rodas4(1e-6),
        output_times=spacing,
    )


def lumped(length: float, segment_count: int) -> Tube:
    """Tube without inertia, by its dimensions."""
    return Tube.from_dimensions(length, DIAMETER, segment_count)


def max_error(
    length: float, segment_count: int, conductance: float, reference: int = REFERENCE_SEGMENTS
) -> float:
    """Maximum error of the pressure in the muscle, as a fraction of the gauge pressure of the
    supply.
    """
    exact = fill(DistributedTube(length, DIAMETER, reference), conductance)["pressure"]
    return (
        float(np.abs(fill(lumped(length, segment_count), conductance)["pressure"] - exact).max())
        / PRESSURE
    )


def draw() -> Any:
    """Figure: step response of the flow into the muscle (left), maximum error over the length
    (right).
    """
    figure, (left, right) = new_figure(1, 2, width=9.0, height=3.4)
    conductance = VALVES[LARGE]
    tubes = {
        "distributed, 40 segments": DistributedTube(2.0, DIAMETER, REFERENCE_SEGMENTS),
        "lumped, 1 segment": lumped(2.0, 1),
        "lumped, 5 segments": lumped(2.0, 5),
    }
    for i, (name, tube) in enumerate(tubes.items()):
        run = fill(tube, conductance, 0.04, 2e-5)
        left.plot(
            run["time"] * 1e3,
            run["mass_flow"] * 1e3,
            color=LINES[i],
            linestyle=DASHES[i],
            label=name,
        )
    left.axvline(
        2.0 / Isothermal().sound_speed(Air(1e5, 293.15)) * 1e3,
        color="0.5",
        linewidth=0.8,
        linestyle=":",
    )
    left.set(
        xlabel="time after opening of the valve [ms]",
        ylabel="flow into the muscle [g/s]",
        xlim=(0, 40),
    )
    left.set_title(f"2 m of 4 mm behind a valve with {LARGE}; dotted: L/c")
    left.legend(loc="upper left", bbox_to_anchor=(0.25, 0.5))
    for i, (name, size) in enumerate(VALVES.items()):
        for count, style in ((1, "-"), (5, "--")):
            errors = [100 * max_error(length, count, size) for length in LENGTHS]
            label = f"valve with {name}, {count} segment{'s' * (count > 1)}"
            right.loglog(LENGTHS, errors, style, color=LINES[i], marker=MARKERS[i], label=label)
    right.set(xlabel="length of the tube [m]", ylabel="maximum pressure error [% of supply]")
    right.set_title("error of lumped tubes of 4 mm during filling")
    right.set_ylim(0.05, 100)
    right.set_yticks([0.1, 1, 10], ["0.1", "1", "10"])
    right.legend(loc="upper left")
    ticks = [0.25, 0.5, 1, 2, 4, 8]
    right.set_xticks(ticks, [f"{t:g}" for t in ticks])
    right.minorticks_off()
    return figure


if __name__ == "__main__":
    save(draw(), PICTURE)
    print(f"wrote {PICTURE}")
