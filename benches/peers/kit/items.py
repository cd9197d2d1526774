"""The work that is compared: items, each with those who do it, ours first.

Words in braces are filled in when an item runs: `{out}` the file to write, `{stats}` a file for our
own statistics, `{export:MODEL}` and `{program:MODEL}` the files of a model, `{bunny}`, `{bunny-open}`,
`{bunny-900k}`, `{bunny-900k-open}` meshes, `{points:MESH:COUNT}` random points around a mesh,
`{cell}` and `{step:N}` lengths of the fill.
"""

from dataclasses import dataclass, field


@dataclass
class Contestant:
    """One way of doing an item's work."""

    name: str
    peer: str
    words: list
    # Extension of the mesh file that it writes.
    writes: str = ""
    # Whether it makes the item's solid; another one is only listed.
    same: bool = True
    # A small version of the work: of a peer's engines only those near the best of it do the rest.
    trial: list = field(default_factory=list)


@dataclass
class Item:
    """Work with a name. The unit is that of the figures: `s` (CPU seconds) or `ns` a sample or query."""

    name: str
    title: str
    unit: str
    contestants: list
    # Relative differences from ours that are allowed; None where counts can't agree.
    triangles: float | None = None
    volume: float | None = None
    # Of distances: of the mean magnitude, and of the points inside as a share of all.
    mean: float | None = None
    inside: float | None = None
    # Whether a Python peer's whole process counts, imports included.
    whole: bool = False


def items(quick):
    """All items; with `quick`, smaller and fewer."""
    return [
        *(headline(n) for n in ([101, 201] if quick else [101, 201, 401, 801])),
        one_shot(),
        *(samples(model) for model in MODELS),
        *(meshes(model, 6 if quick else depth) for model, depth in MODELS.items()),
        *distances("bunny", "56 k", 20_000 if quick else 200_000, 32 if quick else 64),
        *([] if quick else distances("bunny-900k", "900 k", 100_000, 48)),
        *([] if quick else [filled(100), filled_finely(400)]),
    ]


def cesogen(*words, suffix="ply"):
    return Contestant("alveole", "cesogen", ["-q", "--stats", "{stats}", "-o", "{out}", *words], suffix)


def headline(n):
    contour = lambda name, peer, *words: Contestant(name, peer, ["contour", *words, str(n), "{out}"], "ply")
    return Item(
        f"headline-{n}",
        f"gyroid in a box, {n}³ nodes, field to PLY file",
        "s",
        [
            cesogen("-s", f"2/{n - 1}", "gyroid", "box"),
            contour("vtkFlyingEdges3D", "vtk", "flying-edges"),
            contour("vtkMarchingCubes", "vtk", "marching-cubes"),
            contour("Open3D", "open3d"),
        ],
        triangles=0.04,
        volume=0.005,
    )


def one_shot():
    n = 101
    return Item(
        "one-shot-101",
        f"an optimizer's call: start a process, gyroid in a box, {n}³ nodes, to PLY file",
        "s",
        [
            cesogen("-s", f"2/{n - 1}", "--param", "t=0", "gyroid", "dilate", "t", "box"),
            Contestant("VTK in Python", "vtk", ["contour", "flying-edges", str(n), "{out}"], "ply"),
            Contestant("Open3D in Python", "open3d", ["contour", str(n), "{out}"], "ply"),
            Contestant("microgen", "microgen", ["box", str(n - 1), "{out}"], "ply"),
        ],
        volume=0.005,
        whole=True,
    )


# The depth of fidget's octree: 2^depth cells a side. Many small parts need the finer one.
MODELS = {
    "gyroid": 7,
    "neovius": 7,
    "gyroid-about-any": 7,
    "gyroid-graded": 7,
    "hierarchical-unit": 7,
    "spheres-20": 7,
    "spheres-10000": 8,
    "csg-10000": 8,
    "terms-500": 6,
}


def samples(model):
    engine = lambda name: Contestant(f"fidget {name}", "fidget", ["eval", f"{{export:{model}}}", name])
    return Item(
        f"samples-{model}",
        f"{model}: a sample in the bricks that intervals leave of 128³ cells",
        "ns",
        [Contestant("alveole", "ours", ["eval", model]), engine("vm"), engine("jit")],
    )


def meshes(model, depth):
    field = f"{{export:{model}}}"

    def engine(name):
        words = lambda depth: ["mesh", field, name, str(depth), "{out}"]
        return Contestant(f"fidget {name}", "fidget", words(depth), "stl", trial=words(4))

    return Item(
        f"mesh-{model}",
        f"{model}: {2**depth}³ cells to STL file",
        "s",
        [
            cesogen("-s", f"2/{2**depth}", "--bounds=-1,-1,-1,1,1,1", f"@{{program:{model}}}", suffix="stl"),
            engine("vm"),
            engine("jit"),
        ],
        # Small parts are few cells wide, and the two methods cut their edges differently.
        volume=0.05 if model in ("spheres-10000", "csg-10000") else 0.01,
    )


def distances(mesh, size, count, side):
    points = f"{{points:{mesh}:{count}}}"
    closed, opened = f"{{{mesh}}}", f"{{{mesh}-open}}"
    item = lambda kind, title, contestants: Item(
        f"distance-{mesh}-{kind}", f"{size} triangles, {title}", "ns", contestants, mean=1e-3, inside=2e-3
    )
    ask = lambda name, peer, *words: Contestant(name, peer, ["distance", *words])
    return [
        item("random", f"{count:,} random points", [
            ask("alveole", "ours", closed, points),
            ask("Open3D", "open3d", closed, points),
            ask("MeshLib", "meshlib", closed, points, "normals"),
        ]),
        item("grid", f"grid of {side}³ points", [
            ask("alveole", "ours", closed, str(side)),
            ask("Open3D", "open3d", closed, str(side)),
            ask("MeshLib", "meshlib", closed, str(side), "normals"),
        ]),
        item("winding", f"with holes, signed by winding numbers, grid of {side}³ points", [
            ask("alveole", "ours", opened, str(side)),
            ask("MeshLib", "meshlib", opened, str(side), "winding"),
        ]),
    ]


# Gyroid cells along the longest side of the part that is filled.
CELLS = 8


def fill_words(n):
    return ["-s", f"{{step:{n}}}", "{bunny}", "gyroid", "scale", "{cell},{cell},{cell}", "intersection"]


def filled(n):
    fill = lambda name, peer, samples, same=True: Contestant(
        name, peer, ["fill", "{bunny}", str(CELLS), str(samples), "{out}"], "ply", same
    )
    return Item(
        f"fill-{n}",
        f"bunny filled with {CELLS} gyroid cells, about {n} samples along it, mesh to PLY file",
        "s",
        [
            cesogen(*fill_words(n)),
            fill("Open3D distance and contour", "open3d", n),
            fill("Scaffolder", "scaffolder", n),
            fill("MeshLib, double gyroid", "meshlib", n, same=False),
            fill("microgen, walls at 64 samples", "microgen", 64, same=False),
        ],
        volume=0.02,
    )


def filled_finely(n):
    return Item(
        f"fill-{n}",
        f"bunny filled with {CELLS} gyroid cells, about {n} samples along it, mesh to PLY file",
        "s",
        [cesogen(*fill_words(n))],
    )
