"""Texts of configs that are shown to people: without what is not printed, and no longer than is read."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from experiments.config.door import Text, printable

LONGEST_LINE = 200
"""A label or name with more characters is refused."""


def _words(text: str) -> str:
    """The text; `ValueError` as `printable`, and for blanks alone."""
    printable(text)
    if not text.strip():
        raise ValueError("is blank; give it words or leave the key out")
    return text


def name_fault(name: str) -> str:
    r"""Why a level or method cannot be called so, behind its name; empty if it can.

    >>> name_fault("asymmetric-1"), name_fault("two\nlines"), name_fault("x" * 201)
    ('', 'holds the character U+000A, which is not printed; remove it', 'has 201 characters; a name has at most 200')
    """
    if len(name) > LONGEST_LINE:
        return f"has {len(name):,} characters; a name has at most {LONGEST_LINE}"
    try:
        _words(name)
    except ValueError as error:
        return str(error)
    return ""


LineText = Annotated[str, Field(min_length=1, max_length=LONGEST_LINE), AfterValidator(_words)]
PageText = Annotated[Text, AfterValidator(_words)]
