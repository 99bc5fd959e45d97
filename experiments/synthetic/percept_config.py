"""`[synthetic.percept]`: what a synthetic participant feels of a shot, the same section for every experiment."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from experiments.config.door import Model
from experiments.config.models import InnerShare
from experiments.synthetic.percept import PerceptParameters

_DEFAULT = PerceptParameters()


class PerceptConfig(Model):
    """The numbers of `experiments.synthetic.percept`, where each has its source; those defaults."""

    exponent: Annotated[float, Field(gt=0, le=10)] = _DEFAULT.exponent
    leak_s: Annotated[float, Field(gt=0, le=10)] = _DEFAULT.leak_s
    sensitivity: Annotated[float, Field(ge=0, le=1e6)] = _DEFAULT.sensitivity
    confusion: Annotated[float, Field(ge=0, le=1e6)] = _DEFAULT.confusion
    start: InnerShare = _DEFAULT.start

    @property
    def own(self) -> PerceptParameters:
        """The percept's own type."""
        return PerceptParameters(**self.model_dump())
