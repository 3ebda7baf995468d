"""A comparison half done, as a document that can be written, read back and continued: no digit is lost, nothing is believed."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from harness.comparison.compare import Comparison, Pair, Validity
from harness.comparison.statistics import BINS, Stream

Count = Annotated[int, Field(ge=0, lt=2**62)]
Index = Annotated[int, Field(ge=-1, lt=2**62)]  # -1: none
Size = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Part(BaseModel):
    """Base of all parts: immutable, no unknown keys, no other types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class StreamState(Part):
    """A `Stream`: one entry a frame. max is -1 where nothing was counted; histogram has (bin, count) where something was."""

    count: list[Count]
    total: list[Size]
    max: list[Annotated[float, Field(ge=-1, allow_inf_nan=False)]]
    argmax: list[Index]
    histogram: list[list[tuple[Count, Count]]]


class ValidityState(Part):
    """A `Validity` before anything was asked for again."""

    checked: Count
    invalid: Count
    residual: Size
    first: tuple[Count, Count] | None


class PairState(Part):
    """A `Pair` of the sources a and b."""

    a: str
    b: str
    position: Size
    position_frame: Index
    rotation: Size
    rotation_frame: Index


class ComparisonState(Part):
    """A `Comparison`: its streams and validities by source, its pairs in order."""

    reach: Size
    validity: dict[str, ValidityState]
    position: dict[str, StreamState]
    rotation: dict[str, StreamState]
    pairs: list[PairState]


def state_of(comparison: Comparison) -> ComparisonState:
    """What a comparison has accumulated so far."""
    return ComparisonState(
        reach=comparison.reach,
        validity={
            name: ValidityState(checked=v.checked, invalid=v.invalid, residual=v.residual, first=v.first)
            for name, v in comparison.validity.items()
        },
        position={name: _stream_state(stream) for name, stream in comparison.position.items()},
        rotation={name: _stream_state(stream) for name, stream in comparison.rotation.items()},
        pairs=[
            PairState(
                a=a,
                b=b,
                position=pair.position,
                position_frame=pair.position_frame,
                rotation=pair.rotation,
                rotation_frame=pair.rotation_frame,
            )
            for (a, b), pair in comparison.pairs.items()
        ],
    )


def restore(comparison: Comparison, state: ComparisonState, done: int) -> None:
    """Put a state back into a new comparison of the same sources.

    comparison: has compared nothing yet; unchanged if the state is refused.
    state: what was accumulated.
    done: over how many configurations.

    Raises ValueError if that cannot be the state of such a comparison.
    """
    sources, others, frames = {*comparison.views}, {*comparison.position}, range(comparison.frames)
    _require({*state.validity} == sources and {*state.position} == {*state.rotation} == others, "its sources")
    for pair in state.pairs:
        _require({pair.a, pair.b} <= sources, "a pair of sources")
        _require(pair.position_frame in frames and pair.rotation_frame in frames, "the frame of a pair")
    for name, v in state.validity.items():
        raw = {slot for slot in (*comparison.views[name].slots, comparison.views[name].base) if slot is not None}
        _require(v.checked == done * len(raw) and v.invalid <= v.checked, "the count of placements")
        _require(v.first is None or (v.first[0] < done and v.first[1] in raw), "the first invalid placement")
    position, rotation = (
        {name: _stream(streams[name], comparison.frames, done) for name in comparison.position}
        for streams in (state.position, state.rotation)
    )
    comparison.reach, comparison.position, comparison.rotation = state.reach, position, rotation
    for name in comparison.validity:
        v = state.validity[name]
        comparison.validity[name] = Validity(checked=v.checked, invalid=v.invalid, residual=v.residual, first=v.first)
    comparison.pairs = {
        (pair.a, pair.b): Pair(pair.position, pair.position_frame, pair.rotation, pair.rotation_frame) for pair in state.pairs
    }


def _stream_state(stream: Stream) -> StreamState:
    return StreamState(
        count=stream.count.tolist(),
        total=stream.total.tolist(),
        max=stream.max.tolist(),
        argmax=stream.argmax.tolist(),
        histogram=[[(int(i), int(row[i])) for i in np.flatnonzero(row)] for row in stream.histogram],
    )


def _stream(state: StreamState, frames: int, done: int) -> Stream:
    """The stream with this state. Raises ValueError if there can be none."""
    lengths = [len(column) for column in (state.count, state.total, state.max, state.argmax, state.histogram)]
    _require(lengths == [frames] * 5, "the number of frames")
    stream = Stream(frames)
    for frame, (count, total, largest, argmax, bins) in enumerate(
        zip(state.count, state.total, state.max, state.argmax, state.histogram, strict=True)
    ):
        counted = count > 0
        _require(count <= done and sum(number for _, number in bins) == count, "a count")
        _require(len({i for i, _ in bins}) == len(bins) and all(i < BINS for i, _ in bins), "a histogram")
        _require(argmax < done and counted == (argmax >= 0) == (largest >= 0.0), "a maximum")
        _require(total <= max(largest, 0.0) * count * (1.0 + 1e-9), "a sum")
        for i, number in bins:
            stream.histogram[frame, i] = number
    stream.count[:], stream.total[:] = state.count, state.total
    stream.max[:], stream.argmax[:] = state.max, state.argmax
    return stream


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(f"{what} cannot be")
