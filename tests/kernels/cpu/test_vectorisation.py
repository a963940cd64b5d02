"""Guard of the CPU kernels' speed: an innocent edit that stops clang from vectorising a loop costs a factor 3 to 4."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

REPORT = """
import sys
import warp as wp
wp.config.kernel_cache_dir = sys.argv[1]
from warpchain.kernels.cpu import loop
loop.COMPILER_FLAGS += " -Rpass=loop-vectorize -Rpass-missed=loop-vectorize"
features = loop.Features(method=sys.argv[2], columns=200, fixed_body=sys.argv[3], self_contact=True,
                           tilts=sys.argv[4] == "tilts", is_mixed=sys.argv[5] == "mixed")
wp.load_module(loop.make_advance(features).module, device="cpu")
"""

COMMON = {"place_ends", "attempt", "greatest_distance", "greatest_speed", "evaluate"}
EXPLICIT = COMMON | {"begin", "take_constants", "pull_joints", "first_stage", "take_last_stage", "commit"}
# flights have a ``commit`` of their own, one loop of which scatters
RIGID = (EXPLICIT - {"commit"}) | {
    *("fastest", "meeting", "prepare", "place_stage", "factorise", "solve_forces", "damp", "keep_stage"),
    *("openings", "opening_rates", "push", "close", "begin"),
}
TILTING = EXPLICIT | {
    *("shift_first_stage", "tilting_gap", "write_touches", "resolve_tilting_floor", "write_plane_sums"),
}
HOT_FUNCTIONS = {"dp5": EXPLICIT, "hybrid": RIGID}


def remarks_by_function(
    folder: Path, method: str, fixed_body: str, tilts: bool, precision: str
) -> list[tuple[str, str]]:
    """Compile a step kernel from scratch; (function, clang's remark) for every loop that clang looked at."""
    command = [sys.executable, "-c", REPORT, str(folder), method, fixed_body, "tilts" if tilts else "stays", precision]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    (source,) = folder.rglob("*.cpp")
    lines = source.read_text().splitlines()
    starts = [
        (number, re.sub(r"^.*locals__", "", match[1]))
        for number, line in enumerate(lines, start=1)
        if (match := re.match(r"^static (?:CUDA_CALLABLE )?\w[\w:<> ]* (\w+)_\d+\(", line))
    ]
    found = []
    for match in re.finditer(r"\.cpp:(\d+):\d+: remark: (.*)", done.stderr):
        line = int(match[1])
        function = next((name for start, name in reversed(starts) if start <= line), "kernel")
        found.append((function, match[2]))
    return found


@pytest.mark.skipif(
    not Path("/proc/cpuinfo").exists() or "avx2" not in Path("/proc/cpuinfo").read_text(),
    reason="widths are known for x86 processors with AVX2",
)
@pytest.mark.parametrize(
    ("method", "fixed_body", "tilts", "precision"),
    [
        pytest.param("dp5", "sprocket", False, "double", marks=pytest.mark.thorough),
        ("hybrid", "floor", False, "mixed"),
        pytest.param("dp5", "floor", True, "mixed", marks=pytest.mark.thorough),
    ],
)
def test_hot_loops_are_vectorised(tmp_path: Path, method: str, fixed_body: str, tilts: bool, precision: str) -> None:
    """Every loop over links that runs once per stage or step is vectorised, to at least four numbers."""
    found = remarks_by_function(tmp_path, method, fixed_body, tilts, precision)
    hot = TILTING if tilts else HOT_FUNCTIONS[method] | {"resolve", "least_gap"}
    seen = {function for function, _ in found}
    assert hot <= seen, f"no remark on {hot - seen}: was a function renamed?"
    slow = [
        (function, remark)
        for function, remark in found
        if function in hot and not re.search(r"vectorization width: (4|8|16)\b", remark)
    ]
    assert not slow
