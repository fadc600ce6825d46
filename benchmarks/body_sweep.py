"""Bodies with routes: time of the sweep over all poses, of the study, and of the choice of muscles,
for 12 and for 80 routes.
"""

from __future__ import annotations

import functools
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from measure import Section, format_time, print_section

import airmuscle as am

HEADER = ("body", "step", "time of the processor")
TEXT = (
    "Limbs of three hinges with a pair of routes at each; of 80 routes, further ones cross two and"
    " three hinges, so that their grid has 101^2 and 25^3 poses. Sweep: least and greatest length"
    " to 0.1 mm and moment arms. Study: with gravity in 1024 poses and clearances. Choice: muscles"
    " of the catalogue at 6 bar. MuJoCo computes each pose."
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


def section(rounds: int = 1) -> Section:
    """The complete benchmark."""
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
    return Section("Body with 12 and with 80 routes", TEXT, HEADER, tuple(rows))


if __name__ == "__main__":
    print_section(section())
