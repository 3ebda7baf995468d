from __future__ import annotations

import math
from pathlib import Path

import pytest

from harness.description.dh import DHRow, DHTable
from harness.description.dh_csv import read_dh_csv
from harness.errors import ModelFileError

HEADER = "joint,type,a,alpha,d,theta\n"


def read(tmp_path: Path, text: str) -> tuple[DHRow, ...]:
    path = tmp_path / "dh.csv"
    path.write_text(text)
    return read_dh_csv(path)[0]


def test_own_format(tmp_path: Path) -> None:
    text = HEADER + "a,revolute,0,pi/2,0.1,-pi\n\n# a comment\nb,prismatic,1,0,0,0 # and another\nc,fixed,0,0,0.5,\n"
    assert read(tmp_path, text) == (
        DHRow(name="a", kind="revolute", a=0.0, alpha=math.pi / 2, d=0.1, theta=-math.pi),
        DHRow(name="b", kind="prismatic", a=1.0, alpha=0.0, d=0.0, theta=0.0),
        DHRow(name="c", kind="fixed", a=0.0, alpha=0.0, d=0.5, theta=0.0),
    )


def test_the_articles_format(tmp_path: Path) -> None:
    """`name,a,alpha,d,theta_offset` with comments and spaces, every row revolute."""
    text = "# UR5, standard DH\nname, a, alpha, d, theta_offset\nshoulder_pan, 0, 1.5707963267948966, 0.089159, 0\n"
    assert read(tmp_path, text) == (DHRow(name="shoulder_pan", kind="revolute", a=0.0, alpha=math.pi / 2, d=0.089159, theta=0.0),)


def test_windows_line_ends_and_byte_order_mark(tmp_path: Path) -> None:
    assert len(read(tmp_path, "\ufeff" + (HEADER + "a,revolute,0,0,1,0\n").replace("\n", "\r\n"))) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected a header and at least one row"),
        (HEADER, "expected a header and at least one row"),
        ("joint,type,a,alfa,d,theta\n", r"dh.csv:1: unknown column 'alfa'; did you mean 'alpha'\?"),
        ("joint,a,a,d\n", "dh.csv:1: column 'a' is there twice"),
        ("joint,a,d\n", "dh.csv:1: column 'alpha' is missing"),
        (HEADER + "a,revolute,0,0,0\n", r"dh.csv:2: expected 6 cells .* got 5"),
        (HEADER + ",revolute,0,0,0,0\n", "dh.csv:2: expected a joint name"),
        (HEADER + "a,revolut,0,0,0,0\n", r"dh.csv:2: unknown joint type 'revolut'; did you mean 'revolute'\?"),
        (HEADER + "a,revolute,nan,0,0,0\n", "dh.csv:2: column 'a': expected a finite number, got 'nan'"),
        (HEADER + "a,revolute,0,0,inf,0\n", "dh.csv:2: column 'd': expected a finite number, got 'inf'"),
        (HEADER + "a,revolute,0,sin(1),0,0\n", "dh.csv:2: column 'alpha': expected a number or a multiple of pi"),
        (HEADER + "a,revolute,0,0,0,0\nb,revolute,0,0,0,0\na,fixed,0,0,0,0\n", "dh.csv:4: duplicate joint 'a', first on line 2"),
        (HEADER + "".join(f"j{i},revolute,0,0,0,0\n" for i in range(1001)), "expected at most 1000 rows, got more"),
    ],
)
def test_one_clear_error(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ModelFileError, match=message) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_not_text(tmp_path: Path) -> None:
    (tmp_path / "dh.csv").write_bytes(b"joint\xff\xfe")
    with pytest.raises(ModelFileError, match="expected UTF-8 text"):
        read_dh_csv(tmp_path / "dh.csv")


def test_absent_names_the_nearest(tmp_path: Path) -> None:
    (tmp_path / "dh.cvs").touch()
    with pytest.raises(ModelFileError, match=r"no such file; did you mean 'dh.cvs'\?"):
        read_dh_csv(tmp_path / "dh.csv")


def test_suspect_numbers_are_told(tmp_path: Path) -> None:
    path = tmp_path / "dh.csv"
    path.write_text(HEADER + "a,revolute,0,1.5708,0,0\nb,revolute,0,90,0,0\nc,revolute,1.5708,pi/2,0.785,0\n")
    found = read_dh_csv(path)[1]
    assert [(s.where, s.why.split(",")[0]) for s in found] == [
        ("dh.csv:2: a alpha", "1.5708 is pi/2 cut short"),
        ("dh.csv:3: b alpha", "90 rad is more than a turn: degrees?"),
    ]


def test_the_kind_of_a_row_that_is_not_there() -> None:
    table = DHTable((DHRow(name="elbow", kind="prismatic", a=0.0, alpha=0.0, d=0.0, theta=0.0),))
    assert table.kind("elbow") == "prismatic"
    with pytest.raises(KeyError, match=r"no row 'elbo'; did you mean 'elbow'"):
        table.kind("elbo")
