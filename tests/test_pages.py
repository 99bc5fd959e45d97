"""The pages under docs and the README: what fails in them is named, and nothing of the program is missing from them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from docs import generate, run_blocks
from docs.run_blocks import BlockError, Reader

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")

FAILING = [
    ("bash", "false", "page.md:5: exit code 1"),
    ("bash exit=2", "true", "page.md:5: exit code 0"),
    ("python", "1 / 0", "ZeroDivisionError"),
    ("text output", "other", "printed was"),
    ("toml", "a = ", "page.md:5: no TOML"),
    ("toml set=there.toml", "[table]\nb = 2", "has no line that begins with '[table]'"),
    ("ruby", "puts 1", "nothing runs a block of 'ruby'"),
    ("bash hardware", "recoil rum direction", "there is no command 'rum'"),
    ("bash hardware", "recoil run direction --gin x", "`recoil run` has no option --gin"),
    ("bash make", "make coffee", "the Makefile has no target 'coffee'"),
    ("text message", "the gun is out of ... coffee", "nothing in the program says"),
]


def follow(text: str, folder: Path) -> None:
    reader = Reader(folder)
    for block in run_blocks.blocks(Path("page.md"), text):
        reader.follow(block)


@pytest.mark.slow
@pytest.mark.parametrize(("words", "code", "said"), FAILING)
def test_a_block_that_fails_is_named_with_page_and_line(words: str, code: str, said: str, tmp_path: Path) -> None:
    folder = tmp_path / "scratch"
    folder.mkdir()
    (folder / "there.toml").write_text("a = 1\n")
    with pytest.raises(BlockError, match=re.escape(said)) as failed:
        follow(f"# Page\n\nText.\n```{words}\n{code}\n```\n", folder)
    assert str(failed.value).startswith("page.md:5: ")


def test_a_reader_goes_on_where_the_block_before_left_and_edits_files(tmp_path: Path) -> None:
    folder = tmp_path / "scratch"
    folder.mkdir()
    follow(
        "```bash\nmkdir inner\ncd inner\n```\n"
        "```toml file=a.toml\n[one]\nkey = 1\n[two]\nkey = 1\n```\n"
        "```toml set=a.toml\n[two]\nkey = 2\n```\n"
        "```python\nfrom pathlib import Path\nprint(Path('a.toml').read_text())\n```\n"
        "```text output\n[one]\nkey = 1\n...\nkey = 2\n```\n",
        folder,
    )
    assert (folder / "inner" / "a.toml").exists()


def test_a_block_without_an_end_and_a_command_in_the_text_that_there_is_not_are_named() -> None:
    with pytest.raises(BlockError, match=r"page.md:2: the block has no end"):
        list(run_blocks.blocks(Path("page.md"), "text\n```bash\ntrue\n"))
    with pytest.raises(BlockError, match=r"page.md:2: there is no command 'rum'"):
        run_blocks.check_text(Path("page.md"), "text\nSee `recoil rum`.\n")


@pytest.mark.slow
def test_every_key_has_a_meaning_and_every_command_an_example() -> None:
    assert {"commands.md", "columns.md", "statistics.md", "config-design.md"} <= generate.pages().keys()


def test_the_readme_is_one_page_whose_links_lead_somewhere() -> None:
    assert len(README.splitlines()) <= 120
    links = [link for link in re.findall(r"\]\(([^)#]+)", README) if "://" not in link]
    assert [link for link in links if not (ROOT / link).exists()] == []
