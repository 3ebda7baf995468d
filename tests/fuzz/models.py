"""Robot models as nested data, by file name: packaged ones and random ones. The URDF is one of the files."""

from __future__ import annotations

import math
import random
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from harness.convert.export_urdf import export_urdf
from harness.description.locate import default_models_dir
from harness.description.model import load_model
from tests.fuzz.damage import UNDAMAGED, Damage, put
from tests.fuzz.trees import CHILDREN, csv_text, renamed, toml_text
from tests.fuzz.urdfs import element, parsed, real, xml_text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROBOTS = ("stanford", "humanoid_arm", "sixr", "ur5e")
RANDOM = 100
URDF = "arm.urdf"
FILES = ("model.toml", "frames.toml", "configurations.toml", "dh.csv", URDF)
ANGLES = (0, "pi/2", "-pi/2", "pi", 1.5708, 0.3)


@cache
def packaged(robot: str) -> dict[str, Any]:
    """A model that comes with the package; its URDF beside it."""
    folder = default_models_dir() / robot
    model: dict[str, Any] = {name: tomllib.loads((folder / name).read_text()) for name in FILES[:3]}
    lines = [line.split("#")[0].strip() for line in (folder / "dh.csv").read_text().splitlines()]
    model["dh.csv"] = [[_number(cell) for cell in line.split(",")] for line in lines if line]
    model[URDF] = real(model["model.toml"]["urdf"]["file"])
    model["model.toml"]["urdf"]["file"] = URDF
    model["model.toml"]["source"] = [{"name": "dh:pinocchio"}, {"name": "urdf:pinocchio"}]
    return model


def _number(cell: str) -> Any:
    try:
        return float(cell)
    except ValueError:
        return cell.strip()


@cache
def generated(number: int) -> dict[str, Any]:
    """A random model, the same for the same number: a table, the URDF made of it, the same frames in both.

    Half of them have besides what few models need: other joint names and zeros, measured offsets, claims, deviations.
    """
    source = random.Random(number)
    kinds = ["revolute", *source.choices(["revolute", "revolute", "prismatic", "fixed"], k=source.randint(0, 6))]
    rows = [
        [f"j{i}", kind, _length(source), source.choice(ANGLES), _length(source), source.choice(ANGLES)]
        for i, kind in enumerate(kinds, start=1)
    ]
    n = sum(kind != "fixed" for kind in kinds)
    model: dict[str, Any] = {
        "model.toml": {
            "name": f"robot{number}",
            "description": "a random arm",
            "convention": source.choice(["standard", "modified"]),
            "gate": source.choice(["sampled", "sampled", "sampled", "certified"]),
            "provenance": {"document": "none"},
            "tolerance": {"position": 1e-9, "rotation": 1e-9},
            "source": [{"name": "dh:pinocchio"}],
        },
        "dh.csv": [["joint", "type", "a", "alpha", "d", "theta"], *rows],
        "frames.toml": {"frame": [{"name": str(label), "dh": label} for label in (0, *range(1, len(rows) + 1), "tool")]},
        "configurations.toml": {
            "configuration": [
                {"name": "one", "unit": source.choice(["deg", "rad"]), "q": [round(source.uniform(-1, 1), 2) for _ in range(n)]}
            ],
            "random": {"limits": {row[0]: [-0.5, 0.5] for row in rows if row[1] == "prismatic"}},
        },
    }
    if source.random() < 0.5:
        model["model.toml"]["tool"] = {"xyz": [0, 0, 0.1], "rpy": [0, "pi/2", 0]}
    with tempfile.TemporaryDirectory() as temporary:
        model[URDF] = parsed(export_urdf(load_model(written(model, Path(temporary)))).encode())
    model["model.toml"]["urdf"] = {"file": URDF}
    model["model.toml"]["source"].append({"name": "urdf:pinocchio", "required": source.random() < 0.5})
    for frame in model["frames.toml"]["frame"]:
        frame["urdf"] = f"dh_{frame['dh']}"
    return _elaborate(model, source) if number % 2 else model


def _elaborate(model: dict[str, Any], source: random.Random) -> dict[str, Any]:
    """The model with every key that a file may have, or nearly so."""
    frames = model["frames.toml"]
    if len(frames["frame"]) > 3:
        frames["frame"][1]["rigid"] = True
    frames["frame"].append({"name": "camera", "urdf": "camera", "of": "tool", "xyz": [0, 0, 0.1], "rpy": [0, 0, "pi"]})
    frames["engine"] = {"urdf:pinocchio": {"without": ["camera"]}, "urdf:ikpy": {"base": "0", "tip": "tool", "frames": {}}}
    model = renamed(model, "j1", "J 1")
    model[URDF] = renamed(model[URDF], "J 1", "first_joint")
    model[URDF][CHILDREN] += [
        element("link", name="camera"),
        element(
            "joint", element("parent", link="dh_tool"), element("child", link="camera"),
            element("origin", xyz=[0.0, 0.0, 0.1], rpy=[0.0, 0.0, math.pi]), name="camera_joint", type="fixed",
        ),
    ]  # fmt: skip
    movable = [row[0] for row in model["dh.csv"][2:] if row[1] != "fixed"]
    coupling = {"coupling": {source.choice(movable): 1}} if movable and source.random() < 0.3 else {}
    model["frames.toml"]["joints"] = {"J 1": {"urdf": "first_joint", "sign": source.choice([1, 1, -1]), "offset": 0, **coupling}}
    claim = {"dh": "tool", "tolerance": 1e-3, "provenance": "a page", "status": "wrong", "reason": "made up"}
    model["configurations.toml"]["configuration"][0]["published"] = [
        {**claim, "position": [9, 9, 9], "rpy": [0, 0, 0]},
        {**claim, "relative_to": 0, "matrix": [[1, 0, 0, 9], [0, 1, 0, 9], [0, 0, 1, 9]], "rotation_tolerance": 2},
    ]
    model["model.toml"]["accepted"] = [
        {"source": "urdf:*", "frame": ["tool"], "position": 0.1, "within": 0.5, "reason": "none", "cause": {"J 1": {"d": 0.1}}}
    ]
    return model


def _length(source: random.Random) -> float:
    return source.choice([0.0, 0.1, round(source.uniform(-1, 1), 4)])


def written(model: Any, folder: Path, damage: dict[str, Damage] | None = None) -> Path:
    """Write the files of a model into a folder. Returns it."""
    texts = dict.fromkeys(FILES[:3], toml_text) | {"dh.csv": csv_text, URDF: xml_text}
    for name in FILES if isinstance(model, dict) else ():
        if name in model:
            put(folder / name, texts[name](model[name]), (damage or {}).get(name, UNDAMAGED))
    return folder
