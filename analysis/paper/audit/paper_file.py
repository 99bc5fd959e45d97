"""A paper's numbers in TOML, for the audit: the sections of `analysis.paper.paper` and a list of claims.

```
[paper]
title = "..."
source = "doi or address"

[[claims]]
place = "Results, first paragraph"
quote = "M = 5.21, SD = 1.60"
kind = "grimmer"          # a key of analysis.paper.audit.claims.CHECKS, or "stated", "unpublished"
mean = "5.21"             # text: the printed digits; whole numbers are exact
sd = "1.60"
n = 28
```

The other keys of a claim are the arguments of its check (`claims` has them with their types):

| kind | keys (those after ; may be left out) |
| --- | --- |
| grim | mean, n; grain, items, low, high |
| grimmer | mean, sd, n; grain, items, low, high |
| debit | mean, sd, n |
| percent | percent, count, n |
| df | df, design, counts |
| p | statistic, value, p; df, sides |
| binomial | p, n; chance, counts |
| repeated-f | F, n, k; means, grain, low, high, transforms, other_grains |
| between-f | F, sizes; means, grain, low, high |
| tukey | F, sizes, comparisons ({higher, lower, p, p_at_least}); means, repeated, grain, low, high |
| total | printed, terms ({times, over}); bound ("equals", "at least", "at most") |
| stated | printed; unit |
| unpublished | quantity |

Every claim may also have a `note` on how the file reads the paper, and `about`, the names of the numbers of Recoil's
own comparison that it is about. `[participants]`, `[direction]` and `[preference]`, if there, give claims of their own
(`derived`).
"""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from analysis.paper.audit.claims import AnyClaim
from analysis.paper.paper import PaperHead, Participants, PublishedDirection, PublishedPreference
from experiments.config.door import Model, load, parsed


class PaperFile(Model):
    """Everything that a paper reports, as claims; the three sections are those of Recoil's own paper."""

    paper: PaperHead = PaperHead()
    participants: Participants | None = None
    direction: PublishedDirection | None = None
    preference: PublishedPreference | None = None
    claims: tuple[AnyClaim, ...] = Field(default=(), strict=False)


def parse_paper(text: str, name: str = "the paper") -> PaperFile:
    """A paper's file from its TOML text. `ConfigError` with its name, key, value and rule."""
    return parsed(PaperFile, text, name)


def load_paper_file(path: str | Path) -> PaperFile:
    """A paper's file. `ConfigError` with file, key, value and rule."""
    return load(PaperFile, Path(path))
