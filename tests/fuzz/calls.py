"""Public functions and methods, each with good arguments of which some are exchanged."""

from functools import cache

import numpy as np

import linkwise as lw

from . import seeds
from .hostile import NUMBERS, OBJECTS, ODD_TEXTS, WHOLE, hostile_array, hostile_number
from .judge import check_run, must_be_finite

# Arguments by what is good: functions of the random numbers and the machine.
GOOD = {
    "q": lambda rng, model: _batch(rng, model.initial_configuration()),
    "v": lambda rng, model: _batch(rng, _normal(rng, model.nv)),
    "state": lambda rng, model: model.initial_configuration(),
    "rates": lambda rng, model: _normal(rng, model.nv),
    "loop_rates": lambda rng, model: _normal(rng, model.loop_property("damping").size),
    "dof_property": lambda rng, model: rng.choice(("damping", "lower", "armature")),
    "wrenches": lambda rng, model: _normal(rng, (model.n_joints, 6)),
    "force": lambda rng, model: _normal(rng, 5 * model.n_joints),
    "three_times": lambda rng, model: np.array([0.0, 0.1, 0.2]),
    "three_q": lambda rng, model: np.tile(model.initial_configuration(), (3, 1)),
    "three_v": lambda rng, model: _normal(rng, (3, model.nv)),
    "vector": lambda rng, model: _normal(rng, 3),
    "six": lambda rng, model: _normal(rng, 6),
    "inertia": lambda rng, model: np.eye(3),
    "rotation": lambda rng, model: np.eye(3),
    "times": lambda rng, model: np.linspace(0, 0.1, 12),
    "values": lambda rng, model: np.sin(np.linspace(0, 0.1, 12)),
    "number": lambda rng, model: abs(rng.gauss(0, 1)) + 0.1,
    "duration": lambda rng, model: 0.01,
    "every": lambda rng, model: 0.005,
    "step": lambda rng, model: 0.001,
    "tolerance": lambda rng, model: 1e-6,
    "count": lambda rng, model: rng.choice((1, 2, 3)),
    "threads": lambda rng, model: rng.choice((None, 1, 2)),
    "flag": lambda rng, model: rng.random() < 0.5,
    "joint": lambda rng, model: rng.choice(model.joint_names),
    "joints": lambda rng, model: [rng.choice(model.joint_names)],
    "link": lambda rng, model: rng.choice(model.link_names),
    "body": lambda rng, model: rng.choice(model.child_link_names),
    "index": lambda rng, model: rng.randrange(model.n_joints),
    "method": lambda rng, model: rng.choice([entry["name"] for entry in lw.methods()]),
    "solver": lambda rng, model: rng.choice([entry["name"] for entry in lw.solvers()]),
    "integrator": lambda rng, model: rng.choice([entry["name"] for entry in lw.integrators()]),
    "stop": lambda rng, model: rng.choice([entry["name"] for entry in lw.stop_rules()]),
    "options": lambda rng, model: {},
    "quantities": lambda rng, model: [rng.choice([entry["name"] for entry in lw.quantities()])],
    "causes": lambda rng, model: ["gravity"],
    "text": lambda rng, model: "name",
    "section": lambda rng, model: lw.Section.round(0.01 + rng.random()),
    "kind": lambda rng, model: rng.choice(("revolute", "prismatic", "spherical", "floating")),
    "interpolation": lambda rng, model: rng.choice(("linear", "cubic")),
    "frame": lambda rng, model: rng.choice(("world", "body")),
    "wrench_axes": lambda rng, model: rng.choice(("world", "frame")),
    "drives": lambda rng, model: {},
    "property": lambda rng, model: rng.choice(("damping", "armature", "lower_limit")),
    "quantity": lambda rng, model: rng.choice(("axial", "torque", "force")),
    "factors": lambda rng, model: {rng.choice(model.joint_names): rng.gauss(0, 1)},
    "bytes": lambda rng, model: model.to_bytes(),
}
# Each function with its arguments: `*` those that are always given.
CALLS = {
    "forward_dynamics": "*q *v tau:v loop_tau:loop_rates loop_prescribed:loop_rates "
    "external:wrenches passive:flag method solver tolerance stop max_iterations:count "
    "solver_options:options threads full:flag gravity:number",
    "inverse_dynamics": "*q *v *acceleration:v external:wrenches driven:joints passive:flag "
    "full:flag gravity:number threads",
    "inverse_dynamics_loads": "*q *v *acceleration:v external:wrenches driven:joints passive:flag "
    "gravity:number threads",
    "joint_loads": "*q *v tau:v loop_tau:loop_rates external:wrenches passive:flag method solver "
    "threads",
    "joint_loads_by_cause": "*causes *q *v tau:v loop_tau:loop_rates "
    "loop_prescribed:loop_rates external:wrenches method threads",
    "joint_poses": "*q threads",
    "link_poses": "*q threads",
    "loop_gaps": "*q",
    "loop_coordinates": "*q v",
    "loop_accelerations": "*q *v *acceleration:v",
    "indeterminacy": "*q:state",
    "undecided_loads": "q:state",
    "assemble": "q0:state v0:rates",
    "mass_matrix": "*q driven:joints threads",
    "driven_jacobian": "*q *driven:joints threads",
    "body_jacobian": "*q *body threads",
    "frame_pose": "*q *frame:link threads",
    "frame_velocity": "*q *v *frame:link axes:frame threads",
    "frame_acceleration": "*q *v *acceleration:v *frame:link axes:frame threads",
    "frame_jacobian": "*q *frame:link axes:frame threads",
    "external_wrenches": "*q *wrenches:drives",
    "kinetic_energy": "*q *v threads",
    "potential_energy": "*q threads",
    "momentum": "*q *v threads",
    "passive_torque": "*q *v threads",
    "simulate": "*duration *every drives q0:state v0:rates tolerance threads record:quantities "
    "integrator step method solver joints max_step:number times on_failure:text output:text",
    "simulate_batch": "*step *duration q0:q v0:v tau:v every threads record:quantities integrator",
}
METHODS = {
    "joint_labels": "*joint:index",
    "joint_index": "*name:joint",
    "load_index": "*name:joint",
    "loop_property": "*name:dof_property",
    "q_slice": "*joint",
    "v_slice": "*joint",
    "dof_property": "*name:property",
    "prescribe": "*joints",
    "with_payload": "*link *mass:number com:vector inertia name:text",
    "with_link": "*link mass:number com:vector inertia",
    "with_joint": "*joint damping:number armature:number lower:number upper:number "
    "gear_ratio:number motor_inertia:number stiffness:number friction:number effort:number",
    "with_joints": "*joints:drives",
    "loop_labels": "*loop:index",
    "with_rod": "*name:text *parent:link *child:link *length:number point:vector "
    "child_point:vector",
    "with_spring": "*name:text *parent:link *child:link *length:number point:vector "
    "child_point:vector stiffness:number damping:number",
    "with_flexible": "*link *section *E:number *G:number density:number damping:number "
    "bodies:count interior_modes:count stretches:flag end:vector z:vector",
    "with_bearing": "*joint radial:number axial:number tilt:number torsion:number axis:vector "
    "offset:number turn:vector preload:vector",
    "with_joint_type": "*joint *type:kind",
    "with_coupling": "*name:text *factors offset:number",
    "with_loop": "*name:text *type:kind *parent:link *child:link translation:vector rotation "
    "child_translation:vector child_rotation:rotation axis:vector pitch:number",
    "frame_placement": "*frame:link",
    "to_bytes": "source:text",
}
SYSTEM = {
    "solve": "*solver guess:force tolerance stop max_iterations:count solver_options:options",
    "multiply": "*f:force",
    "energy_norm": "*f:force",
    "recover": "*f:force",
    "rows": "*joint",
    "spectrum": "max_steps:count",
    "condition_estimate": "",
    "spectral_radius": "",
}
EVALUATE = "*t:number *q:state v:rates tau:rates external:wrenches passive:flag accept:flag"
FOLLOW = "*times:three_times *q:three_q v:three_v passive:flag"
DRIVES = {
    "Torque": "*value:number breakpoints:times",
    "PD": "*kp:number *kd:number target:number",
    "Spring": "*stiffness:number damping:number rest:number",
    "Motion": "*value:values breakpoints:times",
    "Wrench": "*value:six axes:wrench_axes breakpoints:times",
    "Table": "*times *values interpolation",
    "Numerics": "tolerance step max_steps:count integrator method solver solver_options:options",
    "Recording": "quantities joints scenario_text:text",
}
LOADS = {
    "peak_loads": "",
    "summary": "",
    "envelope": "",
    "energy_balance": "",
    "bounds": "",
    "quantities": "",
    "split": "by:text",
    "split_at_peaks": "by:text",
    "in_frame": "frame point:vector fixed_in:frame",
    "section_loads": "*link n:count",
    "section_summary": "*link n:count",
    "section_deflections": "*link n:count",
    "section_split": "*link n:count",
    "section_damage": "*link n:count exponents:times repetitions:number",
    "cycles": "*joint *quantity",
    "spectrum": "*joint *quantity",
    "load_duration": "*joint *quantity bins:count",
    "damage_equivalent": "exponents:times repetitions:number joints",
}
SCENES = {
    "chain": "n_bodies:count joint:kind axes:text length:number mass:number radius:number "
    "damping:number armature:number gravity:vector floating_base:flag seed:count",
    "tree": "n_bodies:count branching:count joint:kind axes:text length:number mass:number "
    "radius:number damping:number gravity:vector floating_base:flag seed:count",
    "srms_3l5d": "gravity:vector",
}
LINK = "*name:text mass:number com:vector inertia"
JOINT = (
    "*name:text *type:kind *parent:text *child:text translation:vector rotation axis:vector "
    "pitch:number damping:number armature:number lower:number upper:number friction:number "
    "friction_velocity:number stiffness:number rest_position:number initial:vector "
    "limit_stiffness:number effort:number velocity:number"
)


def _normal(rng, shape):
    return np.random.default_rng(rng.getrandbits(32)).normal(size=shape)


def _batch(rng, values):
    return (
        np.broadcast_to(values, (rng.choice((1, 2, 9)), *values.shape))
        if rng.random() < 0.3
        else values
    )


def arguments(rng, model, spec, wrong):
    """Positional and keyword arguments, `wrong` of them exchanged at most."""
    chosen = []
    for word in spec.split():
        needed, (name, _, kind) = word[0] == "*", word.lstrip("*").partition(":")
        if needed or rng.random() < 0.2:
            chosen.append([needed, name, GOOD[kind or name](rng, model)])
    for slot in rng.sample(chosen, min(wrong, len(chosen))):
        slot[2] = _exchanged(rng, slot[2])
    positional = [value for needed, _, value in chosen if needed]
    return positional, {name: value for needed, name, value in chosen if not needed}


def _exchanged(rng, value):
    if isinstance(value, np.ndarray):
        return hostile_array(rng, value)
    if rng.random() < 0.25:
        return rng.choice(OBJECTS)
    if isinstance(value, str):
        return rng.choice(ODD_TEXTS)
    if isinstance(value, bytes):
        return value[: rng.randrange(len(value))]
    if isinstance(value, bool):
        return rng.choice(OBJECTS)
    if isinstance(value, int) or value is None:
        return rng.choice((*WHOLE, *NUMBERS))
    if isinstance(value, float):
        return hostile_number(rng)
    if isinstance(value, list):
        return rng.choice(([], value * 3, [None], [rng.choice(ODD_TEXTS)], "joint_load", {"a": 1}))
    return rng.choice(OBJECTS)


def call(rng, folder):
    """A function, and what it is given."""
    model = seeds.any_machine(rng)
    wrong = rng.choice((0, 1, 1, 1, 2))
    groups = (_function, _method, _driven, _loads, _scene, _built, _system, _evaluated, _frame)
    group = rng.choice((_function, _function, *groups))
    return None, group(rng, model, wrong)


def _function(rng, model, wrong):
    name = rng.choice(sorted(CALLS))
    given, options = arguments(rng, model, CALLS[name], wrong)
    if name == "simulate":
        duration, every = given
        options |= {"duration": duration, "every": every, "max_steps": 40, "on_failure": "return"}
        options.pop("output", None)
        if "times" in options:
            del options["every"]
        given = []
    elif name == "simulate_batch":
        step, duration = given
        options |= {"step": step, "duration": duration}
        given = []
        if _many(duration, step) or _many(duration, options.get("every")):
            return lambda: None
    if name == "simulate" and _many(options["duration"], options.get("every")):
        return lambda: None
    return lambda: _use(name, getattr(lw, name)(model, *given, **options))


def _many(duration, every):
    """Whether a run is long because it was asked to be."""
    try:
        return not float(duration) < 1e4 * float(every)
    except (TypeError, ValueError, OverflowError, ZeroDivisionError):
        return False


def _use(name, result):
    if name == "simulate_batch":
        return  # NaN after a member's end, which it says
    if name == "simulate":
        check_run(result)
    else:
        must_be_finite(result, name)


def _method(rng, model, wrong):
    name = rng.choice(sorted(METHODS))
    given, options = arguments(rng, model, METHODS[name], wrong)
    if name in ("with_payload", "with_rod", "with_spring"):
        options["mass" if name == "with_payload" else "length"] = given.pop()
    return lambda: repr(getattr(model, name)(*given, **options))


def _driven(rng, model, wrong):
    name = rng.choice(sorted(DRIVES))
    given, options = arguments(rng, model, DRIVES[name], wrong)
    joint, body = rng.choice(model.joint_names), rng.choice(model.child_link_names)

    def use():
        made = getattr(lw, name)(*given, **options)
        where = {"drives": {joint: lw.Torque(made) if name == "Table" else made}}
        if name == "Wrench":
            where = {"wrenches": {body: made}}
        elif name == "Numerics":
            where = {"numerics": made}
        elif name == "Recording":
            where = {"record": made}
        if name != "Numerics":
            where["max_steps"] = 40
        elif not (type(made.max_steps) is int and 0 < made.max_steps < 1000):
            return
        run = lw.simulate(model, duration=0.01, every=0.005, on_failure="return", **where)
        _use("simulate", run)

    return use


def _system(rng, model, wrong):
    name = rng.choice(sorted(SYSTEM))
    made_of, _ = arguments(rng, model, "*q:state *v:rates *tau:rates", wrong > 1)
    given, options = arguments(rng, model, SYSTEM[name], wrong)

    def use():
        system = lw.ConstraintSystem(model, *made_of)
        for where, value in enumerate(given):
            if isinstance(value, np.ndarray) and value.shape == (5 * model.n_joints,):
                given[where] = np.resize(value, system.size)
        must_be_finite(system.b, "b")
        result = getattr(system, name)(*given, **options)
        if name == "solve" and result[1].outcome != "converged":
            return  # it says so
        must_be_finite(result, name)

    return use


def _evaluated(rng, model, wrong):
    chosen, options = arguments(rng, model, "method solver tolerance stop threads", wrong > 1)
    follow = rng.random() < 0.3
    given, more = arguments(rng, model, FOLLOW if follow else EVALUATE, wrong)

    def use():
        method = lw.DynamicsMethod(model, *chosen, **options)
        if follow:
            method.follow(*given, **more)
            return
        *result, report = method.evaluate(*given, **more)
        if report.outcome == "converged":
            must_be_finite(result, "evaluate")

    return use


def _frame(rng, model, wrong):
    given, options = arguments(rng, model, "*link origin:vector axes:rotation", wrong)
    q = model.initial_configuration()
    return lambda: must_be_finite(
        lw.frame_jacobian(model, q, lw.Frame(*given, **options)), "Jacobian of a frame"
    )


@cache
def _run(number):
    return lw.simulate(seeds.machine(number), duration=0.05, every=0.005)


def _loads(rng, model, wrong):
    name = rng.choice(sorted(LOADS))
    run = _run(rng.choice((0, 1, 2, 5, 6)))
    given, options = arguments(rng, run.load_model(), LOADS[name], wrong)
    return lambda: getattr(lw.loads, name)(run, *given, **options)


def _scene(rng, model, wrong):
    name = rng.choice(sorted(SCENES))
    _, options = arguments(rng, model, SCENES[name], wrong)
    if isinstance(options.get("n_bodies"), int) and 10_000 < options["n_bodies"] < 2**31:
        return lambda: None
    return lambda: repr(getattr(lw.scenes, name)(**options))


def _built(rng, model, wrong):
    links = [arguments(rng, model, LINK, 0) for _ in range(3)]
    joints = [arguments(rng, model, JOINT, 0) for _ in range(2)]
    for number, (given, _) in enumerate(links):
        given[0] = f"link {number}"
    for number, (given, _) in enumerate(joints):
        given[0], given[2:] = f"joint {number}", [f"link {number}", f"link {number + 1}"]
    for _ in range(wrong):
        given, options = rng.choice((*links, *joints))
        key = rng.choice((*range(len(given)), *options))
        part = given if isinstance(key, int) else options
        part[key] = _exchanged(rng, part[key])

    def use():
        builder = lw.ModelBuilder("built", gravity=(0, 0, -9.81))
        for given, options in links:
            builder.add_link(*given, **options)
        for given, options in joints:
            builder.add_joint(*given, **options)
        made = builder.build()
        q, v = made.initial_configuration(), np.ones(made.nv)
        _use("forward_dynamics", lw.forward_dynamics(made, q, v, passive=True))
        _use("joint_loads", lw.joint_loads(made, q, v))

    return use
