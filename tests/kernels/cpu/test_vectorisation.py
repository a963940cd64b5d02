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

SCALAR = (
    *("kinetic_energy:", "sum_of_squares:", "summarise:"),  # sums in a fixed order
    *("build:", "arrange:", "copy_circles:", "list_touching:", "resolve_self_contacts:", "move_into_room:"),  # not hot
    *("load:", "store:", "open_joints:", "commit: while c"),  # scatter, or where rigid joints and springs take turns
)
"""Loops that may stay scalar: functions of the kernels, or lines in them."""


def widths_of_loops(folder: Path, method: str, fixed_body: str, tilts: bool, precision: str) -> dict[str, int]:
    """Compile a step kernel from scratch; "function: line" of every loop with its least vector width, 1 if scalar.

    Warp repeats each line of a kernel in its C++, as a comment above what it makes of it.
    """
    command = [sys.executable, "-c", REPORT, str(folder), method, fixed_body, "tilts" if tilts else "stays", precision]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    (source,) = folder.rglob("*.cpp")
    assert "_tasks<true>" not in source.read_text(), "Warp compiles the loop once more for contiguous arguments"
    function = line = ""
    places = []  # of each line of C++
    for text in source.read_text().splitlines():
        if comment := re.match(r"\s*// (.*?)\s*<L \d+>$", text):
            line = comment[1]
            function = begin[1] if (begin := re.match(r"def (\w+)", line)) else function
        places.append(f"{function}: {line}")
    found: dict[str, int] = {}
    for number, width in re.findall(r"\.cpp:(\d+):\d+: remark: (?:.*vectorization width: (\d+))?", done.stderr):
        place = places[int(number) - 1]
        found[place] = min(found.get(place, 64), int(width or 1))
    return {place: width for place, width in found.items() if ": while " in place}


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
    """Every loop over links or joints is vectorised to at least four numbers, unless it is known to be scalar."""
    widths = widths_of_loops(tmp_path, method, fixed_body, tilts, precision)
    hot = {place: width for place, width in widths.items() if not place.startswith(SCALAR)}
    assert len(hot) > 12
    assert [place for place, width in hot.items() if width < 4] == []
