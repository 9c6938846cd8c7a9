"""The page's server: reachable from this machine only, with a token, and without outside resources."""

from __future__ import annotations

import hmac
import secrets
import signal
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import panel as pn
from tornado.httputil import HTTPServerRequest
from tornado.routing import Router
from tornado.web import ErrorHandler, OutputTransform, RequestHandler

from axisight.errors import InputError

ADDRESS = "127.0.0.1"
PATH = "/explore"


@dataclass(frozen=True)
class Served:
    """A served page: its address with the token, its server, and the signals that it handles."""

    server: Any
    url: str
    handlers: dict[signal.Signals, Any]

    def run(self) -> None:
        """Serve until interrupted."""
        # Panel replaced the command's signal handlers; those give a stop its exit status.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self.handlers[number])
        try:
            self.server.start()
            self.server.io_loop.start()
        finally:
            self.server.stop()


def free_port() -> int:
    """Return a free port of this machine."""
    with socket.socket() as probe:
        probe.bind((ADDRESS, 0))
        return int(probe.getsockname()[1])


def serve(page: Callable[[], Any], port: int = 0, title: str = "Axisight explorer") -> Served:
    """Return the server of a page, not yet running; ``page`` builds the page for every visit.

    ``title``: title until the page sets its own. ``port`` 0 takes a free port. Raises InputError for a port
    in use.
    """
    chosen = port or free_port()
    host = f"{ADDRESS}:{chosen}"
    handlers: dict[signal.Signals, Any]
    handlers = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
    try:
        server = pn.io.server.get_server(
            {PATH: page},
            port=chosen,
            address=ADDRESS,
            websocket_origin=[host],
            title=title,
            start=False,
            show=False,
            index=None,
        )
    except OSError as error:
        raise InputError(f"--port: expected a free port, got {chosen}: {error}") from error
    token = secrets.token_urlsafe(32)
    application = server._tornado
    application.add_transform(_headers(host))
    server._http.request_callback = _Guard(application, token, host)
    return Served(server, f"http://{host}{PATH}?token={token}", handlers)


class _Guard(Router):
    """Pass requests that have the token; answer all others with 403, files and sockets too.

    The token comes once in the address, then as a cookie that only this host gets and that no script can
    read. A ``Host`` header with another name is refused: a page elsewhere may have chosen that name.
    """

    def __init__(self, application: Any, token: str, host: str) -> None:
        self._application, self._token, self._host = application, token, host
        self._cookie = f"axisight_{host.rpartition(':')[2]}"

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        """Return the handler of a request."""
        if request.host != self._host:
            return self._refused(request)
        given = [x.decode("utf-8", "replace") for x in request.arguments.get("token", [])]
        if request.path == PATH and len(given) == 1 and self._right(given[0]):
            kept = {"name": self._cookie, "value": self._token}
            return self._application.get_handler_delegate(request, _Enter, kept)
        cookie = request.cookies.get(self._cookie)
        if cookie is None or not self._right(cookie.value):
            return self._refused(request)
        return self._application.find_handler(request, **kwargs)

    def _right(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self._token.encode())

    def _refused(self, request: HTTPServerRequest) -> Any:
        return self._application.get_handler_delegate(request, ErrorHandler, {"status_code": 403})


class _Enter(RequestHandler):
    """Set the cookie and redirect to the page without the token in its address."""

    def initialize(self, name: str, value: str) -> None:
        """Store name and value of the cookie."""
        self._name, self._value = name, value

    def get(self) -> None:
        """Redirect the browser."""
        self.set_cookie(self._name, self._value, httponly=True, samesite="Strict")
        self.redirect(PATH)


def _headers(host: str) -> type[OutputTransform]:
    """Return the transform that adds the page's content policy to every response.

    The page's libraries create scripts and styles at run time, all from this server.
    """
    policy = "; ".join(
        [
            "default-src 'self'",
            "script-src 'self' blob: 'unsafe-inline' 'unsafe-eval'",
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self' data:",
            f"connect-src 'self' ws://{host} data: blob:",
            "object-src 'none'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        ]
    )

    class Headers(OutputTransform):
        def transform_first_chunk(
            self, status_code: int, headers: Any, chunk: bytes, finishing: bool
        ) -> Any:
            headers["Content-Security-Policy"] = policy
            headers["Referrer-Policy"] = "no-referrer"
            headers["X-Content-Type-Options"] = "nosniff"
            return status_code, headers, chunk

    return Headers
