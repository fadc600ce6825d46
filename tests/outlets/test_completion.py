"""Completion: the shell completes commands, options and library names; names are found in any
spelling.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.errors import UnknownNameError
from airmuscle.outlets.cli import SHELLS, complete_data, complete_entry, complete_plant

FITTED_PARTS = ("dynamic", "joint", "live", "out", "regulator", "volume")


def completed(words: str, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The completions that bash receives for the last of some words."""
    items = words.split(" ")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(items) - 1))
    monkeypatch.setenv("_AIRMUSCLE_COMPLETE", "bash_complete")
    lines = airmuscle(prog_name="airmuscle").stdout.split()
    return [line.partition(",")[2] for line in lines]  # each with its kind


@pytest.mark.parametrize("shell", SHELLS)
def test_the_script_of_each_shell_asks_this_program(shell: str):
    script = airmuscle("--completion", shell)
    assert script.exit_code == 0
    assert f"_AIRMUSCLE_COMPLETE={shell}_complete" in script.stdout


def test_the_script_for_bash_is_valid(tmp_path: Path):
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("bash is not installed")
    script = tmp_path / "completion.sh"
    script.write_text(airmuscle("--completion", "bash").stdout, encoding="utf-8")
    assert subprocess.run([bash, "-n", str(script)]).returncode == 0


def test_another_shell_is_refused_with_those_that_are_supported():
    failed = airmuscle("--completion", "tcsh")
    assert failed.exit_code == 2
    assert "'tcsh' is not supported; allowed are bash, zsh, fish" in " ".join(failed.stderr.split())


def test_commands_options_and_names_of_the_library_are_completed(monkeypatch: pytest.MonkeyPatch):
    fits = {"fit", *(f"fit-{part}" for part in FITTED_PARTS)}
    assert fits == set(completed("airmuscle fit", monkeypatch))
    assert "--pressure" in completed("airmuscle evaluate --pre", monkeypatch)
    assert completed("airmuscle show matr", monkeypatch) == ["matrix-821"]
    assert completed("airmuscle simulate arm", monkeypatch) == ["arm-lilly-quesada"]
    assert {"dmsp-20-300", "joint-dmsp-20-matrix"} <= set(
        completed("airmuscle predict ", monkeypatch)
    )
    assert "dmsp-20-300" in completed("airmuscle fit dmsp", monkeypatch)


def test_each_kind_of_argument_offers_its_own_names():
    assert "matrix-821" in complete_entry("MAT")
    assert "matrix-821" not in complete_plant("")
    assert set(complete_data("dmsp-20")) == {"dmsp-20-300"}


@pytest.mark.parametrize("name", ["DMSP-20-300", "Dmsp_20_300", "dmsp 20 300", "DMSP-20"])
def test_names_are_found_in_any_case_and_spelling(name: str):
    assert am.load(name).name == "dmsp-20-300"


def test_everything_that_is_listed_can_be_loaded_in_upper_case():
    for name in am.list_library():
        if name.startswith(("matrix", "smc-sy5", "festo-dmsp-1", "joint-sam", "tondu")):
            assert am.load(name.upper()).name == name


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("dsmp-20-300", "Did you mean 'dmsp-20-300'"),
        ("sy5000", "Did you mean 'smc-sy5000'"),
        ("the lilly arm", "Did you mean 'arm-lilly-quesada'"),
        ("zzz", r"there are .* and \d+ more\.$"),
    ],
)
def test_near_misses_are_suggested(name: str, said: str):
    with pytest.raises(UnknownNameError, match=said):
        am.load(name)
