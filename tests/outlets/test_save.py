"""A muscle, a characteristic, a fit and a library entry are written to muscle files that load reads
back.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import airmuscle as am
from airmuscle.physics import Braid, ContractileSurface, Dahl, TonduLopez2000

ENTRY = am.load("dmsp-20-300")
MUSCLES = {
    "plain": ENTRY.muscle,
    "own elements": am.Muscle(
        ENTRY.characteristic,
        ENTRY.geometry,
        am.LinearSpring(10.0),
        am.LinearDamper(200.0),
        Dahl(3e4, 12.0),
    ),
}


@pytest.mark.parametrize("name", MUSCLES)
def test_a_saved_muscle_is_read_back(name: str, tmp_path: Path):
    path = am.save(MUSCLES[name], tmp_path / "mine.toml")
    assert am.load(path).muscle == MUSCLES[name]


def test_a_saved_characteristic_is_read_back(tmp_path: Path):
    path = am.save(ENTRY.characteristic, tmp_path / "law.toml")
    assert am.load(path).characteristic == ENTRY.characteristic


def test_a_saved_fit_is_read_back_with_its_errors_and_its_range(tmp_path: Path):
    fit = am.fit(ContractileSurface.blank(3), am.load_data("dmsp-20-300"))
    saved = am.load(am.save(fit, tmp_path / "fit.toml"))
    assert (saved.characteristic, saved.validity_range) == (fit.model, fit.validity_range)
    assert saved.provenance == "fitted"
    assert saved.note.startswith("Fitted to dmsp-20-300.csv: rms error")
    assert saved.error_band.quantity == "force"
    muscle = am.Muscle(fit.model, ENTRY.geometry)
    assert am.load(am.save(muscle, tmp_path / "muscle.toml")).muscle == muscle


def test_the_fit_of_a_law_with_a_geometry_is_saved_as_a_muscle(tmp_path: Path):
    law = TonduLopez2000(Braid(0.01, 0.43, 0.3), 1.1)
    fit = am.fit(law, am.load_data("dmsp-20-300"))
    saved = am.load(am.save(fit, tmp_path / "fit.toml"))
    assert saved.muscle.contractile == fit.model
    assert saved.geometry == fit.model.geometry
