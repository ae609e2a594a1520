"""Damaged files and what is done with each: read as far as it can be, and computed with."""

import contextlib
import json
import random
import shutil
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

import linkwise as lw
from linkwise.io.table import read_table

from . import seeds
from .calls import call
from .hostile import NUMBERS, WHOLE
from .judge import Finding, check_run, must_be_finite
from .mutate import damage_bytes, damage_document, damage_table, damage_xml, toml_text

MOST_STEPS = 40
MOST_SAMPLES = 1e5  # a million take seconds, as they should


def urdf(rng, folder):
    """A damaged URDF is loaded, and its motion computed."""
    data = damage_xml(rng, rng.choice(seeds.URDFS), seeds.URDF_WORDS)
    path = _write(rng, folder / "machine.urdf", data)
    options = {
        "floating_base": rng.random() < 0.3,
        "mimic": rng.choice(("error", "independent", "couple")),
        "keep_fixed": rng.random() < 0.3,
        "joint_order": rng.choice(("file", "pinocchio")),
    }
    return path.name, lambda: _compute(lw.load(path, **options), rng)


def mjcf(rng, folder):
    """A damaged MJCF is loaded, and its motion computed."""
    data = damage_xml(rng, rng.choice(seeds.mjcfs()), seeds.MJCF_WORDS)
    path = _write(rng, folder / "machine.xml", data)
    options = {
        "keep_fixed": rng.random() < 0.3,
        "equality": rng.choice(("ignore", "exact")),
    }
    return path.name, lambda: _compute(lw.load(path, **options), rng)


def sdf(rng, folder):
    """A damaged SDF is loaded, and its motion computed."""
    data = damage_xml(rng, rng.choice(seeds.SDFS), seeds.SDF_WORDS)
    path = _write(rng, folder / "machine.sdf", data)
    options = {
        "mimic": rng.choice(("error", "independent", "couple")),
        "keep_fixed": rng.random() < 0.3,
    }
    return path.name, lambda: _compute(lw.load(path, **options), rng)


def scenario(rng, folder):
    """A damaged scenario is read, and simulated for some steps."""
    seeds.write_companions(folder)
    text = toml_text(damage_document(rng, rng.choice(seeds.scenarios()), seeds.SCENARIO_WORDS))
    path = _write(rng, folder / "case.toml", text.encode("utf-8", "replace"))
    return None, lambda: _run_scenario(path)


def table(rng, folder):
    """A damaged table is read, and drives a joint."""
    path = _write(rng, folder / "table.csv", damage_table(rng, rng.choice(seeds.TABLES)))

    def use():
        found = read_table(path)
        must_be_finite([found.times, found.values], "table")
        values = lw.Table(found.times, found.values[:, :1], rng.choice(("linear", "cubic")))
        driven = {"shoulder": lw.Torque(values)} if rng.random() < 0.5 else {}
        if not driven:
            driven["shoulder"] = lw.PD(10, 1, target=values)
        _simulate(seeds.machine(0), drives=driven, duration=0.1, every=0.05)

    return None, use


def model_bytes(rng, folder):
    """A damaged description of a stored model."""
    data = damage_bytes(rng, seeds.any_machine(rng).to_bytes())
    return None, lambda: _compute(lw.Model.from_bytes(data), rng)


def stored_run(rng, folder):
    """A damaged folder of a stored run is opened and evaluated."""
    place = folder / "run.zarr"
    shutil.rmtree(place, ignore_errors=True)
    for folder in sorted({str(Path(name).parent) for name in _stored_files()}):
        (place / folder).mkdir(parents=True, exist_ok=True)
    for name, data in _stored_files().items():
        (place / name).write_bytes(data)
    for _ in range(rng.choice((1, 1, 2, 4))):
        _damage_folder(rng, place)
    return "run.zarr", lambda: _read_run(place)


KINDS = {
    "urdf": urdf,
    "mjcf": mjcf,
    "sdf": sdf,
    "scenario": scenario,
    "table": table,
    "model-bytes": model_bytes,
    "stored-run": stored_run,
    "call": call,
}


#: What inputs leave in their folder.
FILES = {"machine.urdf", "machine.xml", "case.toml", "table.csv", "wrench.csv", "arm.urdf"}
FILES |= {"tree.urdf", "ring.urdf", "run.zarr", "machine.sdf"}


def _write(rng, path, data):
    if rng.random() < 0.2:
        data = damage_bytes(rng, data)
    path.write_bytes(data)
    return path


def _compute(model, rng):
    again = lw.Model.from_bytes(model.to_bytes())
    if again.hash != model.hash:
        raise Finding("a model and its stored copy have different hashes")
    _ = repr(model), [repr(note) for note in model.notes]
    if model.n_joints > 200:
        return
    random_state = np.random.default_rng(rng.getrandbits(32))
    q, v = model.initial_configuration(), random_state.normal(size=model.nv)
    must_be_finite(q, "initial configuration")
    must_be_finite(lw.link_poses(model, q), "link poses")
    if model.loop_names or model.coupling_names:
        _compute_closed(model, q)
    else:
        must_be_finite(lw.mass_matrix(model, q), "mass matrix")
        must_be_finite(lw.inverse_dynamics_loads(model, q, v, v), "loads of inverse dynamics")
    method = rng.choice(
        ("auto", "auto", "articulated_body", "constraint_force", "composite_rigid_body")
    )
    result = lw.forward_dynamics(model, q, v, passive=rng.random() < 0.5, method=method, full=True)
    must_be_finite(result, "forward dynamics")
    if rng.random() < 0.2 and model.nv:
        _simulate(model, duration=0.01, every=0.005)


def _compute_closed(model, q):
    """What is asked of machines with loops before they move: they may not close, which is said."""
    must_be_finite(lw.loop_gaps(model, q), "gaps of loops")
    with contextlib.suppress(lw.InputError):
        lw.indeterminacy(model, q)
    closed = lw.assemble(model, q)
    must_be_finite([closed.q, closed.v], "assembly")
    must_be_finite(lw.joint_loads(model, closed.q, closed.v), "loads of a closed machine")


def _simulate(model, **options):
    options["max_steps"] = min(options.pop("max_steps", None) or MOST_STEPS, MOST_STEPS)
    run = lw.simulate(model, on_failure="return", **options)
    check_run(run)


def _run_scenario(path):
    found = lw.load_scenario(path)
    found.replaces_elsewhere()
    model = found.load_model()
    options = found.simulate_arguments(model) | {"output": None}
    options["numerics"] = dict(options["numerics"])
    options["max_steps"] = options["numerics"].pop("max_steps", None)
    if options["duration"] < MOST_SAMPLES * (options["every"] or options["duration"]):
        _simulate(model, **options)


@cache
def _stored_files():
    """Files of a small run, by name."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "run.zarr"
        lw.simulate(seeds.machine(0), duration=0.02, every=0.005, output=place)
        files = (p for p in sorted(place.rglob("*")) if p.is_file())
        return {str(p.relative_to(place)): p.read_bytes() for p in files}


def _damage_folder(rng, place):
    names = sorted(_stored_files())
    file, other = place / rng.choice(names), place / rng.choice(names)
    if any(p.is_symlink() or not p.is_file() for p in (file, other)):
        return  # damaged before
    how = rng.randrange(9)
    if how < 3:
        file.write_bytes(damage_bytes(rng, file.read_bytes()))
    elif how < 5 and file.suffix == ".json":
        try:
            document = json.loads(file.read_bytes())
        except ValueError:
            return
        file.write_text(json.dumps(_damage_json(rng, document)))
    elif how == 5:
        file.unlink()
    elif how == 6:
        shutil.copyfile(file, other) if file != other else None
    elif how == 7:
        file.unlink()
        rng.choice(
            (file.mkdir, lambda: file.symlink_to("/dev/zero"), lambda: file.symlink_to(place))
        )()
    else:
        _copy_inside(file.parent, place / rng.choice(("extra", "a b", "c")), place.parent)


def _copy_inside(folder, to, outside):
    """Copies a folder, also into itself: by way of a folder outside, with its links as links."""
    with tempfile.TemporaryDirectory(dir=outside) as between:
        shutil.copytree(folder, between, symlinks=True, dirs_exist_ok=True)
        with contextlib.suppress(shutil.Error):  # a file stands where a folder of the copy would
            shutil.copytree(between, to, symlinks=True, dirs_exist_ok=True)


def _damage_json(rng, document):
    changed = damage_document(rng, {"x": document}, ["shape", "attributes", "codecs", "chunks"])
    while rng.random() < 0.3:
        changed = damage_document(rng, changed, ["shape", "data_type", "fill_value"])
    return json.loads(json.dumps(changed.get("x", rng.choice((*NUMBERS, *WHOLE[:6]))), default=str))


def _read_run(place):
    run = lw.open_run(place)
    _ = repr(run), run.warnings, run.completed
    for name in run.dataset.variables:
        np.asarray(run.dataset[name].values)
    for evaluate in (run.load_model, run.peak_loads, lambda: lw.loads.summary(run)):
        try:
            evaluate()
        except lw.InputError:  # what is left may not be enough
            continue


def make(kind, number, folder):
    """The file that complaints must name, if any, and the action, of one input."""
    return KINDS[kind](random.Random(f"{kind}/{number}"), folder)
