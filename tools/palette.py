# SPDX-License-Identifier: GPL-3.0-or-later
"""Which colour a value has: the arrays of an export that ndmap knows, and those that users have added."""

import colorsys
import math
from dataclasses import dataclass

from vtkmodules.vtkCommonCore import vtkIntArray, vtkLookupTable

# Told apart by people who see colours differently, too; in an order that puts unlike ones side by side.
BLOCK_COLORS = ["4e79a7", "f28e2b", "59a14f", "e15759", "76b7b2", "edc948", "b07aa1", "9c755f", "86bcb6", "ff9da7",
                "499894", "d37295"]
LEVEL_COLORS = ["46518f", "3b7ea1", "3aa394", "6cc27a", "b9d965", "fbe56b"]  # dark: coarse
FIELD_COLORS = ["30365f", "41629b", "5c93b3", "a3bfb4", "ecd9a0", "eba55f", "d4653f", "9d2f35"]  # dark blue: low
STATE_NAMES = {0: ("unknown", "bab0ac"), 1: ("outside", "d0d7de"), 2: ("inside", "7fb7e6"), 3: ("cut", "f2994a")}
TITLES = {"block": "Blocks", "level": "Refinement level", "state": "Inside and cut by the surface"}
SHADES = 256
NO_NUMBER = (0.8, 0.8, 0.8)


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


def blended(ramp, at):
    """A colour of the ramp, from 0 to 1."""
    at *= len(ramp) - 1
    low = min(int(at), len(ramp) - 2)
    return tuple(a + (b - a) * (at - low) for a, b in zip(rgb(ramp[low]), rgb(ramp[low + 1])))


class Distinct:
    """Values that are names: whole numbers from 0, each with a colour of its own."""

    def __init__(self, title, array, entries):
        self.title, self.array, self.entries = title, array, entries
        self.on_points = False

    def table(self):
        table = vtkLookupTable()
        table.SetNumberOfTableValues(len(self.entries))
        table.SetTableRange(-0.5, len(self.entries) - 0.5)
        for entry in self.entries:
            table.SetTableValue(entry.value, *entry.color, 1.0)
        return table

    def used(self, grid):
        """The entries whose values the grid has."""
        array = data_of(grid, self).GetArray(self.array)
        values = {int(array.GetTuple1(i)) for i in range(array.GetNumberOfTuples())}
        return [entry for entry in self.entries if entry.value in values]


class Ramp:
    """Numbers from low to high; of vectors their lengths."""

    def __init__(self, title, array, low, high, on_points):
        self.title, self.array, self.low, self.high, self.on_points = title, array, low, high, on_points

    def table(self):
        table = vtkLookupTable()
        table.SetNumberOfTableValues(SHADES)
        table.SetTableRange(self.low, self.high if self.high > self.low else self.low + 1)
        for i in range(SHADES):
            table.SetTableValue(i, *self.color(i / (SHADES - 1)), 1.0)
        table.SetNanColor(*NO_NUMBER, 1.0)
        table.SetVectorModeToMagnitude()
        return table

    def color(self, at):
        return blended(FIELD_COLORS, at)


def data_of(grid, palette):
    """Where the palette's array is."""
    return grid.GetPointData() if palette.on_points else grid.GetCellData()


def palette_of(grid, by):
    """How to colour the grid by an array of its cells or points. Adds numbers for texts to the grid."""
    if by in TITLES:
        return known(grid, by)
    for on_points, data in ((False, grid.GetCellData()), (True, grid.GetPointData())):
        array = data.GetAbstractArray(by)
        if array is not None and array.IsNumeric():
            low, high = array.GetFiniteRange(-1) if array.GetNumberOfComponents() > 1 else array.GetFiniteRange(0)
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise Problem(f"array '{by}' has no finite number to draw")
            return Ramp(by, by, low, high, on_points)
        if array is not None:
            return of_texts(data, array, by, on_points)
    arrays = sorted({data.GetArrayName(i) for data in (grid.GetCellData(), grid.GetPointData())
                     for i in range(data.GetNumberOfArrays())})
    raise Problem(f"the export has no array '{by}', it has {', '.join(arrays)}")


def of_texts(data, array, by, on_points):
    texts = [array.GetValue(i) for i in range(array.GetNumberOfValues())]
    numbers = {text: number for number, text in enumerate(sorted(set(texts)))}
    codes = vtkIntArray()
    codes.SetName(f"number of {by}")
    for text in texts:
        codes.InsertNextValue(numbers[text])
    data.AddArray(codes)
    palette = Distinct(by, codes.GetName(),
                       [Entry(number, block_color(number), text or "(none)") for text, number in numbers.items()])
    palette.on_points = on_points
    return palette


def known(grid, by):
    """One entry for each value from 0 to the largest in use."""
    array = grid.GetCellData().GetArray(by)
    if array is None:
        raise Problem(f"the export has no cell array '{by}'")
    low, high = (int(v) for v in array.GetRange())
    if low < 0 or high > 1_000_000:
        raise Problem(f"cell array '{by}' runs from {low} to {high}, which is no {by}")
    if by == "block":
        entries = [Entry(v, block_color(v), str(v)) for v in range(high + 1)]
    elif by == "level":
        entries = [Entry(v, blended(LEVEL_COLORS, v / high if high else 0), str(v)) for v in range(high + 1)]
    else:
        entries = [Entry(v, rgb(color), name) for v, (name, color) in STATE_NAMES.items()]
    return Distinct(TITLES[by], by, entries)
