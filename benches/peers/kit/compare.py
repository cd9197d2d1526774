"""Runs an item: ours and theirs in turn, their results checked against ours."""

import re
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from . import install, meshes
from .measure import answer, run
from .table import differs

# An engine whose trial costs this many times its sibling's is not run any further.
HOPELESS = 3.0


@dataclass
class Result:
    """What a contestant did: its runs, the state of its mesh, and what is to be said about it."""

    contestant: object
    runs: list = field(default_factory=list)
    mesh: dict = field(default_factory=dict)
    remarks: list = field(default_factory=list)
    failed: bool = False
    spent: float = 0.0

    def answers(self, key):
        return [run.answer[key] for run in self.runs if key in run.answer]

    def figures(self, item):
        """The item's figure, by run."""
        if item.unit == "ns":
            return self.answers("nanoseconds")
        return [run.cpu if item.whole else run.answer.get("cpu", run.cpu) for run in self.runs]

    def walls(self, item):
        return [run.wall if item.whole else run.answer.get("wall", run.wall) for run in self.runs]

    def peak(self):
        """The largest resident set in bytes, as the process itself told it if it did."""
        told = [run.answer.get("peak", run.peak) for run in self.runs]
        return max(told, default=0)


class Workbench:
    """The peers that are here, and the files that items need, made when first asked for."""

    def __init__(self, peers, missing, folder, may_install):
        self.peers, self.missing, self.folder, self.may_install = peers, missing, folder, may_install
        self.made = {}
        folder.mkdir(parents=True, exist_ok=True)

    def command(self, words, **files):
        """The words with what stands in braces filled in."""
        fill = lambda found: str(files.get(found[1]) or self.file(found[1]))
        return [re.sub(r"\{([^{}]+)\}", fill, word) for word in words]

    def file(self, name):
        if name not in self.made:
            self.made[name] = self._make(name)
        return self.made[name]

    def _make(self, name):
        kind, *rest = name.split(":")
        path = self.folder / name.replace(":", "-")
        if kind in ("export", "program"):
            done = run([*self.peers["ours"].command, kind, *rest], 120)
            if done.fault:
                raise install.Missing(f"{name}: {done.fault}")
            path.write_text(done.text)
        elif kind == "points":
            path.write_bytes(meshes.scattered(self.solid(rest[0])[0], int(rest[1])))
        elif kind == "cell":
            return max(meshes.sizes(self.solid("bunny")[0])[1]) / 8
        elif kind == "step":
            return max(meshes.sizes(self.solid("bunny")[0])[1]) / (int(rest[0]) - 3)
        else:
            path = path.with_suffix(".ply")
            meshes.write_ply(path, *self.solid(name))
        return path

    def solid(self, name):
        """Vertices and triangles of a mesh by name."""
        if name.endswith("-open"):
            return meshes.opened(*self.solid(name.removesuffix("-open")))
        key = f"solid {name}"
        if key not in self.made:
            if name == "bunny":
                self.made[key] = meshes.read_obj(install.bunny(self.folder.parent, self.may_install))
            else:
                vertices, triangles = self.solid("bunny")
                edge = max(meshes.sizes(vertices)[1]) / len(triangles) ** 0.5
                for level in (1, 2):
                    vertices, triangles = meshes.finer(vertices, triangles, 0.05 * edge / level)
                self.made[key] = vertices, triangles
        return self.made[key]

    def compare(self, item, repeats, limit, budget, say):
        """Results of the item, ours first."""
        results = [Result(contestant) for contestant in item.contestants]
        with tempfile.TemporaryDirectory(prefix="alveole-peers-") as scratch:
            for result in results:
                peer = result.contestant.peer
                if peer not in self.peers:
                    self._fail(result, f"left out: {self.missing.get(peer, 'unknown')}")
            self._drop_hopeless(results, Path(scratch), limit)
            for turn in range(repeats):
                for result in results:
                    if not result.failed and (turn == 0 or result.spent < budget):
                        self._turn(result, Path(scratch), limit)
                        say(result)
        for result in results[1:]:
            self._check(item, results[0], result)
        return results

    @staticmethod
    def _fail(result, reason):
        result.failed = True
        result.remarks.append(reason)

    def _run(self, result, words, scratch, limit):
        out, stats = scratch / f"out.{result.contestant.writes}", scratch / "stats.json"
        for path in (out, stats):
            path.unlink(missing_ok=True)
        try:
            command = self.command(words, out=out, stats=stats)
        except install.Missing as reason:
            self._fail(result, str(reason))
            return None, out
        start = time.monotonic()
        done = run([*self.peers[result.contestant.peer].command, *command], limit)
        result.spent += time.monotonic() - start
        if done.fault:
            self._fail(result, done.fault)
        elif stats.exists():
            told = answer(stats.read_text())
            done.answer = {"peak": told["peak_memory_bytes"], "triangles": told["triangles"]}
        return done, out

    def _drop_hopeless(self, results, scratch, limit):
        trials = {}
        for result in results:
            if result.contestant.trial and not result.failed:
                done, _ = self._run(result, result.contestant.trial, scratch, limit)
                if not result.failed:
                    trials[id(result)] = done.cpu
        for result in results:
            cost, least = trials.get(id(result)), min(trials.values(), default=0)
            if cost and cost > HOPELESS * least:
                self._fail(result, f"left out: {cost / least:.1f} times its best sibling's CPU s on a small grid")

    def _turn(self, result, scratch, limit):
        done, out = self._run(result, result.contestant.words, scratch, limit)
        if result.failed:
            return
        result.runs.append(done)
        if result.contestant.writes and not result.mesh:
            result.mesh = self._inspect(out, limit)

    def _inspect(self, path, limit):
        """What `alveole check` finds in the mesh, whoever wrote it."""
        found = run([*self.peers["alveole"].command, "check", "--json", str(path)], 4 * limit)
        if "check" not in found.answer:
            return {"fault": found.fault or "the mesh could not be read"}
        defects = found.answer["check"]["defects"]
        count = lambda *names: sum(defects[name]["count"] for name in names)
        return {
            "triangles": found.answer["check"]["triangles"],
            "volume": found.answer["volume"],
            "open": count("boundary_edge"),
            "nonmanifold": count("nonmanifold_edge", "nonmanifold_vertex"),
            "misoriented": count("misoriented_edge"),
            "zero_area": count("zero_area", "repeated_corner") + found.answer["reading"]["dropped"],
            "inside_out": found.answer["check"]["inside_out"],
        }

    @staticmethod
    def _check(item, ours, theirs):
        """Says loudly where their result is not ours."""
        if ours.failed or theirs.failed or not theirs.contestant.same:
            return
        pairs = []
        for key, allowed in (("triangles", item.triangles), ("volume", item.volume)):
            if allowed is not None:
                pairs.append((key, ours.mesh.get(key), theirs.mesh.get(key), allowed))
        if item.mean is not None:
            mean, count = ours.answers("mean"), ours.answers("points")
            pairs.append(("mean distance", mean[0], theirs.answers("mean")[0], item.mean))
            inside = abs(ours.answers("inside")[0] - theirs.answers("inside")[0])
            if inside > item.inside * count[0]:
                theirs.remarks.append(f"**DISAGREES: {inside:,} other points are inside**")
        for key, own, other, allowed in pairs:
            if own is None or other is None:
                theirs.remarks.append(f"**NOT CHECKED: no {key}**")
            elif differs(other, own, allowed):
                theirs.remarks.append(f"**DISAGREES: {key} {other:.6g}, ours {own:.6g}**")

