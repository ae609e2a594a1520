"""Only pages at the server's own address that know its token are answered, in silence."""

import contextlib
import os
import socket
import threading
import time
import urllib.parse
from functools import partial

import pytest

import linkwise as lw
from helpers.browser import PATIENCE
from linkwise.view.source import Appearance, Source

viser = pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
msgspec = pytest.importorskip("msgspec")
client = pytest.importorskip("websockets.sync.client")
PROTOCOL = f"viser-v{viser.__version__}"


@pytest.fixture
def address(serve):
    return serve(Source("chain", lw.scenes.chain(2), Appearance([], [], [])))


def ask(address, path=None, host=None, **headers):
    """The status of an answer to a GET, 0 if there is none."""
    parts = urllib.parse.urlsplit(address)
    lines = [f"GET {parts.path if path is None else path} HTTP/1.1"]
    lines += [f"Host: {host}" for host in ([parts.netloc] if host is None else host)]
    lines += [f"{name}: {value}" for name, value in headers.items()]
    with socket.create_connection((parts.hostname, parts.port), timeout=PATIENCE) as talk:
        talk.sendall("\r\n".join([*lines, "", ""]).encode("latin-1"))
        answer = talk.makefile("rb").read()
    return int(answer.split()[1]) if answer else 0


def connection(address, origin=None, protocol=PROTOCOL):
    """A web socket as viser's page opens it, from a page of this origin."""
    parts = urllib.parse.urlsplit(address)
    return client.connect(
        f"ws://{parts.netloc}{parts.path.rstrip('/')}",
        origin=origin or f"http://{parts.netloc}",
        subprotocols=[protocol],
        max_size=None,
        compression=None,
    )


def test_the_page_is_at_the_address_that_is_printed(address):
    assert ask(address) == 200
    port = urllib.parse.urlsplit(address).port
    assert ask(address, host=[f"localhost:{port}"]) == 200
    with connection(address) as own:
        assert own.recv(timeout=PATIENCE)


@pytest.mark.parametrize(
    "host",
    [
        [],
        ["evil.example"],
        ["evil.example:{port}"],
        ["127.0.0.1"],
        ["127.0.0.1:{port}", "evil.example"],
        ["127.0.0.1:{port}@evil.example"],
        ["127.0.0.1.evil.example:{port}"],
    ],
)
def test_a_name_that_somebody_points_here_is_not_answered(address, host):
    port = urllib.parse.urlsplit(address).port
    assert ask(address, host=[name.format(port=port) for name in host]) in (400, 403)


@pytest.mark.parametrize("path", ["/", "/index.html", "/guess/", "//", "/\xff/", "/?token=x"])
def test_without_the_token_nothing_is_answered(address, path):
    assert ask(address, path=path) == 403


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://{place}", "http://localhost:1"]
)
def test_pages_of_other_sites_get_no_connection(address, origin):
    place = urllib.parse.urlsplit(address).netloc
    with pytest.raises(Exception, match="403"):
        connection(address, origin=origin.format(place=place))
    assert ask(address, Origin=origin.format(place=place)) == 403


def test_a_connection_without_the_token_or_in_another_protocol_is_refused(address):
    place = urllib.parse.urlsplit(address).netloc
    with pytest.raises(Exception, match="403"):
        connection(f"http://{place}")
    with pytest.raises(Exception, match="403"):
        connection(address, protocol="viser-v0")


def sockets():
    found = []
    for number in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            found.append(os.readlink(f"/proc/self/fd/{number}"))
    return sum(name.startswith("socket:") for name in found)


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="counts sockets in /proc")
def test_malformed_messages_leave_no_word_and_no_socket(address, capfd):
    parts = urllib.parse.urlsplit(address)
    before = sockets()
    for garbage in (b"\x16\x03\x01\r\n\r\n", b"POST / HTTP/1.1\r\n\r\n", b"GET\r\n\r\n"):
        with socket.create_connection((parts.hostname, parts.port), timeout=PATIENCE) as talk:
            talk.sendall(garbage)
            assert not talk.makefile("rb").read().startswith(b"HTTP/1.1 200")
    encode = msgspec.msgpack.encode
    update = {"type": "GuiUpdateMessage", "uuid": ["x"], "updates": 5}
    closing = ["text", b"", b"\xc1", encode(5), encode({"type": ["x"]}), b"\x91" * 100_000]
    for message in [*closing, encode({"type": "ViewerCameraMessage"})]:
        with connection(address) as own:
            own.send(message)
            with pytest.raises(Exception, match="1011"):
                list(iter(partial(own.recv, timeout=PATIENCE), None))
    with connection(address) as own:
        for message in (encode(update), encode({"type": "ShareUrlDisconnect"})):
            own.send(message)
        own.recv(timeout=PATIENCE)
    until = time.monotonic() + PATIENCE
    while sockets() > before and time.monotonic() < until:
        threading.Event().wait(0.02)
    assert sockets() == before
    assert capfd.readouterr() == ("", "")
    assert ask(address) == 200
