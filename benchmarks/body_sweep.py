"""Bodies with routes: time of the sweep over all poses, of the study, and of the choice of muscles,
for 12 and for 80 routes; of the search of places of points for 27 routes in 5 configurations.
"""

from __future__ import annotations

import functools
import importlib.util
import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from measure import Section, format_time, print_section

import airmuscle as am

TITLE = "Bodies with routes"
HEADER = ("body", "step", "time of the processor")
TEXT = (
    "Limbs of three hinges with a pair of routes at each; of 80 routes, further ones cross two and"
    " three hinges, so that their grid has 101^2 and 25^3 poses. Sweep: least and greatest length"
    " to 0.1 mm and moment arms. Study: with gravity in 1024 poses and clearances. Choice: muscles"
    " of the catalogue at 6 bar. Moved points: both ends of 27 routes within 20 mm, for curves of 9"
    " angles in each of 5 configurations, with 1 to 3 muscles of one product, with and without a"
    " tackle; 16 starts of each. MuJoCo computes each pose."
)
NAMES = ("hip", "knee", "ankle")
HALF = 0.03
"""Distance [m] of the routes from the axis of a limb."""


def limb(number: int, further: int) -> tuple[str, str]:
    """Bodies and routes of a limb, with pairs at its hinges and further routes."""
    place = 0.3 * number
    opening = ""
    for joint in NAMES:
        height = 0.0 if joint == "hip" else -0.4
        opening += (
            f'<body pos="{place if joint == "hip" else 0} 0 {height}">'
            f'<joint name="{joint}_{number}" axis="0 1 0" range="-20 20"/>'
            f'<geom type="capsule" size="0.01" fromto="0 0 -0.05 0 0 -0.3" mass="0.4"/>'
            + "".join(
                f'<site name="{joint}_{number}_{side}_{end}" pos="{sign * HALF} 0 {z}"/>'
                for side, sign in (("front", 1), ("back", -1))
                for end, z in (("top", -0.05), ("low", -0.1))
            )
        )
    stand = "".join(
        f'<site name="stand_{number}_{side}" pos="{place + sign * HALF} 0 0.35"/>'
        for side, sign in (("front", 1), ("back", -1))
    )
    origins = [f"stand_{number}_{{side}}", *(f"{j}_{number}_{{side}}_top" for j in NAMES[:2])]
    insertions = [f"{joint}_{number}_{{side}}_low" for joint in NAMES]
    spans = [(0, 0), (1, 1), (2, 2), *[(0, 1), (1, 2), (0, 2)][:further]]
    routes = "".join(
        f'<spatial name="r{number}_{first}{last}_{side}">'
        f'<site site="{origins[first].format(side=side)}"/>'
        f'<site site="{insertions[last].format(side=side)}"/></spatial>'
        for first, last in spans
        for side in ("front", "back")
    )
    return stand + opening + "</body>" * len(NAMES), routes


def body_text(limbs: int, further: int) -> str:
    """MJCF of limbs side by side."""
    parts = [limb(number, further) for number in range(limbs)]
    return (
        '<mujoco><compiler angle="degree"/><worldbody>'
        + "".join(bodies for bodies, _ in parts)
        + "</worldbody><tendon>"
        + "".join(routes for _, routes in parts)
        + "</tendon></mujoco>"
    )


BODIES = {"12 routes": body_text(2, 0), "80 routes": body_text(8, 2)}


def steps(path: Path) -> dict[str, Callable[[], object]]:
    """The steps that are timed."""
    body = am.design.read_body(path)
    study = am.design.study_body(body)
    conditions = am.design.SizingConditions(supply="6 bar")
    return {
        "sweep": functools.partial(am.design.sweep_routes, body),
        "study": functools.partial(am.design.study_body, body),
        "choice of muscles": functools.partial(am.design.fit_out, study, conditions),
    }


ROUTED = 27
ANGLES = (-20, -15, -10, -5, 0, 5, 10, 15, 20)
CONFIGURATIONS = (2.0, 3.0, 4.0, 5.0, 6.0)
"""Greatest torque [N m] of each configuration."""


def curves(body: am.design.Body) -> str:
    """CSV of the torques of the first routes: a part of a sine over the angle, by configuration."""
    lines = ["route,joint,angle [deg],torque [N m],configuration"]
    for route in body.routes[:ROUTED]:
        sign = -1.0 if route.name.endswith("front") else 1.0
        for number, level in enumerate(CONFIGURATIONS):
            for angle in ANGLES:
                part = 0.6 + 0.4 * math.cos(math.radians(2.0 * angle + 15.0 * number))
                torque = sign * level * part
                lines.append(f"{route.name},{route.joints[0]},{angle},{torque:.4f},c{number}")
    return "\n".join(lines) + "\n"


def routing(folder: Path) -> Callable[[], am.design.MovedRoutes]:
    """The search of the places of both ends of 27 routes."""
    path = folder / "limbs.xml"
    path.write_text(body_text(5, 0), encoding="utf-8")
    body = am.design.read_body(path)
    file = folder / "curves.csv"
    file.write_text(curves(body), encoding="utf-8")
    moves = [
        am.design.read_move(f"{site} within 20 mm", "move")
        for route in body.routes[:ROUTED]
        for site in route.points
    ]
    return functools.partial(
        am.design.move_routes,
        body,
        am.design.read_curves(body, file),
        moves,
        am.design.SizingConditions(supply="6 bar", max_count=3),
        [am.files.load_law("dmsp-20-300")],
    )


def section(rounds: int = 1) -> Section:
    """The complete benchmark; a note alone where MuJoCo is not installed."""
    if importlib.util.find_spec("mujoco") is None:
        note = "Omitted, because mujoco is not installed: pip install mujoco."
        return Section(TITLE, note, HEADER, ())
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, text in BODIES.items():
            path = Path(folder) / "body.xml"
            path.write_text(text, encoding="utf-8")
            for step, call in steps(path).items():
                times = []
                for _ in range(rounds):
                    start = time.process_time()
                    call()
                    times.append(time.process_time() - start)
                rows.append((name, step, format_time(min(times))))
        call = routing(Path(folder))
        start = time.process_time()
        call()
        rows.append(("27 routes", "moved points", format_time(time.process_time() - start)))
    return Section(TITLE, TEXT, HEADER, tuple(rows))


if __name__ == "__main__":
    print_section(section())
