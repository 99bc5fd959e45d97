"""The options of `recoil audit`. The command line knows them before anything heavy is imported."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

Show = Callable[[Any, str, bool], None]
"""Takes the machine-readable result, the text for people, and which of them is wanted."""
Ends = Callable[[bool], typer.Exit]
"""From whether there are exceptions: the end of the command."""


def command(show: Show, ends: Ends) -> Callable[..., None]:
    """The command, which shows its result and ends by these."""

    def audit(
        paper: Annotated[str, typer.Argument(metavar="PAPER", help="A paper's file, or a shipped one.")] = "paper",
        out: Annotated[Path, typer.Option(help="Folder for audit.json and the report.")] = Path("results/audit"),
        *,
        as_json: Annotated[bool, typer.Option("--json", help="Print the machine-readable result.")] = False,
    ) -> None:
        """Are the published numbers attainable and consistent? Each with its proof; exit code 1 if one is not."""
        from experiments.roof import audit as roof  # noqa: PLC0415 - when it is called

        audited = roof.examine(paper)
        roof.write(audited, out)
        show(audited.as_json(), f"{audited.as_text()}\n\nReport: {out / 'report.html'}", as_json)
        raise ends(audited.exceptions)

    return audit
