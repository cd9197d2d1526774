#!/usr/bin/env python3
"""Optimizers around `alveole serve`: a lattice of a given density and area.

The parameters of a gyroid wall in a box, the size of its cell and its level, are sought such that
relative density and area take given values. `cma` uses values only, `newton` their exact derivatives.
Prints the solution and the evaluations per second. Python's standard library is all it needs:

    cargo build --release
    python3 benches/optimize/optimize.py --alveole target/release/alveole

Source of `cma`: Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772, with the Cholesky
factor of the covariance matrix in place of its root.
"""

import argparse
import json
import math
import random
import subprocess
import time

PROGRAM = "gyroid scale cell dilate level box"
NAMES = ["cell", "level"]
START = [0.8, 0.0]
STEP = [0.15, 0.15]
MEASURES = ["relative_density", "area"]


class Server:
    """A running `alveole serve`; counts its evaluations and the time they take."""

    def __init__(self, binary, spacing):
        self.process = subprocess.Popen(
            [binary, "serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.spacing = spacing
        self.evaluations = 0
        self.seconds = 0.0

    def evaluate(self, point):
        """Relative density and area at the parameters `point`; None where there is no solid."""
        reply = self.ask(point, {"measure": ["relative_density", "area"]})
        return reply and [reply["measures"][name] for name in MEASURES]

    def derive(self, point):
        """The same, and their derivatives: a row each, with an entry a parameter."""
        reply = self.ask(point, {"gradient": True})
        if reply is None:
            return None
        found = reply["gradient"]
        by = {entry["parameter"]: entry for entry in found["by"]}
        rows = [[by[parameter][name] for parameter in NAMES] for name in MEASURES]
        return [found[name] for name in MEASURES], rows

    def ask(self, point, wanted):
        """The reply to a request; None where there is no solid."""
        request = {
            "id": self.evaluations,
            "program": PROGRAM,
            "parameters": dict(zip(NAMES, point)),
            "spacing": self.spacing,
            **wanted,
        }
        start = time.perf_counter()
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        reply = json.loads(self.process.stdout.readline())
        self.seconds += time.perf_counter() - start
        self.evaluations += 1
        assert reply["id"] == request["id"]
        if "error" in reply:
            if reply["error"]["kind"] in ("empty", "program"):
                return None
            raise RuntimeError(reply["error"]["message"])
        return reply

    def close(self):
        self.process.stdin.close()
        assert self.process.wait() == 0


def residuals(server, point, target):
    """Relative errors of density and area; None where there is no solid."""
    if point[0] < 0.1:
        return None
    found = server.evaluate(point)
    return found and [f / t - 1.0 for f, t in zip(found, target)]


def derived_residuals(server, point, target):
    """Relative errors and their derivatives, a row each; None where there is no solid."""
    found = None if point[0] < 0.1 else server.derive(point)
    if found is None:
        return None
    values, rows = found
    errors = [f / t - 1.0 for f, t in zip(values, target)]
    return errors, [[d / t for d in row] for row, t in zip(rows, target)]


def norm(vector):
    return math.sqrt(sum(v * v for v in vector))


def cholesky(c):
    """The lower factor of the positive definite matrix `c`."""
    n = len(c)
    a = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(i + 1):
            rest = c[i][j] - sum(a[i][k] * a[j][k] for k in range(j))
            a[i][j] = math.sqrt(max(rest, 1e-300)) if i == j else rest / a[j][j]
    return a


def cma(cost, mean, step, tolerance, generator):
    """The least `cost` around `mean`, by covariance matrix adaptation; coordinates in units of `step`."""
    n = len(mean)
    size = 4 + int(3 * math.log(n))
    kept = size // 2
    weights = [math.log(kept + 0.5) - math.log(i + 1) for i in range(kept)]
    weights = [w / sum(weights) for w in weights]
    mass = 1.0 / sum(w * w for w in weights)
    c_sigma = (mass + 2) / (n + mass + 5)
    damping = 1 + 2 * max(0.0, math.sqrt((mass - 1) / (n + 1)) - 1) + c_sigma
    c_path = (4 + mass / n) / (n + 4 + 2 * mass / n)
    c_one = 2 / ((n + 1.3) ** 2 + mass)
    c_mass = min(1 - c_one, 2 * (mass - 2 + 1 / mass) / ((n + 2) ** 2 + mass))
    expected = math.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n))
    sigma, path, path_sigma = 1.0, [0.0] * n, [0.0] * n
    covariance = [[float(i == j) for j in range(n)] for i in range(n)]
    centre = [0.0] * n
    best = (math.inf, mean)
    for generation in range(1, 200):
        factor = cholesky(covariance)
        tried = []
        for _ in range(size):
            z = [generator.gauss(0.0, 1.0) for _ in range(n)]
            y = [sum(factor[i][k] * z[k] for k in range(n)) for i in range(n)]
            point = [m + s * (c + sigma * d) for m, s, c, d in zip(mean, step, centre, y)]
            tried.append((cost(point), y, z, point))
        tried.sort(key=lambda t: t[0])
        best = min(best, (tried[0][0], tried[0][3]))
        if best[0] < tolerance:
            break
        chosen = list(zip(weights, tried))
        y = [sum(w * t[1][i] for w, t in chosen) for i in range(n)]
        z = [sum(w * t[2][i] for w, t in chosen) for i in range(n)]
        centre = [c + sigma * d for c, d in zip(centre, y)]
        spread = math.sqrt(c_sigma * (2 - c_sigma) * mass)
        path_sigma = [(1 - c_sigma) * p + spread * d for p, d in zip(path_sigma, z)]
        length = norm(path_sigma)
        limit = (1.4 + 2 / (n + 1)) * expected * math.sqrt(1 - (1 - c_sigma) ** (2 * generation))
        steady = 1.0 if length < limit else 0.0
        spread = steady * math.sqrt(c_path * (2 - c_path) * mass)
        path = [(1 - c_path) * p + spread * d for p, d in zip(path, y)]
        rest = 1 - c_one - c_mass + (1 - steady) * c_one * c_path * (2 - c_path)
        covariance = [
            [
                rest * covariance[i][j]
                + c_one * path[i] * path[j]
                + c_mass * sum(w * t[1][i] * t[1][j] for w, t in chosen)
                for j in range(n)
            ]
            for i in range(n)
        ]
        sigma *= math.exp(c_sigma / damping * (length / expected - 1))
    return best


def newton(equations, point, tolerance):
    """A root of two `equations`, which tell their derivatives, by Newton's method with shortened steps."""
    value, rows = equations(point)
    for _ in range(50):
        if norm(value) < tolerance:
            break
        (a, b), (c, d) = rows
        determinant = a * d - b * c
        change = [(b * value[1] - d * value[0]) / determinant, (c * value[0] - a * value[1]) / determinant]
        length = 1.0
        while length > 1e-4:
            trial = [p + length * c for p, c in zip(point, change)]
            found = equations(trial)
            if found and norm(found[0]) < norm(value):
                point, (value, rows) = trial, found
                break
            length /= 2
        else:
            break
    return norm(value), point


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--alveole", default="target/release/alveole", help="the program")
    parser.add_argument("--spacing", type=float, default=0.02, help="grid spacing")
    parser.add_argument("--density", type=float, default=0.4, help="relative density to reach")
    parser.add_argument("--area", type=float, default=60.0, help="area to reach")
    parser.add_argument("--tolerance", type=float, default=1e-4, help="relative error allowed")
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers")
    arguments = parser.parse_args()
    target = [arguments.density, arguments.area]
    for name in ["cma", "newton"]:
        server = Server(arguments.alveole, arguments.spacing)
        start = time.perf_counter()
        if name == "cma":
            def cost(point):
                found = residuals(server, point, target)
                return norm(found) if found else math.inf
            generator = random.Random(arguments.seed)
            error, point = cma(cost, START, STEP, arguments.tolerance, generator)
        else:
            equations = lambda point: derived_residuals(server, point, target)
            error, point = newton(equations, START, arguments.tolerance)
        seconds = time.perf_counter() - start
        server.close()
        values = ", ".join(f"{n} {v:.6f}" for n, v in zip(NAMES, point))
        print(
            f"{name}: {values}; relative error {error:.1e}; {server.evaluations} evaluations in "
            f"{seconds:.2f} s, {server.evaluations / server.seconds:.0f} a second"
        )


if __name__ == "__main__":
    main()
