"""What a result is worth: decided here, and nowhere else.

A recovery finds out what speaks for its mesh and what against it. That is a :class:`Findings`;
:func:`judge` makes a :class:`Verdict` of it. The three statuses mean:

``certified``
    The entries are given back, others were to spare that would have shown otherwise, and no other
    mesh is known.
``ambiguous``
    The same, but another mesh is known that gives the entries back as well.
``uncertified``
    Something speaks against the mesh, or nothing would have shown if it were wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from ..tolerances import CERTIFIED
from ..words import Reason

Status = Literal["certified", "ambiguous", "uncertified"]
Unique = Literal["proved", "searched", "conventional"]
Uniqueness = Literal["proved", "searched", "conventional", "ambiguous"]


@dataclass(frozen=True)
class Findings:
    """What a recovery has found out about its mesh."""

    #: That, and how well, the mesh fits: the reasons of a mesh that is certified.
    fits: tuple[str, ...]
    #: The largest error of an entry that the mesh was held against, as in
    #: :attr:`.Recovery.backward_error`.
    error: float
    #: All that speaks against the mesh, the gravest first.
    objections: tuple[Reason, ...] = ()
    #: Another mesh that gives the entries back as well.
    another: Reason | None = None
    #: Where no other mesh is known: ``"proved"``, there is none; ``"searched"``, a search found
    #: none; ``"conventional"``, there is no other grid or lattice, but meshes that are neither may
    #: fit.
    unique: Unique = "searched"
    #: The largest error with which an entry counts as given back. Infinite where errors of the
    #: entries are known, and a test of their size decides.
    allowed: float = CERTIFIED


@dataclass(frozen=True)
class Verdict:
    """What a result is worth, and why.

    The status is not stored but follows from `objections` and `uniqueness`, so that they cannot
    contradict each other.

    Raises
    ------
    ValueError
        If there is a `uniqueness` although something speaks against the mesh, or none although
        nothing does.
    """

    #: Of other meshes that fit as well ``"proved"``, ``"searched"`` or ``"conventional"``, see
    #: :class:`Findings`, or ``"ambiguous"``, there is one. None where this mesh does not fit.
    uniqueness: Uniqueness | None
    #: Why, the important sentence first. Each comes without its full stop, and beginning small.
    reasons: tuple[str, ...]
    #: What to do next, where the mesh is not certified.
    advice: str = ""
    #: What speaks against the mesh, the gravest first.
    objections: tuple[Reason, ...] = ()

    def __post_init__(self) -> None:
        """See to it that a mesh has a uniqueness just where nothing speaks against it."""
        if (self.uniqueness is None) != bool(self.objections):
            raise ValueError("a verdict has either objections or a uniqueness")

    @property
    def status(self) -> Status:
        """``"certified"``, ``"ambiguous"`` or ``"uncertified"``."""
        if self.uniqueness is None:
            return "uncertified"
        return "ambiguous" if self.uniqueness == "ambiguous" else "certified"

    @property
    def unique(self) -> Unique:
        """What is known of other meshes if there is none that fits."""
        if self.uniqueness is None or self.uniqueness == "ambiguous":
            return "searched"
        return self.uniqueness

    def despite(self, objection: Reason) -> Verdict:
        """The verdict on the same mesh when something else speaks against it, gravely."""
        return _uncertified((objection, *self.objections))

    def beside(self, another: Reason) -> Verdict:
        """The verdict on the same mesh when another turns up that fits as well."""
        if self.objections:
            return self
        return Verdict("ambiguous", (*another.sentences, *self.reasons), another.advice or self.advice)

    def explained(self, *reasons: str, advice: str | None = None) -> Verdict:
        """The same verdict for better reasons, which come first, and with another advice, if one is given."""
        better = Reason(*reasons, advice=self.advice if advice is None else advice)
        if self.objections:
            return _uncertified((better, *self.objections))
        return replace(self, reasons=better.sentences, advice=better.advice)


def judge(findings: Findings) -> Verdict:
    """What a mesh is worth."""
    objections = findings.objections
    if not objections and not findings.error <= findings.allowed:
        objections = (_not_given_back(findings),)
    if objections:
        return _uncertified(objections)
    if findings.another is not None:
        return Verdict("ambiguous", findings.another.sentences, findings.another.advice)
    return Verdict(findings.unique, findings.fits)


def _not_given_back(findings: Findings) -> Reason:
    """That an entry differs too much, or that none could be compared."""
    if math.isnan(findings.error):
        return Reason("no entry of the matrix could be compared with the mesh")
    if math.isinf(findings.error):
        return Reason("a cell is flat, or an entry of the mesh belongs to a row that has none")
    much = f"{findings.error:.1e} (relative) only, where {findings.allowed:g} is allowed"
    return Reason(f"the matrix is given back to {much}")


def _uncertified(objections: tuple[Reason, ...]) -> Verdict:
    """That some things speak against a mesh, with the advice of the gravest that has one."""
    reasons = tuple(sentence for objection in objections for sentence in objection.sentences)
    advice = next((objection.advice for objection in objections if objection.advice), "")
    return Verdict(None, reasons, advice, objections)


UNJUDGED = _uncertified((Reason("the mesh has not been held against the matrix"),))
"""What a mesh is worth before anybody has asked."""
