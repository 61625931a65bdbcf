"""Who may use the viewer's page: not another site in the same browser, and nobody without its
address."""

import asyncio
import http.client
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
import viser
from viser import _messages
from websockets.asyncio.client import connect
from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.http11 import Request

import energymargin as em
from energymargin.look.viewer import guard as serving, view
from energymargin.look.viewer.browser import headless_page
from energymargin.look.viewer.guard import Guard, guarded_server

PORT = 8080


def in_a_thread(function):
    """What it returns: in this thread other tests may have left an event loop running."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(function).result()


@pytest.fixture(autouse=True, scope="module")
def ports_of_its_own():
    """Other tests look for ports at the same time."""
    before, serving.PORT = serving.PORT, 9500
    yield
    serving.PORT = before


@pytest.fixture(scope="module")
def viewer():
    scene = em.Scene()
    scene.add_plane("table")
    at = (0, 0, 0.05)
    scene.add_body("object", em.Box((0.1, 0.1, 0.1)), mass=1, position=at, role="object")
    captured = em.regions.Ball("object", center=at, radius=0.1)
    bounds = {"force": (9, 9, 0), "torque": (0, 0, 0), "duration": 0.2}
    with view(em.Problem(scene, scene.pack(), **bounds, captured=captured)) as viewer:
        yield viewer


def token_of(viewer):
    return viewer.url.rstrip("/").rpartition("/")[2]


def page(viewer, path, **headers):
    """Status, headers and text of the answer to a request for a page."""
    connection = http.client.HTTPConnection("127.0.0.1", viewer.port)
    connection.putrequest("GET", path, skip_host=True)
    for name, value in ({"Host": f"127.0.0.1:{viewer.port}"} | headers).items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    try:
        return answer.status, answer.headers, answer.read().decode()
    finally:
        connection.close()


def socket_answer(viewer, path, host=None, origin=None):
    """What a websocket gets: its first message, or the words of a refusal."""
    host = host or f"127.0.0.1:{viewer.port}"
    protocol = f"viser-v{viser.__version__}"

    async def first():
        opened = connect(
            f"ws://{host}{path}",
            host="127.0.0.1",
            port=viewer.port,
            origin=origin,
            subprotocols=[protocol],
            max_size=None,
            proxy=None,
        )
        async with opened as socket:
            return await asyncio.wait_for(socket.recv(), 60)

    try:
        return in_a_thread(lambda: asyncio.run(first()))
    except InvalidStatus as refused:
        assert refused.response.status_code == 403
        return refused.response.body.decode()


def test_the_printed_address_has_a_token_and_gives_the_page(viewer):
    status, headers, text = page(viewer, f"/{token_of(viewer)}/")
    assert status == 200 and "<title>Viser</title>" in text
    assert headers["Referrer-Policy"] == "no-referrer" and headers["Cache-Control"] == "no-store"
    assert len(token_of(viewer)) >= 22  # 128 bits
    assert viewer.url in viewer._repr_html_()


def test_each_viewer_has_a_token_of_its_own():
    assert Guard("127.0.0.1").token != Guard("127.0.0.1").token


@pytest.mark.parametrize(
    "path", ["/", "/index.html", "/{wrong}/", "/{token}x/", "/x/{token}/", "*"]
)
def test_a_page_without_the_token_is_refused(viewer, path):
    token = token_of(viewer)
    wrong = token[:-1] + ("A" if token[-1] != "A" else "B")
    status, _, text = page(viewer, path.format(token=token, wrong=wrong))
    assert status == 403 and text.startswith("the token is missing or of another viewer")
    assert token not in text


def test_a_file_is_found_behind_the_token_and_nothing_outside_of_the_page(viewer):
    token = token_of(viewer)
    assert page(viewer, f"/{token}/index.html")[0] == 200
    assert page(viewer, f"/{token}")[0] == 200
    assert page(viewer, f"/{token}/none.js")[0] == 404
    assert page(viewer, f"/{token}/../__init__.py")[0] == 404


def test_another_name_for_this_machine_is_refused_even_with_the_token(viewer):
    path, port = f"/{token_of(viewer)}/", viewer.port
    for host in (f"evil.example:{port}", "127.0.0.1:1", "127.0.0.1", f"[::1:{port}", ""):
        status, _, text = page(viewer, path, Host=host)
        assert status == 403 and text.startswith(f"Host is {host!r}, expected 127.0.0.1:")
    assert page(viewer, path, Host=f"localhost:{port}")[0] == 200


def test_another_site_cannot_read_the_page_even_with_the_token(viewer):
    path = f"/{token_of(viewer)}/"
    for origin in ("https://evil.example", "null", f"http://localhost:{viewer.port}"):
        status, _, text = page(viewer, path, Origin=origin)
        assert status == 403 and text.startswith(f"Origin is {origin!r}, expected 'http://127.0")


def test_a_websocket_opens_for_the_page_itself_alone(viewer):
    path, own = f"/{token_of(viewer)}", f"http://127.0.0.1:{viewer.port}"
    assert isinstance(socket_answer(viewer, path, origin=own), bytes)
    for origin in (None, "null", "https://evil.example", "http://127.0.0.1:1", own + "/"):
        assert f"Origin is {origin!r}, expected '{own}'" in socket_answer(
            viewer, path, origin=origin
        )
    assert "the token is missing" in socket_answer(viewer, "", origin=own)
    assert "the token is missing" in socket_answer(viewer, "/" + "x" * 22, origin=own)
    rebound = f"evil.example:{viewer.port}"
    assert f"Host is '{rebound}'" in socket_answer(viewer, path, rebound, f"http://{rebound}")


def test_no_browser_can_ask_for_a_public_tunnel(viewer):
    handled = viewer._server._websock_server._incoming_handlers
    assert _messages.GuiUpdateMessage in handled
    assert not {_messages.ShareUrlRequest, _messages.ShareUrlDisconnect} & set(handled)


def request_of(host, token, origin=None):
    headers = Headers({"Host": host})
    if origin is not None:
        headers["Origin"] = origin
    return Request(f"/{token}/", headers)


@pytest.mark.parametrize(
    ("host", "allowed", "refused"),
    [
        ("127.0.0.1", ("localhost", "127.0.0.1", "[::1]"), ("192.168.1.5", "lab", "0.0.0.0")),
        ("::1", ("localhost", "[::1]"), ("192.168.1.5", "[::2]")),
        ("192.168.1.5", ("192.168.1.5",), ("localhost", "127.0.0.1", "192.168.1.6", "lab")),
        ("lab", ("lab", "LAB", "192.168.1.5"), ("localhost", "lab.example")),
        ("0.0.0.0", ("localhost", "192.168.1.5", "10.0.0.9", "[fe80::1]"), ("evil.example",)),
    ],
)
def test_the_names_are_those_of_the_host_that_is_given(host, allowed, refused):
    guard = Guard(host)
    address = {"0.0.0.0": "192.168.1.5", "lab": "192.168.1.5"}.get(host, host)

    def why(name, port=PORT):
        return guard.refusal(request_of(f"{name}:{port}", guard.token), address, PORT)

    assert [why(name) for name in allowed] == [None] * len(allowed)
    assert all((why(name) or "").startswith("Host is ") for name in refused)
    assert all(why(name, PORT + 1) for name in allowed)


def test_the_port_of_a_bare_name_is_80():
    guard = Guard("127.0.0.1")
    request = request_of("localhost", guard.token, "http://localhost")
    assert guard.refusal(request, "127.0.0.1", 80) is None
    assert guard.refusal(request, "127.0.0.1", PORT) is not None


def test_several_hosts_in_a_request_are_none():
    guard = Guard("127.0.0.1")
    request = request_of(f"localhost:{PORT}", guard.token)
    request.headers["Host"] = f"localhost:{PORT}"
    assert "Host is" in guard.refusal(request, "127.0.0.1", PORT)


def test_servers_that_start_at_once_have_guards_of_their_own():
    guards = [Guard("127.0.0.1") for _ in range(4)]
    servers = {}

    def start(n):
        servers[n] = guarded_server("127.0.0.1", None, guards[n])

    threads = [threading.Thread(target=start, args=[n]) for n in range(len(guards))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    try:
        for n, server in servers.items():
            server.port = server.get_port()
            answers = [page(server, f"/{guard.token}/")[0] for guard in guards]
            assert answers == [200 if k == n else 403 for k in range(len(guards))]
    finally:
        for server in servers.values():
            server.stop()


def test_a_hostile_page_in_the_same_browser_gets_no_websocket(viewer, tmp_path):
    hostile = tmp_path / "hostile.html"
    hostile.write_text("<title>hostile</title>")
    script = """([url, protocol]) => new Promise(done => {
        const socket = new WebSocket(url, [protocol])
        socket.onopen = () => done("open")
        socket.onerror = () => done("refused")
    })"""
    protocol = f"viser-v{viser.__version__}"

    def ask():
        with headless_page() as browser_page:
            browser_page.goto(hostile.as_uri())
            urls = [f"ws://127.0.0.1:{viewer.port}{p}" for p in ("", f"/{token_of(viewer)}")]
            from_elsewhere = [browser_page.evaluate(script, [url, protocol]) for url in urls]
            browser_page.goto(viewer.url, wait_until="commit")
            return from_elsewhere, browser_page.evaluate(script, [urls[-1], protocol])

    assert in_a_thread(ask) == (["refused", "refused"], "open")
