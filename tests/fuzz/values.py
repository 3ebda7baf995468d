"""Values that a file may hold, and values that none should hold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

# By which a number is multiplied: it stays one that its place may hold.
FACTORS = (1e-12, 1e-3, 0.5, 0.999999, 1.0000001, 1.01, 2, 3, 25.4, 180 / math.pi, 1000, 1e6, -1)
GENTLE_NUMBERS = (0, 0.0, -0.0, 1, 2, 0.5, 0.089159, 1e-9, 1e-300, 5e-324, 1.5708, 3.1416, 1e5, -1)

# Names that are no mistake, only odd.
ODD = [
    *("x" * 150, "é" * 80, "🤖", "a\u0301", "ﬀ", "İ", "名前", "'", '"', "it's", 'say "x"', "`x`", "$(touch x)", "a${x", "x; y"),
    *("| x", "& x", "\\", "\\n", "a\\", "%s", "%n", "{0}", "{model}", "{{7*7}}", "{% raw %}", "[bold]x[/bold]", "[", "]]", "[/]"),
    *("<b>", "</script>", "<!--plotly-->", "&amp;", "]]>", "../x", "/abs/x", "~", ".", "..", "a/b", "-h", "--help", "con", "*"),
    *("a b", "0", "1.0", "None", "true", "=", ":", "::", "world", "x:y", "a=b", "(", "A", "é", "joint1", "link1", "l1", "j1"),
]  # fmt: skip

NUMBERS: list[Any] = [
    *(-0.0, 1e-300, 5e-324, -5e-324, 1e9, 1e9 + 1, -1e9, 1e6, 1e17, 1e155, 1.7e308, -1e300, math.nan, math.inf, -math.inf),
    *(10**18, 2**31, 2**63, -(2**63), 2**64, 10**309, 10**4000, True, False, 999999, 1 / 3, 1e-17),
]  # fmt: skip
NUMBER_TEXTS = [
    *("", " ", "nan", "NaN", "inf", "-inf", "1e999", "1_0", "٣", "0x10", "1e", "+-1", "1,5", "0,1", "90°", "1 m", ".5", "+1"),
    *("pi", "pi/0", "-3*pi/4", "2pi", "9" * 400, "-" + "9" * 400, "0." + "0" * 400 + "1", "9" * 5000, "1e308", "5e-324", "−1"),
    *("${x}", "$(arg x)", "1;2", "1\u00a0", "\t1", "1e-400", "0" * 3000, "1" + "e" * 300),
]  # fmt: skip
NAMES = [
    *("", " ", "\t", "x" * 150, "x" * 300, "y" * 1001, "z" * 20_000, "é" * 200, "\U0001f916", "\u0301", "ﬀ", "İ", "名前"),
    *("a\nb", "a\r\nb", "\x1b[31mred\x1b[0m", "\x1b]0;t\x07", "\x00", "\x7f", "\x85", "\u2028", "\u202eabc", "\ufeff", "\ud800"),
    *("'", '"', "it's", 'say "x"', "`x`", "$(touch x)", "${x}", "; touch x", "| x", "& x", "\\", "\\n", "a\\", "%s", "%n", "{0}"),
    *("{model}", "{{7*7}}", "{% raw %}", "[bold]x[/bold]", "[", "]]", "[/]", "<b>", "</script>", "<!--plotly-->", "&amp;", "]]>"),
    *("../../x", "/abs/x", "~", ".", "..", "a/b", "-h", "--help", "-", "--", "con", "index", "report.schema", "*", "?", "urdf:*"),
    *("dh:numpy", "dh:pinocchio", "urdf:pinocchio", "urdf:nosuch", "base", "tool", "0", "1", "-1", "99", "1.0", "true", "x,y"),
    *("a" * 60 + " " + "b" * 60, "word " * 900, "#", "a#b", "=", ":", "::", "world", "base_link", "tip", "joint1", "link1"),
]  # fmt: skip


@dataclass(frozen=True)
class Deep:
    """A value in so many levels of nesting, of lists or of tables."""

    levels: int
    lists: bool

    def text(self, entry: str) -> str:
        """Its text. entry: a key and what stands before its value."""
        opening, closing = ("[", "]") if self.lists else ("{" + entry, "}")
        return opening * self.levels + "1" + closing * self.levels


names = st.sampled_from(NAMES) | st.text(max_size=20)
harsh_numbers = st.sampled_from(NUMBERS) | st.floats() | st.integers()
number_texts = st.sampled_from(NUMBER_TEXTS) | st.floats().map(repr)
scalars = st.one_of(harsh_numbers, number_texts, names)
values = st.one_of(
    scalars,
    st.lists(scalars, max_size=4),
    st.dictionaries(names, scalars, max_size=3),
    st.builds(Deep, st.sampled_from([3, 40, 400, 4000, 100_000]), st.booleans()),
    st.sampled_from([[], {}, [[]], [{}], [0.0] * 3, [0.0] * 2000, ["x"] * 3000, None]),
)
gentle_numbers = st.sampled_from(GENTLE_NUMBERS) | st.floats(-4.0, 4.0)
odd_names = st.sampled_from(ODD) | st.text(st.characters(categories=["L", "N"]), min_size=1, max_size=20)
factors = st.sampled_from(FACTORS)

# Elements of XML as nested data, see urdfs.py: what an arm's file may well hold, in the place where it stands or elsewhere.
elements = st.sampled_from(
    [
        {"<>": "axis", "=": {"xyz": [0.0, 0.0, 1.0]}},
        {"<>": "axis", "=": {"xyz": [0.6, 0.0, 0.8]}},
        {"<>": "axis", "=": {}},
        {"<>": "limit", "=": {"lower": -1, "upper": 1, "effort": 1, "velocity": 1}},
        {"<>": "limit", "=": {"lower": 2, "upper": 1, "effort": -1}},
        {"<>": "limit", "=": {"drake:acceleration": 1}},
        {"<>": "mimic", "=": {"joint": "j1", "multiplier": 2, "offset": 0.1}},
        {"<>": "mimic", "=": {"joint": "nobody"}},
        {"<>": "origin", "=": {"xzy": [0, 0, 1]}},
        {"<>": "origin", "=": {"xyz": [0.1, 0, 0], "rpy": [0, 1.5708, 0]}},
        {"<>": "dynamics", "=": {"damping": "x"}},
        {"<>": "visual", "=": {}, "[]": [{"<>": "geometry", "=": {}, "[]": [{"<>": "mesh", "=": {"filename": "package://x"}}]}]},
        {"<>": "gazebo", "=": {"reference": "l1"}},
        {"<>": "transmission", "=": {"name": "t"}, "[]": [{"<>": "joint", "=": {"name": "j1"}}]},
        {"<>": "sensor:camera", "=": {"xmlns:x": "y"}},
        {"<>": "xacro:if", "=": {"value": "1"}},
        {"<>": "link", "=": {"name": "another"}},
        {"<>": "joint", "=": {"name": "another", "type": "fixed"}},
        {"<>": "joints", "=": {}},
        "<!-- a remark -->",
        "<?pi x?>",
        "text",
        "${x}",
    ]
)
