"""A block of 10 x 10 x 10 mm that is pressed on a table by 10 MPa and dragged, and a slab that only
friction holds on a slope: inputs and exact values for the cases block_friction, where the table and
the slope are rigid tools, and block_friction_bodies, where they are bodies. Standard library only.

The normal force, N = 1000 N, is a dead load, and the sections of the block do not shear: the drag
force follows from the friction law alone, and the tolerance is that of Newton, 1e-8.

Coulomb, mu = 0.3, by return mapping: below the limit the force is the bond's stiffness times the
drag u, then 300 N; after the reversal it falls along the bond to -300 N. Elastic slip u_stick = 300
/ (bond stiffness) is not dissipated: the heat is 300 (u - u_stick) for the way out and 300 (u - 2
u_stick) for the way back (increments end where the bonds break: works are taken by trapezoids).

Tresca: 0.5 * 200 / sqrt(3) = 57.735 MPa whatever the pressure. Norton, alpha = 1, K = 10, q = 0.2:
10 MPa at 1 mm/s, 20 MPa at 32 mm/s. The slab stays if the tangent of the slope is below mu and
slides if not: atan(0.3) = 16.699 degrees.
"""
import math

import swage_mesh_writer

YOUNG, PENALTY = 200000.0, 10.0
WEIGHT, MU = 1000.0, 0.3
LIMIT = MU * WEIGHT
TOLERANCE = 1e-8

COULOMB = f"kind = 'coulomb' coefficient = {MU}"
BONDED, FADING = " method = 'return_mapping'", ' regularisation_velocity = 1e-6'
AUGMENTED = ("enforcement = 'augmented_lagrangian' penetration_tolerance = 1e-12 "
             "multiplier_tolerance = 1e-11")
MULTIPLIERS = AUGMENTED.replace('augmented_lagrangian', 'lagrange')

# Laws at slip rates of 1 and 32 mm/s: title, keys of &friction, rate, pressure and shear [MPa].
TRESCA = "kind = 'tresca' tresca_factor = 0.5 flow_stress = 200"
NORTON = "kind = 'norton' factor = 1 consistency = 10 rate_exponent = 0.2"
LAWS = [('Tresca at 10 MPa', TRESCA, 1, 10.0, 100 / math.sqrt(3)),
        ('Tresca at 20 MPa', TRESCA, 1, 20.0, 100 / math.sqrt(3)),
        ('Norton at 1 mm/s', NORTON, 1, 10.0, 10.0),
        ('Norton at 32 mm/s', NORTON, 32, 10.0, 20.0)]

BLOCK = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'blocks.msh' /
&body name = 'block' material = 'stiff' group = 'BLOCK_BODY' /
&material name = 'stiff' law = 'elastic' young = {young} poisson = 0 /
&boundary name = 'guide' kind = 'fixed' group = 'BLOCK_BODY' components = 'x', 'y' /
&boundary name = 'load' kind = 'traction' group = 'BLOCK_ZMAX' traction = 0, 0, {load}
  time = 0, 1 factor = 0, 1 /
{table}
&friction name = 'rub' {friction} /
&contact name = 'foot' slave = 'BLOCK_ZMIN' master = '{master}' friction = 'rub'
  penalty_factor = {penalty} tangential_factor = {bond} {keys} /
&step duration = 1 increments = 2 /
&step duration = 2 increments = 16 /
&solver tolerance = 1e-10 pressure_tolerance = {pressure_tolerance} /
"""

SLOPE = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'slabs.msh' /
&body name = 'slab' material = 'stiff' group = 'SLAB_BODY' /
&material name = 'stiff' law = 'elastic' young = {young} poisson = 0.3 /
&boundary name = 'weight' kind = 'traction' group = 'SLAB_ZMAX' traction = {along}, 0, {across}
  time = 0, 1 factor = 0, 1 /
{slope}
&friction name = 'rub' kind = 'coulomb' coefficient = {mu} method = 'return_mapping' /
&contact name = 'foot' slave = 'SLAB_ZMIN' master = '{master}' friction = 'rub' {keys} /
&step duration = 1 increments = 4 maximum_cuts = 2 /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
"""


def block_mesh():
    return swage_mesh_writer.box_mesh(2, 2, 2, lambda x, y, z: (10 * x, 10 * y, 10 * z))


def slab_mesh():
    return swage_mesh_writer.box_mesh(4, 4, 1, lambda x, y, z: (10 * x, 10 * y, z))


def block_stiffness():
    """3G of the block's cells by their size, that of regular tetrahedra."""
    return stiffness_of_cells(10**3, 2**3)


def stiffness_of_cells(volume, boxes):
    """The same of a box that is cut in cubes of six tetrahedra."""
    return 1.5 * YOUNG / (math.sqrt(2) * volume / boxes)**(1 / 3)


def bond(stick, stiffness):
    """Tangential factor of bonds that break after a drag `stick`, on cells of this stiffness."""
    return LIMIT / stick / (PENALTY * stiffness * 100)


def block_case(table, master, friction, bond, keys='', load=10.0, pressure_tolerance='1e-10'):
    """Input of the block on a table, which is more groups; mesh blocks.msh with BLOCK."""
    return BLOCK.format(young=YOUNG, load=-load, table=table, master=master, friction=friction,
                        penalty=PENALTY, bond=repr(bond), keys=keys,
                        pressure_tolerance=pressure_tolerance)


def drag_force(time, drag, stick):
    """Out by the drag from 1 to 2, back by twice as much from 2 to 3."""
    stiffness = LIMIT / stick
    if time > 2:
        return max(LIMIT - stiffness * 2 * drag * (time - 2), -LIMIT)
    return min(stiffness * drag * max(time - 1, 0), LIMIT)


def rows_of_drag(context, name, history, force, drag, stick):
    """Force and heat on the way out and back."""
    worst = max(abs(value - drag_force(time, drag, stick))
                for time, value in zip(history['time'], force))
    yield context.zero(f'{name}: drag force in all increments', worst / LIMIT, TOLERANCE)
    heat, out = history['friction_work'], history['time'].index(2.0)
    yield context.row(f'{name}: heat on the way out [mJ]', heat[out], LIMIT * (drag - stick),
                      TOLERANCE)
    yield context.row(f'{name}: heat on the way back [mJ]', heat[-1] - heat[out],
                      LIMIT * (2 * drag - 2 * stick), TOLERANCE)


def rows_of_laws(context, laws, shear):
    """Shear at constant slip rates; shear(context, name, keys of
    &friction, rate, pressure) runs it."""
    for title, law, rate, pressure, stress in laws:
        for method, keys in (('bonded', BONDED), ('fading', FADING)):
            name = f'{title}_{method}'.lower().replace(' ', '_').replace('/', '_')
            yield context.row(f'{title}, {method}: shear [MPa]',
                              shear(context, name, law + keys, rate, pressure), stress,
                              TOLERANCE)


def rows_of_slopes(context, slope, master, force, contacts):
    """Stress of 10 MPa along gravity on a slab that only friction holds on a slope, which is more
    groups; `force` is the column of the friction and its sign, `contacts` keys of &contact by
    name."""
    column, sign = force
    for name, keys in contacts.items():
        for angle, exit_code in ((16.6, 0), (16.8, 4)):
            theta = math.radians(angle)
            case = SLOPE.format(young=YOUNG, along=10 * math.sin(theta),
                                across=-10 * math.cos(theta), slope=slope, master=master, mu=MU,
                                keys=keys)
            done = context.run_swage(case, name=f'slope_{name}_{angle}', expect_exit=exit_code)
            title = f'slope of {angle} degrees, {name}'
            verdict = 'stays' if exit_code == 0 else 'slides'
            yield context.row(f'{title}: {verdict}, exit code', done.exit_code, exit_code, 0)
            if exit_code == 0:
                yield context.row(f'{title}: friction [N]', sign * done.history[column][-1],
                                  1000 * math.sin(theta), 1e-5)
