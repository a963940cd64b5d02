"""How long twelve walks take in this checkout, as a part of what they take in another.

    python -m tests.support.twelve_walks /path/of/another/checkout [rounds]

Walks of 60 to 180 links at 10 to 30 Hz from rest and from an ellipse are computed in turn by both checkouts, each in
its own environment `.venv` and on one core. Times are those of the processor, so that other work on the machine hardly
counts. Kernels are compiled before.
"""

import itertools
import json
import statistics
import subprocess
import sys
from pathlib import Path

WALKS = [*itertools.product((60, 120, 180), (10.0, 30.0), ("rest", "ellipse"))]
SERVE = """
import json, sys, time, warpchain
for line in sys.stdin:
    walk = json.loads(line)
    start = time.process_time()
    result = warpchain.walk(preset="paper", **walk)
    print(json.dumps([time.process_time() - start, result.status.label, result.dx]), flush=True)
"""


class Checkout:
    """A process of a checkout, which lets chains walk."""

    def __init__(self, folder: Path) -> None:
        """Start it."""
        python = folder / ".venv" / "bin" / "python"
        self.process = subprocess.Popen(
            [str(python), "-c", SERVE], cwd=folder, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def walk(self, links: int, frequency: float, start: str) -> tuple[float, str, float]:
        """Processor time [s], status and Δx [m] of a walk."""
        assert self.process.stdin and self.process.stdout
        request = {"links": links, "frequency": frequency, "start": start}
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        seconds, status, dx = json.loads(self.process.stdout.readline())
        return seconds, status, dx


def main(other: str, rounds: int = 1) -> None:
    """Print a line for each walk, and the median and the total of the ratios."""
    there, here = Checkout(Path(other).resolve()), Checkout(Path.cwd())
    for checkout in (there, here):
        for start in ("rest", "ellipse"):
            checkout.walk(60, 30.0, start)
    ratios, total = [], [0.0, 0.0]
    for _, walk in itertools.product(range(rounds), WALKS):
        before, after = there.walk(*walk), here.walk(*walk)
        ratios.append(after[0] / before[0])
        total = [total[0] + before[0], total[1] + after[0]]
        print(*walk, f"{before[0]:.2f} s -> {after[0]:.2f} s: {ratios[-1]:.3f}", before[1:], after[1:], flush=True)
    print(f"median {statistics.median(ratios):.3f}, total {total[1] / total[0]:.3f}")


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
