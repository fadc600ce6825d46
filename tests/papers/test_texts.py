"""Each text of the chapters on the papers belongs to a claim, a table or a figure: none is left
over.
"""

import tomllib
from importlib import resources

FOLDER = resources.files("airmuscle.papers")


def test_the_code_names_every_claim_table_and_figure_of_the_texts():
    code = "".join(
        each.read_text(encoding="utf-8") for each in FOLDER.iterdir() if each.name.endswith(".py")
    )
    texts, claims = (
        tomllib.loads(FOLDER.joinpath(f"{n}.toml").read_text(encoding="utf-8"))
        for n in ("texts", "claims")
    )
    names = [
        *texts["figures"],
        *texts["tables"],
        *(name for rows in claims.values() for name in rows),
    ]
    assert len(names) > 90
    assert [name for name in names if f'"{name}"' not in code] == []
