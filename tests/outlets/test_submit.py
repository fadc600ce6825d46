"""`airmuscle submit` makes a contribution from a folder, and `--check` refuses it for each cause with a
remedy that works.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest
from command_line import airmuscle
from user_files import write_contribution

import airmuscle as am
from airmuscle.design import check_submission, declaration_toml, propose_submission, read_submission
from airmuscle.files import load_law


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("door") / "contribution"
    write_contribution(folder)
    result = airmuscle("submit", folder)
    assert result.exit_code == 0, result.output
    return folder


@pytest.fixture
def contribution(prepared: Path, tmp_path: Path) -> Path:
    """A contribution of which a test may spoil the files."""
    return shutil.copytree(prepared, tmp_path / "contribution")


def replace_in_declaration(folder: Path, old: str, new: str) -> None:
    path = folder / "submission.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def refusals_of(folder: Path) -> dict[str, list[str]]:
    """The reasons by rule, as --check states them; it exits with 1."""
    result = airmuscle("submit", folder, "--check", "--json")
    assert result.exit_code == 1, result.output
    reasons: dict[str, list[str]] = {}
    for row in json.loads(result.stdout)["submission"]["refusals"]:
        assert row["what_to_do"].endswith(".")
        reasons.setdefault(row["rule"], []).append(row["reason"])
    return reasons


def test_a_folder_without_declaration_gets_one_with_question_marks(contribution: Path):
    (contribution / "submission.toml").unlink()
    shutil.rmtree(contribution / "report")
    result = airmuscle("submit", contribution)
    assert result.exit_code == 0
    submission = read_submission(contribution)
    questions = list(submission.open_keys())
    assert f"its {len(questions)} question marks" in result.output
    assert submission.muscle == "muscle.toml"
    assert [record.file for record in submission.records] == ["later.csv", "loop.csv", "map.csv"]
    for record in submission.records:
        content = (contribution / record.file).read_bytes()
        assert record.sha256 == hashlib.sha256(content).hexdigest()
    assert set(refusals_of(contribution)) >= {"declaration", "licence"}


def test_a_whole_contribution_is_accepted_and_its_entry_says_who(prepared: Path):
    result = airmuscle("submit", prepared, "--check")
    assert result.exit_code == 0, result.output
    assert "Accepted" in result.output
    page = (prepared / "report" / "report.html").read_text(encoding="utf-8")
    assert {path.name for path in (prepared / "report" / "figures").glob("*.svg")} == {
        "entry.svg",
        "prediction-1.svg",
    }
    assert "CC0-1.0" in page
    entry = load_law(prepared / "report" / "entry.toml")
    assert entry.submitted_by == "A. Smith <smith@example.org>"
    assert entry.grade == (
        "measured by A. Smith, Example University 2026; submitted by A. Smith <smith@example.org>"
    )
    assert f"Grade: {entry.grade}" in " ".join(
        airmuscle("show", prepared / "report" / "entry.toml").output.split()
    )
    assert entry.characteristic == load_law(prepared / "muscle.toml").characteristic


def test_the_figure_is_the_error_of_the_law_at_the_rows(prepared: Path):
    record = am.bench.read_csv(prepared / "later.csv")
    force = load_law(prepared / "muscle.toml").characteristic.force(
        record["pressure"], record["contraction"]
    )
    pulls = record["force"] > 0.0  # a slack muscle says nothing of its law
    expected = float(((force - record["force"])[pulls] ** 2).mean() ** 0.5)
    verdict = check_submission(prepared)
    assert verdict.figures["later.csv"].rms_error == pytest.approx(expected, rel=1e-9)
    stated = float(read_submission(prepared).records[0].rms_error.split()[0])
    assert expected <= stated <= 1.01 * expected


def test_preparing_again_changes_nothing(contribution: Path):
    before = (contribution / "submission.toml").read_bytes()
    assert airmuscle("submit", contribution).exit_code == 0
    assert (contribution / "submission.toml").read_bytes() == before


def test_a_check_writes_nothing(contribution: Path):
    def state():
        return {path: path.stat().st_mtime_ns for path in contribution.rglob("*")}

    before = state()
    assert airmuscle("submit", contribution, "--check").exit_code == 0
    assert state() == before


SPOILED = {
    "no licence": ('licence = "CC0-1.0"', 'licence = ""', "licence", "no licence is stated"),
    "another licence": ("CC0-1.0", "CC-BY-NC-4.0", "licence", "'CC-BY-NC-4.0' is no licence"),
    "taken name": ("smith-pam-20-300", "dmsp-20-300", "declaration", "has an entry of the name"),
    "impossible name": ("smith-pam-20-300", "../Smith", "declaration", "name is '../Smith'"),
    "open rig": ('force = "simulated"', 'force = "?"', "declaration", "rig.force is not answered"),
    "missing record": ('"loop.csv"', '"loops.csv"', "records present", "loops.csv is missing"),
    "nothing held out": ("held out", "fit", "records of fit and held out", "use = 'held out'"),
    "unknown use": ('"held out"', '"test"', "records of fit and held out", "later.csv is 'test'"),
    "missing muscle": ("muscle.toml", "no.toml", "muscle file", "there is no such file"),
    "muscle elsewhere": ("muscle.toml", "../muscle.toml", "muscle file", "not in the folder"),
    "missing mapping": ('mapping = ""', 'mapping = "a.toml"', "readable records", "No such file"),
    "impossible unit": (
        "rms_error = ",
        'rms_error = "1 m" #',
        "held-out figures",
        "unit 'm' cannot",
    ),
    "no figure": ("rms_error = ", "# ", "held-out figures", "states no rms_error"),
    "better figure": ("rms_error = ", 'rms_error = "1 N" #', "held-out figures", "worse than"),
}


@pytest.mark.parametrize("cause", SPOILED)
def test_a_declaration_is_refused_with_its_reason(contribution: Path, cause: str):
    old, new, rule, reason = SPOILED[cause]
    replace_in_declaration(contribution, old, new)
    reasons = refusals_of(contribution)
    assert list(reasons) == [rule]
    assert any(reason in text for text in reasons[rule]), reasons


def test_a_changed_record_is_refused_until_its_hash_is_stated_anew(contribution: Path):
    path = contribution / "map.csv"
    path.write_bytes(path.read_bytes() + b"\n")
    reasons = refusals_of(contribution)
    assert list(reasons) == ["hashes"]
    assert hashlib.sha256(path.read_bytes()).hexdigest() in reasons["hashes"][0]
    declaration = contribution / "submission.toml"
    lines = declaration.read_text(encoding="utf-8").splitlines()
    place = lines.index('file = "map.csv"')
    declaration.write_text("\n".join(lines[: place + 1] + lines[place + 2 :]), encoding="utf-8")
    assert airmuscle("submit", contribution).exit_code == 0


def test_a_worse_muscle_file_is_refused_and_its_entry_removed(contribution: Path):
    path = contribution / "muscle.toml"
    entry = load_law(path)
    law = entry.characteristic
    am.save(am.core.with_parameters(law, scaled(law, 0.98)), path)
    assert "worse than the stated" in refusals_of(contribution)["held-out figures"][0]
    assert airmuscle("submit", contribution).exit_code == 1
    assert not (contribution / "report" / "entry.toml").exists()


def scaled(law, factor: float) -> list[float]:
    """The parameters of a law whose coefficients, and so its force, are scaled."""
    return [
        leaf.value * factor if leaf.path.startswith("c") else leaf.value
        for leaf in am.core.leaves(law)
    ]


def test_a_copy_of_a_record_of_the_fit_is_not_held_out(contribution: Path):
    shutil.copy(contribution / "map.csv", contribution / "later.csv")
    (contribution / "submission.toml").unlink()
    submission = propose_submission(contribution)
    (contribution / "submission.toml").write_text(declaration_toml(submission), encoding="utf-8")
    text = (contribution / "submission.toml").read_text(encoding="utf-8")
    later, _, others = text.partition('"loop.csv"')
    text = later.replace('use = "?"', 'use = "held out"') + '"loop.csv"'
    text += others.replace('use = "?"', 'use = "fit"')
    (contribution / "submission.toml").write_text(text, encoding="utf-8")
    reasons = refusals_of(contribution)
    assert "the same bytes as map.csv" in reasons["records of fit and held out"][0]


def test_a_record_may_be_elsewhere_by_address_and_hash(contribution: Path, tmp_path: Path):
    downloads = tmp_path / "downloads"
    downloads.mkdir()
    replace_in_declaration(
        contribution, 'file = "', 'address = "https://example.org/records"\nfile = "'
    )
    shutil.move(contribution / "loop.csv", downloads)
    result = airmuscle("submit", contribution, "--check")
    assert result.exit_code == 0
    assert "loop.csv is at https://example.org/records" in result.output
    shutil.move(contribution / "later.csv", downloads)
    assert list(refusals_of(contribution)) == ["records present"]
    assert airmuscle("submit", contribution, "--check", "--downloads", downloads).exit_code == 0


def test_a_record_with_a_fault_is_refused(contribution: Path):
    path = contribution / "loop.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    heading = next(i for i, line in enumerate(lines) if "pressure" in line)
    path.write_text("\n".join(lines[: heading + 12]) + "\n", encoding="utf-8")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    old = next(r.sha256 for r in read_submission(contribution).records if r.file == "loop.csv")
    replace_in_declaration(contribution, old, digest)
    reasons = refusals_of(contribution)
    assert list(reasons) == ["diagnoses"]
    assert "loop.csv: length" in reasons["diagnoses"][0]


def test_a_law_that_the_audit_blames_is_refused(contribution: Path):
    path = contribution / "muscle.toml"
    law = am.characteristic.Reynolds2003(0.3, 179.2, 1.39e-3, -5710.0, 0.0)
    am.save(law, path)
    reasons = refusals_of(contribution)
    assert "falls with contraction" in reasons["audit"][0]


MALFORMED = {
    "no TOML": ("[rig]", "[rig", "TOML"),
    "unknown key": ("licence =", "license =", "unknown key 'license'"),
    "number": ('licence = "CC0-1.0"', "licence = 1", "must be a text in quotes"),
    "path above": ('file = "map.csv"', 'file = "../map.csv"', "a path below the folder"),
    "record table": ("[[record]]", "[[records]]", "unknown key 'records'"),
}


@pytest.mark.parametrize("fault", MALFORMED)
def test_a_declaration_of_another_form_says_where(contribution: Path, fault: str):
    old, new, message = MALFORMED[fault]
    replace_in_declaration(contribution, old, new)
    result = airmuscle("submit", contribution, "--check")
    assert result.exit_code == 1
    assert "submission.toml" in result.stderr
    assert message in result.stderr


def test_a_folder_without_records_says_what_it_needs(tmp_path: Path):
    for folder in (tmp_path, tmp_path / "nowhere"):
        result = airmuscle("submit", folder)
        assert result.exit_code == 1
        assert "records" in result.stderr
    assert not (tmp_path / "submission.toml").exists()
