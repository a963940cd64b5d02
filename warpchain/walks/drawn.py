"""A walk that draws itself: its figures, its animation, what a notebook shows."""

import os
from functools import partial
from typing import TYPE_CHECKING, Any

from warpchain.pictures.walk_shape import Kind, Walk

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from warpchain.loop.stationary_loop import HeldWalk, StationaryLoop


class Drawn:
    """A walk that can draw itself, also in a notebook."""

    def plot(
        self: Walk,
        kind: Kind = "figure5",
        *,
        figure: "Figure | None" = None,
        ax: "Axes | None" = None,
    ) -> "Figure":
        """Draw the walk.

        Args:
            kind: `figure5` for height and speed of the centre of mass, `film_strip` for the chain itself, `loop` for
                its loop on the sprocket just before the release, `energy` for its energies, `tilt` for tilt, yaw and
                lateral drift of a plane that tilts.
            figure: an empty matplotlib figure to draw into; by default a new one, which a notebook shows.
            ax: where to draw `energy`, the only figure with one pair of axes.

        Returns:
            The figure, that of `ax` if it is given.

        Raises:
            ValueError: the kind is unknown, the walk does not have what it shows (frames, `before_release`,
                energies), or `ax` does not suit the kind.
        """
        from warpchain.pictures.walk_figures import draw

        return draw(self, kind, figure=figure, ax=ax)

    def mean_loop(self: "HeldWalk") -> "StationaryLoop":
        """The loop on its sprocket just before the release: its mean shape, the forces in it, its kink.

        Raises:
            ValueError: the walk has kept nothing of that time, or too little.
        """
        from warpchain.loop.stationary_loop import average_loop

        return average_loop(self)

    def animate(self: Walk, path: str | os.PathLike[str], *, fps: float = 30.0, slow: float = 4.0) -> None:
        """Write a moving picture of the walk; the suffix of `path` gives the format: .gif, .mp4 or .html.

        Args:
            path: the file to write, whole or not at all; an older one is replaced.
            fps: pictures per second of playing time; in a .html file the browser decides.
            slow: playing time per simulated time; in a .html file the value at the start.

        Raises:
            ValueError: the walk has no frames, the suffix is another, `fps` or `slow` is not positive, or a GIF would
                have too many pictures.
            ImportError: an .mp4 is asked for, and imageio-ffmpeg is not installed.
            OSError: the file cannot be written.
        """
        from warpchain.pictures.animation import animate

        animate(self, path, fps=fps, slow=slow)

    def facts(self: Walk) -> list[tuple[str, str]]:
        """Names and values that a notebook shows beside the picture."""
        scene = self.setup.scene
        return [
            ("status", self.status.label if self.status.ok else f"{self.status.label}: {self.status.sentence}"),
            ("distance Δx", f"{self.dx:.4g} m"),
            ("chain", f"{scene.links} links at {scene.frequency:g} Hz, preset {self.setup.preset}"),
        ]

    def _repr_png_(self: Any) -> bytes | None:
        """The film strip, or Figure 5 if there are no frames; None if there is nothing to draw."""
        from warpchain.pictures.inline import first_png

        return first_png(partial(self.plot, kind) for kind in ("film_strip", "figure5"))

    def _repr_html_(self: Any) -> str:
        """The most important numbers, and the picture."""
        from warpchain.pictures.inline import page

        return page(type(self).__name__, self.facts(), self._repr_png_())
