"""The command `live`, which serves or exports the live page."""

import os
import sys
import time
from pathlib import Path
from typing import Annotated, Final

import typer

from warpchain.cli.interrupts import INTERRUPTED
from warpchain.cli.words import argument, option, output

_WHAT: Final = "Folder of a sweep whose cells are shown, or a saved address of the page, which restores its settings."
_EXPORT: Final = "Write index.html with some 40 precomputed walks to this folder; it needs neither a server nor Python."


def live(
    what: Annotated[str | None, argument("FOLDER", _WHAT)] = None,
    port: Annotated[int, option("N", "Port of the server. Default: any that is free.", min=0, max=65535)] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
    export: Annotated[Path | None, output("DIR", _EXPORT, "--export")] = None,
) -> None:
    """Serve an interactive page until Ctrl-C.

    Sliders change the walk of a chain. The page is served to this machine only. It shows the walk while it is
    computed, random samples, pushed links, and the code that repeats the walk.
    """
    from warpchain.inputs.validation import InputError, printable

    if export is not None:
        from warpchain.live_page.export import export_page

        if what is not None:
            raise InputError("--export: not possible with a folder or an address; remove one")
        print(printable(str(export_page(export))))
        return
    from warpchain.live_page.server import LiveServer

    address, mark, fragment = (what or "").partition("#")
    folder = Path(address) if address and "://" not in address else None
    server = LiveServer(port, folder)
    url = server.url + mark + fragment
    print(f"{printable(url)}\nCtrl-C ends it", flush=True)
    try:
        if browser:
            import webbrowser

            webbrowser.open(url)
        server.start()  # what it imports now takes a second, in which the browser opens
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr, flush=True)
        os._exit(INTERRUPTED)  # kernels may be being compiled, which nothing else ends
