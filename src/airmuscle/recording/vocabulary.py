"""Vocabulary of headings: words, abbreviations and units of a laboratory, and what a heading states
by the words inside it, such as `PAM Pressure (kPa)`, `meas_pres_DF` or `Prüfkraft`.

A heading whose whole name is a known quantity is read by `parse_heading`; this module reads those
that contain one among other words.
"""

import dataclasses
import enum
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence

from ..core import UnitError, conversion
from .columns import QUANTITIES


def folded(text: str) -> str:
    """Text in lower case without accents: `Síla` and `sila` are one word."""
    parts = unicodedata.normalize("NFKD", text.casefold())
    return "".join(part for part in parts if not unicodedata.combining(part))


# Words of each quantity: English and abbreviations, German, French, Spanish, Italian, Japanese,
# Czech and Slovak.
WORDS: Mapping[str, Mapping[str, str]] = {
    "pressure": {
        "en": "pressure pressures press pres prs psr pressur",
        "de": "druck überdruck ueberdruck innendruck luftdruck",
        "fr": "pression surpression",
        "es": "presión sobrepresión manométrica",
        "it": "pressione sovrapressione",
        "ja": "圧力 空気圧 内圧 圧",
        "cs": "tlak přetlak",
        "sk": "pretlak",
    },
    "force": {
        "en": "force forces load loads loadcell tension pull thrust weight frc fz",
        "de": "kraft zugkraft last standardkraft prüfkraft pruefkraft gewichtskraft",
        "fr": "force effort charge traction",
        "es": "fuerza carga tensión",
        "it": "forza carico",
        "ja": "張力 荷重 力 収縮力",
        "cs": "síla zatížení",
        "sk": "sila zaťaženie",
    },
    "contraction": {
        "en": "contraction contr kappa",
        "de": "kontraktion",
        "fr": "contraction",
        "es": "contracción",
        "it": "contrazione",
        "ja": "収縮率 収縮",
        "cs": "kontrakce",
        "sk": "kontrakcia",
    },
    "shortening": {
        "en": "shortening",
        "de": "verkürzung verkuerzung",
        "fr": "raccourcissement",
        "es": "acortamiento",
        "it": "accorciamento",
        "ja": "短縮 収縮量",
        "cs": "zkrácení",
        "sk": "skrátenie",
    },
    "length": {
        "en": "length len",
        "de": "länge laenge",
        "fr": "longueur",
        "es": "longitud",
        "it": "lunghezza",
        "ja": "長さ 全長",
        "cs": "délka",
        "sk": "dĺžka",
    },
    "position": {
        "en": "displacement disp displ position pos stroke travel lvdt",
        "de": "weg hub verschiebung kolbenweg federweg",
        "fr": "déplacement course position",
        "es": "desplazamiento carrera posición",
        "it": "spostamento corsa posizione",
        "ja": "変位 位置 ストローク",
        "cs": "dráha poloha posunutí zdvih",
        "sk": "dráha posun zdvih",
    },
    "angle": {
        "en": "angle angles ang theta phi",
        "de": "winkel drehwinkel gelenkwinkel",
        "fr": "angle",
        "es": "ángulo",
        "it": "angolo",
        "ja": "角度 関節角 角",
        "cs": "úhel",
        "sk": "uhol",
    },
    "time": {
        "en": "time timestamp elapsed epoch millis micros clock",
        "de": "zeit prüfzeit pruefzeit uhrzeit",
        "fr": "temps",
        "es": "tiempo",
        "it": "tempo",
        "ja": "時間 時刻 経過時間",
        "cs": "čas",
        "sk": "čas",
    },
    "temperature": {
        "en": "temperature temp",
        "de": "temperatur",
        "fr": "température",
        "es": "temperatura",
        "it": "temperatura",
        "ja": "温度",
        "cs": "teplota",
        "sk": "teplota",
    },
    "torque": {
        "en": "torque moment trq",
        "de": "drehmoment",
        "fr": "couple",
        "es": "par",
        "it": "coppia",
        "ja": "トルク",
        "cs": "moment",
        "sk": "moment",
    },
    "speed": {
        "en": "speed velocity vel",
        "de": "geschwindigkeit",
        "fr": "vitesse",
        "es": "velocidad",
        "it": "velocità",
        "ja": "速度",
        "cs": "rychlost",
        "sk": "rýchlosť",
    },
    "acceleration": {
        "en": "acceleration accel",
        "de": "beschleunigung",
        "fr": "accélération",
        "es": "aceleración",
        "it": "accelerazione",
        "ja": "加速度",
        "cs": "zrychlení",
        "sk": "zrýchlenie",
    },
    "volume": {
        "en": "volume",
        "de": "volumen",
        "fr": "volume",
        "es": "volumen",
        "it": "volume",
        "ja": "体積 容積",
        "cs": "objem",
        "sk": "objem",
    },
    "elongation": {
        "en": "elongation extension strain stretch crosshead",
        "de": "dehnung verlängerung verlaengerung traverse traversenweg standardweg",
        "fr": "allongement",
        "es": "alargamiento elongación",
        "it": "allungamento",
        "ja": "伸び ひずみ",
        "cs": "prodloužení",
        "sk": "predĺženie",
    },
    "setpoint": {
        "en": "setpoint setpressure",
        "de": "solldruck vorgabedruck",
        "fr": "consigne",
        "es": "consigna",
        "it": "riferimento",
        "ja": "目標圧力 指令圧力 目標圧",
        "cs": "žádaný",
        "sk": "žiadaný",
    },
}
_LETTERS = {
    "p": "pressure",
    "f": "force",
    "l": "length",
    "x": "position",
    "y": "position",
    "t": "time",
    "q": "angle",
    "eps": "contraction",
    "ε": "contraction",
}
"""Symbols, which state a quantity where their unit does so too."""
SIGN_OPEN = ("elongation",)
"""Quantities of words whose zero and sign are open: the extension of a testing machine counts from
any length. They are proposed, never read by the words alone.
"""


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


COMMANDED = _words(
    "command cmd commanded commands set setpoint target tgt desired des reference ref demand "
    "goal wanted input soll sollwert vorgabe führung consigne consigna obiettivo 目標 指令 žádaná "
    "žiadaná"
)
"""Words of a command, in contrast to a measurement."""
MEASURED = _words(
    "meas measured measurement actual act sensor sens sensed fbk feedback fb ist istwert read "
    "reading filtered filt filter calibrated cal raw signal value val avg average mean mesure "
    "mesurée medida misurata 測定 計測 cell transducer channel ch data gauge gage rel relative "
    "relativ relativni manometric"
)
"""Words of a measurement, which distinguish nothing."""
MUSCLE = _words(
    "m muscle muscles pam pma mckibben actuator dmsp mas fpam bladder internal inner inside "
    "muskel aktor aktuator sval svalu svale ve ve muscolo muscular músculo 筋 人工筋 axial "
    "standard std pull tensile tens out output x z fz of the in de du del della taux percent "
    "load test elapsed system trial ros field"
)
"""Words of the muscle itself, and others that distinguish nothing."""
FOREIGN = _words(
    "supply source tank reservoir res compressor ambient atmospheric atmosphere barometric "
    "room inlet upstream line mains bottle versorgung netz umgebung kessel tank alimentation "
    "vorrat 供給 napájecí zdroj"
)
"""Words of another place than the muscle."""
SPOILERS = _words(
    "error err deviation rate gradient derivative dot variance var rms stdev sigma offset "
    "gain ratio count counts adc voltage volt current index idx id status flag state valid kp "
    "ki kd maximum minimum step number no nr area density modulus energy work power stiffness "
    "damping integral fehler abweichung rozdíl diff difference delta duty pwm valve valves "
    "ventil bias uncertainty tolerance hysteresis noise frequency stress spannung young "
    "elastic flow durchfluss débit caudal portata průtok 流量"
)
"""Words that make another quantity of the one beside them."""
ABSOLUTE = _words("abs absolute absolut absolu absoluta assoluta absolutni absolutny 絶対")
GAUGE = _words(
    "gauge gage rel relative relativ relativni überdruck ueberdruck přetlak pretlak ゲージ"
)

UNIT_NAMES: Mapping[str, str] = {
    "Pa": "pa pascal pascals",
    "hPa": "hpa hectopascal hectopascals",
    "kPa": "kpa kilopascal kilopascals",
    "MPa": "mpa megapascal megapascals",
    "bar": "bar bars",
    "mbar": "mbar millibar millibars",
    "psi": "psi psis",
    "psig": "psig psi(g)",
    "psia": "psia psi(a)",
    "bara": "bara bar(a) baraabs",
    "barg": "barg bar(g)",
    "kPa(a)": "kpa(a) kpaa",
    "kPa(g)": "kpa(g) kpag",
    "atm": "atm",
    "torr": "torr",
    "mmHg": "mmhg",
    "kgf/cm^2": "kgf/cm2 kgf/cm^2 kg/cm2 kg/cm^2",
    "N": "n newton newtons",
    "kN": "kn kilonewton kilonewtons",
    "mN": "mn millinewton millinewtons",
    "kgf": "kgf",
    "gf": "gf",
    "lbf": "lbf lbsf",
    "lb": "lb lbs pound pounds",
    "kp": "kp kilopond",
    "kg": "kg kgs kilogram kilograms kilogramm",
    "g": "g gram grams gramm gr",
    "mm": "mm millimeter millimeters millimetre millimetres",
    "cm": "cm centimeter centimeters centimetre centimetres zentimeter",
    "m": "m meter meters metre metres",
    "um": "um µm micrometer micrometers",
    "in": "in inch inches",
    "ft": "ft feet",
    "s": "s sec secs second seconds sekunde sekunden",
    "ms": "ms msec millis millisecond milliseconds millisekunden",
    "us": "us µs usec micros microsecond microseconds",
    "ns": "ns nanosecond nanoseconds",
    "min": "min mins minute minutes",
    "h": "h hour hours",
    "%": "% percent prozent pct",
    "deg": "deg degs degree degrees ° grad",
    "rad": "rad rads radian radians",
    "mrad": "mrad",
    "degC": "°c degc celsius c",
    "degF": "°f degf fahrenheit",
    "K": "k kelvin",
    "m/s": "m/s",
    "mm/s": "mm/s",
    "cm/s": "cm/s",
    "m/s^2": "m/s2 m/s^2",
    "deg/s": "deg/s °/s",
    "rad/s": "rad/s",
    "rpm": "rpm",
    "N m": "nm n·m n*m n.m n-m",
    "N mm": "nmm n·mm",
    "V": "v volt volts",
    "mV": "mv",
    "A": "a ampere",
    "mA": "ma",
    "Hz": "hz",
}
REFERRED = ("Pa", "kPa", "MPa", "hPa", "bar", "mbar", "psi", "atm", "torr")
"""Units of pressures that are completed by (a) for absolute and (g) for gauge ones."""
_UNITS = {folded(name): unit for unit, names in UNIT_NAMES.items() for name in names.split()}
_BY_UNIT = {
    "Pa": "pressure",
    "N": "force",
    "kg": "force",
    "rad": "angle",
    "s": "time",
    "N m": "torque",
}
"""The quantity that a unit determines by itself: of a length or a ratio there are several."""


def unit_named(text: str) -> str | None:
    """The unit in a text, spelt as `conversion` takes it: `KPA`, `Newton`, `sec`; None if there is
    none.
    """
    bare = text.strip()
    if bare[:1] in ("[", "(") and bare[-1:] in ("]", ")"):
        bare = bare[1:-1].strip()
    return bare if bare in UNIT_NAMES else _UNITS.get(folded(bare))


def dimension(unit: str) -> str:
    """The SI unit of the quantity that a unit measures: `kg` of `g`; empty if it is unknown."""
    for target in (
        "Pa",
        "N",
        "kg",
        "m",
        "1",
        "s",
        "rad",
        "K",
        "m/s",
        "m/s^2",
        "rad/s",
        "N m",
        "m3",
    ):
        try:
            conversion(unit, target)
        except UnitError:
            continue
        return target
    return ""


class Certainty(enum.Enum):
    """Evidence for a quantity in a heading.

    WORD   a word names it, and the unit is one of it
    UNIT   the unit alone, which one quantity has
    OPEN   the unit, the zero or the sign is not stated, as of a magnitude, so that a user must
           answer
    """

    WORD = "by its words"
    UNIT = "by its unit alone"
    OPEN = "open"


@dataclasses.dataclass(frozen=True)
class Reading:
    """What a heading states by the words in it.

    quantity    name of the quantity
    unit        of the heading, as units are spelt; None if it states none
    qualifiers  further words, which distinguish sensors of one quantity
    certainty   of this reading
    is_foreign  whether it is measured at another place than the muscle, such as the supply
    """

    quantity: str
    unit: str | None
    qualifiers: tuple[str, ...]
    certainty: Certainty
    is_foreign: bool = False


_WORD_OF = {
    folded(word): quantity
    for quantity, languages in WORDS.items()
    for words in languages.values()
    for word in words.split()
}
_JAPANESE = sorted(
    (
        (folded(word), quantity)
        for quantity, languages in WORDS.items()
        for word in languages["ja"].split()
    ),
    key=lambda pair: -len(pair[0]),
)
_SETS = {
    name: frozenset(map(folded, words))
    for name, words in {
        "commanded": COMMANDED,
        "neutral": MEASURED | MUSCLE,
        "foreign": FOREIGN,
        "spoilers": SPOILERS,
        "absolute": ABSOLUTE,
        "gauge": GAUGE,
    }.items()
}
MIN_COMPOUND = 3
"""Least number of letters of a word at the end of a compound, `Federweg` (chosen)."""
_COMPOUND_HEADS = tuple(
    sorted(
        {folded(word) for words in WORDS.values() for word in words["de"].split()},
        key=len,
        reverse=True,
    )
)
_TOKEN = re.compile(r"[^\W\d_]+|\d+|%|°")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_BEHIND_SIGN = re.compile(r"(?P<name>.+)[,/](?P<unit>[^,/]+)")
_BRACKETS = re.compile(r"\[([^\[\]]*)\]|\(([^()]*(?:\([ag]\))?)\)")
_OTHER_UNIT = re.compile(r"[\[(][^\])]*[a-zA-Z0-9%][/·*^²³][^\])]*[\])]")
"""A compound unit in brackets that no quantity of the vocabulary has, such as (g/s)."""
_MAGNITUDE = re.compile(r"\|[^|]+\|")
"""A name between bars, `|F|`: a magnitude has lost the sign of its quantity."""
MATRIX_COLUMN = re.compile(r"\(:,\d+\)$")
"""Column of a matrix of MATLAB, `y(:,2)`."""
MAX_CHARACTERS = 200
"""Number of characters of a heading above which no words are read (chosen)."""


def read_heading(text: str, unit_below: str = "") -> Reading | None:
    """What a heading states by its words and its unit, or by the unit below it; None if no quantity
    is found, or if its words make another one of it, such as a pressure error.
    """
    if len(text) > MAX_CHARACTERS:
        return None
    reading = _read_words(text, unit_below)
    if reading is not None and _MAGNITUDE.search(text):
        return dataclasses.replace(reading, certainty=Certainty.OPEN)
    return reading


def _read_words(text: str, unit_below: str) -> Reading | None:
    """The reading of a heading, as that of `read_heading`, where bars state nothing."""
    words, unit = _split(text)
    unit = unit_named(unit_below) or unit
    if unit is None and _OTHER_UNIT.search(text):
        return None
    tokens = [folded(word) for word in words]
    if set(tokens) & _SETS["spoilers"]:
        return None
    named = [(i, quantity) for i, token in enumerate(tokens) if (quantity := _quantity(token))]
    if unit is None:
        tokens, named, unit = _with_unit_inside(tokens, named)
    quantity = _chosen([name for _, name in named], unit)
    by_letter = not quantity
    if by_letter:
        letters = [(i, _LETTERS[token]) for i, token in enumerate(tokens) if token in _LETTERS]
        quantity = _chosen([name for _, name in letters[:1]], unit)
        named = letters[:1] if quantity else []
    is_commanded = bool(set(tokens) & _SETS["commanded"])
    is_component = quantity in ("position", "angle") and unit is None and len(tokens) > 1
    if by_letter and (is_component or is_commanded):  # of a vector, or the side of `cmd_L`
        quantity = ""
        named = []
    if by_letter and MATRIX_COLUMN.search(text):
        quantity = ""
        named = []
    qualifiers = _qualifiers(tokens, {i for i, _ in named})
    if is_commanded and quantity in ("", "pressure", "setpoint"):
        is_pressure = quantity or (unit is not None and dimension(unit) == "Pa")
        certainty = Certainty.WORD if unit and is_pressure else Certainty.OPEN
        return Reading("setpoint", unit, qualifiers, certainty)
    if not quantity:
        is_contradicted = any(_quantity(token) for token in tokens)
        return None if is_contradicted else _by_unit(tokens, unit, qualifiers)
    if is_commanded:
        qualifiers = ("commanded", *qualifiers)
    if quantity == "pressure" and unit is not None:
        unit = _referred(unit, tokens)
    certain = unit is not None and quantity not in SIGN_OPEN
    return Reading(
        quantity,
        unit,
        qualifiers,
        Certainty.WORD if certain else Certainty.OPEN,
        bool(set(tokens) & _SETS["foreign"]) or is_commanded,
    )


def _split(text: str) -> tuple[list[str], str | None]:
    """The words of a heading, and the unit in its brackets or behind a slash or a comma."""
    unit = None
    for match in reversed(list(_BRACKETS.finditer(text))):
        named = unit_named(match[1] if match[1] is not None else match[2])
        if named is not None and unit is None:
            unit = named
            text = f"{text[: match.start()]} {text[match.end() :]}"
    parts = _BEHIND_SIGN.fullmatch(text)
    if unit is None and parts and unit_named(parts["unit"]) is not None:
        unit = unit_named(parts["unit"])
        text = parts["name"]
    words = list[str]()
    for part in _TOKEN.findall(text):
        words += _CAMEL.split(part) if folded(part) not in _UNITS else [part]
    return words, unit


def _quantity(token: str) -> str:
    """The quantity that a word names, also as the last part of a German compound or inside Japanese
    text; empty if it names none.
    """
    if token in _WORD_OF:
        return _WORD_OF[token]
    for word, quantity in _JAPANESE:
        if word in token:
            return quantity
    for word in _COMPOUND_HEADS:
        if len(word) >= MIN_COMPOUND and token.endswith(word) and len(token) > len(word) + 2:
            return _WORD_OF[word]
    return ""


def _with_unit_inside(
    tokens: list[str], named: list[tuple[int, str]]
) -> tuple[list[str], list[tuple[int, str]], str | None]:
    """The words without the last two, or the last, where they are a unit that fits the others."""
    for count in (2, 1):
        first = len(tokens) - count
        if first < 0:
            continue
        tail = "".join(tokens[first:])
        unit = _UNITS.get(tail)
        before = [(i, name) for i, name in named if i < first]
        is_word_of_quantity = len(before) < len(named)
        if unit is None or (count == 2 and is_word_of_quantity):
            continue
        if first == 0:
            return [], named, unit
        names = [name for _, name in before]
        if not names:
            names = [_LETTERS[token] for token in tokens[:first] if token in _LETTERS][:1]
        if _chosen(names, unit) or len(tail) > 1:
            return tokens[:first], before, unit
    return tokens, named, None


def _chosen(names: Sequence[str], unit: str | None) -> str:
    """The quantity among those that the words name, in the meaning that its unit has; the last
    word is the head of a name. Empty if none has this unit.
    """
    fitting = [meant for name in names if (meant := _meant(name, unit))]
    return fitting[-1] if fitting else ""


_MEANT: Mapping[tuple[str, str], str] = {
    ("contraction", "m"): "shortening",
    ("shortening", "1"): "contraction",
    ("position", "rad"): "angle",
    ("speed", "rad/s"): "angular_speed",
    ("acceleration", "rad/s^2"): "angular_acceleration",
    ("force", "kg"): "force",
    ("force", "N m"): "torque",
}
"""The quantity of a word with a unit of another one."""


def _meant(name: str, unit: str | None) -> str:
    if unit is None:
        return name
    measured = dimension(unit)
    if measured == QUANTITIES[name].unit:
        return name
    return _MEANT.get((name, measured), "")


def _by_unit(
    tokens: Sequence[str], unit: str | None, qualifiers: tuple[str, ...]
) -> Reading | None:
    """The reading of a heading without a known word: by its unit, where one quantity has it."""
    if unit is None:
        return None
    quantity = _BY_UNIT.get(dimension(unit), "")
    if not quantity:
        return None
    is_alone = not qualifiers
    certainty = Certainty.UNIT if is_alone else Certainty.OPEN
    return Reading(quantity, unit, qualifiers, certainty, bool(set(tokens) & _SETS["foreign"]))


def referred_unit(text: str, unit: str) -> str:
    """The unit of a pressure whose heading says that it is absolute or gauge: `p_abs` in kPa is in
    kPa(a).
    """
    return _referred(unit, [folded(word) for word in _TOKEN.findall(text[:MAX_CHARACTERS])])


def _referred(unit: str, tokens: Iterable[str]) -> str:
    words = set(tokens)
    if unit not in REFERRED:
        return unit
    if words & _SETS["absolute"]:
        return f"{unit}(a)"
    return f"{unit}(g)" if words & _SETS["gauge"] else unit


def _qualifiers(tokens: Sequence[str], used: set[int]) -> tuple[str, ...]:
    """The words that are neither the quantity nor neutral."""
    left_out = _SETS["neutral"] | _SETS["commanded"] | _SETS["absolute"] | _SETS["gauge"]
    return tuple(token for i, token in enumerate(tokens) if i not in used and token not in left_out)
