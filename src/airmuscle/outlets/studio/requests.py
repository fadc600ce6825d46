"""Requests and answers: bodies within limits, and answers in JSON."""

from __future__ import annotations

from typing import Any

from ...core.errors import AirmuscleError


class BadRequest(AirmuscleError):
    """A request that the server does not understand, with its status."""

    def __init__(self, message: str, status: int = 400) -> None:
        super().__init__(message)
        self.status = status


async def limited_body(request: Any, limit: int) -> bytes:
    """The body of a request. Raises BadRequest as soon as it exceeds the limit [bytes]."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > limit:
            raise BadRequest(f"the text is larger than {limit // 1024} kB.", 413)
        parts.append(part)
    return b"".join(parts)


def decoded(body: bytes) -> str:
    """A body as text. Raises BadRequest unless it is UTF-8."""
    try:
        return body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadRequest(f"the text is not UTF-8 (byte {error.start}).") from None


def json_answer(content: Any, status: int = 200) -> Any:
    """An answer in JSON."""
    from starlette.responses import JSONResponse

    return JSONResponse(content, status_code=status)
