"""Tables and figures of the study of a body."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import plotting
from ...report.chapter import BY_ROW, Table, TableColumn
from .body import Body
from .clearance import Clearance
from .demand import TensionBalance
from .faults import RouteFault
from .signs import direction, main_joint
from .sweep import ExtremeLength, RouteSweep

BRIEF_ROUTES = 20
BRIEF_ARMS = 12
"""Rows of the brief view (chosen)."""
MOST_PANELS = 12
"""Greatest number of joints in the figure of moment arms (chosen)."""
BINS = 40
"""Intervals of a joint over which the band of the moment arms is drawn (chosen)."""


def fault_table(faults: Sequence[RouteFault]) -> tuple[Table, ...]:
    """The faults, with their numbers."""
    if not faults:
        return ()
    shown = {"m": "mm", "1": "%"}
    columns: dict[str, Any] = {
        "fault": [fault.kind for fault in faults],
        "route or joint": [fault.name for fault in faults],
        "value": TableColumn([fault.value for fault in faults], BY_ROW),
        "limit": TableColumn([fault.limit for fault in faults], BY_ROW),
        "unit": TableColumn(
            [fault.unit for fault in faults],
            shown=[shown.get(fault.unit, fault.unit) for fault in faults],
        ),
    }
    columns["in words"] = TableColumn([fault.text for fault in faults], brief=False)
    rows = min(len(faults), BRIEF_ROUTES)
    return (Table("faults", "Faults of the routes", columns, brief=rows),)


def route_table(
    body: Body,
    sweeps: Sequence[RouteSweep],
    clearances: Sequence[Clearance | None],
    gravity: TensionBalance,
) -> Table:
    """Lengths of each route, with the poses."""
    distances = [None if clearance is None else clearance.distance for clearance in clearances]
    columns: dict[str, Any] = {
        "route": [sweep.route.name for sweep in sweeps],
        "least length": TableColumn([sweep.shortest.length for sweep in sweeps], "m", "mm", 5),
        "greatest length": TableColumn([sweep.longest.length for sweep in sweeps], "m", "mm", 5),
        "stroke": TableColumn([sweep.stroke for sweep in sweeps], "m", "mm"),
        "stroke over length": TableColumn(
            [sweep.stroke_share for sweep in sweeps], "1", "%", 3, short="share"
        ),
        "joint": [main_joint(sweep) or "" for sweep in sweeps],
        "pulls towards": [_direction_in_words(sweep) for sweep in sweeps],
        "clearance": TableColumn(distances, "m", "mm", 3),
        "tension of gravity": TableColumn(gravity.tension.max(axis=0), "N", short="gravity"),
        "pose of the least length": TableColumn(
            [_pose(body, sweep, sweep.shortest) for sweep in sweeps], brief=False
        ),
        "pose of the greatest length": TableColumn(
            [_pose(body, sweep, sweep.longest) for sweep in sweeps], brief=False
        ),
        "points": TableColumn([", ".join(sweep.route.points) for sweep in sweeps], brief=False),
        "place": TableColumn([sweep.route.place for sweep in sweeps], brief=False),
    }
    note = (
        "Lengths over all poses of the joints of each route. Pulls towards: greater or lesser"
        " positions of the joint, both where the moment arm changes its sign. Clearance: least"
        " distance of the straight parts from geoms that can collide, negative inside; attachments"
        " are left out. Tension of gravity: the greatest of the least tensions that hold the body"
        " in all poses."
    )
    return Table("routes", "Lengths of the routes", columns, note, brief=BRIEF_ROUTES)


def arm_table(body: Body, sweeps: Sequence[RouteSweep]) -> Table:
    """Moment arms of each route and joint."""
    rows = [
        (sweep, joint, float(share))
        for sweep in sweeps
        for joint, share in zip(sweep.route.joints, sweep.shares, strict=True)
    ]
    units = ["m" if body.joints[joint].is_hinge else "1" for _, joint, _ in rows]
    ranges = [sweep.arm_range(joint) for sweep, joint, _ in rows]
    columns: dict[str, Any] = {
        "route": [sweep.route.name for sweep, _, _ in rows],
        "joint": [joint for _, joint, _ in rows],
        "least moment arm": TableColumn([low for low, _ in ranges], BY_ROW),
        "greatest moment arm": TableColumn([high for _, high in ranges], BY_ROW),
        "unit": TableColumn(units, shown=["mm" if unit == "m" else unit for unit in units]),
        "part of the changes of length": TableColumn(
            [share for _, _, share in rows], "1", "%", 3, short="part"
        ),
        "pose of the least": TableColumn(
            [sweep.poses.described(body, sweep.row_of(joint, False)) for sweep, joint, _ in rows],
            brief=False,
        ),
        "pose of the greatest": TableColumn(
            [sweep.poses.described(body, sweep.row_of(joint, True)) for sweep, joint, _ in rows],
            brief=False,
        ),
    }
    note = (
        "Moment arms of a pull, -dL/dq; MuJoCo's actuator_moment has the opposite sign. A route"
        " with several joints couples them."
    )
    return Table("moment_arms", "Moment arms", columns, note, brief=BRIEF_ARMS)


def joint_table(body: Body, demands: Sequence[TensionBalance]) -> Table:
    """Demand at each joint, and what the routes on both sides of it give."""
    rows = [(balance, joint) for balance in demands for joint in body.moving]
    balances = [balance for balance, _ in rows]
    columns_of = [body.moving.index(joint) for _, joint in rows]
    torque = [
        balance.demand.torque[:, column]
        for balance, column in zip(balances, columns_of, strict=True)
    ]
    stated = [values[np.isfinite(values)] for values in torque]

    def levers(sign: float) -> list[tuple[float, float]]:
        """The least and the greatest lever of the routes that pull in one direction."""
        ranges = []
        for balance, column in zip(balances, columns_of, strict=True):
            arms = np.clip(sign * balance.moment_arm[:, column], 0.0, None)
            lever = arms.sum(axis=1)
            ranges.append((float(lever.min()), float(lever.max())))
        return ranges

    units = ["N m" if body.joints[joint].is_hinge else "N" for _, joint in rows]
    columns: dict[str, Any] = {
        "joint": [joint for _, joint in rows],
        "demand": [balance.demand.name for balance in balances],
        "least torque": TableColumn([_least(values) for values in stated], BY_ROW),
        "greatest torque": TableColumn([_greatest(values) for values in stated], BY_ROW),
        "unit": TableColumn(units),
        "lever towards greater positions": TableColumn(
            levers(1.0),
            "m",
            "mm",
            short="lever +",
        ),
        "lever towards lesser positions": TableColumn(
            levers(-1.0),
            "m",
            "mm",
            short="lever -",
        ),
        "poses that are not held": TableColumn(
            [
                float(balance.is_unmet[:, column].mean())
                for balance, column in zip(balances, columns_of, strict=True)
            ],
            "1",
            "%",
            3,
            short="not held",
        ),
    }
    note = (
        "Torque that the routes must give. Levers: sum of the moment arms of the routes that pull"
        " the joint in that direction, over the poses: the torque of antagonists is this lever"
        " times their tension."
    )
    return Table("joints", "Demand at the joints", columns, note, brief=len(rows))


def stroke_figure(sweeps: Sequence[RouteSweep], limit: float) -> Any:
    """Bars of the strokes over the greatest lengths."""
    sweeps = [sweep for sweep in sweeps if sweep.stroke_share is not None]
    figure, axes = plotting.new_figure(height=max(1.6, 0.6 + 0.22 * len(sweeps)))
    shares = [sweep.stroke_share or 0.0 for sweep in sweeps]
    colours = [plotting.RED if share > limit else plotting.BLUE for share in shares]
    places = np.arange(len(sweeps))
    axes.barh(places, 100 * np.array(shares), color=colours)
    axes.axvline(100 * limit, color=plotting.BLACK, linestyle="--", linewidth=1.0)
    axes.set_yticks(places, [sweep.route.name for sweep in sweeps])
    axes.invert_yaxis()
    axes.set_xlabel("stroke over greatest length in %")
    return figure


def arms_figure(body: Body, sweeps: Sequence[RouteSweep]) -> Any:
    """Moment arms over the joints that routes move most, one panel a joint."""
    of_joints: dict[str, list[RouteSweep]] = {}
    for sweep in sweeps:
        joint = main_joint(sweep)
        if joint is not None:
            of_joints.setdefault(joint, []).append(sweep)
    panels = list(of_joints.items())[:MOST_PANELS]
    columns = min(2, max(1, len(panels)))
    rows = max(1, -(-len(panels) // columns))
    figure, axes = plotting.new_figure(rows, columns, height=2.4 * rows, squeeze=False)
    for panel in axes.flat[len(panels) :]:
        panel.set_axis_off()
    for panel, (joint, moving) in zip(axes.flat, panels, strict=False):
        _arm_panel(panel, body, joint, moving)
    return figure


def _arm_panel(axes: Any, body: Body, joint: str, sweeps: Sequence[RouteSweep]) -> None:
    is_hinge = body.joints[joint].is_hinge
    scale = (180.0 / np.pi, 1e3) if is_hinge else (1e3, 1.0)
    for sweep, colour in zip(sweeps, plotting.LINES * len(sweeps), strict=False):
        column = sweep.route.joints.index(joint)
        position = scale[0] * sweep.poses.positions[:, column]
        arm = scale[1] * sweep.moment_arm[:, column]
        edges = np.linspace(position.min(), position.max(), BINS + 1)
        which = np.clip(np.digitize(position, edges) - 1, 0, BINS - 1)
        filled = [number for number in range(BINS) if (which == number).any()]
        middle = [0.5 * (edges[number] + edges[number + 1]) for number in filled]
        low = [arm[which == number].min() for number in filled]
        high = [arm[which == number].max() for number in filled]
        axes.fill_between(middle, low, high, color=colour, alpha=0.25, linewidth=0.0)
        mean = 0.5 * (np.array(low) + np.array(high))
        axes.plot(middle, mean, color=colour, label=sweep.route.name)
    axes.axhline(0.0, color=plotting.BLACK, linewidth=0.6)
    axes.set_xlabel(f"{joint} in {'degrees' if is_hinge else 'mm'}")
    axes.set_ylabel("moment arm in mm" if is_hinge else "moment arm")
    axes.legend(fontsize=7)


def _direction_in_words(sweep: RouteSweep) -> str:
    joint = main_joint(sweep)
    if joint is None:
        return ""
    return {1: "greater", -1: "lesser", 0: "both"}[direction(sweep, joint)]


def _pose(body: Body, sweep: RouteSweep, extreme: ExtremeLength) -> str:
    parts = (
        f"{name} {body.joints[name].shown(float(value))}"
        for name, value in zip(sweep.route.joints, extreme.positions, strict=True)
    )
    return ", ".join(parts)


def _least(values: Any) -> float | None:
    return float(values.min()) if len(values) else None


def _greatest(values: Any) -> float | None:
    return float(values.max()) if len(values) else None
