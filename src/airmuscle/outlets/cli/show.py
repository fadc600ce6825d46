"""`airmuscle show`: parameters, sources and checks of a library entry."""

from __future__ import annotations

from ...files.library.catalogue import load
from ..requests.entry import EntryRequest
from .delivery import print_result
from .options import Json, Name
from .request_options import with_requests
from .terminal import echo


@with_requests
def show(name: Name, variant: EntryRequest, json: Json = False) -> None:
    """Show parameters, sources and checks of a library entry.

    The table of parameters contains symbol, value, unit, meaning and bounds.

    \b
    Examples:
      airmuscle show dmsp-20-300
      airmuscle show matrix-821
      airmuscle show festo-dmsp-20
      airmuscle show my/muscle.toml --json
    """
    chapter = variant.load(name, load).chapter()
    print_result([chapter], {}, json)
    for reference in () if json else chapter.references:
        echo(f"- {reference}")
