"""Draws claims with a number from the pages of all studies, for a strict reading with other programs than theirs.

`python -m tests.support.drawn_claims` prints the same thirty as long as the pages stay.
"""

import random
import re
from pathlib import Path

SEED = 20261128
COUNT = 30
STUDIES = Path(__file__).parents[2] / "studies"
HEAD = re.compile(r"[#!<]|\|(?! \d+ \|)")  # Headings, figures, markers, and tables but that of the paper's statements
NUMBER = re.compile(r"\d\S* (?:%|of \d|times|m|mm|s|Hz|±)|±|χ²")


def claims() -> list[tuple[str, str]]:
    """Sentences, and rows of the paper's statements, that have a number: study and text."""
    found = []
    for page in sorted(STUDIES.glob("*/README.md")):
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        for block in re.split(r"\n\n+|\n(?=- |\|)", text):
            words = " ".join(block.split())
            if not HEAD.match(words):
                sentences = re.split(r"(?<=[.;]) (?=[A-Z*`])", words)
                found += [(page.parent.name, each) for each in sentences if NUMBER.search(each)]
    return found


def main() -> None:
    """Print them."""
    for number, (study, text) in enumerate(random.Random(SEED).sample(claims(), COUNT), 1):
        print(f"{number}. {study}: {text}")


if __name__ == "__main__":
    main()
