"""Which sources take part in a run, and how far each may be off."""

from __future__ import annotations

import contextlib
import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

from harness.description.locate import comes_with_the_package
from harness.description.model import RobotModel
from harness.description.model_file import Tolerance
from harness.engines.registry import REFERENCE, adapter_of, kind_of, registered
from harness.errors import EngineUnavailable, InputError, MappingError, nearest
from harness.run.options import Options
from harness.run.trust import Program, check_allowed, filled_in


@dataclass(frozen=True, kw_only=True)
class Planned:
    """A source that is to run: an engine, or a program of the user's.

    name: source name.
    required: whether the gate fails without it.
    tolerance: how far it may be off, against the in-house FK.
    command: the program, which speaks the worker protocol; empty for an engine.
    folder: where the program is started; None for one given with --worker.
    """

    name: str
    required: bool
    tolerance: Tolerance
    command: tuple[str, ...] = ()
    folder: Path | None = None


def plan(model: RobotModel, options: Options) -> list[Planned]:
    """The reference first, then the sources of model.toml or those chosen, the commands given, and all engines if asked.

    Chosen ones and commands are required; an engine that model.toml does not list is not. Raises InputError for an unknown
    source, or if nothing is left to compare; UntrustedError for a program of model.toml that `options.trust` does not allow.
    """
    planned = _planned(model, options)
    if not options.trust:
        check_allowed(_own_programs(model, planned))
    return planned


def programs(model: RobotModel, options: Options) -> list[Program]:
    """The programs of the model's own folder that such a run starts, allowed or not. Raises InputError, as `plan` does."""
    return _own_programs(model, plan(model, replace(options, trust=True)))


def _own_programs(model: RobotModel, planned: Sequence[Planned]) -> list[Program]:
    """Those that nobody but model.toml names. A model that comes with the package is no stranger's."""
    if comes_with_the_package(model.folder):
        return []
    entries = [entry.name for entry in model.file.source]
    return [
        Program(
            source=source.name,
            key=f"source[{entries.index(source.name)}].command",
            written=source.command,
            command=filled_in(source.command, model.folder),
            folder=model.folder.resolve(),
            urdf=model.urdf.path if model.urdf else None,
        )
        for source in planned
        if source.command and source.folder is not None
    ]


def _planned(model: RobotModel, options: Options) -> list[Planned]:
    entries = {entry.name: entry for entry in model.file.source}
    commands = {**{e.name: tuple(e.command) for e in entries.values() if e.command}, **dict(options.workers)}
    asked = [options.reference, *options.sources, *dict(options.workers)]
    listed = [] if options.sources else [REFERENCE, *entries]
    more = [name for name in registered() if model.urdf or kind_of(name) != "urdf"] if options.all_engines else []
    planned = []
    for name in dict.fromkeys([options.reference, *listed, *asked, *more]):
        entry = entries.get(name)
        _check_known(name, commands)
        if kind_of(name) == "urdf" and model.urdf is None:
            raise InputError(f"{model.name} has no [urdf] table for it", key=name)
        required = name in (*asked, REFERENCE) or (entry is not None and entry.required)
        tolerance = (entry and entry.tolerance) or model.file.tolerance
        if entry is None and name not in commands:
            tolerance = _no_finer_than(tolerance, name)
        folder = None if name in dict(options.workers) else model.folder
        planned.append(Planned(name=name, required=required, tolerance=tolerance, command=commands.get(name, ()), folder=folder))
    if len(planned) < 2:
        raise InputError(
            f"{model.name}: nothing to compare with the reference {options.reference}",
            hint=f"choose among: {', '.join(entries)}",
        )
    known = {*entries, *commands, *registered()}
    _check_accepted(model, known)
    _check_engine_names(model, known)
    return planned


def _no_finer_than(tolerance: Tolerance, name: str) -> Tolerance:
    """The tolerance of an engine that model.toml does not list: its own resolution counts, if it is coarser."""
    try:
        finest = adapter_of(name).resolution
    except EngineUnavailable:  # broken, and will say so itself
        return tolerance
    return Tolerance(position=max(tolerance.position, finest), rotation=max(tolerance.rotation, finest))


def _check_known(name: str, commands: Mapping[str, tuple[str, ...]]) -> None:
    """Raise InputError unless `name` is a registered source or a command, and not both.

    A broken adapter is known, and will say so itself.
    """
    if name not in commands:
        with contextlib.suppress(EngineUnavailable):
            adapter_of(name)
    elif name in registered():
        raise InputError("this is the name of an engine; give the command another", key=name)


def _check_engine_names(model: RobotModel, known: set[str]) -> None:
    """Refuse what looks like a misspelt engine. A name that nothing is like may be that of a program given with --worker."""
    for name in model.engine_names:
        if name not in known and (set(name) & set("*?[") or not name.strip() or get_close_matches(name, known, 1, 0.75)):
            raise MappingError(
                f"no source {name!r}; {nearest(name, known)}", where=model.folder / "frames.toml", key=f'engine."{name}"'
            )


def _check_accepted(model: RobotModel, known: set[str]) -> None:
    for i, accepted in enumerate(model.file.accepted):
        for source in accepted.sources:
            if not fnmatch.filter(known, source):
                raise MappingError(
                    f"no source {source!r}; {nearest(source, known)}",
                    where=model.folder / "model.toml",
                    key=f"accepted[{i}].source",
                )


def pair_tolerance(a: Planned, reference: Planned) -> tuple[float, float]:
    """Tolerance (m, rad) of a source against the reference.

    Tolerances on file are against the in-house FK; against another reference they add up (triangle inequality).
    """
    if reference.name == REFERENCE:
        return a.tolerance.position, a.tolerance.rotation
    own = [p.tolerance for p in (a, reference) if p.name != REFERENCE]
    return sum(t.position for t in own), sum(t.rotation for t in own)
