"""Where the page is served: an address that is free."""

from __future__ import annotations

import errno
import socket

__all__ = ["HOST", "PORT", "is_local", "port_at", "served_at"]

HOST, PORT = "127.0.0.1", 8080
TRIED = 100  # ports from PORT on


def port_at(host: str, port: int | None) -> int:
    """A port that is free there: the one that is asked for or, if none is, the first from 8080 on.

    Raises ValueError if the one that is asked for is taken or out of range, or the host is not this
    machine's.
    """
    if port is None:
        free = next((one for one in range(PORT, PORT + TRIED) if _is_free(host, one)), None)
        if free is None:
            raise ValueError(
                f"the ports {PORT} to {PORT + TRIED - 1} are taken: give another --port"
            )
        return free
    if not 1 <= port <= 65535:
        raise ValueError(f"port is {port}, expected 1 to 65535")
    if not _is_free(host, port):
        raise ValueError(
            f"port {port} of {host} is taken, perhaps by another viewer: without a port a free one "
            "is found"
        )
    return port


def served_at(port: int, chosen: int, asked: int | None) -> int:
    """The port that it is served at: another than the chosen one if that was taken meanwhile, which
    is a ValueError if it was asked for."""
    if port != chosen and asked is not None:
        raise ValueError(f"port {asked} was taken just now: without a port a free one is found")
    return port


def is_local(host: str) -> bool:
    """Whether only this machine reaches it."""
    return host == "localhost" or host.startswith("127.") or host == "::1"


def _is_free(host: str, port: int) -> bool:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server does
        try:
            probe.bind((host, port))
        except socket.gaierror as error:
            raise ValueError(f"host is {host!r}, which is no address: {error.strerror}") from None
        except OSError as error:
            if error.errno in (errno.EADDRINUSE, errno.EACCES):
                return False
            raise ValueError(f"host is {host!r}, expected an address of this machine") from None
    return True
