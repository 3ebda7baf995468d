"""The page of a view: a slider for each joint, buttons for the configurations worth seeing, live discrepancies."""

from __future__ import annotations

import html
import threading
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.report.text import metres, numbers, plain, radians
from harness.se3 import Array
from harness.view.guard import Guard
from harness.view.meshes import Meshes
from harness.view.messages import clipped
from harness.view.scene import Skeleton
from harness.view.session import Apart, Place, Session

STEP = 0.001  # of a slider [rad or m]
TRIAD = 0.09  # of the reach


class Page:
    """One viser server's page over a session. All state is shared by everyone who has the page open."""

    def __init__(self, server: Any, session: Session, guard: Guard) -> None:
        self._session, self._server, self._guard = session, server, guard
        self.q = np.clip(np.zeros(len(session.model.table.joints)), *self._limits())
        self._moving = threading.RLock()  # q and the sliders
        self._showing = threading.Lock()  # the engines and the scene
        self._is_stale = True
        comparison = session.run.comparison
        reach = max(comparison.reach if comparison else 1.0, 0.1)
        server.scene.set_up_direction("+z")
        # Without the button by which viser would serve the page to the world.
        server.gui.configure_theme(control_width="large", show_share_button=False, show_logo=False)
        camera = server.initial_camera
        camera.position, camera.look_at = (0.95 * reach, 0.95 * reach, 0.8 * reach), (0.0, 0.0, 0.2 * reach)
        server.scene.add_grid("/grid", width=2.0 * reach, height=2.0 * reach, cell_size=0.1)
        self._skeletons = {
            name: Skeleton(server, i, session.frames, TRIAD * reach, named=i == 0) for i, name in enumerate(session.sources)
        }
        self._meshes = Meshes(server, session.model)
        self._text = server.gui.add_html("", order=0.0)
        self._sliders = self._add_sliders(server.gui)
        self._add_sources(server.gui)
        self._add_places(server.gui)
        self.refresh()

    def _limits(self) -> tuple[Array, Array]:
        law = self._session.model.configurations
        return law.lower, law.upper

    def _add_sliders(self, gui: Any) -> list[Any]:
        sliders = []
        lower, upper = self._limits()
        model = self._session.model
        with gui.add_folder("Joints"):
            for i, name in enumerate(model.table.joints):
                unit = "m" if model.table.kind(name) == "prismatic" else "rad"
                low, high = float(lower[i]), float(upper[i])
                slider = gui.add_slider(f"{plain(name)} [{unit}]", low, high, STEP, float(np.clip(self.q[i], low, high)))
                slider.on_update(lambda event, i=i: self._slid(i, event.target.value))
                self._guard.add(slider, (low, high))
                sliders.append(slider)
            zero = gui.add_button("All to zero")
            zero.on_click(lambda _: self.go(np.clip(np.zeros(len(lower)), lower, upper)))
            self._guard.add(zero)
        return sliders

    def _add_sources(self, gui: Any) -> None:
        with gui.add_folder("Sources"):
            for i, name in enumerate(self._session.sources):
                box = gui.add_checkbox(plain(name) + (", the reference" if i == 0 else ""), True)
                box.on_update(lambda event, name=name: self._skeletons[name].show(bool(event.target.value)))
                self._guard.add(box)
            if self._meshes.note:
                gui.add_html(f"<p style='padding:0 1em'>{html.escape(plain(self._meshes.note))}</p>")
            else:
                box = gui.add_checkbox("meshes of the URDF", True)
                box.on_update(lambda event: self._meshes.show(bool(event.target.value)))
                self._guard.add(box)

    def _add_places(self, gui: Any) -> None:
        groups: dict[str, list[Place]] = {}
        for place in self._session.places:
            groups.setdefault(place.kind, []).append(place)
        for kind in ("worst", "published", "singular", "fixed"):
            if kind in groups:
                with gui.add_folder(f"{kind.capitalize()} configurations", expand_by_default=kind != "fixed"):
                    for place in groups[kind]:
                        button = gui.add_button(plain(place.name))
                        button.on_click(lambda _, q=place.q: self.go(q))
                        self._guard.add(button)

    def _slid(self, joint: int, given: object) -> None:
        """A slider was moved. A value that only rounds the one it was set to is no move, nor is one that is no number."""
        lower, upper = self._limits()
        value = clipped(given, float(lower[joint]), float(upper[joint]))
        with self._moving:
            if value is None or abs(self.q[joint] - value) <= 0.51 * STEP:
                return
            self.q[joint] = value
        self.refresh()

    def go(self, q: Array) -> None:
        """Show the configuration q (n,), exactly: sliders show it rounded."""
        with self._moving:
            self.q = np.array(q, dtype=float)
            for slider, value in zip(self._sliders, self.q, strict=True):
                slider.value = float(np.clip(value, slider.min, slider.max))
        self.refresh()

    def refresh(self) -> None:
        """Show q as it is now. While one thread shows, others go: it looks again, and moves do not pile up behind it."""
        self._is_stale = True
        while self._is_stale and self._showing.acquire(blocking=False):
            try:
                self._is_stale = False
                self._show()
            finally:
                self._showing.release()

    def _show(self) -> None:
        """Ask all sources at q, and show what they say."""
        with self._moving:
            q = self.q.copy()
        session = self._session
        placements = session.placements(q)
        for name, skeleton in self._skeletons.items():
            if name in placements:
                skeleton.move(placements[name])
        self._meshes.move(q)
        self._text.content = table(session.reference, session.sources[1:], session.absent, q, session.apart(placements))


def table(reference: str, sources: Sequence[str], absent: Mapping[str, str], q: Array, rows: Sequence[Apart]) -> str:
    """Discrepancies by frame and source as an HTML table; every name is escaped. absent: why sources do not run."""

    def cell(text: str, tag: str = "td", style: str = "") -> str:
        return f"<{tag} style='padding:1px 6px;text-align:left;white-space:nowrap;{style}'>{html.escape(plain(text))}</{tag}>"

    by_frame: dict[str, dict[str, Apart]] = {}
    for row in rows:
        by_frame.setdefault(row.frame, {})[row.source] = row
    lines = ["<tr>" + cell("frame", "th") + "".join(cell(name, "th") for name in sources) + "</tr>"]
    for frame, by_source in by_frame.items():
        cells = [cell(frame, "th")]
        for name in sources:
            one = by_source.get(name)
            text = f"{'' if one.within else '✗ '}{metres(one.position)}, {radians(one.rotation)}" if one else ""
            cells.append(cell(text, style="font-weight:700" if one and not one.within else ""))
        lines.append("<tr>" + "".join(cells) + "</tr>")
    outside = sorted({row.source for row in rows if not row.within})
    head = f"q = {numbers(q)}; off {reference}; outside tolerance: {', '.join(outside) or 'none'}"
    missing = "".join(f"<p>{html.escape(plain(f'{name} does not run: {why}'))}</p>" for name, why in absent.items())
    style = "padding:0 1em;font-size:0.8em;overflow-x:auto"
    return (
        f"<div id='discrepancies' style='{style}'><p>{html.escape(plain(head))}</p><table>{''.join(lines)}</table>{missing}</div>"
    )
