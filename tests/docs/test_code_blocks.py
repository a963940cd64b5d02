"""Every command and every example of README, docs/ and studies/ does what a reader would have it do."""

import functools
import os
import re
import shlex
import stat
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from tests.docs.code_blocks import PAGES, REASONS, ROOT, code_blocks, inline_code, name_of
from warpchain.cli.main import app, main
from warpchain.inputs.yaml_files import read_yaml

SET_UP = re.compile(r"^python3 -m venv \S+ && \S+/pip install -q \. && ")
"""What the first command of the README does before it runs warpchain; `.ci/run` and the test of the wheel do it."""
MOST_SAMPLES = 2
MOST_VALUES = 2
LONGEST = 70
"""Most links of a chain in a sweep."""
SHORTER = {
    r"(?m)^samples: \d+$": f"samples: {MOST_SAMPLES}",
    r"\[(0\.\d+), (?:0\.\d+, )+(0\.\d+)\]": r"[\1, \2]",  # an axis with its first and its last value
    r"\bsamples=4\b": f"samples={MOST_SAMPLES}",
    r"\b(links[=:] ?\[60, )\d+\]": r"\g<1>70]",
    r"--at-most \d+": f"--at-most {4 * MOST_SAMPLES}",
    r"--fps 12 --slow 5": "--fps 3",
    r'\.animate\("([\w.-]+)"\)': r'.animate("\1", fps=3)',
}
"""What a page does for long, and what is run instead."""
RUN = [page for page in PAGES if any(block.is_run for block in code_blocks(page))]


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN, ids=name_of)
def test_blocks_of_a_page_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of a page run one after the other; sweeps have fewer samples, shorter axes and shorter chains.

    The commands of the repository's README run in processes of their own, as a shell starts them.
    """
    for file in (*ROOT.glob("sweeps/*.yaml"), *ROOT.glob("studies/*/sweeps/*.yaml")):
        target = tmp_path / file.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(yaml.safe_dump(reduced(read_yaml(file)), sort_keys=False), encoding="utf-8")
    command = tmp_path / "bin" / "warpchain"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m warpchain "$@"\n', encoding="utf-8")
    command.chmod(command.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{command.parent}:{os.environ['PATH']}")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "page"}
    for block in code_blocks(page):
        if not block.is_run:
            continue
        code = block.code
        for longer, shorter in SHORTER.items():
            code = re.sub(longer, shorter, code)
        if block.language == "python":
            exec(compile(code, name_of(page), "exec"), names)
        else:
            code = SET_UP.sub("", code).replace(".venv/bin/", "")
            if page != ROOT / "README.md" and (commands := plain_commands(code)):
                for arguments in commands:
                    with pytest.raises(SystemExit) as end:
                        main(arguments)
                    assert not end.value.code, arguments
                continue
            done = subprocess.run(["bash", "-euo", "pipefail", "-c", code], capture_output=True, encoding="utf-8")
            assert done.returncode == 0, f"{code}\n{done.stdout}\n{done.stderr}"


def plain_commands(code: str) -> list[list[str]]:
    """The arguments of each command of a block, if it has nothing but commands of `warpchain` and needs no shell.

    They run in this process: in one of its own most take longer to import what they need than to do their work.
    """
    lines = [line.strip() for line in re.split(r"\n|&&", re.sub(r"#.*", "", code)) if line.strip()]
    is_plain = all(line.startswith("warpchain ") and not re.search(r"[|<>$&;*\\]", line) for line in lines)
    return [shlex.split(line)[1:] for line in lines] if is_plain else []


def reduced(sweep: Any) -> Any:
    """The content of a sweep file with few samples in each cell, few values along each axis and no long chains."""
    if not isinstance(sweep, Mapping):
        return sweep
    small = dict(sweep)
    if "samples" in small:
        small["samples"] = min(small["samples"], MOST_SAMPLES)
    if "grid" in small:
        small["grid"] = {
            name: values[:MOST_VALUES]
            if isinstance(values, list)
            else [values["from"], values["from"] + values["step"]]
            for name, values in small["grid"].items()
        }
        if (links := small["grid"].get("links")) and links[-1] > LONGEST:
            small["grid"]["links"] = [LONGEST - 10, LONGEST]
    if "blocks" in small:
        small["blocks"] = [reduced(block) for block in small["blocks"]]
    return small


@functools.cache
def command_line() -> Any:
    """The command `warpchain` with all of its commands, as it parses words."""
    return typer.main.get_command(app)


def test_no_block_is_left_out_silently() -> None:
    """Each block is Python or shell that is run, a file that is shown, or is marked with a reason."""
    reasons: Counter[str] = Counter()
    for page in PAGES:
        for block in code_blocks(page):
            assert block.language in ("python", "sh", "yaml", "text", "mermaid", "math"), (name_of(page), block)
            if block.reason is not None:
                reasons[block.reason] += 1
            elif block.language == "sh":
                assert "warpchain" in block.code, f"{name_of(page)}: nothing of it is run; say so\n{block.code}"
    assert set(reasons) <= set(REASONS)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_are_those_of_the_command_line(page: Path) -> None:
    """Each `warpchain …` of a page, in blocks and sentences, has options and arguments that its command takes."""
    lines = [line for block in code_blocks(page) if block.language == "sh" for line in block.code.splitlines()]
    parts = [part.strip() for text in [*lines, *inline_code(page)] for part in re.split(r"&&|#", text)]
    for part in parts:
        words = shlex.split(part) if part.removeprefix(".venv/bin/").startswith("warpchain ") else []
        command: Any = command_line()
        words = words[1:]
        while words and words[0] in getattr(command, "commands", {}):
            command = command.commands[words.pop(0)]
        if words:  # a name alone is no command to be typed
            command.make_context("warpchain", words)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_files_that_are_named_exist(page: Path) -> None:
    """Each path of the repository that stands in a page's code is there."""
    code = [*inline_code(page), *(block.code for block in code_blocks(page) if block.is_run)]
    for text in code:
        for path in re.findall(r"(?<![\w./-])(?:docs|kernels|studies|sweeps|tests|warpchain)/[\w./-]*", text):
            assert (ROOT / path).exists(), path
