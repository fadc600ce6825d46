"""The catalogue: library entries by name, and muscle files of the user in the same form.

`load("dmsp-20-300")` and `load("my/muscle.toml")` give an Entry; a unique beginning of a name is enough.
"""

from __future__ import annotations

import dataclasses
import tomllib
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import AirmuscleWarning, FileError, UnknownNameError, suggestion
from .entry import Check, Entry
from .read import build_entry
from .write import save, to_toml

if TYPE_CHECKING:
    from ..recording import Recording

__all__ = [
    "Check",
    "Entry",
    "complete_name",
    "list_laws",
    "load",
    "load_data",
    "list_data",
    "read_toml",
    "save",
    "to_toml",
]  # fmt: skip

FOLDER = Path(__file__).parent
DATA = FOLDER / "data"


def list_laws() -> tuple[str, ...]:
    """The names of all library entries, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def list_data() -> tuple[str, ...]:
    """The names of all measured or tabulated data sets that come with the library, sorted."""
    return tuple(sorted(path.stem for path in DATA.glob("*.csv")))


def load(name_or_path: str | Path) -> Entry:
    """A library entry by its name or a unique beginning of it, or a muscle file by its path.

    Raises UnknownName, FileError, ParameterError or UnitError, saying where; an entry that carries a warning
    issues it as an AirmuscleWarning.
    """
    text = str(name_or_path)
    is_path = isinstance(name_or_path, Path) or text.endswith(".toml") or "/" in text or "\\" in text
    path = Path(name_or_path) if is_path else FOLDER / f"{complete_name(text, list_laws(), 'library entry')}.toml"
    entry = build_entry(read_toml(path), path.stem, path if is_path else Path(path.name), path.parent)
    if entry.warning:
        warnings.warn(f"{entry.name}: {entry.warning}", AirmuscleWarning, stacklevel=2)
    return entry


def load_data(name: str) -> Recording:
    """A data set that comes with the library, by its name or a unique beginning of it.

    The head of its file, with source and licence, is the last of the Recording's notes.
    """
    from ..recording import read_csv  # pandas, which no entry without data needs

    path = DATA / f"{complete_name(str(name), list_data(), 'data set')}.csv"
    recording: Recording = read_csv(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    head = " ".join(line.lstrip("# ") for line in lines if line.startswith("#") and " = " not in line)
    return dataclasses.replace(recording, notes=(*recording.notes, head))


def complete_name(name: str, known: Iterable[str], kind: str) -> str:
    """The one known name that is, or begins with, `name`. Raises UnknownName with what there is."""
    known = tuple(known)
    if name in known:
        return name
    found = [candidate for candidate in known if name and candidate.startswith(name)]
    if len(found) > 1:
        raise UnknownNameError(f"'{name}' is the beginning of several: {', '.join(found)}. Write more of it.")
    if not found:
        raise UnknownNameError(f"no {kind} '{name}'; there are {', '.join(known)}.{suggestion(name, known)}")
    return found[0]


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file. Raises FileError where it cannot be read or is not TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise FileError(f"{path}: there is no such file.") from None
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror}).") from None
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: is not UTF-8 text (byte {error.start}). Save it as UTF-8.") from None
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{path}: is not TOML: {error}.") from None
    except (ValueError, RecursionError) as error:  # a name with a null byte, brackets nested past any use
        raise FileError(f"{path}: cannot be read ({error}).") from None
