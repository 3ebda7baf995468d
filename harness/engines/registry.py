"""Which engines there are: every entry point in the group `fk_crosscheck.engines`, ours and third parties' alike."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata

from harness.description.model import RobotModel
from harness.description.packaged import Packaged
from harness.description.urdf import UrdfText
from harness.engines.base import Description, Engine, Trait
from harness.errors import DescriptionUnavailable, EngineUnavailable, InputError, nearest

GROUP = "fk_crosscheck.engines"
REFERENCE = "dh:numpy"


@dataclass(frozen=True)
class Registered:
    """One entry point.

    Attributes:
        name: source name.
        adapter: the adapter class; None if it could not be imported.
        problem: why it could not be imported; empty if it could.
    """

    name: str
    adapter: type[Engine] | None
    problem: str = ""


@lru_cache(maxsize=1)
def registered() -> dict[str, Registered]:
    """All engines by source name, the in-house one first, then by name.

    The entry point's name is the source name with `-` for `:`. A broken third-party adapter is listed with its problem.
    """
    engines: dict[str, Registered] = {}
    for point in metadata.entry_points(group=GROUP):
        source = point.name.replace("-", ":", 1)
        try:
            adapter = point.load()
            if not (isinstance(adapter, type) and issubclass(adapter, Engine)):
                raise TypeError(f"{point.value} is not a subclass of harness.engines.base.Engine")
            _check_class(adapter)
            entry = Registered(adapter.source, adapter)
        except Exception as error:  # third-party code: whatever it raises must not end the run
            entry = Registered(source, None, f"entry point {point.value}: {type(error).__name__}: {error}")
        if entry.name in engines and engines[entry.name].adapter is not entry.adapter:
            entry = Registered(entry.name, None, f"two packages offer {entry.name}: second is {point.value}")
        engines[entry.name] = entry
    return dict(sorted(engines.items(), key=lambda item: (item[0] != REFERENCE, item[0])))


def _check_class(adapter: type[Engine]) -> None:
    """Raise TypeError for what a third party's class says of itself in another form than the harness reads."""
    source = getattr(adapter, "source", None)
    if not isinstance(source, str) or not source.startswith(("dh:", "urdf:")):
        raise TypeError(f"source: expected dh:NAME or urdf:NAME, got {source!r}")
    for name in ("requirements", "debian", "imports"):
        value = getattr(adapter, name)
        if not isinstance(value, tuple) or not all(isinstance(text, str) for text in value):
            raise TypeError(f'{name}: expected a tuple of texts such as ("numpy>=1.26",), got {value!r}')
    if not isinstance(adapter.traits, tuple) or not all(isinstance(trait, Trait) for trait in adapter.traits):
        raise TypeError(f"traits: expected a tuple of Trait, got {adapter.traits!r}")


def adapter_of(source: str) -> type[Engine]:
    """Adapter class of a source name.

    Raises:
        InputError: there is no such source.
        EngineUnavailable: its adapter cannot be imported.
    """
    known = registered()
    if source not in known:
        raise InputError(f"no source {source!r}; {nearest(source, known)}")
    entry = known[source]
    if entry.adapter is None:
        raise EngineUnavailable(source, entry.problem)
    return entry.adapter


def kind_of(source: str) -> str:
    """Kind of description a source computes from: `urdf` if its name starts so, else `dh`."""
    return "urdf" if source.startswith("urdf:") else "dh"


def description_of(source: str, model: RobotModel, takes: str = "") -> Description:
    """What a source is given: the model's table, its URDF, or the name of a robot that the library ships.

    Args:
        source: source name.
        model: the robot model.
        takes: what the adapter takes, see `Engine.takes`.

    Raises:
        DescriptionUnavailable: it reads a URDF, and the model has none.
        EngineUnavailable: it takes a packaged robot, and frames.toml names none for it.
    """
    if takes == "packaged":
        names = model.engine_names.get(source)
        if names is None or names.robot is None:
            hint = f'in frames.toml, [engine."{source}"] robot = "..."'
            raise EngineUnavailable(source, f"no packaged robot is named: {hint}")
        return Packaged(names.robot, model.table.joints)
    if kind_of(source) == "dh":
        return model.table
    if model.urdf is None:
        raise DescriptionUnavailable(f"{source}: {model.name} has no URDF")
    names = model.engine_names.get(source)
    if names is None or names.tip is None:
        return model.urdf
    link = next(frame.urdf for frame in model.frames.frames if frame.name == names.tip)
    return UrdfText(model.urdf.text, tip=link or "")
