"""Friction of a block of 10 x 10 x 10 mm that is pressed on a plane by 10 MPa and dragged.

What the laws demand stands in tools/swage_block_friction.py. With the augmented Lagrangian the bond
is rigid: 300 N from the first increment on, and no node penetrates. The generalized law is
mu p (v/v0)^0.5.
"""
import math

import swage_block_friction as block

# The way out, and elastic slip.
DRAG, STICK = 0.02, 0.005
BOND = block.bond(STICK, block.block_stiffness())
TABLE = """&tool name = 'table' shape = 'plane' point = 0, 0, 0 normal = 0, 0, 1 motion = 'drag' /
&motion name = 'drag' direction = 1, 0, 0 {motion} /"""
TO_AND_FRO = f'time = 0, 1, 2, 3 displacement = 0, 0, {DRAG}, -{DRAG}'

GENERAL = "kind = 'generalized_coulomb' coefficient = 0.1 rate_exponent = 0.5 reference_velocity = 2"
LAWS = [*block.LAWS,
        ('generalized at 1 mm/s', GENERAL, 1, 10.0, 0.1 * 10 * math.sqrt(1 / 2)),
        ('generalized at 32 mm/s', GENERAL, 32, 10.0, 0.1 * 10 * math.sqrt(32 / 2))]

SLOPE = "&tool name = 'slope' shape = 'plane' point = 0, 0, 0 normal = 0, 0, 1 /"


def run(context):
    context.bodies('blocks', {'BLOCK': block.block_mesh()})
    context.bodies('slabs', {'SLAB': block.slab_mesh()})
    yield from coulomb(context)
    yield from block.rows_of_laws(context, LAWS, shear)
    yield from block.rows_of_slopes(
        context, SLOPE, 'slope', ('force_slope_x', 1),
        {'penalty': '', 'augmented': "enforcement = 'augmented_lagrangian'",
         'multipliers': "enforcement = 'lagrange'"})


def drag(context, name, friction, keys='', motion=TO_AND_FRO, load=10.0):
    """History and drag force of a run."""
    case = block.block_case(TABLE.format(motion=motion), 'table', friction, BOND, keys, load)
    history = context.run_swage(case, name=name).history
    return history, [-value for value in history['force_table_x']]


def shear(context, name, friction, rate, pressure):
    """At a constant slip rate."""
    _, force = drag(context, name, friction, load=pressure,
                    motion=f'time = 0, 1, 3 displacement = 0, 0, {2 * rate}')
    return force[-1] / 100


def coulomb(context):
    history, force = drag(context, 'bonded', block.COULOMB + block.BONDED)
    yield from block.rows_of_drag(context, 'bonded', history, force, DRAG, STICK)
    yield context.row('bonded: force on the way out [N]', force[history['time'].index(2.0)],
                      block.LIMIT, block.TOLERANCE)
    yield context.row('bonded: force on the way back [N]', force[-1], -block.LIMIT,
                      block.TOLERANCE)

    for name, keys in (('augmented', block.AUGMENTED), ('multipliers', block.MULTIPLIERS)):
        history, force = drag(context, name, block.COULOMB + block.BONDED, keys)
        yield context.row(f'{name}: force at the first increment [N]',
                          force[history['time'].index(1.125)], block.LIMIT, block.TOLERANCE)
        yield context.row(f'{name}: force on the way back [N]', force[-1], -block.LIMIT,
                          block.TOLERANCE)
        yield context.row(f'{name}: penetration by cell', max(
            abs(value) for value in history['penetration_by_cell_foot']), 0, 1e-12)

    # Fading friction reaches the limit up to (fading rate / drag rate)^2 / 2
    fading = f' regularisation_velocity = {1e-5 * DRAG!r}'
    _, force = drag(context, 'fading', block.COULOMB + fading)
    yield context.row('fading: force on the way back [N]', force[-1], -block.LIMIT,
                      block.TOLERANCE)
