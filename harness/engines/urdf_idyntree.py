"""`urdf:idyntree`: frame transforms of `KinDynComputations` (https://github.com/gbionics/idyntree)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Refusal, Trait
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfIdyntree(Engine):
    """`ModelLoader.loadModelFromString`, `setJointPos`, `getWorldTransformsAsHomogeneous`; frames are links and frames."""

    source = "urdf:idyntree"
    # 14.0.0 turns three intersecting joints between massless links into one spherical joint, which misplaces links.
    requirements = ("idyntree>=15",)
    traits = (
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "iDynTree 15.1.0 on a two-joint URDF: a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Refusal(
            "no-floating-planar",
            "floating and planar joints are dropped, and the two trees that are left are refused",
            "iDynTree 15.1.0 on a two-joint URDF: an empty model, of which loadModelFromString says it is valid",
            lint="unsupported-joint",
        ),
        Trait(
            "joints-hashed",
            "joints come in the order of a hash table, neither as written nor by name; fixed joints last",
            "iDynTree 15.1.0: order ja1 jz1 jz2 ja2 for a file that writes jz1 ja1 jz2 ja2; e c d a b for b a c e d",
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        library = self.library("idyntree.bindings")
        loader = library.ModelLoader()
        try:
            loaded = loader.loadModelFromString(description.text, "urdf")
            model = loader.model()
        except Exception as error:  # whatever its bindings hit
            raise EngineFailed(self.source, f"loadModelFromString refused the URDF: {type(error).__name__}: {error}") from error
        # It may say yes to a file it has refused: the model is empty then, and kinematics on it ends the process.
        if not loaded or model.getNrOfLinks() == 0:
            raise EngineFailed(self.source, "loadModelFromString refused the URDF: the model is empty")
        self._kinematics = library.KinDynComputations()
        if not self._kinematics.loadRobotModel(model):
            raise EngineFailed(self.source, "loadRobotModel refused the model")
        moving = [i for i in range(model.getNrOfJoints()) if model.getJoint(i).getNrOfPosCoords() == 1]
        self._columns = [model.getJoint(i).getPosCoordsOffset() for i in moving]
        self._width = model.getNrOfPosCoords()
        self.joints = tuple(model.getJointName(i) for i in moving)
        self.frames = tuple(model.getFrameName(i) for i in range(model.getNrOfFrames()))

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        names = list(frames)
        full = np.zeros((q.shape[0], self._width))
        full[:, self._columns] = q
        out = np.empty((q.shape[0], len(frames), 4, 4))
        set_joints, transforms = self._kinematics.setJointPos, self._kinematics.getWorldTransformsAsHomogeneous
        for k, q_k in enumerate(full):
            set_joints(q_k)
            row = out[k]
            for slot, matrix in enumerate(transforms(names)):
                row[slot] = matrix.toNumPy()
        return out
