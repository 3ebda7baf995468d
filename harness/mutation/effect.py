"""How far a mutant moves what a source would show, by the in-house models alone: what the gate could know at best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.cause import fit
from harness.description.model import RobotModel
from harness.engines.registry import adapter_of, kind_of, registered
from harness.kinematics.descriptions import X_AXIS, Z_AXIS, Reading
from harness.kinematics.recipes import TableRecipe, UrdfRecipe
from harness.mutation.controller import controller
from harness.mutation.mutant import Mutant
from harness.se3 import Array

SAMPLES = 200


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Of one mutant on one source, at each mapped frame (F,): discrepancy and its distance from the original's, [m], [rad]."""

    frames: tuple[str, ...]
    position: Array
    rotation: Array
    position_change: Array
    rotation_change: Array


def effect_of(mutant: Mutant, original: RobotModel, source: str) -> Effect:
    """Without rounding, float32 and all that engines add."""
    law = original.configurations
    q = np.concatenate([law.fixed_q, np.random.default_rng(1).uniform(law.lower, law.upper, (SAMPLES, len(law.lower)))])
    names = tuple(f.name for f in original.frames.frames if kind_of(source) == "dh" or f.urdf is not None)
    T_a, T_b = _pair(mutant.model, source, q, names, mutant.fault or None)
    T_a_original, T_b_original = _pair(original, source, q, names, None)
    D = T_a - T_b
    change = D - (T_a_original - T_b_original)
    return Effect(
        frames=names,
        position=np.linalg.norm(D[..., :3, 3], axis=-1).max(axis=0),
        rotation=np.linalg.norm(D[..., :3, :3], axis=(-2, -1)).max(axis=0) / np.sqrt(2.0),
        position_change=np.linalg.norm(change[..., :3, 3], axis=-1).max(axis=0),
        rotation_change=np.linalg.norm(change[..., :3, :3], axis=(-2, -1)).max(axis=0) / np.sqrt(2.0),
    )


def _pair(model: RobotModel, source: str, q: Array, names: tuple[str, ...], fault: str | None) -> tuple[Array, Array]:
    """Placements (N, F, 4, 4) of the reference and of the source; offsets of rigid frames measured."""
    frames = {f.name: f for f in model.frames.frames if f.name in names}
    labels = {n: (f.dh, np.eye(4) if f.offset is None else f.offset) for n, f in frames.items()}
    T_a = TableRecipe(model.table, labels).mechanism.placements(q, names)
    if fault and kind_of(source) == "dh":
        engine = controller(fault, model)
        raw = engine.placements(q, [frames[n].dh for n in names])
        return T_a, raw @ np.array([labels[n][1] for n in names])
    if kind_of(source) == "dh" or model.urdf is None or model.urdf_joints is None:
        return T_a, T_a
    prismatic = tuple(model.table.kind(j) == "prismatic" for j in model.table.joints)
    links = {n: f.urdf or "" for n, f in frames.items()}
    base, reading = model.frames.base.urdf or "", _reading(source, fault)
    T_b = UrdfRecipe(
        urdf=model.urdf,
        base=base,
        frames=links,
        joints=model.urdf_joints,
        model_joints=model.table.joints,
        prismatic=prismatic,
        reading=reading,
    ).mechanism.placements(q, names)
    rigid = [i for i, n in enumerate(names) if frames[n].offset is None]
    if rigid:
        T_a[:, rigid] = T_a[:, rigid] @ fit.fit_constant_offset(T_a[:, rigid], T_b[:, rigid])
    return T_a, T_b


def _reading(source: str, fault: str | None) -> Reading:
    """How the engine is known to read a URDF, by its traits. The harness passes followers their values."""
    traits: Mapping[str, object] = {t.key: t for t in adapter_of(source).traits} if source in registered() else {}
    return Reading(
        default_axis=Z_AXIS if "missing-axis-z" in traits else X_AXIS,
        stretched="prismatic-scaled" in traits,
        mimic=fault != "mimic ignored",
    )
