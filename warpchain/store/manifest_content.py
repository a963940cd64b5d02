"""The content of sweep.json, read as if anybody had written it: its checksum, its types, and whether it agrees.

A manifest repeats what its sweep gives, for people and other programs: name, seed, blocks, number of walks, digests.
What is repeated is computed again when the file is read.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, Field

from warpchain.files import version_refusal
from warpchain.hdf5_files import open_regular
from warpchain.inputs.distributions import DRAWABLE, LARGEST_SEED
from warpchain.inputs.sections import SECTION_OF
from warpchain.inputs.validation import STRICT, DamagedFileError, InputError
from warpchain.sweeps.designs import SAMPLERS, walks_per_sample

FORMAT: Final = "warpchain sweep"
FORMAT_VERSION: Final = 5
"""Of the manifest and of the shards."""

MOST_BYTES: Final = 2**24
"""Size of the largest sweep.json that is read; 12 axes of 10,000 values take 3 MB."""
MOST_WALKS: Final = 2**24
"""Walks of the largest sweep that is read: some 700 bytes each have to fit into memory."""

_CHECKSUM: Final = "sha256"
_Count = Annotated[int, Field(ge=1, le=MOST_WALKS)]
_Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class _Choice(BaseModel):
    model_config = STRICT
    interval: Annotated[float, Field(gt=0)]
    samples: Literal["all"] | list[Annotated[int, Field(ge=0)]]
    before: Annotated[float, Field(ge=0)] = 0.0


class _Record(BaseModel):
    model_config = STRICT
    series: Literal[False] | _Choice = False
    frames: Literal[False] | _Choice = False


class _Block(BaseModel):
    model_config = STRICT | {"extra": "allow"}
    name: str
    samples: _Count
    sampler: Literal[*SAMPLERS]  # type: ignore[valid-type]
    distributions: dict[Literal["all", *DRAWABLE], Any]  # type: ignore[valid-type]
    grid: dict[Literal["preset", *SECTION_OF], Annotated[list[bool | int | float | str | None], Field(min_length=1)]]  # type: ignore[valid-type]


class _Sweep(BaseModel):
    model_config = STRICT | {"extra": "allow"}
    name: str
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)]
    record: _Record = _Record()
    blocks: Annotated[list[_Block], Field(min_length=1)]


class _Generation(BaseModel):
    model_config = STRICT
    digest: _Digest
    samples: list[_Count]
    shard_size: _Count


class _Content(BaseModel):
    """What `Manifest` does not compute from other content."""

    model_config = STRICT | {"extra": "ignore"}
    digest: _Digest
    numerics_version: int
    shard_size: _Count
    sweep: _Sweep
    versions: dict[str, str]
    earlier: Annotated[list[_Generation], Field(max_length=1000)]


def with_checksum(content: Mapping[str, Any]) -> dict[str, Any]:
    """A manifest's content with format, version and checksum."""
    whole = {"format": FORMAT, "format_version": FORMAT_VERSION, **content}
    return {**whole, _CHECKSUM: _checksum(whole)}


def _checksum(content: Mapping[str, Any]) -> str:
    """SHA-256 of the shortest JSON with sorted keys."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def read_content(path: Path) -> dict[str, Any]:
    """The content of a sweep.json, of the right types and with the right checksum.

    Raises:
        OSError: it cannot be read.
        InputError: it belongs to another version of warpchain, is too large or no file.
        DamagedFileError: it is damaged, or not of warpchain.
    """
    with open_regular(path) as file:
        text = file.read(MOST_BYTES + 1)
    if len(text) > MOST_BYTES:
        raise InputError(f"{path}: over {MOST_BYTES} bytes, the limit of a sweep.json; give the folder of a sweep")
    try:
        content: dict[str, Any] = json.loads(text)
        if content["format"] != FORMAT:
            raise KeyError("format")
        refusal = version_refusal(content["format_version"], FORMAT_VERSION, "run it again in another folder")
        if refusal:
            raise InputError(f"{path}: {refusal}")
        given = content.pop(_CHECKSUM)
        if given != _checksum(content):
            raise damaged(path, "its checksum is wrong")
        _Content.model_validate(content)
        walks = sum(walks_of(block) for block in content["sweep"]["blocks"])
        if walks > MOST_WALKS:
            raise InputError(f"{path}: declares {walks} walks; a sweep has at most {MOST_WALKS}")
    except InputError:
        raise
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise damaged(path) from None
    return {name: value for name, value in content.items() if name not in ("format", "format_version")}


def walks_of(block: Mapping[str, Any]) -> int:
    """Number of walks of a block, given its canonical form."""
    cells = math.prod(len(values) for values in block["grid"].values())
    return cells * samples_of(block)


def samples_of(block: Mapping[str, Any]) -> int:
    """Walks in each cell of a block, given its canonical form."""
    drawn = block["distributions"].keys() - {"all"}
    return int(block["samples"]) * walks_per_sample(block["sampler"], len(drawn))


def damaged(path: Path, why: str = "") -> DamagedFileError:
    """The error of a damaged sweep.json, and why it is thought to be."""
    shown = f" ({why})" if why else ""
    return DamagedFileError(
        f"{path}: damaged, or not of warpchain{shown}; give the folder of a sweep, or put a copy of the file there"
    )
