"""Server of the studio: it answers its own page only, within limits, and never with a traceback or
a file.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import json
import re
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urljoin, urlsplit

import pytest
from scenario_files import LIFT
from studio_pages import HOST, WEB, InThisProcess, request, run_script
from widths import widened

pytest.importorskip("starlette", reason="needs starlette")

from airmuscle import load
from airmuscle.errors import InputError, ParameterError
from airmuscle.files import to_toml
from airmuscle.files.library import Location
from airmuscle.outlets.studio import (
    MAX_PAGE,
    MAX_TEXT,
    Access,
    LimitError,
    WorkerPool,
    access_of,
    bound_socket,
    create_app,
    is_loopback,
    reachable_host,
    read_text_tables,
    self_contained_page,
    sheet_of_tables,
    warning_of,
)
from airmuscle.outlets.studio import app as studio_app
from airmuscle.outlets.studio import page as studio_page

MUSCLE = to_toml(load("tondu-lopez"))


@pytest.fixture(scope="module")
def app():
    return create_app(pool=InThisProcess())


def test_the_page_allows_scripts_of_this_server_only(app):
    answer = request(app, "GET", "/")
    policy = answer.headers["content-security-policy"]
    assert answer.status == 200
    assert "script-src 'self';" in policy
    assert "unsafe" not in policy
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert " style=" not in answer.text
    assert "<script>" not in answer.text


def test_every_file_that_the_page_names_is_sent(app):
    page = request(app, "GET", "/").text
    names = [
        part.split('"')[0]
        for part in page.replace('href="web/', 'src="web/').split('src="web/')[1:]
    ]
    assert len(names) > 15
    assert {request(app, "GET", f"/web/{name}").status for name in names} == {200}
    assert "MIT" in request(app, "GET", "/web/vendor/uPlot.LICENSE").text


def test_a_muscle_of_the_library_and_its_program_are_sent(app):
    sheet = request(app, "GET", "/api/law/dmsp-20-300").json()
    program = request(app, "GET", f"/program/{sheet['id']}.js")
    assert sheet["law"] == "MartensBoblan2017"
    assert program.headers["content-type"].startswith("text/javascript")
    assert program.text.startswith('"use strict";\nairmusclePrograms[')


def test_own_files_are_read(app):
    muscle = request(app, "POST", "/api/law", MUSCLE.encode())
    plant = request(app, "POST", "/api/plant", LIFT.encode())
    assert (muscle.status, plant.status) == (200, 200)
    assert muscle.json()["own_text"] == MUSCLE
    assert [row["name"] for row in plant.json()["inputs"]] == ["fill", "discharge"]


PATHS = (
    "/../../etc/passwd",
    "/web/../app.py",
    "/web/..%2f..%2fapp.py",
    "/web/scripts/../../app.py",
    "/web//etc/passwd",
    "/web/",
    "/web/.",
    "/web/scripts",
    "/web/index.html",
    "/web/\0",
    "/program/../../x.js",
    "/program/",
    "/api/law/..",
    "/api/law/../plants/lift",
    "/api/law/%2e%2e",
    "/api/law/matrix-821",
    "/api/law/lift",
    "/api/plant/dmsp-20-300",
    "/api/plant/../lift",
    "/api/law/<script>",
    "/api/law/" + "x" * 1500,
    "/api",
    "/docs",
    "/openapi.json",
    "/favicon.ico",
    "/.git/config",
    "//",
    "/api/law/a\r\nx: y",
    "/api/law/é",
    "/program/" + "0" * 32 + ".js",
)


@pytest.mark.parametrize("path", PATHS)
def test_other_addresses_do_not_exist(app, path):
    answer = request(app, "GET", path, raw=path.encode())
    assert answer.status == 404
    assert "Traceback" not in answer.text
    assert "root:" not in answer.text
    assert set(answer.json()) == {"error"}


@pytest.mark.parametrize(
    "host",
    [
        "",
        "evil.example",
        "evil.example:8765",
        "127.0.0.1.evil.example",
        "[::2]:8765",
        "0.0.0.0",
        "localhost.evil.example.",
        "a" * 500,
    ],
)
def test_another_host_name_is_refused(app, host):
    assert request(app, "GET", "/", headers={"host": host}).status == 421
    assert request(app, "GET", "/api/library", headers={"host": None}).status == 421


@pytest.mark.parametrize(
    "host", ["127.0.0.1", "localhost:80", "[::1]:8765", "[::1]", "LOCALHOST", "localhost.:80"]
)
def test_the_names_of_this_machine_are_accepted(app, host):
    assert request(app, "GET", "/", headers={"host": host}).status == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"x-airmuscle": None},
        {"x-airmuscle": "0"},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1:9999"},
        {"origin": f"https://{HOST}"},
        {"origin": "https://["},
        {"origin": ""},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
    ],
)
@pytest.mark.parametrize("path", ["/api/law", "/api/plant", "/api/page"])
def test_requests_of_other_pages_are_refused(app, path, headers):
    assert request(app, "POST", path, b"", headers=headers).status == 403


@pytest.mark.parametrize(
    "method", ["PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "post", "X" * 100]
)
def test_other_methods_are_refused(app, method):
    assert request(app, method, "/api/law").status == 405


def test_posts_of_the_own_page_are_accepted(app):
    headers = {"origin": f"http://{HOST}", "sec-fetch-site": "same-origin"}
    assert request(app, "POST", "/api/law", MUSCLE.encode(), headers=headers).status == 200


def test_a_path_of_any_length_is_refused_early(app):
    assert request(app, "GET", "/" + "x" * 5000).status == 414


@pytest.mark.parametrize("path", ["/api/law", "/api/plant"])
def test_a_large_text_is_refused_before_it_is_read(app, path):
    answer = request(app, "POST", path, b"x" * (20 * MAX_TEXT))
    assert answer.status == 413
    assert answer.json()["error"] == "the text is larger than 64 kB."
    assert answer.unread > 100


BAD_TEXTS = (
    b"",
    b"\xff\xfe\x00",
    b"\x00" * 100,
    b"[",
    b"a = ",
    b"[[[[",
    b"title = 1",
    b"x" * 60000,
    b"a = " + b"[" * 30000,
    b"a = " + b"{ a = " * 5000,
    b"<script>alert(1)</script>",
    b"title = '${7*7}{{7*7}}'",
    b"[characteristic]",
    b"title='x'\nprovenance='x'\n[characteristic]\nmodel='os.system'",
    b"title='x'\nprovenance='x'\n[characteristic]\nmodel='Braid'",
    b"title='x'\nprovenance='x'\n[characteristic]\nmodel='TonduLopez2000'\nend_correction=nan",
    b"title='x'\nprovenance='x'\n[characteristic]\nmodel='TonduLopez2000'\nend_correction=1e400",
    b"title='x'\nprovenance='x'\n[characteristic]\nmodel='Tabulated'\npressures={file='/etc/passwd',column='x'}",
    b"title='x'\nprovenance='x'\n[characteristic]\nmodel='Tabulated'\npressures=[]\ncontractions=[]\nforces=[]",
    b"title='x'\nprovenance='x'\nproduct='../../x'\n[characteristic]\nmodel='Serres2009'",
    b"title='x'\nprovenance='x'\n[characteristic]\nmodel='ContractileSurface'\ndegree=1000000",
    MUSCLE.encode().replace(b"radius = ", b"radius = -"),
    MUSCLE.encode().replace(b"0.", b"inf #"),
    MUSCLE.encode() + b"\n[unknown]\n",
    MUSCLE.encode() * 3,
    "title = 'ü'\r\n".encode("latin-1"),
    b"[plant]",
    b"[plant]\nmuscle='/etc/passwd'",
    b"[plant]\nmuscle='../x.toml'\n[run]\nduration='1 s'",
    b"[plant]\nmuscle='x.toml'",
    b"[plant]\nlibrary='/dev/zero'",
    b"[plant]\nlibrary='lift/../x'",
    b"[plant]\nmuscle=[]",
    b"[plant]\nmuscle=1\n[run]\nduration=1",
    b"plant = 1",
    b"[[plant]]",
    b"[plant.muscle]",
    LIFT.encode().replace(b"2 s", b"-2 s"),
    LIFT.encode().replace(b"2 s", b"1e9 s"),
    LIFT.encode().replace(b"2 s", b"nan s"),
    LIFT.encode().replace(b'fill = [["1 s", 1]]', b"file='x.csv'"),
    LIFT.encode().replace(b'fill = [["1 s", 1]]', b"[input.controller]\nmodel='PID'"),
    LIFT.encode().replace(b'fill = [["1 s", 1]]', b"fill=[[1,2]]"),
    LIFT.encode().replace(b"matrix-821", b"/absolute/valve.toml"),
    LIFT.encode().replace(b"matrix-821", b"1 x/../../valve"),
    LIFT.encode().replace(b"5 kg", b"0 kg"),
    LIFT.encode().replace(b"5 kg", b"5 m"),
    LIFT.encode().replace(b"HangingMass", b"__import__"),
)


@pytest.mark.parametrize(
    "text", BAD_TEXTS, ids=lambda text: text[:40].decode("latin-1").replace("\0", "0")
)
@pytest.mark.parametrize("path", ["/api/law", "/api/plant"])
def test_a_wrong_text_is_answered_with_its_reason(app, path, text):
    answer = request(app, "POST", path, text)
    assert answer.status in (400, 422)
    error = answer.json()["error"]
    assert 10 < len(error) < 3000
    assert not any(word in error for word in ("Traceback", "root:", 'File "', "/src/"))


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b"1",
        b'{"sheets": []}',
        b'{"sheets": [], "state": {}}',
        b'{"sheets": ["x"], "state": {}}',
        b'{"sheets": "x", "state": {}}',
        b'{"sheets": [1], "state": {}}',
        b'{"sheets": ["x"], "state": []}',
        b'{"sheets": ["../x"], "state": {}}',
        b'{"sheets": ["' + b'x","' * 13 + b'x"], "state": {}}',
        b"[" * 100000,
        b"\xff",
        b'{"sheets": {"a": 1}, "state": {}}',
    ],
    ids=range(16),
)
def test_a_wrong_request_for_a_page_is_refused(app, body):
    answer = request(app, "POST", "/api/page", body)
    assert answer.status in (400, 404)
    assert set(answer.json()) == {"error"}


def test_a_large_request_for_a_page_is_refused(app):
    assert request(app, "POST", "/api/page", b" " * (MAX_PAGE + 1)).status == 413


@pytest.mark.parametrize("text", ["</script><script>alert(1)</script>", "<!--", "&amp;\u2028"])
def test_texts_in_a_saved_page_remain_texts(app, text):
    sheet = request(app, "POST", "/api/law", MUSCLE.replace("Pneumatic", text).encode()).json()
    body = (
        f'{{"sheets": ["{sheet["id"]}"], "state": {{"tab": "</script><script>alert(2)</script>"}}}}'
    )
    page = request(app, "POST", "/api/page", body.encode()).text
    assert "<script>alert" not in page
    assert "unsafe" not in page


@pytest.mark.parametrize(
    "name",
    widened(
        [
            "</script><script>alert(1)</script>",
            "<!--<script>",
            "*/ alert(1) //",
            "`${alert(1)}`",
            '"; alert(1); "',
        ],
        lambda name: name.startswith(
            ("</", "<!--", '"')
        ),  # what ends an element, a script and a text
    ),
)
def test_names_in_the_program_of_a_saved_page_remain_names(name, tmp_path):
    """Each script of the page has its digest in the policy; the program runs in Node, and its
    states have the name.
    """
    tables = tomllib.loads(LIFT)
    plant = tables["plant"]
    plant |= {
        "muscle": [{"library": "dmsp-20-300", "name": name}, "dmsp-20-300"],
        "circuit": [plant["circuit"]] * 2,
    }
    plant["mechanism"] = {"model": "AntagonisticJoint", "radius": 0.04, "inertia": 0.05}
    tables["input"] = {"muscle.fill": [[1.0, 1.0]]}
    sheet = sheet_of_tables(tables, Location("own", "", tmp_path), name, {}, "")
    page = self_contained_page([sheet], {"name": name})
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    digests = [
        base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts
    ]
    policy = re.search(r"script-src ([^;]*);", page).group(1)
    assert policy.split() == [f"'sha256-{digest}'" for digest in digests]
    assert not any("<!--" in text for text in scripts)
    program = next(
        text for text in scripts if text.startswith('"use strict";\nairmusclePrograms["')
    )
    show = f"console.log(JSON.stringify(airmusclePrograms['{sheet['id']}'].states));"
    states = run_script(f"const airmusclePrograms = {{}};\n{program}\n{show}", 0, tmp_path)
    assert states[0] == f"{name}.air_mass"


ALLOWED = (
    'note = "a/b.toml"',
    'x = "2.6 m3/(s Pa)"',
    'x = "-1.5e-3 1/bar"',
    '[[reference]]\nwhere = "https://x/y"',
)
REFUSED = (
    'x = "/etc/passwd"',
    'x = "a.toml"',
    'x = ["../y"]',
    "x = { file = 1 }",
    'x = "2 a/../b"',
    'x = "1 /etc/passwd"',
    'x = "1 x/etc"',
    'x = "C:\\\\y"',
)


def test_a_text_may_contain_units_and_references_but_no_paths():
    assert [read_text_tables(text) != {} for text in ALLOWED] == [True] * len(ALLOWED)
    for text in REFUSED:
        with pytest.raises(ParameterError, match=r"must not refer to files"):
            read_text_tables(text)


def prefixed(app, *, is_stripped: bool):
    """The application below a path, as a proxy that strips the path serves it, or one that does
    not.
    """

    async def handle(scope, receive, send):
        path = scope["path"].removeprefix("/lab/studio") if is_stripped else scope["path"]
        root = "" if is_stripped else "/lab/studio"
        await app(
            {**scope, "path": path, "raw_path": path.encode(), "root_path": root}, receive, send
        )

    return handle


@pytest.mark.parametrize("is_stripped", [True, False])
def test_the_page_works_below_a_path(is_stripped):
    app = prefixed(create_app(Access(), pool=InThisProcess()), is_stripped=is_stripped)
    base = "http://127.0.0.1/lab/studio/"
    page = request(app, "GET", "/lab/studio/")
    linked = re.findall(r"(?:src|href)=\"([^\"#:]+)\"", page.text)
    assert linked
    for address in linked:  # as a browser resolves them
        target = urljoin(base, address)
        assert target.startswith(base)
        assert request(app, "GET", urlsplit(target).path).status == 200, address
    script = (WEB / "scripts" / "source.js").read_text("utf-8")
    assert not re.findall(r"[\"'`]/(?:api|web|program)", script)
    assert request(app, "GET", "/lab/studio/api/library").status == 200
    own = {"x-airmuscle": None}  # a request that costs computation needs its header here, too
    assert request(app, "GET", "/lab/studio/api/law/saga2007", headers=own).status == 403
    token = create_app(Access((), "t"), pool=InThisProcess())
    answer = request(
        prefixed(token, is_stripped=is_stripped), "GET", "/lab/studio/", query=b"token=t"
    )
    assert urljoin(base, answer.headers["location"]) == base


def test_other_machines_need_the_token():
    token = "secret-of-the-test"
    app = create_app(Access((), token), pool=InThisProcess())
    assert request(app, "GET", "/").status == 401
    assert request(app, "GET", "/api/library", query=b"token=wrong").status == 401
    assert request(app, "GET", "/", headers={"cookie": "airmuscle_token_8765=wrong"}).status == 401
    assert request(app, "GET", "/", query=b"token=" + b"&token=" * 50).status == 401
    first = request(app, "GET", "/", query=f"token={token}".encode())
    assert (first.status, first.headers["location"]) == (303, "./")
    cookie = first.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "samesite=lax" in cookie.lower()
    assert (
        request(
            app, "GET", "/", headers={"cookie": cookie.split(";")[0], "host": "any.example"}
        ).status
        == 200
    )


def test_a_loopback_address_is_recognised_and_has_a_token_as_well():
    """Another user of this machine reaches it too."""
    assert [
        is_loopback(h)
        for h in ("127.0.0.1", "127.8.8.8", "localhost", "::1", "[::1]", "LOCALHOST.")
    ] == [True] * 6
    assert [is_loopback(h) for h in ("0.0.0.0", "192.168.1.2", "::", "example.org", "")] == [
        False
    ] * 5
    assert min(len(access_of(host).token) for host in ("127.0.0.1", "0.0.0.0")) > 30


def test_a_muscle_that_the_command_names_is_opened_by_its_name(tmp_path):
    """Only a file has a text of its own."""
    (tmp_path / "own.toml").write_text(MUSCLE, encoding="utf-8")
    by_name, by_path = studio_page.open_sheets(["dmsp-20-300", str(tmp_path / "own.toml")])
    assert by_name.get("own_text", "") == ""
    muscles = studio_page.first_state([by_name, by_path])["muscle"]["muscles"]
    assert muscles[0] == {"name": "dmsp-20-300", "values": {}}
    assert set(muscles[1]) == {"text", "values"}
    opened = json.loads(
        request(create_app(pool=InThisProcess(), opened=(by_name,)), "GET", "/api/library").text
    )["opened"]
    assert [sheet["name"] for sheet in opened] == ["dmsp-20-300"]


def test_another_address_of_this_machine_answers_for_its_own_name():
    assert "127.0.0.2" in access_of("127.0.0.2").hosts
    assert access_of("0.0.0.0").hosts == ()


def test_the_printed_address_can_be_opened_and_an_unencrypted_connection_is_remarked():
    assert reachable_host("127.0.0.2") == "127.0.0.2"
    assert [reachable_host(host) in ("0.0.0.0", "::") for host in ("0.0.0.0", "::")] == [
        False,
        False,
    ]
    assert "not encrypted" in warning_of("0.0.0.0")
    assert warning_of("127.0.0.1") == ""


@pytest.mark.parametrize(
    "path", ["/api/law/dmsp-20-300", "/api/plant/lift", "/api/joint/joint-dmsp-20-matrix"]
)
@pytest.mark.parametrize("headers", [{"x-airmuscle": None}, {"sec-fetch-site": "cross-site"}])
def test_what_is_read_but_computed_must_come_from_the_page(app, path, headers):
    assert request(app, "GET", path, headers=headers).status == 403


def test_a_tab_that_is_closed_during_its_request_raises_nothing(app):
    sent = []

    async def receive():
        return {"type": "http.disconnect"}

    async def send(message):
        sent.append(message)

    headers = [(b"host", HOST.encode()), (b"x-airmuscle", b"1")]
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": "POST",
        "path": "/api/law",
        "headers": headers,
    }
    asyncio.run(
        app({**scope, "query_string": b"", "root_path": "", "scheme": "http"}, receive, send)
    )
    assert sent[0]["status"] == 400


def test_a_port_in_use_is_named():
    with bound_socket("127.0.0.1", 0) as used:
        used.listen()
        port = used.getsockname()[1]
        with pytest.raises(
            InputError,
            match=rf"port {port}: no server can be started there .* Choose another --port",
        ):
            bound_socket("127.0.0.1", port)
    with pytest.raises(InputError, match="allowed range: 0 to 65535"):
        bound_socket("127.0.0.1", 70000)


def test_a_task_is_ended_at_its_limit_and_the_next_one_runs():
    pool = WorkerPool(1)
    try:
        assert pool.call(sum, [1, 2], limit=60.0) == 3
        with pytest.raises(LimitError, match="takes more than"):
            pool.call(time.sleep, 60, limit=0.3)
        with pytest.raises(InputError, match="cannot be processed"):
            pool.call(int, "x", limit=60.0)
        assert pool.call(sum, [3, 4], limit=60.0) == 7
    finally:
        pool.stop()


@pytest.mark.slow
def test_ten_users_at_once_are_answered():
    pool = WorkerPool(2)
    app = create_app(pool=pool)
    try:
        texts = [MUSCLE + f"# user {i}\n" for i in range(10)]
        with ThreadPoolExecutor(10) as users:
            answers = list(
                users.map(lambda text: request(app, "POST", "/api/law", text.encode()), texts)
            )
    finally:
        pool.stop()
    assert [answer.status for answer in answers] == [200] * 10
    assert [answer.json()["own_text"] for answer in answers] == texts


@pytest.mark.slow
def test_a_plant_that_takes_too_long_is_refused_in_time(monkeypatch):
    """The next request is answered, by a new process."""
    pool = WorkerPool(1)
    app = create_app(pool=pool)
    tube = (
        'circuit = { model = "WithTubes", tube = { model = "DistributedTube", length = "2 m",'
        ' diameter = "4 mm", segment_count = 200 }, circuit = { model = "FillDischarge"'
    )
    text = LIFT.replace('circuit = { model = "FillDischarge"', tube).replace(
        '"matrix-821" } }', '"matrix-821" } } }'
    )
    try:
        assert request(app, "POST", "/api/law", MUSCLE.encode()).status == 200
        monkeypatch.setattr(studio_app, "TIME_LIMIT", 0.3)
        begin = time.monotonic()
        answer = request(app, "POST", "/api/plant", text.encode())
        assert time.monotonic() - begin < 10.0
        assert answer.status == 503, answer.text
        monkeypatch.setattr(studio_app, "TIME_LIMIT", 60.0)
        assert request(app, "POST", "/api/law", MUSCLE.encode()).status == 200
    finally:
        pool.stop()
