"""Body as files: MJCF or URDF, further routes as TOML, ranges of joints; read into a MuJoCo
specification.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ...core import (
    FileError,
    InputError,
    ParameterError,
    ShortRepr,
    check_known,
    quantity,
    quotable,
)
from ...files.library import read_finite_number, read_toml
from .simulator import load_simulator
from .xml_source import XmlSource, read_source

ROUTE_KEYS = ("name", "points")
POINT_KEYS = ("body", "at")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BodyFile(ShortRepr):
    """A body and what is added to it before it is compiled.

    path            MJCF or URDF
    routes          TOML file of further routes; None without
    ranges          range (low, high) of joints [rad or m], by name, in place of that of the file
    folder          folder from which the body may read files; that of `path` by default
    without_meshes  whether geoms and textures of files are left out
    sites           positions of sites [m] in the frames of their bodies, by name, in place of those
                    of the file
    """

    path: Path
    routes: Path | None = None
    ranges: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    folder: Path | None = None
    without_meshes: bool = False
    sites: Mapping[str, tuple[float, float, float]] = dataclasses.field(default_factory=dict)

    def source(self) -> XmlSource:
        """The text, checked. Raises FileError."""
        source = read_source(self.path, self.folder)
        if source.missing and not self.without_meshes:
            places = "; ".join(
                f"{element.place}: {quotable(element.attributes.get('file') or '')!r}"
                for element in source.missing[:3]
            )
            more = f"; and {len(source.missing) - 3} more" if len(source.missing) > 3 else ""
            raise FileError(
                f"{self.path}: files of meshes or textures are missing: {places}{more}. Put them"
                " there, or leave them out with --without-meshes (without_meshes=True); masses"
                " that MuJoCo takes from meshes are then missing."
            )
        return source

    def specification(self) -> Any:
        """The `mujoco.MjSpec` with all additions. Raises FileError and ParameterError."""
        mujoco = load_simulator()
        try:
            spec = mujoco.MjSpec.from_file(str(self.path))
        except (ValueError, RuntimeError) as error:
            raise FileError(f"{self.path}: MuJoCo cannot read it: {_one_sentence(error)}") from None
        spec.compiler.fusestatic = False
        if self.without_meshes:
            _leave_meshes_out(mujoco, spec)
        self._set_ranges(mujoco, spec)
        for name, points in self.further_routes():
            _add_route(spec, name, points)
        for site in spec.sites:
            if site.name in self.sites:
                site.pos = self.sites[site.name]
        return spec

    def compiled(self, spec: Any) -> Any:
        """The `mujoco.MjModel` of a specification. Raises FileError."""
        try:
            return spec.compile()
        except (ValueError, RuntimeError) as error:
            raise FileError(
                f"{self.path}: MuJoCo cannot compile it: {_one_sentence(error)}"
            ) from None

    def further_routes(self) -> Iterator[tuple[str, list[Any]]]:
        """Name and points of the routes of the TOML file: names of sites, or (body, position
        [m]).
        """
        if self.routes is None:
            return
        tables = read_toml(self.routes)
        check_known(f"{self.routes}: unknown key", tables, ("route",))
        for number, table in enumerate(tables.get("route", []), 1):
            place = f"{self.routes}: route {number}"
            if not isinstance(table, dict) or not isinstance(table.get("name"), str):
                raise ParameterError(f"{place}: 'name' is missing; it must be a text in quotes.")
            check_known(f"{place}: unknown key", table, ROUTE_KEYS)
            points = table.get("points")
            if not isinstance(points, list) or len(points) < 2:
                raise ParameterError(
                    f"{place} ({quotable(table['name'])}): points must be a list of at least two:"
                    ' names of sites, or { body = "shank", at = ["0 mm", "0 mm", "-40 mm"] }.'
                )
            yield table["name"], [_point(point, place) for point in points]

    def _set_ranges(self, mujoco: Any, spec: Any) -> None:
        known = {joint.name: joint for joint in spec.joints}
        check_known(f"{self.path}: there is no joint", self.ranges, known)
        for name, (low, high) in self.ranges.items():
            joint = known[name]
            if not low < high:
                raise ParameterError(
                    f"range of joint {name}: {low:.4g} is not less than {high:.4g}."
                )
            is_in_degrees = spec.compiler.degree and joint.type == mujoco.mjtJoint.mjJNT_HINGE
            factor = 57.29577951308232 if is_in_degrees else 1.0
            joint.range = [factor * low, factor * high]
            joint.limited = 1


def _point(point: Any, place: str) -> Any:
    """A point of a route: the name of a site, or (body, position [m])."""
    if isinstance(point, str):
        return point
    if not isinstance(point, dict) or not isinstance(point.get("body"), str):
        raise ParameterError(
            f'{place}: a point must be the name of a site, or {{ body = "shank", at = [...] }}.'
        )
    check_known(f"{place}: unknown key", point, POINT_KEYS)
    position = point.get("at")
    if not isinstance(position, list) or len(position) != 3:
        raise ParameterError(
            f"{place}: 'at' must be three lengths in the frame of the body, such as"
            ' ["0 mm", "0 mm", "-40 mm"].'
        )
    return point["body"], [read_finite_number(value, "m", f"{place}: at") for value in position]


def _add_route(spec: Any, name: str, points: list[Any]) -> None:
    """Add a spatial tendon through points. Raises ParameterError."""
    bodies = {body.name: body for body in spec.bodies}
    sites = {site.name for site in spec.sites}
    if name in {tendon.name for tendon in spec.tendons}:
        raise ParameterError(f"route {quotable(name)}: the body has a tendon of this name already.")
    tendon = spec.add_tendon(name=name)
    for number, point in enumerate(points, 1):
        if isinstance(point, str):
            check_known(f"route {name}: there is no site", [point], sites)
            tendon.wrap_site(point)
            continue
        body, position = point
        check_known(f"route {name}: there is no body", [body], bodies)
        site = bodies[body].add_site(name=f"{name}_point{number}", pos=position)
        tendon.wrap_site(site.name)


def _leave_meshes_out(mujoco: Any, spec: Any) -> None:
    """Remove the geoms of meshes, and textures of files."""
    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH or geom.meshname:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    for texture in spec.textures:
        texture.file = ""
        texture.cubefiles = [""] * 6
        texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
        texture.width = 8
        texture.height = 8
    spec.compiler.boundmass = max(spec.compiler.boundmass, 1e-9)
    spec.compiler.boundinertia = max(spec.compiler.boundinertia, 1e-12)


def read_range(text: str, unit: str, where: str) -> tuple[float, float]:
    """The range of a joint [unit] from a text such as "-10 deg..30 deg". Raises InputError."""
    low, separator, high = text.partition("..")
    if not separator:
        raise InputError(f"{where} is '{text}'; give two values: '-10 deg..30 deg'.")
    return quantity(low.strip(), unit, where=where), quantity(high.strip(), unit, where=where)


def _one_sentence(error: Exception) -> str:
    """The message of MuJoCo on one line, with a full stop."""
    return " ".join(str(error).split()).rstrip(".") + "."
