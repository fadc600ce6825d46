"""Server of the studio: address, token and the loop of uvicorn."""

from __future__ import annotations

import importlib.util
import secrets
import socket
from collections.abc import Callable
from typing import Any

from ..core.errors import InputError
from .app import WORKERS, create_app
from .fit_routes import FitService
from .security import Access, is_loopback
from .worker import WorkerPool

PACKAGES = ("starlette", "uvicorn")
MAX_CONNECTIONS = 64
"""Maximum number of requests at a time (chosen)."""


def check_packages() -> None:
    """Raise InputError with the install command if a package of the server is missing."""
    missing = [name for name in PACKAGES if importlib.util.find_spec(name) is None]
    if missing:
        raise InputError(
            f"the studio needs {' and '.join(missing)}. Install them: pip install starlette uvicorn. A page "
            "without a server needs neither: airmuscle studio NAME --export page.html"
        )


def access_of(host: str) -> Access:
    """The rules of access: this machine without a token, other machines with one."""
    return Access() if is_loopback(host) else Access((), secrets.token_urlsafe(32))


def bound_socket(host: str, port: int) -> socket.socket:
    """A socket that listens at an address. Raises InputError if that is not possible."""
    if not 0 <= port <= 65535:
        raise InputError(f"--port is {port}; allowed range: 0 to 65535.")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, kind, protocol)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"{host[:80]}, port {port}: no server can be started there ({reason}). Choose another --port."
        ) from None
    return listening


def address_of(listening: socket.socket, host: str, access: Access) -> str:
    """The address of the page; with the token if there is one."""
    port = listening.getsockname()[1]
    name = f"[{host}]" if ":" in host and not host.startswith("[") else host
    return f"http://{name}:{port}/" + (f"?token={access.token}" if access.token else "")


def serve(host: str, port: int, opened: tuple[dict[str, Any], ...], started: Callable[[str], None]) -> None:
    """Serve the page until the process is interrupted; `started` receives its address.

    Raises InputError if a package is missing or the address cannot be used.
    """
    check_packages()
    import uvicorn

    access, listening, pool = access_of(host), bound_socket(host, port), WorkerPool(WORKERS)
    settings: dict[str, Any] = {
        "log_level": "warning", "access_log": False, "limit_concurrency": MAX_CONNECTIONS, "timeout_keep_alive": 5,
        "server_header": False, "lifespan": "off", "ws": "none",
    }  # fmt: skip
    fits = FitService(pool)
    server = uvicorn.Server(uvicorn.Config(create_app(access, pool, opened, fits), **settings))
    try:
        started(address_of(listening, host, access))
        server.run(sockets=[listening])
    finally:
        fits.stop()
        pool.stop()
        listening.close()
