"""Two languages that nobody speaks, made from the template: one of long texts, one from right to left.

Each text can still be read by whoever wrote it, so that a text that did not come from the catalogue is seen at once.
"""

import io
import json
import re
from itertools import starmap

from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po

from experiments.catalogues.catalogue import CHECKED_BY, DIRECTION, DOMAIN, FONTS, NAME, SHIPPED

LONG, RIGHT_TO_LEFT = "en-XA", "ar-XB"
_NAMED = re.compile(r"(\{\w+\})")
_ACCENTS = str.maketrans("aceinouyACEINOUY", "áçéïñöüýÅÇÉÎÑÖÛÝ")
_ARABIC = str.maketrans("abcdefghijklmnopqrstuvwxyz", "ابثدهفغحيجكلمنوپقرستعوخصيز")
HEADS = {
    LONG: {NAME: "long", FONTS: "Noto Sans", DIRECTION: "ltr", CHECKED_BY: "a test, 2026-01-31"},
    RIGHT_TO_LEFT: {NAME: "turned", FONTS: "DejaVu Sans", DIRECTION: "rtl", CHECKED_BY: "a test, 2026-01-31"},
}


def in_long(text):
    """Half as long again, with accents, between brackets: a text that is cut has lost one."""
    said = "".join(part if _NAMED.fullmatch(part) else part.translate(_ACCENTS) for part in _NAMED.split(text))
    return f"[{said}{' lorem ipsum'[: len(text) // 2 + 2]}{' dolor sit' * (len(text) // 24)}]"


def in_right_to_left(text):
    """In Arabic letters, one for each Latin one."""
    parts = (part if _NAMED.fullmatch(part) else part.lower().translate(_ARABIC) for part in _NAMED.split(text))
    return "".join(parts).replace("?", "؟").replace(",", "،")


SAID = {LONG: in_long, RIGHT_TO_LEFT: in_right_to_left}


def write_catalogue(folder, code, say, head, but=()):
    """A catalogue of every text in the template but some; gives back its file."""
    place = folder / code / "LC_MESSAGES"
    place.mkdir(parents=True, exist_ok=True)
    with (SHIPPED / f"{DOMAIN}.pot").open("rb") as file:
        texts = [one.id for one in read_po(file) if one.id and one.id not in but]
    entries = {"": head_of(code, head)} | {one: say(one) for one in texts}
    (place / f"{DOMAIN}.po").write_text("\n".join(starmap(po_entry, entries.items())), encoding="utf-8")
    return place / f"{DOMAIN}.po"


def head_of(code, head):
    """The lines that stand for the empty text."""
    lines = {"Language": code, "Content-Type": "text/plain; charset=utf-8", **head}
    return "".join(f"{name}: {value}\n" for name, value in lines.items())


def po_entry(text, said):
    """A text and what is said for it, as a `.po` has them."""
    return f"msgid {json.dumps(text, ensure_ascii=False)}\nmsgstr {json.dumps(said, ensure_ascii=False)}\n"


class _Entries(list):
    """What Babel compiles: entries with the head as it is given."""

    charset = "utf-8"


def compiled(entries):
    """The bytes of a catalogue, by Babel."""
    from babel.messages.catalog import Message

    made = _Entries(Message(text, said, context=None) for text, said in entries.items())
    out = io.BytesIO()
    write_mo(out, made)
    return out.getvalue()


def write_pseudo_languages(folder):
    """Both, in a folder for `--catalogues`."""
    for code, say in SAID.items():
        write_catalogue(folder, code, say, HEADS[code])
    return folder
