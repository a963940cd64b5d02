"""What README, docs/, studies/ and CITATION.cff say of the project is so."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from tests.docs.code_blocks import PAGES, ROOT, name_of


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
