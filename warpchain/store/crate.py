"""Where and when a sweep was run: ro-crate-metadata.json in its folder, which archives and search engines read.

The file is an RO-Crate 1.1 (https://w3id.org/ro/crate/1.1) in JSON-LD: the folder with its files, warpchain with its
versions, and an action for each run with its command, its times and its machine. It is outside of what is equal to the
byte for equal sweeps, like log.txt. What somebody adds to it, such as authors and a licence, stays there.
"""

import datetime
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from warpchain.files import AnyPath, naming, write_whole
from warpchain.hdf5_files import SWEEP_FILE
from warpchain.inputs.validation import InputError
from warpchain.store.shards import CRATE, Manifest

_CONTEXT: Final = "https://w3id.org/ro/crate/1.1/context"
_RUN: Final = "#run-"


def now() -> str:
    """The time in the notation of ISO 8601, to a second."""
    return datetime.datetime.now().astimezone().isoformat(timespec="seconds")


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


def runs(directory: AnyPath) -> list[dict[str, Any]]:
    """The runs of a sweep, each with name (its command), startTime, endTime if it came to its end, and description."""
    return [each for name, each in entities(directory).items() if name.startswith(_RUN)]


def write_crate(directory: Path, manifest: Manifest, run: Mapping[str, str], *, is_over: bool = False) -> None:
    """Add a run that begins to a folder's crate, or its end to the last run; who calls holds the folder.

    `run` has the command of the run, and what names its machine. An `OSError` says that the file cannot be written.
    """
    known, moment = entities(directory), now()
    names = [name for name in known if name.startswith(_RUN)]
    if is_over and names:
        known[names[-1]]["endTime"] = moment
    else:
        names.append(f"{_RUN}{len(names) + 1}")
        machine = "; ".join(f"{name}: {value}" for name, value in run.items() if name != "command")
        known[names[-1]] = {
            **{"@id": names[-1], "@type": "CreateAction", "name": run["command"], "description": machine},
            **{"startTime": moment, "instrument": {"@id": "#warpchain"}},
            **{"object": {"@id": "sweep.yaml"}, "result": [{"@id": SWEEP_FILE}, {"@id": "shards/"}]},
        }
    versions = ", ".join(f"{name} {version}" for name, version in manifest.versions.items())
    parts = {SWEEP_FILE: "File", "sweep.yaml": "File", "shards/": "Dataset"}
    most = "at most " * manifest.sweep.has_rounds
    walks = f"{most}{manifest.sweep.walk_count:,} walks of roller chains, simulated by warpchain"
    ours: dict[str, dict[str, Any]] = {
        CRATE: {
            **{"@type": "CreativeWork", "about": {"@id": "./"}},
            "conformsTo": {"@id": _CONTEXT.removesuffix("/context")},
        },
        "./": {"@type": "Dataset", "name": manifest.sweep.name, "description": walks, "datePublished": moment[:10]},
        **{name: {"@type": kind, "name": name} for name, kind in parts.items()},
        "#warpchain": {
            **{"@type": "SoftwareApplication", "name": "warpchain", "softwareRequirements": versions},
            "softwareVersion": manifest.versions.get("warpchain", "unknown"),
        },
    }
    found = {name: {**known.pop(name, {}), "@id": name, **own} for name, own in ours.items()}
    found["./"] |= {"hasPart": [{"@id": name} for name in parts], "mentions": [{"@id": name} for name in names]}
    content = {"@context": _CONTEXT, "@graph": [*found.values(), *known.values()]}
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    write_whole(directory / CRATE, text)
