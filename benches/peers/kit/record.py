"""The record of a comparison: Markdown for people, JSON beside it."""

import json
import os
import platform
import subprocess
from pathlib import Path

from .install import ROOT
from .table import least_and_median, markdown, number, ratio

HOW = """\
* Least / median of the runs; runs of one item take turns. Ratios are of the least figures: how many times ours theirs is.
* CPU s is user and system time of all threads. Ours and fidget's is the whole process; a Python peer's begins after its imports
  and holds field, contour and file (`one-shot`: the whole process, for all). Wall s likewise. Every program may use all processors.
* ns is CPU time on one thread (Open3D, MeshLib: CPU time of all their threads). *All in*: with what must be known before, that is
  the enclosures and simplified tapes of the bricks for a sample, the search tree for a distance.
* fidget is the published crate, its default features for meshing, both engines: the virtual machine (vm) and the just-in-time compiler
  (jit), with its float and interval evaluators; of two engines on a mesh, one that takes three times the other's CPU s on 16³ cells is not run further.
  Both programs read the same expression, node by node; it samples in f32, ours in f64. Its meshes are dual contours: fewer triangles, not comparable by count.
* Defects: open / non-manifold / misoriented edges and zero-area triangles (faces dropped in reading included), by `alveole check`, whoever wrote the file; *inward*: all triangles face inside.
* Checked against ours, on closed solids: volume and, where both are marching cubes, triangles; of distances, mean magnitude and points inside. What differs by more than
  the item allows is marked **DISAGREES**.
"""


def conditions(commit_of=ROOT):
    """The machine, the load and the state of the source, as pairs of title and text."""
    first = lambda path, key: next((l.split(":", 1)[1].strip() for l in open(path) if l.startswith(key)), "?")
    ask = lambda *words: subprocess.run(words, capture_output=True, text=True, cwd=commit_of).stdout.strip()
    memory = int(first("/proc/meminfo", "MemTotal").split()[0]) / 2**20
    changed = " with uncommitted changes" if ask("git", "status", "--porcelain", "--", "src", "Cargo.toml") else ""
    return {
        "Machine": f"{first('/proc/cpuinfo', 'model name')}, {os.cpu_count()} processors, {memory:.0f} GiB, "
        f"Linux {platform.release().split('-')[0]}, {ask('rustc', '--version')}, Python {platform.python_version()}",
        "Commit": (ask("git", "rev-parse", "--short=10", "HEAD") or "?") + changed,
    }


def load(before, after):
    """How busy the machine was, in words."""
    text = f"{before:.1f} before, {after:.1f} after, our own runs included"
    busy = "; **the machine was busy**: times are upper bounds, walls above all; ratios suffer less"
    return text + (busy if min(before, after) > 0.75 * os.cpu_count() else "")


def best(item, results):
    """The peer with the least figure that makes our solid, if any."""
    able = [r for r in results[1:] if r.runs and r.contestant.same]
    return min(able, key=lambda r: min(r.figures(item)), default=None)


def summary(compared):
    """One line an item: ours, the best peer, and how many times ours it takes."""
    rows = []
    for item, results in compared:
        ours, peer = results[0], best(item, results)
        if not ours.runs or peer is None:
            continue
        figures, theirs = ours.figures(item), peer.figures(item)
        walls = ratio(peer.walls(item), ours.walls(item)) if item.unit == "s" else ""
        faults = [r.contestant.name for r in results if any("**" in remark for remark in r.remarks)]
        rows.append([
            item.name, item.title, f"{number(min(figures))} {item.unit}", peer.contestant.name,
            f"{number(min(theirs))} {item.unit}", ratio(theirs, figures), walls,
            "**no: " + ", ".join(faults) + "**" if faults else "yes",
        ])
    head = ["item", "work", "ours", "best peer", "theirs", "times ours", "wall, times ours", "results agree"]
    return markdown(head, rows)


def defects(mesh):
    if not mesh or "fault" in mesh:
        return mesh.get("fault", "")
    parts = "/".join(f"{mesh[key]:,}" for key in ("open", "nonmanifold", "misoriented", "zero_area"))
    return parts + (", inward" if mesh["inside_out"] else "")


def meshing(compared):
    rows = []
    for item, results in compared:
        for result in results:
            figures, mesh = result.figures(item), result.mesh
            rows.append([
                item.name if result is results[0] else "",
                result.contestant.name,
                str(len(result.runs) or ""),
                least_and_median(figures),
                least_and_median(result.walls(item)),
                number(result.peak() / 2**20) if result.runs else "",
                f"{mesh['triangles']:,}" if "triangles" in mesh else "",
                defects(mesh),
                f"{mesh['volume']:.6g}" if "volume" in mesh else "",
                "" if result is results[0] else ratio(figures, results[0].figures(item)),
                "" if result is results[0] else ratio(result.walls(item), results[0].walls(item)),
                "; ".join(result.remarks + ([] if result.contestant.same else ["another solid"])),
            ])
    head = [
        "item", "program", "runs", "CPU s", "wall s", "peak MiB", "triangles", "defects", "volume",
        "CPU, times ours", "wall, times ours", "remarks",
    ]
    return markdown(head, rows)


def rates(compared):
    rows = []
    for item, results in compared:
        for result in results:
            all_in = lambda r: r.answers("nanoseconds_bounded") or r.answers("nanoseconds_built")
            own = result is results[0]
            rows.append([
                item.name if own else "",
                result.contestant.name,
                str(len(result.runs) or ""),
                least_and_median(result.figures(item)),
                least_and_median(all_in(result)),
                "" if own else ratio(result.figures(item), results[0].figures(item)),
                "" if own else ratio(all_in(result), all_in(results[0])),
                number(result.peak() / 2**20) if result.runs else "",
                "; ".join(result.remarks),
            ])
    return markdown(
        ["item", "program", "runs", "ns", "all in, ns", "times ours", "all in, times ours", "peak MiB", "remarks"], rows
    )


def text(date, about, versions, missing, compared):
    """The whole record."""
    of = lambda unit: [(i, r) for i, r in compared if i.unit == unit]
    head = [f"# Comparison with other programs, {date}", ""]
    head += [f"* {title}: {line}." for title, line in about.items()]
    head += ["* Versions: " + ", ".join(f"{name} {version}" for name, version in versions.items()) + "."]
    head += [f"* Missing: {name} ({reason})." for name, reason in missing.items()]
    sections = [("At a glance", summary(compared))]
    if of("s"):
        sections.append(("From field to file", meshing(of("s"))))
    if of("ns"):
        sections.append(("Samples and distances", rates(of("ns"))))
    titles = "\n".join(f"* `{item.name}`: {item.title}." for item, _ in compared)
    sections += [("Items", titles), ("How", HOW)]
    return "\n".join(head) + "\n" + "".join(f"\n## {title}\n\n{body.rstrip()}\n" for title, body in sections)


def data(date, about, versions, missing, compared):
    """The same with every run, as JSON."""
    result = lambda r: {
        "name": r.contestant.name,
        "peer": r.contestant.peer,
        "words": r.contestant.words,
        "same_solid": r.contestant.same,
        "runs": [{"cpu": run.cpu, "wall": run.wall, "peak": run.peak, **{"answer": run.answer}} for run in r.runs],
        "mesh": r.mesh,
        "remarks": r.remarks,
    }
    item = lambda i, results: {
        "name": i.name,
        "title": i.title,
        "unit": i.unit,
        "allowed": {"triangles": i.triangles, "volume": i.volume, "mean": i.mean, "inside": i.inside},
        "results": [result(r) for r in results],
    }
    whole = {
        "date": date,
        "conditions": about,
        "versions": versions,
        "missing": missing,
        "items": [item(i, results) for i, results in compared],
    }
    return json.dumps(whole, indent=1) + "\n"


def write(path: Path, *parts):
    """The record at `path` and its JSON beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text(*parts))
    path.with_suffix(".json").write_text(data(*parts))
