"""Server of the studio: address, token, the loop of uvicorn, and the limits of its connections.

A connection that sends nothing, or slowly, costs nobody else an answer: it is closed at its limit,
and before that if another one needs its place.
"""

import contextlib
import importlib.util
import ipaddress
import secrets
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

from ...core import InputError
from .app import LONG_WORKERS, WORKERS, create_app
from .fit_routes import FitService
from .security import LOOPBACK, Access, is_loopback
from .tasks import warm_up
from .worker import SPARE, WorkerPool

MAX_CONNECTIONS = 128
"""Maximum number of connections (chosen); a further one takes the place of the oldest without a
request.
"""
HEAD_LIMIT = 10.0
"""Limit [s] from the start of a connection, or from the end of an answer, to the end of the next
head (chosen).
"""
BODY_LIMIT = 120.0
"""Limit [s] from the end of the head to the end of the body (chosen: 32 MB at 270 kB/s)."""
ANSWER_LIMIT = 300.0
"""Limit [s] from the end of the body to the end of the answer (chosen: more than each computation
may take).
"""
PACKAGES = ("starlette", "uvicorn")
_OUTSIDE = "192.0.2.1"
"""An address of another network, RFC 5737: its route names the address of this machine; nothing is
sent to it.
"""


def limited_protocol() -> Any:
    """The protocol class for uvicorn. Raises ImportError without uvicorn."""
    from uvicorn.protocols.http.h11_impl import H11Protocol

    class LimitedProtocol(H11Protocol):
        """HTTP/1.1 with limits of time."""

        def connection_made(self, transport: Any) -> None:
            self.phase: Any = None
            self.since = 0.0
            self.limit: Any = None
            super().connection_made(transport)
            self.follow()
            close_one_of(self.connections)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            self.follow()

        def on_response_complete(self) -> None:
            super().on_response_complete()
            self.follow()

        def connection_lost(self, exc: Exception | None) -> None:
            super().connection_lost(exc)
            if self.limit is not None:
                self.limit.cancel()

        def follow(self) -> None:
            """Begin the limit of time of the phase in which the request is."""
            limit = limit_of(self.cycle)
            if (limit, self.cycle) == self.phase:
                return
            self.phase, self.since = (limit, self.cycle), self.loop.time()
            if self.limit is not None:
                self.limit.cancel()
            self.limit = self.loop.call_later(limit, self.transport.abort)

    return LimitedProtocol


def limit_of(cycle: Any) -> float:
    """The limit of time [s] of what a connection waits for: the head, the body or the answer of a
    request.
    """
    if cycle is None or cycle.response_complete:
        return HEAD_LIMIT
    return BODY_LIMIT if cycle.more_body else ANSWER_LIMIT


def close_one_of(connections: Any) -> None:
    """If there are too many, close the one that has waited longest for the head of a request, or
    else the last one.
    """
    opened = [connection for connection in connections if not connection.transport.is_closing()]
    if len(opened) <= MAX_CONNECTIONS:
        return
    waiting = [connection for connection in opened if limit_of(connection.cycle) == HEAD_LIMIT]
    (
        min(waiting, key=lambda connection: connection.since)
        if waiting
        else max(opened, key=lambda connection: connection.since)
    ).transport.abort()


def access_of(host: str) -> Access:
    """The rules of access: a token for all, and the names of this machine alone if the server is
    reached only there. Other users of this machine reach a loopback address as well, so it has a
    token too."""
    return Access(
        (*LOOPBACK, _bracketed(host).lower()) if is_loopback(host) else (),
        secrets.token_urlsafe(32),
    )


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host and not host.startswith("[") else host


def warning_of(host: str) -> str:
    """The remark that belongs to an address that other machines reach; empty for this machine
    alone.
    """
    return (
        ""
        if is_loopback(host)
        else "the connection is not encrypted; use it only in a network that you trust."
    )


def bound_socket(host: str, port: int) -> socket.socket:
    """A socket that listens at an address. Raises InputError if that is not possible."""
    if not 0 <= port <= 65535:
        raise InputError(f"--port is {port}; allowed range: 0 to 65535.")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM
        )[0]
        listening = socket.socket(family, kind, protocol)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"{host[:80]}, port {port}: no server can be started there ({reason}). Choose another"
            " --port."
        ) from None
    return listening


def address_of(listening: socket.socket, host: str, access: Access) -> str:
    """The address of the page; with the token if there is one."""
    token = f"?token={access.token}" if access.token else ""
    return f"http://{_bracketed(reachable_host(host))}:{listening.getsockname()[1]}/{token}"


def reachable_host(host: str) -> str:
    """The host; for the unspecified address, on which no page is opened, the address of this
    machine in its network.
    """
    try:
        address = ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        return host
    if not address.is_unspecified:
        return host
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as route:
        try:
            route.connect((_OUTSIDE, 9))
            return str(route.getsockname()[0])
        except OSError:  # a machine without a network
            return "127.0.0.1"


@contextlib.contextmanager
def ending_signals(end: Callable[[], None]) -> Iterator[None]:
    """Within the block SIGTERM and SIGHUP, the end of a session, call `end`; the process is not
    ended at once.
    """
    is_main = threading.current_thread() is threading.main_thread()
    signals = [
        getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if is_main and hasattr(signal, name)
    ]
    before = {number: signal.signal(number, lambda number, frame: end()) for number in signals}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def serve(
    host: str, port: int, opened: tuple[dict[str, Any], ...], started: Callable[[str], None]
) -> None:
    """Serve the page until the process is interrupted; `started` receives its address.

    Raises InputError if a package is missing or the address cannot be used.
    """
    if missing := [name for name in PACKAGES if importlib.util.find_spec(name) is None]:
        raise InputError(
            f"the studio needs {' and '.join(missing)}. Install them: pip install starlette"
            " uvicorn. A page without a server needs neither: airmuscle studio NAME --export"
            " page.html"
        )
    import uvicorn

    access = access_of(host)
    listening = bound_socket(host, port)
    pool = WorkerPool(WORKERS, warm_up)
    long_pool = WorkerPool(LONG_WORKERS, warm_up)
    settings: dict[str, Any] = {
        "log_level": "warning",
        "access_log": False,
        "http": limited_protocol(),
        "timeout_keep_alive": 5,
        "server_header": False,
        "lifespan": "off",
        "ws": "none",
    }
    fits = FitService(long_pool)
    server = uvicorn.Server(
        uvicorn.Config(create_app(access, pool, opened, fits, long_pool), **settings)
    )

    def end() -> None:
        server.should_exit = server.force_exit = True

    with ending_signals(end):
        try:
            pool.prepare(1 + SPARE)
            # a browser that is faster than the server waits instead of being refused
            listening.listen()
            started(address_of(listening, host, access))
            server.run(sockets=[listening])
        finally:
            fits.stop()
            pool.stop()
            long_pool.stop()
            listening.close()
