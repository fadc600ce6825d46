"""Grade of an entry: whose numbers they are, from the tables of its file."""

from collections.abc import Mapping
from typing import Any

MAKER = "maker's table"
SECONDARY = "secondary source"


def grade_of(tables: Mapping[str, Any]) -> str:
    """Who measured and who submitted an entry, a table of the maker, a secondary source; else what
    its law rests on, or the origin of its numbers.
    """
    evidence = str(tables.get("evidence", ""))
    provenance = str(tables.get("provenance", ""))
    words = [MAKER] if evidence == MAKER else []
    if SECONDARY in provenance:
        words.append(SECONDARY)
    for key, verb in (("measured_by", "measured by"), ("submitted_by", "submitted by")):
        if person := str(tables.get(key, "")):
            words.append(f"{verb} {person}")
    return "; ".join(words) or evidence or provenance
