"""Unloading: a bar pulled into plasticity and released; an upsetting whose tool is withdrawn.

Bar: half of it, a traction that rises to 260 MPa and falls to 0. The uniaxial state is known:
small strain, e = (260 - Y)/H; large strain, the stress is 260 A0/A, A = V/h, V = V0 exp(-p/kappa),
and what remains is the plastic strain. Residual strain by 1e-6 of itself: the return is exact in a
proportional state; what is left in 80 steps is the strain at the middle of the step, de^2/12 =
3e-7, and the grad-div term, which takes the pressure of the start of the step: 1e-7. Newton's own
tolerance is 1e-9: a force that is wrong by 1e-6 leaves 260e-6/H, 4e-6 of the residual strain.

Tool: half of a cylinder is shortened by 10 %, then the tool is withdrawn. Without friction the
height that remains is h0 exp(-plastic strain), to 1e-6. With Coulomb friction residual stresses
remain, but contact is open: no node, no force, and the plane of symmetry carries nothing (1e-6 of
the largest force, the tolerance of Newton).
"""
import math

YOUNG, POISSON, YIELD_STRESS, HARDENING = 200000.0, 0.3, 200.0, 2000.0
BULK = YOUNG / (3 - 6 * POISSON)
TRACTION = 260.0
HEIGHT = 15.0

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' geometry = '{geometry}' /
&mesh file = '{dimension}.msh' /
&body name = 'bar' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 200 hardening_modulus = 2000 /
{symmetry}
&step duration = 1 increments = {steps} /
&step duration = 1 increments = {steps} /
&output every = {steps} fields = 'displacement' /
"""

PULL = """
&boundary name = 'end' kind = 'traction' group = '{end}' traction = {load}
  time = 0, 1, 2 factor = 0, 1, 0 /
&solver tolerance = 1e-9 /
"""

UPSET = """
&boundary name = 'end' kind = 'traction' group = '{end}' traction = 0, 0, 0 /
&tool name = 'upper' shape = 'plane' point = {top} normal = {down} motion = 'press' /
&motion name = 'press' direction = {down} time = 0, 1, 2 displacement = 0, 1.5, 0 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.2 /
&contact name = 'top' slave = 'bar' master = 'upper' friction = '{friction}' penalty_factor = 100 /
"""


def run(context):
    context.rectangle('axisymmetric', 4, 6, lambda x, y: (10 * x, HEIGHT * y))
    context.box('3d', 3, 3, 4, quarter_cylinder)
    for dimension in ('axisymmetric', '3d'):
        for geometry in ('fixed', 'updated'):
            history = unload(context, dimension, geometry, 'pull', PULL, steps=80)
            yield context.row(f'bar, {dimension}, {geometry}: residual strain',
                              strain(dimension, geometry, history, -1), pulled_strain(geometry),
                              1e-6)
        for friction in ('none', 'dry'):
            yield from withdraw(context, dimension, friction)


def withdraw(context, dimension, friction):
    history = unload(context, dimension, 'updated', f'upset_{friction}', UPSET, friction)
    along_axis = axis(dimension)
    title = f'tool, {dimension}, friction {friction}'
    force = [abs(value) for value in history[f'force_upper_{along_axis}']]
    largest = max(force)
    at_largest = force.index(largest)
    if friction == 'none':
        # Elastic and plastic parts of the strain at the end of the stroke
        total = -strain(dimension, 'updated', history, at_largest)
        yield context.row(f'{title}: residual strain', -strain(dimension, 'updated', history, -1),
                          plastic_strain(total), 1e-6)
    yield context.above(f'{title}: nodes in contact at the largest force',
                        history['contact_nodes_top'][at_largest], 5)
    yield context.zero(f'{title}: nodes in contact at the end', history['contact_nodes_top'][-1], 0)
    yield context.zero(f'{title}: force of the tool at the end', force[-1] / largest, 0)
    yield context.zero(f'{title}: reaction at mid-height at the end',
                       history[f'reaction_middle_{along_axis}'][-1] / largest, 1e-6)


def unload(context, dimension, geometry, name, load, friction='none', steps=20):
    """History of a bar under a load that comes and goes."""
    volume = dimension == '3d'
    planes = {'middle': 'ZMIN', 'x': 'XMIN', 'y': 'YMIN'} if volume else {'middle': 'BOTTOM'}
    symmetry = '\n'.join(f"&boundary name = '{plane}' kind = 'symmetry' group = '{group}' /"
                         for plane, group in planes.items())
    load = load.format(end='ZMAX' if volume else 'TOP', load=along(volume, TRACTION),
                       top=along(volume, HEIGHT), down=along(volume, -1), friction=friction)
    return context.run_swage(CASE.format(dimension=dimension, geometry=geometry,
                                         symmetry=symmetry + load, steps=steps),
                             name=f'{dimension}_{geometry}_{name}').history


def axis(dimension):
    return 'z' if dimension == '3d' else 'y'


def along(volume, value):
    """A vector along the axis of the cylinder."""
    return f'0, 0, {value}' if volume else f'0, {value}, 0'


def quarter_cylinder(x, y, z):
    """The unit square becomes a quarter of a disc, its sides x = 0 and y = 0 remain."""
    return (10 * x * math.sqrt(1 - y**2 / 2), 10 * y * math.sqrt(1 - x**2 / 2), HEIGHT * z)


def strain(dimension, geometry, history, row):
    """Of the bar in a row of the history; logarithmic where the mesh moves."""
    relative = history[f'displacement_end_{axis(dimension)}'][row] / HEIGHT
    return relative if geometry == 'fixed' else math.log(1 + relative)


def elastic_strain(stress):
    """Axial, logarithmic."""
    return stress / YOUNG


def pulled_strain(geometry):
    """Plastic strain under the traction per undeformed area."""
    if geometry == 'fixed':
        return (TRACTION - YIELD_STRESS) / HARDENING
    stress = TRACTION
    for _ in range(200):
        plastic = (stress - YIELD_STRESS) / HARDENING
        section = math.exp(stress / 3 / BULK - plastic - elastic_strain(stress))
        stress = TRACTION / section
    return plastic


def plastic_strain(total):
    """Part of a compressive strain that is plastic, by bisection on the stress."""
    low, high = 0.0, 10 * YIELD_STRESS
    for _ in range(200):
        stress = (low + high) / 2
        plastic = max(0.0, stress - YIELD_STRESS) / HARDENING
        if plastic - elastic_strain(-stress) < total:
            low = stress
        else:
            high = stress
    return plastic
