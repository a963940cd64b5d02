"""What taps that a hand could give do: reduces the sweep `taps`, if its folder is given, and writes its tables."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas
import typer

import warpchain
from studies.common import Columns, OverCells, mean, minus, publish, run_study, standard_error, table, write_rows

FOLDER = Path(__file__).parent
UNITS = {"tilt": "rad", "tilt_rate": "rad/s", "lateral_speed": "m/s", "yaw_rate": "rad/s"}
STRAIGHT = (0.1, 0.2)  # Greatest |drift| over Δx of a walk that counts as straight
FEW = 3  # Walks of a cell that are enough for a mean


def reduced(folder: str, needed: str) -> tuple[warpchain.SweepResult, list[dict[str, str]]]:
    """A sweep, and rows: what each tap does, over the cells."""
    result, found = warpchain.load(folder), []
    if not {"fixed", needed} <= result.blocks.keys():
        raise warpchain.InputError(f"{folder}: no blocks fixed and {needed}; use a folder of the page's sweep")
    fixed = result.blocks["fixed"].statistics()
    settings = {each["name"]: each["scene"] for each in result.sweep["blocks"]}
    for name, block in result.blocks.items():
        taps = [axis for axis in block.axes if axis not in ("links", "frequency")]
        if name == "fixed":
            continue
        for place in np.ndindex(*(len(block.axes[axis]) for axis in taps)):
            at = {axis: float(block.axes[axis][i]) for axis, i in zip(taps, place, strict=True)}
            columns = {key: values[(slice(None), slice(None), *place)] for key, values in block.columns.items()}
            tap = {**{key: settings[name][key] for key in UNITS if settings[name].get(key)}, **at}
            text = ", ".join(f"{key} {value:g} {UNITS[key]}" for key, value in tap.items())
            found.append({"tap": text.replace("_", " "), **_of_cells(columns, fixed)})
    return result, found


def _of_cells(columns: Columns, fixed: Any) -> dict[str, str]:
    """Numbers of one tap over the cells, columns (links, frequency, samples)."""
    rest = columns["status"] == warpchain.Status.AT_REST
    dx, drift = (np.where(rest, columns[name].astype(float), np.nan) for name in ("dx", "lateral_drift"))
    ratio = mean(dx) / fixed.mean
    own = standard_error(dx) / mean(dx)
    over = OverCells(ratio, ratio * np.hypot(own, fixed.standard_error / fixed.mean))
    found = {
        "walks": str(rest.sum()),
        "fell": f"{100 * columns['fell_over'].mean():.3g}",
        "early": f"{100 * columns['fell_before_collapse'].mean():.3g}",
        "ratio": f"{over.mean:.3f}",
        "error": f"{over.error:.3f}",
        "least": f"{ratio.min():.2f}",
        "greatest": f"{ratio.max():.2f}",
        "drift": f"{np.sqrt(np.nanmean(drift**2)):.3f}",
        "yaw": f"{np.degrees(np.sqrt(np.nanmean(columns['final_yaw'].astype(float) ** 2))):.2g}",
    }
    for bound in STRAIGHT:
        straight = np.abs(drift) <= bound * np.abs(dx)
        enough = straight.sum(axis=-1) >= FEW
        kept = mean(np.where(straight, dx, np.nan)[enough]) / mean(dx)[enough]
        found[f"straight_{bound:g}"] = f"{100 * straight.sum() / rest.sum():.0f}"
        found[f"kept_{bound:g}"] = f"{mean(kept):.3f}"
    return found


def taps_table(rows: list[dict[str, str]]) -> str:
    """What each tap of one kind does, means over the cells."""
    head = "perturbation | fell over / % | before collapse / % | Δx over fixed plane (cells) | drift / m"
    shown = "{fell}", "{early}", "{ratio} ({least}–{greatest})", "{drift}"
    straight = f"straight_{STRAIGHT[-1]:g}"
    lines = (
        (minus(row["tap"]), *(text.format(**row) for text in shown), row[straight])
        for row in rows
        if "," not in row["tap"]
    )
    return table(f"{head} | straight / %", lines)


def main(folder: Annotated[str | None, typer.Argument()] = None) -> None:
    """Reduce a folder if it is given; write the tables."""
    path = FOLDER / "results" / "taps.csv"
    if folder is not None:
        result, found = reduced(folder, "lateral_speed")
        write_rows(path, found, result)
    rows = pandas.read_csv(path, comment="#", dtype=str).to_dict("records")
    publish(FOLDER, {"taps": taps_table(rows)})


if __name__ == "__main__":
    run_study(main)
