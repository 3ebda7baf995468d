"""Which engines refuse or misread what the lint finds in a URDF: looked up in the traits of the engines, with their versions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from harness.description.finding import Finding
from harness.engines.base import Engine, LintTrait, Misreading, Refusal
from harness.engines.registry import registered

# What engines are not given: `Urdf.text` has neither prefixes nor namespaces, and always a name.
NOT_IN_TEXT = ("undeclared-prefix", "default-namespace", "unnamed-robot")


@dataclass(frozen=True)
class Effect:
    """What the engines make of one finding.

    Attributes:
        refused: the engines that refuse the file, each as its library and version.
        misread: the engines that read it otherwise than the specification says.
    """

    refused: tuple[str, ...]
    misread: tuple[str, ...]

    @property
    def clause(self) -> str:
        """`refused by kinpy 0.6.1; misread by ...`; empty if no engine is known to do either."""
        parts = [("refused", self.refused), ("misread", self.misread)]
        return "; ".join(f"{what} by {', '.join(names)}" for what, names in parts if names)


def effect_of(finding: Finding) -> Effect:
    """What the engines are known to make of a finding."""
    return Effect(tuple(_versions(finding, Refusal)), tuple(_versions(finding, Misreading)))


def messages(findings: Sequence[Finding]) -> list[str]:
    """The message of each finding, with the engines that refuse or misread it where they have not been named before."""
    texts, named = [], set()
    for finding in findings:
        clause = effect_of(finding).clause
        texts.append(finding.message if not clause or (finding.code, clause) in named else f"{finding.message}; {clause}")
        named.add((finding.code, clause))
    return texts


def refused_for(adapter: type[Engine], findings: Iterable[Finding]) -> Finding | None:
    """The first finding for which an engine is known to refuse the text that it is given; None if there is none."""
    refusals = [trait for trait in adapter.traits if isinstance(trait, Refusal)]
    for finding in findings:
        if finding.code not in NOT_IN_TEXT and any(t.lint == finding.code and _concerns(t, finding) for t in refusals):
            return finding
    return None


def _versions(finding: Finding, kind: type[LintTrait]) -> Iterator[str]:
    """Library and version of every engine with such a trait; the name of the source where its evidence gives no version."""
    for source, entry in registered().items():
        for trait in entry.adapter.traits if entry.adapter is not None else ():
            if isinstance(trait, kind) and trait.lint == finding.code and _concerns(trait, finding):
                yield trait.version or source


def _concerns(trait: LintTrait, finding: Finding) -> bool:
    """Whether a trait matters with the type of joint that a finding is about; a continuous joint is as a revolute one."""
    return not trait.on or trait.on == finding.joint_type.replace("continuous", "revolute")
