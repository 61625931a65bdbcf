"""Where the page is served, and who may use it: who has its whole address, and no other web page.
All that is changed of viser, websockets and rich, which have no option for it, is here.

Any web page that is open in the same browser can ask this machine for a page or a websocket. The
browser then says in `Origin` which page asks and in `Host` which name it asked for, and does not
know the token.
"""

from __future__ import annotations

import dataclasses
import errno
import secrets
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from ipaddress import ip_address
from typing import Any
from urllib.parse import urlsplit

import rich
import viser.infra
from viser import _messages
from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

HOST, PORT = "127.0.0.1", 8080
TAKEN = (
    "port {port} of {host} is taken, perhaps by another viewer: without a port a free one is found"
)

TOKEN_BYTES = 16
HTTP = 80  # the port of a Host without one
LOCAL = frozenset({"localhost", "127.0.0.1", "::1"})
EVERYWHERE = ("0.0.0.0", "::")  # a server of all addresses of this machine
# The address has the token: no other site may learn it, and no disk may store it.
HEADERS = {"Referrer-Policy": "no-referrer", "Cache-Control": "no-store"}

Process = Callable[
    [ServerConnection, Request], Awaitable[Response | None] | Response | None
]  # of websockets: a response instead of a websocket, or None

_starting = threading.Lock()


def is_local(host: str) -> bool:
    """Whether only this machine reaches it."""
    return host == "localhost" or host.startswith("127.") or host == "::1"


def require_free(host: str, port: int | None) -> None:
    """Raises ValueError unless this machine can serve at this address and, if it is not None, at
    this port of it."""
    if port is not None and not 1 <= port <= 65535:
        raise ValueError(f"port is {port}, expected 1 to 65535")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server does
        try:
            probe.bind((host, port or 0))
        except socket.gaierror as error:
            raise ValueError(f"host is {host!r}, which is no address: {error.strerror}") from None
        except OSError as error:
            if port is None or error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise ValueError(f"host is {host!r}, expected an address of this machine") from None
            raise ValueError(TAKEN.format(port=port, host=host)) from None


class Guard:
    """Answers requests of strangers; a page or websocket is reached as /TOKEN/ alone."""

    def __init__(self, host: str) -> None:
        """With a new token, for a server at this address."""
        self.token = secrets.token_urlsafe(TOKEN_BYTES)
        self._everywhere = host in EVERYWHERE
        self._names = {host.lower()}
        if is_local(host) or self._everywhere:
            self._names |= LOCAL
        if self._everywhere:
            own = socket.gethostname().lower()
            self._names |= {own, f"{own}.local", socket.getfqdn().lower()}

    def refusal(self, request: Request, address: str, port: int) -> str | None:
        """Why a request that came in at this address and port of ours is refused, or None."""
        host = _only(request.headers, "Host")
        name = _name(host, port)
        if name is None or not self._is_ours(name, address):
            ours = " or ".join(sorted(_with_port(name, port) for name in self._names))
            return f"Host is {host!r}, expected {ours}"
        origin = _only(request.headers, "Origin")
        needed = "Upgrade" in request.headers  # browsers name the origin of each websocket
        if (origin is not None or needed) and origin != f"http://{host}":
            return f"Origin is {origin!r}, expected 'http://{host}'"
        if not secrets.compare_digest(_token(request.path), self.token.encode()):
            return "the token is missing or of another viewer, expected the address as printed"
        return None

    def _is_ours(self, name: str, address: str) -> bool:
        """An address, unlike a name, cannot be made to mean this machine by a stranger."""
        return name in self._names or name == address or (self._everywhere and _is_address(name))

    def before(self, inner: Process) -> Process:
        """Answers what it refuses; the rest is for `inner`, without the token."""

        def process(
            connection: ServerConnection, request: Request
        ) -> Awaitable[Response | None] | Response | None:
            address, port = connection.local_address[:2]
            why = self.refusal(request, address, port)
            if why is not None:
                return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
            path = request.path.partition(self.token)[2]
            answer = inner(connection, dataclasses.replace(request, path=path or "/"))
            if isinstance(answer, Response):
                answer.headers.update(HEADERS)
            return answer

        return process


def guarded_server(host: str, port: int | None, guard: Guard) -> viser.ViserServer:
    """A viser server that asks the guard first, and that no browser can ask for a public tunnel.

    Without a port it is at the first free one from PORT on. Raises ValueError if the port is taken
    or the host is not this machine's, and RuntimeError if this viser cannot be guarded.
    """
    require_free(host, port)
    with _serving_by(guard) as guarded:
        server = viser.ViserServer(host=host, port=port or PORT, verbose=False)
    if not guarded:
        server.stop()
        raise RuntimeError(
            f"viser {viser.__version__} serves in a way that energymargin cannot guard, and the "
            "page would be open to all: pip install 'viser==1.1.*'"
        )
    if port not in (None, server.get_port()):  # viser takes the next one
        server.stop()
        raise ValueError(TAKEN.format(port=port, host=host))
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    return server


@contextmanager
def silent() -> Iterator[None]:
    """Silences viser, which prints where it serves and when it stops and has no option for it."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


@contextmanager
def _serving_by(guard: Guard) -> Iterator[list[str]]:
    """Guards the viser server that starts in the `with` block, and lists the function that is.

    viser has no option for it, so the function that viser serves with is another meanwhile.
    """
    guarded: list[str] = []

    def serve(handler: Any, *arguments: Any, **options: Any) -> Any:
        if handler.__module__.startswith(viser.infra.__name__):
            options["process_request"] = guard.before(options["process_request"])
            guarded.append(handler.__qualname__)
        return original(handler, *arguments, **options)

    with _starting:
        original = websockets_server.serve
        setattr(websockets_server, "serve", serve)  # noqa: B010, mypy knows a class by this name
        try:
            yield guarded
        finally:
            setattr(websockets_server, "serve", original)  # noqa: B010


def _only(headers: Headers, name: str) -> str | None:
    values = headers.get_all(name)
    return values[0] if len(values) == 1 else ", ".join(values) or None


def _name(host: str | None, port: int) -> str | None:
    """Name or address in the header Host; None if there is none, or it is of another port."""
    try:
        parts = urlsplit(f"//{host}")
        return parts.hostname if (parts.port or HTTP) == port else None
    except ValueError:  # such as a port that is no number
        return None


def _with_port(name: str, port: int) -> str:
    return f"[{name}]:{port}" if ":" in name else f"{name}:{port}"


def _token(path: str) -> bytes:
    first = path.partition("?")[0].removeprefix("/").partition("/")[0]
    return first.encode(errors="surrogateescape")


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
