# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws one view of a mesh with VTK: its faces in the colours of a cell array, edges, title and legend."""

import colorsys
import math
from dataclasses import dataclass

import vtkmodules.vtkRenderingFreeType  # noqa: F401  draws text
import vtkmodules.vtkRenderingUI  # noqa: F401  opens X windows
from vtkmodules.vtkCommonCore import vtkLookupTable
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersCore import vtkThreshold
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersSources import vtkPlaneSource
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.vtkImagingCore import vtkImageShrink3D
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkActor2D,
    vtkCamera,
    vtkLight,
    vtkPolyDataMapper,
    vtkPolyDataMapper2D,
    vtkRenderer,
    vtkTextActor,
    vtkWindowToImageFilter,
)
from vtkmodules.vtkRenderingOpenGL2 import vtkRenderStepsPass, vtkSSAOPass

OVERSAMPLING = 2  # drawn larger, then averaged: smooth thin lines whatever the graphics driver can do
INK = (0.13, 0.15, 0.18)
GREY = (0.35, 0.38, 0.42)
HEADER = 5  # lines of text that the mesh leaves free at the top
# Told apart by people who see colours differently, too; in an order that puts unlike ones side by side.
BLOCK_COLORS = ["4e79a7", "f28e2b", "59a14f", "e15759", "76b7b2", "edc948", "b07aa1", "9c755f", "86bcb6", "ff9da7",
                "499894", "d37295"]
LEVEL_COLORS = ["46518f", "3b7ea1", "3aa394", "6cc27a", "b9d965", "fbe56b"]  # dark: coarse
STATE_NAMES = {0: ("unknown", "bab0ac"), 1: ("outside", "d0d7de"), 2: ("inside", "7fb7e6"), 3: ("cut", "f2994a")}
TITLES = {"block": "Blocks", "level": "Refinement level", "state": "Inside and cut by the surface"}
MOST_IN_LEGEND = 16


class Problem(Exception):
    """Something the user should read, in one line."""


@dataclass
class Entry:
    """A value of the array that colours, its colour and what the legend calls it."""

    value: int
    color: tuple
    name: str


def rgb(text):
    return tuple(int(text[i : i + 2], 16) / 255 for i in (0, 2, 4))


def block_color(number):
    """The palette, then again darker and lighter in turns."""
    h, l, s = colorsys.rgb_to_hls(*rgb(BLOCK_COLORS[number % len(BLOCK_COLORS)]))
    turn = number // len(BLOCK_COLORS)
    l += (0, -0.16, 0.14, -0.08, 0.08)[turn % 5]
    return colorsys.hls_to_rgb(h, min(max(l, 0.15), 0.9), s)


def level_color(level, most):
    """Spread over the whole ramp, blended between its colours."""
    at = level / most * (len(LEVEL_COLORS) - 1) if most else 0
    low = min(int(at), len(LEVEL_COLORS) - 2)
    return tuple(a + (b - a) * (at - low) for a, b in zip(rgb(LEVEL_COLORS[low]), rgb(LEVEL_COLORS[low + 1])))


def entries(grid, by):
    """One entry for each value from 0 to the largest in use."""
    array = grid.GetCellData().GetArray(by)
    if array is None:
        raise Problem(f"the export has no cell array '{by}'")
    low, high = (int(v) for v in array.GetRange())
    if low < 0 or high > 1_000_000:
        raise Problem(f"cell array '{by}' runs from {low} to {high}, which is no {by}")
    if by == "block":
        return [Entry(v, block_color(v), str(v)) for v in range(high + 1)]
    if by == "level":
        return [Entry(v, level_color(v, high), str(v)) for v in range(high + 1)]
    return [Entry(v, rgb(color), name) for v, (name, color) in STATE_NAMES.items()]


def used(grid, by, all_entries):
    array = grid.GetCellData().GetArray(by)
    values = {int(array.GetTuple1(i)) for i in range(array.GetNumberOfTuples())}
    return [e for e in all_entries if e.value in values]


def surface_of(grid):
    surface = vtkGeometryFilter()
    surface.SetInputData(grid)
    surface.Update()
    return surface.GetOutput()


def by_size(surface, limits):
    """The faces of the surface in groups, by the square root of their area: one group more than limits."""
    sizes = vtkCellSizeFilter()
    sizes.SetInputData(surface)
    sizes.ComputeVertexCountOff()
    sizes.ComputeLengthOff()
    sizes.ComputeVolumeOff()
    groups = []
    for low, high in zip([0.0] + limits, limits + [float("inf")]):
        part = vtkThreshold()
        part.SetInputConnection(sizes.GetOutputPort())
        part.SetInputArrayToProcess(0, 0, 0, 1, "Area")
        part.SetLowerThreshold(low * low)
        part.SetUpperThreshold(math.nextafter(high * high, 0))
        part.SetThresholdFunction(vtkThreshold.THRESHOLD_BETWEEN)
        part.Update()
        groups.append(surface_of(part.GetOutput()))
    return groups


def add_mesh(renderer, surface, by, all_entries, line_width):
    """The surface coloured by an array; `line_width` (in the pixels that are drawn) 0 for no edges."""
    table = vtkLookupTable()
    table.SetNumberOfTableValues(len(all_entries))
    table.SetTableRange(-0.5, len(all_entries) - 0.5)
    for entry in all_entries:
        table.SetTableValue(entry.value, *entry.color, 1.0)
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(surface)
    mapper.SetScalarModeToUseCellFieldData()
    mapper.SelectColorArray(by)
    mapper.SetColorModeToMapScalars()  # bytes, too: by default VTK takes them for shades of grey
    mapper.SetLookupTable(table)
    mapper.UseLookupTableScalarRangeOn()
    actor = vtkActor()
    actor.SetMapper(mapper)
    shading = actor.GetProperty()
    shading.SetInterpolationToFlat()
    shading.SetAmbient(0.36)
    shading.SetDiffuse(0.8)
    shading.SetSpecular(0.0)
    if line_width:
        shading.EdgeVisibilityOn()
        shading.SetEdgeColor(*INK)
        shading.SetLineWidth(line_width)
    renderer.AddActor(actor)


def add_light(renderer):
    """From over the left shoulder, and a weaker one from the right, both fixed to the camera."""
    renderer.AutomaticLightCreationOff()
    for position, strength in (((-0.25, 0.6, 1.2), 0.85), ((0.8, -0.2, 1.0), 0.3)):
        light = vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(position)
        light.SetFocalPoint(0, 0, 0)
        light.SetIntensity(strength)
        renderer.AddLight(light)


class Camera:
    """A parallel camera: where a mesh lies as seen from `direction`, and how to show it whole."""

    def __init__(self, surface, direction, up):
        bounds = surface.GetBounds()
        self.diagonal = sum((bounds[2 * i + 1] - bounds[2 * i]) ** 2 for i in range(3)) ** 0.5
        length = sum(d * d for d in direction) ** 0.5
        self.direction = [d / length for d in direction]
        self.up = [1.0 if i == up else 0.0 for i in range(3)]
        self.focus = [(bounds[2 * i] + bounds[2 * i + 1]) / 2 for i in range(3)]
        camera = vtkCamera()
        self.place(camera, self.focus)
        self.matrix = camera.GetViewTransformMatrix()
        to_view = vtkTransform()
        to_view.SetMatrix(self.matrix)
        seen = vtkTransformPolyDataFilter()
        seen.SetInputData(surface)
        seen.SetTransform(to_view)
        seen.Update()
        # In view coordinates the focus is at (0, 0).
        self.left, self.right, self.bottom, self.top, _, _ = seen.GetOutput().GetBounds()

    def place(self, camera, focus):
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(focus)
        # Far enough that nothing is behind the camera, whatever its shape.
        camera.SetPosition([f + 2 * self.diagonal * d for f, d in zip(focus, self.direction)])
        camera.SetViewUp(self.up)

    def scale(self, width, height, header):
        """The length of a pixel when the mesh just fills a view of so many pixels, below a header of some of them."""
        return max((self.top - self.bottom) / 0.92 / (height - header), (self.right - self.left) / 0.92 / width)

    def frame(self, renderer, width, height, header):
        scale = self.scale(width, height, header)
        across, upward = ([self.matrix.GetElement(row, i) for i in range(3)] for row in (0, 1))
        x, y = (self.left + self.right) / 2, (self.bottom + self.top) / 2 + scale * header / 2
        camera = renderer.GetActiveCamera()
        self.place(camera, [f + a * x + u * y for f, a, u in zip(self.focus, across, upward)])
        camera.SetParallelScale(scale * height / 2)
        renderer.ResetCameraClippingRange()


def add_text(renderer, text, x, y, size, color=INK, bold=False, from_right=False):
    """Text whose upper left (or right) corner is at (x, y) in pixels of the picture."""
    actor = vtkTextActor()
    actor.SetInput(text)
    style = actor.GetTextProperty()
    style.SetFontSize(round(size * OVERSAMPLING))
    style.SetColor(*color)
    style.SetBold(bold)
    style.SetVerticalJustificationToTop()
    if from_right:
        style.SetJustificationToRight()
    actor.SetPosition(x * OVERSAMPLING, y * OVERSAMPLING)
    renderer.AddViewProp(actor)
    return actor


def add_square(renderer, x, y, side, color):
    """A filled square, its lower left corner at (x, y) in pixels of the picture."""
    square = vtkPlaneSource()
    square.SetOrigin(0, 0, 0)
    square.SetPoint1(side * OVERSAMPLING, 0, 0)
    square.SetPoint2(0, side * OVERSAMPLING, 0)
    mapper = vtkPolyDataMapper2D()
    mapper.SetInputConnection(square.GetOutputPort())
    actor = vtkActor2D()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*color)
    actor.SetPosition(x * OVERSAMPLING, y * OVERSAMPLING)
    renderer.AddViewProp(actor)


def add_legend(renderer, shown, total, width, height, unit):
    """Coloured squares with names, in rows below the title; with too many values, only how many there are."""
    top = height - 3.5 * unit
    if len(shown) > MOST_IN_LEGEND:
        add_text(renderer, f"{total} of them", 1.2 * unit, top, unit, color=GREY)
        return
    column = (2.6 + 0.62 * max(len(entry.name) for entry in shown)) * unit
    columns = max(1, int((width - 2.4 * unit) / column))
    for i, entry in enumerate(shown):
        x, y = 1.2 * unit + i % columns * column, top - i // columns * 1.6 * unit
        add_square(renderer, x, y - unit, unit, entry.color)
        add_text(renderer, entry.name, x + 1.5 * unit, y, unit)


def ambient_occlusion(renderer, diagonal):
    """Darkens where cells meet at an angle: steps between cells show."""
    steps = vtkRenderStepsPass()
    occlusion = vtkSSAOPass()
    occlusion.SetRadius(0.05 * diagonal)
    occlusion.SetBias(0.002 * diagonal)
    occlusion.SetKernelSize(64)
    occlusion.BlurOn()
    occlusion.SetDelegatePass(steps)
    renderer.SetPass(occlusion)


def draw_view(window, shown, parts, by, all_entries, camera, unit, options, caption):
    """The pixels of one view, drawn in `window`."""
    renderer = vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    for surface, line_width in parts:
        add_mesh(renderer, surface, by, all_entries, OVERSAMPLING * line_width)
    add_light(renderer)
    if options.shadows:
        ambient_occlusion(renderer, camera.diagonal)
    width, height = (side / OVERSAMPLING for side in window.GetSize())
    add_text(renderer, TITLES[by], 1.2 * unit, height - 1.1 * unit, 1.35 * unit, bold=True)
    add_text(renderer, caption, width - 1.2 * unit, height - 1.3 * unit, unit, color=GREY, from_right=True)
    add_legend(renderer, used(shown, by, all_entries), len(all_entries), width, height, unit)
    window.AddRenderer(renderer)
    camera.frame(renderer, width, height, HEADER * unit)
    window.Render()

    image = vtkWindowToImageFilter()
    image.SetInput(window)
    image.ReadFrontBufferOff()
    smaller = vtkImageShrink3D()
    smaller.SetInputConnection(image.GetOutputPort())
    smaller.SetShrinkFactors(OVERSAMPLING, OVERSAMPLING, 1)
    smaller.AveragingOn()
    smaller.Update()
    window.RemoveRenderer(renderer)
    return smaller.GetOutput()


def with_edges(surface, pixel, options):
    """The surface in parts with their line widths: edges thinner, then none, where they would cover small cells."""
    if not options.edges:
        return [(surface, 0)]
    none, thin, full = by_size(surface, [4 * pixel, 10 * pixel])
    return [(none, 0), (thin, options.line_width / 2), (full, options.line_width)]
