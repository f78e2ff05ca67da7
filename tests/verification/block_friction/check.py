"""Friction of a block of 10 x 10 x 10 mm that is pressed on a plane by 10 MPa and dragged.

The normal force, N = 1000 N, is a dead load, and the sections of the block do not shear: the drag
force follows from the friction law alone, and the tolerance is that of Newton, 1e-8.

Coulomb, mu = 0.3, by return mapping: below the limit the drag force is the bond's stiffness times
the drag u, then 300 N; after the reversal it falls along the bond again to -300 N. Elastic slip
u_stick = 300 / (bond stiffness) is not dissipated: the heat is 300 (u - u_stick) for the way out
and 300 (u - 2 u_stick) for the way back (increments end where the bonds break: works are taken by
trapezoids). With the augmented Lagrangian the bond is rigid: 300 N
from the first increment on, and no node penetrates.

Tresca: 0.5 * 200 / sqrt(3) = 57.735 MPa whatever the pressure. Norton, alpha = 1, K = 10, q = 0.2:
10 MPa at 1 mm/s, 20 MPa at 32 mm/s. The generalized law is mu p (v/v0)^0.5.

A block held by nothing but friction on a plane inclined by theta stays if tan(theta) < mu and
slides if not: atan(0.3) = 16.699 degrees.
"""
import math

YOUNG, PENALTY = 200000.0, 10.0
WEIGHT, MU = 1000.0, 0.3
DRAG, STICK = 0.02, 0.005
TOLERANCE = 1e-8
# 3G of the cells by their size, on the area of the block, times this is the stiffness of the bonds
SIZE = (6 * math.sqrt(2) * 10.0**3 / 48)**(1 / 3)
BOND = MU * WEIGHT / STICK / (PENALTY * 1.5 * YOUNG / SIZE * 100)

CASE = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'block.msh' /
&body name = 'block' material = 'stiff' group = 'BODY' /
&material name = 'stiff' law = 'elastic' young = {young} poisson = 0 /
&boundary name = 'guide' kind = 'fixed' group = 'BODY' components = 'x', 'y' /
&boundary name = 'load' kind = 'traction' group = 'ZMAX' traction = 0, 0, {load}
  time = 0, 1 factor = 0, 1 /
&tool name = 'table' shape = 'plane' point = 0, 0, 0 normal = 0, 0, 1 motion = 'drag' /
&motion name = 'drag' direction = 1, 0, 0 {motion} /
&friction name = 'rub' {friction} /
&contact name = 'foot' slave = 'ZMIN' master = 'table' friction = 'rub'
  penalty_factor = {penalty} tangential_factor = {bond} {enforcement} /
&step duration = 1 increments = 2 /
&step duration = 2 increments = 16 /
&solver tolerance = 1e-10 pressure_tolerance = 1e-10 /
"""

TO_AND_FRO = f'time = 0, 1, 2, 3 displacement = 0, 0, {DRAG}, -{DRAG}'
COULOMB = f"kind = 'coulomb' coefficient = {MU}"
BONDED = " method = 'return_mapping'"
AUGMENTED = ("enforcement = 'augmented_lagrangian' penetration_tolerance = 1e-12 "
             "multiplier_tolerance = 1e-11")
MULTIPLIERS = AUGMENTED.replace('augmented_lagrangian', 'lagrange')

SLOPE = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'slab.msh' /
&body name = 'slab' material = 'stiff' group = 'BODY' /
&material name = 'stiff' law = 'elastic' young = {young} poisson = 0.3 /
&boundary name = 'weight' kind = 'traction' group = 'ZMAX' traction = {along}, 0, {across}
  time = 0, 1 factor = 0, 1 /
&tool name = 'slope' shape = 'plane' point = 0, 0, 0 normal = 0, 0, 1 /
&friction name = 'rub' kind = 'coulomb' coefficient = {mu} method = 'return_mapping' /
&contact name = 'foot' slave = 'ZMIN' master = 'slope' friction = 'rub' {enforcement} /
&step duration = 1 increments = 4 maximum_cuts = 2 /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
"""


def run(context):
    context.box('block', 2, 2, 2, lambda x, y, z: (10 * x, 10 * y, 10 * z))
    context.box('slab', 4, 4, 1, lambda x, y, z: (10 * x, 10 * y, z))
    yield from coulomb(context)
    yield from rates(context)
    yield from incline(context)


def drag(context, name, friction, enforcement='', motion=TO_AND_FRO, load=10.0):
    case = CASE.format(young=YOUNG, load=-load, motion=motion, friction=friction, penalty=PENALTY,
                       bond=repr(BOND), enforcement=enforcement)
    return context.run_swage(case, name=name).history


def coulomb(context):
    history = drag(context, 'bonded', COULOMB + BONDED)
    time, force = history['time'], [-value for value in history['force_table_x']]
    heat = history['friction_work']
    limit = MU * WEIGHT

    stiffness = limit / STICK
    worst = 0.0
    for t, value in zip(time, force):
        if 1 <= t <= 2:
            expected = min(stiffness * DRAG * (t - 1), limit)
        elif t > 2:
            expected = max(limit - stiffness * 2 * DRAG * (t - 2), -limit)
        else:
            expected = 0.0
        worst = max(worst, abs(value - expected))
    yield context.row('bonded: drag force in all increments', worst / limit, 0, TOLERANCE)
    out, back = time.index(2.0), len(time) - 1
    yield context.row('bonded: force on the way out [N]', force[out], limit, TOLERANCE)
    yield context.row('bonded: force on the way back [N]', force[back], -limit, TOLERANCE)
    yield context.row('bonded: heat on the way out [mJ]', heat[out], limit * (DRAG - STICK),
                      TOLERANCE)
    yield context.row('bonded: heat on the way back [mJ]', heat[back] - heat[out],
                      limit * (2 * DRAG - 2 * STICK), TOLERANCE)

    for name, keys in (('augmented', AUGMENTED), ('multipliers', MULTIPLIERS)):
        history = drag(context, name, COULOMB + BONDED, keys)
        force = [-value for value in history['force_table_x']]
        first = history['time'].index(1.125)
        yield context.row(f'{name}: force at the first increment [N]', force[first], limit,
                          TOLERANCE)
        yield context.row(f'{name}: force on the way back [N]', force[-1], -limit, TOLERANCE)
        yield context.row(f'{name}: penetration by cell', max(
            abs(value) for value in history['penetration_by_cell_foot']), 0, 1e-12)

    # Fading friction reaches the limit up to (fading rate / drag rate)^2 / 2
    history = drag(context, 'fading', COULOMB + f' regularisation_velocity = {1e-5 * DRAG!r}')
    yield context.row('fading: force on the way back [N]', -history['force_table_x'][-1], -limit,
                      TOLERANCE)


def rates(context):
    """Shear stresses at constant slip rates."""
    slow, fast = 'time = 0, 1, 3 displacement = 0, 0, 2', 'time = 0, 1, 3 displacement = 0, 0, 64'
    tresca = "kind = 'tresca' tresca_factor = 0.5 flow_stress = 200"
    norton = "kind = 'norton' factor = 1 consistency = 10 rate_exponent = 0.2"
    general = ("kind = 'generalized_coulomb' coefficient = 0.1 rate_exponent = 0.5 "
               "reference_velocity = 2")
    for title, law, motion, load, stress in (
            ('Tresca at 10 MPa', tresca, slow, 10.0, 100 / math.sqrt(3)),
            ('Tresca at 20 MPa', tresca, slow, 20.0, 100 / math.sqrt(3)),
            ('Norton at 1 mm/s', norton, slow, 10.0, 10.0),
            ('Norton at 32 mm/s', norton, fast, 10.0, 20.0),
            ('generalized at 1 mm/s', general, slow, 10.0, 0.1 * 10 * math.sqrt(1 / 2)),
            ('generalized at 32 mm/s', general, fast, 10.0, 0.1 * 10 * math.sqrt(32 / 2))):
        for method, keys in (('bonded', BONDED), ('fading', ' regularisation_velocity = 1e-6')):
            name = f'{title}_{method}'.lower().replace(' ', '_').replace('/', '_')
            history = drag(context, name, law + keys, motion=motion, load=load)
            yield context.row(f'{title}, {method}: shear [MPa]',
                              -history['force_table_x'][-1] / 100, stress, TOLERANCE)


def incline(context):
    """Stress of 10 MPa along gravity on a slab that only friction holds."""
    for name, enforcement in (('penalty', ''),
                              ('augmented', "enforcement = 'augmented_lagrangian'"),
                              ('multipliers', "enforcement = 'lagrange'")):
        for angle, exit_code in ((16.6, 0), (16.8, 4)):
            theta = math.radians(angle)
            case = SLOPE.format(young=YOUNG, along=10 * math.sin(theta),
                                across=-10 * math.cos(theta), mu=MU, enforcement=enforcement)
            done = context.run_swage(case, name=f'slope_{name}_{angle}', expect_exit=exit_code)
            verdict = 'stays' if exit_code == 0 else 'slides'
            yield context.row(f'slope of {angle} degrees, {name}: {verdict}, exit code',
                              done.exit_code, exit_code, 0)
            if exit_code == 0:
                yield context.row(f'slope of {angle} degrees, {name}: friction [N]',
                                  done.history['force_slope_x'][-1], 1000 * math.sin(theta), 1e-5)
