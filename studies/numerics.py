"""With which numerics the numbers of each study were computed, and whether walks have changed since.

Files in results/ say it in their first line, or in JSON beside each sweep; the changelog has what each version changed.
`studies.all` writes the line that a page has below its findings, and tests compare that line with the files.
"""

import json
import re
import shlex
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Annotated

import typer
import yaml

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_name("all.yaml")  # All studies, what they run and how long it takes
LINE = re.compile(r"\*Computed with numerics [^*]*\*\n\n")
SAME = re.compile(r"none\b|in the last digits\b|single walks change\b")
"""How the changelog begins what a version does to no mean."""
MEAN = re.compile(r"(?:all others )?([-+−]?[\d.]+) ± ([\d.]+) %")  # Likewise a mean change with its standard error


@cache
def effects() -> dict[int, str]:
    """Version of the numerics → what it did to Δx, from the table of the changelog, newest first."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    return {
        int(number): effect.strip() for number, effect in re.findall(r"^\| (\d+) \|.*\|(.*)\|$", text, re.MULTILINE)
    }


def today() -> int:
    """The version with which walks are computed now."""
    return max(effects())


def is_beyond_scatter(effect: str) -> bool:
    """Whether a version changed walks by more than they scatter: one of its effects is neither none nor within 2 σ."""
    for part in effect.split("; "):
        mean = MEAN.match(part)
        within = mean and abs(float(mean[1].replace("−", "-"))) < 2 * float(mean[2])
        if part and not within and not SAME.match(part):
            return True
    return False


def changed_since(version: int) -> list[int]:
    """Later versions that changed walks beyond their scatter, oldest first."""
    return sorted(number for number, effect in effects().items() if number > version and is_beyond_scatter(effect))


def first_line(numerics: Iterable[int], seeds: Iterable[object], command: str) -> str:
    """What a file of results begins with."""
    words = [" and ".join(map(str, sorted({*each}))) or "none" for each in (numerics, seeds)]
    return f"# numerics {words[0]}; seed {words[1]}; {command}\n"


def this_command() -> str:
    """The command that runs, without the folder in which its input lies."""
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    arguments = (Path(each).name if "/" in each else each for each in sys.argv[1:])
    return shlex.join(["python", "-m", spec.name if spec else Path(sys.argv[0]).stem, *arguments])


def of_file(path: Path) -> set[int]:
    """Versions that a file of results was computed with; ValueError if it does not say."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        return {int(each["numerics_version"]) for each in json.loads(text).values()}
    given = re.match(r"# numerics ([\d and]+); seed [^;]+; .+\n", text)
    if given is None:
        raise ValueError(f"{path}: expected '# numerics N; seed S; COMMAND' in its first line; run its study again")
    return {int(each) for each in given[1].split(" and ")}


def of_study(study: str) -> set[int]:
    """Versions that the numbers on a study's page were computed with: those of its files."""
    return {version for path in sorted((TABLE.parent / study / "results").glob("*")) for version in of_file(path)}


def line(study: str) -> str:
    """The line that a study's page needs below its findings: empty if no walk of it has changed since."""
    used = sorted(of_study(study))
    if not (changed := changed_since(used[0])):
        return ""
    numbers = [", ".join(map(str, each[:-1])) + " and " * (len(each) > 1) + str(each[-1]) for each in (used, changed)]
    changes = f"version{'s' * (len(changed) > 1)} {numbers[1]} ha{'ve' if len(changed) > 1 else 's'}"
    link = "[changed walks beyond their scatter](../../CHANGELOG.md#numerics)"
    return f"*Computed with numerics {numbers[0]}; since then {changes}\n{link}.*\n\n"


def with_line(study: str, page: str) -> str:
    """A study's page with its line right below the heading of its findings."""
    text = LINE.sub("", page)
    head, findings, rest = text.partition("## Findings\n\n")
    if not findings:
        raise ValueError(f"{study}: no heading Findings")
    return f"{head}{findings}{line(study)}{rest}"


def main(studies: Annotated[list[str] | None, typer.Argument()] = None) -> None:
    """Write the line of these studies' pages, or of all."""
    for study in studies or yaml.safe_load(TABLE.read_text(encoding="utf-8")):
        path = TABLE.parent / study / "README.md"
        path.write_text(with_line(study, path.read_text(encoding="utf-8")), encoding="utf-8")
        print(f"{study}: {' '.join(line(study).split()) or 'its walks are those of today'}")


if __name__ == "__main__":
    typer.run(main)
