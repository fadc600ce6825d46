"""Rules of the audit of a muscle law. Tolerances are chosen: far above rounding and the waviness of
a fitted polynomial, far below the faults that they look for.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from ...core import Array
from .audited_law import AuditedLaw
from .finding import AuditFinding

PRESSURES = 7
CONTRACTIONS = 41
BEYOND = 0.1
"""Contraction [1] below and above the range in which a law is examined beyond it."""
CLIFF = 3.0
"""Force beyond the range over the greatest one inside, from which it is a cliff."""
SLIP = 0.02
"""Change in the wrong direction over the greatest force, from which it is a fault."""
PUSH = 0.05
ZERO = 0.01
LITTLE_CHANGE = 0.05
MUCH_LESS = 0.7
JUMP = 0.05
JUMP_WIDTH = 1e-9
"""Size of a jump over the greatest force, and width [1] to which it is narrowed."""
ENERGY = 0.02
STATE = 1e-9
NO_MEMORY = "no memory"
ATMOSPHERE = 101_325.0
PLAUSIBLE_FORCE = (1.0, 2e4)
"""Greatest force of a muscle [N]: from the thinnest to the thickest that is sold."""
UNITS = {"bar": 1e-5, "kPa": 1e-3, "MPa": 1e-6, "psi": 1.0 / 6894.757}
"""Units of pressure that a law may expect in place of Pa, each with its number for 1 Pa."""


@dataclasses.dataclass(frozen=True)
class RuleOutcome:
    """Findings of a rule, and the law in the units that it expects, where they are others."""

    findings: tuple[AuditFinding, ...] = ()
    subject: AuditedLaw | None = None


@dataclasses.dataclass(frozen=True)
class LawRule:
    """A rule: its name, its function, and why it may not apply (an empty text where it does)."""

    name: str
    apply: Callable[[AuditedLaw], RuleOutcome]
    needs: Callable[[AuditedLaw], str] = lambda law: ""


@dataclasses.dataclass(frozen=True)
class LawGrid:
    """Forces [N] inside the range, shape (P, C); the greatest one; not a number without a value."""

    pressures: Array
    contractions: Array
    forces: Array

    @property
    def greatest(self) -> float:
        """The greatest force [N]; the least positive number where no force is known."""
        finite = self.forces[np.isfinite(self.forces)]
        return max(float(np.max(np.abs(finite))), 1e-12) if finite.size else 1e-12


def grid_of(law: AuditedLaw) -> LawGrid:
    """The forces of a law inside its range."""
    pressures = np.linspace(*law.pressures, PRESSURES)
    contractions = np.linspace(*law.contractions, CONTRACTIONS)
    forces = _forces(law, pressures, contractions)
    return LawGrid(pressures, contractions, forces)


def _forces(law: AuditedLaw, pressures: Array, contractions: Array) -> Array:
    grid = np.meshgrid(pressures, contractions, indexing="ij")
    values = law.force(grid[0].ravel(), grid[1].ravel())
    return np.asarray(values, dtype=float).reshape(grid[0].shape)


def find_units(law: AuditedLaw) -> RuleOutcome:
    """Pressure in bar, kPa, MPa or psi, contraction in per cent, absolute pressure."""
    low, high = law.pressures
    found: list[AuditFinding] = []
    replay: tuple[str, ...]
    subject = law
    greatest = grid_of(law).greatest
    if greatest > PLAUSIBLE_FORCE[1]:
        for unit, factor in UNITS.items():
            in_unit = _rescaled(law, pressure=factor)
            if PLAUSIBLE_FORCE[0] <= grid_of(in_unit).greatest <= PLAUSIBLE_FORCE[1]:
                text = (
                    f"The pressure seems to be expected in {unit}: at {high:.4g} Pa the force is"
                    f" {greatest:.4g} N, and with the number in {unit} it is"
                    f" {grid_of(in_unit).greatest:.4g} N."
                )
                replay = (
                    law.call(high, law.contractions[0]),
                    law.call(factor * high, law.contractions[0]),
                )
                found.append(AuditFinding("units", text, replay))
                subject = in_unit
                break
    if _expects_per_cent(subject):
        text = (
            "The contraction seems to be expected in per cent: between 0 and"
            f" {law.contractions[1]:.3g} the force hardly changes, and between 0 and"
            f" {100 * law.contractions[1]:.3g} it falls."
        )
        ends = (0.0, law.contractions[1], 100 * law.contractions[1])
        replay = tuple(law.call(high, end) for end in ends)
        found.append(AuditFinding("units", text, replay))
        subject = _rescaled(subject, contraction=100.0)
    if low <= 0.0 and _expects_absolute(subject):
        text = (
            "The pressure seems to be expected as an absolute one: the force is zero at 101.3 kPa"
            " for each contraction, and negative below."
        )
        replay = tuple(law.call(pressure, 0.0) for pressure in (0.0, ATMOSPHERE))
        found.append(AuditFinding("units", text, replay))
        subject = _rescaled(subject, offset=ATMOSPHERE)
    return RuleOutcome(tuple(found), subject)


def _rescaled(
    law: AuditedLaw, pressure: float = 1.0, contraction: float = 1.0, offset: float = 0.0
) -> AuditedLaw:
    """The law with its arguments in other units."""
    inner = law.force
    return dataclasses.replace(
        law, force=lambda p, c: inner(pressure * (p + offset), contraction * c)
    )


def _expects_per_cent(law: AuditedLaw) -> bool:
    ratios = np.linspace(0.0, law.contractions[1], 9)
    pressures = np.full(ratios.shape, law.pressures[1])
    as_ratio = law.force(pressures, ratios)
    as_per_cent = law.force(pressures, 100.0 * ratios)
    both = np.concatenate((as_ratio, as_per_cent))
    if not np.isfinite(both).all():
        return False
    scale = max(float(np.max(np.abs(as_ratio))), 1e-12)
    change = float(np.ptp(as_ratio)) / scale
    last = float(as_per_cent[-1]) / scale
    hardly_changes = change < LITTLE_CHANGE
    return hardly_changes and -CLIFF < last < MUCH_LESS


def _expects_absolute(law: AuditedLaw) -> bool:
    grid = grid_of(law)
    contractions = grid.contractions[: CONTRACTIONS // 2]
    atmosphere = np.full(contractions.shape, ATMOSPHERE)
    at_atmosphere = law.force(atmosphere, contractions)
    at_zero = law.force(0.0 * atmosphere, contractions)
    are_finite = np.isfinite(at_atmosphere).all() and np.isfinite(at_zero).all()
    if not are_finite:
        return False
    largest = float(np.max(np.abs(at_atmosphere)))
    highest = float(np.max(at_zero))
    return largest < ZERO * grid.greatest and highest < -PUSH * grid.greatest


def find_not_finite(law: AuditedLaw) -> RuleOutcome:
    """Points inside the range without a finite real force."""
    grid = grid_of(law)
    rows, columns = np.nonzero(~np.isfinite(grid.forces))
    if not rows.size:
        return RuleOutcome()
    pressure = float(grid.pressures[rows[0]])
    contraction = float(grid.contractions[columns[0]])
    text = (
        f"No finite real force at {rows.size} of {grid.forces.size} points inside the range, first"
        f" at {pressure / 1e3:.4g} kPa and {100 * contraction:.3g} %."
    )
    return RuleOutcome((AuditFinding("finite", text, (law.call(pressure, contraction),)),))


def find_push(law: AuditedLaw) -> RuleOutcome:
    """A muscle that pushes."""
    grid = grid_of(law)
    pressed = grid.pressures > 0.0
    forces = np.where(np.isfinite(grid.forces), grid.forces, 0.0)[pressed]
    if not forces.size or forces.min() >= -PUSH * grid.greatest:
        return RuleOutcome()
    row, column = np.unravel_index(np.argmin(forces), forces.shape)
    pressure = float(grid.pressures[pressed][row])
    contraction = float(grid.contractions[column])
    text = (
        f"The muscle pushes with {-forces.min():.4g} N at {pressure / 1e3:.4g} kPa and"
        f" {100 * contraction:.3g} %; a muscle is slack there. Limit the force at zero."
    )
    return RuleOutcome((AuditFinding("pulls only", text, (law.call(pressure, contraction),)),))


def find_rise_with_contraction(law: AuditedLaw) -> RuleOutcome:
    """A force that grows with contraction where the muscle pulls."""
    grid = grid_of(law)
    rise = _greatest_rise(np.maximum(grid.forces, 0.0))
    if rise is None or rise.size <= SLIP * grid.greatest:
        return RuleOutcome()
    pressure = float(grid.pressures[rise.row])
    ends = (float(grid.contractions[rise.start]), float(grid.contractions[rise.stop]))
    text = (
        f"The force grows by {rise.size:.4g} N with the contraction, from {100 * ends[0]:.3g} to"
        f" {100 * ends[1]:.3g} % at {pressure / 1e3:.4g} kPa; a longer muscle must pull more."
    )
    replay = tuple(law.call(pressure, end) for end in ends)
    return RuleOutcome((AuditFinding("falls with contraction", text, replay),))


def find_fall_with_pressure(law: AuditedLaw) -> RuleOutcome:
    """A force that falls with pressure where the muscle pulls."""
    grid = grid_of(law)
    fall = _greatest_rise(-np.maximum(grid.forces, 0.0).T)
    if fall is None or fall.size <= SLIP * grid.greatest:
        return RuleOutcome()
    contraction = float(grid.contractions[fall.row])
    ends = (float(grid.pressures[fall.start]), float(grid.pressures[fall.stop]))
    text = (
        f"The force falls by {fall.size:.4g} N with the pressure, from {ends[0] / 1e3:.4g} to"
        f" {ends[1] / 1e3:.4g} kPa at {100 * contraction:.3g} %."
    )
    replay = tuple(law.call(end, contraction) for end in ends)
    return RuleOutcome((AuditFinding("grows with pressure", text, replay),))


@dataclasses.dataclass(frozen=True)
class _Rise:
    """The greatest rise along a row: its size, the row, and both places."""

    size: float
    row: int
    start: int
    stop: int


def _greatest_rise(values: Array) -> _Rise | None:
    """The greatest rise above the least value before it, along rows of finite values."""
    best: _Rise | None = None
    for row, line in enumerate(values):
        if not np.isfinite(line).all():
            continue
        least = np.minimum.accumulate(line)
        rise = line - least
        stop = int(np.argmax(rise))
        start = int(np.argmin(line[: stop + 1]))
        if best is None or rise[stop] > best.size:
            best = _Rise(float(rise[stop]), row, start, stop)
    return best


def find_cliff(law: AuditedLaw) -> RuleOutcome:
    """A force that explodes beyond the range."""
    greatest = grid_of(law).greatest
    low, high = law.contractions
    for where, contractions in (
        ("longer than the range", low - np.linspace(0.005, BEYOND, 20)),
        ("shorter than the range", high + np.linspace(0.005, BEYOND, 20)),
    ):
        pressures = np.linspace(*law.pressures, PRESSURES)
        forces = np.abs(_forces(law, pressures, contractions))
        limit = CLIFF * greatest
        wrong = forces > limit  # infinite ones too; a refusal is no number, and no fault here
        if not wrong.any():
            continue
        row, column = (int(place[0]) for place in np.nonzero(wrong))
        pressure = float(pressures[row])
        contraction = float(contractions[column])
        value = f"{float(forces[row, column]):.4g} N"
        text = (
            f"Where the muscle is {where}, at {100 * contraction:.3g} % and"
            f" {pressure / 1e3:.4g} kPa, the law gives {value}; the greatest inside is"
            f" {greatest:.4g} N. A simulation that gets there explodes. Continue the law by a"
            " stretched sleeve, and by a slack muscle."
        )
        replay = (law.call(pressure, contraction), law.call(law.pressures[1], low))
        return RuleOutcome((AuditFinding("bounded beyond the range", text, replay),))
    return RuleOutcome()


def find_jump(law: AuditedLaw) -> RuleOutcome:
    """A jump of the force inside the range."""
    pressure = law.pressures[1]
    contractions = np.linspace(*law.contractions, 401)
    forces = law.force(np.full(contractions.shape, pressure), contractions)
    steps = np.abs(np.diff(forces))
    steps = np.where(np.isfinite(steps), steps, 0.0)
    greatest = grid_of(law).greatest
    place = int(np.argmax(steps))
    if steps[place] < JUMP * greatest:
        return RuleOutcome()
    left = float(contractions[place])
    right = float(contractions[place + 1])
    at = np.array(law.force(np.array([pressure, pressure]), np.array([left, right])))
    while right - left > JUMP_WIDTH:
        middle = 0.5 * (left + right)
        value = law.force(np.array([pressure]), np.array([middle]))[0]
        if abs(value - at[0]) > abs(at[1] - value):
            right, at[1] = middle, value
        else:
            left, at[0] = middle, value
    jump = abs(float(at[1] - at[0]))
    if jump < 0.5 * JUMP * greatest:
        return RuleOutcome()
    text = (
        f"The force jumps by {jump:.4g} N at {100 * left:.6g} % and {pressure / 1e3:.4g} kPa; an"
        " integrator loses its step there, and a stiffness does not exist."
    )
    replay = tuple(law.call(pressure, end) for end in (left, right))
    return RuleOutcome((AuditFinding("continuous", text, replay),))


def find_state(law: AuditedLaw) -> RuleOutcome:
    """A law that remembers earlier calls."""
    pressures = np.linspace(*law.pressures, 4)
    contractions = np.linspace(*law.contractions, 5)
    grid = np.meshgrid(pressures, contractions, indexing="ij")
    pressures = grid[0].ravel()
    contractions = grid[1].ravel()
    first = law.force(pressures, contractions)
    order = np.random.default_rng(0).permutation(len(first))
    again = np.empty_like(first)
    again[order] = law.force(pressures[order], contractions[order])
    difference = np.nan_to_num(np.abs(first - again))
    sizes = np.abs(first[np.isfinite(first)])
    scale = float(np.max(sizes, initial=1e-12))
    place = int(np.argmax(difference))
    if difference[place] <= STATE * scale:
        return RuleOutcome()
    point = f"({pressures[place]:.6g}, {contractions[place]:.6g})"
    text = (
        f"The function remembers earlier calls: at {point} it gives {first[place]:.6g} N, and"
        f" {again[place]:.6g} N after other points. A static law must not; give an audit the law"
        " without its hysteresis."
    )
    replay = (f"{law.name}{point} = {first[place]:.6g}", f"and later {again[place]:.6g}")
    return RuleOutcome((AuditFinding(NO_MEMORY, text, replay),))


def find_energy(law: AuditedLaw) -> RuleOutcome:
    """Energy from nothing: work of a closed cycle of pressure and length, less that of the air."""
    enclosed = law.enclosed
    if enclosed is None:
        return RuleOutcome()
    pressures = np.linspace(max(law.pressures[0], 0.0), law.pressures[1], 3)[1:]
    contractions = np.linspace(*law.contractions, 81)[: 81 // 2]
    forces = _forces(law, pressures, contractions)
    if not np.isfinite(forces).all() or (forces <= 0.0).any():
        taut = np.all(np.isfinite(forces) & (forces > 0.0), axis=0)
        count = len(contractions) if taut.all() else int(np.argmin(taut))
        contractions = contractions[:count]
        forces = forces[:, :count]
    if len(contractions) < 5:
        return RuleOutcome()
    by_length = np.trapezoid(forces[1] - forces[0], enclosed.resting_length * contractions)
    volumes = enclosed.volume(contractions[[0, -1]])
    by_air = float((pressures[1] - pressures[0]) * (volumes[1] - volumes[0]))
    gained = float(by_length) - by_air
    scale = max(abs(by_air), 1e-12)
    if abs(gained) <= ENERGY * scale:
        return RuleOutcome()
    corners = f"{pressures[0] / 1e3:.4g} and {pressures[1] / 1e3:.4g} kPa"
    ends = f"{100 * contractions[0]:.3g} and {100 * contractions[-1]:.3g} %"
    text = (
        f"A closed cycle between {corners} and {ends} gives {gained:+.4g} J of work that the air"
        f" does not pay ({100 * gained / scale:+.3g} % of the work of the air, {by_air:.4g} J):"
        " force and volume are not those of one muscle."
    )
    replay = tuple(
        law.call(float(pressure), float(contraction))
        for pressure in pressures
        for contraction in contractions[[0, -1]]
    )
    return RuleOutcome((AuditFinding("energy", text, replay),))


def _needs_formula(law: AuditedLaw) -> str:
    return "a table says nothing there" if law.is_table else ""


def _needs_answers(law: AuditedLaw) -> str:
    refused = "the law refuses points without a solution" if law.refuses else ""
    return refused or _needs_formula(law)


def _needs_volume(law: AuditedLaw) -> str:
    missing = "needs the volume (--volume) and the resting length (--resting-length)"
    return missing if law.enclosed is None else ""


LAW_RULES = (
    LawRule(NO_MEMORY, find_state),
    LawRule("units", find_units),
    LawRule("finite", find_not_finite, _needs_answers),
    LawRule("pulls only", find_push),
    LawRule("falls with contraction", find_rise_with_contraction),
    LawRule("grows with pressure", find_fall_with_pressure),
    LawRule("continuous", find_jump, _needs_formula),
    LawRule("bounded beyond the range", find_cliff, _needs_formula),
    LawRule("energy", find_energy, _needs_volume),
)
"""The rules, in the order in which they are applied: units first, as the others suppose them."""
