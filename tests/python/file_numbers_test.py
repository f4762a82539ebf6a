# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers in files, computed in columns, against the rule spelt out one id at a time."""
import random
import unittest

import numpy as np

import ndmap
from ndmap.file_numbers import file_numbers, finest_level


def number_of(text, grid):
    """Of an id's text, with Python's own integers."""
    initial, _, rest = text[1:].partition("/")
    digits, _, corner = rest.partition(":")
    initial, _, first = initial.partition(":")
    corner = corner or first
    finest = finest_level(grid)
    number = int(initial)
    at = [number % grid.cells[0], number // grid.cells[0] % grid.cells[1], number // grid.cells[0] // grid.cells[1]]
    path = [int(digit) for digit in digits.split(".") if digit]
    for digit in path:
        at = [2 * along + (digit >> axis & 1) for axis, along in enumerate(at)]
        number = 8 * number + digit
    left = finest - len(path)
    if text[0] == "h":
        return number << 3 * left
    x, y, z = ((along + (int(corner) >> axis & 1)) << left for axis, along in enumerate(at))
    nx, ny = ((cells << finest) + 1 for cells in grid.cells[:2])
    return x + nx * (y + ny * z)


class FileNumbersTest(unittest.TestCase):
    def test_ids_of_every_level(self):
        random.seed(7)
        for cells in ((1, 1, 1), (3, 2, 5), (100, 1, 7), (1000, 1000, 1000)):
            grid = ndmap.Grid(cells, (0, 0, 0), (1, 1, 1))
            finest = finest_level(grid)
            self.assertLess((cells[0] << finest) * (cells[1] << finest) * (cells[2] << finest), 1 << 62)
            for kind in "hv":
                texts = []
                for level in list(range(finest + 1)) * 20:
                    digits = ".".join(str(random.randrange(8)) for _ in range(level))
                    part = f":{random.randrange(8)}" if kind == "v" else ""
                    texts.append(f"{kind}{random.randrange(grid.cell_count)}{'/' if digits else ''}{digits}{part}")
                numbers = file_numbers(ndmap.CellIds.of(texts), grid)
                self.assertEqual(numbers.tolist(), [number_of(text, grid) for text in texts])
        self.assertEqual(len(file_numbers(ndmap.CellIds.of([]), ndmap.Grid((1, 1, 1), (0, 0, 0), (1, 1, 1)))), 0)

    def test_the_finest_levels_are_those_of_the_services(self):
        levels = [finest_level(ndmap.Grid(cells, (0, 0, 0), (1, 1, 1))) for cells in ((1, 1, 1), (10, 11, 9), (1200, 1, 1))]
        self.assertEqual(levels, [20, 17, 17])
        self.assertEqual(np.dtype(file_numbers(ndmap.CellIds.of(["h0"]), ndmap.Grid((1, 1, 1), (0, 0, 0), (1, 1, 1))).dtype),
                         np.dtype(np.int64))


if __name__ == "__main__":
    unittest.main()
