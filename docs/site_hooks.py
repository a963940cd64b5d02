"""MkDocs hooks: studies, notebooks, and files of the repository that pages link to, become part of the site.

Pages link as GitHub needs it, such as `../sweeps/figure6.yaml`. In the site files of docs/ lie at the top, studies in
`studies/`, all others in `repository/`; `live/` has walks that are computed for it. Formulas become MathML, which needs
no script.
"""

import inspect
import json
import os
import re
import tempfile
from pathlib import Path
from typing import Any

from griffe import Extension, Function, Parameter, ParameterKind, Parameters
from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

import warpchain
from warpchain.live_page.export import export_page

ROOT = Path(__file__).parents[1]
ROLE = re.compile(r":(?:attr|class|data|func|meth|mod):(?=<code>|`)")
LINK = re.compile(r"\]\(((?!\w+:)[^)#\s]+)")
WHOLE = re.compile(
    r"(<(?:code|pre|math|script|style|svg|title)\b.*?</(?:code|pre|math|script|style|svg|title)>|<[^>]+>)", re.S
)
"""What has no subscripts: code, formulas, tags."""
SUBSCRIPT = re.compile(r"(?<![\w.])([^\W\d_][\u0302-\u0308]?)_(?:\{([^}]+)\}|([a-zA-Z]+|\d)(?![a-zA-Z0-9_(]|\.\w))")


class Signatures(Extension):
    """Shows the fields that `walk`, `sweep` and `simulate` take as keywords, which their source has not one by one."""

    def on_function(self, *, func: Function, **_: Any) -> None:
        """Replace the parameters of the source by those that `inspect.signature` finds."""
        if any("takes_fields" in str(each.value) for each in func.decorators):
            found = inspect.signature(getattr(warpchain, func.name)).parameters.values()
            func.parameters = Parameters(
                *(
                    Parameter(
                        each.name,
                        annotation=str(each.annotation),
                        kind=ParameterKind(each.kind.description),
                        default=None if each.default is each.empty else repr(each.default),
                    )
                    for each in found
                )
            )


def in_site(path: str) -> str:
    """Where a file of the repository is in the site."""
    if path == "README.md":
        return "index.md"
    path = re.sub(r"\.ipynb$", ".md", path)
    return path.removeprefix("docs/") if path.startswith(("docs/", "studies/")) else f"repository/{path}"


def in_repository(uri: str) -> str:
    """Where a file of the site is in the repository."""
    return uri.removeprefix("repository/") if uri.startswith(("repository/", "studies/")) else f"docs/{uri}"


def linked(page: str, target: str) -> str:
    """What a link of a page leads to; both are paths in the repository."""
    return os.path.normpath(os.path.join(os.path.dirname(page), target))


def notebook_page(notebook: Path) -> str:
    """A notebook as Markdown: its texts, code and outputs."""
    parts = []
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", ()):
            data = {kind: "".join(text) for kind, text in output.get("data", {}).items()}
            image = f'<img alt="" src="data:image/png;base64,{data.get("image/png", "").strip()}">'
            if "text/html" in data or "image/png" in data:
                parts.append(f'<div class="output">{data.get("text/html", image)}</div>')
            else:
                parts.append("```text\n" + (data.get("text/plain") or "".join(output["text"])).rstrip() + "\n```")
    return "\n\n".join([*parts, f"[This page as a notebook]({notebook.name})"])


def on_config(config: Any) -> Any:
    """Fences of the language math are formulas."""

    def formula(source: str, *_: Any, **__: Any) -> str:
        return f'<div class="formula">{convert(source, display="block")}</div>'

    fences = config.mdx_configs["pymdownx.superfences"]["custom_fences"]
    fences.append({"name": "math", "class": "math", "format": formula})
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the page of walks without a server, the notebooks, the pages of the studies, and all that pages link to."""
    with tempfile.TemporaryDirectory() as folder:
        walks = export_page(Path(folder)).read_text(encoding="utf-8")
    files.append(File.generated(config, "live/index.html", content=walks))
    for path in sorted([*ROOT.glob("docs/notebooks/*.ipynb"), *ROOT.glob("studies/*/*.ipynb")]):
        page = in_site(path.relative_to(ROOT).as_posix())
        files.append(File.generated(config, page, content=notebook_page(path)))
        if path.is_relative_to(ROOT / "studies"):
            files.append(File.generated(config, page.removesuffix("md") + "ipynb", abs_src_path=str(path)))
    waiting = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.glob("studies/**/README.md"))
    waiting += [
        linked(in_repository(page.src_uri), match[1])
        for page in files.documentation_pages()
        for match in LINK.finditer(page.content_string)
    ]
    while waiting:
        path = waiting.pop()
        if files.get_file_from_path(in_site(path)) is not None or not (ROOT / path).is_file():
            continue
        files.append(File.generated(config, in_site(path), abs_src_path=str(ROOT / path)))
        if path.startswith("studies/") and path.endswith(".md"):
            text = (ROOT / path).read_text(encoding="utf-8")
            waiting += [linked(path, match[1]) for match in LINK.finditer(text)]
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Lead links to where files are in the site."""
    source = in_repository(page.file.src_uri)
    folder = os.path.dirname(page.file.src_uri) or "."

    def moved(match: re.Match[str]) -> str:
        path = linked(source, match[1])
        # The page of a notebook links to the notebook itself.
        stays = not (ROOT / path).is_file() or path == source.removesuffix(".md") + ".ipynb"
        return match[0] if stays else f"]({os.path.relpath(in_site(path), folder)}"

    return LINK.sub(moved, markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Take Sphinx roles away, and set subscripts such as that of `ω_c`."""
    parts = WHOLE.split(ROLE.sub("", html))  # texts, and between them what has no subscripts
    parts[::2] = [SUBSCRIPT.sub(r"\1<sub>\2\3</sub>", text) for text in parts[::2]]
    return "".join(parts)
