"""MkDocs hooks: studies, and files of the repository that pages link to, become part of the site.

Pages link as GitHub needs it, such as `../sweeps/figure6.yaml`. In the site files of docs/ lie at the top, studies in
`studies/`, all others in `repository/`. Docstrings lose the roles that only Sphinx knows.
"""

import os
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
ROLE = re.compile(r":(?:attr|class|data|func|meth|mod):(?=<code>|`)")
LINK = re.compile(r"\]\(((?!\w+:)[^)#\s]+)")


def in_site(path: str) -> str:
    """Where a file of the repository is in the site."""
    if path == "README.md":
        return "index.md"
    return path.removeprefix("docs/") if path.startswith(("docs/", "studies/")) else f"repository/{path}"


def in_repository(uri: str) -> str:
    """Where a file of the site is in the repository."""
    return uri.removeprefix("repository/") if uri.startswith(("repository/", "studies/")) else f"docs/{uri}"


def linked(page: str, target: str) -> str:
    """What a link of a page leads to; both are paths in the repository."""
    return os.path.normpath(os.path.join(os.path.dirname(page), target))


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of the studies, and all that pages link to."""
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
        return f"]({os.path.relpath(in_site(path), folder)}" if (ROOT / path).is_file() else match[0]

    return LINK.sub(moved, markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Take Sphinx roles away."""
    return ROLE.sub("", html)
