"""Display units: units of a user's choice for plots, tables, texts and notebooks; files keep their
declared units.

The choice is, in this order: that of the innermost `with display(...)` block, that of the last call
of `display(...)` in this process, that of the file config.toml in the user's configuration folder,
or else the default of each output.
"""

import functools
import math
import os
import pathlib
import re
import threading
import tomllib
from contextvars import ContextVar
from typing import Any, Self

from .annotation import abridged
from .errors import AirmuscleError, FileError, UnitError
from .units import conversion, known_factor, known_si_unit

SI_UNITS = (
    "Pa",
    "m",
    "rad",
    "1",
    "N",
    "kg",
    "s",
    "m3",
    "m/s",
    "m/s^2",
    "rad/s",
    "rad/s^2",
    "kg/s",
    "m3/s",
    "m3/(s Pa)",
    "N/m",
    "N m",
    "N m/rad",
)
"""SI units of the quantities whose display unit can be chosen; "1" is that of the contraction."""
CONFIG_FILE = "config.toml"
"""Name of the configuration file."""

_SUPERSCRIPTS = str.maketrans({"³": "3", "²": "2"})
_HEADING = re.compile(r"(?P<name>.*)\[(?P<unit>[^\]]+)\]\s*$", re.DOTALL)
_NUMBER = re.compile(r"(?<![\w.])[-−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")


class DisplayUnits:
    """A choice of display units, which is in force in this process, or in a `with` block only.

    units  the texts of the units, such as ("bar", "mm"); a quantity without one keeps the default
           of the output

    Raises UnitError.
    """

    def __init__(self, units: tuple[str, ...], where: str = "display") -> None:
        self.units = units
        self.by_si: dict[str, tuple[float, str]] = {}
        """Factor from SI and text of each unit, by SI unit."""
        for unit in units:
            if not isinstance(unit, str) or not unit.strip():
                raise UnitError(
                    f"{where}: {abridged(unit)} is not a unit; write texts, such as 'bar', 'mm',"
                    " 'deg'."
                )
            text = unit.strip()
            si_unit, factor = _si_unit_and_factor(unit.strip(), where)
            if si_unit in self.by_si:
                both = f"'{self.by_si[si_unit][1]}' and '{text}'"
                raise UnitError(f"{where}: {both} are units of the same quantity; choose one.")
            self.by_si[si_unit] = (1.0 / factor, text)

    def __enter__(self) -> Self:
        """Restrict the choice to a block in this thread: the choice of the process is the earlier
        one again.
        """
        with _lock:
            if self in _process:
                _process.remove(self)
        _blocks.set((*_blocks.get(), self))
        return self

    def __exit__(self, *_: object) -> None:
        _blocks.set(_blocks.get()[:-1])

    def __repr__(self) -> str:
        return f"DisplayUnits({', '.join(self.units) or 'default units'})"


_lock = threading.Lock()
_process: list[DisplayUnits] = []
"""The choices of this process, the last of which is in force."""
_blocks: ContextVar[tuple[DisplayUnits, ...]] = ContextVar("display units", default=())


def display(*units: str) -> DisplayUnits:
    """Show quantities in these units from now on: `display("bar", "mm", "deg")`; without units, in
    the default ones.

    A call replaces the previous choice. `with display("bar"):` limits it to a block and to the
    thread of the block. It changes plots, tables, reports, texts and notebooks; values, arguments
    and files (CSV, TOML, JSON) are not affected. Raises UnitError for an unknown unit, for two
    units of one quantity, and for an absolute pressure.
    """
    choice = DisplayUnits(units)
    with _lock:
        _process.append(choice)
    return choice


def current_units() -> tuple[str, ...] | None:
    """The units chosen in this process or block, for a worker process; None if only the
    configuration file counts.
    """
    choice = _choice_here()
    return None if choice is None else choice.units


def _choice_here() -> DisplayUnits | None:
    return next(reversed(_blocks.get() or tuple(_process)), None)


def chosen_scale(si_unit: str, factor: float, label: str) -> tuple[float, str]:
    """Factor from SI and unit in which a quantity is displayed; `factor` and `label` are the
    default.

    Raises FileError or UnitError for an invalid configuration file.
    """
    choice = _choice_here() or _of_user()
    return choice.by_si.get(si_unit, (factor, label))


def quantity_text(value: Any, si_unit: str, default: str, digits: int = 4) -> str:
    """A value in SI as text with its display unit, `300 kPa`, to a number of significant digits."""
    return _scaled(value, *chosen_scale(si_unit, 1.0 / known_factor(default), default), digits)


def contraction_text(value: Any, decimals: int = 2) -> str:
    """A contraction as text: in per cent with so many decimals, or to four significant digits in
    the chosen unit.
    """
    factor, unit = chosen_scale("1", 0.0, "")
    return _scaled(value, factor, unit, 4) if unit else f"{100 * value:.{decimals}f} %"


def _scaled(value: Any, factor: float, unit: str, digits: int) -> str:
    return f"{value * factor:.{digits}g} {'' if unit == '1' else unit}".rstrip()


def level_text(quantity: str, level: float, span: float) -> str:
    """A level of a measured quantity as text, rounded to a thousandth of a span of levels [SI].

    The median of noisy contractions, -6e-6, is so written as the level that was set, 0 %.
    """
    step = 10.0 ** math.floor(math.log10(span / 1e3)) if span > 0 else 0.0
    rounded = round(level / step) * step + 0.0 if step else level
    if quantity == "contraction":
        return f"{100 * rounded:.4g} %"
    units = {"pressure": ("Pa", "kPa"), "force": ("N", "N"), "length": ("m", "mm")}.get(quantity)
    return quantity_text(rounded, *units) if units else f"{rounded:.4g}"


def heading_scale(heading: str) -> tuple[float, str]:
    """Factor and heading of a column or axis whose heading ends with its unit: 'pressure [kPa]' in
    the chosen unit.

    The factor is 1 if no other unit is chosen. A ratio is converted only if it is a contraction.
    """
    match = _HEADING.fullmatch(heading)
    if match is None or (unit_and_factor := _known(match["unit"])) is None:
        return 1.0, heading
    si_unit, factor = unit_and_factor
    if si_unit == "1" and "contraction" not in match["name"].lower():
        return 1.0, heading
    scale, unit = chosen_scale(si_unit, 1.0 / factor, match["unit"])
    if unit == match["unit"]:
        return 1.0, heading
    return factor * scale, f"{match['name']}[{'-' if unit == '1' else unit}]"


def scaled_numbers(text: str, factor: float) -> str:
    """A text with its numbers multiplied by a factor: '1 to 2' becomes '0.01 to 0.02' for 0.01."""
    return _NUMBER.sub(lambda match: f"{float(match[0].replace('−', '-')) * factor:.4g}", text)


@functools.cache
def _known(unit: str) -> tuple[str, float] | None:
    """SI unit and factor of a unit of which a display unit can be chosen, else None."""
    plain = unit.translate(_SUPERSCRIPTS)
    if plain in SI_UNITS:
        return plain, 1.0
    si_unit = known_si_unit(plain)
    return (si_unit, known_factor(plain)) if si_unit in SI_UNITS else None


def _si_unit_and_factor(unit: str, where: str) -> tuple[str, float]:
    """SI unit and factor of a unit. Raises UnitError if it is unknown, has an offset, or cannot be
    chosen.
    """
    reason = ""
    for si_unit in SI_UNITS:
        try:
            converted = conversion(unit, si_unit)
        except UnitError as error:
            reason = reason or ("" if "measures another" in error.message else f" {error.message}")
            continue
        if re.search(r"a$|\(a\)|abs", unit) and si_unit == "Pa" and converted.offset:
            raise UnitError(
                f"{where}: '{unit}' is absolute, but displayed pressures are gauge pressures; write"
                " 'bar'."
            )
        if math.isfinite(converted.factor) and converted.factor > 0.0 and not converted.offset:
            return si_unit, converted.factor
    raise UnitError(
        f"{where}: '{unit}' cannot be chosen.{reason} Allowed are units of {', '.join(SI_UNITS)},"
        " such as 'bar' or 'mm'."
    )


def _of_user() -> DisplayUnits:
    """The choice of the configuration file in AIRMUSCLE_CONFIG_DIR, or in the user's configuration
    folder.
    """
    try:
        folder = os.environ.get("AIRMUSCLE_CONFIG_DIR") or user_folder("config")
    except RuntimeError:  # a user without a home folder
        return DisplayUnits(())
    return _configured(str(pathlib.Path(folder) / CONFIG_FILE))


def user_folder(kind: str) -> pathlib.Path:
    """The folder of the user for "cache" or "config" files of the program. Raises RuntimeError
    without a home folder.

    A relative path in XDG_CACHE_HOME or XDG_CONFIG_HOME is ignored, as the XDG base directory
    specification demands: it would be another folder in each working folder.
    """
    import platformdirs

    folders = {"cache": platformdirs.user_cache_dir, "config": platformdirs.user_config_dir}
    folder = pathlib.Path(folders[kind]("airmuscle", appauthor=False))
    return folder if folder.is_absolute() else pathlib.Path.home() / f".{kind}" / "airmuscle"


@functools.cache
def _configured(file: str) -> DisplayUnits:
    """The choice of a configuration file, [display] units = [...], read once. Raises FileError or
    UnitError.
    """
    try:
        tables = tomllib.loads(pathlib.Path(file).read_text(encoding="utf-8-sig"))
    except (FileNotFoundError, NotADirectoryError):
        return DisplayUnits(())
    except OSError as error:
        if not os.access(
            os.path.dirname(file), os.X_OK
        ):  # the folder of another user, as after `su` without a login
            return DisplayUnits(())
        raise FileError(f"{file}: cannot be read ({error.strerror}).") from None
    except (ValueError, RecursionError) as error:  # not TOML, or not UTF-8
        raise FileError(f"{file}: is not valid TOML: {error}.") from None
    table = tables.get("display", {})
    units = table.get("units", []) if isinstance(table, dict) else None
    unknown = [key for key in tables if key != "display"]
    unknown += [key for key in table if key != "units"] if isinstance(table, dict) else []
    if unknown or not isinstance(units, list):
        what = f"unknown key '{unknown[0]}'" if unknown else "units must be a list of texts"
        raise FileError(
            f'{file}: {what}; write [display] and under it units = ["bar", "mm", "deg"].'
        )
    try:
        return DisplayUnits(tuple(units), "[display] units")
    except AirmuscleError as error:
        raise error.located(file) from None
