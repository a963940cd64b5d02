"""A worker process for each GPU: what each sees, what is refused; no GPU is needed for that."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import warp as wp
import yaml

from tests.run.test_sweep_run import TINY, data_of
from tests.support.command_line import Command
from warpchain.run.progress_bar import SweepProgress
from warpchain.run.sweep_run import sweep
from warpchain.run.workers import LostWorkersError, gpu_workers

GPU_OF_WORKER = "__import__('time').sleep(0.5) or __import__('os').environ['CUDA_VISIBLE_DEVICES']"
"""Takes a while, so that other workers have to take the next ones; text, for workers cannot import tests."""


def test_each_worker_has_a_gpu_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers see one GPU each, the first of those that this process may use."""
    for visible, expected in (("5, GPU-abc,2", {"5", "GPU-abc"}), (None, {"0", "1"})):
        if visible is None:
            monkeypatch.delenv("CUDA_VISIBLE_DEVICES")
        else:
            monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
        with gpu_workers(2) as executor:
            assert set(executor.map(eval, [GPU_OF_WORKER] * 4)) == expected
        assert os.environ.get("CUDA_VISIBLE_DEVICES") == visible


def test_more_gpus_than_there_are_are_refused(monkeypatch: pytest.MonkeyPatch, command: Command) -> None:
    """One line says how many there are, before the folder is made."""
    monkeypatch.setattr("warpchain.engine.devices.gpu_count", lambda: 1)
    answer = command("sweep", "figure6", "-o", "sweep", "--gpus", "2")
    assert answer.status == 2 and not Path("sweep").exists()
    assert answer.err == "error: --gpus: expected at most 1, the GPUs of this machine, got 2; use at most 1\n"


def test_an_exception_ends_what_workers_are_doing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C does not wait for tasks under way, nor for those that the pool has handed out already."""
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    with pytest.raises(KeyboardInterrupt), gpu_workers(1) as executor:
        executor.submit(os.getpid).result()
        for _ in range(3):
            executor.submit(time.sleep, 30)
        began = time.monotonic()
        raise KeyboardInterrupt
    assert time.monotonic() - began < 15


@pytest.mark.skipif(wp.get_cuda_device_count() > 0, reason="there is a GPU")
@pytest.mark.parametrize("given", (["--device", "cuda"], ["--gpus", "1"], ["--gpus", "99999"]))
def test_a_missing_gpu_leaves_no_folder(given: list[str], monkeypatch: pytest.MonkeyPatch, command: Command) -> None:
    """One line names the option and says that there is no GPU, before the folder is made."""
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    answer = command("sweep", "figure6", "-o", "sweep", *given)
    problem = f"--gpus: expected at most 0, the GPUs of this machine, got {given[1]}; remove it to run on the CPU"
    if given[0] == "--device":
        problem = "options.device: cuda is not available on this machine; use one of cpu"
    assert answer.err == f"error: {problem}\n"
    assert answer.status == 2 and not Path("sweep").exists()


def test_a_worker_that_is_killed_ends_the_sweep_in_one_line(tmp_path: Path) -> None:
    """What the workers wrote is kept, and the error is told from a defect."""
    killed: list[int] = []

    def kill(progress: SweepProgress) -> None:
        if not killed and progress.done:
            killed.append(pids[0])
            os.kill(pids[0], signal.SIGKILL)

    with gpu_workers(2) as executor:
        pids = [executor.submit(os.getpid).result()]
        with pytest.raises(LostWorkersError, match="start again, shards written are kept") as lost:
            sweep(TINY | {"samples": 200}, tmp_path / "sweep", executor=executor, workers=2, on_progress=kill)
    assert len(str(lost.value)) < 200 and "\n" not in str(lost.value)
    assert data_of(tmp_path / "sweep")


PARENT = """
import sys
from warpchain.run.sweep_run import sweep
from warpchain.run.workers import gpu_workers

if __name__ == "__main__":
    with gpu_workers(2) as executor:
        sweep(sys.argv[1], sys.argv[2], executor=executor, workers=2)
"""


LONGER = TINY | {"samples": 150}


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The shards of the longer sweep when nobody kills anything."""
    folder = tmp_path_factory.mktemp("sweep") / "whole"
    sweep(LONGER, folder, workers=1)
    return data_of(folder)


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_their_parent_however_it_dies(
    tmp_path: Path, how: signal.Signals, uninterrupted: dict[str, bytes]
) -> None:
    """Five seconds after a parent was killed in a sweep no worker runs; the sweep goes on and no byte is lost."""
    source, program, folder = tmp_path / "tiny.yaml", tmp_path / "parent.py", tmp_path / "sweep"
    source.write_text(yaml.safe_dump(LONGER, sort_keys=False))
    program.write_text(PARENT)
    parent = subprocess.Popen([sys.executable, program, source, folder], start_new_session=True)
    while not data_of(folder):
        assert parent.poll() is None
        time.sleep(0.05)
    parent.send_signal(how)
    parent.wait()

    def running() -> list[str]:
        listing = subprocess.run(["ps", "-eo", "sess=,stat=,args="], capture_output=True, check=True, text=True)
        rows = [line.split(maxsplit=2) for line in listing.stdout.splitlines()]
        return [args for session, state, args in rows if session == str(parent.pid) and not state.startswith("Z")]

    until = time.monotonic() + 5.0
    while running():
        assert time.monotonic() < until, running()
        time.sleep(0.05)
    left = data_of(folder)
    sweep(LONGER, folder, workers=1)
    assert data_of(folder) == uninterrupted and left.items() <= uninterrupted.items()
