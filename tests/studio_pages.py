"""Requests to the application of the studio without a network, and its scripts in Node."""

from __future__ import annotations

import asyncio
import json
import subprocess
from pathlib import Path

import printed

import airmuscle.outlets.studio

WEB = Path(airmuscle.outlets.studio.__file__).with_name("web")
HOST = "127.0.0.1:8765"
BEGINNING = ("numbers", "roots", "beyond-range", "law")
"""Scripts of a law that need no browser."""


class Answer:
    """Status, headers and body of a response."""

    def __init__(self, messages):
        self.status = messages[0]["status"]
        self.headers = {
            name.decode().lower(): value.decode() for name, value in messages[0]["headers"]
        }
        self.body = b"".join(m.get("body", b"") for m in messages[1:])

    @property
    def text(self):
        return self.body.decode()

    def json(self):
        return json.loads(self.body)


def request(app, method, path, body=b"", *, headers=None, query=b"", chunk=8192, raw=None):
    """The answer of an ASGI application. `headers` replace the usual ones; those that are None are
    left out.
    """
    usual = {
        "host": HOST,
        "x-airmuscle": "1" if method == "POST" or path.startswith("/api/") else None,
    }
    given = {**usual, **(headers or {})}
    scope = {
        "type": "http",
        "asgi": {"version": "3.0", "spec_version": "2.4"},
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": path,
        "raw_path": raw or path.encode(),
        "query_string": query,
        "root_path": "",
        "server": ("127.0.0.1", 8765),
        "client": ("127.0.0.1", 1),
        "headers": [(n.encode(), v.encode("latin-1")) for n, v in given.items() if v is not None],
    }
    parts = [body[i : i + chunk] for i in range(0, len(body), chunk)] or [b""]
    queue = [
        {"type": "http.request", "body": part, "more_body": i < len(parts) - 1}
        for i, part in enumerate(parts)
    ]
    sent = []

    async def receive():
        return queue.pop(0) if queue else {"type": "http.disconnect"}

    async def send(message):
        sent.append(message)

    asyncio.run(app(scope, receive, send))
    answer = Answer(sent)
    answer.unread = len(queue)
    return answer


class InThisProcess:
    """A pool that runs tasks here, for tests that are not about processes."""

    def call(self, task, *arguments, limit):
        return task(*arguments)


def scripts(*names):
    return "\n".join((WEB / "scripts" / f"{name}.js").read_text(encoding="utf-8") for name in names)


def run_script(text, data, folder):
    """The JSON that a script prints in Node, with `data` as the constant DATA."""
    file = folder / "page.js"
    file.write_text(f"{text.replace('DATA', json.dumps(data))}", encoding="utf-8")
    done = subprocess.run([printed.require("node"), str(file)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]
    return json.loads(done.stdout)
