"""`airmuscle site`: the page of the studio as a folder of static files."""

from pathlib import Path
from typing import Annotated

from ..studio import write_site
from .parser import Argument
from .terminal import echo

FOLDER = "Folder of the page; created if it does not exist."
FILES = "Own muscle files or scenarios (TOML), beside the whole library."
MEGABYTE = 1e6


def site(
    folder: Annotated[Path, Argument("DIR", FOLDER)],
    names: Annotated[list[str] | None, Argument("FILE", FILES)] = None,
) -> None:
    """Write a page with the whole library, without a server.

    \b
    The page is that of airmuscle studio without fits: every muscle and law, plants that run in the
    page, joints. Open DIR/index.html from disk, or put the folder on any web space: the page
    computes all itself and requests nothing from elsewhere. Its address keeps what is shown.

    \b
    Examples:
      airmuscle site page
      airmuscle site page my/muscle.toml scenario.toml
    """
    written = write_site(folder, names or [])
    for omission in written.omissions:
        echo(f"note: the page lacks {omission.name}. {omission.reason}", err=True)
    echo(f"page: {written.page} ({written.models} models, {written.size / MEGABYTE:.1f} MB)")
