"""The configurations a model is checked at: fixed ones in a stated order, then random ones, each known by its index.

Fixed: zero, the named ones of configurations.toml, and every joint alone at +-90 degrees (prismatic: at its limits).
Random: uniform within limits. Any one can be regenerated from seed and index, whatever the block it was drawn in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from harness.description.dh import DHTable
from harness.description.published import Published, PublishedEntry
from harness.description.values import Name, Number, Strict, Text, checked_angle
from harness.errors import ModelFileError, nearest
from harness.se3 import Array

CHUNK = 1024
LATTICE_POINTS, LATTICE_GENERATOR = 1021, 267


class ConfigurationEntry(Strict):
    """One `[[configuration]]`: `q` in the model's joint order; lengths of prismatic joints are metres in either unit."""

    name: Name = Field(min_length=1)
    unit: Literal["rad", "deg"]
    q: list[Number]
    provenance: Text = ""
    published: list[PublishedEntry] = []


class RandomTable(Strict):
    """`[random]`: ranges that replace the URDF limits, [lower, upper] in rad or m for each joint named."""

    limits: dict[Name, list[Number]] = {}


class ConfigurationsFile(Strict):
    """configurations.toml."""

    configuration: list[ConfigurationEntry] = []
    random: RandomTable = RandomTable()


@dataclass(frozen=True)
class Configuration:
    """One fixed configuration.

    Attributes:
        name: its name, as in reports.
        q: joint values (n,) [rad or m], in the model's order.
        provenance: where it comes from.
        published: what is published about it.
    """

    name: str
    q: Array
    provenance: str = ""
    published: tuple[Published, ...] = ()


@dataclass(frozen=True)
class ConfigurationSet:
    """Fixed configurations, and the law of the random ones. Index 0 ... len(fixed) - 1 is fixed, beyond is random.

    Attributes:
        fixed: the fixed configurations.
        lower: lower ends of the random ranges (n,) [rad or m].
        upper: upper ends of the random ranges (n,) [rad or m].
        revolute: whether each joint is revolute, (n,).
    """

    fixed: tuple[Configuration, ...]
    lower: Array
    upper: Array
    revolute: tuple[bool, ...]

    @cached_property
    def fixed_q(self) -> Array:
        """Joint values of the fixed configurations, (len(fixed), n) [rad or m]."""
        return np.array([c.q for c in self.fixed]).reshape(len(self.fixed), len(self.lower))

    def random(self, seed: int, start: int, count: int) -> Array:
        """Random configurations of one seed, uniform within the ranges.

        They are drawn from Philox (Salmon et al. 2011), keyed by seed and chunk number, so each chunk stands alone. Only the
        raw 64-bit stream is used: NumPy guarantees that it never changes.

        Args:
            seed: the seed, below 2^64.
            start: number of the first; the first random configuration of all is 0.
            count: how many.

        Returns:
            Joint values (count, n) [rad or m].
        """
        n = len(self.lower)
        first, last = start // CHUNK, (start + count + CHUNK - 1) // CHUNK
        chunks: list[Array] = [np.empty((0, n))]
        for chunk in range(first, last):
            raw = np.random.Philox(key=np.array([seed, chunk], dtype=np.uint64)).random_raw(CHUNK * n)
            chunks.append((np.asarray(raw, dtype=np.uint64) >> np.uint64(11)).reshape(CHUNK, n).astype(np.float64) * 2.0**-53)
        unit = np.concatenate(chunks)[start - first * CHUNK :][:count]
        return self.lower + unit * (self.upper - self.lower)

    def lattice(self) -> Array:
        """1021 configurations spread evenly: whole turns for revolute joints, the range for prismatic ones, (1021, n).

        A rank-1 lattice (Korobov 1959): the mean over it is the mean over all configurations, exactly, for every harmonic
        of degree at most 2 in each joint and 6 in all, in up to 7 joints. The generator was found by trying all.
        """
        steps = np.array([pow(LATTICE_GENERATOR, j, LATTICE_POINTS) for j in range(len(self.lower))])
        unit = (np.arange(LATTICE_POINTS)[:, None] * steps % LATTICE_POINTS) / LATTICE_POINTS
        turns = np.array(self.revolute)
        q: Array = np.where(turns, 2 * math.pi * unit, self.lower + unit * (self.upper - self.lower))
        return q

    def block(self, seed: int, start: int, stop: int) -> Array:
        """Configurations `start` ... `stop - 1` by index, fixed then random, (stop - start, n) [rad or m]."""
        k = len(self.fixed)
        head = self.fixed_q[start : min(stop, k)]
        first = max(start, k)
        return np.concatenate([head, self.random(seed, first - k, max(0, stop - first))])

    def one(self, seed: int, index: int) -> Array:
        """The configuration with this index, (n,) [rad or m], as every run with this seed draws it."""
        return np.asarray(self.block(seed, index, index + 1)[0])

    def label(self, index: int) -> str:
        """`zero`, `shoulder +90 deg`, ... or `random[17]`."""
        return self.fixed[index].name if index < len(self.fixed) else f"random[{index - len(self.fixed)}]"


def resolve_configurations(
    file: ConfigurationsFile, table: DHTable, limits: dict[str, tuple[float, float]], path: Path
) -> ConfigurationSet:
    """Check the entries against the table, and add zero and each joint alone.

    Args:
        file: configurations.toml as written.
        table: the DH table.
        limits: (lower, upper) [rad or m] of the joints that have limits, by name.
        path: configurations.toml, for messages.

    Raises:
        ModelFileError: an entry does not fit the table, or a prismatic joint has no range.
    """
    ranges = _ranges(file.random, table, limits, path)
    fixed = [Configuration("zero", np.zeros(len(table.joints)))]
    for i, entry in enumerate(file.configuration):
        key = f"configuration[{i}]"
        if len(entry.q) != len(table.joints):
            raise ModelFileError(
                f"expected {len(table.joints)} values ({', '.join(table.joints)}), got {len(entry.q)}",
                where=path,
                key=f"{key}.q",
            )
        for j, claim in enumerate(entry.published):
            for which, label in (("dh", claim.dh), ("relative_to", claim.relative_to)):
                if str(label) not in table.frames:
                    raise ModelFileError(
                        f"no DH frame {label!r}: expected base, 0 to {len(table.rows)}, or tool",
                        where=path,
                        key=f"{key}.published[{j}].{which}",
                    )
        configuration = Configuration(
            entry.name,
            _radians(entry, table, path, key),
            entry.provenance,
            tuple(_published(claim, entry.unit, path, f"{key}.published[{j}]") for j, claim in enumerate(entry.published)),
        )
        if entry.name == "zero" and not configuration.q.any():
            fixed[0] = configuration
        elif entry.name in {c.name for c in fixed}:
            raise ModelFileError(f"configuration {entry.name!r} is there twice", where=path, key=f"{key}.name")
        else:
            fixed.append(configuration)
    fixed += _one_joint_at_a_time(table, ranges)
    lower, upper = np.array([ranges[j] for j in table.joints]).reshape(-1, 2).T
    return ConfigurationSet(tuple(fixed), lower, upper, tuple(table.kind(j) == "revolute" for j in table.joints))


def _radians(entry: ConfigurationEntry, table: DHTable, path: Path, key: str) -> Array:
    """The joint values in rad and m, (n,). Raises ModelFileError for an angle that is too large."""
    turns = [table.kind(joint) == "revolute" for joint in table.joints]
    values = [math.radians(x) if turn and entry.unit == "deg" else x for turn, x in zip(turns, entry.q, strict=True)]
    for i, (turn, value) in enumerate(zip(turns, values, strict=True)):
        if turn:
            checked_angle(value, path, f"{key}.q[{i}]")
    return np.array(values)


def _published(claim: PublishedEntry, unit: Literal["rad", "deg"], path: Path, key: str) -> Published:
    """The claim in rad and m. Raises ModelFileError for an angle that is too large."""
    for i, value in enumerate(claim.rpy or ()):
        checked_angle(math.radians(value) if unit == "deg" else value, path, f"{key}.rpy[{i}]")
    return Published.from_entry(claim, unit)


def _one_joint_at_a_time(table: DHTable, ranges: dict[str, tuple[float, float]]) -> list[Configuration]:
    single = []
    for i, joint in enumerate(table.joints):
        revolute = table.kind(joint) == "revolute"
        for value in (math.pi / 2, -math.pi / 2) if revolute else ranges[joint]:
            q = np.zeros(len(table.joints))
            q[i] = value
            single.append(Configuration(f"{joint} {math.degrees(value):+.0f} deg" if revolute else f"{joint} {value:+g} m", q))
    return single


def _ranges(
    random: RandomTable, table: DHTable, limits: dict[str, tuple[float, float]], path: Path
) -> dict[str, tuple[float, float]]:
    ranges = dict(limits)
    for joint, pair in random.limits.items():
        key = f"random.limits.{joint}"
        if joint not in table.joints:
            raise ModelFileError(f"no joint {joint!r}; {nearest(joint, table.joints)}", where=path, key=key)
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise ModelFileError(f"expected [lower, upper] with lower < upper, got {pair}", where=path, key=key)
        if table.kind(joint) == "revolute":
            for value in pair:
                checked_angle(value, path, key)
        ranges[joint] = (pair[0], pair[1])
    for joint in table.joints:
        if joint not in ranges:
            raise ModelFileError(
                f"prismatic joint {joint!r} has no range",
                where=path,
                key="random.limits",
                hint=f"add [random.limits] {joint} = [lower, upper] in metres",
            )
    return ranges
