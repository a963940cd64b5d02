"""What taps that a hand could give do: reduces the sweep `taps` and writes its tables.

warpchain sweep studies/tilting_plane/sweeps/taps.yaml -o taps --device cuda
python -m studies.tilting_plane.taps taps     # → results/taps.csv, tables of the page
python -m studies.tilting_plane.taps          # that file → tables of the page
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer

import warpchain
from studies import common

FOLDER: Final = Path(__file__).parent
RESULTS: Final = FOLDER / "results" / "taps.csv"
UNITS: Final = {"tilt": "rad", "tilt_rate": "rad/s", "lateral_speed": "m/s", "yaw_rate": "rad/s"}
STRAIGHT: Final = (0.1, 0.2)
"""Greatest |drift| over Δx of a walk that counts as straight."""
FEW: Final = 3
"""Walks of a cell that are enough for a mean."""


def reduced(result: warpchain.SweepResult) -> Iterator[dict[str, object]]:
    """Rows: what each tap does, over the cells and, of those of one number of links, alone."""
    fixed = result.blocks["fixed"].statistics()
    for name, block in result.blocks.items():
        if name == "fixed":
            continue
        taps = [axis for axis in block.axes if axis not in ("links", "frequency")]
        given = next(each for each in result.sweep["blocks"] if each["name"] == name)["scene"]
        for place in np.ndindex(*(len(block.axes[axis]) for axis in taps)):
            at = {axis: float(block.axes[axis][i]) for axis, i in zip(taps, place, strict=True)}
            columns = {key: values[(slice(None), slice(None), *place)] for key, values in block.columns.items()}
            tap = {**{key: given[key] for key in UNITS if given.get(key)}, **at}
            text = ", ".join(f"{key} {value:g} {UNITS[key]}" for key, value in tap.items())
            for links in (None, *block.axes["links"].tolist()):
                rows = slice(None) if links is None else block.axes["links"] == links
                yield {"tap": text.replace("_", " "), "links": links or "all", **_of_cells(columns, fixed, rows)}


def _of_cells(columns: Mapping[str, Any], fixed: Any, rows: Any) -> dict[str, object]:
    """Numbers of one tap over some cells, (links, frequency, samples)."""
    rest = columns["status"][rows] == warpchain.Status.AT_REST
    dx, drift = (np.where(rest, columns[name][rows].astype(float), np.nan) for name in ("dx", "lateral_drift"))
    mean, count = np.nanmean(dx, axis=-1), rest.sum(axis=-1)
    ratio = mean / fixed.mean[rows]
    errors = np.hypot(
        np.nanstd(dx, axis=-1, ddof=1) / np.sqrt(count) / mean, fixed.standard_error[rows] / fixed.mean[rows]
    )
    found: dict[str, object] = {
        "walks": int(rest.sum()),
        "fell": f"{100 * columns['fell_over'][rows].mean():.3g}",
        "early": f"{100 * columns['fell_before_collapse'][rows].mean():.3g}",
        "ratio": f"{ratio.mean():.3f}",
        "error": f"{np.sqrt(np.sum((ratio * errors) ** 2)) / ratio.size:.3f}",
        "least": f"{ratio.min():.2f}",
        "greatest": f"{ratio.max():.2f}",
        "drift": f"{np.sqrt(np.nanmean(drift**2)):.3f}",
        "yaw": f"{np.degrees(np.sqrt(np.nanmean(columns['final_yaw'][rows].astype(float) ** 2))):.2g}",
        "tilt_at_most": f"{np.degrees(np.nanmedian(columns['greatest_tilt'][rows].astype(float))):.0f}",
    }
    for bound in STRAIGHT:
        straight = np.abs(drift) <= bound * np.abs(dx)
        enough = straight.sum(axis=-1) >= FEW
        kept = (
            np.nanmean(np.where(straight, dx, np.nan)[enough], axis=-1) / mean[enough] if enough.any() else np.array([])
        )
        found[f"straight_{bound:g}"] = f"{100 * straight.sum() / rest.sum():.0f}"
        found[f"kept_{bound:g}"] = f"{kept.mean():.3f}" if len(kept) else "nan"
        found[f"kept_cells_{bound:g}"] = int(enough.sum())
    return found


def table(rows: Sequence[Mapping[str, str]]) -> str:
    """What each tap does, means over the cells."""
    head = ("tap at the release", "fell over", "before the loop collapsed", "Δx over that of a fixed plane")
    lines = [
        (
            row["tap"].replace("-", "−"),
            f"{row['fell']} %",
            f"{row['early']} %",
            f"{row['ratio']} ± {row['error']} ({row['least']} to {row['greatest']})",
            row["drift"],
            *(f"{row[f'straight_{bound:g}']} %, {row[f'kept_{bound:g}']}".replace("nan", "—") for bound in STRAIGHT),
        )
        for row in rows
        if row["links"] == "all"
    ]
    straight = [f"straight to {bound:g}: walks, Δx over all" for bound in STRAIGHT]
    return common.table((*head, "drift / m", *straight), lines)


def by_links(rows: Sequence[Mapping[str, str]]) -> str:
    """Share of walks that fell over before their loop collapsed, by tap and number of links."""
    links = list(dict.fromkeys(row["links"] for row in rows if row["links"] != "all"))
    taps = list(dict.fromkeys(row["tap"] for row in rows))
    early = {(row["tap"], row["links"]): row["early"] for row in rows}
    return common.table(
        ("tap", *(f"{each} links" for each in links)),
        ((tap.replace("-", "−"), *(f"{early[tap, each]} %" for each in links)) for tap in taps),
    )


def main(folder: Annotated[str | None, typer.Argument()] = None) -> None:
    """Reduce a folder if it is given; write the tables."""
    if folder is not None:
        result = warpchain.load(folder)
        if "fixed" not in result.blocks or "lateral_speed" not in result.blocks:
            raise warpchain.InputError(f"{folder}: no blocks fixed and lateral_speed; give a folder of the sweep taps")
        common.write_rows(RESULTS, list(reduced(result)))
    rows = common.read_rows(RESULTS)
    common.write_tables(FOLDER / "README.md", {"taps": table(rows), "taps by links": by_links(rows)})


if __name__ == "__main__":
    common.run_study(main)
