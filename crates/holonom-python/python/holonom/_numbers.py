"""Whole numbers and threads, as they are given."""

from __future__ import annotations

import operator
import os
from typing import SupportsIndex


def natural(name: str, given: SupportsIndex, least: int) -> int:
    """A whole number that is not below ``least``.

    Raises
    ------
    TypeError, ValueError
    """
    try:
        number = operator.index(given)
    except TypeError:
        raise TypeError(f"{name}: a whole number, not {given!r}") from None
    if not least <= number < 2**63:
        raise ValueError(f"{name}: {least} or more, not {number}")
    return number


def threads_of(given: int | None) -> int:
    """How many threads; by default the processors that this process may use."""
    return len(os.sched_getaffinity(0)) if given is None else natural("threads", given, 1)
