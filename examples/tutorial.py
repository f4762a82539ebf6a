#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tutorial (docs/tutorial.md) in Python: a map of a surface, a walk through its blocks, a field, a mesh with it.

  tutorial.py HOST:PORT SURFACE.off MESH.vtu
"""
import sys

import numpy as np
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

import ndmap

INSIDE = (-0.3, 0.1, 0.1)
HOT = np.array([0.9, 0.0, 0.0])


def make(client, surface):
    """A map in four blocks, fine where it meets the surface, without what lies outside."""
    ball = client.create_map("pyball", surface, grid="8x8x8", blocks=4, partition="slabs")
    ball.refine(depth=2).result()
    ball.trim().result()
    print(f"{ball.stats().counts['hexahedra']:,} hexahedra")
    return ball


def walk_out(ball, point):
    """From the hexahedron at the point across the side that lies farthest along x, again and again."""
    cell = ball.cell(ball.locate([point])[0][0])
    while True:
        print(f"{cell} of level {cell.level} in block {cell.blocks[0]}")
        faces = ball.explore(cell, close="3", give="details", dimension=2)
        far = max(faces, key=lambda face: face.points[:, 0].mean())
        if far.boundary:
            print("the boundary of the map")
            return
        cell = next(ball.cell(other) for other in ball.incident(far, 3) if other != cell.id)


def temperature(point):
    """20 degrees, and up to 70 more around HOT."""
    return 20 + 70 * np.exp(-4 * ((point - HOT) ** 2).sum(axis=1))


def heat(ball):
    """A field on the vertices, refined where it is hot."""
    ball.define("temperature", on="vertices", type="double", split="mean", fill=20.0).result()
    ball.compute("temperature", temperature, "@point")
    values = ball.read("temperature", "@point")
    hottest = np.argmax(values["temperature"])
    print(f"hottest at {values['@point'][hottest].round(2)}: {values['temperature'][hottest]:.2f}")
    ball.refine(3, "sphere", centre=HOT, radius=0.2).result()
    whole = ball.aggregate("temperature", histogram=(7, 20.0, 90.0), integral=True)
    print(f"{whole.count:,} vertices, {whole.min:.2f} to {whole.max:.2f}, mean of the volume "
          f"{whole.integral / whole.volume:.2f}")
    print("in bins of 10:", *whole.histogram)


def save(ball, path):
    """The mesh with its field."""
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(path)
    writer.SetInputData(ball.to_vtk())
    if not writer.Write():
        sys.exit(f"tutorial.py: cannot write {path}")


def main():
    target, surface, path = sys.argv[1:]
    with ndmap.connect(target) as client:
        ball = make(client, surface)
        walk_out(ball, INSIDE)
        heat(ball)
        save(ball, path)
        client.delete_map("pyball")


if __name__ == "__main__":
    main()
