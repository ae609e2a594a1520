"""A viser server that stays on this machine unless told otherwise."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linkwise._core import InputError
from linkwise.io.complaint import shown
from linkwise.view.guard import Guard

if TYPE_CHECKING:
    import viser

LOCAL = "127.0.0.1"


def _viser() -> Any:
    try:
        import viser
    except ImportError:
        raise InputError("view needs the package viser; pip install 'linkwise[view]'") from None
    return viser


def check_address(host: str, port: int) -> None:
    """InputError unless a server may listen there. (viser itself would take another port.)"""
    if not 0 <= port <= 65535:
        raise InputError(
            f"port {port}: is not a port; give a number from 0 (any free one) to 65535"
        )
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except PermissionError:
        raise InputError(f"port {port}: may not be used; give --port 8081") from None
    except socket.gaierror:
        raise InputError(
            f"host {shown(host)}: is unknown; give an address of this machine"
        ) from None
    except OSError as error:
        if error.errno == errno.EADDRNOTAVAIL:
            raise InputError(
                f"host {shown(host)}: is no address of this machine; leave --host out"
            ) from None
        raise InputError(
            f"port {port}: is in use on {host}; give another with --port, or --port 0 for any free "
            "one"
        ) from None


def client_page() -> str:
    """The one page that viser's client is."""
    return (Path(_viser().__file__).parent / "client/build/index.html").read_text(encoding="utf-8")


def replay(server: viser.ViserServer, arrays: list[memoryview]) -> list[dict[str, Any]]:
    """The messages that the server sends to a client that connects, as dictionaries.

    Their arrays are appended to `arrays`; in the messages stand placeholders with their indices.
    """
    buffer = server._websock_server._broadcast_buffer
    server.flush()
    with buffer.buffer_lock:
        held = list(buffer.message_from_id.values())
    return [message.as_serializable_dict(arrays) for message in held]


@contextlib.contextmanager
def running(host: str, port: int, title: str) -> Iterator[viser.ViserServer]:
    """A server until the block ends, which no client can make reachable from outside.

    It answers who opens its `address`, and no other page (see `linkwise.view.guard`).
    """
    viser = _viser()
    check_address(host, port)
    guard = Guard(host, f"viser-v{viser.__version__}")
    os.environ.pop("_VISER_PORT_OVERRIDE", None)

    class Server(viser.ViserServer):  # type: ignore[misc, name-defined]
        def request_share_url(self, verbose: bool = True) -> str | None:
            """Never: it would hand the scene to a relay on the network."""
            return None

        def disconnect_share_url(self) -> None:
            """Nothing: there is none. (viser would say so on stdout, whenever a page asks.)"""

        @property
        def address(self) -> str:
            """What to open in a browser, with the token without which nothing is answered."""
            return guard.address(self.get_port())

    with guard.on_servers(), contextlib.redirect_stdout(io.StringIO()):  # it draws a box
        server = Server(host=host, port=port, label=title, verbose=False)
    try:
        if port and server.get_port() != port:
            raise InputError(f"port {port}: is in use on {host}; give another with --port")
        server.gui.configure_theme(
            show_logo=False, show_share_button=False, control_width="large", dark_mode=False
        )
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints that it stops
            server.stop()
