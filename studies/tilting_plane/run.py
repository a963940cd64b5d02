"""Writes the table of tilts of README.md and draws its figure, from the folder of the sweep `tilt`."""

from pathlib import Path

from studies import common
from studies.tilting_plane import taps

FOLDER = Path(__file__).parent


def table(rows: list[dict[str, str]]) -> str:
    """What a tilt at the release does, in Markdown: means over the cells, ± standard error; r.m.s. drift and yaw."""
    head = "tilt / rad | fell over / % | before collapse / % | Δx, tilting over fixed | minimum, maximum of cells"
    shown = "{fell}", "{early}", "{ratio} ± {error}", "{least}, {greatest}", "{drift}", "{yaw}"
    lines = ((row["tap"].split()[1], *(text.format(**row) for text in shown)) for row in rows)
    return common.table(f"{head} | drift / m | yaw / °", lines)


def main(folder: str) -> None:
    """Write the table and draw the fraction of walks that fell over."""
    result, rows = taps.reduced(folder, "tilted")
    common.write_rows(FOLDER / "results" / "tilt.csv", rows, result)
    common.publish(FOLDER, {"tilt": table(rows)}, {"falls": result.plot(quantity="fell_over")})


if __name__ == "__main__":
    common.run_study(main)
