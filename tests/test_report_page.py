"""The report in a real browser: it opens without a network, and nothing is clipped, wide or narrow, light or dark."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from PIL import Image

from tests.waiting import PATIENCE_S

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [pytest.mark.slow, pytest.mark.skipif(BROWSER is None, reason="needs a Chromium")]

MEASURE = """<script>addEventListener("load", () => {
  const wide = [...document.querySelectorAll("body *")].filter(e =>
    e.getBoundingClientRect().right > innerWidth + 1 && !e.closest(".wide, .scroll, [class*=table]"));
  const broken = [...document.images].filter(i => !i.naturalWidth);
  document.title = `wide:${wide.map(e => e.tagName).join()} broken:${broken.length} images:${document.images.length}`;
});</script>"""


@pytest.fixture(scope="module")
def page(reproduction: Path) -> Path:
    return reproduction / "report.html"


def browse(page: Path, folder: Path, *words: str) -> str:
    """What headless Chromium says of a page, with every name resolved to nowhere."""
    switches = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync"]
    offline = ["--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={folder / 'profile'}"]
    command = [str(BROWSER), *switches, *offline, *words, page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    return done.stdout


def test_the_page_names_nothing_but_itself_and_the_files_beside_it(page: Path) -> None:
    named = re.findall(r"""(?:src|href)=["'](?!data:|#)([^"']*)""", page.read_text(encoding="utf-8"))
    assert named == ["statistics.json", "reconstructed_direction.csv", "reconstructed_preference.csv"]
    assert all((page.parent / name).is_file() for name in named)
    assert "<script" not in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("width", [1280, 500])
def test_nothing_sticks_out_and_every_figure_is_there(page: Path, tmp_path: Path, width: int) -> None:
    measured = tmp_path / "report.html"
    measured.write_text(page.read_text(encoding="utf-8") + MEASURE, encoding="utf-8")
    shown = browse(measured, tmp_path, "--dump-dom", f"--window-size={width},2000")
    assert "<title>wide: broken:0 images:6</title>" in shown


def test_what_is_wider_than_a_small_screen_says_that_it_scrolls(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    (sign,) = re.findall(r"@media \(max-width: 40rem\) \{\s*([^{]*)\{ content: \"([^\"]*)\"", text)
    assert "scroll" in sign[1]
    assert "figcaption::after" in sign[0]
    assert ".wide caption" in sign[0]


def test_the_page_is_painted_in_more_than_two_colours(page: Path, tmp_path: Path) -> None:
    picture = tmp_path / "report.png"
    browse(page, tmp_path, f"--screenshot={picture}", "--window-size=1280,3000")
    assert len(Image.open(picture).convert("RGB").getcolors(maxcolors=1 << 24)) > 50
