"""Speed of one forward-dynamics evaluation, joint loads included, against Pinocchio's aba.

    python benchmarks/evaluate.py [-o results] [--rounds 15] [--no-cpp]

Two arenas. From Python: single calls on NumPy arrays, on a 7-joint robot arm and on chains. In C++:
the same chains without any Python (needs a compiler; Pinocchio's side also its headers and Eigen's,
from the wheels pin and cmeel-eigen). Contestants take turns within one run and every call gets
another state; medians and quartiles of nanoseconds a body. Wrong answers are not timed.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import time
from importlib import metadata, util
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import linkwise as lw

ROOT = Path(__file__).resolve().parents[1]
SIZES = (7, 30, 100, 300)
STATES = 64
SECONDS_A_ROUND = 0.05


def linkwise_chain(n, rng):
    """A chain of revolute joints about changing axes, as links for Pinocchio too."""
    builder = lw.ModelBuilder(f"chain {n}")
    builder.add_link("ground")
    links, parent = [], "ground"
    for k in range(n):
        rotation = Rotation.from_quat(rng.standard_normal(4)).as_matrix()
        translation = np.array([0.3, 0, -1.0]) if k else np.zeros(3)
        mass, com, inertia = 1.0, np.array([0.1, 0, -0.5]), np.diag([0.084, 0.084, 0.00125])
        links.append((rotation, translation, mass, com, inertia))
        builder.add_link(f"link{k}", mass=mass, com=com, inertia=inertia)
        builder.add_joint(
            f"joint{k}", "revolute", parent, f"link{k}", translation=translation, rotation=rotation
        )
        parent = f"link{k}"
    return builder.build(), links


def pinocchio_chain(pin, links):
    model, joint = pin.Model(), 0
    for k, (rotation, translation, mass, com, inertia) in enumerate(links):
        place = pin.SE3(rotation, translation)
        joint = model.addJoint(joint, pin.JointModelRZ(), place, f"joint{k}")
        model.appendBodyToJoint(joint, pin.Inertia(mass, com, inertia), pin.SE3.Identity())
    return model


def machines(pin):
    """(name, our model, Pinocchio's or None)."""
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        files = []
    for path in (str(f.locate()) for f in files if f.name == "xarm7.urdf"):
        yield "xarm7", lw.load(path), pin and pin.buildModelFromUrdf(path)
    for n in SIZES[1:]:
        model, links = linkwise_chain(n, np.random.default_rng(n))
        yield f"chain {n}", model, pin and pinocchio_chain(pin, links)


def contestants(pin, model, reference):
    """{name: function of (q, v, tau)}; ours return accelerations and joint loads."""

    def ours(**options):
        return lambda q, v, tau: lw.forward_dynamics(model, q, v, tau, full=True, **options)

    entries = {
        "articulated_body": ours(method="articulated_body"),
        "constraint_force": ours(method="constraint_force", solver="thomas"),
    }
    if reference is not None:
        data = reference.createData()
        for name in ("WORLD", "LOCAL"):
            convention = getattr(pin.Convention, name)
            entries[f"pinocchio_{name.lower()}"] = lambda q, v, tau, convention=convention: pin.aba(
                reference, data, q, v, tau, convention
            )
    return entries


def accelerations(result):
    return np.array(getattr(result, "acceleration", result))


def race_in_python(rounds):
    pin = __import__("pinocchio") if util.find_spec("pinocchio") else None
    for name, model, reference in machines(pin):
        entries = contestants(pin, model, reference)
        states = np.random.default_rng(1).uniform(-1, 1, (STATES, 3, model.nv))
        expected = None
        for function in entries.values():
            found = np.array([accelerations(function(*s)) for s in states])
            expected = found if expected is None else expected
            error = np.abs(found - expected).max() / np.abs(expected).max()
            if not error < 1e-8:
                raise SystemExit(f"{name}: the contestants disagree by {error:.1e}")
        calls = {key: calls_a_round(function, states) for key, function in entries.items()}
        for _ in range(rounds):
            for key, function in entries.items():
                seconds = spend(function, states, calls[key])
                yield {
                    "arena": "Python",
                    "machine": name,
                    "n": model.nv,
                    "contestant": key,
                    "ns_per_body": 1e9 * seconds / calls[key] / model.nv,
                }


def spend(function, states, calls):
    rows = [tuple(state) for state in states]
    start = time.perf_counter()
    for k in range(calls):
        function(*rows[k % STATES])
    return time.perf_counter() - start


def calls_a_round(function, states):
    return 1 + int(SECONDS_A_ROUND * STATES / spend(function, states, STATES))


def race_in_cpp(rounds, build):
    """Build the C++ program in `build` (kept for the next time) and run it."""
    if not shutil.which("cmake"):
        print("No cmake here: the C++ program is left out.", file=sys.stderr)
        return
    prefixes = [str(folder) for p in sys.path if (folder := Path(p) / "cmeel.prefix").is_dir()]
    configure = [
        *("cmake", "-S", ROOT, "-B", build, "-DCMAKE_BUILD_TYPE=Release"),
        *("-DLINKWISE_CPU_TARGETS=native", "-DLINKWISE_BUILD_BENCHMARKS=ON"),
        f"-DCMAKE_PREFIX_PATH={';'.join(prefixes)}",
    ]
    compile_ = ["cmake", "--build", build, "--target", "linkwise_evaluate", "--parallel", "2"]
    for command in (configure, compile_):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    program = [build / "benchmarks" / "cpp" / "linkwise_evaluate", str(rounds), *map(str, SIZES)]
    lines = subprocess.run(program, check=True, capture_output=True, text=True).stdout.splitlines()
    for line in lines:
        row = json.loads(line)
        yield {"arena": "C++", "machine": f"chain {row['n']}", **row}


def summarise(rows):
    """Median and quartiles of every contestant, and its speed against Pinocchio's better one."""
    groups = {}
    for row in rows:
        key = row["arena"], row["machine"], row["n"], row["contestant"]
        groups.setdefault(key, []).append(row["ns_per_body"])
    best = {}
    for (arena, machine, _, contestant), values in groups.items():
        if contestant.startswith("pinocchio"):
            key = arena, machine
            best[key] = min(best.get(key, np.inf), np.median(values))
    table = []
    for (arena, machine, n, contestant), values in groups.items():
        low, median, high = np.percentile(values, [25, 50, 75])
        peer = best.get((arena, machine))
        table.append(
            {
                "arena": arena,
                "machine": machine,
                "n": n,
                "contestant": contestant,
                "ns_per_body": median,
                "quartiles": [low, high],
                "times_pinocchio": peer / median if peer else None,
            }
        )
    return table


def markdown(table):
    lines = [
        "| arena | machine | contestant | ns/body | quartiles | times Pinocchio's speed |",
        "|---|---|---|---|---|---|",
    ]
    for row in table:
        low, high = row["quartiles"]
        speed = "-" if row["times_pinocchio"] is None else f"{row['times_pinocchio']:.2f}"
        lines.append(
            f"| {row['arena']} | {row['machine']} | {row['contestant']} "
            f"| {row['ns_per_body']:.1f} | {low:.1f} - {high:.1f} | {speed} |"
        )
    return "\n".join(lines)


def conditions():
    versions = {}
    for package in ("linkwise", "pin", "numpy"):
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            versions[package] = None
    info = Path("/proc/cpuinfo")
    names = [x for x in info.read_text().splitlines() if "model name" in x] if info.exists() else []
    cpu = names[0].split(":")[1].strip() if names else platform.processor()
    return {"cpu": cpu, "cores": os.cpu_count(), "python": platform.python_version(), **versions}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "-o", "--output", type=Path, help="folder for evaluate.json and evaluate.md"
    )
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "benchmarks")
    parser.add_argument("--no-cpp", action="store_true", help="only the calls from Python")
    parser.add_argument("--no-python", action="store_true", help="only the C++ program")
    arguments = parser.parse_args()
    rows = [] if arguments.no_python else list(race_in_python(arguments.rounds))
    if not arguments.no_cpp:
        rows += race_in_cpp(arguments.rounds, arguments.build)
    table = summarise(rows)
    print(markdown(table))
    if arguments.output:
        arguments.output.mkdir(parents=True, exist_ok=True)
        result = {"conditions": conditions(), "table": table}
        (arguments.output / "evaluate.json").write_text(json.dumps(result, indent=1) + "\n")
        (arguments.output / "evaluate.md").write_text(markdown(table) + "\n")


if __name__ == "__main__":
    main()
