"""Languages from gettext catalogues: folders LANGUAGE/LC_MESSAGES with a `recoil.po`, shipped or own.

The `.po` is read as it stands, so that nothing compiled can be older; a `recoil.mo` counts where there is no `.po`.
What says more than texts stands in the head: the language's own name, its fonts, its direction, and who has checked
it. A catalogue is used whole or not at all.
"""

from __future__ import annotations

import gettext
import io
import re
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import date
from functools import partial
from pathlib import Path

from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages, translated
from experiments.catalogues.po import texts_of_po
from experiments.config.door import ConfigError, printable
from experiments.config.findings import LANGUAGE_CODE, PATTERNS

SHIPPED = Path(__file__).parent
DOMAIN = "recoil"
NAME, FONTS, DIRECTION, CHECKED_BY = "X-Language-Name", "X-Fonts", "X-Direction", "X-Checked-By"
"""The entries in the head of a catalogue that say what gettext does not ask for."""
NOBODY = "nobody"
"""What the last of them says, where no native speaker has checked the catalogue."""
_NO_NAMES = re.compile(r"(nobody|no ?one|none|n/a|todo|tbd|unchecked|unknown|machine)\b.*", re.IGNORECASE)
"""What is written there instead, with a day or without, and is nobody either."""
_CHECKED = re.compile(r"(.*\w.*?),?\s+(\d{4}-\d{2}-\d{2})")
"""Who checked a catalogue, and on which day: what only fills the place has no day."""
_COMPILED = ".mo"
_MOST_BYTES = 1 << 22


def _nothing(_: str) -> str:
    return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Language:
    """A language, as a run uses it. `fonts`: families, of which one must have all letters; the first that does is used.

    `checked_by`: which native speaker checked it, and when; empty if none did. `look_up` gives a text in this language,
    empty if there is none.
    """

    code: str
    name: str
    fonts: tuple[str, ...]
    right_to_left: bool = False
    checked_by: str = ""
    messages: ParticipantMessages = ENGLISH_MESSAGES
    look_up: Callable[[str], str] = _nothing

    @property
    def title(self) -> str:
        """Its code and name, and whether somebody checked it."""
        return f"{self.code} ({self.name}{'' if self.checked_by else ', unchecked'})"


ENGLISH = Language(code="en", name="English", fonts=("Noto Sans",), checked_by="it is what the others are made from")


def languages(folder: Path | None = None) -> dict[str, Path | None]:
    """The languages that there are, with their files: a lab's before those that come along. English has none."""
    found: dict[str, Path | None] = {ENGLISH.code: None}
    for place in filter(None, (SHIPPED, folder)):
        for kind in (_COMPILED, ".po"):  # in brackets, as a name without a pattern hides a link that leads nowhere
            found |= {path.parts[-3]: path for path in sorted(place.glob(f"*/LC_MESSAGES/{DOMAIN}[.]{kind[1:]}"))}
    return found


def language(code: str, folder: Path | None = None, asked: str = "") -> Language:
    """A language by its code. `ConfigError`: there is none, or its catalogue cannot be used, and why.

    `asked`: where the code stands, if not behind `--language`.
    """
    if folder is not None and not folder.is_dir():
        raise ConfigError(f"{folder}: no such folder of catalogues; it must hold LANGUAGE/LC_MESSAGES/{DOMAIN}.po")
    known = languages(folder)
    if not re.match(LANGUAGE_CODE, code):
        place = asked or f"--language {code!r}"
        raise ConfigError(f"{place}: must be {PATTERNS[LANGUAGE_CODE]}; there are {', '.join(sorted(known))}")
    if code not in known:
        where = "" if folder is None else f" here or in {folder}"
        raise ConfigError(
            f"{asked or f'--language {code}'}: no catalogue of that name{where}; there are {', '.join(sorted(known))}; "
            "docs/howto/languages.md says how to make one, and how it is found"
        )
    path = known[code]
    if path is None:
        return ENGLISH
    if code == ENGLISH.code:
        raise ConfigError(f"{path}: {code} is what the others are made from; give it a code of its own, such as en_GB")
    return _read(code, path)


def check_allowed(one: Language, asked: str = "", *, unchecked: bool) -> None:
    """`ConfigError`, if no native speaker has checked the language, and nobody said that it may be used so.

    `asked` as of `language`.
    """
    if not one.checked_by and not unchecked:
        raise ConfigError(
            f"{asked or f'--language {one.code}'}: no native speaker has checked it ({CHECKED_BY} in the head of its "
            ".po names nobody); have it checked, or add --unchecked: journal and report will say so"
        )


class _Absent(gettext.NullTranslations):
    """Where a catalogue has nothing."""

    def gettext(self, message: str) -> str:
        del message
        return ""


def _read(code: str, path: Path) -> Language:
    if not path.is_file():
        raise ConfigError(f"{path}: is no file")
    if path.stat().st_size > _MOST_BYTES:
        raise ConfigError(f"{path}: is longer than {_MOST_BYTES >> 20} MiB, as no catalogue is")
    try:
        return _language(code, *(_compiled(path) if path.suffix == _COMPILED else _of_source(path)))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        how = (
            "put the .po that it was made from beside it, and mend that"
            if path.suffix == _COMPILED
            else "mend it there"
        )
        raise ConfigError(f"{path}: {error}; {how}") from error


_Texts = tuple[Mapping[str, str], Callable[[str], str]]
"""The head of a catalogue, by names in small letters, and what gives a text in its language, empty if it has none."""


def _of_source(path: Path) -> _Texts:
    try:
        texts = texts_of_po((data := path.read_bytes()).decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(f"line {line}: is not UTF-8 (byte {error.start}); save it as UTF-8") from error
    head = dict[str, str]()
    for name, _, value in (line.partition(":") for line in filter(None, texts.pop("", "").split("\n"))):
        key = name.strip().lower()
        if key in head:
            raise ValueError(f"its head says {name.strip()} twice")
        head[key] = value.strip()
    return head, lambda text: texts.get(text, "")


def _compiled(path: Path) -> _Texts:
    data = path.read_bytes()
    try:
        catalogue = gettext.GNUTranslations(io.BytesIO(data))
    except (OSError, ValueError, struct.error, LookupError) as error:  # what gettext raises for bytes that are none
        raise ValueError(f"is no compiled catalogue ({error})") from error
    catalogue.add_fallback(_Absent())
    return catalogue.info(), catalogue.gettext


_JOINERS = str.maketrans("", "", "\u200c\u200d")
"""Not printed, but part of how Persian and other languages are written."""


def _printed(translate: Callable[[str], str], text: str) -> str:
    """A text in another language. `ValueError` for one with what is not printed: nobody would see it."""
    found = translate(text)
    try:
        printable(found.translate(_JOINERS))
    except ValueError as error:
        raise ValueError(f"has for {text!r} a text that {error}") from error
    return found


def _checker(said: str) -> str:
    """Who checked a catalogue and when; empty where nobody did. `ValueError`: it says something else."""
    if said.lower() in ("", NOBODY):
        return ""
    found = _CHECKED.fullmatch(said)
    try:
        if found is not None and not _NO_NAMES.fullmatch(found[1]):
            date.fromisoformat(found[2])
            return printable(said)
    except ValueError:
        pass
    raise ValueError(
        f"{CHECKED_BY}: {said}; it must be {NOBODY}, or the initials or role of the native speaker who checked it and "
        "the day, as in `A. B., 2026-02-28`"
    )


def _language(code: str, head: Mapping[str, str], say: Callable[[str], str]) -> Language:
    own, direction = head.get("language", ""), head.get(DIRECTION.lower(), "ltr")
    if own != code or not re.match(LANGUAGE_CODE, code):
        raise ValueError(f"its head says Language: {own or 'nothing'}, and its folder {code}; they must be one code")
    if direction not in ("ltr", "rtl"):
        raise ValueError(f"{DIRECTION}: {direction}; it must be ltr or rtl")
    fonts = tuple(filter(None, (font.strip() for font in head.get(FONTS.lower(), "").split(","))))
    if not fonts:
        raise ValueError(f"{FONTS} is missing in its head; name the font families that have its letters, with commas")
    look_up = partial(_printed, say)
    return Language(
        code=code,
        name=head.get(NAME.lower(), "") or code,
        fonts=fonts,
        right_to_left=direction == "rtl",
        checked_by=_checker(head.get(CHECKED_BY.lower(), NOBODY)),
        messages=translated(look_up),
        look_up=look_up,
    )
