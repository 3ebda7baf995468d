"""What engines are known to refuse in a URDF: one sentence for each code of the lint, the same for every engine."""

from __future__ import annotations

from collections.abc import Mapping

from harness.engines.base import Refusal

# Code of the finding: what an engine does that refuses it.
TEXTS = {
    "undeclared-prefix": "refuses a namespace prefix that the file does not declare",
    "default-namespace": "refuses a <robot> in a default namespace",
    "unnamed-robot": "refuses a <robot> without a name",
    "empty-name": "refuses a <robot> with an empty name",
    "limit-without-effort": "refuses a <limit> without effort",
    "limit-without-velocity": "refuses a <limit> without velocity",
    "limit-not-a-number": "refuses a <limit> whose effort or velocity is no number",
    "limit-not-finite": "refuses inf and nan for an effort or a velocity",
    "negative-effort": "refuses a negative effort",
    "negative-velocity": "refuses a negative velocity",
    "prismatic-without-limit": "refuses a prismatic joint without a <limit>",
    "revolute-without-limit": "refuses a revolute joint without a <limit>",
    "limits-reversed": "refuses a lower limit above the upper one",
    "fixed-axis-without-xyz": "refuses an <axis> without xyz at a fixed joint",
    "fixed-axis-not-numbers": "refuses an <axis> that is no vector at a fixed joint",
    "fixed-limit-not-a-number": "refuses a range that is no number at a fixed joint",
    "fixed-limit-not-finite": "refuses inf and nan for a range at a fixed joint",
    "fixed-mimic-not-a-number": "refuses a multiplier or an offset that is no number at a fixed joint",
    "fixed-mimic-not-finite": "refuses inf and nan for a multiplier or an offset at a fixed joint",
    "unknown-mimic": "refuses a <mimic> of a joint that does not exist",
}

# What urdfdom refuses, and with it every library that reads URDFs by it.
URDFDOM = (
    "unnamed-robot",
    "limit-without-effort",
    "limit-without-velocity",
    "limit-not-a-number",
    "limit-not-finite",
    "prismatic-without-limit",
    "revolute-without-limit",
    "fixed-limit-not-a-number",
    "fixed-limit-not-finite",
    "fixed-mimic-not-a-number",
    "fixed-mimic-not-finite",
)


def refusals(version: str, evidence: Mapping[str, str]) -> tuple[Refusal, ...]:
    """Traits of an engine that refuses URDFs with these findings.

    Args:
        version: the library and the version it was found with, such as `pinocchio 4.1.0`.
        evidence: by code of the finding, what the library says to a URDF that has it and nothing else.

    Raises:
        KeyError: there is no such code.
    """
    return tuple(
        Refusal(f"refuses-{code}", TEXTS[code], f"{version} on a small URDF: {said}", lint=code)
        for code, said in evidence.items()
    )
