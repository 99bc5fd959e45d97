"""How Sphinx makes the site: Markdown by MyST, the API from docstrings, equations that need no network."""

from __future__ import annotations

import re
import sys
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode
from latex2mathml.converter import convert
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent.parent))

project = "Recoil"
author = "Recoil maintainers"
copyright = author  # noqa: A001 - the name is Sphinx's
version = release = version_of("recoil")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosectionlabel"]
autosectionlabel_prefix_document = True
exclude_patterns = ["_build", "examples", "notebooks", "pictures"]
suppress_warnings = [
    "autosectionlabel.*",  # pages that repeat a title are linked as a whole
]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 4

smartquotes = False  # `--from` in a help text is no dash

html_theme = "furo"
html_title = f"Recoil {version}"
html_math_renderer = "mathml"
html_copy_source = False
html_static_path = ["static"]
html_css_files = ["recoil.css"]
pygments_style = "default"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "undoc-members": False}


def _math(visitor: Any, node: Any, display: str) -> None:
    visitor.body.append(convert(node.astext(), display=display))


def _inline(visitor: Any, node: Any) -> None:
    _math(visitor, node, "inline")
    raise SkipNode


def _block(visitor: Any, node: Any) -> None:
    _math(visitor, node, "block")
    raise SkipNode


def _as_code(_app: Sphinx, _what: str, _name: str, _obj: object, _options: object, lines: list[str]) -> None:
    """Docstrings write code in single backticks, as Markdown does, and |d| for an absolute value."""
    lines[:] = [re.sub(r"(?<![`:])`([^`]+)`(?!`)", r"``\1``", line.replace("|", "\\|")) for line in lines]


CAPTIONS = {
    "file": "the file {}",
    "more": "at the end of {}",
    "set": "to change in {}",
    "hardware": "needs a gun, a display or a person",
    "output": "it prints",
}
"""What stands over a block, by the word behind its language (`docs/run_blocks.py`)."""


def _captions(_app: Sphinx, _name: str, source: list[str]) -> None:
    """Say over each block which file it is, or what it needs."""

    def captioned(fence: re.Match[str]) -> str:
        indent, language, word, name = fence.groups()
        caption = CAPTIONS[word].format(name)
        return f"{indent}```{{code-block}} {language}\n{indent}:caption: {caption}\n\n"

    fences = re.compile(rf"^( *)```(\w+) ({'|'.join(CAPTIONS)})(?:=(\S+))?.*\n", re.MULTILINE)
    source[0] = fences.sub(captioned, source[0])


def setup(app: Sphinx) -> None:
    """Add what Sphinx does not have: MathML, and docstrings with Markdown's backticks."""
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_block, None))
    app.connect("source-read", _captions)
    app.connect("autodoc-process-docstring", _as_code)
