"""Process of the studio: it ends with its files removed, and neither silent connections nor long
tasks block others.
"""

from __future__ import annotations

import asyncio
import http.client
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager, suppress
from types import SimpleNamespace
from urllib.parse import urlsplit

import pytest

pytest.importorskip("starlette", reason="needs starlette")
pytest.importorskip("uvicorn", reason="needs uvicorn")

from airmuscle.outlets.studio import server as studio_server
from airmuscle.outlets.studio import worker


@contextmanager
def running(folder):
    """A server whose uploads are in a folder, with a function that sends a request to it."""
    environment = {**os.environ, "TMPDIR": str(folder)}
    command = [sys.executable, "-u", "-m", "airmuscle", "studio", "--no-browser", "--port", "0"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as server:
        try:
            address = urlsplit(server.stdout.readline().split()[1])

            def send(method, path, body=None, query=""):
                connection = http.client.HTTPConnection(address.hostname, address.port, timeout=60)
                connection.request(
                    method, f"{path}?{address.query}{query}", body, {"X-Airmuscle": "1"}
                )
                answer = connection.getresponse()
                connection.close()
                return answer.status

            yield server, address, send
        finally:
            server.kill()


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals of POSIX")
@pytest.mark.parametrize(
    "number", [signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.slow)], ids=str
)
def test_a_server_that_is_ended_removes_its_uploads(tmp_path, number):
    with running(tmp_path) as (server, _, send):
        assert send("POST", "/api/fit/file", b"p [bar]\n1\n", "&name=a.csv&set=") == 200
        assert len(list(tmp_path.rglob("a.csv"))) == 1
        server.send_signal(number)
        server.wait(30)
        assert "Traceback" not in server.stderr.read()
    assert list(tmp_path.rglob("a.csv")) == []


def test_silent_connections_block_nobody(tmp_path):
    with running(tmp_path) as (_, address, send), ExitStack() as silent:
        for _ in range(studio_server.MAX_CONNECTIONS + 10):
            silent.enter_context(socket.create_connection((address.hostname, address.port)))
        assert send("GET", "/api/library") == 200


def made_connection(cycle, since):
    aborted = SimpleNamespace(is_closing=lambda: False)
    aborted.abort = lambda: setattr(aborted, "is_closing", lambda: True)
    return SimpleNamespace(cycle=cycle, since=since, transport=aborted)


def test_each_phase_of_a_request_has_its_limit(monkeypatch):
    body, answer = (
        SimpleNamespace(response_complete=False, more_body=more) for more in (True, False)
    )
    done = SimpleNamespace(response_complete=True, more_body=True)
    assert [studio_server.limit_of(cycle) for cycle in (None, body, answer, done)] == [
        studio_server.HEAD_LIMIT,
        studio_server.BODY_LIMIT,
        studio_server.ANSWER_LIMIT,
        studio_server.HEAD_LIMIT,
    ]
    monkeypatch.setattr(studio_server, "MAX_CONNECTIONS", 2)
    kept = [made_connection(cycle, since) for since, cycle in enumerate((body, None, None))]
    studio_server.close_one_of(kept)
    assert [each.transport.is_closing() for each in kept] == [False, True, False]


def test_a_silent_connection_is_closed_at_its_limit(monkeypatch):
    import uvicorn

    monkeypatch.setattr(studio_server, "HEAD_LIMIT", 0.2)

    async def closed_after():
        server = uvicorn.Server(
            uvicorn.Config(
                lambda *_: None,
                port=0,
                http=studio_server.limited_protocol(),
                lifespan="off",
                ws="none",
            )
        )
        task = asyncio.create_task(server.serve())
        while not server.started:
            await asyncio.sleep(0.01)
        reader, writer = await asyncio.open_connection(*server.servers[0].sockets[0].getsockname())
        begin = time.monotonic()
        writer.write(b"GET / HT")
        with suppress(ConnectionResetError):
            await asyncio.wait_for(reader.read(), 10.0)
        duration = time.monotonic() - begin
        writer.close()
        server.should_exit = True
        await task
        return duration

    assert asyncio.run(closed_after()) < 5.0


def occupy(pool):
    """A task that lasts until the pool ends."""
    with suppress(worker.LimitError):
        pool.call(time.sleep, 60, limit=60.0)


def test_a_short_task_is_answered_while_two_long_ones_run_that_began_together():
    pool = worker.WorkerPool(5, os.getpid)
    try:
        pool.prepare(1 + worker.SPARE)
        deadline = time.monotonic() + 60.0
        while pool._free.qsize() < 1 + worker.SPARE:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        for _ in range(2):
            threading.Thread(target=occupy, args=(pool,), daemon=True).start()
        time.sleep(0.1)
        begin = time.monotonic()
        assert pool.call(sum, [3, 4], limit=60.0) == 7
        assert time.monotonic() - begin < 1.0
    finally:
        pool.stop()


def test_a_worker_may_be_ended_at_any_instant_of_its_start():
    for delay in (0.0, 0.005, 0.05):
        process, cancelled = worker.LimitedWorker(), threading.Event()

        def report(fraction, text, process=process, cancelled=cancelled):
            if cancelled.is_set():
                process.kill()

        ended = []

        def run(process=process, report=report, ended=ended):
            try:
                process.call(time.sleep, (60.0,), 60.0, report)
            except worker.LimitError as error:
                ended.append(error)

        thread = threading.Thread(target=run)
        thread.start()
        time.sleep(delay)
        cancelled.set()
        process.kill()
        thread.join(30.0)
        assert not thread.is_alive()
        process.stop()
