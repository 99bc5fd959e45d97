"""What the experimenter reads, text by text, so that a catalogue can translate it. There is only English yet.

`scripts/catalogues` collects the texts in `experiments/catalogues/console.pot`.
"""

from __future__ import annotations

import unicodedata
from gettext import NullTranslations

CATALOGUE = NullTranslations()
"""What gives a text in the language of the console."""


def phrase(text: str, /, **values: object) -> str:
    """A text of the console, with values by their names in braces.

    >>> phrase("Trial {number} of {of}", number=2, of=20)
    'Trial 2 of 20'
    """
    said = CATALOGUE.gettext(text)
    beside = {name: isolated(value) if isinstance(value, str) else value for name, value in values.items()}
    return said.format(**beside) if values else said


def isolated(text: str) -> str:
    r"""A text with letters from right to left between Unicode's isolates: what stands around it keeps its sides.

    >>> isolated("left"), isolated("א") == "\N{FIRST STRONG ISOLATE}א\N{POP DIRECTIONAL ISOLATE}"
    ('left', True)
    """
    turned = any(unicodedata.bidirectional(letter) in ("R", "AL") for letter in text)
    return f"\N{FIRST STRONG ISOLATE}{text}\N{POP DIRECTIONAL ISOLATE}" if turned else text
