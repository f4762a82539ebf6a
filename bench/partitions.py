#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the partitions: how evenly the work falls on blocks and how much they have to say to each other.

usage: bench/partitions.py SURFACE [--grid AxBxC | --cubes N] [--depth D] [--blocks K ...] [--ndmap PATH]

For each partition and number of blocks one `ndmap run`; prints a Markdown table: the busiest block's CPU seconds over the
mean (what K machines would wait for), the largest block's hexahedra over the mean, critical darts, messages, bytes.
"""
import argparse
import json
import subprocess
import sys
import tempfile


def run(options, partition, blocks):
    with tempfile.TemporaryDirectory() as folder:
        command = [options.ndmap, "run", options.surface, "--json", "--no-check", "--depth", str(options.depth),
                   "--blocks", str(blocks), "--partition", partition, "-o", folder + "/out"]
        if options.grid:
            command += ["--grid", options.grid]
        if options.cubes:
            command += ["--cubes", str(options.cubes)]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr.strip().splitlines()[-1])
        return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("surface")
    parser.add_argument("--grid")
    parser.add_argument("--cubes", type=int)
    parser.add_argument("--depth", type=int, default=4)
    parser.add_argument("--blocks", type=int, nargs="+", default=[8, 32])
    parser.add_argument("--ndmap", default="build/release/bin/ndmap")
    options = parser.parse_args()
    print("| blocks | partition | busiest block / mean CPU | largest block / mean hexahedra | critical darts | messages | MiB sent |")
    print("|---|---|---|---|---|---|---|")
    for blocks in options.blocks:
        hashes = set()
        for partition in ("hilbert", "morton", "slabs", "metis", "lpt"):
            result = run(options, partition, blocks)
            hashes.add(result["hash"])
            busy = [b["busy_seconds"] for b in result["blocks"]]
            cells = [b["hexahedra"] for b in result["blocks"]]
            print(f"| {blocks} | {partition} | {max(busy) * blocks / sum(busy):.2f} "
                  f"| {max(cells) * blocks / sum(cells):.2f} | {result['critical_darts']:,} "
                  f"| {result['messages']:,} | {result['message_bytes'] / 2**20:.1f} |", flush=True)
        if len(hashes) != 1:
            sys.exit(f"{blocks} blocks: the partitions gave different hashes {hashes}")


if __name__ == "__main__":
    main()
