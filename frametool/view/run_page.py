"""A run of turtles as the page of `view`: their frames over time, as their followers saw them in tf."""

from __future__ import annotations

from typing import TYPE_CHECKING

from frametool.frames.buffer import TransformBuffer

if TYPE_CHECKING:
    from frametool.sim.simulate import SimulationStep


class RunPage:
    """Collect the transforms of a run, all of them, for a page."""

    def __init__(self) -> None:
        """Create the page of a run that has not begun."""
        self.buffer = TransformBuffer(name="run")

    def watch(self, step: SimulationStep) -> None:
        """Add the transforms of a step."""
        for stamp_ns, parent, child, transform in step.broadcasts:
            self.buffer.insert(parent, child, transform, stamp_ns)

    def content(self) -> str:
        """Return the page, seen from above."""
        from frametool.view.frame_scene import FrameScene
        from frametool.view.html_page import write_page
        from frametool.view.projection import EYES

        return write_page(FrameScene(self.buffer), title="turtles", file="tf.yaml", eye=EYES["top"])
