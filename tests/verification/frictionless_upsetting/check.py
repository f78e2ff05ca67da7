"""Upsetting between frictionless rigid tools, every law: exact force, order in time, mass.

A cylinder, radius 10 mm, height 30 mm, shortened by half in 1 s; the state is homogeneous, so the
force is known at any strain e = ln(h0/h) whatever the mesh:

  norton_hoff          F = A sqrt(3) K (sqrt(3) v/h)^m, A = A0 h0/h
  j2                   sigma = (Y + H e)/(1 + H/E)
  perzyna, chenot_eq3  d sigma/d e = E (1 - plastic rate/(v/h)), integrated here
  elastic              sigma = E e
  all but the first    F = sigma A, A = A0 exp(e - (1 - 2 nu) sigma/E)

A0 is the section of the mesh, its volume by its height: the polygon of a mesh in 3D is smaller
than the circle. In 3D it is a prism: where nodes of the side lie between those of the ends, as
Gmsh leaves them, the state is not homogeneous (4e-5).

The height h is the distance of the tools plus both penetrations; the penalty is 100 times the
default, so that their rates (1e-6 of the tool's) do not matter; 10^5 times for the elastic law,
whose pressure is hundreds of times larger. The ends alone touch the tools: the side's share of the
area at the edge would add to the unevenness of the penetration.

Tolerances: the limit of the step to 0, by Richardson extrapolation of three or four runs, is exact
but for the extrapolation: 1e-6. Strain is measured at the middle of the step and the return of j2
is exact in a proportional state, as is elasticity: order 2. A rate is that of the whole step but counts at its end: order 1. Mass:
the volume equation keeps the sum of the cells' volumes to the tolerance of Newton: 1e-6, and 1e-4
with friction in 50 steps.

The elastic law is compressed to 0.7 of its volume here. The trapezoid of the first step, from no force
to one that is not linear in the way, is off by a third of the strain of the step: its balance is held to
2 % in ten steps, to half of that in twice as many, and to the 1e-3 of all runs in 200.
"""
import math

HEIGHT, REDUCTION, SPEED = 30.0, 0.5, 15.0
YOUNG, POISSON = 200000.0, 0.3

LAWS = {
    'j2': "law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'linear'",
    'perzyna': "law = 'perzyna' young = 200000 poisson = 0.3 consistency = 100 "
               "rate_sensitivity = 0.2 threshold = 50",
    'chenot_eq3': "law = 'chenot_eq3' young = 200000 poisson = 0.3 consistency = 100 "
                  "rate_sensitivity = 0.2 threshold = 50",
    'norton_hoff': "law = 'norton_hoff' consistency = 10 rate_sensitivity = 0.2",
    'elastic': "law = 'elastic' young = 200000 poisson = 0.3",
}

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' /
&mesh file = '{mesh}.msh' /
&body name = 'billet' material = 'metal' group = 'BODY' /
&material name = 'metal' {law} /
{flow_stress}
{symmetry}
&tool name = 'upper' shape = 'plane' point = {top} normal = {down} motion = 'press' /
&tool name = 'lower' shape = 'plane' point = 0, 0, 0 normal = {up} /
&motion name = 'press' velocity = {velocity} /
&friction name = 'dry' kind = 'coulomb_tresca' coefficient = 0.2 /
&contact slave = '{end}' master = 'upper' friction = '{friction}' penalty_factor = {penalty} /
&contact slave = '{start}' master = 'lower' friction = '{friction}' penalty_factor = {penalty} /
&step duration = 1 increments = {steps} /
&solver tolerance = {tolerance} pressure_tolerance = 1e-9 /
&output every = {steps} fields = 'displacement' /
"""
FLOW_STRESS = "&flow_stress name = 'linear' kind = 'linear' yield_stress = 200 " \
              "hardening_modulus = 300 /"


def run(context):
    context.rectangle('axisymmetric', 2, 4, lambda x, y: (10 * x, HEIGHT * y))
    context.box('3d', 2, 2, 3, quarter_cylinder)
    for dimension in ('axisymmetric', '3d'):
        for law in LAWS:
            yield from limit(context, dimension, law)
        upset(context, dimension, 'elastic', 200)
    context.rectangle('axisymmetric', 8, 24, lambda x, y: (10 * x, HEIGHT * y))
    context.cylinder('3d', 10.0, HEIGHT, 3.0, quarter=True)
    for dimension in ('axisymmetric', '3d'):
        done = upset(context, dimension, 'j2', 50, friction='dry')
        mass = max(abs(value) for value in done.history['mass_error'])
        yield context.below(f'{dimension}, friction, 50 steps: mass error', mass, 1e-4)


def limit(context, dimension, law):
    """Force in the limit of small steps, its order, and the mass."""
    order = 2 if law in ('j2', 'elastic') else 1
    counts = (10, 20, 40) if order == 2 else (20, 40, 80, 160)
    forces, mass, section = [], 0.0, 0.0
    for steps in counts:
        done = upset(context, dimension, law, steps)
        section = done.history['volume'][0] / HEIGHT
        forces.append(abs(done.history['force_upper_' + axis(dimension)][-1]))
        mass = max([mass] + [abs(value) for value in done.history['mass_error']])
        height = HEIGHT * (1 - REDUCTION) + sum(
            done.history[f'penetration_contact_{side}'][-1] for side in (1, 2))
    exact = exact_force(law, height) * section
    errors = [abs(force / exact - 1) for force in forces]
    title = f'{dimension}, {law}'
    yield context.row(f'{title}: force, dt to 0', extrapolated(forces, order), exact, 1e-6)
    yield context.order(f'{title}: order in time', [1 / n for n in counts], errors,
                        order, 0.1 if order == 2 else 0.05)
    if law != 'elastic':
        yield context.below(f'{title}: mass error', mass, 1e-6)


def upset(context, dimension, law, steps, friction='none'):
    volume = dimension == '3d'
    symmetry = ("&boundary name = 'x' kind = 'symmetry' group = 'XMIN' /\n"
                "&boundary name = 'y' kind = 'symmetry' group = 'YMIN' /") if volume else ''
    start, end = ('ZMIN', 'ZMAX') if volume else ('BOTTOM', 'TOP')
    if friction == 'dry':
        start = end = 'billet'
    # Round-off of positions, 4e-15, is 1e-8 of a penetration under the largest penalty
    stiff = law == 'elastic'
    return context.run_swage(CASE.format(
        start=start, end=end, dimension=dimension, mesh=dimension, law=LAWS[law],
        symmetry=symmetry, steps=steps, flow_stress=FLOW_STRESS if law == 'j2' else '',
        friction=friction, penalty=10 if friction == 'dry' else 1e6 if stiff else 1e3,
        tolerance=1e-6 if stiff else 1e-8,
        top=along(volume, HEIGHT), down=along(volume, -1), up=along(volume, 1),
        velocity=along(volume, -SPEED)), name=f'{dimension}_{law}_{steps}_{friction}',
        energy_tolerance=0.2 / steps if stiff else 1e-3)


def quarter_cylinder(x, y, z):
    """The unit square becomes a quarter of a disc, its sides x = 0 and y = 0 remain."""
    return (10 * x * math.sqrt(1 - y**2 / 2), 10 * y * math.sqrt(1 - x**2 / 2), HEIGHT * z)


def axis(dimension):
    return 'z' if dimension == '3d' else 'y'


def along(volume, value):
    """A vector along the axis of the cylinder."""
    return f'0, 0, {value}' if volume else f'0, {value}, 0'


def extrapolated(values, order):
    """Richardson's limit of values at steps halved each time, errors in powers of step^order."""
    values = list(values)
    power = order
    while len(values) > 1:
        values = [fine + (fine - coarse) / (2**power - 1)
                  for coarse, fine in zip(values, values[1:])]
        power += order
    return values[0]


def exact_force(law, height):
    """At the end, by the initial section."""
    strain = math.log(HEIGHT / height)
    if law == 'norton_hoff':
        rate = SPEED / height
        return math.sqrt(3) * 10 * (math.sqrt(3) * rate)**0.2 * HEIGHT / height
    if law == 'j2':
        stress = (200 + 300 * strain) / (1 + 300 / YOUNG)
    elif law == 'elastic':
        stress = YOUNG * strain
    else:
        stress = viscoplastic_stress(law, strain)
    return stress * math.exp(strain - (1 - 2 * POISSON) * stress / YOUNG)


def viscoplastic_stress(law, end):
    """Runge-Kutta of order 4 over the strain, from first yield at sigma = R; R = 50, K = 100,
    m = 0.2."""
    def slope(strain, stress):
        over = max(stress - 50, 0.0) / 100
        plastic = over**5 if law == 'perzyna' else 2 / 3 * stress / 100 * over**4
        return YOUNG * (1 - plastic * HEIGHT * math.exp(-strain) / SPEED)

    strain, stress, n = 50 / YOUNG, 50.0, 40000
    step = (end - strain) / n
    for _ in range(n):
        first = slope(strain, stress)
        second = slope(strain + step / 2, stress + step / 2 * first)
        third = slope(strain + step / 2, stress + step / 2 * second)
        fourth = slope(strain + step, stress + step * third)
        stress += step / 6 * (first + 2 * second + 2 * third + fourth)
        strain += step
    return stress
