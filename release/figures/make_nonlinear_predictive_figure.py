"""Figure docs/images/nonlinear_predictive.png: linear and nonlinear model predictive control of a
lift.

Run python release/figures/make_nonlinear_predictive_figure.py. The muscle is the DMSP-20-300 of
the library; all else is chosen.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import airmuscle as am
from airmuscle.control import ExtendedKalmanFilter, NonlinearModelPredictive, design_predictive
from airmuscle.core.plotting import BLACK, DASHES, LINES, legend_below, new_figure, save
from airmuscle.engine import ControlLoop
from airmuscle.physics import linearise

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "nonlinear_predictive.png"
H = 0.01
STEP = 20e-3
LIMIT = 0.06
DISCHARGE = 0.3


def main() -> None:
    """Simulate both controllers and save the figure."""
    muscle = replace(am.load("dmsp-20-300").muscle, damper=am.LinearDamper(300.0))
    valve = am.Valve(1e-9, 0.35)
    plant = am.Plant(muscle, am.FillDischarge(am.Supply(6e5), valve, valve), am.HangingMass(10.0))
    rest = am.find_equilibrium(plant, pressure=2e5)
    flow = {
        name: plant.outputs(rest, {"fill": 0.0, "discharge": 0.0, name: 1.0})["mass_flow"]
        for name in plant.inputs
    }
    operating = {"fill": -DISCHARGE * flow["discharge"] / flow["fill"], "discharge": DISCHARGE}
    noise = {"air_mass": 1e-6, "speed": 0.02, "speed.disturbance": 1.0}
    sensor = {"position": 1e-5}
    permitted = {"position": 1e-3, "fill": 0.2}
    limits = {"speed": (-LIMIT, LIMIT)}
    observer = ExtendedKalmanFilter(plant, ("position",), H, noise, sensor, disturbances=("speed",))
    first = observer.start(rest, {"air_mass": 1e-6, "speed.disturbance": 0.5})
    laws = {
        "linear": design_predictive(
            linearise(plant, rest, operating).select(inputs=["fill"]),
            H,
            measured=("position",),
            controlled=("position",),
            disturbed=("speed",),
            permitted=permitted,
            process_noise=noise,
            measurement_noise=sensor,
            limits=limits,
            slack_weight=1e7,
        ),
        "nonlinear": NonlinearModelPredictive(
            observer,
            first,
            operating,
            ("position",),
            ("fill",),
            permitted,
            limits,
            slack_weight=1e7,
        ),
    }
    wanted = am.Schedule({"position": ((0.0, rest["position"]), (0.1, rest["position"] + STEP))})
    figure, axes = new_figure(1, 3, width=9.0, height=3.2)
    for i, (name, law) in enumerate(laws.items()):
        loop = ControlLoop(law, H, wanted, am.Schedule({"discharge": ((0.0, DISCHARGE),)}))
        run = am.simulate(plant, loop, duration=1.2, initial_state=rest, output_times=2e-3)
        time = run["time"]
        style = {"color": LINES[i], "linestyle": DASHES[i], "label": name}
        for panel, values in zip(
            axes,
            (1e3 * (run["position"] - rest["position"]), run["speed"], run["command.fill"]),
            strict=True,
        ):
            panel.plot(time, values, **style)
        print(
            f"{name}: maximum speed {run['speed'].max():.4f} m/s, final error "
            f"{1e3 * (rest['position'] + STEP - run['position'][-1]):.3f} mm"
        )
    axes[0].plot(
        [0.0, 0.1, 0.1, 1.2],
        1e3 * np.array([0.0, 0.0, STEP, STEP]),
        color=BLACK,
        linewidth=0.7,
        label="set point, limit",
    )
    axes[1].axhline(LIMIT, color=BLACK, linewidth=0.7)
    for panel, label in zip(
        axes,
        ("position from rest [mm]", "speed [m/s]", "opening of the fill valve [1]"),
        strict=True,
    ):
        panel.set(xlabel="time [s]", ylabel=label)
    legend_below(figure, axes[0], columns=3)
    save(figure, PICTURE)


if __name__ == "__main__":
    main()
    print(f"wrote {PICTURE}")
