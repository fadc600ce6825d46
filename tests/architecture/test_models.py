"""Models are complete: each is exported, and each law of a paper has a library file; a missing step
is named.
"""

from __future__ import annotations

import importlib
import inspect
import json
import pkgutil
import re
from pathlib import Path

from airmuscle.files.library import PACKAGES, files, model_class, model_names
from airmuscle.physics import Characteristic

PARTS = {"PlaneCurve", "PlaneCurves"}
"""Coefficients of BorzikovaDirect, which builds them itself."""
GENERAL_LAWS = {"ContractileSurface", "VirtualWork"}
"""Laws with a reference but without parameters of a certain muscle."""


def models_by_package():
    """(package, class) of every model that a file may name, exported or not."""
    for package in PACKAGES:
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            for cls in vars(importlib.import_module(found.name)).values():
                if (
                    inspect.isclass(cls)
                    and cls.__module__ == found.name
                    and cls.__dict__.get("from_file")
                ):
                    yield package.__name__, cls


def test_every_model_is_exported():
    known = {*model_names(), *PARTS}
    missing = [
        f"export {cls.__name__} in {package.replace('.', '/')}/__init__.pyi"
        for package, cls in models_by_package()
        if not inspect.isabstract(cls) and cls.__name__ not in known
    ]
    assert not missing, "\n".join(missing)


def test_every_law_of_a_paper_has_a_library_file():
    texts = "".join(path.read_text(encoding="utf-8") for path in files.LAWS.glob("*.toml"))
    laws = [
        law
        for name in model_names()
        if issubclass(law := model_class(name, "test"), Characteristic)
    ]
    missing = [
        f"write a file in airmuscle/files/library that names {law.__name__}"
        for law in laws
        if law.references and law.__name__ not in GENERAL_LAWS and f'"{law.__name__}"' not in texts
    ]
    assert not missing, "\n".join(missing)


def test_the_bibliography_is_sorted_and_each_of_its_references_is_used():
    package = Path(files.__file__).parents[2]
    known = json.loads((package / "core" / "references.json").read_text(encoding="utf-8"))
    used = {
        key
        for path in package.rglob("*.py")
        for key in re.findall(r'published\("([^"]+)"', path.read_text("utf-8"))
    }
    assert list(known) == sorted(known)
    assert used == set(known)
