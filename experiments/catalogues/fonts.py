"""Fonts of a language: which of its families is installed and has every letter that a run shows.

A window draws an empty box for a letter that its font lacks, and says nothing; so it is looked for beforehand.
"""

from __future__ import annotations

import os
import sys
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from device.messages import first_few
from experiments.catalogues.catalogue import ENGLISH, Language
from experiments.config.door import ConfigError

_PLAIN = "".join(map(chr, range(32, 127)))
"""What everybody's keyboard types, and stands on keys and scales."""
_SEVERAL = (".ttc", ".otc")
_FILES = (".ttf", ".otf", *_SEVERAL)
_UPRIGHT = ("Regular", "Book", "Roman")
_MOST_NAMED = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Font:
    """A font family and its file; no file of the one that PsychoPy brings along and that has the plain letters."""

    family: str
    path: Path | None = None


def font_for(language: Language, letters: str) -> Font:
    """The first of the language's fonts that is installed and has all letters. `ConfigError` says what each lacks.

    What counts as English may be written in any language: there any other font that has all letters will do.
    """
    if language is ENGLISH and letters.isascii():
        return Font(family=ENGLISH.fonts[0])
    needed = {letter for letter in shaped(letters) + _PLAIN if letter.isprintable()}
    lacking = dict.fromkeys(language.fonts, "is not installed")
    for family, path, has in _installed(language.fonts):
        missing = needed - has
        if not missing:
            return Font(family=family, path=path)
        lacking[family] = f"lacks {_named(missing)}"
    if language is ENGLISH:
        for path in _font_files():
            family, has = _letters_of(path)
            if needed <= has:
                return Font(family=family, path=path)
    raise ConfigError(
        f"language {language.code} ({language.name}): no font has all its letters, so participants would see empty "
        f"boxes: {'; '.join(f'{family} {why}' for family, why in lacking.items())}. {_remedy(language)}"
    )


def _remedy(language: Language) -> str:
    where = f"(as a file in {_own_folder()}, or by your system's packages)"
    if language is not ENGLISH:
        return f"Install one of them {where}, or name another in the head of the catalogue"
    return (
        f"Install a font that has all of them {where}: fonts-noto-cjk has Chinese, Japanese and Korean; few have "
        "emoji beside other letters, so leave those out. Or say in the design in which language it is written, which "
        "needs a catalogue (docs/howto/languages.md)"
    )


def _named(letters: Iterable[str]) -> str:
    """Letters by number and name, the first of them.

    >>> _named("é")
    'U+00E9 é (LATIN SMALL LETTER E WITH ACUTE)'
    """
    every = sorted(letters)
    shown = [f"U+{ord(one):04X} {one} ({unicodedata.name(one, 'no name')})" for one in every]
    return first_few(shown, _MOST_NAMED)


def shaped(text: str) -> str:
    """A text with its letters in the forms that they are drawn in: those of Arabic depend on their neighbours.

    Without the extra `gui`, which draws them, as they are written.
    """
    if find_spec("arabic_reshaper") is None:
        return text
    import arabic_reshaper  # noqa: PLC0415 - an extra

    return str(arabic_reshaper.reshape(text))


def _installed(families: tuple[str, ...]) -> Iterator[tuple[str, Path, frozenset[str]]]:
    """The fonts of some families that are installed, in the order of the families, with the letters that each has."""
    files = list(_font_files())
    for family in families:
        for path in files:
            if has := _letters_of(path, family)[1]:
                yield family, path, has
                break


def _letters_of(path: Path, family: str | None = None) -> tuple[str, frozenset[str]]:
    """The family and letters of a font file's regular face; none if it is not of the family, or cannot be read."""
    # imported when used: whoever runs in English needs none of it
    from fontTools.ttLib import TTCollection, TTFont, TTLibError  # noqa: PLC0415

    try:
        with TTCollection(path, lazy=True) if path.suffix.lower() in _SEVERAL else TTFont(path, lazy=True) as file:
            for face in file.fonts if isinstance(file, TTCollection) else (file,):
                name = face["name"]
                own = str(name.getBestFamilyName())
                if family in (None, own) and name.getBestSubFamilyName() in _UPRIGHT:
                    return own, frozenset(map(chr, face.getBestCmap() or ()))
    except (OSError, TTLibError, KeyError, AttributeError, AssertionError):
        pass
    return "", frozenset()


def _font_files() -> Iterator[Path]:
    for folder in _folders():
        yield from (path for path in sorted(folder.rglob("*")) if path.suffix.lower() in _FILES)


def _folders() -> Iterator[Path]:
    """Where fonts lie: PsychoPy's own, then the system's."""
    psychopy = find_spec("psychopy")
    for place in psychopy.submodule_search_locations or () if psychopy else ():
        yield Path(place, "assets", "fonts")
    yield _own_folder()
    match sys.platform:
        case "win32":
            yield Path(os.environ.get("WINDIR", "C:/Windows"), "Fonts")
        case "darwin":
            yield from map(Path, ("/Library/Fonts", "/System/Library/Fonts"))
        case _:
            yield from map(Path, ("/usr/local/share/fonts", "/usr/share/fonts"))


def _own_folder() -> Path:
    """Where a person puts fonts of their own."""
    own = {"win32": "AppData/Local/Microsoft/Windows/Fonts", "darwin": "Library/Fonts"}
    return Path.home() / own.get(sys.platform, ".local/share/fonts")
