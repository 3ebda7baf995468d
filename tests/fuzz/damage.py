"""What the bytes of a file suffer: cuts, insertions, flips, other encodings; or what stands in the file's place."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from hypothesis import strategies as st

ENCODINGS = (*["utf-8"] * 4, "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "latin-1", "cp1252", "utf-7")
SPECIAL = ("", "missing", "folder", "pipe", "dangling link", "link to itself", "device", "endless device", "large", "unreadable")
PIECES = (
    *("", "\n", "\r", "\r\n", "\x00", "\x1b", "\ufeff", "\u2028", '"', "'", "'''", '"""', "[", "]", "{", "}", "=", ",", ";", "#"),
    *("<", ">", "&", "-", "é", "\ud7ff", "nan", "1e999", "true", "null", "9" * 400, "[[frame]]\n", "[a]\n", "a.b.c = 1\n"),
    *("a." * 300, "[" * 300, '{"a":' * 300, "<a>" * 300, "<!-- -->", "<!--", "<?pi?>", "<![CDATA[", "<link/>", "x:y='1' ", "&e;"),
    *("<!DOCTYPE r [<!ENTITY e 'x'>]>", "<!DOCTYPE r SYSTEM 'file:///etc/passwd'>", "<?xml version='1.1'?>", "\n" * 5000),
)  # fmt: skip


@dataclass(frozen=True)
class Damage:
    """Cuts (where, how much, what is put there), flipped bits, an encoding, and what the file is instead."""

    cuts: tuple[tuple[float, int, str], ...] = ()
    flips: tuple[tuple[float, int], ...] = ()
    encoding: str = "utf-8"
    special: str = ""

    def bytes_of(self, text: str) -> bytes:
        """The damaged text as bytes."""
        for where, cut, piece in self.cuts:
            at = int(where * len(text))
            text = text[:at] + piece + text[at + cut :]
        data = bytearray(text.encode(self.encoding, errors="replace"))
        for where, bit in self.flips if data else ():
            data[int(where * (len(data) - 1))] ^= 1 << bit
        return bytes(data)


UNDAMAGED = Damage()
_parts = st.floats(0, 1)
_cuts = st.lists(
    st.tuples(_parts, st.sampled_from([0, 0, 1, 2, 7, 40, 10**9]), st.sampled_from(PIECES)), min_size=1, max_size=2
).map(tuple)
damages = st.one_of(
    st.builds(Damage, cuts=_cuts),
    st.builds(Damage, flips=st.lists(st.tuples(_parts, st.integers(0, 7)), min_size=1, max_size=3).map(tuple)),
    st.builds(Damage, encoding=st.sampled_from(ENCODINGS)),
    st.builds(Damage, special=st.sampled_from(SPECIAL)),
)
seldom_damaged = st.sampled_from(range(8)).flatmap(lambda n: damages if n == 7 else st.just(UNDAMAGED))


def put(path: Path, text: str, damage: Damage = UNDAMAGED) -> None:
    """Write a text as the damage leaves it, or put something else in the place of the file."""
    path.unlink(missing_ok=True)
    if damage.special == "folder":
        path.mkdir()
    elif damage.special == "pipe":
        os.mkfifo(path)
    elif damage.special in LINKS:
        path.symlink_to(LINKS[damage.special])
    elif damage.special == "link to itself":
        path.symlink_to(path.name)
    elif damage.special == "large":
        path.touch()
        os.truncate(path, 10**11)
    elif damage.special != "missing":
        path.write_bytes(damage.bytes_of(text))
        if damage.special == "unreadable":
            path.chmod(0)


LINKS = {"dangling link": "nowhere", "device": "/dev/null", "endless device": "/dev/zero"}
