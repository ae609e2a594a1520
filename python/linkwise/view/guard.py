"""Who may talk to the server: browsers at its own address that know its token, in viser's words.

viser answers every request of every page, whatever host and origin it names. A page in another tab
could so read the machine and its loads, under the server's address or under a name of its own that
it points here.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import http
import ipaddress
import logging
import secrets
import socket
import urllib.parse
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any
from unittest import mock

from linkwise._core import InputError

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

_LOOPBACK = ("127.0.0.1", "localhost", "::1")
_EVERY_INTERFACE = ("0.0.0.0", "::", "")

# Malformed requests and messages end their connection, and nothing of them reaches the terminal.
_SILENT = logging.getLogger(f"{__name__}.silent")
_SILENT.addHandler(logging.NullHandler())
_SILENT.propagate = False


class Guard:
    """What a request must bring to be answered.

    host: the address that the server listens on; protocol: the one that its own page speaks.
    """

    def __init__(self, host: str, protocol: str) -> None:
        self.token = secrets.token_urlsafe(16)
        self._host = host.lower()
        self._protocol = protocol
        self._installed = False

    def address(self, port: int) -> str:
        """What to open in a browser."""
        host = _LOOPBACK[0] if self._host in _EVERY_INTERFACE else self._host
        return f"http://{f'[{host}]' if ':' in host else host}:{port}/{self.token}/"

    @contextlib.contextmanager
    def on_servers(self) -> Iterator[None]:
        """Servers that viser starts inside the block ask this guard first."""
        import websockets.asyncio.server as server

        serve = server.serve

        def guarded(handler: Any, *where: Any, process_request: Any, **options: Any) -> Any:
            self._installed = True
            options["logger"] = _SILENT
            asyncio.get_running_loop().set_exception_handler(lambda *_: None)
            return serve(handler, *where, process_request=self._asks(process_request), **options)

        with mock.patch.object(server, "serve", guarded):
            yield
        if not self._installed:
            raise InputError("view cannot guard the server of this viser; pip install viser==1.1.1")

    def _asks(
        self, answer: Callable[[ServerConnection, Request], Response | None]
    ) -> Callable[[ServerConnection, Request], Response | None]:
        def process(connection: ServerConnection, request: Request) -> Response | None:
            port = connection.transport.get_extra_info("sockname")[1]
            refusal = self.refusal(request, port)
            if refusal is not None:
                return connection.respond(http.HTTPStatus.FORBIDDEN, f"{refusal}\n")
            request.path = request.path.removeprefix(f"/{self.token}") or "/"
            response = answer(connection, request)
            if response is not None:
                # The address holds the token: no other site is told it, or shows the page.
                response.headers["Referrer-Policy"] = "same-origin"
                response.headers["Content-Security-Policy"] = "frame-ancestors 'self'"
                response.headers["X-Content-Type-Options"] = "nosniff"
            return response

        return process

    def refusal(self, request: Request, port: int) -> str | None:
        """Why a request to this port is not answered, or None."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or not self._is_own(hosts[0], port):
            return "this is not the server's address"
        if origins and [origin.lower() for origin in origins] != [f"http://{hosts[0]}".lower()]:
            return "this page belongs to another site"
        token = request.path.partition("?")[0].lstrip("/").partition("/")[0]
        if not hmac.compare_digest(token.encode("utf-8", "replace"), self.token.encode()):
            return "open the address that linkwise printed, with its token"
        if request.headers.get_all("Upgrade"):
            spoken = [
                part.strip()
                for line in request.headers.get_all("Sec-WebSocket-Protocol")
                for part in line.split(",")
            ]
            if spoken != [self._protocol]:
                return "this is not the server's own page"
        return None

    def _is_own(self, written: str, port: int) -> bool:
        """Whether a Host header names this server."""
        try:
            parts = urllib.parse.urlsplit(f"//{written}")
            host, given = (parts.hostname or "").lower(), parts.port
        except ValueError:
            return False
        if parts.netloc != written or "@" in written or (80 if given is None else given) != port:
            return False
        if host == self._host or host in _LOOPBACK:
            return True
        if self._host not in _EVERY_INTERFACE:
            return False
        # Of all interfaces any address is right. A name is not: everyone can point one here.
        with contextlib.suppress(ValueError):
            ipaddress.ip_address(host)
            return True
        return host == socket.gethostname().lower()
