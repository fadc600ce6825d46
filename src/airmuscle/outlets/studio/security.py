"""Security of the studio: response headers, allowed hosts and origins, token, limits and sizes of
requests, answers.

The page has access to the programs that it computes and to nothing else: scripts and styles come
from this server only, none are written in the page itself, and nothing is sent elsewhere. A request
that changes something, or that costs computation, needs the header X-Airmuscle, which a page of
another origin cannot send, and an Origin of this server. The token of the printed address is
required of everyone, because the other users of this machine reach a loopback address as well. The
Host of every request is compared, so that another name that leads to this machine is of no use.
"""

import contextlib
import dataclasses
import ipaddress
import json
import secrets
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ...core import AirmuscleError

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:;"
    " connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cache-control", b"no-store"),
)
COOKIE = "airmuscle_token"
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
"""Names of this machine in the header Host."""
READING = ("GET", "HEAD")
COMPUTING = ("/api/law", "/api/plant", "/api/joint")
"""Beginnings of the paths that are read, but cost computation."""
MAX_TARGET = 2048
"""Maximum length of the path of a request (chosen)."""


def is_loopback(host: str) -> bool:
    """Whether a host name or address is this machine itself."""
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    return host.lower().removesuffix(".") == "localhost"


@dataclasses.dataclass(frozen=True)
class Access:
    """Who may send requests: the names of the server, and the token that is required.

    hosts   allowed values of the header Host without a port; any if empty
    token   text that a request must know; none is required if empty
    """

    hosts: tuple[str, ...] = LOOPBACK
    token: str = ""

    def refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Status and reason if a request is not allowed."""
        headers = {
            n.decode("latin-1").lower(): value.decode("latin-1") for n, value in scope["headers"]
        }
        if self.hosts and _name_of_host(headers) not in self.hosts:
            return 421, "This server does not answer for this host."
        if len(scope.get("raw_path") or scope["path"]) > MAX_TARGET:
            return 414, "The path is too long."
        tokens = [cookie_value(headers.get("cookie", ""), cookie_name(scope)), *given_token(scope)]
        if self.token and not any(
            secrets.compare_digest(candidate.encode(), self.token.encode()) for candidate in tokens
        ):
            return 401, "A token is required; open the address that the command printed."
        path = scope["path"].removeprefix(scope.get("root_path", ""))  # of a proxy
        if scope["method"] in READING and not path.startswith(COMPUTING):
            return None
        if scope["method"] not in (*READING, "POST"):
            return 405, "This method is not allowed."
        if (
            headers.get("x-airmuscle") != "1"
            or headers.get("sec-fetch-site", "same-origin") != "same-origin"
        ):
            return 403, "This request does not come from the page of this server."
        if not _is_of_this_origin(headers, scope):
            return 403, "This request comes from another origin."
        return None

    def cookie(self, scope: Scope) -> dict[str, Any] | None:
        """The cookie that keeps a token which the address of a request contains; None without
        one.
        """
        if not (self.token and given_token(scope)):
            return None
        # "lax": a link to the page in a text opens it; requests that cost computation need their
        # header as well
        return {"key": cookie_name(scope), "value": self.token, "httponly": True, "samesite": "lax"}


def given_token(scope: Scope) -> list[str]:
    """The token in the query of a request."""
    with contextlib.suppress(ValueError):
        return parse_qs(scope.get("query_string", b"").decode("latin-1"), max_num_fields=5).get(
            "token", []
        )
    return []


def cookie_name(scope: Scope) -> str:
    """The name of the cookie: browsers keep one for all ports of a host, and each server has its
    own token.
    """
    return f"{COOKIE}_{(scope.get('server') or ('', 0))[1]}"


def cookie_value(text: str, name: str) -> str:
    """The token in a header Cookie; empty if there is none."""
    cookie: SimpleCookie = SimpleCookie()
    with contextlib.suppress(CookieError):
        cookie.load(text)
        return cookie[name].value if name in cookie else ""
    return ""


def _name_of_host(headers: Mapping[str, str]) -> str:
    """The header Host without its port, in lower case."""
    host = headers.get("host", "")
    name, _, port = host.rpartition(":")
    bare: str = name if name and port.isdecimal() else host
    return bare.lower().removesuffix(".")


def _is_of_this_origin(headers: Mapping[str, str], scope: Scope) -> bool:
    """Whether the header Origin, if there is one, is the address of the server."""
    if "origin" not in headers:
        return True
    try:
        origin = urlsplit(headers["origin"])
    except ValueError:  # an origin that is no address
        return False
    return (origin.scheme, origin.netloc) == (scope.get("scheme", "http"), headers.get("host", ""))


def secured(application: Application, access: Access) -> Application:
    """The application behind these rules, with the headers of security in every response."""

    async def handle(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await application(scope, receive, send)
        if scope["type"] != "http":
            return

        async def send_with_headers(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                retained = [
                    row for row in message.get("headers", []) if row[0].lower() not in dict(HEADERS)
                ]
                message = {**message, "headers": [*retained, *HEADERS]}
            await send(message)

        refusal = access.refusal(scope)
        if refusal is None:
            await application(scope, receive, send_with_headers)
            return
        status, text = refusal
        headers = [(b"content-type", b"text/plain; charset=utf-8")]
        await send_with_headers(
            {"type": "http.response.start", "status": status, "headers": headers}
        )
        await send({"type": "http.response.body", "body": text.encode()})

    return handle


class BadRequest(AirmuscleError):
    """A request that the server does not understand, with its status."""

    def __init__(self, message: str, status: int = 400) -> None:
        super().__init__(message)
        self.status = status


async def limited_text(request: Any, limit: int) -> str:
    """The body of a request. Raises BadRequest as soon as it exceeds the limit [bytes], and unless
    it is UTF-8.
    """
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > limit:
            raise BadRequest(f"the text is larger than {limit // 1024} kB.", 413)
    try:
        return body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadRequest(f"the text is not UTF-8 (byte {error.start}).") from None


async def limited_table(request: Any, limit: int) -> dict[str, Any]:
    """The table in the body of a request. Raises BadRequest."""
    return table_of(await limited_text(request, limit))


def table_of(text: str, error: type[AirmuscleError] = BadRequest) -> dict[str, Any]:
    """The table in the text of a request. Raises an error of this class for another content."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise error("the request is not JSON.") from None
    if not isinstance(content, dict):
        raise error("the request must be a table of fields.")
    return content


def json_answer(content: Any, status: int = 200) -> Any:
    """An answer in JSON."""
    from starlette.responses import JSONResponse

    return JSONResponse(content, status_code=status)
