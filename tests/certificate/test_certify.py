"""The certificate: interpolation is exact, bounds hold over random perturbed chains, broken premises are refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.certificate.certify import Evaluate, ascend, certify, found_from, lebesgue, sample
from harness.certificate.interpolation import Axis, coefficient_sum, grid, weights
from harness.certificate.joint_axes import UncertifiableError, joint_axes
from harness.certificate.links import Link, certify_links, sample_links
from harness.description.dh import DHRow, DHTable
from harness.description.model import RobotModel, load_model
from harness.engines import registry
from harness.engines.base import Engine
from harness.engines.dh_numpy import DHNumpy
from harness.engines.registry import Registered
from harness.report.document import Report
from harness.report.source_parts import Certificate
from harness.run.certifying import chain_links
from harness.run.options import Options
from harness.se3 import Array, chord_angle
from tests.helpers import crosscheck

TURN = Axis(True, 1, 0.0, 2 * math.pi)
SLIDE = Axis(False, 1, -0.5, 1.0)


@given(st.integers(0, 4), st.floats(0.5, 20.0), st.integers(0, 10**6))
def test_a_trigonometric_polynomial_is_its_interpolant(degree: int, period: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis, a, b = Axis(True, degree, -1.0, period - 1.0), rng.normal(size=degree + 1), rng.normal(size=degree + 1)

    def f(q: Array) -> Array:
        m = np.arange(degree + 1) * 2 * np.pi / period
        return np.asarray(np.cos(q[:, None] * m) @ a + np.sin(q[:, None] * m) @ b)

    q = rng.uniform(-30, 30, 50)
    assert axis.weights(q) @ f(axis.nodes) == pytest.approx(f(q), abs=1e-11)
    assert np.abs(f(q)).max() <= coefficient_sum([axis], f(axis.nodes)[:, None]) * (1 + 1e-12) + 1e-12
    assert np.abs(axis.weights(q)).sum(axis=-1).max() <= axis.lebesgue * (1 + 1e-12)


@given(st.integers(0, 5), st.integers(0, 10**6))
def test_a_polynomial_is_its_interpolant(degree: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis, c = Axis(False, degree, -0.5, 1.5), rng.normal(size=degree + 1)
    q = rng.uniform(-0.5, 1.5, 50)
    assert axis.weights(q) @ np.polyval(c, axis.nodes) == pytest.approx(np.polyval(c, q), abs=1e-10)
    assert (
        np.abs(np.polyval(c, q)).max()
        <= coefficient_sum([axis], np.asarray(np.polyval(c, axis.nodes))[:, None]) * (1 + 1e-12) + 1e-12
    )
    assert np.abs(axis.weights(q)).sum(axis=-1).max() <= axis.lebesgue * (1 + 1e-12)


def test_the_lebesgue_constant_is_five_thirds_and_attained() -> None:
    assert TURN.lebesgue == pytest.approx(5 / 3)
    assert np.abs(TURN.weights(np.array([math.pi / 3]))).sum() == pytest.approx(5 / 3)
    assert lebesgue([TURN] * 6) == pytest.approx((5 / 3) ** 6)


def random_table(rng: np.random.Generator, joints: int) -> DHTable:
    kinds = np.where(rng.random(joints) < 0.25, "prismatic", "revolute")
    rows = tuple(
        DHRow.of(f"j{i}", str(kind), rng.normal(size=4) * [0.4, 1.5, 0.4, 1.5])  # type: ignore[arg-type]
        for i, kind in enumerate(kinds)
    )
    return DHTable(rows, "standard" if rng.random() < 0.5 else "modified")


def perturbed(table: DHTable, rng: np.random.Generator, size: float) -> DHTable:
    change = rng.normal(size=(len(table.rows), 4)) * (rng.random((len(table.rows), 4)) < 0.3) * size
    rows = tuple(
        DHRow(name=r.name, kind=r.kind, a=r.a + c[0], alpha=r.alpha + c[1], d=r.d + c[2], theta=r.theta + c[3])
        for r, c in zip(table.rows, change, strict=True)
    )
    return DHTable(rows, table.convention)


def evaluate(table: DHTable) -> Evaluate:
    frames = [str(i) for i in range(1, len(table.rows) + 1)]
    return lambda q: DHNumpy(table).placements(q, frames)[:, :, :3, :].transpose(0, 1, 3, 2)


def axes_of(table: DHTable) -> list[Axis]:
    return [TURN if row.kind == "revolute" else SLIDE for row in table.rows]


def links_of(table: DHTable) -> list[Link]:
    return [Link(i - 1 if i else None, i, (i,)) for i in range(len(table.rows))]


def largest(D: Array) -> tuple[Array, Array]:
    position = np.linalg.norm(D[:, :, 3], axis=-1).max(axis=0)
    return position, chord_angle(np.linalg.norm(D[:, :, :3].reshape(*D.shape[:2], 9), axis=-1).max(axis=0))


@settings(max_examples=60)
@given(st.integers(0, 10**9), st.integers(3, 5), st.floats(-12, 0))
def test_no_bound_lies_below_what_is_seen(seed: int, joints: int, size: float) -> None:
    """Random chains, randomly perturbed: grid and link-by-link bounds against grid, random and climbed configurations."""
    rng = np.random.default_rng(seed)
    table = random_table(rng, joints)
    a, b, axes = evaluate(table), evaluate(perturbed(table, rng, 10.0**size)), axes_of(table)
    own, other = sample(a, axes, rng), sample(b, axes, rng)
    assert own.holds
    assert other.holds
    bounds = certify(own, other, axes)
    links = links_of(table)
    first, second = (sample_links(e, axes, links, rng) for e in (a, b))
    by_links = certify_links(first, second, axes, links, joints)
    q = np.concatenate([grid(axes), np.column_stack([rng.uniform(axis.lower, axis.upper, 200) for axis in axes])])

    def difference(q: Array) -> Array:
        return np.asarray(a(q) - b(q))

    D = own.values - other.values
    found = found_from(difference, lambda q: np.tensordot(weights(axes, q), D, axes=1), axes, q, 1e-13)
    for i, seen in enumerate(largest(difference(q))):
        assert (seen <= found[i]).all()
        assert (found[i] <= (bounds.position, bounds.rotation)[i]).all()
        assert (found[i] <= (by_links.position, by_links.rotation)[i]).all()


def test_climbing_finds_the_top() -> None:
    """One joint, one lever: |D| is largest where the analysis says, not at a node."""
    a = DHTable((DHRow(name="j", kind="revolute", a=1.0, alpha=0.0, d=0.0, theta=0.0),))
    b = DHTable((DHRow(name="j", kind="revolute", a=1.0, alpha=0.0, d=0.0, theta=0.0),), base=np.eye(4))
    shifted = DHTable(b.rows, base=np.array([[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]))
    stretched = DHTable((DHRow(name="j", kind="revolute", a=1.2, alpha=0.0, d=0.0, theta=0.0),), base=shifted.base)

    def difference(q: Array) -> Array:
        return np.asarray(evaluate(stretched)(q) - evaluate(a)(q))

    top = ascend(difference, [TURN], np.array([[2.0]]), np.array([0]), np.array([0]))
    assert np.linalg.norm(difference(top)[0, 0, 3]) == pytest.approx(0.3, abs=1e-12)  # both shifts along x, at q = 0


def test_a_chain_of_thirty_joints(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    table = DHTable(
        tuple(DHRow(name=f"j{i}", kind="revolute", a=0.1, alpha=math.pi / 2 * (-1) ** i, d=0.05, theta=0.0) for i in range(30))
    )
    longer = DHTable(
        tuple(
            DHRow(name=r.name, kind=r.kind, a=r.a + (1e-4 if i == 12 else 0), alpha=r.alpha, d=r.d, theta=r.theta)
            for i, r in enumerate(table.rows)
        )
    )
    axes, links = axes_of(table), links_of(table)
    a, b = (sample_links(evaluate(t), axes, links, rng) for t in (longer, table))
    assert a.holds
    bounds = certify_links(a, b, axes, links, 30)
    assert bounds.position[11] < 1e-9
    assert bounds.position[29] == pytest.approx(1e-4, rel=1e-3)  # one link longer: shifted by that much, never more
    assert bounds.rotation[29] < 1e-9


# Models ------------------------------------------------------------------------------------------

FAST = ("dh:pinocchio", "urdf:pinocchio")


def certificate(report: Report, name: str) -> Certificate:
    found = next(s.certificate for s in report.sources if s.name == name)
    assert found is not None
    return found


@pytest.mark.parametrize("robot", ["humanoid_arm", "iiwa14", "panda", "sixr", "stanford", "ur10", "ur3", "ur5", "ur5e"])
def test_every_robot_is_certified(models: dict[str, RobotModel], robot: str) -> None:
    report = crosscheck(models[robot], Options(samples=100, seed=0, sources=FAST))
    for name in FAST:
        proof = certificate(report, name)
        assert (proof.status, proof.reason) == ("certified", "")
        assert proof.residual is not None
        assert proof.residual < 1e-13
        source = next(s for s in report.sources if s.name == name)
        assert [b.frame for b in proof.frames] == [f.frame for f in source.frames]
        for bound, frame in zip(proof.frames, source.frames, strict=True):
            assert frame.position.max <= bound.position_found <= bound.position_upper
            assert frame.rotation.max <= bound.rotation_found <= bound.rotation_upper
    if robot != "iiwa14":
        assert "; for all configurations at most" in report.verdict.sentence


def test_ur5_is_proven_to_agree(models: dict[str, RobotModel]) -> None:
    report = crosscheck(models["ur5"], Options(samples=100, seed=0, sources=FAST))
    for name in FAST:
        proof = certificate(report, name)
        assert max(b.position_upper for b in proof.frames) < 1e-10
        assert max(proof.residual or 1, proof.reference_residual or 1) < 1e-12


def test_a_longer_d1_is_bracketed(copy_model: Callable[..., Path]) -> None:
    model = load_model(copy_model("ur5", ("dh.csv", "0.089159", "0.089460")))
    proof = certificate(crosscheck(model, Options(samples=0, seed=0, sources=FAST)), "urdf:pinocchio")
    tool0 = next(b for b in proof.frames if b.frame == "tool0")
    assert tool0.position_found == pytest.approx(0.301e-3, rel=1e-4)
    assert tool0.position_upper == pytest.approx(0.301e-3, rel=1e-4)


def test_iiwas_deviation_is_found_whatever_the_samples(models: dict[str, RobotModel]) -> None:
    """The search behind the certificate finds the largest discrepancy even with no random configuration at all."""
    report = crosscheck(models["iiwa14"], Options(samples=0, seed=0, sources=("urdf:pinocchio",)))
    assert report.verdict.exit_code == 0
    assert max(b.position_found for b in certificate(report, "urdf:pinocchio").frames) == pytest.approx(2 * 0.00043624, rel=1e-6)


class Fake(DHNumpy):
    source = "dh:fake"


class Clamped(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(np.clip(q, -math.pi, math.pi), frames)


class Stale(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(np.concatenate([q[:1], q[:-1]]), frames)


class Coupled(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        q = q.copy()
        q[:, 2] += q[:, 1]
        return super()._placements(q, frames)


class WrappedWrongly(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(np.where(q > math.pi, q - 6.2832, q), frames)


class Degrees(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(np.radians(q), frames)


class Nan(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        T = super()._placements(q, frames)
        return np.where(np.abs(q[:, :1, None, None]) > 3.5, np.nan, T)


class Raises(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        if np.abs(q).max() > 3.5:
            raise ValueError("joint limits exceeded")
        return super()._placements(q, frames)


class ClampedFarOut(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return super()._placements(np.clip(q, -3 * math.pi, 3 * math.pi), frames)


class Infinite(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        T = super()._placements(q, frames)
        T[np.abs(q[:, 0]) > 3.5, :, 0, 3] = np.inf
        return T


class NanInRotation(Fake):
    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        T = super()._placements(q, frames)
        T[np.abs(q[:, 0]) > 4.5, :, 0, 0] = np.nan
        return T


BROKEN = [Clamped, ClampedFarOut, Stale, Coupled, WrappedWrongly, Degrees, Nan, NanInRotation, Infinite, Raises]


@pytest.mark.parametrize("limit", [4096, 10])
@pytest.mark.parametrize("adapter", BROKEN)
def test_a_broken_premise_is_refused(
    models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch, adapter: type[Engine], limit: int
) -> None:
    """On the grid, and link by link."""
    monkeypatch.setattr("harness.run.certifying.GRID_LIMIT", limit)
    known = {**registry.registered(), "dh:fake": Registered("dh:fake", adapter)}
    monkeypatch.setattr(registry, "registered", lambda: known)
    report = crosscheck(models["stanford"], Options(samples=20, seed=0, sources=("dh:fake", "dh:pinocchio"), explain=False))
    proof = certificate(report, "dh:fake")
    assert proof.status == "refused"
    assert proof.frames == []
    assert "dh:fake" in proof.reason
    assert certificate(report, "dh:pinocchio").status == "certified"
    assert "for all configurations" not in report.verdict.sentence


@pytest.mark.parametrize("adapter", [Raises, Clamped])
def test_a_reference_that_breaks_the_premise_ends_no_run(
    models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch, adapter: type[Engine]
) -> None:
    known = {**registry.registered(), "dh:fake": Registered("dh:fake", adapter)}
    monkeypatch.setattr(registry, "registered", lambda: known)
    report = crosscheck(models["stanford"], Options(samples=20, seed=0, sources=("dh:numpy",), reference="dh:fake"))
    proof = certificate(report, "dh:numpy")
    assert proof.status == "refused"
    assert "dh:fake" in proof.reason


def test_the_smaller_of_both_forms_counts(models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch) -> None:
    both = certificate(crosscheck(models["ur5e"], Options(samples=20, seed=0, sources=FAST, explain=False)), "urdf:pinocchio")
    monkeypatch.setattr("harness.run.certifying.GRID_LIMIT", 10)
    links = certificate(crosscheck(models["ur5e"], Options(samples=20, seed=0, sources=FAST, explain=False)), "urdf:pinocchio")
    assert (both.form, links.form) == ("grid", "links")
    for a, b in zip(both.frames, links.frames, strict=True):
        assert a.position_upper <= b.position_upper
        assert a.rotation_upper <= b.rotation_upper


def test_an_engine_that_clamps_agrees_within_limits_but_not_at_the_gate(
    copy_model: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sampled inside the limits nothing is seen; `gate = "certified"` does not let it pass."""
    known = {**registry.registered(), "dh:fake": Registered("dh:fake", Clamped)}
    monkeypatch.setattr(registry, "registered", lambda: known)
    folder = copy_model("sixr", ("model.toml", 'name = "dh:pinocchio"', 'name = "dh:fake"'))
    (folder / "configurations.toml").write_text("")
    sampled = crosscheck(load_model(folder), Options(samples=200, seed=0, sources=("dh:fake",), explain=False, probe=False))
    assert sampled.verdict.exit_code == 0
    text = (folder / "model.toml").read_text().replace('convention = "modified"', 'convention = "modified"\ngate = "certified"')
    (folder / "model.toml").write_text(text)
    report = crosscheck(load_model(folder), Options(samples=200, seed=0, sources=("dh:fake",), explain=False, probe=False))
    assert report.verdict.exit_code == 1
    assert "is within tolerance where it was sampled, but dh:fake is not the polynomial" in report.verdict.sentence


@pytest.mark.parametrize(("tolerance", "certify_it", "code"), [("1e-10", True, 0), ("1e-13", True, 1), ("1e-10", False, 1)])
def test_the_certified_gate(copy_model: Callable[..., Path], tolerance: str, certify_it: bool, code: int) -> None:
    folder = copy_model(
        "humanoid_arm",
        ("model.toml", 'convention = "standard"', 'convention = "standard"\ngate = "certified"'),
        ("model.toml", "position = 1e-13\nrotation = 1e-13", f"position = {tolerance}\nrotation = {tolerance}"),
    )
    report = crosscheck(load_model(folder), Options(samples=20, seed=0, sources=("urdf:pinocchio",), certify=certify_it))
    assert report.verdict.exit_code == code
    if code and certify_it:
        assert "can be proven for all configurations" in report.verdict.sentence


def test_coupled_joints_take_more_nodes(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("humanoid_arm")
    with (folder / "frames.toml").open("a") as file:
        file.write("[joints.elbow_flex.coupling]\nshoulder_lift = 1\n[joints.wrist_flex.coupling]\nelbow_flex = 0.5\n")
    model = load_model(folder)
    axes = joint_axes(model)
    assert [(axis.degree, round(axis.upper / (2 * math.pi))) for axis in axes] == [(1, 1), (2, 1), (3, 2), (1, 1)]
    proof = certificate(crosscheck(model, Options(samples=20, seed=0, sources=FAST, explain=False)), "urdf:pinocchio")
    assert (proof.status, proof.nodes) == ("certified", 3 * 5 * 7 * 3)
    assert chain_links(model, list(range(6)))[3].joints == (1, 2)


def test_a_factor_that_is_no_fraction(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("humanoid_arm")
    with (folder / "frames.toml").open("a") as file:
        file.write("[joints.wrist_flex.coupling]\nelbow_flex = 0.12345\n")
    model = load_model(folder)
    with pytest.raises(UncertifiableError, match="'elbow_flex' drives a link by a factor that is no simple fraction"):
        joint_axes(model)
    assert (
        certificate(crosscheck(model, Options(samples=5, seed=0, sources=FAST, explain=False)), "dh:pinocchio").status
        == "refused"
    )


def test_a_joint_that_turns_and_slides(copy_model: Callable[..., Path]) -> None:
    folder = copy_model("stanford")
    with (folder / "frames.toml").open("a") as file:
        file.write("[joints.joint3.coupling]\njoint2 = 0.1\n")
    with (folder / "configurations.toml").open("a") as file:
        file.write("[random.limits]\njoint3 = [0, 1]\n")
    with pytest.raises(UncertifiableError, match="'joint2' turns some links and slides others"):
        joint_axes(load_model(folder))


def test_long_chains_go_link_by_link(models: dict[str, RobotModel], monkeypatch: pytest.MonkeyPatch) -> None:
    """The same model both ways: the composed bounds hold too, and are not absurdly loose."""
    monkeypatch.setattr("harness.run.certifying.GRID_LIMIT", 100)
    report = crosscheck(models["ur5e"], Options(samples=100, seed=0, sources=FAST, explain=False))
    proof = certificate(report, "urdf:pinocchio")
    assert (proof.status, proof.form) == ("certified", "links")
    assert proof.nodes < 60
    for bound in proof.frames:
        assert bound.position_found <= bound.position_upper < 1e-8


def test_a_mimic_follower_on_the_chain(copy_model: Callable[..., Path]) -> None:
    """The wrist turns by -2 times the elbow, which no DH row does: a disagreement, but one with a proven bound."""
    mimic = '<mimic joint="elbow_flex" multiplier="-2" offset="0.1"/>'
    folder = copy_model("humanoid_arm", ("dh.csv", "wrist_flex,revolute", "wrist_flex,fixed"))
    urdf = folder.parent.parent / "urdf" / "humanoid_arm.urdf"
    head, tail = urdf.read_text().split('<joint name="wrist_flex"')
    urdf.write_text(head + '<joint name="wrist_flex"' + tail.replace("<axis", f"{mimic}<axis", 1))
    (folder / "configurations.toml").write_text("")
    model = load_model(folder)
    assert [axis.degree for axis in joint_axes(model)] == [1, 1, 3]
    report = crosscheck(model, Options(samples=300, seed=0, sources=("urdf:pinocchio", "urdf:yourdfpy"), explain=False))
    assert report.verdict.exit_code == 1
    for name in ("urdf:pinocchio", "urdf:yourdfpy"):  # one is passed the follower's value, the other moves it itself
        proof = certificate(report, name)
        assert proof.status == "certified"
        tip = proof.frames[-1]
        assert 0.1 < tip.position_found <= tip.position_upper < 4 * tip.position_found
