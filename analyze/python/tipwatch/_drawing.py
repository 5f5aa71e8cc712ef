"""Drawings with matplotlib: machines from the right and from above, and logs over time."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from typing import TYPE_CHECKING, Any

import numpy as np

from tipwatch._errors import error

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from tipwatch import Analysis, Machine, Table

# axes of the base frame along the page's right and up: x forward, y left, z up
_VIEWS = {"side": (0, 2), "top": (0, 1)}
# points on a circle
_CIRCLE = 24


def draw(machine: Machine, posture: ArrayLike | None = None, ax: Any = None) -> Any:
    """``Machine.draw``."""
    pyplot = _pyplot("Machine.draw")
    poses, layout = machine.link_poses(posture), machine.layout(posture)
    side, top = pyplot.subplots(1, 2, figsize=(11, 4.5), layout="constrained")[1] if ax is None else _pair(ax)
    links = _Links(machine.urdf)
    for axes, view in ((side, "side"), (top, "top")):
        _draw_links(axes, view, links, poses)
        _draw_wheels(axes, view, machine, layout)
        _draw_balance(axes, view, layout)
        axes.set_aspect("equal")
        axes.set_xlabel("x, forward (m)")
        axes.grid(alpha=0.25)
    side.set_ylabel("z, up (m)")
    side.set_title(f"{machine.name} from the right")
    top.set_ylabel("y, left (m)")
    top.set_title("from above")
    top.legend(loc="upper center", bbox_to_anchor=(0.5, -0.25), ncols=2, fontsize="small", frameon=False)
    return side.figure


def plot(analysis: Analysis, start: float | None = None, end: float | None = None, ax: Any = None) -> Any:
    """``Analysis.plot``."""
    pyplot = _pyplot("Analysis.plot")
    samples, events = analysis.samples, analysis.events
    wheels = [name[len("load_") : -len("_sigma")] for name in samples.columns if _is_band(name, samples.columns)]
    lacking = [name for name in ("time_ns", "valid") if name not in samples]
    lacking += [] if wheels else ["load_WHEEL", "load_WHEEL_sigma"]
    if lacking:
        raise error("value", f"expected samples with {', '.join(lacking)} to plot, found none: name them in columns of analyze")
    times_ns = np.asarray(samples["time_ns"])
    seconds = (times_ns - times_ns[0]) / 1e9
    shown = (seconds >= (-np.inf if start is None else start)) & (seconds <= (np.inf if end is None else end))
    if not shown.any():
        raise error("value", f"expected rows between start {start} and end {end}, found rows from 0 to {seconds[-1]:.2f} s")
    # what is doubted or cannot be computed is no curve
    valid = np.asarray(samples["valid"], dtype=bool)
    values = lambda name: np.where(valid, np.asarray(samples[name], dtype=float), np.nan)[shown]
    loads, margins = pyplot.subplots(2, 1, figsize=(11, 6.5), sharex=True, layout="constrained")[1] if ax is None else _pair(ax)
    for wheel in wheels:
        load, sigma = values(f"load_{wheel}"), values(f"load_{wheel}_sigma")
        (line,) = loads.plot(seconds[shown], load, linewidth=1.2, label=wheel.upper())
        band = (np.maximum(load - 2 * sigma, 0), load + 2 * sigma)
        loads.fill_between(seconds[shown], *band, color=line.get_color(), alpha=0.15, linewidth=0)
    for name, label in (("utilisation", "utilisation"), ("zmp_margin", "margin of the zero moment point (m)")):
        if name in samples:
            margins.plot(seconds[shown], values(name), linewidth=1.2, label=label)
    for axes in (loads, margins):
        _shade_events(axes, events, times_ns[0], (seconds[shown][0], seconds[shown][-1]))
        axes.grid(alpha=0.25)
    loads.set_ylabel("load, ± 2 sigma (N)")
    above = {"loc": "lower left", "bbox_to_anchor": (0, 1), "fontsize": "small", "frameon": False}
    loads.legend(ncols=8, **above)
    margins.set_xlabel("time (s)")
    margins.legend(ncols=8, **above)
    return loads.figure


def _is_band(name: str, columns: list[str]) -> bool:
    """Whether a column is the standard deviation of a wheel's load, which is there, too."""
    return name.startswith("load_") and name.endswith("_sigma") and name[: -len("_sigma")] in columns


# colours of what wheels, edges and the machine do, the worst last
_SHADES = {"wheel_light": "tab:orange", "wheel_lift": "tab:red", "edge_tipping": "tab:purple", "tip_over": "black"}


def _shade_events(axes: Any, events: Table, first_ns: int, span: tuple[float, float]) -> None:
    """Shades the times of events; one label for each kind."""
    labelled = set()
    for kind, start_ns, end_ns in zip(*(events[name].to_list() for name in ("kind", "start_ns", "end_ns"))):
        # an event that lasts until the end of the log has no end
        begin, stop = (start_ns - first_ns) / 1e9, span[1] if end_ns is None else (end_ns - first_ns) / 1e9
        if kind in _SHADES and begin <= span[1] and stop >= span[0]:
            label = None if kind in labelled else kind.replace("_", " ")
            axes.axvspan(max(begin, span[0]), min(stop, span[1]), color=_SHADES[kind], alpha=0.12, linewidth=0, label=label)
            labelled.add(kind)


def _pyplot(caller: str) -> Any:
    try:
        from matplotlib import pyplot
    except ImportError as missing:
        text = f"expected matplotlib for {caller}, found none: pip install matplotlib, or tipwatch[drawing]"
        raise error("package", text) from missing
    return pyplot


def _pair(ax: Any) -> tuple[Any, Any]:
    """Both axes that the caller gave."""
    axes = [ax] if hasattr(ax, "plot") else list(np.ravel(ax))
    if len(axes) != 2 or not all(hasattr(one, "plot") for one in axes):
        raise error("value", f"expected ax to be a pair of matplotlib axes, found {ax!r}")
    return axes[0], axes[1]


class _Links:
    """Shapes and parents of the links of a URDF."""

    def __init__(self, urdf: str) -> None:
        robot = ElementTree.fromstring(urdf)
        self.shapes = {link.get("name"): _shapes(link) for link in robot.findall("link")}
        self.parents = [
            (parent.get("link"), child.get("link"))
            for joint in robot.findall("joint")
            if (parent := joint.find("parent")) is not None and (child := joint.find("child")) is not None
        ]


def _shapes(link: ElementTree.Element) -> list[NDArray[np.float64]]:
    """Corners of each visual shape in the link's frame, or of each collision shape where none is visual."""
    for tag in ("visual", "collision"):
        found = [corners for holder in link.findall(tag) if (corners := _corners(holder)) is not None]
        if found:
            return found
    return []


def _corners(holder: ElementTree.Element) -> NDArray[np.float64] | None:
    """Points whose convex hull is the shape; None for meshes and for shapes that cannot be read."""
    geometry = holder.find("geometry")
    shape = None if geometry is None else next(iter(geometry), None)
    if shape is None:
        return None
    turn = np.linspace(0, 2 * np.pi, _CIRCLE, endpoint=False)
    try:
        if shape.tag == "box":
            half = _numbers(shape.get("size")) / 2
            points = half * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        elif shape.tag in ("cylinder", "capsule"):
            radius, half = float(shape.attrib["radius"]), float(shape.attrib["length"]) / 2
            circle = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(_CIRCLE)], axis=1)
            points = np.concatenate([circle - (0, 0, half), circle + (0, 0, half)])
        elif shape.tag == "sphere":
            radius, rise = float(shape.attrib["radius"]), np.linspace(-np.pi / 2, np.pi / 2, _CIRCLE // 2)
            points = radius * np.stack(
                [np.outer(np.cos(rise), np.cos(turn)), np.outer(np.cos(rise), np.sin(turn)),
                 np.outer(np.sin(rise), np.ones(_CIRCLE))], axis=-1,
            ).reshape(-1, 3)
        else:
            return None
        origin = holder.find("origin")
        if origin is None:
            return points
        return points @ _rotation(_numbers(origin.get("rpy", "0 0 0"))).T + _numbers(origin.get("xyz", "0 0 0"))
    except (KeyError, ValueError):
        return None  # shapes are only drawn: loads do not depend on them


def _numbers(text: str | None) -> NDArray[np.float64]:
    numbers = np.array([float(word) for word in (text or "").split()])
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f"expected three numbers, found {text!r}")
    return numbers


def _rotation(rpy: NDArray[np.float64]) -> NDArray[np.float64]:
    """R = Rz(yaw) Ry(pitch) Rx(roll)"""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _draw_links(axes: Any, view: str, links: _Links, poses: dict[str, NDArray[np.float64]]) -> None:
    for name, shapes in links.shapes.items():
        for corners in shapes if name in poses else []:
            pose = poses[name]
            seen = (corners @ pose[:3, :3].T + pose[:3, 3])[:, _VIEWS[view]]
            axes.fill(*_hull(seen).T, facecolor="tab:orange", edgecolor="saddlebrown", alpha=0.25, linewidth=0.8)
    for parent, child in links.parents:
        if parent in poses and child in poses:
            ends = np.stack([poses[parent][:3, 3], poses[child][:3, 3]])[:, _VIEWS[view]]
            axes.plot(*ends.T, color="0.45", linewidth=1, marker=".", markersize=3)


def _draw_wheels(axes: Any, view: str, machine: Machine, layout: dict[str, NDArray[Any]]) -> None:
    turn = np.linspace(0, 2 * np.pi, 2 * _CIRCLE)
    wheels = zip(machine.wheels, layout["wheel_centres"], layout["wheel_radii"], layout["contacts"])
    for name, centre, radius, contact in wheels:
        if view == "side":
            outline = centre[[0, 2]] + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
            axes.plot(*outline.T, color="black", linewidth=1.2)
        else:
            # the machine file states neither width nor steering: the contact point is all that is known of the wheel
            axes.plot(*contact[:2], color="black", marker="o", markersize=7)
            outward = np.sign(contact[1]) or 1
            axes.annotate(name, contact[:2], xytext=(0, 12 * outward), textcoords="offset points", ha="center",
                          va="center", fontsize="small")


def _draw_balance(axes: Any, view: str, layout: dict[str, NDArray[Any]]) -> None:
    """Support polygon, centre of mass and its plumb line on level ground."""
    contacts, com, normal = layout["contacts"], layout["centre_of_mass"], layout["normal"]
    for number, edge in enumerate(layout["edges"]):
        ends = contacts[edge][:, _VIEWS[view]]
        axes.plot(*ends.T, color="tab:blue", linestyle="--", label=None if number else "support polygon")
    # plumb line of the centre of mass, down to the contact plane: n . (foot - contact) = 0
    foot = com - np.array([0, 0, normal @ (com - contacts[0]) / normal[2]])
    line = np.stack([com, foot])[:, _VIEWS[view]]
    if view == "side":
        axes.plot(*line.T, color="tab:red", linewidth=1, linestyle=":")
    axes.plot(*line[0], color="tab:red", marker="P", markersize=9, linestyle="none", label="centre of mass")


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners of the convex hull of points in a plane, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(map(tuple, points.tolist()))

    def chain(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        corners: list[tuple[float, float]] = []
        for point in points:
            while len(corners) > 1:
                (ax, ay), (bx, by) = corners[-2:]
                if (bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax) > 0:
                    break
                corners.pop()
            corners.append(point)
        return corners[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]) or ordered[:1])
