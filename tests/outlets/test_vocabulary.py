"""A heading states a quantity by the words in it and by its unit, in the languages of the field,
and nothing where two readings differ.
"""

from __future__ import annotations

import pytest

from airmuscle import read
from airmuscle.errors import UnitError
from airmuscle.recording import (
    QUANTITIES,
    UNIT_NAMES,
    WORDS,
    Certainty,
    read_heading,
    unit_named,
)
from airmuscle.recording.columns import find_quantity_name, parse_heading, split_unit
from airmuscle.units import quantity

READ = {
    "PAM Pressure (kPa)": ("pressure", "kPa"),
    "Load Cell Force (N)": ("force", "N"),
    "Muscle Contraction (%)": ("contraction", "%"),
    "cmd_DF_kPa": ("setpoint", "kPa"),
    "wrist_angle_deg": ("angle", "deg"),
    "p_kPa": ("pressure", "kPa"),
    "force_lbf": ("force", "lbf"),
    "length_in": ("length", "in"),
    "pressure_hPa": ("pressure", "hPa"),
    "Überdruck [bar]": ("pressure", "bar(g)"),
    "p_abs [kPa]": ("pressure", "kPa(a)"),
    "Zugkraft / N": ("force", "N"),
    "Kolbenweg (mm)": ("position", "mm"),
    "Verkürzung [%]": ("contraction", "%"),
    "MusclePressure_kPa_": ("pressure", "kPa"),
    "Temps (s)": ("time", "s"),
    "Fuerza (N)": ("force", "N"),
    "Pressione [bar]": ("pressure", "bar"),
    "測定圧力(kPa)": ("pressure", "kPa"),
    "Síla [N]": ("force", "N"),
    "Skrátenie (mm)": ("shortening", "mm"),
    "PRESSURE, PSI": ("pressure", "psi"),
    "load (Newton)": ("force", "N"),
    "joint angular velocity (deg/s)": ("angular_speed", "deg/s"),
}
BY_UNIT = {"psi": "pressure", "kg": "force", "Newton": "force", "deg": "angle", "sec": "time"}
OPEN = {
    "meas_pres_DF": "pressure",
    "cmd_L": "setpoint",
    "Pump (psi)": "pressure",
    "Extension (mm)": "elongation",
    "|F| [N]": "force",
    "|Force| (N)": "force",
    "|axial| [N]": "force",
    "|p| / bar": "pressure",
}
NONE = (
    "pressure error (kPa)",
    "Pressure voltage (V)",
    "mass flow (g/s)",
    "Young modulus (MPa)",
    "stress [MPa]",
    "force rate (N)",
    "cm",
    "%",
    "operator",
    "y(:,2)",
    "valve pressure duty (%)",
    "",
)


@pytest.mark.parametrize("text", READ)
def test_words_inside_a_heading_and_its_unit_are_read(text: str):
    reading = read_heading(text)
    assert reading is not None
    assert (reading.quantity, reading.unit) == READ[text]
    assert reading.certainty is Certainty.WORD


@pytest.mark.parametrize("text", BY_UNIT)
def test_a_unit_that_one_quantity_has_determines_it(text: str):
    reading = read_heading(text)
    assert reading is not None
    assert (reading.quantity, reading.certainty) == (BY_UNIT[text], Certainty.UNIT)


@pytest.mark.parametrize("text", OPEN)
def test_what_a_heading_leaves_open_is_a_question(text: str):
    reading = read_heading(text)
    assert reading is not None
    assert (reading.quantity, reading.certainty) == (OPEN[text], Certainty.OPEN)


@pytest.mark.parametrize("text", NONE)
def test_what_names_another_quantity_is_not_read(text: str):
    assert read_heading(text) is None


@pytest.mark.parametrize("quantity", WORDS)
def test_each_word_of_the_table_names_its_quantity_with_and_without_its_neighbours(quantity: str):
    unit = {"1": "%", "m/s^2": "m/s^2"}.get(QUANTITIES[quantity].unit, QUANTITIES[quantity].unit)
    for language, words in WORDS[quantity].items():
        for word in words.split():
            for text in (f"{word} [{unit}]", f"{word.upper()} ({unit})"):
                reading = read_heading(text)
                said = f"{language}: {text} is {reading}"
                assert reading is not None, said
                alike = {quantity, "setpoint"} if reading.quantity == "setpoint" else {quantity}
                assert reading.quantity in alike, said


def headings_that_name_no_quantity() -> list[str]:
    """Headings with words of a quantity, or its unit alone, whose names are those of a laboratory."""
    names = [*READ, *(f"{word} [{unit}]" for word, unit in (("p1", "bar"), ("pressure2", "psi")))]
    return [
        text
        for text in names
        if not parse_heading(text).known and READ.get(text, ("",))[0] != "time"
    ]


@pytest.mark.parametrize("text", headings_that_name_no_quantity())
def test_a_column_that_is_read_by_its_words_keeps_its_name_of_the_file(tmp_path, text: str):
    column = "time [s];" + text
    (tmp_path / "run.csv").write_text(f"{column}\n0;0.01\n1;0.02\n2;0.03\n", encoding="utf-8")
    (recording,) = read(tmp_path / "run.csv")
    (name,) = set(recording) - {"time"}
    unit = QUANTITIES[name.rpartition(".")[2]].unit
    for asked in (text, split_unit(text)[0]):
        assert find_quantity_name(asked) is None
        assert asked in recording
        assert asked in recording.names()
        assert list(recording.in_unit(asked, unit)) == list(recording[name])
        assert list(recording.rows(slice(1, None))[asked]) == list(recording[name][1:])
        with pytest.raises(UnitError):
            recording.in_unit(asked, "kg/s")


def test_every_unit_of_the_table_is_converted():
    targets = ("Pa", "N", "kg", "m", "1", "s", "rad", "K", "m/s", "m/s^2", "rad/s", "N m")
    others = {"V", "mV", "A", "mA", "Hz"}
    for unit, names in UNIT_NAMES.items():
        for name in names.split():
            assert unit_named(name) == unit
        assert unit in others or any(_converts(unit, target) for target in targets), unit


def _converts(unit: str, target: str) -> bool:
    try:
        quantity(f"1 {unit}", target)
    except UnitError:
        return False
    return True
