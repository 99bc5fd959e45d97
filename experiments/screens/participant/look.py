"""How the participant's window looks and where it stands: said by the console as arguments of the program."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

Theme = Literal["dark", "light"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Screen by index, full or a window of a size; dark or light; the font must hold the script of the texts."""

    screen: int = 0
    full_screen: bool = True
    width_px: int = 1280
    height_px: int = 800
    theme: Theme = "dark"
    font: str = "Noto Sans"  # PsychoPy brings it along


@dataclass(frozen=True, slots=True, kw_only=True)
class Palette:
    """Colours of one theme, as PsychoPy takes them."""

    ground: str
    ink: str
    muted: str
    panel: str
    accent: str
    on_accent: str


PALETTES: dict[Theme, Palette] = {
    "dark": Palette(
        ground="#101418", ink="#F2F4F5", muted="#A9B4BC", panel="#242C33", accent="#5CC8FF", on_accent="#06202E"
    ),
    "light": Palette(
        ground="#F6F7F8", ink="#14191D", muted="#4E5A63", panel="#DFE4E8", accent="#005A9C", on_accent="#FFFFFF"
    ),
}


def arguments(look: Look) -> list[str]:
    """A look as arguments of the program.

    >>> look_from(arguments(Look(screen=1, theme="light"))) == Look(screen=1, theme="light")
    True
    """
    size = [] if look.full_screen else ["--window", str(look.width_px), str(look.height_px)]
    return ["--screen", str(look.screen), "--theme", look.theme, "--font", look.font, *size]


def look_from(words: Sequence[str]) -> Look:
    """The look that arguments ask for; `SystemExit` with a message if they are wrong."""
    usual = Look()
    parser = argparse.ArgumentParser(prog="experiments.screens.participant", description="The participant's screen.")
    parser.add_argument("--screen", type=int, default=usual.screen, help="index of the screen")
    parser.add_argument("--theme", choices=get_args(Theme), default=usual.theme)
    parser.add_argument("--font", default=usual.font, help="name of the font")
    parser.add_argument("--window", type=int, nargs=2, metavar=("WIDTH", "HEIGHT"), help="a window, not full screen")
    told = parser.parse_args(words)
    width_px, height_px = told.window or (usual.width_px, usual.height_px)
    return Look(
        screen=told.screen,
        full_screen=told.window is None,
        width_px=width_px,
        height_px=height_px,
        theme=told.theme,
        font=told.font,
    )
