"""A viser server for each live session, inside this process and behind the app's own door.

viser's own server listens on a port of its own and lets in whoever finds it (no check of origin,
no token), runs a thread for each server, and lets any page open a public tunnel. Here it gets no
port and no thread: its messages are made on the app's event loop and travel over a websocket that
the app has already checked; what the page sends back is read and dropped. This leans on private
names of viser 1.1.1, which is pinned; docs/decisions/0003 says why.
"""

import asyncio
import contextlib
import io
from collections.abc import AsyncGenerator, Callable, MutableMapping, Sequence
from typing import Any, Protocol

import viser
from viser import infra
from viser._messages import ReplayDoneMessage
from viser.infra._async_message_buffer import AsyncMessageBuffer

from .poses import Poses, encode

SUBPROTOCOL = f"viser-v{viser.__version__}"


class SceneSocket(Protocol):
    """The two things asked of a websocket: bytes out, and whatever comes in."""

    async def send_bytes(self, data: bytes) -> None:
        """Send one binary message."""

    async def receive(self) -> MutableMapping[str, Any]:
        """Wait for the next ASGI message; "websocket.disconnect" when the page is gone."""


class _SameThread:
    """The event loop as its own thread sees it: nothing has to be woken through a socket."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.create_task = loop.create_task

    def call_soon_threadsafe(self, callback: Callable[[], None]) -> None:
        callback()


class _PortlessServer(infra.WebsockServer):
    """viser's message buffer on the running event loop; no port, no thread."""

    def start(self) -> None:
        self._background_event_loop = asyncio.get_running_loop()
        self._broadcast_buffer = AsyncMessageBuffer(
            _SameThread(self._background_event_loop),  # type: ignore[arg-type]
            persistent_messages=True,
        )

    def stop(self) -> None:
        self._broadcast_buffer.set_done()


class SceneServer:
    """One scene that any number of checked websockets may look at. Make it on the event loop."""

    def __init__(self) -> None:
        """Build viser's server around the portless one."""
        listening = infra.WebsockServer
        infra.WebsockServer = _PortlessServer  # type: ignore[misc]
        try:
            # viser prints a banner whatever it is told.
            with contextlib.redirect_stdout(io.StringIO()):
                self.viser = viser.ViserServer(verbose=False)
        finally:
            infra.WebsockServer = listening  # type: ignore[misc]
        self.poses = Poses()
        self._next_viewer = 0
        self.viewers = 0

    async def serve(self, socket: SceneSocket) -> None:
        """Show the scene to one viewer until it leaves."""
        viewer = self._next_viewer
        self._next_viewer += 1
        self.viewers += 1
        # Whoever joins late need not hear of nodes that are gone.
        self.viser._run_garbage_collector()
        windows = self.viser._websock_server.get_message_buffer().window_generator(
            viewer, backlog_done_message=ReplayDoneMessage()
        )
        tasks = {
            asyncio.create_task(self._tell(socket, windows)),
            asyncio.create_task(_drop_everything(socket)),
        }
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self.viewers -= 1
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _tell(
        self, socket: SceneSocket, windows: AsyncGenerator[Sequence[infra.Message], None]
    ) -> None:
        """What there is, then what moves and what else changes, until the scene is closed."""
        following: asyncio.Task[None] | None = None
        try:
            async with contextlib.aclosing(windows):
                async for window in windows:
                    arrays: list[memoryview] = []
                    messages = [message.as_serializable_dict(arrays) for message in window]
                    await socket.send_bytes(encode(messages, arrays))
                    if isinstance(window[-1], ReplayDoneMessage):
                        # The nodes are there now; only then can they be put somewhere.
                        following = asyncio.create_task(self.poses.follow(socket.send_bytes))
        finally:
            if following is not None:
                following.cancel()
                await asyncio.gather(following, return_exceptions=True)

    def flush(self) -> None:
        """Send what is queued now instead of at viser's next window, and what has moved."""
        self.poses.flush()
        self.viser.flush()

    def close(self) -> None:
        """Let every viewer go and free what the scene holds."""
        self.viser.stop()


async def _drop_everything(socket: SceneSocket) -> None:
    # The page may only look: a share request would open a tunnel to the outside.
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass
