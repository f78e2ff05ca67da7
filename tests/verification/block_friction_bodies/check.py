"""Friction of a block of 10 x 10 x 10 mm that is pressed on another body by 10 MPa and dragged.

As `block_friction`, with a deformable body in place of the rigid table: a block of 22 x 14 x 5 mm
whose mesh does not match, moved as a whole. The normal force, N = 1000 N, is a dead load, and
sections do not shear: the drag force follows from the friction law alone, and the tolerance is that
of Newton, 1e-8, also where nodes pass from facet to facet.

Coulomb, mu = 0.3, by return mapping: below the limit the force is the bond's stiffness times the
drag u, then 300 N; after the reversal it falls along the bond to -300 N. Elastic slip u_stick = 300/
(bond stiffness) is not dissipated: the heat is 300 (u - u_stick) for the way out and 300 (u - 2
u_stick) for the way back. With multipliers the bond is rigid: 300 N from the first increment on,
and no node penetrates. Both ways, in `symmetric` contact, half of the conditions are those of the
other body's nodes, which feel the edge of the block: the force only.

Tresca: 0.5 * 200 / sqrt(3) = 57.735 MPa whatever the pressure. Norton, alpha = 1, K = 10, q = 0.2:
10 MPa at 1 mm/s, 20 MPa at 32 mm/s. A slab on a slab stays on a slope of 16.6 degrees and slides at
16.8: atan(0.3) = 16.699 degrees.

A ring of sticking and sliding: an elastic strip is sheared to and fro by 0.1 mm, friction holds it
and lets it go: what the shear puts in is in the strip, in the bonds, or was rubbed away. The
increments are short enough for 1e-3 of it; force along by force across is mu while all nodes slide.
"""
import math

import swage_mesh_writer

YOUNG, PENALTY = 200000.0, 10.0
WEIGHT, MU = 1000.0, 0.3
TOLERANCE = 1e-8
# The way out, and elastic slip by it.
DRAG, STICK = 4.0, 1.0

CASE = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'blocks.msh' /
&body name = 'block' material = 'stiff' group = 'BLOCK_BODY' /
&body name = 'table' material = 'stiff' group = 'TABLE_BODY' /
&material name = 'stiff' law = 'elastic' young = {young} poisson = 0 /
&boundary name = 'guide' kind = 'fixed' group = 'BLOCK_BODY' components = 'x', 'y' /
&boundary name = 'load' kind = 'traction' group = 'BLOCK_ZMAX' traction = 0, 0, {load}
  time = 0, 1 factor = 0, 1 /
&boundary name = 'drag' kind = 'displacement' group = 'TABLE_BODY' {motion} /
&friction name = 'rub' {friction} /
&contact name = 'foot' slave = 'BLOCK_ZMIN' master = 'TABLE_ZMAX' friction = 'rub'
  penalty_factor = {penalty} tangential_factor = {bond} {keys} /
&step duration = 1 increments = 2 /
&step duration = 2 increments = 16 /
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 /
"""

TO_AND_FRO = f'displacement = {DRAG}, 0, 0 time = 0, 1, 2, 3 factor = 0, 0, 1, -1'
COULOMB = f"kind = 'coulomb' coefficient = {MU} method = 'return_mapping'"
AUGMENTED = ("enforcement = 'augmented_lagrangian' penetration_tolerance = 1e-12 "
             "multiplier_tolerance = 1e-11")
MULTIPLIERS = AUGMENTED.replace('augmented_lagrangian', 'lagrange')

SLOPE = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'slabs.msh' /
&body name = 'slab' material = 'stiff' group = 'SLAB_BODY' /
&body name = 'bed' material = 'stiff' group = 'BED_BODY' /
&material name = 'stiff' law = 'elastic' young = {young} poisson = 0.3 /
&boundary name = 'weight' kind = 'traction' group = 'SLAB_ZMAX' traction = {along}, 0, {across}
  time = 0, 1 factor = 0, 1 /
&boundary name = 'base' kind = 'fixed' group = 'BED_ZMIN' /
&friction name = 'rub' kind = 'coulomb' coefficient = {mu} method = 'return_mapping' /
&contact name = 'foot' slave = 'SLAB_ZMIN' master = 'BED_ZMAX' friction = 'rub' {keys} /
&step duration = 1 increments = 4 maximum_cuts = 2 /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
"""

RING = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = 'strips.msh' /
&body name = 'strip' material = 'soft' group = 'STRIP_BODY' /
&body name = 'bed' material = 'stiff' group = 'BED_BODY' /
&material name = 'soft' law = 'elastic' young = 10000 poisson = 0.3 /
&material name = 'stiff' law = 'elastic' young = 50000 poisson = 0.3 /
&boundary name = 'shear' kind = 'displacement' group = 'STRIP_TOP' components = 'x'
  displacement = 0.1, 0, 0 time = 0, 1, 2, 3, 4, 5 factor = 0, 0, 1, -1, 1, -1 /
&boundary name = 'press' kind = 'displacement' group = 'STRIP_TOP' components = 'y'
  displacement = 0, -0.004, 0 time = 0, 1 factor = 0, 1 /
&boundary name = 'base' kind = 'fixed' group = 'BED_BOTTOM' /
&friction name = 'rub' kind = 'coulomb' coefficient = {mu} method = 'return_mapping' /
&contact name = 'foot' slave = 'STRIP_BOTTOM' master = 'BED_TOP' friction = 'rub' {keys} /
&step duration = 1 increments = 4 /
&step duration = 4 increments = 120 /
"""


def size(volume, cells):
    """Of the cells of a box cut in cubes of six tetrahedra: the edge of a regular one."""
    return (math.sqrt(2) * volume / cells)**(1 / 3)


def bond():
    """Factor that makes the bonds of the block break after the drag STICK."""
    soft = [1.5 * YOUNG / size(1000, 8), 1.5 * YOUNG / size(22 * 14 * 5, 11 * 7 * 2)]
    together = 2 * soft[0] * soft[1] / sum(soft)
    return MU * WEIGHT / STICK / (PENALTY * together * 100)


def run(context):
    context.bodies('blocks', {
        'BLOCK': swage_mesh_writer.box_mesh(2, 2, 2, lambda x, y, z: (10 * x, 10 * y, 10 * z)),
        'TABLE': swage_mesh_writer.box_mesh(11, 7, 2, lambda x, y, z: (22 * x - 5.7, 14 * y - 2.2,
                                                                      5 * z - 5))})
    context.bodies('slabs', {
        'SLAB': swage_mesh_writer.box_mesh(4, 4, 1, lambda x, y, z: (10 * x, 10 * y, z)),
        'BED': swage_mesh_writer.box_mesh(5, 5, 1, lambda x, y, z: (12.5 * x - 1.1, 12.5 * y - 1.3,
                                                                    2 * z - 2))})
    context.bodies('strips', {
        'STRIP': swage_mesh_writer.rectangle_mesh(14, 3, lambda x, y: (10 * x, 2 * y)),
        'BED': swage_mesh_writer.rectangle_mesh(17, 3, lambda x, y: (14 * x - 2.1, 2 * y - 2))})
    yield from coulomb(context)
    yield from rates(context)
    yield from incline(context)
    yield from cycles(context)


def drag(context, name, friction, keys='', motion=TO_AND_FRO, load=10.0, factor=None):
    case = CASE.format(young=YOUNG, load=-load, motion=motion, friction=friction, penalty=PENALTY,
                       bond=repr(factor or bond()), keys=keys)
    return context.run_swage(case, name=name)


def coulomb(context):
    limit, stiffness = MU * WEIGHT, MU * WEIGHT / STICK
    for name, keys in (('l2', ''), ('lumped', "projection = 'lumped'"),
                       ('nodal', "formulation = 'master_slave'"),
                       ('full', "formulation = 'master_slave' variant = 'full'")):
        history = drag(context, name, COULOMB, keys).history
        force, heat = history['reaction_drag_x'], history['friction_work']
        worst = 0.0
        for t, value in zip(history['time'], force):
            expected = min(stiffness * DRAG * max(t - 1, 0), limit)
            if t > 2:
                expected = max(limit - stiffness * 2 * DRAG * (t - 2), -limit)
            worst = max(worst, abs(value - expected))
        yield context.zero(f'{name}: drag force in all increments', worst / limit, TOLERANCE)
        out, back = history['time'].index(2.0), -1
        yield context.row(f'{name}: heat on the way out [mJ]', heat[out], limit * (DRAG - STICK),
                          TOLERANCE)
        yield context.row(f'{name}: heat on the way back [mJ]', heat[back] - heat[out],
                          limit * (2 * DRAG - 2 * STICK), TOLERANCE)

    for name, method, keys in (
            ('l2', 'augmented', AUGMENTED), ('l2', 'multipliers', MULTIPLIERS),
            ('nodal', 'augmented', AUGMENTED + " formulation = 'master_slave'"),
            ('nodal', 'multipliers', MULTIPLIERS + " formulation = 'master_slave'")):
        history = drag(context, f'{name}_{method}', COULOMB, keys).history
        force = history['reaction_drag_x']
        first = history['time'].index(1.125)
        way = force[first:first + 8] + [-value for value in force[first + 8:]]
        furthest = max(way, key=lambda value: abs(value - limit))
        yield context.row(f'{name}, {method}: force, all increments [N]', furthest, limit,
                          TOLERANCE)
        yield context.zero(f'{name}, {method}: penetration by cell',
                           max(abs(value) for value in history['penetration_by_cell_foot']), 1e-12)

    history = drag(context, 'symmetric', COULOMB, "formulation = 'symmetric'").history
    yield context.row('symmetric: force on the way out [N]',
                      history['reaction_drag_x'][history['time'].index(2.0)], limit, 0.01)


def rates(context):
    """Shear stresses at constant slip rates; the slow way is 2 mm long, the fast one 4 mm."""
    slow = 'displacement = 2, 0, 0 time = 0, 1, 3 factor = 0, 0, 1'
    fast = ('displacement = 4, 0, 0 time = 0, 1, 1.03125, 1.0625, 1.09375, 1.125, 3 '
            'factor = 0, 0, 0.25, 0.5, 0.75, 1, 1')
    tresca = "kind = 'tresca' tresca_factor = 0.5 flow_stress = 200"
    norton = "kind = 'norton' factor = 1 consistency = 10 rate_exponent = 0.2"
    # The elastic part of the way is 0.1 % of an increment, and so is its trace in the next one
    stiff = 400 * bond()
    for title, law, motion, load, stress in (
            ('Tresca at 10 MPa', tresca, slow, 10.0, 100 / math.sqrt(3)),
            ('Tresca at 20 MPa', tresca, slow, 20.0, 100 / math.sqrt(3)),
            ('Norton at 1 mm/s', norton, slow, 10.0, 10.0),
            ('Norton at 32 mm/s', norton, fast, 10.0, 20.0)):
        for method, keys in (('bonded', " method = 'return_mapping'"),
                             ('fading', ' regularisation_velocity = 1e-6')):
            name = f'{title}_{method}'.lower().replace(' ', '_').replace('/', '_')
            history = drag(context, name, law + keys, motion=motion, load=load,
                           factor=stiff).history
            at = history['time'].index(1.125) if motion == fast else -1
            yield context.row(f'{title}, {method}: shear [MPa]',
                              history['reaction_drag_x'][at] / 100, stress, TOLERANCE)


def incline(context):
    """Stress of 10 MPa along gravity on a slab that only friction holds."""
    for name, keys in (('penalty', ''), ('nodal', "formulation = 'master_slave'"),
                       ('augmented', "enforcement = 'augmented_lagrangian'"),
                       ('multipliers', "enforcement = 'lagrange'")):
        for angle, exit_code in ((16.6, 0), (16.8, 4)):
            theta = math.radians(angle)
            case = SLOPE.format(young=YOUNG, along=10 * math.sin(theta),
                                across=-10 * math.cos(theta), mu=MU, keys=keys)
            done = context.run_swage(case, name=f'slope_{name}_{angle}', expect_exit=exit_code)
            verdict = 'stays' if exit_code == 0 else 'slides'
            yield context.row(f'slope of {angle} degrees, {name}: {verdict}, exit code',
                              done.exit_code, exit_code, 0)
            if exit_code == 0:
                yield context.row(f'slope of {angle} degrees, {name}: friction [N]',
                                  -done.history['reaction_base_x'][-1], 1000 * math.sin(theta),
                                  1e-5)


def cycles(context):
    """An elastic strip on a table, sheared to and fro by its top until it slides."""
    for name, keys in (('l2', ''), ('nodal', "formulation = 'master_slave'"),
                       ('symmetric', "formulation = 'symmetric'"),
                       ('augmented', "enforcement = 'augmented_lagrangian'")):
        history = context.run_swage(RING.format(mu=MU, keys=keys), name=f'ring_{name}').history
        ratio = [abs(pull / weight) for pull, weight in zip(history['reaction_shear_x'][4:],
                                                           history['reaction_press_y'][4:])]
        yield context.row(f'ring, {name}: largest force along by force across', max(ratio), MU,
                          0.002)
        yield context.row(f'ring, {name}: friction by external work', history['friction_work'][-1]
                          / history['external_work'][-1], 1, 0.1)
        yield context.zero(f'ring, {name}: energy balance', max(
            abs(error) for error in history['energy_error']), 1e-3)
