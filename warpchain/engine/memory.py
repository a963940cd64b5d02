"""Memory: what a chain takes on a device, and how many chains fit."""

from warpchain.engine.devices import Device, Gpu, start_device
from warpchain.engine.kernel_choice import block_threads, resident_blocks
from warpchain.inputs.options import Options
from warpchain.kernels import layout
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.cpu import rows as cpu_rows
from warpchain.kernels.gpu import functions as gpu_functions
from warpchain.kernels.types import CHAIN_DOUBLES

WORLDS_OF_BLOCK = 2
"""Chains under way for each block that a GPU holds: while some are with the host, the others fill it.

With more, every walk takes longer, and so does the end of a run, when the GPU empties.
"""
CAPACITY_SAMPLES = 512
"""Samples of a chain that a device can hold between two launches, if the time series is kept."""
CAPACITY_FRAMES = 64
"""Frames of a chain that a device can hold between two launches, if frames are kept."""


def scratch_rows(options: Options, longest: int, device: Device, threads: int | None = None) -> int:
    """Rows of a chain's scratch on a device, for chains of up to this many links; ``threads`` as in a batch."""
    columns = layout.padded_width(longest)
    if isinstance(device, Gpu):
        return gpu_functions.board_rows(threads or block_threads(longest), columns)
    return cpu_rows.scratch_rows(options.method, columns)


def world_bytes(
    longest: int,
    options: Options,
    samples: int,
    frames: int,
    device: Device,
    keeps_loads: bool = False,
    tilts: bool = False,
    faces: int = 1,
) -> int:
    """Memory [B] that a batch takes on a device for each of its worlds.

    Args:
        longest: Greatest number of links.
        options: Options of the batch.
        samples: Capacity of the time series.
        frames: Capacity of the frames.
        device: Device of the batch.
        keeps_loads: Whether loads of joints are kept with the frames.
        tilts: Whether the plane of the chain is kept with samples and frames.
        faces: Most faces of a floor.
    """
    columns = layout.padded_width(longest)
    few = CHAIN_DOUBLES + 144  # numbers of a world in model, drive and state, beside these tables
    few += layout.PLANE_ROWS + layout.MOTION_ROWS * layout.MOTION_VALUES
    numbers = columns * scratch_rows(options, longest, device) + (6 + layout.LINK_ROWS) * longest + few
    numbers += faces * layout.FACE_VALUES + (faces > 1) * (layout.GROUND_CELLS + 1) * layout.CELL_VALUES
    numbers += samples * (layout.ALL_COLUMNS if tilts else layout.SAMPLE_COLUMNS)
    numbers += frames * ((2 + 3 * keeps_loads) * longest + layout.PLANE_VALUES * tilts + 1)
    return 8 * numbers + 4 * list_layout(columns).size


def most_worlds(
    longest: int,
    options: Options,
    *,
    keeps_samples: bool,
    keeps_frames: bool,
    keeps_loads: bool = False,
    tilts: bool = False,
    faces: int = 1,
    threads: int | None = None,
) -> int:
    """Chains that a GPU should carry on together: enough to fill it that fit into half of the free memory.

    The other half is left to others, such as batches of other threads.
    """
    device = start_device(options.device)
    assert isinstance(device, Gpu)
    samples, frames = CAPACITY_SAMPLES * keeps_samples, CAPACITY_FRAMES * keeps_frames
    taken = world_bytes(longest, options, samples, frames, device, keeps_loads, tilts, faces)
    fitting = device.free_memory // 2 // taken
    filling = WORLDS_OF_BLOCK * resident_blocks(threads or block_threads(longest)) * device.multiprocessors
    return max(1, min(filling, fitting))
