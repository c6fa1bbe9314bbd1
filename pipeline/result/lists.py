"""Types of the fields: numbers whose cube is a number still, and a check that lists belong together."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

# Nothing measured comes near it, and its square and cube are numbers still.
Number = Annotated[float, Field(ge=-1e30, le=1e30)]
Floats = list[Number]


def check_one_length(part: BaseModel, needed: tuple[str, ...], optional: tuple[str, ...] = ()) -> None:
    """Refuse lists of a part that differ in length; optional ones may be empty.

    Raises
    ------
    ValueError
        With the lengths.
    """
    lengths = {name: len(getattr(part, name)) for name in (*needed, *optional)}
    if len({lengths[name] for name in lengths if name in needed or lengths[name]}) > 1:
        raise ValueError(f"lists of different lengths: {', '.join(f'{n} {count}' for n, count in lengths.items())}")
