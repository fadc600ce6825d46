"""Body with its muscles as MJCF: an actuator at each route whose force is that of the muscles, and
the choice as TOML.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core import Array
from ...design.body import FitOut, RouteMuscle
from ...design.body.simulator import load_simulator
from .body_plugins import MusclePlugins, RoutePlugin

PRESSURES = 25
LENGTHS = 25
"""Points of the table of forces (chosen)."""
LAG = 0.05
"""Time constant [s] between the set pressure and that of the muscle (chosen)."""
VISCOSITY = 0.02
"""Damping of a muscle over its greatest tension, for a motion of its stroke in 1 s (chosen)."""


class ForceTable(NamedTuple):
    """Tension of the muscles of a route as p (g0 + g1 L) + b0 + b1 L, from 0 to the permitted one.

    gain, bias  coefficients for gauge pressure p [Pa] and length L [m]
    permitted   greatest tension [N]
    greatest    greatest deviation from the law [N] over the working range
    rms         root mean square of the deviations [N]
    """

    gain: tuple[float, float]
    bias: tuple[float, float]
    permitted: float
    greatest: float
    rms: float

    def tension(self, pressure: Array, length: Array) -> Array:
        """Tension [N] at gauge pressures [Pa] and lengths of the route [m]."""
        force = pressure * (self.gain[0] + self.gain[1] * length)
        force = force + self.bias[0] + self.bias[1] * length
        return np.asarray(np.clip(force, 0.0, self.permitted))


class FittedBody(NamedTuple):
    """A body with its muscles: MJCF, and by the name of a route its table of forces or plugin."""

    text: str
    tables: dict[str, ForceTable]
    plugins: dict[str, RoutePlugin]


def force_table(choice: RouteMuscle) -> ForceTable:
    """The affine table of the muscles of a route by least squares over their working range."""
    low, high = choice.muscle.pressure_range
    sweep = choice.sweep
    pressure, length = np.meshgrid(
        np.linspace(low, high, PRESSURES),
        np.linspace(sweep.shortest.length, sweep.longest.length, LENGTHS),
    )
    permitted = choice.count / choice.tackle * min(choice.muscle.max_force, _strongest(choice))
    tension = np.minimum(choice.tension(pressure, length), permitted).ravel()
    p = pressure.ravel()
    x = length.ravel()
    pulls = tension > 0.0
    columns = np.stack([p, p * x, np.ones_like(x), x], axis=1)
    scale = np.abs(columns).max(axis=0)
    solution = np.linalg.lstsq(columns[pulls] / scale, tension[pulls], rcond=None)[0] / scale
    g0, g1, b0, b1 = (float(value) for value in solution)
    table = ForceTable((g0, g1), (b0, b1), permitted, 0.0, 0.0)
    deviation = table.tension(p, x) - tension
    rms = float(np.sqrt(np.mean(deviation**2)))
    return table._replace(greatest=float(np.abs(deviation).max()), rms=rms)


def _strongest(choice: RouteMuscle) -> float:
    """Greatest force [N] of one muscle by its law over the working range."""
    contraction = np.linspace(*choice.contraction, LENGTHS)
    return float(np.max(choice.muscle.force(choice.muscle.pressure_range[1], contraction)))


def fitted_body(fit_out: FitOut, plugins: Path | None = None) -> FittedBody:
    """The MJCF of a body whose routes have their muscles as actuators.

    plugins  folder for MuJoCo plugins of the muscles whose law gives a force; the other routes, or
             all without a folder, have a general actuator by a table

    The control of an actuator is the set gauge pressure [Pa]: of a plugin that of a regulator, else
    the pressure follows it with a time constant. Actuators of the file at these routes are removed.
    Raises FileError, and ParameterError for a MuJoCo without plugins.
    """
    mujoco = load_simulator()
    file = fit_out.study.body.file
    spec = file.specification()
    served = {choice.sweep.route.tendon: choice for choice in fit_out.muscles}
    for actuator in list(spec.actuators):
        if actuator.trntype == mujoco.mjtTrn.mjTRN_TENDON and actuator.target in served:
            spec.delete(actuator)
    tables = {}
    built = {}
    writer = None if plugins is None else MusclePlugins(plugins, fit_out.conditions)
    for tendon, choice in served.items():
        plugin = None if writer is None else writer.add(spec, choice, tendon)
        if plugin is not None:
            built[choice.name] = plugin
            continue
        table = force_table(choice)
        tables[choice.name] = table
        _add_actuator(mujoco, spec, choice, tendon, table)
    if len(spec.meshes) or len(spec.textures) or len(spec.hfields):
        folder = file.path.parent.resolve()
        spec.meshdir = str(folder / spec.meshdir)
        spec.texturedir = str(folder / spec.texturedir)
    file.compiled(spec)
    text: str = spec.to_xml()
    return FittedBody(f"<!-- {_provenance(fit_out, tables)} -->\n{text}", tables, built)


def _add_actuator(
    mujoco: Any, spec: Any, choice: RouteMuscle, tendon: str, table: ForceTable
) -> None:
    """A general actuator: a pull is a negative force."""
    actuator = spec.add_actuator(name=choice.name, target=tendon)
    actuator.trntype = mujoco.mjtTrn.mjTRN_TENDON
    actuator.gaintype = mujoco.mjtGain.mjGAIN_AFFINE
    actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    damping = VISCOSITY * table.permitted / max(choice.sweep.stroke, 1e-3)
    actuator.gainprm[:3] = [-table.gain[0], -table.gain[1], 0.0]
    actuator.biasprm[:3] = [-table.bias[0], -table.bias[1], -damping]
    actuator.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
    actuator.dynprm[0] = LAG
    actuator.ctrlrange = [0.0, choice.muscle.pressure_range[1]]
    actuator.ctrllimited = 1
    actuator.forcerange = [-table.permitted, 0.0]
    actuator.forcelimited = 1
    actuator.lengthrange = [choice.sweep.shortest.length, choice.sweep.longest.length]


def _provenance(fit_out: FitOut, tables: dict[str, ForceTable]) -> str:
    """The comment at the beginning of the MJCF."""
    lines = [
        f"{fit_out.study.body.name} with the muscles of airmuscle fit-out.",
        "Control: set gauge pressure in Pa. Force: affine in pressure and length of the route, or",
        "that of a plugin, which mj_loadPluginLibrary loads before this file.",
    ]
    for choice in fit_out.muscles:
        muscles = (
            f"{choice.name}: {choice.count} x {choice.product}, {1e3 * choice.length:.4g} mm,"
            f" tackle {choice.tackle}:1"
        )
        table = tables.get(choice.name)
        if table is None:
            lines.append(
                f"{muscles}, a plugin for each muscle, of the law {choice.muscle.entry.name}"
            )
            continue
        lines.append(
            f"{muscles}, greatest deviation from the law {table.greatest:.3g} N"
            f" (rms {table.rms:.3g} N) of {table.permitted:.4g} N"
        )
    for item in fit_out.unserved:
        lines.append(f"{item.sweep.route.name}: not served, its actuator is that of the file")
    return "\n     ".join(line.replace("--", "- -") for line in lines)


def choice_toml(fit_out: FitOut) -> str:
    """The choice as TOML: a table for each route, in the units of the report."""
    conditions = fit_out.conditions
    parts = [
        f"# Muscles of {fit_out.study.body.name}, chosen by airmuscle fit-out.\n"
        f'supply = "{conditions.supply / 1e5:.6g} bar"\n'
        f"safety = {conditions.safety_factor:.6g}\n"
    ]
    for choice in fit_out.muscles:
        reserve = "" if np.isinf(choice.reserve) else f"reserve = {choice.reserve:.4g}\n"
        parts.append(
            "[[muscle]]\n"
            f"route = {json.dumps(choice.name)}\n"
            f"tendon = {json.dumps(choice.sweep.route.tendon)}\n"
            f"product = {json.dumps(choice.product)}\n"
            f"law = {json.dumps(choice.muscle.entry.name)}\n"
            f'nominal_length = "{1e3 * choice.length:.6g} mm"\n'
            f"number = {choice.count}\n"
            f"tackle = {choice.tackle}\n"
            f'tendon_length = "{1e3 * choice.tendon:.6g} mm"\n'
            f'fittings = "{1e3 * choice.fittings:.6g} mm"  # chosen\n'
            f"least_contraction = {choice.contraction[0]:.6g}\n"
            f"greatest_contraction = {choice.contraction[1]:.6g}\n{reserve}"
        )
    for item in fit_out.unserved:
        parts.append(
            f"[[unserved]]\nroute = {json.dumps(item.sweep.route.name)}\n"
            f"reason = {json.dumps(item.reason)}\n"
        )
    return "\n".join(parts)
