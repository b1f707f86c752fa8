"""How the server listens."""

import asyncio
import socket

from app.cli import _listen
from app.settings import Settings


def test_answers_do_not_wait_for_an_acknowledgement() -> None:
    """Nagle's algorithm is off where somebody connects; with it, each answer took 40 ms more."""
    listener = _listen(Settings(port=0))

    async def connect() -> int:
        found: asyncio.Future[int] = asyncio.get_running_loop().create_future()

        def see(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            accepted = writer.get_extra_info("socket")
            found.set_result(accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
            writer.close()

        server = await asyncio.start_server(see, sock=listener)
        async with server:
            _, writer = await asyncio.open_connection(*listener.getsockname())
            writer.close()
            return await found

    assert asyncio.run(connect()) == 1
