# SPDX-License-Identifier: GPL-3.0-or-later
"""The page docs/benchmarks.md and its plots, from the samples that bench/run.py took."""

import os
from statistics import median

import matplotlib

matplotlib.use("Agg")
# pylint: disable=wrong-import-position
import matplotlib.pyplot as plt

from common import DOCS, table

# What makes the mesh; the rest of a run starts services, counts, hashes and checks.
JOB_PHASES = ["build", "refine", "classify", "trim"]
PLAIN_PHASES = {"build": ["grid"], "refine": ["test", "split"], "classify": ["classify"], "trim": ["remove"]}
MIB = 1024.0 * 1024.0

HEAD = """# Benchmarks

Made by `bench/run.py` (a part alone: `bench/run.py routing`), which keeps every sample in
[benchmarks.json](benchmarks.json) and writes this page. It needs the release preset's programs and `python3-matplotlib`.
The surface is ndmap's own sample, so anyone can repeat it: `ndmap sample bumpy-torus -o bumpy-torus.off`.

**The machine has 2 cores, and other work was going on**: the load average when samples began is given under each table
(more than 2 means that programs waited for a core). Wall times are therefore worse than on a quiet machine, and
vary; CPU seconds vary less. The mesh is the same in every sample; numbers of messages vary by some per cent, because
two blocks that split the same edge at the same time both tell it. Times are medians of {repeat} samples.

"""


def middle(samples, value):
    return median(value(sample) for sample in samples)


def job_seconds(sample, of="seconds"):
    return sum(sample[of].get(phase, 0) for phase in JOB_PHASES)


def plain_seconds(sample, kinds=("wall",)):
    return sum(plain_phase(sample, phase, kind) for phase in JOB_PHASES for kind in kinds)


def plain_phase(sample, phase, kind):
    return sum(sample["seconds"][name][kind] for name in PLAIN_PHASES[phase])


def job_cpu(sample):
    return job_seconds(sample, "user_seconds") + job_seconds(sample, "system_seconds")


def peak(sample):
    rss = sample["peak_rss_bytes"]
    return rss["sum"] if isinstance(rss, dict) else rss


def loads(part):
    every = [sample["load"] for samples in part["samples"].values() for sample in samples]
    return f"Load average when samples began: {min(every):.1f} to {max(every):.1f}; {part['date']}.\n\n"


def command(text):
    return f"```console\n$ {text}\n```\n\n"


def plot(name, x_label, y_label, curves, logarithmic=False):
    """curves: {label: (xs, ys)}."""
    figure, axes = plt.subplots(figsize=(5.6, 3.4))
    for label, (xs, ys) in curves.items():
        axes.plot(xs, ys, marker="o", label=label)
    axes.set_xscale("log", base=2)
    if logarithmic:
        axes.set_yscale("log", base=2)
        axes.yaxis.set_major_formatter("{x:g}")
    else:
        axes.set_ylim(bottom=0)
    ticks = sorted({x for xs, _ in curves.values() for x in xs})
    axes.set_xticks(ticks)
    axes.set_xticklabels([str(x) for x in ticks])
    if max(y for _, ys in curves.values() for y in ys) >= 10000:
        axes.yaxis.set_major_formatter("{x:,.0f}")
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(os.path.join(DOCS, "pictures", name), dpi=110)
    plt.close(figure)
    return f"![{y_label} against {x_label}](pictures/{name})\n\n"


def core_page(part):
    samples = part["samples"]
    plain = samples["plain"]
    plain_wall, plain_memory = middle(plain, plain_seconds), middle(plain, peak)
    plain_cpu = middle(plain, lambda s: plain_seconds(s, ("user", "system")))
    rows, phases = [], []
    for name in sorted(samples, key=lambda n: (["plain", "core", "ndmap"].index(n.split()[0]), n)):
        list_ = samples[name]
        made = list_[0]["made"]
        is_plain = name == "plain"
        title = {"plain": "plain CGAL", "core": "block algorithms, no services, 1 block"}.get(
            name, f"ndmap, {name.split()[-1]} block" + ("" if name == "ndmap 1" else "s"))
        wall = middle(list_, plain_seconds if is_plain else job_seconds)
        cpu = plain_cpu if is_plain else middle(list_, job_cpu)
        memory = middle(list_, peak)
        rows.append([title, f"{made:,}", f"{wall:.2f}", f"{made / wall:,.0f}", f"{wall / plain_wall:.2f}", f"{cpu:.2f}",
                     f"{made / cpu:,.0f}", f"{cpu / plain_cpu:.2f}", f"{memory / MIB:.0f}", f"{memory / made:.0f}",
                     f"{memory / plain_memory:.2f}"])
        cells = []
        for phase in JOB_PHASES + ["count", "hash", "check"]:
            if is_plain:
                cells.append("" if phase not in PLAIN_PHASES else " + ".join(
                    f"{middle(list_, lambda s, k=kind: plain_phase(s, phase, k)):.2f}"
                    for kind in ("user", "system")))
            else:
                cells.append(" + ".join(f"{middle(list_, lambda s, k=kind: s[k].get(phase, 0)):.2f}"
                                        for kind in ("user_seconds", "system_seconds")))
        phases.append([title, *cells])
    text = "## Speed and memory, beside one plain CGAL map\n\n" + command(
        "bench/run.py core     # ndmap run bumpy-torus.off --cubes 11 --depth 5 --blocks 1, 2, 4 --json")
    text += """The peer, `bench_plain_cgal`, is the same job as a user would write it without ndmap: one process, one
`Linear_cell_complex_for_combinatorial_map` with CGAL's own storage, `insert_*` and `remove_cell`, CGAL's AABB tree. *Job* is
building the grid, refining, classifying and trimming; reading the surface is not in it. Memory is the peak of the
resident set, all included, summed over all processes (command line, coordinator and block servers), by hexahedron
made. A *ratio* is the row's number by the plain map's, less is better. While others want the two cores, wall times are
mostly theirs, and a program with two busy processes gets more of the machine than one with a single one: the ratio
of CPU seconds is the one to rely on.

"""
    text += table(["", "made", "job, wall s", "hexahedra/s", "ratio of wall s", "job CPU, s", "hexahedra/CPU s", "ratio of CPU s",
                   "peak RSS, MiB", "bytes/hexahedron", "ratio of bytes"], rows) + "\n" + loads(part)
    text += "User + system seconds by phase (block servers only):\n\n"
    return text + table(["", *JOB_PHASES, "count", "hash", "check"], phases) + "\n"


def wire_page(part):
    rows = []
    for blocks, list_ in sorted(part["samples"].items(), key=lambda item: int(item[0])):
        s = list_[0]
        if s["refine_refined_at_boundary"] == 0:
            continue
        boundary = s["refine_refined_at_boundary"]
        rows.append([blocks, f"{s['refine_refined']:,}", f"{boundary:,}", f"{s['refine_messages']:,}",
                     f"{s['refine_messages'] / boundary:.2f}", f"{s['refine_message_bytes'] / boundary:.1f}",
                     f"{s['refine_message_bytes'] / s['refine_messages']:.1f}"])
    return """## Messages on the wire

From the runs of Figure 11 below (depth 5, direct routing): messages of all refinement levels, by hexahedron that was
refined and had a face that another block has, too. Bytes are those of the encoded batches, without gRPC's own
frames.

""" + table(["blocks", "refined", "at a boundary", "messages", "messages each", "bytes each", "bytes a message"], rows) + "\n"


def routing_page(part):
    samples = part["samples"]
    blocks = sorted({int(name.split()[1]) for name in samples})
    rows, curves = [], {"direct": ([], []), "broadcast": ([], [])}
    for b in blocks:
        row = [b]
        for routing in curves:
            list_ = samples[f"{routing} {b}"]
            seconds = middle(list_, lambda s: s["cpu_seconds"]["refine"])
            row += [f"{middle(list_, lambda s: s['seconds']['refine']):.2f}", f"{seconds:.2f}",
                    f"{list_[0]['refine_messages']:,}", f"{list_[0]['refine_message_bytes'] / MIB:.2f}"]
            curves[routing][0].append(b)
            curves[routing][1].append(seconds)
        rows.append(row)
    text = "## Direct against broadcast (the paper's Figure 10)\n\n" + command(
        "bench/run.py routing  # ndmap run bumpy-torus.off --cubes 11 --depth 4 --blocks K --routing direct|broadcast")
    head = ["blocks"] + [f"{routing}: {what}" for routing in curves for what in ("wall s", "CPU s", "messages", "MiB")]
    text += "The refinement phases alone. With broadcast routing a message goes to every other block. The plot is of CPU\n"
    text += "seconds of the block servers.\n\n"
    return text + table(head, rows) + "\n" + loads(part) + plot(
        "routing.png", "blocks", "refinement, CPU seconds", curves)


def blocks_page(part):
    rows, xs, wall, busiest = [], [], [], []
    for blocks, list_ in sorted(part["samples"].items(), key=lambda item: int(item[0])):
        xs.append(int(blocks))
        wall.append(middle(list_, job_seconds))
        busiest.append(middle(list_, lambda s: max(s["block_busy_seconds"])))
        rows.append([blocks, f"{wall[-1]:.2f}", f"{middle(list_, job_cpu):.2f}", f"{busiest[-1]:.2f}",
                     f"{busiest[0] / busiest[-1]:.2f}", f"{middle(list_, lambda s: s['seconds']['total']):.2f}",
                     f"{max(list_[0]['block_hexahedra']) / sum(list_[0]['block_hexahedra']) * xs[-1]:.2f}"])
    text = "## Time against number of blocks, at fixed depth (Figure 11)\n\n" + command(
        "bench/run.py blocks   # ndmap run bumpy-torus.off --cubes 11 --depth 5 --blocks K")
    text += """Two block servers on two cores host all blocks, so wall time cannot fall beyond two blocks. What K machines would
wait for is the *busiest block*: the CPU seconds that worker threads spent on it, all phases with count, hash and check.
Neither gRPC's own threads nor waiting for messages at the end of a phase are in it, so *speed-up*, one block's seconds by
it, is what the partition allows, not what a network was seen to give. *Balance* is the largest block's hexahedra by the
mean.

"""
    text += table(["blocks", "job, wall s", "job CPU, s", "busiest block, CPU s", "speed-up", "whole run, wall s", "balance"], rows)
    return text + "\n" + loads(part) + plot("blocks.png", "blocks", "seconds", {
        "job, wall, two cores": (xs, wall), "busiest block, CPU, all phases": (xs, busiest)}, True)


def memory_page(part):
    rows, xs, made = [], [], []
    for blocks, list_ in sorted(part["samples"].items(), key=lambda item: int(item[0])):
        s = list_[0]
        xs.append(int(blocks))
        made.append(s["made"])
        rows.append([blocks, f"{s['made']:,}", f"{s['made'] / made[0]:.2f}", s["levels_reached"],
                     "yes" if s["stopped_by_memory"] else "no", "yes" if s["valid"] else "no",
                     f"{peak(s) / MIB:.0f}", f"{s['seconds']['total']:.1f}"])
    text = "## Hexahedra within 256 MiB a block, against number of blocks (Figure 12)\n\n" + command(
        "bench/run.py memory   # ndmap run bumpy-torus.off --cubes 11 --depth 8 --memory-limit 256MiB --blocks K")
    text += """The limit is in accounted bytes of each block (the map's arrays and tables), checked before each own refinement; depth 8
is more than fits. One sample a row: what a limit leaves behind depends on timing. The resident set is that of all
processes; besides the blocks it has each server's copy of the surface and what classifying, trimming and checking need.

"""
    text += table(["blocks", "hexahedra made", "by one block's", "finest level", "stopped by the limit", "valid",
                   "peak RSS, MiB", "whole run, s"], rows)
    return text + "\n" + loads(part) + plot("memory.png", "blocks", "hexahedra made",
                                             {"256 MiB a block": (xs, made)})


def write(path, results):
    os.makedirs(os.path.join(DOCS, "pictures"), exist_ok=True)
    counts = [len(samples) for name, part in results.items() if name != "memory" for samples in part["samples"].values()]
    text = HEAD.format(repeat=min(counts) if counts else 0)
    pages = [("core", core_page), ("blocks", wire_page), ("routing", routing_page), ("blocks", blocks_page),
             ("memory", memory_page)]
    text += "".join(page(results[name]) for name, page in pages if name in results)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text.rstrip("\n") + "\n")
