"""`airmuscle studio`: a page in the browser that shows muscles and plants."""

import webbrowser
from pathlib import Path
from typing import Annotated

from ..requests.declaration import option, optional, request
from ..studio import export_page, serve
from ..studio.page import open_sheets
from ..studio.server import warning_of
from .options import complete_law
from .parser import Argument
from .requested import with_requests
from .terminal import echo

OPENED = "Muscles or laws to open: library entries or muscle files (TOML)."
Names = Annotated[list[str] | None, Argument("NAME", OPENED, complete_law)]


@request
class StudioRequest:
    """How the page is served, or the file that is written instead."""

    port: int = option("Port of the server; 0 stands for any free one.", default=8765)
    host: str = option(
        "Address of the server; 0.0.0.0 admits other machines, without encryption.",
        default="127.0.0.1",
        metavar="ADDRESS",
    )
    browser: bool = option(
        "Open the page in the browser.", default=True, flag="--browser/--no-browser"
    )
    export: Path | None = optional(
        "Write one self-contained page instead, without a server.", metavar="FILE.html"
    )


@with_requests
def studio(request: StudioRequest, names: Names = None) -> None:
    """Show muscles and plants in the browser.

    \b
    The page computes laws and plants itself; the server reads files of the library, texts that are
    pasted into the page and measurement files that are dropped on it, and fits these. It answers
    this machine only, unless another --host is given, and requires the token of the printed
    address. Ctrl-C ends it.

    \b
    Examples:
      airmuscle studio
      airmuscle studio dmsp-20-300 my/muscle.toml
      airmuscle studio dmsp-20-300 tondu-lopez --export chart.html
    """
    if request.export is not None:
        echo(f"page: {export_page(names or [], request.export)}")
        return
    opened = open_sheets(names or [])

    def started(address: str) -> None:
        echo(f"studio: {address}  (Ctrl-C ends it)")
        if remark := warning_of(request.host):
            echo(f"note: {remark}", err=True)
        if request.browser:
            webbrowser.open(address)

    serve(request.host, request.port, opened, started)
