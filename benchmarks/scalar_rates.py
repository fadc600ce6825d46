"""Hand-written rates of the benchmark plants in scalar Python, as a user would write them for
SciPy.

All constants are precomputed as local variables; closed valves, the extrapolation outside the
validity range and the root of choked flow are skipped. The library is not called during a run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sin, sqrt
from typing import Any

from filling import stretch_factor
from joints import HEAT_CAPACITY, Joint, JointWithHeat

import airmuscle as am

Rates = Callable[[float, Any], list[float]]
Scalar = Callable[[float, float], float]


def valve_flow(valve: am.Valve, temperature: float) -> Scalar:
    """Mass flow [kg/s] from one absolute pressure to another [Pa], fully open."""
    scale = (
        valve.conductance
        * am.physics.REFERENCE_DENSITY
        * sqrt(am.physics.REFERENCE_TEMPERATURE / temperature)
    )
    b, laminar = valve.critical_ratio, float(valve.laminar_slope())
    inverse = 1.0 / (1.0 - b)

    def flow(up: float, down: float) -> float:
        if up >= down:
            if down <= b * up:
                return scale * up
            beyond = (down - b * up) * inverse
            root = up * up - beyond * beyond
            ellipse = sqrt(root) if root > 1.0 else 1.0
            chord = laminar * (up - down)
            return scale * (ellipse if ellipse < chord else chord)
        return -flow(down, up)

    return flow


def extrapolate(law: am.characteristic.ContractileSurface) -> Scalar:
    """Extrapolation of the surface by its tangent beyond the validity range, in scaled
    arguments.
    """
    (
        a00,
        a10,
        a20,
        a30,
        a40,
        a50,
        a01,
        a11,
        a21,
        a31,
        a41,
        a02,
        a12,
        a22,
        a32,
        a03,
        a13,
        a23,
        a04,
        a14,
        a05,
    ) = law.coefficients
    rows = (
        (a00, a10, a20, a30, a40, a50),
        (a01, a11, a21, a31, a41),
        (a02, a12, a22, a32),
        (a03, a13, a23),
        (a04, a14),
        (a05,),
    )

    def tangent(x: float, q: float) -> float:
        xi, qi = min(max(x, -1.0), 1.0), min(max(q, -1.0), 1.0)
        terms = [(i, j, a) for j, row in enumerate(rows) for i, a in enumerate(row)]
        at_edge = sum(a * xi**i * qi**j for i, j, a in terms)
        by_x = sum(i * a * xi ** (i - 1) * qi**j for i, j, a in terms if i)
        by_q = sum(j * a * xi**i * qi ** (j - 1) for i, j, a in terms if j)
        return at_edge + min(by_x, 0.0) * (x - xi) + max(by_q, 0.0) * (q - qi)

    return tangent


def hill(plant: am.Plant) -> Callable[[Sequence[float]], Rates]:
    """A function from valve openings to the rates of the plant with three states."""
    muscle = plant.muscles[0]
    load = plant.mechanism
    circuit = plant.circuits[0]
    ambient = plant.ambient
    law = muscle.contractile
    length = muscle.geometry.resting_length
    k, c = stretch_factor(muscle.geometry)
    rt, outside, source = (
        am.physics.GAS_CONSTANT * ambient.temperature,
        ambient.pressure,
        am.physics.absolute_pressure(circuit.supply.pressure, ambient),
    )
    fill_flow, discharge_flow = (
        valve_flow(v, ambient.temperature) for v in (circuit.fill, circuit.discharge)
    )
    stiffness = muscle.spring.stiffness
    damping = muscle.damper.damping
    growth = muscle.damper.damping_slope
    inverse_mass = 1.0 / load.mass
    gravity = load.gravity
    per_length = 1.0 / length
    cc = c * c
    low_x = law.min_contraction
    scale_x = 2.0 / (law.max_contraction - law.min_contraction)
    low_q = law.min_pressure
    scale_q = 2.0 / (law.max_pressure - law.min_pressure)
    min_force, max_force, tangent = law.min_force, law.max_force, extrapolate(law)
    (
        a00,
        a10,
        a20,
        a30,
        a40,
        a50,
        a01,
        a11,
        a21,
        a31,
        a41,
        a02,
        a12,
        a22,
        a32,
        a03,
        a13,
        a23,
        a04,
        a14,
        a05,
    ) = law.coefficients

    def rates_at(openings: Sequence[float]) -> Rates:
        fill, discharge = openings

        def rates(t: float, y: Any) -> list[float]:
            air, position, speed = y.tolist()
            contraction = position * per_length
            s = 1.0 - contraction
            p = air * rt / (k * s * (1.0 - cc * s * s))
            gauge = p - outside
            x = (contraction - low_x) * scale_x - 1.0
            q = (gauge - low_q) * scale_q - 1.0
            if -1.0 <= x <= 1.0 and -1.0 <= q <= 1.0:
                r0 = a00 + x * (a10 + x * (a20 + x * (a30 + x * (a40 + x * a50))))
                r1 = a01 + x * (a11 + x * (a21 + x * (a31 + x * a41)))
                r2 = a02 + x * (a12 + x * (a22 + x * a32))
                force = r0 + q * (
                    r1 + q * (r2 + q * (a03 + x * (a13 + x * a23) + q * (a04 + x * a14 + q * a05)))
                )
            else:
                force = tangent(x, q)
            force = min_force if force < min_force else max_force if force > max_force else force
            tension = force - stiffness * position - (damping + growth * gauge) * speed
            if tension < 0.0:
                tension = 0.0
            flow = 0.0
            if fill:
                flow += fill * fill_flow(source, p)
            if discharge:
                flow -= discharge * discharge_flow(p, outside)
            return [flow, speed, tension * inverse_mass - gravity]

        return rates

    return rates_at


def _force(system: Joint) -> Callable[[float, float, float], float]:
    """A function from gauge pressure [Pa], contraction [1] and shortening speed [m/s] to the
    tension [N].
    """
    muscle = system.muscle
    length = muscle.geometry.resting_length
    clamp = muscle.contractile
    k, c = stretch_factor(muscle.geometry)
    area = -k / length
    ccc = 3.0 * c * c
    stiffness = muscle.spring.stiffness * length
    damping = muscle.damper.damping
    min_force = clamp.min_force
    max_force = clamp.max_force

    def force(gauge: float, contraction: float, speed: float) -> float:
        s = 1.0 - contraction
        pull = gauge * area * (1.0 - ccc * s * s)
        pull = min_force if pull < min_force else max_force if pull > max_force else pull
        tension = pull - stiffness * contraction - damping * speed
        return tension if tension > 0.0 else 0.0

    return force


def six_states(system: Joint) -> Callable[[Sequence[float]], Rates]:
    """A function from valve openings to the rates of the joint with six states."""
    ambient = system.ambient
    length = system.muscle.geometry.resting_length
    k, c = stretch_factor(system.muscle.geometry)
    rt = am.physics.GAS_CONSTANT * ambient.temperature
    outside = ambient.pressure
    cc = c * c
    in_tube, source, radius = (
        rt / system.tube_volume,
        am.physics.absolute_pressure(system.supply.pressure, ambient),
        system.radius,
    )
    lever = radius / length
    offset = system.offset
    inverse_inertia = 1.0 / system.inertia
    friction, load, force = system.friction, system.load, _force(system)
    valve, tube = (valve_flow(v, ambient.temperature) for v in (system.valve, system.tube))

    def rates_at(openings: Sequence[float]) -> Rates:
        left_fill, left_discharge, right_fill, right_discharge = openings

        def rates(t: float, y: Any) -> list[float]:
            angle, speed, air_l, tube_l, air_r, tube_r = y.tolist()
            eps_l = offset + lever * angle
            eps_r = offset - lever * angle
            v = radius * speed
            sl = 1.0 - eps_l
            sr = 1.0 - eps_r
            p_l = air_l * rt / (k * sl * (1.0 - cc * sl * sl))
            p_r = air_r * rt / (k * sr * (1.0 - cc * sr * sr))
            t_l = tube_l * in_tube
            t_r = tube_r * in_tube
            through_l, through_r = tube(t_l, p_l), tube(t_r, p_r)
            in_l = in_r = 0.0
            if left_fill:
                in_l += left_fill * valve(source, t_l)
            if left_discharge:
                in_l -= left_discharge * valve(t_l, outside)
            if right_fill:
                in_r += right_fill * valve(source, t_r)
            if right_discharge:
                in_r -= right_discharge * valve(t_r, outside)
            pull = force(p_l - outside, eps_l, v) - force(p_r - outside, eps_r, -v)
            turning = (radius * pull - friction * speed - load * sin(angle)) * inverse_inertia
            return [speed, turning, through_l, in_l - through_l, through_r, in_r - through_r]

        return rates

    return rates_at


def ten_states(system: JointWithHeat) -> Callable[[Sequence[float]], Rates]:
    """A function from valve openings to the rates of the joint with ten states: heat transfer and
    spools.
    """
    ambient = system.ambient
    length = system.muscle.geometry.resting_length
    k, c = stretch_factor(system.muscle.geometry)
    wall = ambient.temperature
    outside = ambient.pressure
    cc = c * c
    in_tube, source = (
        am.physics.GAS_CONSTANT * wall / system.tube_volume,
        am.physics.absolute_pressure(system.supply.pressure, ambient),
    )
    radius = system.radius
    offset = system.offset
    inverse_inertia = 1.0 / system.inertia
    lever, friction, load, force = radius / length, system.friction, system.load, _force(system)
    valve, tube = (valve_flow(v, wall) for v in (system.valve, system.tube))
    transfer = system.heat_transfer
    inverse_lag = 1.0 / system.spool_lag
    cp = HEAT_CAPACITY + am.physics.GAS_CONSTANT
    inverse_cv = 1.0 / HEAT_CAPACITY
    ratio = am.physics.GAS_CONSTANT / HEAT_CAPACITY
    per_length = 1.0 / length

    def side(
        contraction: float,
        speed: float,
        air: float,
        tube_air: float,
        energy: float,
        spool: float,
        goal: float,
    ) -> tuple[float, float, float, float, float]:
        s = 1.0 - contraction
        css = cc * s * s
        p = energy * ratio / (k * s * (1.0 - css))
        temperature = energy * inverse_cv / air
        t = tube_air * in_tube
        incoming = 0.0
        if spool > 0.0:
            incoming = spool * valve(source, t)
        elif spool < 0.0:
            incoming = spool * valve(t, outside)
        through = tube(t, p)
        energy_flow = cp * through * (wall if through >= 0.0 else temperature)
        work = p * k * (3.0 * css - 1.0) * speed * per_length
        heating = energy_flow - work + transfer * (wall - temperature)
        tension = force(p - outside, contraction, speed)
        return tension, through, incoming - through, heating, (goal - spool) * inverse_lag

    def rates_at(openings: Sequence[float]) -> Rates:
        goal_l = openings[0] - openings[1]
        goal_r = openings[2] - openings[3]

        def rates(t: float, y: Any) -> list[float]:
            angle, speed, air_l, tube_l, energy_l, spool_l, air_r, tube_r, energy_r, spool_r = (
                y.tolist()
            )
            turn = lever * angle
            v = radius * speed
            pull_l, *left = side(offset + turn, v, air_l, tube_l, energy_l, spool_l, goal_l)
            pull_r, *right = side(offset - turn, -v, air_r, tube_r, energy_r, spool_r, goal_r)
            turning = (
                radius * (pull_l - pull_r) - friction * speed - load * sin(angle)
            ) * inverse_inertia
            return [speed, turning, *left, *right]

        return rates

    return rates_at
