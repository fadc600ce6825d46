"""`airmuscle studio`: a page in the browser that shows muscles and plants."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from ..studio import export_page, serve
from ..studio.page import open_sheets
from ..studio.server import warning_of
from .options import complete_law
from .terminal import echo


def studio(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="Muscles or laws to open: library entries or muscle files (TOML).",
            autocompletion=complete_law,
        ),
    ] = None,
    port: Annotated[int, typer.Option(metavar="N", help="Port of the server; 0 stands for any free one.")] = 8765,
    host: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS", help="Address of the server; 0.0.0.0 admits other machines, without encryption."
        ),
    ] = "127.0.0.1",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
    export: Annotated[
        Path | None,
        typer.Option("--export", metavar="FILE.html", help="Write one self-contained page instead, without a server."),
    ] = None,
) -> None:
    """Show muscles and plants in the browser.

    \b
    The page computes laws and plants itself; the server reads files of the library, texts that are pasted into the
    page and measurement files that are dropped on it, and fits these.
    It answers this machine only, unless another --host is given, and requires the token of the printed address.
    Ctrl-C ends it.

    \b
    Examples:
      airmuscle studio
      airmuscle studio dmsp-20-300 my/muscle.toml
      airmuscle studio dmsp-20-300 tondu-lopez --export chart.html
    """
    if export is not None:
        echo(f"page: {export_page(names or [], export)}")
        return
    opened = open_sheets(names or [])

    def started(address: str) -> None:
        echo(f"studio: {address}  (Ctrl-C ends it)")
        if remark := warning_of(host):
            echo(f"note: {remark}", err=True)
        if browser:
            webbrowser.open(address)

    serve(host, port, opened, started)
