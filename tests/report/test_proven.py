"""What is proven, in words: of the files, at which frames, and in which range of the slides."""

from __future__ import annotations

from harness.report.proof_parts import Equality, FrameBound, Range, Theorem
from harness.report.proven import proven_text


def theorem(word: Equality, position: float, slides: dict[str, Range]) -> Theorem:
    bound = FrameBound(
        frame="tip",
        position_upper=position,
        position_found=0.0,
        rotation_upper=0.0,
        rotation_found=0.0,
        slope=None,
        method="joints",
    )
    return Theorem(frames=[bound], equality={"tip": word}, worst={}, slides=slides)


def test_a_bound_names_the_range_of_the_slides() -> None:
    text = proven_text(theorem("not equal", 2e-3, {"lift": Range(lower=-0.5, upper=10.0)}), ["tip"])
    assert text == (
        "the table and the URDF differ by at most 2.000 mm, 0 rad at every configuration with lift from -0.5 to 10 m (proven)"
    )


def test_the_range_of_a_joint_that_turns_and_slides_is_an_angle() -> None:
    text = proven_text(theorem("not equal", 2e-3, {"screw": Range(lower=-3.0, upper=3.0, unit="rad")}), ["tip"])
    assert "with screw from -3 to 3 rad (proven)" in text


def test_equal_descriptions_are_so_whatever_the_range() -> None:
    text = proven_text(theorem("equal", 0.0, {"lift": Range(lower=0.0, upper=1.5)}), ["tip"])
    assert text == "the table and the URDF are equal at every configuration (proven)"
    assert not proven_text(theorem("equal", 0.0, {}), ["elsewhere"])
