"""How far apart walks end that begin alike to a billionth of a metre: what a single distance is worth.

``python -m tests.support.scatter`` prints the numbers of the page about accuracy, in some minutes.
"""

import tempfile

import numpy as np

import warpchain

LINKS, FREQUENCIES = [60, 100, 140, 180], [5.0, 15.0, 25.0]
STARTS = ["rest", "spinning", "ellipse"]


def scatter(links: list[int], frequencies: list[float], starts: list[str], walks: int) -> np.ndarray:
    """Standard deviation of Δx over its mean, of links, frequency and start; clearances differ by 1 nm."""
    with tempfile.TemporaryDirectory() as folder:
        result = warpchain.sweep(
            grid={
                "links": links,
                "frequency": frequencies,
                "start": starts,
                "clearance": 0.01 + 1e-9 * np.arange(walks),
            },
            distributions={"all": "fixed"},
            samples=1,
            out=folder,
            progress=False,
        )
        dx = result.dx[..., 0]
    return np.asarray(dx.std(axis=-1, ddof=1) / dx.mean(axis=-1))


if __name__ == "__main__":
    percent = 100 * scatter(LINKS, FREQUENCIES, STARTS, 16)
    for number, start in enumerate(STARTS):
        print(f"{start}: median {np.median(percent[..., number]):.1f} %")
        print(percent[..., number].round(1))
    least, low, middle, high, greatest = np.quantile(percent, [0, 0.25, 0.5, 0.75, 1])
    print(f"from the sprocket: median {np.median(percent[..., :2]):.1f} %")
    print(f"all: median {middle:.1f} %, half of them {low:.1f} to {high:.1f} %, all {least:.1f} to {greatest:.1f} %")
