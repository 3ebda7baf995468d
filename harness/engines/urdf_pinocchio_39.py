"""`urdf:pinocchio@3.9`: the last Pinocchio before 4.0, to tell a change of the library from one of the description."""

from __future__ import annotations

from dataclasses import replace

from harness.engines.urdf_pinocchio import UrdfPinocchio


class UrdfPinocchio39(UrdfPinocchio):
    """As `urdf:pinocchio`, in an environment of its own.

    Its wheel is linked against urdfdom 4.0 and tinyxml2 10 but sets no upper bounds; those here keep newer ones away.
    """

    source = "urdf:pinocchio@3.9"
    requirements = ("pin>=3.9,<3.10", "cmeel-urdfdom<5", "cmeel-tinyxml2<11")
    traits = tuple(
        replace(trait, evidence=f"pinocchio 3.9.0, the same as {trait.evidence}")
        for trait in UrdfPinocchio.traits
        if trait.lint not in ("negative-effort", "negative-velocity")  # which it reads
    )
