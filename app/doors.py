"""What stands between the network and the routers: a limit on bodies, and headers on answers."""

from starlette.datastructures import MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.errors import BodyTooLarge, JoymapError

_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
        "connect-src 'self'; frame-src 'self'; object-src 'none'; base-uri 'none'; "
        "form-action 'self'; frame-ancestors 'none'"
    ),
    "Referrer-Policy": "no-referrer",  # a participant's address is their key
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class TooOften(JoymapError):
    """Somebody who asks too often."""

    status_code = 429
    kind = "too-often"

    def __init__(self, wait_s: int) -> None:
        """Say when to come back, in whole seconds."""
        super().__init__("That was too often; please wait a minute and try again.")
        self.wait_s = wait_s


class Busy(JoymapError):
    """A database that cannot be written to just now."""

    status_code = 503
    kind = "busy"
    wait_s = 2

    def __init__(self, is_full: bool) -> None:
        """Say why, and that it passes."""
        why = "has no room left to write to" if is_full else "is held by another program"
        super().__init__(f"The database {why}; nothing was kept. Please try again in a moment.")


class SecurityHeaders:
    """Puts the headers on every answer that has not chosen its own."""

    def __init__(self, app: ASGIApp) -> None:
        """Stand before ``app``."""
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, adding headers to the answer."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
                if scope["path"].startswith("/static/"):
                    headers["Cache-Control"] = "no-cache"
            await send(message)

        await self._app(scope, receive, send_with_headers if scope["type"] == "http" else send)


class Heads:
    """Answers HEAD as GET is answered, without the body."""

    def __init__(self, app: ASGIApp) -> None:
        """Stand before ``app``."""
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on as GET, and keep the body back."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return

        async def send_head(message: Message) -> None:
            if message["type"] == "http.response.body":
                message = {**message, "body": b""}
            await send(message)

        await self._app({**scope, "method": "GET"}, receive, send_head)


class BodyLimit:
    """Refuses bodies over a limit, whatever their length header says, before anyone reads them."""

    def __init__(self, app: ASGIApp, limit_bytes: int) -> None:
        """Stand before ``app``."""
        self._app = app
        self._limit_bytes = limit_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Read the body, and pass on if it is not too large."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        body, more = b"", True
        while more:
            message = await receive()
            if message["type"] == "http.disconnect":
                return
            body += message.get("body", b"")
            more = message.get("more_body", False)
            if len(body) > self._limit_bytes:
                await refusal(BodyTooLarge(self._limit_bytes))(scope, receive, send)
                return
        read = False

        async def replay() -> Message:
            nonlocal read
            if read:
                return await receive()
            read = True
            return {"type": "http.request", "body": body, "more_body": False}

        await self._app(scope, replay, send)


def refusal(error: JoymapError) -> JSONResponse:
    """What programs get for a refusal."""
    return JSONResponse(
        {"error": {"kind": error.kind, "sentence": error.sentence}},
        error.status_code,
        refusal_headers(error),
    )


def refusal_headers(error: JoymapError) -> dict[str, str]:
    """What a refusal says besides: how long to wait, in seconds."""
    return {"Retry-After": str(error.wait_s)} if isinstance(error, TooOften | Busy) else {}
