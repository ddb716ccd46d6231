"""What notebooks show of scenes, plans and runs: short tables, and scenes drawn to scale."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from flagrs.scene.part import different
from flagrs.scene.values import FloatArray

if TYPE_CHECKING:
    from flagrs.scene.part import Part
    from flagrs.scene.plan import Plan
    from flagrs.scene.scene import Scene
    from flagrs.trajectory import Trajectory

#: Colours of filaments, and of what is dry; as in figures.
_TONES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_DRY, _PIXELS = "#8a8a8a", 300


def scene_html(scene: Scene) -> str:
    """Return a scene as HTML: two views to scale, and its parts in a line each."""
    rods = [
        f"{rod.name or f'rod {number}'}: {len(rod.nodes)} nodes, {len(rod.edge_array())} edges, "
        f"radius {_range(rod.radius_array())}, E = {rod.material.youngs_modulus:.3g} Pa"
        for number, rod in enumerate(scene.rods)
    ]
    shown = rods[:5] + ([f"and {len(rods) - 5} more"] if len(rods) > 5 else [])
    rows = [("rods", "<br>".join(map(escape, shown)))]
    for name in ("fluid", "head", "motors", "clamps", "loads", "magnetic_field", "contact"):
        value = getattr(scene, name)
        if isinstance(value, tuple):
            text = "<br>".join(escape(_short(one)) for one in value[:5])
            text += f"<br>and {len(value) - 5} more" if len(value) > 5 else ""
        else:
            text = "" if value is None else escape(_short(value))
        if text:
            rows.append((name.replace("_", " "), text))
    views = "".join(_view(scene, plane) for plane in ((0, 1), (0, 2)))
    return f"<div><b>{escape(scene.name)}</b><div>{views}</div>{_table(rows)}</div>"


def plan_html(plan: Plan) -> str:
    """Return a plan as HTML."""
    return f"<pre>{escape(str(plan))}</pre>"


def trajectory_html(trajectory: Trajectory) -> str:
    """Return a run as HTML: how long, from where, and its read-outs."""
    span = f"{trajectory.time[0]:g} s to {trajectory.time[-1]:g} s" if len(trajectory) else "none"
    state = "finished" if trajectory.finished else "not finished"
    rows = [
        ("frames", f"{len(trajectory)}, {span} ({state})"),
        ("nodes", f"{trajectory.scene.node_count}"),
        ("wall time", f"{trajectory.wall_seconds:.3g} s"),
        ("file", escape(str(trajectory.path or "in memory"))),
    ]
    rows += [("warning", escape(notice.message)) for notice in trajectory.warnings]
    measured = ""
    if len(trajectory) > 1:
        found = {name: one for name, one in trajectory.readouts().items() if one.estimate is not None}
        listed = [(escape(one.meaning), escape(str(one))) for one in found.values()]
        measured = f"<details open><summary>read-outs of the last half</summary>{_table(listed)}</details>"
    title = f"<b>Trajectory of {escape(trajectory.scene.name)}</b> (<code>.view()</code> shows it)"
    return f"<div>{title}{_table(rows)}{measured}</div>"


def _table(rows: list[tuple[str, str]]) -> str:
    cells = "".join(
        f'<tr><td style="text-align: left; vertical-align: top"><b>{name}</b></td>'
        f'<td style="text-align: left">{text}</td></tr>'
        for name, text in rows
    )
    return f"<table>{cells}</table>"


def _range(values: FloatArray) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.3g} m" if low == high else f"{low:.3g} to {high:.3g} m"


def _short(part: Part) -> str:
    """Return a part with those of its fields that differ from their defaults."""
    plain = {
        name: field.get_default(call_default_factory=True) for name, field in type(part).model_fields.items()
    }
    told = [
        f"{name}={value:.6g}" if isinstance(value, float) else f"{name}={_shown(value)}"
        for name, value in ((name, getattr(part, name)) for name in plain)
        if different(value, plain[name])
    ]
    text = f"{type(part).__name__}({', '.join(told)})"
    return text if len(text) <= 240 else text[:237] + "..."


def _shown(value: object) -> str:
    return f"array{value.shape}" if isinstance(value, np.ndarray) and value.size > 4 else repr(value)


def _view(scene: Scene, plane: tuple[int, int]) -> str:
    """Return a view of a scene along an axis as SVG, rods with their thickness."""
    from flagrs.results.paths import paths_of

    nodes = scene.node_array()[:, plane] * [1.0, -1.0]  # up is down in SVG
    radius = max(float(rod.radius_array().max()) for rod in scene.rods)
    low, high = nodes.min(axis=0) - radius, nodes.max(axis=0) + radius
    head = ""
    if scene.head is not None:
        middle = nodes[scene.node_offset(scene.head.rod) + scene.head.node]
        low, high = np.minimum(low, middle - scene.head.radius), np.maximum(high, middle + scene.head.radius)
    scale = _PIXELS / float((high - low).max())
    width, height = (high - low) * scale
    if scene.head is not None:
        x, y = (middle - low) * scale
        head = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{scene.head.radius * scale:.1f}" fill="#ddd"/>'
    lines, wet = [], 0
    for path in paths_of(scene):
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in (nodes[path.nodes] - low) * scale)
        tone = _TONES[wet % len(_TONES)] if path.immersed else _DRY
        wet += path.immersed
        thick = max(2.0 * float(path.radius.mean()) * scale, 0.7)
        lines.append(
            f'<polyline points="{points}" fill="none" stroke="{tone}" stroke-width="{thick:.2f}" '
            'stroke-linejoin="round" stroke-linecap="round"/>'
        )
    axes = "".join("xyz"[axis] for axis in plane)
    return (
        f'<svg width="{width:.0f}" height="{max(height, 12.0):.0f}" style="margin: 6px" role="img" '
        f'aria-label="{axes} plane"><title>{axes} plane</title>{head}{"".join(lines)}</svg>'
    )
