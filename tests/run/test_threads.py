"""Threads of one process: they take turns on a GPU, and one at a time starts Warp and makes kernels."""

import concurrent.futures
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import warpchain
from tests.run.test_sweep_run import TINY
from warpchain.engine.devices import gpu_turn, has_gpu_turn
from warpchain.run.sweep_run import sweep


@pytest.mark.parametrize(("device", "at_most"), [("cuda", 1), ("cpu", 2)])
def test_threads_take_turns_on_a_gpu(device: str, at_most: int) -> None:
    """Two threads with a turn each work at the same time on a CPU, one after the other on a GPU."""
    inside, most = [], []

    def work() -> None:
        with gpu_turn([device]):
            inside.append(device)
            time.sleep(0.2)
            most.append(len(inside))
            inside.pop()

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for task in [pool.submit(work) for _ in range(2)]:
            task.result()
    assert max(most) == at_most and len(most) == 2


def test_a_thread_that_waits_for_its_turn_can_be_stopped() -> None:
    """It gives up within a moment; a turn within one's own turn comes at once, and none is needed on a CPU."""
    stop = threading.Event()

    def wait(device: str) -> bool:
        with gpu_turn([device], stop):
            return has_gpu_turn()

    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        with gpu_turn(["cpu", "cuda"]):
            assert wait("cuda:1") and has_gpu_turn() and not pool.submit(wait, "cpu").result(5)
            task = pool.submit(wait, "cuda")
            time.sleep(0.05)
            assert not task.done()
            stop.set()
            with pytest.raises(concurrent.futures.CancelledError):
                task.result(5)
        assert pool.submit(wait, "cuda").result(5) and not has_gpu_turn()


def test_a_sweep_on_a_gpu_is_refused_within_a_walk_there(tmp_path: Path) -> None:
    """Its task would wait for a turn that the walk does not end."""
    with (
        gpu_turn(["cuda"]),
        pytest.raises(warpchain.InputError, match="device: this thread is running a walk on a GPU; "),
    ):
        sweep(TINY, tmp_path / "sweep", device="cuda")
    assert not (tmp_path / "sweep").exists()
    with gpu_turn(["cuda"]):
        assert sweep(TINY | {"samples": 1}, tmp_path / "sweep").summary()["missing"] == 0


def test_threads_start_a_device_once() -> None:
    """Four first calls at the same time give one device and leave stderr as it was; so does a closed stderr."""
    program = (
        "import os, sys, threading\n"
        "from warpchain.engine.devices import start_device\n"
        "before = os.fstat(2).st_ino if sys.stderr else None\n"
        "found = []\n"
        "threads = [threading.Thread(target=lambda: found.append(start_device('cpu'))) for _ in range(4)]\n"
        "[thread.start() for thread in threads], [thread.join() for thread in threads]\n"
        "print(len(found), len({id(device) for device in found}), before is None or before == os.fstat(2).st_ino)\n"
    )
    for end in ("", " 2>&-"):
        shell = f'"$0" -c "$1"{end}'
        done = subprocess.run(["sh", "-c", shell, sys.executable, program], capture_output=True, text=True)
        assert (done.returncode, done.stdout) == (0, "4 1 True\n"), done
