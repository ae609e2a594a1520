#!/usr/bin/env python3
"""Every URDF, SDF and MJCF of installed packages or given folders, beside Pinocchio and MuJoCo.

    python tools/corpus.py [FOLDER ...] [--json FILE]

At a random state of each machine that loads, our mass matrix is compared with Pinocchio's (URDF,
mimic joints independent, machines without a moving joint on a floating base) or MuJoCo's (MJCF).
The only witness of an SDF is a URDF of its name. Prints how many load and agree, and each refusal
with its reason. It belongs to no test: what is installed differs.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import sysconfig
import warnings
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import linkwise as lw
from linkwise.io import mjcf_state

AGREE = 1e-9
MOST_FREEDOMS = 1500
KINDS = ("URDF", "SDF", "MJCF")


def found_in(folders: list[Path]) -> tuple[list[Path], list[Path], list[Path]]:
    """URDF and SDF files, and XML files whose root is <mujoco>."""
    urdf, sdf = (
        sorted({p for folder in folders for p in folder.rglob(f"*.{end}")})
        for end in ("urdf", "sdf")
    )
    mjcf = []
    for path in sorted({p for folder in folders for p in folder.rglob("*.xml")}):
        head = path.read_bytes()[:4096]
        if re.search(rb"<mujoco\b(?!include)", head):
            mjcf.append(path)
    return urdf, sdf, mjcf


def difference(ours: Any, theirs: Any) -> float:
    return float(np.abs(ours - theirs).max() / max(float(np.abs(theirs).max()), 1e-300))


def of_urdf(path: Path, rng: np.random.Generator) -> tuple[str, float | None, str]:
    """How it went, how far the mass matrices are apart, and what was said."""
    try:
        model = lw.load(path, mimic="independent", joint_order="pinocchio")
    except lw.InputError as error:
        return "refused", None, str(error)
    try:
        import pinocchio as pin

        if model.nv == 0:  # one body: let it float
            options = {"mimic": "independent", "joint_order": "pinocchio"}
            try:
                model = lw.load(path, floating_base=True, **options)
            except lw.InputError as error:
                return "loads, no witness", None, str(error)
            theirs = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
        else:
            theirs = pin.buildModelFromUrdf(str(path))
    except Exception as error:
        return "loads, no witness", None, f"Pinocchio: {error}"
    if theirs.nv != model.nv or model.nv == 0 or model.nv > MOST_FREEDOMS:
        return "loads, no witness", None, f"{model.nv} degrees of freedom, {theirs.nv} in Pinocchio"
    q, qp = model.neutral_configuration(), pin.neutral(theirs)
    for name in model.joint_names:
        if name == "root_joint":
            continue  # its mass matrix is the same everywhere
        joint = theirs.joints[theirs.getJointId(name)]
        angle = rng.uniform(-1, 1)
        if joint.nv != 1:
            continue  # at its zero
        q[model.q_slice(name)] = angle
        values = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
        qp[joint.idx_q : joint.idx_q + joint.nq] = values
    crba = pin.crba(theirs, theirs.createData(), qp)
    symmetric = np.triu(crba) + np.triu(crba, 1).T
    apart = difference(lw.mass_matrix(model, q), symmetric)
    return ("agrees" if apart < AGREE else "differs"), apart, ""


def of_sdf(path: Path, rng: np.random.Generator) -> tuple[str, float | None, str]:
    """Eigenvalues of the mass matrix at zero beside those of a URDF of the same name."""
    try:
        model = lw.load(path, mimic="independent")
    except lw.InputError as error:
        return "refused", None, str(error)
    twin = path.with_suffix(".urdf")
    try:
        other = lw.load(
            twin, mimic="independent", floating_base=model.joint_types[:1] == ["floating"]
        )
    except lw.InputError as error:
        return "loads, no witness", None, str(error)
    if other.nv != model.nv or model.nv == 0:
        return "loads, no witness", None, f"{model.nv} degrees of freedom, {other.nv} of the URDF"
    ours, theirs = (
        np.linalg.eigvalsh(lw.mass_matrix(m, m.neutral_configuration())) for m in (model, other)
    )
    apart = difference(ours, theirs)
    return ("agrees" if apart < AGREE else "differs"), apart, ""


def of_mjcf(path: Path, rng: np.random.Generator) -> tuple[str, float | None, str]:
    import mujoco

    try:
        model = lw.load(path)
    except lw.InputError as error:
        return "refused", None, str(error)
    if model.loop_names or model.coupling_names:  # the tree beneath is what has a mass matrix
        model = lw.load(path, equality="ignore")
    theirs = mjcf_state.compile_mjcf(path)
    if model.nv == 0 or model.nv > MOST_FREEDOMS:
        return "loads, no witness", None, f"{model.nv} degrees of freedom"
    data = mujoco.MjData(theirs)
    mujoco.mj_integratePos(theirs, data.qpos, rng.normal(size=theirs.nv) * 0.3, 1.0)
    mujoco.mj_forward(theirs, data)
    full = np.zeros((theirs.nv, theirs.nv))
    mujoco.mj_fullM(theirs, data, full)
    q = mjcf_state.position_from_mujoco(model, theirs, data.qpos)
    ours = lw.mass_matrix(model, q)
    # Each column of this matrix is our velocity for one unit of MuJoCo's.
    turn = np.column_stack(
        [
            mjcf_state.velocity_from_mujoco(model, theirs, data.qpos, unit)
            for unit in np.eye(theirs.nv)
        ]
    )
    apart = difference(turn.T @ ours @ turn, full)
    said = "; ".join(
        f"{n.element}: {n.text}" for n in model.notes if "the mass matrix lacks it" in n.text
    )
    return ("agrees" if apart < AGREE else "differs"), apart, said


def reason(text: str) -> str:
    """A refusal without names and places, to count it by."""
    return re.sub(r"'[^']*'", "'...'", re.sub(r"^\S*?(:\d+)?: ", "", text))[:160]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    warnings.simplefilter("ignore", lw.ModelWarning)  # what is ignored shows in the comparison
    with suppress(ImportError):  # what MuJoCo warns of would go to a file in the current folder
        import mujoco

        mujoco.set_mju_user_warning(lambda message: None)
    folders = given.folders or [Path(sysconfig.get_paths()["purelib"])]
    rng = np.random.default_rng(0)
    rows = []
    for kind, paths, check in zip(
        KINDS, found_in(folders), (of_urdf, of_sdf, of_mjcf), strict=True
    ):
        for path in paths:
            try:
                how, apart, said = check(path, rng)
            except Exception as error:
                how, apart, said = "fails", None, f"{type(error).__name__}: {error}"
            rows.append((kind, str(path), how, apart, said))
    counts = Counter((kind, how) for kind, _, how, _, _ in rows)
    hows = ("agrees", "differs", "loads, no witness", "refused", "fails")
    print("| files | found | agree | differ | load, without a witness | refused | fail |")
    print("|---|---|---|---|---|---|---|")
    for kind in KINDS:
        numbers = [counts[kind, how] for how in hows]
        print(f"| {kind} | {sum(numbers)} | " + " | ".join(map(str, numbers)) + " |")
    print()
    why = Counter((kind, reason(said)) for kind, _, how, _, said in rows if how == "refused")
    for (kind, text), count in why.most_common():
        print(f"{count} {kind} refused: {text}")
    for kind, path, how, apart, said in rows:
        if how in ("differs", "fails"):
            print(f"{kind} {how} {'' if apart is None else f'{apart:.1e}'} {path} {said}")
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1))
    return 1 if any(how == "fails" for _, _, how, _, _ in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
