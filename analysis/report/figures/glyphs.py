"""Letters that the figures' own font lacks: other fonts of this machine draw them, and what none can is escaped.

matplotlib shapes Arabic and sets it from right to left by itself.
"""

from __future__ import annotations

import sys
import unicodedata
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

from matplotlib import font_manager
from matplotlib.figure import Figure
from matplotlib.ft2font import FaceFlags, FT2Font
from matplotlib.text import Text

from device.messages import first_few

OWN_FONT = "DejaVu Sans"
_FITTING = ("hei", "gothic", "sans")
"""What fonts are called that look like the figures' own."""
_LETTERS_SAID = 12

_chosen: list[str] = []
"""The files of the fonts that this process has drawn with, which are asked first."""
_said: set[str] = set()


def give_fonts(figure: Figure) -> None:
    """Have every letter of a figure drawn by a font that has it; a letter that no font has becomes its escape.

    That is said once, on stderr.
    """
    texts = [text for text in figure.findobj(Text) if lacking(text.get_text())]
    letters = frozenset(letter for text in texts for letter in lacking(text.get_text()))
    if not letters:
        return
    families, undrawn = _fonts_for(letters)
    for text in texts:
        text.set_fontfamily([OWN_FONT, *families])
        text.set_text(drawable_text(text.get_text()))  # but for those of ticks, which are named by `drawn_name`
    _say(undrawn)


def is_drawable(text: str) -> bool:
    """Whether the fonts of this machine have all letters of a text. If they do not, that is said once."""
    letters = lacking(text)
    undrawn = _fonts_for(letters)[1] if letters else frozenset()
    _say(undrawn)
    return not undrawn


def lacking(text: str) -> frozenset[str]:
    """The letters of a text that the figures' own font does not have."""
    return frozenset(letter for letter in text if letter > "~" and not _in_own_font(letter))


@lru_cache(maxsize=4096)
def _in_own_font(letter: str) -> bool:
    unseen = unicodedata.category(letter) in {"Cc", "Cf", "Zs", "Zl", "Zp"}
    return unseen or bool(font_manager.get_font(font_manager.findfont(OWN_FONT)).get_char_index(ord(letter)))


@lru_cache(maxsize=256)
def _fonts_for(letters: frozenset[str]) -> tuple[tuple[str, ...], frozenset[str]]:
    """The families that have letters, those of most letters first, and the letters that none has."""
    families: list[str] = []
    left = set(letters)
    for path in (*_chosen, *_installed()):
        if not left:
            break
        font = _opened(path)
        there = {letter for letter in left if font is not None and font.get_char_index(ord(letter))}
        if there and font is not None:
            families.append(_registered(path, font))
            left -= there
    return tuple(dict.fromkeys(families)), frozenset(left)


def _installed() -> Iterator[str]:
    """The files of all other fonts of this machine, also of those that came since matplotlib listed them."""
    paths = sorted(set(font_manager.findSystemFonts()) - set(_chosen))
    yield from sorted(paths, key=lambda path: (not any(word in Path(path).name.lower() for word in _FITTING), path))


def _opened(path: str) -> FT2Font | None:
    """A font of outlines; `None` for another, and for a file that is none."""
    if "emoji" in path.lower():
        return None
    try:
        font = FT2Font(path)
    except (OSError, RuntimeError):
        return None
    return font if FaceFlags.SCALABLE in font.face_flags else None


def _registered(path: str, font: FT2Font) -> str:
    """The family of a font, under which matplotlib finds it from now on."""
    if path not in _chosen:
        _chosen.append(path)
        if not any(known.fname == path for known in font_manager.fontManager.ttflist):
            font_manager.fontManager.addfont(path)
    return str(font.family_name)


def drawable_text(text: str) -> str:
    """A text with the letters that no font of this machine has as their escapes."""
    letters = lacking(text)
    undrawn = _fonts_for(letters)[1] if letters else frozenset()
    return text.translate({ord(letter): letter.encode("ascii", "backslashreplace").decode() for letter in undrawn})


def _say(undrawn: Iterable[str]) -> None:
    """Say once of each letter that nothing draws it."""
    new = sorted(set(undrawn) - _said)
    if new:
        _said.update(new)
        sys.stderr.write(
            f"recoil: no font on this machine has the letters {first_few(new, _LETTERS_SAID, apart=' ')}; figures show "
            "codes or escapes instead, tables are whole. Install a font that has them (Chinese: fonts-wqy-microhei)\n"
        )
