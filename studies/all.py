"""Runs studies anew: sweeps, which resume from their shards, then the commands that reduce, draw and write pages.

all.yaml says what each study runs, times.csv how long that took. A rehearsal does all of it with few samples, and with
a copy of the pages.
"""

import json
import math
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import pandas
import typer
import yaml

import warpchain
from studies import numerics
from studies.common import run_study, table

TIMES = numerics.TABLE.with_name("times.csv")
ENDED = "ended.json"  # In the folder of all sweeps: step → row of `TIMES`, of those that have run to their end


@dataclass(frozen=True, kw_only=True)
class Step:
    """A sweep, or a command that reads sweeps: arguments of ``python -m`` with {folders} and {device} in them."""

    study: str
    name: str
    arguments: tuple[str, ...]
    walks: int = 0

    def expected(self, times: pandas.DataFrame) -> tuple[float, str]:
        """Time on one device [s], and what was measured; NaN if nothing was."""
        if self.name not in times.index:
            return math.nan, "not measured"
        known = times.loc[self.name]
        share = self.walks / known.walks if self.walks else 1.0
        return float(known.seconds * known.devices * share), f"{known.device}, numerics {known.numerics}"


def steps(only: list[str]) -> Iterator[Step]:
    """All steps of these studies, or of every one, in their order."""
    content: dict[str, Any] = yaml.safe_load(numerics.TABLE.read_text(encoding="utf-8"))
    if unknown := [name for name in only if name not in content]:
        raise warpchain.InputError(f"--only: unknown name {unknown[0]}; use one of {', '.join(content)}")
    for study in only or content:
        sweeps = content[study].get("sweeps", {})
        for name, given in sweeps.items():
            file = given.get("file", f"studies/{study}/sweeps/{name}.yaml")
            words = ["warpchain", "sweep", file, "-o", f"{{folders}}/{name}", "--device", given.get("on", "{device}")]
            words += [text for key in ("seed", "samples") if key in given for text in (f"--{key}", str(given[key]))]
            yield Step(study=study, name=name, arguments=tuple(words), walks=given["walks"])
        for command in content[study]["commands"]:
            words = [f"{{folders}}/{word}" if word in sweeps else word for word in command.split()]
            name = " ".join(word for word in command.split()[:2] if "{" not in word)
            yield Step(study=study, name=name, arguments=tuple(words))


def read_times() -> pandas.DataFrame:
    """The rows of the file by step."""
    return pandas.read_csv(TIMES, comment="#", index_col="step")


def listed(chosen: list[Step], times: pandas.DataFrame) -> str:
    """The steps with their walks, the time that one GPU is expected to take, and which measurement says so."""
    rows, total = [], {"GPU": 0.0, "CPU core": 0.0}
    for step in chosen:
        seconds, basis = step.expected(times)
        if is_known := not math.isnan(seconds):
            total["CPU core" if "CPU" in basis else "GPU"] += seconds
        rows.append((step.study, step.name, f"{step.walks:,}", f"{seconds:.0f}" if is_known else "-", basis))
    text = table("study | step | walks | expected / s | measured", rows)
    times_of = " and ".join(f"{each / 60:.0f} min of one {kind}" for kind, each in total.items() if each)
    return f"{text}\n\n{sum(step.walks for step in chosen):,} walks, {times_of}; what was not measured is not in it"


def device_name(device: str) -> str:
    """The name of a processor, for the file of times."""
    if not device.startswith("cuda"):
        return "CPU"
    query = ["nvidia-smi", "--query-gpu=name", "--format=csv,noheader", f"--id={device.partition(':')[2] or 0}"]
    return subprocess.run(query, capture_output=True, text=True, check=True).stdout.strip()


def run_step(step: Step, folders: Path, device: str, home: Path) -> dict[str, Any]:
    """Run a step in a checkout; its row of the file of times. CalledProcessError if it fails, or walks are missing.

    A sweep whose walks have all ended is complete; its own exit status is 1 if some of them failed, as some loops do.
    """
    arguments = [each.format(folders=folders, device=device) for each in step.arguments]
    print(f"\n$ python -m {' '.join(arguments)}", flush=True)
    is_resumed, began = bool(step.walks) and (folders / step.name).exists(), time.monotonic()
    status = subprocess.run([sys.executable, "-m", *arguments], cwd=home, check=False).returncode
    seconds = None if is_resumed else round(time.monotonic() - began, 1)  # the rest of a sweep says nothing of it
    walks, version = step.walks, numerics.today()
    is_complete = status == 0
    if walks and status in (0, 1):
        result = warpchain.load(folders / step.name)
        walks, version, is_complete = result.walk_count, result.provenance["numerics_version"], not result.missing_count
    if not is_complete:
        raise subprocess.CalledProcessError(status, arguments)
    used = device if "{device}" in step.arguments else "cpu"  # a command without it
    row = {"study": step.study, "step": step.name, "walks": walks, "device": device_name(used), "devices": 1}
    return row | {"seconds": seconds, "numerics": version}


def copy_for_rehearsal(home: Path, samples: int) -> None:
    """A copy of what steps read and write, whose sweeps have so few samples."""
    for name in ("studies", "sweeps"):
        shutil.copytree(numerics.ROOT / name, home / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(numerics.ROOT / "CHANGELOG.md", home)
    for path in home.glob("**/*.yaml"):
        text = path.read_text(encoding="utf-8")
        path.write_text(re.sub(r"\bsamples: \d+", f"samples: {samples}", text), encoding="utf-8")


def main(
    device: str = "cpu",
    resume: bool = False,
    only: list[str] | None = None,
    show: Annotated[bool, typer.Option("--list", help="Print steps, walks and expected times; run nothing.")] = False,
    runs: Annotated[Path, typer.Option(help="Folder of the folders of all sweeps.")] = Path("runs"),
    rehearse: Annotated[int | None, typer.Option(min=1, help="Samples of a rehearsal on a copy of studies/.")] = None,
) -> None:
    """Run the sweeps of all studies, or of --only some, and write their tables, figures and pages."""
    chosen = list(steps(only or []))
    if show:
        print(listed(chosen, read_times()))
        return
    runs, home = runs.resolve(), numerics.ROOT
    if runs.exists() and not resume:
        raise warpchain.InputError(f"{runs}: already exists; use --resume to run what is missing, or another --runs")
    runs.mkdir(parents=True, exist_ok=True)
    if rehearse is not None and not (home := runs / "rehearsal").exists():
        copy_for_rehearsal(home, rehearse)
    path = runs / ENDED
    ended: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    failed: dict[str, str] = {}
    for step in chosen:
        key = " ".join(step.arguments)
        if step.study in failed or ended.get(key, {}).get("numerics") == numerics.today():
            continue
        try:
            ended[key] = run_step(step, runs, device, home)
        except subprocess.CalledProcessError:
            failed[step.study] = step.name  # the other studies need nothing of it
            continue
        path.write_text(json.dumps(ended, indent=1), encoding="utf-8")
    rows = pandas.DataFrame([ended[key] for step in chosen if (key := " ".join(step.arguments)) in ended])
    print(f"\n{table(rows.columns, rows.values.tolist())}" if len(rows) else "\nnothing has run to its end")
    if studies := sorted({step.study for step in chosen} - failed.keys()):
        subprocess.run([sys.executable, "-m", "studies.numerics", *studies], cwd=home, check=True)
    if rehearse is None and len(rows):
        first, times = TIMES.read_text(encoding="utf-8").splitlines()[0], read_times()
        rows = rows.dropna()
        times = pandas.concat([times.drop(rows.step, errors="ignore"), rows.set_index("step")])
        TIMES.write_text(f"{first}\n{times.to_csv()}", encoding="utf-8")
    if failed:
        texts = (f"{study} at {step}" for study, step in failed.items())
        raise warpchain.InputError(f"failed: {', '.join(texts)}; see above, and use --resume to run what is missing")


if __name__ == "__main__":
    run_study(main)
