"""Files of a cam: DXF and SVG in mm for a machine, CSV of the profile."""

import numpy as np

from ...core import Array
from .cam import Cam

DXF_HEAD = ("0", "SECTION", "2", "HEADER", "9", "$INSUNITS", "70", "4", "0", "ENDSEC")
"""The header of a DXF file: lengths in mm."""
MARGIN = 5.0
"""Margin of an SVG file [mm] (chosen)."""
CSV_HEADING = (
    "angle [deg],torque [N m],moment arm [mm],shortening [mm],contraction [1],force [N],"
    "radius of curvature [mm],x [mm],y [mm]"
)


def cam_dxf(cam: Cam) -> str:
    """The outline as DXF (R12) in mm, in the frame of the cam: the layer CAM has the closed
    outline, HUB the circle of the hub, CABLE the points that the cable touches, ANCHOR its end.
    """
    lines = [*DXF_HEAD, "0", "SECTION", "2", "ENTITIES"]
    lines += _polyline("CAM", 1e3 * cam.outline.closed, is_closed=True)
    lines += _polyline("CABLE", 1e3 * cam.outline.working, is_closed=False)
    lines += ["0", "CIRCLE", "8", "HUB", *_position(np.zeros(2)), "40", _number(1e3 * cam.hub)]
    lines += ["0", "POINT", "8", "ANCHOR", *_position(1e3 * cam.outline.working[-1])]
    lines += ["0", "ENDSEC", "0", "EOF"]
    return "\n".join(lines) + "\n"


def _polyline(layer: str, points: Array, *, is_closed: bool) -> list[str]:
    """A polyline of R12, group code and value in turn."""
    lines = ["0", "POLYLINE", "8", layer, "66", "1", "70", "1" if is_closed else "0"]
    for point in points:
        lines += ["0", "VERTEX", "8", layer, *_position(point)]
    return [*lines, "0", "SEQEND"]


def _position(point: Array) -> list[str]:
    return ["10", _number(point[0]), "20", _number(point[1]), "30", "0.0"]


def _number(value: float) -> str:
    return f"{value + 0.0:.6f}"


def cam_svg(cam: Cam) -> str:
    """The outline as SVG in mm, at its true size; the line of the cable, hub and anchor marked."""
    points = 1e3 * cam.outline.closed * [1.0, -1.0]
    low = points.min(axis=0) - MARGIN
    size = points.max(axis=0) + MARGIN - low
    working = 1e3 * cam.outline.working * [1.0, -1.0]
    anchor = working[-1]
    style = 'fill="none" stroke-width="0.2"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]:.4f}mm" height="{size[1]:.4f}mm"'
        f' viewBox="{low[0]:.4f} {low[1]:.4f} {size[0]:.4f} {size[1]:.4f}">\n'
        f'<polygon id="cam" {style} stroke="black" points="{_pairs(points)}"/>\n'
        f'<polyline id="cable" {style} stroke="blue" points="{_pairs(working)}"/>\n'
        f'<circle id="hub" {style} stroke="black" r="{1e3 * cam.hub:.4f}"/>\n'
        f'<circle id="anchor" {style} stroke="red" r="0.5" cx="{anchor[0]:.4f}"'
        f' cy="{anchor[1]:.4f}"/>\n</svg>\n'
    )


def _pairs(points: Array) -> str:
    return " ".join(f"{x:.5f},{y:.5f}" for x, y in points)


def cam_csv(cam: Cam) -> str:
    """The profile as CSV, a row for each angle; x and y are the point that the cable touches, in
    the frame of the cam.
    """
    columns = (
        np.degrees(cam.angle),
        cam.torque,
        1e3 * cam.arm,
        1e3 * cam.shortening,
        cam.contraction,
        cam.force,
        1e3 * cam.curvature,
        *(1e3 * cam.outline.working.T),
    )
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([CSV_HEADING, *rows]) + "\n"
