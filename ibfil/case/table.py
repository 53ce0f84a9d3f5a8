"""The base of every table of a case."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from .expressions import parse

ZERO = parse(0)


ORIGIN = (0.0, 0.0, 0.0)


class Table(BaseModel):
    """A table of the file: no other keys, nothing converted that is not said to be."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
