"""What came out for the paper's last sentences, see `studies.paper.findings`."""

import numpy as np

from studies.common import read_rows
from studies.paper.figure5 import RESULTS as FIGURE5
from studies.paper.findings import Finding, Numbers, monotonic, percent
from studies.paper.reduction import effect_of
from studies.paper.verdicts import Verdict, bounds, share, together


def gradual(numbers: Numbers) -> Finding:
    """A loop loses its shape gradually: nine of ten take longer than an impact lasts."""
    found = numbers["paper_strands"]["strands"]["loss_of_shape"]["rest"]
    low, median, high = found["seconds"]
    impact = float(np.nanmedian(np.array(numbers["paper_shapes"]["impacts"]["duration"], np.float64)))
    text = (
        f"from 90 to 50 % of its area a loop takes {median:.2f} s in the median, {low:.2f} to {high:.2f} s in eight of "
        f"ten walks, {percent(found['of_the_walk'][1], sign=False)} of the walk's time; a first impact lasts "
        f"{impact:.2f} s in the median"
    )
    return Finding(text, Verdict.AGREES if low > impact else Verdict.PART if median > impact else Verdict.DIFFERS)


def nonlinear(numbers: Numbers) -> Finding:
    """Linear propagation of the uncertainties fails: linear terms explain less than half of the variance in a cell."""
    texts, fails = [], []
    for start, found in numbers["paper_footnote"]["nonlinear"].items():
        shares = {name: np.maximum(np.array(each, np.float64), 0.0) for name, each in found.items()}
        medians = {name: percent(float(np.median(each)), sign=False) for name, each in shares.items()}
        linear = shares["linear"]
        name = "as an ellipse" if start == "ellipse" else "from the sprocket"
        texts.append(
            f"{name}: linear terms {medians['linear']} ({percent(linear.min(), sign=False)} to "
            f"{percent(linear.max(), sign=False)}), with squares {medians['squares']}, with products "
            f"{medians['products']}, all but chaos {medians['repeated']}"
        )
        fails.append(share(int((linear < bounds().most).sum()), linear.size))
    text = (
        "shares of the variance in a cell, less what as many terms of noise explain, medians of 9 cells of 500 walks: "
        f"{'; '.join(texts)}"
    )
    return Finding(text, together(fails))


def figure5_shape(numbers: Numbers) -> Finding:
    """Curves of other cells bounce, change v_x in impacts only, and do not turn back."""
    found = read_rows(FIGURE5)
    alike = [
        int(row["rises"]) > 0 and float(row["changes_in_impacts"]) > 0.9 and float(row["backwards"]) < 0.1
        for row in found
    ]
    without = [f"{row['links']} × {float(row['frequency']):g} Hz" for row in found if row["rises"] == "0"]
    text = f"{sum(alike)} of {len(found)} cells have it; not visibly rising between impacts: {', '.join(without)}"
    return Finding(text, share(sum(alike), len(found)))


def sliding(numbers: Numbers) -> Finding:
    """Less friction of the floor lets a chain slide for longer after its collapse."""
    found = numbers["paper_more"]["more"]["sliding"]
    steps = [(float(value), effect_of(each["time"])) for value, each in found.items()]
    return monotonic(numbers, "floor_friction", steps, -1, "time from the collapse to rest")


def same_distributions(numbers: Numbers) -> Finding:
    """Δx is distributed alike at both tolerances."""
    found = numbers["paper_distributions"]["distributions"]
    alike = sum(each["p"] > 0.05 for each in found)
    cells = ", ".join(f"{each['links']} × {each['frequency']:g} Hz" for each in found)
    least, walks = min(each["p"] for each in found), found[0]["walks"][0]
    text = (
        f"in {alike} of {len(found)} cells ({cells}) of {walks} walks the test of Kolmogorov and Smirnov sees no "
        f"difference, the least p is {least:.2f}; means and standard deviations in the [table](#the-last-sentences); "
        "not tried with longer chains"
    )
    return Finding(text, share(alike, len(found)))
