"""Connections of the studio: limits of time from the first byte of a request to the last one of its answer.

A connection that sends nothing, or slowly, costs nobody else an answer: it is closed at its limit, and before that if
another one needs its place.
"""

from __future__ import annotations

from typing import Any

MAX_CONNECTIONS = 128
"""Maximum number of connections (chosen); a further one takes the place of the oldest without a request."""
HEAD_LIMIT = 10.0
"""Limit [s] from the start of a connection, or from the end of an answer, to the end of the next head (chosen)."""
BODY_LIMIT = 120.0
"""Limit [s] from the end of the head to the end of the body (chosen: 32 MB at 270 kB/s)."""
ANSWER_LIMIT = 300.0
"""Limit [s] from the end of the body to the end of the answer (chosen: more than each computation may take)."""


class _NoLimit:
    """A limit that has not begun."""

    def cancel(self) -> None:
        """Nothing is to be cancelled."""


def limited_protocol() -> Any:
    """The protocol class for uvicorn. Raises ImportError without uvicorn."""
    from uvicorn.protocols.http.h11_impl import H11Protocol

    class LimitedProtocol(H11Protocol):
        """HTTP/1.1 with limits of time."""

        def connection_made(self, transport: Any) -> None:
            self.phase: Any = None
            self.since = 0.0
            self.limit: Any = _NoLimit()
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
            self.limit.cancel()

        def follow(self) -> None:
            """Begin the limit of time of the phase in which the request is."""
            limit = limit_of(self.cycle)
            if (limit, self.cycle) == self.phase:
                return
            self.phase, self.since = (limit, self.cycle), self.loop.time()
            self.limit.cancel()
            self.limit = self.loop.call_later(limit, self.transport.abort)

    return LimitedProtocol


def limit_of(cycle: Any) -> float:
    """The limit of time [s] of what a connection waits for: the head, the body or the answer of a request."""
    if cycle is None or cycle.response_complete:
        return HEAD_LIMIT
    return BODY_LIMIT if cycle.more_body else ANSWER_LIMIT


def close_one_of(connections: Any) -> None:
    """If there are too many, close the one that has waited longest for the head of a request, or else the last one."""
    kept = [each for each in connections if not each.transport.is_closing()]
    if len(kept) <= MAX_CONNECTIONS:
        return
    waiting = [each for each in kept if limit_of(each.cycle) == HEAD_LIMIT]
    (min(waiting, key=lambda each: each.since) if waiting else max(kept, key=lambda each: each.since)).transport.abort()
