"""Every engine against exact one- and two-joint cases, in the environment it runs in, and every trait it is said to have.

A trait that no longer shows means the engine was mended or has changed: the record must follow. By default these are the
engines that the package's extras install; with CROSSCHECK_TESTS_ENGINES=all, as in `nox -s engines`, all there are.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import ClassVar, TypeAlias

import numpy as np
import pytest

from harness import se3
from harness.convert.derive import derive
from harness.convert.write_model import write_model
from harness.description.dh import DHRow, DHTable
from harness.description.model import RobotModel, load_model
from harness.description.packaged import Packaged
from harness.description.urdf import Urdf
from harness.description.urdf_file import parse_urdf, read_urdf
from harness.description.urdf_lint import lint
from harness.engines import requirements
from harness.engines.base import Description, Engine, Trait
from harness.engines.dh_numpy import DHNumpy
from harness.engines.registry import REFERENCE, adapter_of, description_of, registered
from harness.errors import EngineFailed, EngineUnavailable, InputError
from harness.report.verdicts import Verdict
from harness.run.options import Options
from harness.se3 import Array
from harness.workers.pool import Workers
from tests.conftest import WITHOUT, engines
from tests.helpers import assert_placements_close, crosscheck

Build: TypeAlias = Callable[..., Engine]

ALL = os.environ.get("CROSSCHECK_TESTS_ENGINES") == "all"
URDF_ENGINES: tuple[str, ...] = ("urdf:pinocchio", "urdf:pytorch-kinematics", "urdf:yourdfpy")
MORE_URDF_ENGINES = (
    "urdf:drake",
    "urdf:frax",
    "urdf:idyntree",
    "urdf:ikpy",
    "urdf:kdl",
    "urdf:kinpy",
    "urdf:mujoco",
    "urdf:pinocchio@3.9",
    "urdf:placo",
    "urdf:roboticstoolbox",
    "urdf:urchin",
)
DH_ENGINES: tuple[str, ...] = ("dh:pinocchio",)
MORE_DH_ENGINES = ("dh:kdl", "dh:roboticstoolbox", "dh:sympy")
if ALL:
    URDF_ENGINES, DH_ENGINES = (*URDF_ENGINES, *MORE_URDF_ENGINES), (*DH_ENGINES, *MORE_DH_ENGINES)
FLOAT32 = 2e-7


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    with Workers() as started:
        yield started


@pytest.fixture
def build(workers: Workers) -> Iterator[Build]:
    """Build an engine in a worker; afterwards the worker serves the next test."""
    built: list[Engine] = []

    def start(source: str, description: Description, frames: Sequence[str] = ()) -> Engine:
        names = frames or (description.links if isinstance(description, Urdf) else getattr(description, "frames", ()))
        built.append(workers.load(adapter_of(source), description, names))
        return built[-1]

    yield start
    workers.settle(built)


def urdf(*joints: str) -> Urdf:
    names = ["root", *(f"l{i + 1}" for i in range(len(joints)))]
    links = "".join(f"<link name='{name}'/>" for name in names)
    return parse_urdf(f"<robot name='r'>{links}{''.join(joints)}</robot>".encode(), Path("case.urdf"))


def joint(
    name: str, child: int, kind: str = "revolute", axis: str | None = "0 0 1", extra: str = "", parent: int | None = None
) -> str:
    """Joint `name` from link child - 1 (or `parent`) to link l<child>, 0.5 m along x and 0.25 m up."""
    above = child - 1 if parent is None else parent
    axis_text = "" if axis is None else f"<axis xyz='{axis}'/>"
    return (
        f"<joint name='{name}' type='{kind}'><origin xyz='0.5 0 0.25' rpy='0 0 0'/>"
        f"<parent link='{f'l{above}' if above else 'root'}'/><child link='l{child}'/>"
        f"{axis_text}{extra}<limit lower='-9' upper='9' effort='1' velocity='1'/></joint>"
    )


def placement(engine: Engine, link: str, **q: float) -> Array:
    values = np.array([[q.get(name, 0.0) for name in engine.joints]])
    T: Array = engine.placements(values, [link])[0, 0]
    return T


STEP = se3.translation((0.5, 0.0, 0.25))


def turn(axis: Sequence[float], angle: float) -> Array:
    """Rotation about any axis by Rodrigues' formula, written here independently of the harness."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    T = np.eye(4)
    T[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    return T


def skewed(axis: Sequence[float], angle: float) -> Array:
    """What comes of `n n' + cos (1 - n n') + sin [n]x` with an axis that is not of unit length: no rotation."""
    x, y, z = n = np.array(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    T = np.eye(4)
    T[:3, :3] = np.outer(n, n) + np.cos(angle) * (np.eye(3) - np.outer(n, n)) + np.sin(angle) * K
    return T


CASES = [
    pytest.param(joint("j", 1), STEP @ turn((0, 0, 1), 0.7), id="revolute z"),
    pytest.param(joint("j", 1, axis="-1 0 0"), STEP @ turn((-1, 0, 0), 0.7), id="revolute -x"),
    pytest.param(joint("j", 1, axis="0 0 2"), STEP @ turn((0, 0, 1), 0.7), id="revolute, axis of length 2"),
    pytest.param(joint("j", 1, axis="0.6 0 0.8"), STEP @ turn((0.6, 0, 0.8), 0.7), id="oblique"),
    pytest.param(joint("j", 1, axis="0 1e-16 1"), STEP @ turn((0, 1e-16, 1), 0.7), id="barely oblique"),
    pytest.param(joint("j", 1, axis="1 1 0"), STEP @ turn((1, 1, 0), 0.7), id="oblique, axis of length sqrt 2"),
    pytest.param(joint("j", 1, "continuous"), STEP @ turn((0, 0, 1), 0.7), id="continuous"),
    pytest.param(joint("j", 1, "prismatic", "0 1 0"), STEP @ se3.translation((0, 0.7, 0)), id="prismatic"),
    pytest.param(joint("j", 1, "prismatic", "0.6 0 0.8"), STEP @ se3.translation((0.42, 0, 0.56)), id="prismatic, oblique"),
    pytest.param(joint("j", 1, axis=None), STEP @ turn((1, 0, 0), 0.7), id="no axis"),
    pytest.param(joint("j", 1, "prismatic", "0 0 2"), STEP @ se3.translation((0, 0, 0.7)), id="prismatic, axis of length 2"),
]
_Z = turn((0, 0, 1), 0.7)
_TWICE = STEP @ se3.translation((0, 0, 1.4))
WRONG = {
    ("urdf:pytorch-kinematics", "no axis"): ("missing-axis-z", STEP @ _Z),
    ("urdf:kinpy", "no axis"): ("missing-axis-z", STEP @ _Z),
    ("urdf:yourdfpy", "prismatic, axis of length 2"): ("prismatic-scaled", _TWICE),
    ("urdf:kinpy", "prismatic, axis of length 2"): ("prismatic-scaled", _TWICE),
    ("urdf:ikpy", "prismatic, axis of length 2"): ("prismatic-scaled", _TWICE),
    ("urdf:ikpy", "revolute, axis of length 2"): ("revolute-skewed", STEP @ skewed((0, 0, 2), 0.7)),
    ("urdf:ikpy", "oblique, axis of length sqrt 2"): ("revolute-skewed", STEP @ skewed((1, 1, 0), 0.7)),
    # It turns by 1 rad about the axis, and takes what was z for the axis.
    ("urdf:roboticstoolbox", "oblique"): ("oblique-axis", STEP @ turn((0.6, 0, 0.8), 1.0) @ _Z),
    ("urdf:roboticstoolbox", "barely oblique"): ("oblique-axis", STEP @ turn((0, 1e-16, 1), 1.0) @ _Z),
    ("urdf:roboticstoolbox", "oblique, axis of length sqrt 2"): ("oblique-axis", STEP @ turn((1, 1, 0), 1.0) @ _Z),
    ("urdf:roboticstoolbox", "prismatic, oblique"): (
        "oblique-axis",
        STEP @ turn((0.6, 0, 0.8), 1.0) @ se3.translation((0, 0, 0.7)),
    ),
}
REFUSED = {("urdf:kdl", "no axis"): "missing-axis-refused"}


@pytest.mark.parametrize(("text", "expected"), CASES)
@pytest.mark.parametrize("source", engines(*URDF_ENGINES))
def test_one_joint(source: str, text: str, expected: Array, build: Build, request: pytest.FixtureRequest) -> None:
    """The specification's answer; where a trait says otherwise, the trait's answer, and a lint that warns of it."""
    description = urdf(text)
    case = request.node.callspec.id.removeprefix(f"{source}-")
    if known := WRONG.get((source, case)):
        key, expected = known
        check_lint(source, key, description)
    if (source, case) in REFUSED:
        check_lint(source, REFUSED[source, case], description)
        with pytest.raises(EngineFailed):
            build(source, description)
        return
    engine = build(source, description)
    assert engine.joints == ("j",)
    assert_placements_close(placement(engine, "l1", j=0.7), expected, FLOAT32 if "pytorch" in source else 1e-15)


def check_lint(source: str, key: str, description: Urdf) -> None:
    """The engine's record has the trait, and the URDF's lint warns of what makes it matter."""
    trait = next(t for t in adapter_of(source).traits if t.key == key)
    assert trait.lint in [f.code for f in lint(description)]


@pytest.mark.parametrize("source", engines(*URDF_ENGINES))
def test_mimic(source: str, build: Build) -> None:
    """Given what the harness passes, every engine places the follower where the specification says."""
    description = urdf(
        joint("lead", 1), joint("follow", 2, "continuous", extra="<mimic joint='lead' multiplier='-2' offset='0.25'/>")
    )
    engine = build(source, description)
    keys = {t.key for t in adapter_of(source).traits}
    assert ("mimic-independent" if "follow" in engine.joints else "mimic-applied") in keys
    assert not keys >= {"mimic-independent", "mimic-applied"}
    T = placement(engine, "l2", lead=0.4, follow=-2 * 0.4 + 0.25)
    expected = STEP @ turn((0, 0, 1), 0.4) @ STEP @ turn((0, 0, 1), -0.55)
    assert_placements_close(T, expected, FLOAT32 if "pytorch" in source else 1e-15)


@pytest.mark.parametrize("source", engines(*URDF_ENGINES))
@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_floating_and_planar_joints_are_refused_or_left_alone(source: str, kind: str, build: Build) -> None:
    """Off the chain such a joint may stand; an engine that cannot live with it says so as EngineFailed."""
    description = urdf(joint("j", 1), joint("off", 2, kind, parent=0))
    try:
        T = placement(build(source, description), "l1", j=0.7)
    except (EngineFailed, NotImplementedError, ValueError, KeyError, IndexError):
        assert "no-floating-planar" in {t.key for t in adapter_of(source).traits}
    else:
        assert_placements_close(T, STEP @ turn((0, 0, 1), 0.7), FLOAT32 if "pytorch" in source else 1e-15)


ORDERS = {
    "urdf:drake": ("jz1", "jz2", "ja1", "ja2"),
    "urdf:frax": ("jz1", "ja1", "jz2", "ja2"),
    "urdf:ikpy": ("jz1", "jz2"),
    "urdf:kdl": ("jz1", "jz2", "ja1", "ja2"),
    "urdf:kinpy": ("jz1", "jz2", "ja1", "ja2"),
    "urdf:mujoco": ("jz1", "jz2", "ja1", "ja2"),
    "urdf:pinocchio@3.9": ("ja1", "ja2", "jz1", "jz2"),
    "urdf:placo": ("ja1", "ja2", "jz1", "jz2"),
    "urdf:roboticstoolbox": ("jz1", "jz2", "ja1", "ja2"),
    "urdf:urchin": ("jz1", "ja1", "jz2", "ja2"),
    "urdf:pinocchio": ("ja1", "ja2", "jz1", "jz2"),
    "urdf:pytorch-kinematics": ("jz1", "jz2", "ja1", "ja2"),
    "urdf:yourdfpy": ("jz1", "ja1", "jz2", "ja2"),
}


@pytest.mark.parametrize("source", engines(*URDF_ENGINES))
def test_two_branches_are_told_apart_by_name(source: str, build: Build) -> None:
    """Each engine has an order of its own, and answers by name all the same."""
    text = [joint("jz1", 1), joint("ja1", 2, parent=0), joint("jz2", 3, parent=1), joint("ja2", 4, parent=2)]
    engine = build(source, urdf(*text))
    # iDynTree's order is that of a hash table: it may be another with another build.
    assert engine.joints == ORDERS[source] if source in ORDERS else set(engine.joints) == {"jz1", "jz2", "ja1", "ja2"}
    for link, first, second in (("l3", "jz1", "jz2"), ("l4", "ja1", "ja2")):
        if link not in engine.frames:
            assert "first-child-only" in {t.key for t in adapter_of(source).traits}
            continue
        T = placement(engine, link, **{first: 0.3, second: -0.8})
        assert_placements_close(
            T, STEP @ turn((0, 0, 1), 0.3) @ STEP @ turn((0, 0, 1), -0.8), FLOAT32 if "pytorch" in source else 1e-15
        )


@pytest.mark.parametrize("source", engines("urdf:pytorch-kinematics"))
def test_float32_origins(source: str, build: Build) -> None:
    """0.1 is not a float32: the trait shows even though the chain is float64."""
    text = joint("j", 1).replace("0.5 0 0.25", "0.1 0 0")
    T = placement(build(source, urdf(text)), "l1")
    assert T[0, 3] == np.float64(np.float32(0.1)) != 0.1


TABLES = {
    "standard": DHTable(
        (
            DHRow(name="a", kind="revolute", a=0.3, alpha=0.4, d=0.5, theta=0.6),
            DHRow(name="b", kind="prismatic", a=-0.2, alpha=1.1, d=0.1, theta=-0.7),
        )
    ),
    "modified": DHTable(
        (
            DHRow(name="a", kind="revolute", a=0.3, alpha=0.4, d=0.5, theta=0.6),
            DHRow(name="b", kind="prismatic", a=-0.2, alpha=1.1, d=0.1, theta=-0.7),
        ),
        "modified",
    ),
    "fixed rows, base and tool": DHTable(
        (
            DHRow(name="a", kind="prismatic", a=0.3, alpha=0.4, d=0.5, theta=0.6),
            DHRow(name="f", kind="fixed", a=0.1, alpha=0.2, d=0.3, theta=0.4),
            DHRow(name="b", kind="revolute", a=-0.2, alpha=1.1, d=0.1, theta=-0.7),
            DHRow(name="g", kind="fixed", a=0.0, alpha=-0.3, d=0.2, theta=0.5),
        ),
        "modified",
        se3.from_xyz_rpy((0.1, -0.2, 0.3), (0.3, 0.2, 0.1)),
        se3.from_xyz_rpy((0.0, 0.5, 0.1), (-1.0, 0.4, 2.0)),
    ),
}


@pytest.mark.parametrize("table", TABLES)
@pytest.mark.parametrize("source", engines(*DH_ENGINES))
def test_dh_tables(source: str, table: str, build: Build) -> None:
    """Revolute, prismatic and fixed rows in both conventions, with base and tool, at every frame the engine has."""
    engine, reference = build(source, TABLES[table]), DHNumpy(TABLES[table])
    assert engine.joints == reference.joints
    assert engine.frames[-1] == "tool"
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 2))
    assert_placements_close(engine.placements(q, engine.frames), reference.placements(q, engine.frames), 1e-14)


@pytest.mark.skipif(not ALL, reason="needs the Robotics Toolbox: CROSSCHECK_TESTS_ENGINES=all")
def test_packaged_robots(build: Build) -> None:
    source = "dh:roboticstoolbox-packaged"
    engine = build(source, Packaged("UR5", tuple("abcdef")), ("0", "6"))
    assert engine.joints == tuple("abcdef")
    # Upright, joint 2 at -90 deg and joint 4 at -90 deg, all lengths along z add up: d1 is its author's, not the maker's.
    T = engine.placements(np.radians([[0.0, -90, 0, -90, 0, 0]]), engine.frames)[0]
    assert T[1, 2, 3] == pytest.approx(0.089459 + 0.425 + 0.39225 + 0.09465, abs=1e-12)
    with pytest.raises(EngineFailed, match="no robot 'UR6'"):
        build(source, Packaged("UR6", tuple("abcdef")))
    with pytest.raises(EngineFailed, match="expected 5 joints"):
        build(source, Packaged("UR5", tuple("abcde")))


@pytest.mark.skipif(not ALL, reason="needs ikpy: CROSSCHECK_TESTS_ENGINES=all")
def test_the_mapping_says_where_a_single_chain_ends(models: dict[str, RobotModel]) -> None:
    """Left to itself ikpy ends a UR5 at ee_link, and a UR5e at base, where no joint moves it."""
    for robot, last in (("ur5", "ee_link"), ("ur5e", "tool0")):
        report = crosscheck(models[robot], Options(samples=50, seed=0, sources=("urdf:ikpy",)))
        (source,) = (s for s in report.sources if s.name == "urdf:ikpy")
        assert source.verdict is Verdict.AGREES
        assert last in {f.frame for f in source.frames}
        assert source.read_in == "base_link"
        assert source.absent[0] == "base"


@pytest.mark.skipif(not ALL, reason="needs every engine: CROSSCHECK_TESTS_ENGINES=all")
def test_an_oblique_axis_is_wrong_in_one_library_alone(tmp_path: Path) -> None:
    """Its trait says so, and the report names it; every other engine there is agrees with the derived table."""
    text = "".join(joint(f"j{i}", i, axis=axis) for i, axis in enumerate(("0 0 1", "0 0.6 0.8", "1 0 0"), start=1))
    path = tmp_path / "oblique.urdf"
    path.write_text(f"<robot name='oblique'><link name='root'/><link name='l1'/><link name='l2'/><link name='l3'/>{text}</robot>")
    derived = derive(read_urdf(path), "root", "l3", "standard", "urdf:pinocchio")
    model = load_model(write_model(derived, "oblique", "urdf:pinocchio", tmp_path))
    report = crosscheck(model, Options(samples=200, all_engines=True))
    verdicts = {s.name: s.verdict for s in report.sources if s.name not in WITHOUT}
    assert verdicts.pop("dh:roboticstoolbox-packaged") is Verdict.NOT_RUN
    assert {name for name, verdict in verdicts.items() if verdict not in ("agrees", "reference")} == {"urdf:roboticstoolbox"}
    (wrong,) = (s for s in report.sources if s.name == "urdf:roboticstoolbox")
    assert wrong.verdict is Verdict.DISAGREES
    assert any("taken for z" in text for text in wrong.explained_by)
    assert report.verdict.exit_code == 1


@pytest.mark.parametrize("source", engines(REFERENCE, *DH_ENGINES, *URDF_ENGINES))
def test_batches_equal_single_configurations(models: dict[str, RobotModel], source: str, build: Build) -> None:
    """No state is carried from one configuration to the next, in any order."""
    model = models["panda"]
    engine = build(source, description_of(source, model))
    frames = engine.frames[-3:]
    q = model.joint_map(source.partition(":")[0]).values(model.configurations.random(1, 0, 6), engine.joints)
    batch = engine.placements(q, frames)
    assert_placements_close(engine.placements(q[::-1], frames)[::-1], batch, 1e-15)
    assert_placements_close(np.concatenate([engine.placements(q_k[None], frames) for q_k in q]), batch, 1e-15)


@pytest.mark.parametrize("source", engines(REFERENCE, *DH_ENGINES, *URDF_ENGINES))
def test_wrong_calls(models: dict[str, RobotModel], source: str, build: Build) -> None:
    engine = build(source, description_of(source, models["ur3"]))
    with pytest.raises(ValueError, match=r"expected q of shape \(N, 6\), got \(2, 5\)"):
        engine.placements(np.zeros((2, 5)), engine.frames[:1])
    with pytest.raises(KeyError, match="has no frame 'nowhere'"):
        engine.placements(np.zeros((1, 6)), ["nowhere"])


@pytest.mark.parametrize("source", engines(*URDF_ENGINES))
def test_a_urdf_the_library_refuses(source: str, build: Build) -> None:
    """Two parents: no engine is asked in a run, but each adapter answers or raises EngineFailed."""
    with contextlib.suppress(EngineFailed):
        build(source, urdf(joint("j", 1), joint("k", 1, parent=0)))


def test_the_registry() -> None:
    assert next(iter(registered())) == REFERENCE
    named = {REFERENCE, *DH_ENGINES, *MORE_DH_ENGINES, *URDF_ENGINES, *MORE_URDF_ENGINES, "dh:roboticstoolbox-packaged"}
    assert named <= set(registered())
    with pytest.raises(InputError, match=r"no source 'urdf:pinochio'; did you mean 'urdf:pinocchio'"):
        adapter_of("urdf:pinochio")
    for entry in registered().values():
        assert entry.adapter is not None, entry.problem
        assert all(isinstance(t, Trait) and t.text and t.evidence for t in entry.adapter.traits)
        assert len({t.key for t in entry.adapter.traits}) == len(entry.adapter.traits)


class _Missing(Engine):
    source = "dh:missing"
    requirements: ClassVar[tuple[str, ...]] = ("no-such-distribution>=1", "numpy>=1")

    def __init__(self, description: object) -> None:
        self.library("no_such_module")

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        raise AssertionError


class _TooOld(_Missing):
    source = "dh:too-old"
    requirements = ("numpy>=99",)


class _Broken(_Missing):
    source = "dh:broken"
    requirements = ("numpy>=1",)


@pytest.mark.parametrize(
    ("adapter", "message"),
    [
        (_Missing, "no-such-distribution is not installed; crosscheck engines install dh:missing"),
        (_TooOld, "needs numpy>=99, found numpy"),
        (_Broken, "import no_such_module failed"),
    ],
)
def test_unavailable(adapter: type[Engine], message: str) -> None:

    def start() -> None:
        requirements.check(adapter)
        adapter(None)

    with pytest.raises(EngineUnavailable) as caught:
        start()
    assert message in str(caught.value)
    assert caught.value.exit_code == 3


class _WrongShape(Engine):
    source = "dh:wrong-shape"

    def __init__(self, result: Array) -> None:
        self.joints, self.frames, self._result = ("j",), ("f",), result

    def _placements(self, q: Array, frames: Sequence[str]) -> Array:
        return self._result


@pytest.mark.parametrize("result", [np.zeros((1, 4, 4)), np.zeros((2, 1, 4, 4), dtype=np.float32), np.zeros((1, 1, 4, 4))])
def test_a_result_of_the_wrong_shape_or_type(result: Array) -> None:
    with pytest.raises(EngineFailed, match=r"expected placements float64 \(2, 1, 4, 4\)"):
        _WrongShape(result).placements(np.zeros((2, 1)), ["f"])


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ("requirements = ('acme-fk>=2')", r"requirements: expected a tuple of texts"),
        ("traits = ('drops links',)", "traits: expected a tuple of Trait"),
        ("source = 'acme:fk'", "source: expected dh:NAME or urdf:NAME, got 'acme:fk'"),
        ("source = None", "source: expected dh:NAME or urdf:NAME, got None"),
    ],
)
def test_what_a_class_says_of_itself_is_checked(body: str, problem: str) -> None:
    """A slip in a third party's class must not end the list of all engines."""
    from harness.engines.registry import _check_class  # noqa: PLC0415

    namespace = {"source": "urdf:acme"}
    exec(body, {}, namespace)
    adapter = type("Acme", (_Broken,), namespace)
    with pytest.raises(TypeError, match=problem):
        _check_class(adapter)
