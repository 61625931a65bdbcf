"""The idea of a lower bound in a picture: a disc in a pen, cells of its centre, and their flood."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Cell", "Flooded", "figure_idea", "flood"]

RADIUS = 0.12  # m, of the disc
DOMAIN = (-1.0, 0.0, 2.0)  # m: left and lower edge, and the width of the square
# Left, lower, right and upper edge of the walls [m].
WALLS = ((-1.0, 0.0, 1.0, 0.2), (-0.6, 0.2, -0.45, 1.3), (0.45, 0.2, 0.6, 0.95))
START = (0.0, 0.2 + RADIUS)
OUTSIDE = 0.8  # m, of |x|, from where on it has left
LEVELS = (4, 7)  # halvings of the domain in the two pictures


class Cell(NamedTuple):
    """A square of positions of the disc's centre."""

    x: float
    y: float
    """Place of its middle [m]."""
    half: float
    """Half of its edge [m]."""

    def depth(self) -> float:
        """How deep the disc is in a wall in the middle [m]; negative: it is as far from all."""
        return max(RADIUS + _depth_in(self.x, self.y, wall) for wall in WALLS)

    def blocked(self) -> bool:
        """Whether the disc is in a wall all over the cell."""
        return self.depth() > math.sqrt(2.0) * self.half

    def clear(self) -> bool:
        """Whether it is in none all over the cell."""
        return self.depth() < -math.sqrt(2.0) * self.half

    def touches(self, other: Cell) -> bool:
        """Whether they share an edge."""
        reach = self.half + other.half
        across, along = sorted((abs(self.x - other.x), abs(self.y - other.y)))
        return math.isclose(along, reach) and across < reach * (1 - 1e-9)


class Flooded(NamedTuple):
    """A flood up to where it comes out."""

    cells: list[Cell]
    reached: set[int]
    level: float
    """Highest lower side of the cells on the lowest way out [m]."""


def flood(level: int) -> Flooded:
    """From the start, lowest cell first, over cells of up to so many halvings."""
    cells = list(_cells(level))
    start = next(i for i, cell in enumerate(cells) if _holds(cell, *START))
    heap = [(START[1], start)]
    reached: set[int] = set()
    while heap:
        height, i = heapq.heappop(heap)
        if i in reached:
            continue
        if abs(cells[i].x) + cells[i].half > OUTSIDE:
            return Flooded(cells, reached, height)
        reached.add(i)
        for j, other in enumerate(cells):
            if j not in reached and other.touches(cells[i]) and not other.blocked():
                heapq.heappush(heap, (max(height, other.y - other.half), j))
    return Flooded(cells, reached, math.inf)


def _cells(level: int) -> list[Cell]:
    left, lower, width = DOMAIN
    made, rest = [], [(Cell(left + width / 2, lower + width / 2, width / 2), 0)]
    while rest:
        cell, halvings = rest.pop()
        certain = cell.blocked() or (cell.clear() and halvings > 3)
        if halvings == level or certain:
            made.append(cell)
            continue
        half = cell.half / 2
        for dx in (-half, half):
            rest += [(Cell(cell.x + dx, cell.y + dy, half), halvings + 1) for dy in (-half, half)]
    return made


def _holds(cell: Cell, x: float, y: float) -> bool:
    return max(abs(cell.x - x), abs(cell.y - y)) <= cell.half


def _depth_in(x: float, y: float, wall: tuple[float, float, float, float]) -> float:
    left, lower, right, upper = wall
    across = abs(x - (left + right) / 2) - (right - left) / 2
    along = abs(y - (lower + upper) / 2) - (upper - lower) / 2
    inside = max(across, along)
    return -inside if inside <= 0.0 else -math.hypot(max(across, 0.0), max(along, 0.0))


def figure_idea() -> Figure:
    """With few cells, and with more."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4.6), dpi=160, layout="constrained")
    for place, level in enumerate(LEVELS, 1):
        _draw(figure.add_subplot(1, 2, place), flood(level))
    return figure


def _draw(ax: Axes, flooded: Flooded) -> None:
    from matplotlib.patches import Circle, Rectangle

    for i, cell in enumerate(flooded.cells):
        color = "0.75" if cell.blocked() else "#9ecae9" if i in flooded.reached else "white"
        corner, edge = (cell.x - cell.half, cell.y - cell.half), 2 * cell.half
        ax.add_patch(Rectangle(corner, edge, edge, facecolor=color, edgecolor="0.6", linewidth=0.2))
    for left, lower, right, upper in WALLS:
        size = (right - left, upper - lower)
        ax.add_patch(Rectangle((left, lower), *size, facecolor="none", edgecolor="black"))
    ax.add_patch(Circle(START, RADIUS, facecolor="#F0E442", edgecolor="black"))
    ax.plot(*START, "k.", markersize=4)
    barrier = max(upper for *_, upper in WALLS[2:]) + RADIUS
    ax.axhline(barrier, color="black", linestyle="--", linewidth=1, label="the barrier")
    ax.axhline(flooded.level, color="#D55E00", linewidth=1.5, label="the lower bound")
    ax.set_xlim(DOMAIN[0], DOMAIN[0] + DOMAIN[2])
    ax.set_ylim(DOMAIN[1], DOMAIN[1] + DOMAIN[2])
    ax.set_aspect("equal")
    ax.set_title(f"{len(flooded.cells)} cells", fontsize=9)
    ax.tick_params(labelsize=7)
    ax.legend(frameon=True, fontsize=7, loc="upper right")
