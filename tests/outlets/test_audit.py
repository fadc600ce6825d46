"""`airmuscle audit` finds planted faults of laws, orifices and constants, and blames no right one."""

from __future__ import annotations

import json
from pathlib import Path

import audited_models
import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.design import (
    AuditedLaw,
    EnclosedVolume,
    FunctionProcess,
    audit_constants,
    audit_law,
    audit_orifice,
    law_of_entry,
    law_of_points,
)
from airmuscle.errors import FileError, ParameterError, UnknownNameError
from airmuscle.files import allow_code, list_laws, load_law

TESTS = str(Path(__file__).resolve().parents[1])


def values_of(name: str):
    """A function of arrays that is not a number where the model raises."""
    model = getattr(audited_models, name)

    def values(first, second):
        out = []
        for pair in zip(np.ravel(first), np.ravel(second), strict=True):
            try:
                value = complex(model(*map(float, pair)))
            except ValueError:
                value = complex("nan")
            out.append(value.real if value.imag == 0.0 else np.nan)
        return np.reshape(out, np.shape(first))

    return values


def law(name: str, enclosed: EnclosedVolume | None = None) -> AuditedLaw:
    return AuditedLaw(name, values_of(name), (0.0, 6e5), (0.0, 0.25), enclosed)


RIGHT = (
    *("ideal", "end_correction", "with_wall", "linear", "slack_smoothly", "exponential"),
    *("surface", "refuses_what_is_longer", "stretched_sleeve"),
)
WRONG = {
    "explodes": ("bounded beyond the range", "explodes"),
    "pushes": ("pulls only", "pushes with"),
    "grows": ("falls with contraction", "a longer muscle must pull more"),
    "inverted": ("grows with pressure", "falls by"),
    "jumps": ("continuous", "jumps by"),
    "in_bar": ("units", "expected in bar"),
    "in_per_cent": ("units", "expected in per cent"),
    "absolute": ("units", "expected as an absolute one"),
    "not_real": ("finite", "No finite real force"),
    "remembers": ("no memory", "remembers earlier calls"),
}


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_law_is_not_blamed(name: str):
    assert audit_law(law(name)).findings == ()


@pytest.mark.parametrize("name", WRONG)
def test_a_planted_fault_is_named_first_with_calls_that_show_it(name: str):
    rule, words = WRONG[name]
    findings = audit_law(law(name)).findings
    assert findings[0].rule == rule
    assert words in findings[0].text
    assert findings[0].replay
    assert {finding.rule for finding in findings} == {rule}


@pytest.mark.parametrize("name", list_laws())
@pytest.mark.filterwarnings("ignore")
def test_the_laws_of_the_library_pass(name: str):
    assert audit_law(law_of_entry(load_law(name))).findings == ()


NOT_FINITE = {
    "no number": lambda pressure, contraction: np.full(np.shape(pressure), np.nan),
    "infinite": lambda pressure, contraction: np.full(np.shape(pressure), np.inf),
    "minus infinite": lambda pressure, contraction: np.full(np.shape(pressure), -np.inf),
    "no number without pressure": lambda pressure, contraction: np.where(
        pressure > 0.0, 1e-3 * pressure * (0.3 - contraction), np.nan
    ),
    "infinite where it is short": lambda pressure, contraction: np.where(
        contraction < 0.2, 1e-3 * pressure * (0.3 - contraction), np.inf
    ),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", NOT_FINITE)
def test_a_force_that_is_no_number_is_named_as_such_and_as_no_memory(kind: str):
    result = audit_law(AuditedLaw("law", NOT_FINITE[kind], (0.0, 6e5), (0.0, 0.25)))
    named = [finding.rule for finding in result.findings]
    assert "finite" in named
    assert "no memory" not in named


def test_every_law_counts_the_points_at_which_it_was_examined():
    library = audit_law(law_of_entry(load_law("dmsp-20-300")))
    assert library.evaluations > 1000
    calls = []

    def force(pressure, contraction):
        calls.append(np.size(pressure))
        return 2e-3 * pressure * (1.0 - contraction / 0.25)

    assert audit_law(AuditedLaw("law", force, (0.0, 6e5), (0.0, 0.25))).evaluations == sum(calls)


def test_the_replay_is_the_call_with_its_value():
    finding = audit_law(law("explodes")).findings[0]
    call, value = finding.replay[0].split(" = ")
    pressure, contraction = map(float, call.removeprefix("explodes(").rstrip(")").split(", "))
    assert audited_models.explodes(pressure, contraction) == pytest.approx(float(value), rel=1e-4)
    assert float(value) > 3.0 * audited_models.explodes(6e5, 0.0)


@pytest.mark.parametrize(("volume", "is_paid"), [("volume", True), ("volume_of_a_cylinder", False)])
def test_energy_from_nothing_is_found_where_force_and_volume_are_not_of_one_muscle(volume, is_paid):
    values = values_of(volume)
    enclosed = EnclosedVolume(lambda at: values(at, np.zeros_like(at)), 0.2)
    findings = audit_law(law("ideal", enclosed)).findings
    assert (findings == ()) == is_paid
    if not is_paid:
        assert "work that the air does not pay" in findings[0].text


ORIFICES = {
    "iso": "",
    "never_chokes": "does not choke",
    "of_gauge_pressures": "seems to expect gauge pressures",
    "uphill": "from the lower to the higher pressure",
}


@pytest.mark.parametrize("name", ORIFICES)
def test_an_orifice_chokes_and_flows_downhill(name: str):
    findings = audit_orifice(name, values_of(name)).findings
    assert bool(findings) == bool(ORIFICES[name])
    assert ORIFICES[name] in " ".join(finding.text for finding in findings)


def test_constants_that_differ_from_print_or_that_no_muscle_has(tmp_path):
    file = tmp_path / "constants.csv"
    file.write_text(
        "name,value,unit,printed\n"
        "ratio of friction,0.2,,0.3\n"
        "density of the rubber,10156,kg/m^3,\n"
        "braid angle,25,rad,\n"
        "critical ratio,0.3,,0.3\n"
        "gas constant,287,J/(kg K),287.1\n",
        encoding="utf-8",
    )
    texts = [finding.text for finding in audit_constants(file).findings]
    assert texts[0] == "ratio of friction is 0.2 in the code and 0.3 in print (0.667 times)."
    assert texts[1].startswith("density of the rubber = 10156 kg/m^3 is outside")
    assert texts[2].endswith("It seems to be in degrees.")
    assert len(texts) == 3


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("name,size\na,1\n", "a list of constants has a heading with name and value"),
        ("name,value\nlength,long\n", "value of length is 'long'; it must be a number"),
        ("name,value\n", "a heading with name and value"),
    ],
)
def test_a_list_of_another_form_is_refused(tmp_path, content, message):
    file = tmp_path / "constants.csv"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(FileError, match=message):
        audit_constants(file)


def test_constants_of_a_spreadsheet_with_semicolons_and_decimal_commas_are_read(tmp_path):
    file = tmp_path / "constants.csv"
    file.write_text("name;value;unit;printed\nbraid angle;0,4;rad;0,44\n", encoding="utf-8")
    answer = json.loads(airmuscle("audit", str(file), "--json").stdout)
    assert answer["audit"]["problems"] == [
        "braid angle is 0.4 in the code and 0.44 in print (0.909 times)."
    ]


def test_points_of_a_file_are_a_law_where_they_are(tmp_path):
    rows = ["pressure [kPa],contraction [%],force [N]"]
    for pressure in (100, 200, 300, 400):
        for contraction in (0, 5, 10, 15):
            force = 2.0 * pressure * (0.2 + contraction / 100.0)  # grows with contraction
            rows.append(f"{pressure},{contraction},{force}")
    file = tmp_path / "map.csv"
    file.write_text("\n".join(rows), encoding="utf-8")
    result = audit_law(law_of_points(file))
    assert [finding.rule for finding in result.findings] == ["falls with contraction"]
    assert dict(result.left_out)["bounded beyond the range"] == "a table says nothing there"


def test_a_function_runs_in_its_own_process_and_needs_permission(monkeypatch):
    monkeypatch.chdir(TESTS)
    with pytest.raises(UnknownNameError, match="is code of a user"):
        FunctionProcess("audited_models:ideal")
    with allow_code():
        function = FunctionProcess("audited_models:ideal")
        values = function(np.array([[3e5], [6e5]]), np.array([0.0, 0.1]))
    assert values.shape == (2, 2)
    assert values[1, 0] == pytest.approx(audited_models.ideal(6e5, 0.0))
    assert function.evaluations == 4


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "audited_models:raises",
            r"raises at each of 2 points, at \(300000.0, 0.0\): RuntimeError",
        ),
        ("audited_models:missing", "cannot be imported: AttributeError"),
        ("no_such_module:force", "cannot be imported: ModuleNotFoundError"),
        ("audited_models:hangs", r"did not answer within 1 s; it stopped at point 1 of 2"),
    ],
)
def test_a_function_that_cannot_be_audited_has_its_sentence(monkeypatch, name, message):
    monkeypatch.chdir(TESTS)
    with allow_code(), pytest.raises(Exception, match=message):
        FunctionProcess(name, time_limit=1.0 if "hangs" in name else 60.0)([3e5, 6e5], 0.0)


def test_the_command_says_what_is_wrong_and_ends_with_1(monkeypatch):
    monkeypatch.chdir(TESTS)
    answer = airmuscle("audit", "audited_models:in_bar", "--allow-code", "--json")
    assert answer.exit_code == 1
    assert "expected in bar" in json.loads(answer.stdout)["audit"]["problems"][0]
    assert (
        airmuscle("audit", "audited_models:iso", "--kind", "orifice", "--allow-code").exit_code == 0
    )
    refused = airmuscle("audit", "audited_models:ideal")
    assert refused.exit_code == 1
    assert "--allow-code" in refused.output


def test_an_empty_range_and_half_of_the_energy_are_refused():
    with pytest.raises(ParameterError, match="the first must be less than the second"):
        AuditedLaw("law", values_of("ideal"), (6e5, 0.0), (0.0, 0.2))
    answer = airmuscle("audit", "dmsp-20-300", "--resting-length", "0.3 m")
    assert "--volume and --resting-length belong together" in answer.output
