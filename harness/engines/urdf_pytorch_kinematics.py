"""`urdf:pytorch-kinematics`: its URDF chain, batched on the CPU (https://github.com/UM-ARM-Lab/pytorch_kinematics)."""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Iterator, Sequence

import numpy as np

from harness.description.urdf import UrdfText
from harness.engines.base import Engine, Misreading, Refusal, Trait
from harness.engines.refusals import refusals
from harness.errors import EngineFailed
from harness.se3 import Array


class UrdfPytorchKinematics(Engine):
    """`build_chain_from_urdf(...).to(dtype=float64)`: all links of the tree, one batched call per block."""

    source = "urdf:pytorch-kinematics"
    resolution = 1e-6  # float32 origins, summed over a long arm
    requirements = ("pytorch-kinematics>=0.7", "torch>=2.4")
    traits = (
        Trait(
            "float32-origins",
            "joint origins are built in float32 even when the chain is float64: 1e-8 to 4e-8 a joint",
            "pytorch-kinematics 0.10.0 on one-joint URDFs; torch.set_default_dtype does not help",
        ),
        Misreading(
            "missing-axis-z",
            "a joint without <axis> turns about z; the specification says x",
            "pytorch-kinematics 0.10.0 on a one-joint URDF",
            lint="missing-axis",
        ),
        Misreading(
            "mimic-independent",
            "a mimic joint is an independent degree of freedom",
            "pytorch-kinematics 0.10.0: a follower stays at zero when only its leader is set",
            lint="mimic",
        ),
        Refusal(
            "no-floating-planar",
            "floating and planar joints raise KeyError",
            "pytorch-kinematics 0.10.0 on a one-joint URDF",
            lint="unsupported-joint",
        ),
        Trait("joints-depth-first", "joints are ordered depth first, not as written", "order jz1 jz2 ja1 ja2"),
        *refusals(
            "pytorch-kinematics 0.10.0",
            {
                "undeclared-prefix": "XMLSyntaxError, 'Namespace prefix drake for acceleration on limit is not defined'",
                "default-namespace": "UnboundLocalError: it finds no link",
                "limit-without-effort": "ParseError, 'Required attribute not set in XML: effort'",
                "limit-without-velocity": "ParseError, 'Required attribute not set in XML: velocity'",
                "limit-not-a-number": "ParseError, 'could not convert string to float'",
                "fixed-axis-without-xyz": "AttributeError, 'NoneType' object has no attribute 'split'",
                "fixed-axis-not-numbers": "ValueError, 'could not convert string to float'",
                "fixed-limit-not-a-number": "ParseError, 'could not convert string to float'",
                "fixed-mimic-not-a-number": "ParseError, 'could not convert string to float'",
            },
        ),
    )

    def __init__(self, description: UrdfText) -> None:
        self._torch = self.library("torch")
        pk = self.library("pytorch_kinematics")
        try:
            with _quiet():
                chain = pk.build_chain_from_urdf(description.text.encode())
                self._chain = chain.to(dtype=self._torch.float64, device="cpu")
        except Exception as error:  # the parser raises whatever its own code happens to hit
            raise EngineFailed(self.source, f"build_chain_from_urdf refused the URDF: {type(error).__name__}: {error}") from error
        self.joints = tuple(self._chain.get_joint_parameter_names())
        self.frames = tuple(self._chain.get_frame_names(exclude_fixed=False))

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        with self._torch.no_grad():
            indices = self._chain.get_frame_indices(*frames)
            poses = self._chain.forward_kinematics(self._torch.from_numpy(np.ascontiguousarray(q)), indices)
            matrices = {name: poses[name].get_matrix().numpy() for name in set(frames)}
        # A link no joint moves comes back as one matrix for the whole batch.
        return np.stack([np.broadcast_to(matrices[name], (q.shape[0], 4, 4)) for name in frames], axis=1)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Its URDF parser reports unknown tags on stderr and through the root logger."""
    level = logging.root.level
    with contextlib.redirect_stderr(io.StringIO()):
        try:
            yield
        finally:
            logging.root.setLevel(level)
