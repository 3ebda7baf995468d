"""`urdf:yourdfpy`: its scene graph, one configuration at a time (https://github.com/clemense/yourdfpy)."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfYourdfpy(Engine):
    """`URDF.load`, `update_cfg`, `get_transform`, as its README shows, without meshes."""

    source = "urdf:yourdfpy"
    requirements = ("yourdfpy>=0.0.56",)
    slow = True
    ignored_step = 1e-8
    traits = (
        Trait(
            "small-steps-ignored",
            "a joint stays where it was if its new transform differs from the old one by at most 1e-8 in every entry",
            "yourdfpy 0.0.60 with trimesh 5.2.0: update_cfg leaves an edge of the scene graph that is close to the new one",
        ),
        Misreading(
            "prismatic-scaled",
            "the travel of a prismatic joint is multiplied by the length of its axis",
            "yourdfpy 0.0.60 on a one-joint URDF: axis 0 0 2 moves twice as far",
            lint="unnormalised-axis",
            on="prismatic",
        ),
        Trait(
            "mimic-applied",
            "mimic joints follow their leader, as the specification says",
            "yourdfpy 0.0.60 on a two-joint URDF",
            lint="mimic",
        ),
        Misreading(
            "floating-planar-fixed",
            "floating and planar joints stay at their origin, whatever value they are given",
            "yourdfpy 0.0.60 on one- and two-joint URDFs: update_cfg takes one value for them, and the link does not move",
            lint="unsupported-joint",
        ),
        Misreading(
            "default-namespace-empty",
            "finds no link and no joint in a <robot> in a default namespace",
            "yourdfpy 0.0.60 on a one-joint URDF: an empty model",
            lint="default-namespace",
        ),
        *refusals(
            "yourdfpy 0.0.60",
            {
                "unnamed-robot": "KeyError, 'name'",
                "limit-not-a-number": "ValueError, 'could not convert string to float'",
                "fixed-axis-not-numbers": "ValueError, 'could not convert string to float'",
                "fixed-limit-not-a-number": "ValueError, 'could not convert string to float'",
                "fixed-mimic-not-a-number": "ValueError, 'could not convert string to float'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        yourdfpy = self.library("yourdfpy")
        try:
            self._robot = yourdfpy.URDF.load(
                io.BytesIO(description.text.encode()),
                build_scene_graph=True,
                load_meshes=False,
                build_collision_scene_graph=False,
                load_collision_meshes=False,
            )
        except Exception as error:  # the parser raises whatever its own code happens to hit
            raise EngineFailed(self.source, f"URDF.load refused the URDF: {type(error).__name__}: {error}") from error
        self.joints = tuple(self._robot.actuated_joint_names)
        self.frames = tuple(self._robot.link_map)

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        out = np.empty((q.shape[0], len(frames), 4, 4))
        for k, q_k in enumerate(q):
            self._robot.update_cfg(q_k)
            for slot, frame in enumerate(frames):
                out[k, slot] = self._robot.get_transform(frame)
        return out
