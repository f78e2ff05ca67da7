"""Friction of a block of 10 x 10 x 10 mm that is pressed on another body by 10 MPa and dragged.

As `block_friction`, with a deformable body in place of the rigid table: a block of 22 x 14 x 5 mm
whose mesh does not match, moved as a whole. What the laws demand stands in
tools/swage_block_friction.py; it holds also where nodes pass from facet to facet. With multipliers
the bond is rigid: 300 N from the first increment on, and no node penetrates. Both ways, in
`symmetric` contact, half of the conditions are those of the other body's nodes, which feel the edge
of the block: the force only.

A ring of sticking and sliding: an elastic strip is sheared to and fro by 0.1 mm, friction holds it
and lets it go: what the shear puts in is in the strip, in the bonds, or was rubbed away. The
increments are short enough for 1e-3 of it; force along by force across is mu while all nodes slide.
"""
import swage_block_friction as block
import swage_mesh_writer

# The way out, and elastic slip.
DRAG, STICK = 4.0, 1.0
TABLE = """&body name = 'table' material = 'stiff' group = 'TABLE_BODY' /
&boundary name = 'drag' kind = 'displacement' group = 'TABLE_BODY' {motion} /"""
TO_AND_FRO = f'displacement = {DRAG}, 0, 0 time = 0, 1, 2, 3 factor = 0, 0, 1, -1'
COULOMB = block.COULOMB + block.BONDED
NODAL = "formulation = 'master_slave'"

SLOPE = """&body name = 'bed' material = 'stiff' group = 'BED_BODY' /
&boundary name = 'base' kind = 'fixed' group = 'BED_ZMIN' /"""

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


def run(context):
    context.bodies('blocks', {
        'BLOCK': block.block_mesh(),
        'TABLE': swage_mesh_writer.box_mesh(11, 7, 2, lambda x, y, z: (22 * x - 5.7, 14 * y - 2.2,
                                                                      5 * z - 5))})
    context.bodies('slabs', {
        'SLAB': block.slab_mesh(),
        'BED': swage_mesh_writer.box_mesh(5, 5, 1, lambda x, y, z: (12.5 * x - 1.1, 12.5 * y - 1.3,
                                                                    2 * z - 2))})
    context.bodies('strips', {
        'STRIP': swage_mesh_writer.rectangle_mesh(14, 3, lambda x, y: (10 * x, 2 * y)),
        'BED': swage_mesh_writer.rectangle_mesh(17, 3, lambda x, y: (14 * x - 2.1, 2 * y - 2))})
    yield from coulomb(context)
    yield from block.rows_of_laws(context, block.LAWS, shear)
    yield from block.rows_of_slopes(
        context, SLOPE, 'BED_ZMAX', ('reaction_base_x', -1),
        {'penalty': '', 'nodal': NODAL, 'augmented': "enforcement = 'augmented_lagrangian'",
         'multipliers': "enforcement = 'lagrange'"})
    yield from cycles(context)


def bond():
    """Factor that makes the bonds of the block break after the drag STICK."""
    both = [block.block_stiffness(), block.stiffness_of_cells(22 * 14 * 5, 11 * 7 * 2)]
    return block.bond(STICK, 2 * both[0] * both[1] / sum(both))


def drag(context, name, friction, keys='', motion=TO_AND_FRO, load=10.0, factor=1):
    """History and drag force of a run, with bonds stiffer by a factor."""
    case = block.block_case(TABLE.format(motion=motion), 'TABLE_ZMAX', friction, factor * bond(),
                            keys, load, pressure_tolerance='1e-9')
    history = context.run_swage(case, name=name).history
    return history, history['reaction_drag_x']


def coulomb(context):
    for name, keys in (('l2', ''), ('lumped', "projection = 'lumped'"), ('nodal', NODAL),
                       ('full', NODAL + " variant = 'full'")):
        history, force = drag(context, name, COULOMB, keys)
        yield from block.rows_of_drag(context, name, history, force, DRAG, STICK)

    for name, method, keys in (
            ('l2', 'augmented', block.AUGMENTED), ('l2', 'multipliers', block.MULTIPLIERS),
            ('nodal', 'augmented', f'{block.AUGMENTED} {NODAL}'),
            ('nodal', 'multipliers', f'{block.MULTIPLIERS} {NODAL}')):
        history, force = drag(context, f'{name}_{method}', COULOMB, keys)
        first = history['time'].index(1.125)
        way = force[first:first + 8] + [-value for value in force[first + 8:]]
        furthest = max(way, key=lambda value: abs(value - block.LIMIT))
        yield context.row(f'{name}, {method}: force, all increments [N]', furthest, block.LIMIT,
                          block.TOLERANCE)
        yield context.zero(f'{name}, {method}: penetration by cell',
                           max(abs(value) for value in history['penetration_by_cell_foot']), 1e-12)

    history, force = drag(context, 'symmetric', COULOMB, "formulation = 'symmetric'")
    yield context.row('symmetric: force on the way out [N]', force[history['time'].index(2.0)],
                      block.LIMIT, 0.01)


def shear(context, name, friction, rate, pressure):
    """At a constant slip rate; the slow way is 2 mm long, the fast one 4 mm."""
    motion, end = 'displacement = 2, 0, 0 time = 0, 1, 3 factor = 0, 0, 1', 3.0
    if rate > 1:
        motion = ('displacement = 4, 0, 0 time = 0, 1, 1.03125, 1.0625, 1.09375, 1.125, 3 '
                  'factor = 0, 0, 0.25, 0.5, 0.75, 1, 1')
        end = 1.125
    # The elastic part of the way is 0.1 % of an increment, and so is its trace in the next one
    history, force = drag(context, name, friction, motion=motion, load=pressure, factor=400)
    return force[history['time'].index(end)] / 100


def cycles(context):
    """An elastic strip on a table, sheared to and fro by its top until it slides."""
    for name, keys in (('l2', ''), ('nodal', "formulation = 'master_slave'"),
                       ('symmetric', "formulation = 'symmetric'"),
                       ('augmented', "enforcement = 'augmented_lagrangian'")):
        history = context.run_swage(RING.format(mu=block.MU, keys=keys),
                                    name=f'ring_{name}').history
        ratio = [abs(pull / weight) for pull, weight in zip(history['reaction_shear_x'][4:],
                                                           history['reaction_press_y'][4:])]
        yield context.row(f'ring, {name}: largest force along by force across', max(ratio),
                          block.MU, 0.002)
        yield context.row(f'ring, {name}: friction by external work', history['friction_work'][-1]
                          / history['external_work'][-1], 1, 0.1)
        yield context.zero(f'ring, {name}: energy balance', max(
            abs(error) for error in history['energy_error']), 1e-3)
