"""The URDF's visual meshes in a viser scene, where their files exist."""

from __future__ import annotations

import contextlib
import importlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from harness import se3
from harness.description.model import RobotModel
from harness.se3 import Array
from harness.view.scene import quaternion

GLASS = (0.7, 0.72, 0.76, 0.35)  # the skeletons are inside
PACKAGE = "package://"


def mesh_path(name: str, urdf: Path) -> Path | None:
    """The file of a mesh of a URDF: `package://NAME/REST` is looked for in the folders above it; None if it is not there."""
    rest = name.removeprefix(PACKAGE).removeprefix("file://")
    inside = rest.split("/", 1)[-1]
    for folder in urdf.parents:
        for candidate in (folder / rest, folder / inside):
            if candidate.is_file():
                return candidate
    return None


class Meshes:
    """The URDF as yourdfpy loads it, drawn by viser, following the model's joints. `note`: why there is nothing to show."""

    def __init__(self, server: Any, model: RobotModel) -> None:
        self.note = ""
        self._shown: Any = None
        self._model = model
        if model.urdf is None:
            self.note = "the model has no URDF"
            return
        file, missing = Path(model.urdf.path), list[str]()

        def handler(fname: str, **_: Any) -> str:
            path = mesh_path(fname, file)
            if path is None:
                missing.append(fname)
            return str(path or fname)

        def why(otherwise: str) -> str:
            return f"{len(missing)} mesh files are not here, e.g. {missing[0]}" if missing else otherwise

        try:
            yourdfpy = importlib.import_module("yourdfpy")
            extras = importlib.import_module("viser.extras")
            with contextlib.redirect_stdout(io.StringIO()):
                self._urdf = yourdfpy.URDF.load(
                    str(file), filename_handler=handler, load_meshes=True, build_scene_graph=True, force_mesh=True
                )
            self._frame = server.scene.add_frame("/meshes", show_axes=False)
            self._shown = extras.ViserUrdf(server, self._urdf, root_node_name="/meshes", mesh_color_override=GLASS)
        except Exception as error:  # a picture is missing; what is compared is not
            self.note = f"no meshes: {why(f'{type(error).__name__}: {error}')}"
            return
        if self._urdf.scene is None or not self._urdf.scene.geometry:
            self.note = why("the URDF has no visual geometry")

    def move(self, q: Array) -> None:
        """Set joints to q (n,); everything is drawn in the base frame, so the meshes are moved to where it is in the URDF."""
        if self._shown is None:
            return
        joints = list(self._urdf.actuated_joint_names)
        values = self._model.joint_map("urdf").values(q[None, :], tuple(joints))[0] if joints else np.zeros(0)
        self._shown.update_cfg(values)
        base = self._model.frames.base.urdf
        T = se3.inverse(self._urdf.get_transform(base)) if base else np.eye(4)
        self._frame.position, self._frame.wxyz = T[:3, 3], quaternion(T[:3, :3])

    def show(self, visible: bool) -> None:
        """Show or hide them."""
        if self._shown is not None:
            self._frame.visible = visible
