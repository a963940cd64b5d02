"""MkDocs hooks: files of the repository outside docs/ that pages link to become part of the site.

A page links to them as GitHub needs it, such as `../sweeps/figure6.yaml`; in the site they lie in `repository/`.
Docstrings lose the roles that only Sphinx knows.
"""

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
FOLDER = "repository"
ROLE = re.compile(r":(?:attr|class|data|func|meth|mod):(?=<code>|`)")
LINK = re.compile(r"\]\(((?:\.\./)+)([^)#]+)")


def outside(page: str, target: str) -> str | None:
    """Path in the repository of a link's target, None if that lies in docs/.

    Args:
        page: the page, relative to docs/.
        target: what it links to, relative to the page's folder.
    """
    path = (ROOT / "docs" / page).parent / target
    if path.resolve().is_relative_to(ROOT / "docs") or not path.resolve().is_relative_to(ROOT):
        return None
    return path.resolve().relative_to(ROOT).as_posix()


def on_files(files: Files, config: Any) -> Files:
    """Add the files that pages link to."""
    wanted = set()
    for page in files.documentation_pages():
        for match in LINK.finditer(page.content_string):
            path = outside(page.src_uri, match[1] + match[2])
            if path is not None and (ROOT / path).is_file():
                wanted.add(path)
    for path in sorted(wanted):
        files.append(File.generated(config, f"{FOLDER}/{path}", abs_src_path=str(ROOT / path)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Lead links that leave docs/ to `repository/`, and those of a page from there back to docs/."""
    source = page.file.src_uri
    if source.startswith(f"{FOLDER}/"):
        return markdown.replace("](docs/", "](../").replace("](README.md", "](../index.md")
    up = "../" * source.count("/")

    def moved(match: re.Match[str]) -> str:
        path = outside(source, match[1] + match[2])
        return match[0] if path is None else f"]({up}{FOLDER}/{path}"

    return LINK.sub(moved, markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Take Sphinx roles away."""
    return ROLE.sub("", html)
