"""What README, docs/, studies/ and CITATION.cff say of the project is so."""

import importlib.util
import json
import re
import tomllib
from pathlib import Path
from types import ModuleType

import pytest
import yaml

import warpchain
from tests.docs.code_blocks import PAGES, ROOT, name_of
from tests.support.same_walks import GOLDEN, processor
from warpchain.inputs.methods import METHODS
from warpchain.version import VERSION


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    """The script that writes docs/reference/."""
    spec = importlib.util.spec_from_file_location("generate_reference", ROOT / "docs/generate_reference.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_reference_is_that_of_the_code(generator: ModuleType) -> None:
    """The committed pages are what `python docs/generate_reference.py` writes, and there are no others."""
    pages = generator.pages()
    assert {path.name for path in generator.FOLDER.iterdir()} == set(pages)
    for name, text in pages.items():
        committed = (generator.FOLDER / name).read_text(encoding="utf-8")
        assert committed == text, f"{name} is out of date; run python docs/generate_reference.py"
    assert generator.STUB.read_text(encoding="utf-8") == generator.stub(), "run python docs/generate_reference.py"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_to_files_and_headings(page: Path) -> None:
    """Each link to a file of the repository finds it, and the heading that it names."""
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        path, _, anchor = target.partition("#")
        if re.match(r"\w+:", target):
            continue
        file = (page.parent / path).resolve() if path else page
        assert file.is_relative_to(ROOT) and file.exists(), target
        assert not anchor or anchor in anchors(file), target


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_readme_has_the_numbers_of_its_first_command() -> None:
    """Δx of its walk as printed, on the kind of processor whose bits are known; elsewhere a walk may be another one."""
    given = re.search(r"`walk` also prints Δx = ([\d.]+) m", (ROOT / "README.md").read_text(encoding="utf-8"))
    if processor() != json.loads(GOLDEN.read_text(encoding="utf-8"))["processor"]:
        pytest.skip("bits of this processor are not known")
    walk = warpchain.walk(links=60, frequency=15.0, start="spinning", frame_interval=None)
    assert given is not None and f"{walk.dx:.2f}" == given[1]


@pytest.mark.slow
def test_readme_has_the_numbers_of_its_first_sweep(tmp_path: Path) -> None:
    """Mean and standard deviation of Δx for 60 links at 15 Hz, to three standard errors on any processor."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    given = re.search(r"For 60 links at 15 Hz it is ([\d.]+) ± ([\d.]+) m \(mean and standard deviation", text)
    result = warpchain.sweep("quickstart", tmp_path / "sweep", progress=False)
    found = result.cell_statistics()
    (cells,) = found.values()
    place = tuple(int((cells.axes[name] == value).argmax()) for name, value in (("links", 60), ("frequency", 15.0)))
    assert given is not None
    assert abs(cells.mean[place] - float(given[1])) < 3 * cells.standard_error[place] + 0.005


def test_the_table_of_integrators_has_them_all() -> None:
    """Who registers another one describes it there."""
    section = (ROOT / "docs/methods.md").read_text(encoding="utf-8").partition("\n## Integrators\n")[2]
    assert re.findall(r"^\| `(\w+)` \|", section.partition("\n#")[0], re.MULTILINE) == [*METHODS]


def test_metadata_for_archives_are_those_of_the_package() -> None:
    """codemeta.json and CITATION.cff have name, version, licence, keywords and paper of pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    meta = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert meta["version"] == cited["version"] == VERSION and meta["name"] == project["name"]
    assert meta["keywords"] == cited["keywords"] == project["keywords"]
    assert meta["license"].endswith(f"/{project['license']}") and cited["license"] == project["license"]
    paper = project["urls"]["Paper"]
    assert meta["referencePublication"]["@id"] == paper == f"https://doi.org/{cited['references'][0]['doi']}"
