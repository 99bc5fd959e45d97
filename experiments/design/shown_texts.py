"""The texts of a design that a participant sees or is read, and the design with them in another language. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

from experiments.catalogues.catalogue import ENGLISH, Language
from experiments.catalogues.messages import NAMED_ANSWERS
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.language import INSTRUCTION_FACTOR, QuestionConfig


class ShownText(NamedTuple):
    """A text with the key that it stands at; `named` if it is an answer's own name, for want of a label."""

    place: str
    text: str
    named: bool = False


def shown_texts(design: DesignConfig) -> Iterator[ShownText]:
    """Every text of a design that a participant sees or is read."""
    for place, opening in enumerate(design.opening, start=1):
        yield ShownText(f"opening[{place}].text", opening.text)
    told = design.factors.get(INSTRUCTION_FACTOR)
    for level, text in (told.texts if told else {}).items():
        yield ShownText(f"factors.{INSTRUCTION_FACTOR}.texts.{level}", text)
    for name, question in design.questions.items():
        yield from _of_question(f"questions.{name}", question)


def _of_question(place: str, question: QuestionConfig) -> Iterator[ShownText]:
    yield ShownText(f"{place}.text", question.text)
    for answer in question.named_answers:
        yield ShownText(f"{place}.labels.{answer}", question.label(answer), answer not in question.labels)
    for key in ("minimum_text", "maximum_text"):
        if text := getattr(question, key):
            yield ShownText(f"{place}.{key}", text)


def setup_in(language: Language, setup: Setup[DesignConfig]) -> tuple[Setup[DesignConfig], dict[str, str]]:
    """The setup as its participants see it, and its texts in their language, by the texts of the design.

    `ConfigError` names the texts that the catalogue lacks.
    """
    design = setup.config
    if language is ENGLISH and design.language == ENGLISH.code:
        return setup, {}
    try:
        texts = texts_in(design, language.code, language.look_up)
        return replace(setup, config=with_texts(design, texts)), texts
    except ValueError as error:
        raise ConfigError(f"{setup.source}: the catalogue {language.title} {error}") from error


def letters_of(language: Language, setup: Setup[DesignConfig]) -> str:
    """Every character that the participant of a run may see. Raises as `setup_in`."""
    shown, _ = setup_in(language, setup)
    return "".join((*language.messages.every, *(one.text for one in shown_texts(shown.config))))


def texts_in(design: DesignConfig, code: str, look_up: Callable[[str], str]) -> dict[str, str]:
    """The design's texts in another language, by the texts. `ValueError` names those that it lacks.

    Where the design is written in that language its texts stand, but for answers that Recoil names. What has no
    letters, as the label "1", needs no translation.
    """
    shown = [one for one in shown_texts(design) if any(map(str.isalpha, one.text))]
    if design.language == code:
        shown = [one for one in shown if one.named and one.text in NAMED_ANSWERS]
    missing = [one for one in shown if not look_up(one.text).strip()]
    if missing:
        named = "; ".join(f"{one.place} = {one.text!r}" for one in missing)
        raise ValueError(
            f"lacks what this design says: {named}; add it there, or say language = {code!r} at the top of the design "
            "if its texts are in that language"
        )
    return {one.text: look_up(one.text) for one in shown}


def with_texts(design: DesignConfig, texts: dict[str, str]) -> DesignConfig:
    """The design as it is shown, with some of its texts in other words. `ValueError`: two answers would be one."""

    def said(text: str) -> str:
        return texts.get(text, text)

    factors = dict(design.factors)
    if (told := factors.get(INSTRUCTION_FACTOR)) is not None:
        own = {level: said(text) for level, text in told.texts.items()}
        factors[INSTRUCTION_FACTOR] = told.model_copy(update={"texts": own})
    return design.model_copy(
        update={
            "factors": factors,
            "opening": tuple(one.model_copy(update={"text": said(one.text)}) for one in design.opening),
            "questions": {name: _question(name, one, said) for name, one in design.questions.items()},
        }
    )


def _question(name: str, question: QuestionConfig, said: Callable[[str], str]) -> QuestionConfig:
    ends = {key: said(text) for key in ("minimum_text", "maximum_text") if (text := getattr(question, key))}
    labels = {answer: said(question.label(answer)) for answer in question.named_answers}
    if len(set(labels.values())) < len(labels):
        raise ValueError(f"gives two answers of questions.{name} one label: {', '.join(labels.values())}")
    return question.model_copy(update={"text": said(question.text), "labels": labels, **ends})
