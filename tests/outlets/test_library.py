"""A library file becomes a model, and a model a file that gives the same numbers.

What is wrong with a file is said with file, table, key, value and what is allowed; nothing half
written is left.
"""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from airmuscle import files
from airmuscle.bench import fit
from airmuscle.core import cite
from airmuscle.errors import (
    AirmuscleError,
    AirmuscleWarning,
    FileError,
    ParameterError,
    UnitError,
    UnknownNameError,
)
from airmuscle.files import Entry, library
from airmuscle.files.library import PLANT_READER, Location, model_class, model_names, write
from airmuscle.physics import (
    BoucWen,
    Braid,
    ChouHannaford1996,
    Clamped,
    ContractileSurface,
    CreepElements,
    Dahl,
    EndStop,
    HuntCrossley,
    LinearDamper,
    LinearSpring,
    LuGre,
    MaxwellSlip,
    Muscle,
    NoFriction,
    PrandtlIshlinskii,
    PressureDamper,
    SwellingWall,
)

GOOD = """
title = "A muscle of our own"
provenance = "chosen"
[characteristic]
model = "Clamped"
max_force = "1.2 kN"
[characteristic.inner]
model = "TonduLopez2000"
end_correction = 1.2
[characteristic.inner.geometry]
model = "Braid"
radius = "10 mm"
braid_angle = "25 deg"
resting_length = "300 mm"
[geometry]
model = "Braid"
radius = 0.01
braid_angle = 0.4363
resting_length = 0.3
[spring]
model = "LinearSpring"
stiffness = "2 N/mm"
[damper]
model = "PressureDamper"
damping = 50.0
damping_slope = "1 N s/(m bar)"
[validity_range]
min_pressure = "0 bar"
max_pressure = "6 bar"
min_contraction = 0.0
max_contraction = "25 %"
[[check]]
quantity = "force"
pressure = "5 bar"
contraction = "0 %"
equals = "1.2 kN"
tolerance = "1 N"
source = "the clamp"
[[reference]]
key = "ours"
authors = "We"
title = "Notes"
where = "here"
year = 2024
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "muscle.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_becomes_a_muscle_in_si(tmp_path: Path):
    entry = library.load(written(tmp_path, GOOD))
    assert entry.name == "muscle"
    assert isinstance(entry.characteristic, Clamped)
    assert (entry.characteristic.max_force, entry.characteristic.inner.geometry.radius) == (
        1200.0,
        0.01,
    )
    assert entry.spring == LinearSpring(2000.0)
    assert entry.damper == PressureDamper(50.0, 1e-5)
    assert entry.validity_range.pressure == (0.0, 6e5)
    assert entry.checks[0].conditions == (("pressure", 5e5), ("contraction", 0.0))
    assert {"ours", "tondu-lopez-2000"} <= {reference.key for reference in cite(entry)}
    assert entry.muscle.tension(5e5, 0.0) == 1200.0
    held_back = 2000.0 * 0.1 * 0.3 + (50.0 + 1e-5 * 5e5) * 0.02
    assert entry.muscle.tension(5e5, 0.1, 0.02) == entry.characteristic.force(5e5, 0.1) - held_back


def test_the_page_on_muscle_files_holds_the_muscle_that_it_names(tmp_path: Path):
    page = (Path(__file__).parents[2] / "docs" / "guides/muscle-file.md").read_text(
        encoding="utf-8"
    )
    (text,) = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    entry = library.load(written(tmp_path, text))
    assert entry.muscle.damper == LinearDamper(200.0)
    assert entry.muscle.friction == Dahl(3e4, 12.0)
    assert entry.characteristic.force(375e3, 0.11) == pytest.approx(
        library.load("dmsp-20-300").characteristic.force(375e3, 0.11), rel=1e-4
    )
    assert entry.checks[0].tolerance == 38.9


@pytest.mark.parametrize("name", files.list_data())
def test_a_published_data_set_is_cited_also_by_a_fit_to_it(name: str, tmp_path: Path):
    """The licence of most of them requires it."""
    data = library.load_data(name)
    (source,) = cite(data)
    words = re.findall(r"[A-Z][a-z]+", source.authors)
    assert words
    assert all(word in data.notes[-1] for word in words), (
        "the header of the file names the same authors"
    )
    assert cite(data.rows(slice(20))) == [source]
    result = fit(
        ContractileSurface.blank(2, max_force=1e5),
        [data.rows(slice(0, None, 2)), data.rows(slice(1, None, 2))],
    )
    assert {r.key for r in cite(result)} == {source.key, *(r.key for r in cite(result.model))}
    entry = library.load(write.save(result, tmp_path / "muscle.toml"))
    assert source in cite(entry)


FRICTION = [
    Dahl(3e4, 12.5),
    LuGre(3e4, 12.5, 2.5, 0.004, 3.0, 40.0),
    BoucWen(3e4, 12.5, 1.7, 0.8),
    MaxwellSlip((2e4, 1e4), (3e-4, 1.2e-3), 0.1),
    PrandtlIshlinskii((2e4, 1e4), (3e-4, 1.2e-3), (6.0, -6.0), (0.6, -0.5)),
]


@pytest.mark.parametrize("law", FRICTION, ids=lambda law: type(law).__name__)
def test_a_muscle_file_carries_its_friction(law, tmp_path: Path):
    entry = dataclasses.replace(library.load("chou-hannaford"), friction=law)
    again = library.load(write.save(entry, tmp_path / "muscle.toml"))
    assert again == dataclasses.replace(entry, name="muscle")
    assert again.muscle.friction == law
    assert {r.key for r in cite(again)} >= {r.key for r in law.references}
    bristles = {state.name: 1e-4 for state in law.states}
    held = again.muscle.unclamped_tension(3e5, 0.1, 0.01, bristles)
    assert held == dataclasses.replace(entry, friction=None).muscle.unclamped_tension(
        3e5, 0.1
    ) - law.force(bristles, 0.01)


def test_a_plant_takes_over_the_friction_of_its_muscle_file_unless_it_states_another(
    tmp_path: Path,
):
    entry = dataclasses.replace(library.load("dmsp-20-300"), friction=FRICTION[0])
    write.save(entry, tmp_path / "muscle.toml")
    table = {"library": "muscle.toml", "damper": {"model": "LinearDamper", "damping": 100.0}}
    place = Location("scenario.toml", "plant.muscle", tmp_path)
    assert PLANT_READER.build(table, place, kind=Muscle).friction == FRICTION[0]
    assert (
        PLANT_READER.build(
            {**table, "friction": {"model": "NoFriction"}}, place, kind=Muscle
        ).friction
        == NoFriction()
    )


def test_a_muscle_file_carries_wall_stop_and_creep(tmp_path: Path):
    parts = {
        "wall": SwellingWall(1e-5, 1.5e5, 5e4, 0.2),
        "stop": EndStop(0.25, HuntCrossley(1e7)),
        "creep": CreepElements((500.0,), (8.0,)),
    }
    entry = dataclasses.replace(library.load("dmsp-20-300"), **parts)
    again = library.load(write.save(entry, tmp_path / "muscle.toml"))
    assert again == dataclasses.replace(entry, name="muscle")
    assert {name: getattr(again.muscle, name) for name in parts} == parts


def test_a_friction_of_another_kind_is_refused(tmp_path: Path):
    spring = '[friction]\nmodel = "LinearSpring"\nstiffness = 1.0\n'
    with pytest.raises(
        ParameterError,
        match=r"\[friction\]: LinearSpring is not allowed here; a Friction is required",
    ):
        library.load(
            written(tmp_path, GOOD.replace("[validity_range]", spring + "[validity_range]"))
        )


def test_a_saved_muscle_loads_to_the_same_numbers(tmp_path: Path):
    entry = library.load(written(tmp_path, GOOD))
    saved = write.save(entry, tmp_path / "muscle.toml")
    assert library.load(saved) == entry
    assert [path.name for path in tmp_path.iterdir()] == ["muscle.toml"]


@pytest.mark.parametrize("name", files.list_laws())
def test_every_library_entry_survives_saving(name: str, tmp_path: Path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        entry = library.load(name)
        assert library.load(write.save(entry, tmp_path / f"{name}.toml")) == entry


def test_texts_with_quotes_and_new_lines_survive_saving(tmp_path: Path):
    law = ChouHannaford1996(Braid(0.01, 0.4, 0.3))
    entry = Entry(
        "odd", 'called "odd" \\ here', "chosen", law, law.geometry, note="two\nlines\tä\x7f"
    )
    assert library.load(write.save(entry, tmp_path / "odd.toml")) == entry


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path: Path):
    entry = library.load("chou-hannaford")
    with pytest.raises(FileError, match=r"nowhere.*cannot be written"):
        write.save(entry, tmp_path / "nowhere" / "muscle.toml")
    (tmp_path / "taken.toml").mkdir()
    with pytest.raises(FileError, match=r"taken\.toml: cannot be written"):
        write.save(entry, tmp_path / "taken.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["taken.toml"]


@pytest.mark.parametrize(
    ("was", "becomes", "kind", "message"),
    [
        # missing
        (
            'radius = "10 mm"\n',
            "",
            ParameterError,
            r"\[characteristic.inner.geometry\]: Braid needs 'radius' \[m\] \(r_0",
        ),
        ('model = "Clamped"', "", ParameterError, r"\[characteristic\]: the model is not named"),
        ('provenance = "chosen"', "", ParameterError, r"muscle.toml: 'provenance' is missing"),
        (
            "[characteristic.inner.geometry]",
            "[x]",
            ParameterError,
            r"muscle.toml: unknown key 'x'; there are title",
        ),
        ('source = "the clamp"', "", ParameterError, r"\[check 1\]: 'source' is missing"),
        (
            'contraction = "0 %"\n',
            "",
            ParameterError,
            r"\[check 1\]: a check of the force requires pressure and contraction",
        ),
        ('tolerance = "1 N"', "", ParameterError, r"\[check 1\]: 'tolerance' is missing"),
        # misspelt
        (
            "end_correction",
            "end_corection",
            ParameterError,
            r"no parameter 'end_corection'.*Did you mean 'end_correction'\?",
        ),
        (
            '"TonduLopez2000"',
            '"TonduLopez2001"',
            UnknownNameError,
            r"\[characteristic.inner\], model: no model 'TonduLopez2001'",
        ),
        ("[spring]", "[sprng]", ParameterError, r"unknown key 'sprng'.*Did you mean 'spring'\?"),
        (
            '"300 mm"',
            '"300 mn"',
            UnitError,
            r"\[characteristic.inner.geometry\], resting_length: 'mn' is not a known unit",
        ),
        (
            'quantity = "force"',
            'quantity = "forc"',
            ParameterError,
            r"no check of the quantity 'forc'.*Did you mean 'force'\?",
        ),
        # mistyped
        (
            '"10 mm"',
            "[0.01]",
            ParameterError,
            r"radius is \[0.01\]; it must be one number in m \(r_0, radius of the braid",
        ),
        ('"10 mm"', "true", ParameterError, r"radius is True; it must be a number in m"),
        ('"10 mm"', '"10"', UnitError, r"radius: '10' has no unit; write it like '10 mm'"),
        ('"10 mm"', '"wide"', UnitError, r"radius: 'wide' is not a number with a unit"),
        ('"10 mm"', '"10 N"', UnitError, r"radius: unit 'N' cannot be converted to 'm'"),
        (
            '"LinearSpring"',
            '"Braid"',
            ParameterError,
            (
                r"\[spring\]: Braid is not allowed here; a Spring is required: CubicSpring,"
                r" LinearSpring"
            ),
        ),
        (
            "year = 2024",
            'year = "2024"',
            ParameterError,
            r"\[reference 1\]: year is '2024'; it must be an integer",
        ),
        (
            'title = "A muscle of our own"',
            "title = 7",
            ParameterError,
            r"title is 7; it must be a text in quotes",
        ),
        # non-physical
        (
            '"10 mm"',
            '"-10 mm"',
            ParameterError,
            r"radius of the braid at rest\) is -0.01 m; allowed range: 0.0001 to 0.2 m",
        ),
        (
            '"25 deg"',
            '"25 rad"',
            ParameterError,
            r"theta_0.* is 25 rad; allowed range: 0.05 to 1.5 rad",
        ),
        ('"300 mm"', "nan", ParameterError, r"L_0.* is nan; it must be finite"),
        (
            '"1.2 kN"',
            '"-1 N"',
            ParameterError,
            r"\[characteristic\]: Clamped: min_force 0 must be less than max_force",
        ),
        (
            '"6 bar"',
            '"-1 bar"',
            ParameterError,
            r"\[validity_range\]: ValidityRange: min_pressure 0 must be less than max_pressure",
        ),
    ],
)
def test_a_bad_file_is_told_what_is_wrong(
    tmp_path: Path, was: str, becomes: str, kind: type[AirmuscleError], message: str
):
    assert was in GOOD
    with pytest.raises(kind, match=message) as raised:
        library.load(written(tmp_path, GOOD.replace(was, becomes, 1)))
    assert "muscle.toml" in str(raised.value)


def test_a_model_of_another_kind_is_refused(tmp_path: Path):
    braid = 'model = "Braid"\nradius = 0.01\nbraid_angle = 0.4\nresting_length = 0.3\n'
    text = f'title = "t"\nprovenance = "chosen"\n[characteristic]\n{braid}'
    with pytest.raises(
        ParameterError,
        match=r"\[characteristic\]: Braid is not allowed here; a Characteristic is required",
    ):
        library.load(written(tmp_path, text))
    text = (
        'title = "t"\nprovenance = "chosen"\n[characteristic]\nmodel ='
        f' "Clamped"\n[characteristic.inner]\n{braid}'
    )
    with pytest.raises(
        ParameterError,
        match=r"\[characteristic.inner\]: Braid is not allowed here; a ForceLaw is required",
    ):
        library.load(written(tmp_path, text))


def test_a_value_where_a_table_belongs_is_refused(tmp_path: Path):
    with pytest.raises(
        ParameterError, match=r"\[characteristic\] is 3; it must be a table. Write model = "
    ):
        library.load(written(tmp_path, 'title = "t"\nprovenance = "chosen"\ncharacteristic = 3\n'))
    text = (
        'title = "t"\nprovenance = "chosen"\n[characteristic]\nmodel ='
        ' "ChouHannaford1996"\ngeometry = 3\n'
    )
    with pytest.raises(
        ParameterError,
        match=(
            r"\[characteristic.geometry\] is 3; it must be a table. Write its values in it: radius,"
            r" braid_angle"
        ),
    ):
        library.load(written(tmp_path, text))


def test_a_file_that_is_no_toml_or_is_not_there(tmp_path: Path):
    with pytest.raises(FileError, match=r"muscle\.toml: is not valid TOML: .* \(at line 2, column"):
        library.load(written(tmp_path, "title = 'x'\n[characteristic\n"))
    with pytest.raises(FileError, match=r"nothing\.toml: there is no such file"):
        library.load(tmp_path / "nothing.toml")
    (tmp_path / "muscle.toml").write_bytes(GOOD.replace("own", "own\xe9").encode("latin-1"))
    with pytest.raises(FileError, match=r"is not UTF-8 text \(byte 29\)"):
        library.load(tmp_path / "muscle.toml")


def test_a_byte_order_mark_does_no_harm(tmp_path: Path):
    (tmp_path / "muscle.toml").write_text(GOOD, encoding="utf-8-sig")
    assert library.load(tmp_path / "muscle.toml").title == "A muscle of our own"


def test_a_unique_beginning_of_a_name_is_enough():
    assert library.load("chou").name == "chou-hannaford"
    with pytest.raises(
        UnknownNameError, match=r"'dmsp' is ambiguous: dmsp-10-250, dmsp-20-300\. Write more"
    ):
        library.load("dmsp")
    with pytest.raises(
        UnknownNameError,
        match=r"no library entry 'dsmp-20-300'; there are .* Did you mean 'dmsp-20-300'\?",
    ):
        library.load("dsmp-20-300")
    with pytest.raises(UnknownNameError, match="no library entry ''"):
        library.load("")


def test_an_entry_with_a_warning_gives_it(tmp_path: Path):
    with pytest.warns(AirmuscleWarning, match="muscle: made up"):
        library.load(written(tmp_path, 'warning = "made up"\n' + GOOD))


def test_an_entry_that_is_no_muscle_says_what_it_lacks():
    with pytest.raises(UnknownNameError, match=r"sarosi-dmsp-10 .* lacks a \[geometry\]"):
        _ = library.load("sarosi-dmsp-10").muscle
    table = dataclasses.replace(library.load("festo-tool-dmsp-20"), geometry=Braid(0.01, 0.4, 0.2))
    with pytest.raises(
        UnknownNameError, match="lacks a law solved for the force: see as_force_law"
    ):
        _ = table.muscle


@pytest.mark.parametrize("name", files.list_data())
def test_a_data_set_says_where_it_is_from(name: str):
    recording = library.load_data(name)
    assert len(recording) >= 60
    assert "source: " in recording.notes[-1]
    assert "licence: " in recording.notes[-1]


def test_the_measured_maps_know_their_resting_length():
    assert library.load_data("dmsp-20")["contraction"].max() == pytest.approx(0.26)
    assert library.load_data("dmsp-10")["contraction"].max() == pytest.approx(0.208)


def test_a_column_of_a_file_that_is_not_there(tmp_path: Path):
    table = '{ file = "map.csv", column = "force" }'
    text = (
        'title = "t"\nprovenance = "chosen"\n[characteristic]\nmodel = "Tabulated"\npressures ='
        f" {table}\n"
    )
    text += f"contractions = {table}\nforces = {table}\n"
    with pytest.raises(FileError, match=r"map\.csv"):
        library.load(written(tmp_path, text))
    with pytest.raises(
        ParameterError, match=r"pressures is .*; write a column of a file as \{ file = "
    ):
        library.load(written(tmp_path, text.replace("column", "colum")))


@pytest.mark.parametrize("name", model_names())
def test_every_model_that_a_file_may_name_is_there(name: str):
    assert dataclasses.is_dataclass(model_class(name, "here"))


def test_a_table_without_a_model_is_of_the_only_class_unless_a_file_may_name_a_subclass():
    models = [model_class(name, "test") for name in model_names()]
    for cls in models:
        has_variants = any(each is not cls and issubclass(each, cls) for each in models)
        assert (library.only_class(cls) is None) == has_variants, cls


def test_a_muscle_is_loaded_without_the_modules_of_control_laws():
    program = "import sys, airmuscle; airmuscle.load('dmsp-20-300'); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert not [
        name for name in done.stdout.split() if re.match(r"airmuscle\.control\.\w+\.", name)
    ]
