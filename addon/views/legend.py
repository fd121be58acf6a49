# SPDX-License-Identifier: GPL-3.0-or-later
"""What the colours mean: a bar with the distribution above it, figures, notes; in the lower right corner of an editor."""

from dataclasses import dataclass, field

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from . import faces, measures, shapes

BINS = 48
_WIDTH, _BAR, _CURVE, _LINE, _PAD = 250, 12, 34, 17, 10


@dataclass
class Bar:
    scale: faces.Scale
    reference: float
    shares: np.ndarray  # (BINS,)


@dataclass
class Legend:
    bar: Bar | None = None
    lines: list = field(default_factory=list)  # (colour of a square, text)

    @property
    def empty(self) -> bool:
        return self.bar is None and not self.lines


def of(drawings: list[shapes.Drawing], what: str) -> Legend:
    """Of all objects together; colours their faces on the way."""
    legend = Legend()
    scale = faces.SCALES.get(what)
    known = [d for d in drawings if d.values is not None]
    if scale and known:
        values = np.concatenate([d.values for d in known])
        weights = np.concatenate([d.weights for d in known])
        figures = measures.figures(values, weights)
        reference = figures.mean if figures and np.isfinite(figures.mean) else 1.0
        for drawing in known:
            faces.colour(drawing, scale, reference)
        places = np.clip(scale.place(values, reference), 0.0, 1.0)
        legend.bar = Bar(scale, reference, measures.shares(places, weights, BINS))
        legend.lines += _figures(figures, scale)
    elif scale:
        legend.lines.append(((0, 0, 0, 0), "no UV map to measure"))
    for drawing in drawings:
        legend.lines += [line for line in drawing.notes if line not in legend.lines]
    return legend


def _figures(figures, scale) -> list:
    if figures is None:
        return [((0, 0, 0, 0), "no face with an area")]
    unit = f" {scale.unit}" if scale.unit else ""
    half, most, nearly_all = (number(value) for value in figures.percentiles)
    worst = f", {scale.last} {number(figures.worst)}"
    return [
        ((0, 0, 0, 0), f"mean {number(figures.mean)}{unit}{worst}"),
        ((0, 0, 0, 0), f"half below {half}, 95 % {most}, 99 % {nearly_all}"),
    ]


def number(value: float) -> str:
    return "unbounded" if not np.isfinite(value) else f"{value:.3g}"


def draw(legend: Legend, region_width: int, bottom: int) -> None:
    """Region coordinates: right-aligned at region_width, upwards from `bottom`."""
    if legend.empty:
        return
    ui = bpy.context.preferences.system.ui_scale
    pad, line, width = _PAD * ui, _LINE * ui, _WIDTH * ui
    blf.size(0, 11 * ui)
    widest = max([blf.dimensions(0, text)[0] + 18 * ui for _, text in legend.lines] + [0])
    width = max(width, widest)
    height = line * len(legend.lines) + 2 * pad
    if legend.bar is not None:
        height += (_BAR + _CURVE + 2 * _LINE) * ui
    left, right = region_width - width - 3 * pad, region_width - pad
    gpu.state.blend_set("ALPHA")
    rectangle(left, bottom, right, bottom + height, (0.08, 0.08, 0.08, 0.75))
    y = bottom + pad
    for colour, text in reversed(legend.lines):
        indent = 0.0
        if colour[3] > 0:
            rectangle(left + pad, y, left + pad + 11 * ui, y + 11 * ui, (*colour[:3], 1.0))
            indent = 18 * ui
        write(left + pad + indent, y + 1, text)
        y += line
    if legend.bar is not None:
        _draw_bar(legend.bar, left + pad, right - pad, y, ui)
    gpu.state.blend_set("NONE")


def _draw_bar(bar: Bar, left: float, right: float, y: float, ui: float) -> None:
    unit = f" {bar.scale.unit}" if bar.scale.unit else ""
    for place in (0.0, 0.5, 1.0):
        text = number(bar.scale.value(place, bar.reference)) + (unit if place == 1.0 else "")
        width = blf.dimensions(0, text)[0]
        write(left + place * (right - left - width), y, text)
    y += _LINE * ui
    edges = np.linspace(left, right, BINS + 1)
    middle = (np.arange(BINS) + 0.5) / BINS
    colours = faces.colours(bar.scale, middle)
    colours[:, 3] = 1.0
    low = np.full(BINS, y)
    _boxes(edges, low, low + _BAR * ui, colours)
    y += (_BAR + 3) * ui
    peak = max(float(bar.shares.max()), 1e-9)
    low = np.full(BINS, y)
    _boxes(edges, low, low + _CURVE * ui * bar.shares / peak, colours)
    write(left, y + (_CURVE + 6) * ui, bar.scale.title)


def _boxes(edges: np.ndarray, low: np.ndarray, high: np.ndarray, colours: np.ndarray) -> None:
    rectangles(np.column_stack([edges[:-1], low, edges[1:], high]), colours)


def rectangles(boxes: np.ndarray, colours: np.ndarray) -> None:
    """boxes (k, 4) left, low, right, high in pixels; colours (k, 4)."""
    a, b, c, d = (boxes[:, i] for i in range(4))
    zero = np.zeros(len(boxes))
    corners = ((a, b), (c, b), (c, d), (a, b), (c, d), (a, d))
    pos = np.stack([np.column_stack([x, y, zero]) for x, y in corners], axis=1)
    shader = gpu.shader.from_builtin("FLAT_COLOR")
    values = {
        "pos": np.ascontiguousarray(pos.reshape(-1, 3), np.float32),
        "color": np.repeat(colours, 6, axis=0).astype(np.float32),
    }
    batch_for_shader(shader, "TRIS", values).draw(shader)


def rectangle(left: float, low: float, right: float, high: float, colour: tuple) -> None:
    rectangles(np.array([[left, low, right, high]]), np.array([colour]))


def write(x: float, y: float, text: str, colour: tuple = (0.92, 0.92, 0.92, 1.0)) -> None:
    blf.color(0, *colour)
    blf.position(0, x, y, 0)
    blf.draw(0, text)
