"""The web server of a played case: one page and one WebSocket, on this machine only, for who has the token."""

from __future__ import annotations

import errno
import json
import logging
import re
import secrets
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from ...errors import CaseError
from .viewers import Viewer, Viewers

if TYPE_CHECKING:
    from websockets.http11 import Request, Response
    from websockets.sync.server import ServerConnection

HOST = "127.0.0.1"
ORIGINS = re.compile(r"http://(127\.0\.0\.1|localhost)(:\d+)?")  # a page of ours, also through an ssh tunnel
LARGEST = 2**16  # bytes of an order
PATIENCE = 2.0  # seconds for a browser to say hello, or goodbye
GOING_AWAY = 1001
NO_LIBRARY = "ibfil live needs websockets: pip install 'ibfil[web]'"


@contextmanager
def served(page: str, viewers: Viewers, port: int) -> Iterator[str]:
    """Within it the page is served; gives its address, with the token. ``port`` 0 takes one that is free.

    Raises CaseError where websockets is not installed and where the port is taken.
    """
    try:
        from websockets.sync.server import serve
    except ImportError:
        raise CaseError([NO_LIBRARY]) from None
    token = secrets.token_urlsafe(16)

    def answer(connection: ServerConnection, request: Request) -> Response | None:
        return _answer(connection, request, token, page.encode())

    open_lines: set[ServerConnection] = set()

    def meet(connection: ServerConnection) -> None:
        open_lines.add(connection)
        try:
            _meet(connection, viewers)
        finally:
            open_lines.discard(connection)

    quiet = logging.getLogger("ibfil.live")
    quiet.addHandler(logging.NullHandler())
    quiet.propagate = False
    try:
        server = serve(
            meet,
            HOST,
            port,
            origins=[ORIGINS],
            process_request=answer,
            max_size=LARGEST,
            compression=None,
            open_timeout=PATIENCE,
            close_timeout=PATIENCE,
            logger=quiet,
        )
    except OSError as error:
        if error.errno != errno.EADDRINUSE:
            raise
        raise CaseError([f"--port: found {port}, which is taken; allowed: another, or none for a free one"]) from None
    with server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield f"http://{HOST}:{server.socket.getsockname()[1]}/?token={token}"
        finally:
            for connection in list(open_lines):
                connection.close(GOING_AWAY)


def _answer(connection: ServerConnection, request: Request, token: str, page: bytes) -> Response | None:
    """The page, or a refusal; None lets the WebSocket through."""
    from http import HTTPStatus

    from websockets.datastructures import Headers
    from websockets.http11 import Response

    where = urlsplit(request.path)
    given = parse_qs(where.query).get("token", [""])[0]
    if where.path not in ("/", "/line"):
        return connection.respond(HTTPStatus.NOT_FOUND, "there is one page, /\n")
    if not secrets.compare_digest(given.encode(), token.encode()):
        return connection.respond(HTTPStatus.FORBIDDEN, "the address that `ibfil live` printed has a token\n")
    if where.path == "/line":
        return None
    headers = Headers(
        {
            "Content-Type": "text/html; charset=utf-8",
            "Content-Length": str(len(page)),
            "Connection": "close",
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Frame-Options": "DENY",
        }
    )
    return Response(HTTPStatus.OK, "OK", headers, page)


def _meet(connection: ServerConnection, viewers: Viewers) -> None:
    """Serve one page until it is gone."""
    from websockets.exceptions import ConnectionClosed

    viewer = Viewer(connection)

    def send() -> None:
        with suppress(ConnectionClosed, OSError):
            viewer.serve()

    sender = threading.Thread(target=send, daemon=True)
    sender.start()
    viewers.join(viewer)
    try:
        with suppress(ConnectionClosed, OSError):
            for message in connection:
                order = _order(message)
                if order.get("drawn"):
                    viewer.drawn()
                elif order:
                    viewers.ask(order)
    finally:
        viewers.leave(viewer)
        sender.join(timeout=1.0)


def _order(message: str | bytes) -> dict[str, Any]:
    """An order as a page sends it, JSON; nothing where it is none."""
    with suppress(ValueError, RecursionError):
        found = json.loads(message)
        if isinstance(found, dict):
            return found
    return {}
