#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws an export of ndmap, cut open by a plane that keeps cells whole, so that the inside shows.

  ndmap-picture out/mesh.pvtu -o mesh.png
  ndmap-picture out/mesh.pvtu --color level --clip x --clip-at 0.4 --up y -o mesh.png
  ndmap-picture out/mesh.pvtu --color temperature -o mesh.png

ndmap-picture gives this program the X server that it needs, for the time of one picture.
"""

import argparse
import os
import sys

from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow
from vtkmodules.vtkCommonDataModel import VTK_HEXAHEDRON, VTK_POLYHEDRON, vtkCellTypes, vtkPlane
from vtkmodules.vtkFiltersCore import vtkImageAppend
from vtkmodules.vtkFiltersExtraction import vtkExtractGeometry
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLPUnstructuredGridReader, vtkXMLUnstructuredGridReader
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from palette import Problem, palette_of
from view import HEADER, OVERSAMPLING, Camera, draw_view, surface_of, with_edges

AXES = "xyz"
# For each axis that points up: the axes that run to the right and to the front, with their signs.
HORIZONTAL = [((1, 1), (2, -1)), ((0, 1), (2, 1)), ((0, 1), (1, -1))]
DEFAULT_WIDTH = 1600


def read(path):
    if not os.path.isfile(path):
        raise Problem(f"{path}: no such file")
    complaints = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(complaints)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    reader = vtkXMLPUnstructuredGridReader() if path.endswith(".pvtu") else vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    if complaints.GetOutput():
        raise Problem(f"{path}: cannot be read: {' '.join(complaints.GetOutput().split())[:300]}")
    grid = reader.GetOutput()
    if grid.GetNumberOfCells() == 0:
        raise Problem(f"{path}: has no cells to draw")
    return grid


def view_direction(up, clip):
    """From the mesh to the camera: from above, from the side, and most of all against the clip plane."""
    (right, right_sign), (front, front_sign) = HORIZONTAL[up]
    direction = [0.0, 0.0, 0.0]
    direction[right] = right_sign * (1.0 if clip == right else 0.62)
    direction[front] = front_sign * (0.62 if clip == right else 1.0)
    direction[up] = 1.25 if clip == up else 0.62
    return direction


def clipped(grid, axis, at, direction):
    """The cells beyond the plane, seen from the camera, and those that it meets: whole."""
    bounds = grid.GetBounds()
    plane = vtkPlane()
    origin = [0.0, 0.0, 0.0]
    normal = [0.0, 0.0, 0.0]
    low, high = bounds[2 * axis], bounds[2 * axis + 1]
    normal[axis] = 1.0 if direction[axis] > 0 else -1.0
    # A little less than asked, so that cells which only touch the plane are not shown for it.
    origin[axis] = low + (high - low) * at - 1e-6 * (high - low) * normal[axis]
    plane.SetOrigin(origin)
    plane.SetNormal(normal)
    extract = vtkExtractGeometry()
    extract.SetInputData(grid)
    extract.SetImplicitFunction(plane)
    extract.ExtractInsideOn()
    extract.ExtractBoundaryCellsOn()
    extract.Update()
    if extract.GetOutput().GetNumberOfCells() == 0:
        raise Problem(f"--clip {AXES[axis]} --clip-at {at:g} leaves no cells")
    return extract.GetOutput()


def counted(number, one):
    return f"{number:,} {one if number == 1 else one.replace('hedron', 'hedra').replace('cell', 'cells')}"


def describe(grid):
    types = vtkCellTypes()
    grid.GetCellTypes(types)
    kinds = {types.GetCellType(i) for i in range(types.GetNumberOfTypes())}
    name = {frozenset([VTK_HEXAHEDRON]): "hexahedron", frozenset([VTK_POLYHEDRON]): "polyhedron"}
    return counted(grid.GetNumberOfCells(), name.get(frozenset(kinds), "cell"))


def draw(options):
    grid = read(options.export)
    palettes = [palette_of(grid, by) for by in options.color]
    up = AXES.index(options.up)
    clip = AXES.find(options.clip) if options.clip else HORIZONTAL[up][1][0]
    direction = view_direction(up, clip)
    shown = clipped(grid, clip, options.clip_at, direction) if clip >= 0 else grid
    surface = surface_of(shown)
    camera = Camera(surface, direction, up)

    count = len(options.color)
    width = (options.size[0] if options.size else DEFAULT_WIDTH) // count
    unit = min(max(9.0, width / 45), 20.0)  # height of a line of text
    shape = (camera.top - camera.bottom) / (camera.right - camera.left)
    height = options.size[1] if options.size else round(min(1.25 * width, width * shape + HEADER * unit))
    parts = with_edges(surface, camera.scale(width, height, HEADER * unit), options)
    # One after the other in one window: of several views side by side vtkSSAOPass draws only the first.
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(width * OVERSAMPLING, height * OVERSAMPLING)
    caption = options.title if options.title is not None else f"{os.path.basename(options.export)}: {describe(grid)}"
    together = vtkImageAppend()
    together.SetAppendAxis(0)
    for i, palette in enumerate(palettes):
        view = draw_view(window, shown, parts, palette, camera, unit, options,
                         caption if i == count - 1 else "")
        together.AddInputData(view)
    save(together, options.output)


def save(picture, path):
    part = path + ".part"
    writer = vtkPNGWriter()
    writer.SetFileName(part)
    writer.SetInputConnection(picture.GetOutputPort())
    writer.Write()
    if writer.GetErrorCode() or not os.path.isfile(part):
        raise Problem(f"{path}: cannot be written")
    os.replace(part, path)


def size(text):
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and 64 <= int(width) <= 8192 and 64 <= int(height) <= 8192):
        raise argparse.ArgumentTypeError(f"'{text}' is not WIDTHxHEIGHT, 64 to 8192 pixels each")
    return int(width), int(height)


def colors(text):
    names = text.split(",")
    if "" in names:
        raise argparse.ArgumentTypeError(f"'{text}' is not the name of an array, or several with commas between")
    return names


def fraction(text):
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number from 0 to 1")
    return value


def parse(arguments):
    parser = argparse.ArgumentParser(prog="ndmap-picture", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("export", help=".pvtu or .vtu")
    parser.add_argument("-o", "--output", required=True, metavar="FILE.png")
    parser.add_argument("--color", type=colors, default=["block", "level"], metavar="BY[,BY]",
                        help="block, level, state or an attribute; several give one view each, side by side "
                             "(default: block,level)")
    parser.add_argument("--clip", choices=[*AXES, "none"],
                        help="axis of the plane that cuts the mesh open (default: the one that runs to the front)")
    parser.add_argument("--clip-at", type=fraction, default=0.5, metavar="F",
                        help="where on this axis the plane stands, 0 to 1 (default: 0.5)")
    parser.add_argument("--up", choices=list(AXES), default="z", help="the axis that points up (default: z)")
    parser.add_argument("--edges", action=argparse.BooleanOptionalAction, default=True,
                        help="draw the cells' edges (default: yes)")
    parser.add_argument("--line-width", type=float, default=0.6, metavar="PIXELS", help="of edges (default: 0.6)")
    parser.add_argument("--shadows", action=argparse.BooleanOptionalAction, default=True,
                        help="darken corners between cells (default: yes)")
    parser.add_argument("--size", type=size, metavar="WxH",
                        help=f"in pixels (default: {DEFAULT_WIDTH} wide, as high as the mesh needs)")
    parser.add_argument("--title", help="text at the upper right (default: file name and number of cells)")
    return parser.parse_args(arguments)


def main():
    try:
        draw(parse(sys.argv[1:]))
    except (Problem, OSError) as problem:
        print(f"ndmap-picture: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
