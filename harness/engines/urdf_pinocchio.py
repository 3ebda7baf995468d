"""`urdf:pinocchio`: frame placements of the model Pinocchio parses from the URDF (https://stack-of-tasks.github.io/pinocchio)."""

from __future__ import annotations

from harness.description.urdf import UrdfText
from harness.engines.base import Misreading
from harness.engines.pinocchio_base import PinocchioEngine
from harness.engines.refusals import URDFDOM, refusals
from harness.errors import EngineFailed


class UrdfPinocchio(PinocchioEngine):
    """`pinocchio.buildModelFromXML` with its defaults; frames are the URDF links (body frames)."""

    source = "urdf:pinocchio"
    traits = (
        *PinocchioEngine.traits,
        Misreading(
            "mimic-independent",
            "mimic joints are independent degrees of freedom unless mimic=True is asked for",
            "pinocchio 4.1.0: a follower stays at zero when only its leader is set; stack-of-tasks/pinocchio#2753",
            lint="mimic",
        ),
        *refusals(
            "pinocchio 4.1.0",
            {
                **dict.fromkeys(URDFDOM, "'The XML stream does not contain a valid URDF model.'"),
                "negative-effort": "'Some components of min_effort are greater than max_effort'",
                "negative-velocity": "'Some components of min_velocity are greater than max_velocity'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        pin = self.library("pinocchio")
        try:
            model = pin.buildModelFromXML(description.text)
        except (ValueError, RuntimeError) as error:
            raise EngineFailed(self.source, f"buildModelFromXML refused the URDF: {error}") from error
        body = pin.FrameType.BODY
        self._adopt(pin, model, {f.name: i for i, f in enumerate(model.frames) if f.type == body})
