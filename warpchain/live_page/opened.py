"""Ways to the live page: `warpchain.live` for notebooks, and the set-up of an address."""

import html
from pathlib import Path

from warpchain.live_page.server import LiveServer
from warpchain.store.sweep_result import load


class Live:
    """A live page that a notebook shows, and its server, which ends with the notebook's kernel or by `close`.

    Attributes:
        url: address of the page, with the token that it asks for; only this machine reaches it.
    """

    def __init__(self, server: LiveServer) -> None:
        """Start to serve."""
        self._server, self.url = server, server.url
        server.start()

    def __repr__(self) -> str:
        """The address."""
        return f"<live page at {self.url}>"

    def _repr_html_(self) -> str:
        """The page in a frame."""
        style = "width:100%;height:820px;border:0"
        return f'<iframe title="live page" style="{style}" src="{html.escape(self.url)}"></iframe>'

    def close(self) -> None:
        """End the server and its walks."""
        self._server.close()


def live(folder: str | Path | None = None, *, port: int = 0) -> Live:
    """Show a live page, on which sliders change a walk, in a notebook whose kernel runs on this machine.

    Args:
        folder: folder of a sweep, or a merged file, whose cells can be clicked to see their walks; None: no sweep.
        port: port of the server on 127.0.0.1; 0: any that is free.

    Returns:
        The page: a notebook shows it, `url` is its address, `close` ends its server.

    Raises:
        InputError: the folder holds no sweep.
        OSError: the port is taken.
    """
    sweep = None if folder is None else load(folder)
    return Live(LiveServer(port, sweep, Path(folder or ".")))
