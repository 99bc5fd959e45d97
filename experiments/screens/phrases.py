"""What the experimenter reads, text by text, so that a catalogue can translate it. There is only English yet.

`scripts/catalogues` collects the texts in `experiments/catalogues/console.pot`.
"""

from __future__ import annotations

from gettext import NullTranslations

CATALOGUE = NullTranslations()
"""What gives a text in the language of the console."""


def phrase(text: str, /, **values: object) -> str:
    """A text of the console, with values by their names in braces.

    >>> phrase("Trial {number} of {of}", number=2, of=20)
    'Trial 2 of 20'
    """
    said = CATALOGUE.gettext(text)
    return said.format(**values) if values else said
