"""How soon a chain moves on the live page: after the command, and after a slider is let go.

``python -m tests.support.live_times`` prints wall times in a headless browser, with the load of the machine, and the
processor time of the server until its first frames. Kernels are in the cache after the first round.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.support.browser import Page, program

LINKS, FRICTIONS, ROUNDS = (60, 180), (0.3, 0.4, 0.5), 4
_OVER = "/^(Δx|No walk|[a-z ]+: )/.test($('said').textContent)"


def first_chain(page: Page, server: "subprocess.Popen[str]") -> tuple[float, float]:
    """Wall time [s] from now until a chain of the server that starts moves on the page, and processor time of both."""
    began = time.monotonic()
    assert server.stdout is not None
    page.call("Page.navigate", url=server.stdout.readline().strip())
    page.wait("player.walk && player.frame > 0")
    ticks = Path(f"/proc/{server.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return time.monotonic() - began, sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def slider(page: Page, links: int, friction: float) -> float:
    """Time [s] from a change of links and floor friction to the first frame on the page."""
    page.wait(_OVER)
    change = f"$('field-links').value = {links}; $('field-floor_friction').value = {friction}; player.delay = 0;"
    events = "".join(f"$('field-{name}').dispatchEvent(new Event('change'));" for name in ("links", "floor_friction"))
    page.do(f"$('said').textContent = ''; {change} {events}")
    page.wait("player.delay > 0")
    return float(page.do("player.delay")) / 1e3


if __name__ == "__main__":
    command = [sys.executable, "-m", "warpchain", "live", "--no-browser"]
    with tempfile.TemporaryDirectory() as profile:
        page = Page(program(), Path(profile))
        page.size(1280)
        for _ in range(ROUNDS):
            page.open("about:blank")
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
                wall, cpu = first_chain(page, server)
                told = [f"load {os.getloadavg()[0]:.1f}", f"first chain {wall:.2f} s, {cpu:.2f} s of the processor"]
                for links in LINKS:
                    times = ", ".join(f"{slider(page, links, friction):.2f}" for friction in FRICTIONS)
                    told.append(f"slider at {links} links {times} s")
                print("; ".join(told), flush=True)
                server.terminate()
        page.close()
