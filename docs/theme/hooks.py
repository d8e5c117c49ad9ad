"""What MkDocs does not do by itself: pages made of files outside docs/, and links to them.

`CHANGELOG.md`, `CONTRIBUTING.md` and the programs of `examples/` are pages of the site. A link is
written as it works in a checkout and leads to the page of the site; one that leads nowhere fails the build.
"""

import ast
import fnmatch
import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = {
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    **{f"examples/{path.name}": f"examples/{path.stem}.md" for path in (ROOT / "examples").glob("*.py")},
}
LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)#\s]+)")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Write out the entries of the menu that stand for all pages of a folder."""
    config.nav = written_out(config.nav)
    return config


def written_out(nav: Any) -> Any:
    """A menu in which every ``folder/*.md`` is the list of its pages."""
    if isinstance(nav, dict):
        return {title: written_out(part) for title, part in nav.items()}
    if isinstance(nav, list):
        return [written_out(part) for part in nav]
    written = [path.relative_to(DOCS).as_posix() for path in DOCS.glob(nav)]
    return sorted([*written, *fnmatch.filter(PAGES.values(), nav)]) if "*" in nav else nav


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made of files outside docs/."""
    for source, page in PAGES.items():
        if page != "index.md":
            text = (ROOT / source).read_text(encoding="utf-8")
            content = program_page(source, text) if source.endswith(".py") else text
            files.append(File.generated(config, page, content=content))
    return files


def program_page(source: str, text: str) -> str:
    """A program: what it says it does, then itself."""
    title, _, rest = (ast.get_docstring(ast.parse(text)) or source).partition("\n")
    return f'# {title.rstrip(".")}\n\n{rest.strip()}\n\n```python title="{source}"\n{text}```\n'


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links as they work in a checkout into links between pages."""
    here = page.file.src_uri
    source = next((source for source, made in PAGES.items() if made == here), f"docs/{here}")
    return LINK.sub(
        lambda link: linked(link[1], posixpath.dirname(source), posixpath.dirname(here)), markdown
    )


def linked(target: str, source: str, here: str) -> str:
    """Where a link leads on the site; as it was, for the build to refuse, if nowhere.

    Args:
        target: As written.
        source: Folder of the file in the checkout in which it is written.
        here: Folder of its page under docs/.
    """
    path = posixpath.normpath(posixpath.join(source, target))
    page = PAGES.get(path, path.removeprefix("docs/") if path.startswith("docs/") else None)
    return target if page is None else posixpath.relpath(page, here or ".")
