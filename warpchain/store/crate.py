"""Where and when a sweep was run: ro-crate-metadata.json in its folder, which archives and search engines read.

The file is an RO-Crate 1.1 (https://w3id.org/ro/crate/1.1) in JSON-LD: the folder with its files, warpchain with its
versions, and an action for each run with its command, its times and its machines. It is outside of what is equal to the
byte for equal sweeps, like log.txt. What somebody adds to it, such as authors and a licence, stays there.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from warpchain.files import AnyPath, naming, now, write_whole
from warpchain.hdf5_files import SWEEP_FILE
from warpchain.inputs.validation import InputError
from warpchain.store.shards import CRATE, Manifest

_PROFILE: Final = "https://w3id.org/ro/crate/1.1"
_PARTS: Final = {SWEEP_FILE: "File", "sweep.yaml": "File", "shards/": "Dataset"}
_RUN: Final = "#run-"


def entities(directory: AnyPath) -> dict[str, dict[str, Any]]:
    """The entities of a folder's crate by their names, none if it has no crate; an `InputError` if it is none."""
    path = Path(directory) / CRATE
    try:
        with naming(path, "read"):
            graph = json.loads(path.read_text(encoding="utf-8"))["@graph"]
        return {str(each["@id"]): dict(each) for each in graph}
    except FileNotFoundError:
        return {}
    except (ValueError, TypeError, KeyError, RecursionError):
        raise InputError(f"{path}: expected an RO-Crate in JSON; move it out of this folder") from None


def runs(directory: AnyPath) -> list[dict[str, str]]:
    """The runs of a sweep, each with its `command`, `start`, `end` if it came to its end, and `machines`."""
    named = {"command": "name", "start": "startTime", "end": "endTime", "machines": "description"}
    own = [each for name, each in entities(directory).items() if name.startswith(_RUN)]
    return [{name: str(each[key]) for name, key in named.items() if key in each} for each in own]


def write_crate(
    directory: Path,
    manifest: Manifest,
    command: str,
    machines: Sequence[str],
    *,
    is_new: bool = False,
    is_over: bool = False,
) -> None:
    """Add a run that begins to a folder's crate, or machines and end to the last run; who calls holds the folder.

    The machines are those that have computed walks in this run. An `OSError` says that the file cannot be written.
    """
    graph, moment = entities(directory), now()

    def put(entity: str, kind: str, **values: Any) -> None:
        graph[entity] = {**graph.get(entity, {}), "@id": entity, "@type": kind, **values}

    names = [name for name in graph if name.startswith(_RUN)]
    if is_new or not names:
        names.append(f"{_RUN}{len(names) + 1}")
        used: dict[str, Any] = {"instrument": _id("#warpchain"), "object": _id("sweep.yaml")}
        used["result"] = [_id(SWEEP_FILE), _id("shards/")]
        put(names[-1], "CreateAction", name=command, startTime=moment, **used)
    graph[names[-1]]["description"] = " | ".join(machines) or "no worker has named its machine yet"
    if is_over:
        graph[names[-1]]["endTime"] = moment
    walks = f"{manifest.sweep.walk_count:,} walks of roller chains, simulated by warpchain"
    if manifest.sweep.has_rounds:
        walks = f"at most {walks}"
    put(CRATE, "CreativeWork", about=_id("./"), conformsTo=_id(_PROFILE))
    put("./", "Dataset", name=manifest.sweep.name, description=walks, datePublished=moment[:10])
    put("./", "Dataset", hasPart=list(map(_id, _PARTS)), mentions=list(map(_id, names)))
    for name, kind in _PARTS.items():
        put(name, kind, name=name)
    needed = ", ".join(f"{name} {version}" for name, version in manifest.versions.items())
    own = manifest.versions.get("warpchain", "unknown")
    put("#warpchain", "SoftwareApplication", name="warpchain", softwareVersion=own, softwareRequirements=needed)
    content = {"@context": f"{_PROFILE}/context", "@graph": list(graph.values())}
    write_whole(directory / CRATE, json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def _id(name: str) -> dict[str, str]:
    """A reference to an entity."""
    return {"@id": name}
