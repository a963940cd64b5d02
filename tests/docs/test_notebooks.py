"""The notebooks of docs/ and studies/ run, and what is committed of them is small and of no particular machine."""

import json
import re
import shutil
from pathlib import Path

import pytest

from tests.docs.code_blocks import ROOT

NOTEBOOKS = [*sorted((ROOT / "docs/notebooks").glob("*.ipynb")), *sorted((ROOT / "studies").glob("*/*.ipynb"))]


SHORTER = {
    "samples=3,": "samples=1,",
    "np.arange(20, 61, 20)": "np.arange(20, 41, 20)",
    "[0.1, 0.2, 0.4, 0.8]": "[0.1, 0.4]",
    "samples=64,": "samples=40,",
}
"""What a notebook does for long, and what is run instead: fewer walks."""


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every cell runs without an error where notebooks are opened, in a copy of their own folder, without settings."""
    pytest.importorskip("ipykernel", reason="the extra `test` has it")
    nbclient = pytest.importorskip("nbclient", reason="the extra `test` has it")
    import nbformat

    monkeypatch.delenv("PYTHONPATH", raising=False)
    for part in ("docs", "studies"):
        shutil.copytree(ROOT / part, tmp_path / part)
    content = nbformat.read(notebook, as_version=4)
    for cell in content.cells:
        for longer, shorter in SHORTER.items():
            cell.source = cell.source.replace(longer, shorter)
    resources = {"metadata": {"path": str(tmp_path / notebook.parent.relative_to(ROOT))}}
    nbclient.NotebookClient(content, timeout=900, kernel_name="python3", resources=resources).execute()
    outputs = [output for cell in content.cells for output in cell.get("outputs", [])]
    assert outputs and not [output for output in outputs if output["output_type"] == "error"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_committed_notebook_was_run(notebook: Path) -> None:
    """All cells were run in order, from the first; there are outputs, no errors and no paths of a machine."""
    content = json.loads(notebook.read_text(encoding="utf-8"))
    cells = [cell for cell in content["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert outputs and all(output["output_type"] in ("display_data", "execute_result", "stream") for output in outputs)
    assert not [output for output in outputs if output.get("name") == "stderr"]
    assert not re.findall(r"(?<![\w.+/])/(?:home|root|tmp|work|Users|opt)/\w", json.dumps(outputs))
