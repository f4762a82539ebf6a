# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws one view of a mesh with VTK: its faces in the colours of an array, edges, title and legend."""

import math

import vtkmodules.vtkRenderingFreeType  # noqa: F401  draws text
import vtkmodules.vtkRenderingUI  # noqa: F401  opens X windows
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

from palette import SHADES, Ramp

OVERSAMPLING = 2  # drawn larger, then averaged: smooth thin lines whatever the graphics driver can do
INK = (0.13, 0.15, 0.18)
GREY = (0.35, 0.38, 0.42)
HEADER = 5  # lines of text that the mesh leaves free at the top
MOST_IN_LEGEND = 16


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


def add_mesh(renderer, surface, palette, line_width):
    """The surface coloured by an array; `line_width` (in the pixels that are drawn) 0 for no edges."""
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(surface)
    if palette.on_points:
        mapper.SetScalarModeToUsePointFieldData()
        # Numbers are blended, and names never; colours would be: there is no violet between blue and red.
        mapper.SetInterpolateScalarsBeforeMapping(isinstance(palette, Ramp))
    else:
        mapper.SetScalarModeToUseCellFieldData()
    mapper.SelectColorArray(palette.array)
    mapper.SetColorModeToMapScalars()  # bytes, too: by default VTK takes them for shades of grey
    mapper.SetLookupTable(palette.table())
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


def add_square(renderer, x, y, sides, color):
    """A filled rectangle, its lower left corner at (x, y) in pixels of the picture."""
    square = vtkPlaneSource()
    square.SetOrigin(0, 0, 0)
    square.SetPoint1(sides[0] * OVERSAMPLING, 0, 0)
    square.SetPoint2(0, sides[1] * OVERSAMPLING, 0)
    mapper = vtkPolyDataMapper2D()
    mapper.SetInputConnection(square.GetOutputPort())
    actor = vtkActor2D()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*color)
    actor.SetPosition(x * OVERSAMPLING, y * OVERSAMPLING)
    renderer.AddViewProp(actor)


def add_legend(renderer, palette, grid, width, height, unit):
    """Below the title: a bar of colours with its ends, or coloured squares with names in rows; with too many of them,
    only how many there are."""
    top = height - 3.5 * unit
    if isinstance(palette, Ramp):
        low = f"{palette.low:g}"
        add_text(renderer, low, 1.2 * unit, top, unit)
        left, shade = (1.7 + 0.62 * len(low)) * unit, 12 * unit / SHADES
        for i in range(SHADES):
            # Each on top of those before, so that no gap is between two.
            rest = (SHADES - i) * shade
            add_square(renderer, left + i * shade, top - unit, (rest, unit), palette.color(i / (SHADES - 1)))
        add_text(renderer, f"{palette.high:g}", left + 12.5 * unit, top, unit)
        return
    shown = palette.used(grid)
    if len(shown) > MOST_IN_LEGEND:
        add_text(renderer, f"{len(palette.entries)} of them", 1.2 * unit, top, unit, color=GREY)
        return
    column = (2.6 + 0.62 * max(len(entry.name) for entry in shown)) * unit
    columns = max(1, int((width - 2.4 * unit) / column))
    for i, entry in enumerate(shown):
        x, y = 1.2 * unit + i % columns * column, top - i // columns * 1.6 * unit
        add_square(renderer, x, y - unit, (unit, unit), entry.color)
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


def draw_view(window, shown, parts, palette, camera, unit, options, caption):
    """The pixels of one view, drawn in `window`."""
    renderer = vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    for surface, line_width in parts:
        add_mesh(renderer, surface, palette, OVERSAMPLING * line_width)
    add_light(renderer)
    if options.shadows:
        ambient_occlusion(renderer, camera.diagonal)
    width, height = (side / OVERSAMPLING for side in window.GetSize())
    add_text(renderer, palette.title, 1.2 * unit, height - 1.1 * unit, 1.35 * unit, bold=True)
    add_text(renderer, caption, width - 1.2 * unit, height - 1.3 * unit, unit, color=GREY, from_right=True)
    add_legend(renderer, palette, shown, width, height, unit)
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
