"""Where robot models and URDFs lie: a checkout, an installed wheel, or another installed data package."""

from __future__ import annotations

import os
import re
from importlib import metadata
from pathlib import Path, PurePosixPath

from harness.errors import DescriptionUnavailable, ModelFileError, nearest

_PACKAGE = Path(__file__).resolve().parent.parent


def default_models_dir() -> Path:
    """models/ of the wheel (`harness/_data/models`) or, in a checkout, beside the package."""
    packaged = _PACKAGE / "_data" / "models"
    return packaged if packaged.is_dir() else _PACKAGE.parent / "models"


def comes_with_the_package(folder: Path) -> bool:
    """Whether this is the folder of a robot model that comes with the package."""
    return folder.resolve().parent == default_models_dir().resolve()


def model_folders(models: Path) -> dict[str, Path]:
    """Every folder of `models` that has a model.toml, by folder name. Raises ModelFileError if there is none."""
    if not models.is_dir():
        raise ModelFileError("no such folder of robot models", where=models)
    folders = {p.parent.name: p.parent for p in sorted(models.glob("*/model.toml"))}
    if not folders:
        raise ModelFileError("expected folders with a model.toml, found none", where=models)
    return folders


def find_model(robot: str, models: Path) -> Path:
    """The folder of one robot: a path if it has a slash, else a name under `models`. Raises ModelFileError."""
    path = Path(robot)
    is_model = (path / "model.toml").is_file()
    if is_model and os.sep in robot:
        return path
    folders = model_folders(models)
    if robot in folders:
        return folders[robot]
    if is_model:
        return path
    raise ModelFileError(f"no robot model {robot!r}; {nearest(robot, folders)}", where=models)


def locate_urdf(file: str, package: str | None, folder: Path) -> Path:
    """Path of a model's URDF.

    Without `package`: beside the model's files, or in the urdf/ folder next to the models/ folder. With it: the one file
    of that installed distribution whose path ends in `file`. Raises ModelFileError, DescriptionUnavailable.
    """
    if package is None:
        candidates = [folder / file, folder.parent.parent / "urdf" / file, default_models_dir().parent / "urdf" / file]
        for candidate in candidates:
            if candidate.is_file():
                return candidate
        present = [p.name for c in candidates[1:] if c.parent.is_dir() for p in c.parent.iterdir()]
        raise ModelFileError(
            f"no URDF {file!r} under urdf/; {nearest(file, present)}", where=folder / "model.toml", key="urdf.file"
        )
    return packaged_file(package, file, folder / "model.toml", "urdf.file")


def packaged_file(package: str, file: str, where: Path | None = None, key: str | None = None) -> Path:
    """The one file of an installed distribution whose path ends in `file`. Raises ModelFileError, DescriptionUnavailable."""
    try:
        files = metadata.files(package) or []
    except ValueError:  # no name at all
        raise ModelFileError(f"expected the name of an installed package, got {package!r}", where=where, key=key) from None
    except metadata.PackageNotFoundError:
        place = f"{where}: urdf.package: " if where else ""
        # Only a name is offered for pasting: an option, an address or a path would install something else.
        way_out = f"; pip install {package}" if re.fullmatch(r"[A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9])?", package) else ""
        raise DescriptionUnavailable(f"{place}{package} is not installed{way_out}") from None
    wanted = PurePosixPath(file).parts
    matches = [f for f in files if PurePosixPath(str(f)).parts[-len(wanted) :] == wanted]
    if len(matches) != 1:
        urdfs = [str(f) for f in files if str(f).endswith(".urdf")]
        why = f"{len(matches)} files end in it" if matches else nearest(file, urdfs)
        raise ModelFileError(f"no such file {file!r} in {package}: {why}", where=where, key=key)
    return Path(str(matches[0].locate())).resolve()
