"""Places where a sweep can run, each named by a word: a number of processor cores, a GPU, several GPUs."""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import warp as wp

from warpchain.engine.devices import start_device
from warpchain.engine.processors import processors
from warpchain.inputs.validation import InputError, shown
from warpchain.run.sweep_run import on_device
from warpchain.sweeps.plan import Sweep, load_sweep

PLACE: Final = re.compile(r"(?:(\d{1,4})x)?(cpu|cuda(?::\d{1,3})?)(?:@(\d{1,9}))?")


@dataclass(frozen=True)
class Place:
    """Where a sweep runs.

    Attributes:
        name: As given on the command line.
        device: ``"cpu"``, ``"cuda"`` or ``"cuda:N"``.
        threads: Threads of this process that run shards; None: the default of a sweep.
        processes: Worker processes, each with a GPU of its own; 0: the sweep runs in this process.
        samples: Samples per cell; None: as the sweep says.
    """

    name: str
    device: str
    threads: int | None = None
    processes: int = 0
    samples: int | None = None

    @classmethod
    def parse(cls, text: str, samples: int | None = None) -> "Place":
        """Read ``cpu``, ``4xcpu``, ``cuda``, ``cuda:1`` or ``2xcuda``, with ``@N`` for N samples per cell.

        Args:
            text: The place.
            samples: Per cell where the place does not say; None: as the sweep says.

        Raises:
            InputError: It cannot be read, or this machine has no such place.
        """
        found = PLACE.fullmatch(text)
        if found is None:
            given = re.fullmatch(r"cpu:(\d+)(@\d+)?", text)
            hint = f"give {given[1]}xcpu" if given else "give such as cpu, 4xcpu, cuda, cuda:1, 2xcuda or cpu@2"
            raise InputError(f"--devices: {shown(text)} is no place to run on; {hint}")
        count, device = None if found[1] is None else int(found[1]), found[2]
        own = samples if found[3] is None else int(found[3])
        if count == 0 or own == 0:
            raise InputError(f"--devices: {shown(text)} asks for none; give numbers from 1")
        if count is not None and device.startswith("cuda:"):
            raise InputError(f"--devices: {shown(text)}: {device} is one GPU; give {device}, or {count}xcuda")
        start_device(device)
        if device == "cpu":
            if (count or 1) > (there := processors()):
                raise InputError(f"--devices: {shown(text)}, but there are {there} processors; give no more")
            return cls(text.removeprefix("1x"), device, threads=count or 1, samples=own)
        if (count or 1) > (gpus := wp.get_cuda_device_count()):
            raise InputError(f"--devices: {shown(text)}, but there are {gpus} GPUs; give no more")
        return cls(text, device, processes=count or 0, samples=own)

    @property
    def folder(self) -> str:
        """Name of its folder."""
        return self.name.replace(":", "-")

    def planned(self, source: Sweep) -> Sweep:
        """The sweep as it runs here; a word such as ``standard`` is the method that it means on this device.

        Raises:
            InputError: The sweep cannot have so many samples, or cannot run on this device.
        """
        canonical = on_device(source, self.device).canonical()  # with the names of methods instead of words
        for block in canonical["blocks"]:
            block["samples"] = self.samples or block["samples"]
        return load_sweep(canonical)


def places_of(texts: Sequence[str], samples: int | None = None) -> list[Place]:
    """The places of a list, see :meth:`Place.parse`.

    Raises:
        InputError: One cannot be read, is not there, or is given twice.
    """
    places = [Place.parse(text, samples) for text in texts]
    for one, other in itertools.combinations(places, 2):
        if one.folder == other.folder:
            raise InputError(f"--devices: {shown(one.name)} is given twice; leave one out")
    return places
