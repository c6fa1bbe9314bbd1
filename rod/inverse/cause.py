"""What a cause is: one small frozen class that can be put into a model. What is said of it stands with the messages.

A cause has one amount (in `unit`) and one or more variants: what is scanned because it has no meaning without the
cause, such as the place of a soft spot or a relaxation time. ``amount = 0`` leaves every model as it was.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rod.array import Array
from rod.inverse.prediction import Facts, Model


@dataclass(frozen=True)
class Variant:
    """One form of a cause.

    Attributes
    ----------
    label : str
        In words, as it completes "pre_curvature_varying, ...".
    at, width : float
        What the form needs to know: place and width in shares of the length, time in s, curvature in 1/m.
    tuned : tuple of str
        Which of ``at`` and ``width`` a refit may change.
    at_range, width_range : (low, high)
        Where they may go.
    by_factors : bool
        Whether ``at``, a time, is known by its order of magnitude: what a refit changes is its logarithm.
    setting : str
        What all forms of the cause that act together have in common, such as where the displacement is counted from.
    component : bool
        Whether the forms of a setting are components of one thing: the model has all of them, or one alone.
    trace : float
        Multiple of the usual amount (`search.direction`) at which its trace in the data is computed: one that grows
        otherwise than in proportion looks elsewhere when it is large.
    power : float
        Power of the amount with which its trace grows.
    of_law : bool
        Whether a law of any form takes this form of the cause over: the data cannot tell them apart.
    known : float
        Multiple of the usual amount that is the standard deviation of what is known of the amount beforehand; infinite
        where nothing is.
    rare : bool
        Whether few rigs have it so: it is sought, but says nothing of what would have been seen of the cause.
    """

    label: str = ""
    at: float = 0.0
    width: float = 0.0
    tuned: tuple[str, ...] = ()
    at_range: tuple[float, float] = (0.0, 1.0)
    width_range: tuple[float, float] = (0.0, 1.0)
    by_factors: bool = False
    setting: str = ""
    component: bool = False
    trace: float = 1.0
    power: float = 1.0
    known: float = np.inf
    of_law: bool = False
    rare: bool = False

    def number(self, name: str) -> float:
        """What a refit changes of ``at`` or ``width``: itself, or its logarithm."""
        return self._number(name, self.at if name == "at" else self.width)

    def range(self, name: str) -> tuple[float, float]:
        """Range of that number."""
        low, high = self.at_range if name == "at" else self.width_range
        return self._number(name, low), self._number(name, high)

    def moved(self, numbers: dict[str, float]) -> Variant:
        """The same form elsewhere: ``at`` and ``width`` by the numbers that are given."""
        at = float(np.exp(numbers["at"])) if self.by_factors and "at" in numbers else numbers.get("at", self.at)
        return replace(self, at=at, width=numbers.get("width", self.width)) if numbers else self

    def scale(self, name: str) -> float:
        """Size of a large change of that number."""
        low, high = self.range(name)
        return high - low

    def _number(self, name: str, value: float) -> float:
        return float(np.log(value)) if self.by_factors and name == "at" else value


PLAIN = (Variant(),)


@dataclass(frozen=True)
class Cause(ABC):
    """A candidate for what the simulation gets wrong.

    Attributes
    ----------
    name : str
        Of the contract's table.
    unit : str
        Of the amount.
    seat : str
        Where it sits: ``cable``, ``rig``, ``load cell`` or ``camera``. Turning the cable end for end turns the first
        kind only.
    sign : int
        1 if the amount cannot be negative, 0 if it can.
    combines : bool
        Whether several forms may act together (a profile along the cable is a sum of forms).
    additive : bool
        Whether the amounts of forms acting together add up; else the largest is the size of the cause.
    adds : bool
        Whether it does the same whatever its other terms do, in proportion to its amount.
    limited : bool
        Whether many times the plausible amount cannot be. A number typed wrongly, a zero never set, a bearing that has
        seized, a heavy or patched cable may be off by any amount.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    seat: ClassVar[str]
    sign: ClassVar[int] = 0
    combines: ClassVar[bool] = False
    additive: ClassVar[bool] = False
    adds: ClassVar[bool] = False
    limited: ClassVar[bool] = False

    @abstractmethod
    def plausible(self, facts: Facts) -> float:
        """Size (positive, in `unit`) that would surprise nobody on such a rig."""

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Forms to be tried, one unless there are several; empty where the data cannot show the cause at all."""
        return PLAIN

    def by_step(self, amount: float, facts: Facts) -> tuple[tuple[Variant, ...], ...]:
        """Ways in which a cause of that ``amount`` differs from step to step, each the forms put beside it.

        What is known of their amounts says by how much (`Variant.known`). Empty for causes that do not differ.
        """
        return ()

    @abstractmethod
    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """The model with the cause in it."""

    def together(self, forms: Sequence[Variant], facts: Facts) -> tuple[str, Array] | None:
        """Unit and rows (m, k), per unit of the amounts of k forms, of what these make up; the largest is the size.

        None where an amount says the size.
        """
        return None


@dataclass(frozen=True)
class Profile(Cause):
    """A cause whose forms are profiles along the cable, which add up."""

    combines: ClassVar[bool] = True

    @abstractmethod
    def along_cable(self, variant: Variant, model: Model) -> tuple[str, Array]:
        """Parameter of `rod.parameters` that the amount of a form moves, and the basis (n joints,) along which."""
