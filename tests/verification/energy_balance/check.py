"""Energies: they add up to the external work whatever the law, load or contact; closed forms.

Balance: the external work less the other energies, by the external work, in every row of the
history: 1e-3. Small strain with constant loads is exact: 1e-9, what Newton leaves.

Closed forms:
  Frictionless upsetting, linear hardening, of the strain e at the end: plastic work V0 (Y ep +
  H ep^2/2) with ep = e - sigma/E. Ten short steps lead to yield, for a step in which the force
  jumps counts half of it; 40 steps of 1.7 %: 1e-3 (e^2/6 a step and p/kappa).
  Gap: an elastic block that the tool meets in the middle of a step: the external work is half of
  the force times what the tool has gone since the contact: 1e-3, for the area of the contact is
  that of the start of the step.
  A tool that turns on a pressed disc, rigid by hardening: friction takes torque times angle, all
  the work of this step but for what is elastic: 1e-2 of it.
"""
import math

YOUNG, YIELD_STRESS, HARDENING = 200000.0, 200.0, 300.0
HEIGHT = 15.0

LAWS = {
    'j2': "law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'linear'",
    'elastic': "law = 'elastic' young = 200000 poisson = 0.3",
    'perzyna': "law = 'perzyna' young = 200000 poisson = 0.3 consistency = 100 "
               "rate_sensitivity = 0.2 threshold = 50",
    'norton_hoff': "law = 'norton_hoff' consistency = 10 rate_sensitivity = 0.2",
}
FRICTION = {
    'none': "kind = 'none'",
    'coulomb': "kind = 'coulomb' coefficient = 0.2",
    'bond': "kind = 'coulomb_tresca' coefficient = 0.2 method = 'return_mapping'",
    'tresca': "kind = 'tresca' tresca_factor = 0.3",
    'sticking': "kind = 'sticking'",
}

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' geometry = '{geometry}' /
&mesh file = '{mesh}.msh' /
&body name = 'billet' material = 'metal' group = 'BODY' /
&material name = 'metal' {law} /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 200 hardening_modulus = 300 /
&friction name = 'friction' {friction} /
{rest}
&output every = 1000 fields = 'displacement' /
{solver}
"""
EXACT = '&solver tolerance = 1e-9 pressure_tolerance = 1e-9 /'

SYMMETRY = {
    'plane_strain': {'LEFT': 'x', 'BOTTOM': 'y'},
    'axisymmetric': {'BOTTOM': 'y'},
    '3d': {'XMIN': 'x', 'YMIN': 'y', 'ZMIN': 'z'},
}


def run(context):
    context.rectangle('plane_strain', 6, 8, lambda x, y: (10 * x, HEIGHT * y))
    context.rectangle('axisymmetric', 6, 8, lambda x, y: (10 * x, HEIGHT * y))
    context.box('3d', 3, 3, 4, quarter_cylinder)
    yield from closed_form(context)
    yield from gap(context)
    yield from upsettings(context)
    yield from tools(context)
    yield from loads(context)


def run_case(context, name, dimension, law, rest, friction='none', geometry='updated', mesh=None):
    """The history, and a row for its balance."""
    exact = geometry == 'fixed'
    history = context.run_swage(
        CASE.format(dimension=dimension, geometry=geometry, mesh=mesh or dimension, law=LAWS[law],
                    friction=FRICTION[friction], rest=rest, solver=EXACT if exact else ''),
        name=name).history
    worst = max((abs(error) for error in history['energy_error']))
    return history, context.zero(f'{name}: balance', worst, 1e-9 if exact else 1e-3)


def supports(dimension):
    return '\n'.join(f"&boundary name = '{group}' kind = 'symmetry' group = '{group}' /"
                     for group in SYMMETRY[dimension])


def press(dimension, travel, gap=0.0):
    """Half of a billet and a plane tool; `travel` is the text of its motion."""
    volume = dimension == '3d'
    return supports(dimension) + f"""
&tool name = 'upper' shape = 'plane' point = {along(volume, HEIGHT + gap)}
  normal = {along(volume, -1)} motion = 'press' /
&motion name = 'press' direction = {along(volume, -1)} {travel} /
&contact name = 'top' slave = 'billet' master = 'upper' friction = 'friction' /
"""


def closed_form(context):
    first = 0.002
    history, row = run_case(context, 'exact', 'axisymmetric', 'j2', supports('axisymmetric') + f"""
&tool name = 'upper' shape = 'plane' point = 0, {HEIGHT}, 0 normal = 0, -1, 0 motion = 'press' /
&motion name = 'press' velocity = 0, -7.5, 0 /
&contact slave = 'TOP' master = 'upper' penalty_factor = 1000 /
&step duration = {first} increments = 10 /
&step duration = {1 - first} increments = 40 /
""")
    yield row
    strain = math.log(2)
    stress = (YIELD_STRESS + HARDENING * strain) / (1 + HARDENING / YOUNG)
    plastic = strain - stress / YOUNG
    volume = math.pi * 10**2 * HEIGHT
    work = volume * (YIELD_STRESS * plastic + HARDENING * plastic**2 / 2)
    stored = volume * stress**2 / 2 / YOUNG
    yield context.row('exact: plastic work', history['plastic_work'][-1], work, 1e-3)
    yield context.row('exact: elastic energy', history['elastic_energy'][-1], stored, 1e-3)
    yield context.row('exact: external work', history['external_work'][-1], work + stored, 1e-3)


def gap(context):
    """The tool is 0.0074 mm away and goes 0.002 mm a step."""
    for dimension in ('plane_strain', '3d'):
        history, row = run_case(context, f'gap_{dimension}', dimension, 'elastic', press(
            dimension, 'time = 0, 1 displacement = 0, 0.02', gap=0.0074)
            + '&step duration = 1 increments = 10 /')
        yield row
        force = abs(history[f"force_upper_{'z' if dimension == '3d' else 'y'}"][-1])
        yield context.row(f'gap_{dimension}: external work', history['external_work'][-1],
                          force * (0.02 - 0.0074) / 2, 1e-3)


def upsettings(context):
    """By 30 % in 15 steps, then the tool leaves."""
    travel = 'time = 0, 1, 1.2 displacement = 0, 4.5, 3'
    steps = '&step duration = 1 increments = 15 /\n&step duration = 0.2 increments = 4 /'
    cases = [('plane_strain', 'j2', friction) for friction in FRICTION]
    cases += [('axisymmetric', 'j2', 'coulomb'), ('axisymmetric', 'perzyna', 'tresca'),
              ('axisymmetric', 'norton_hoff', 'coulomb'), ('3d', 'j2', 'bond'),
              ('3d', 'norton_hoff', 'tresca')]
    for dimension, law, friction in cases:
        name = f'upset_{dimension}_{law}_{friction}'
        history, row = run_case(context, name, dimension, law, press(dimension, travel) + steps,
                                friction)
        yield row
        work = history['external_work'][-1]
        if law != 'norton_hoff':
            # The fluid has nothing that pushes it off the tool
            yield context.zero(f'{name}: force at the end', max(
                abs(history[f'force_upper_{axis}'][-1]) for axis in 'xyz'), 0)
            yield context.zero(f'{name}: energy left in the contact',
                               history['contact_energy'][-1] / work, 1e-4)
        if friction not in ('none', 'sticking'):
            yield context.above(f'{name}: share of friction', history['friction_work'][-1] / work,
                                0.01)


def tools(context):
    """Tools that turn, and one with an edge over which the metal flows."""
    context.cylinder('disc', 10.0, 8.0, 4.0)
    held = """
&tool name = 'upper' shape = 'plane' point = 0, 0, 8 normal = 0, 0, -1 motion = 'turn' /
&tool name = 'lower' shape = 'plane' point = 0, 0, 0 normal = 0, 0, 1 motion = '{lower}' /
&friction name = 'weld' kind = 'sticking' /
&contact name = 'top' slave = 'TOP' master = 'upper' friction = '{upper}' separation = {free} /
&contact name = 'bottom' slave = 'BOTTOM' master = 'lower' friction = 'weld'
  separation = .false. /
"""
    pull = 'direction = 0, 0, 1 time = 0, 1, 2 displacement = 0, 0.01, 0.01'
    turn = 'axis_point = 0, 0, 0 axis_direction = {axis} angle = 0, {angles}'
    for name, axis, angles in (('pulled_and_turned', '0, 0, 1', '0.5, 1'),
                               ('pulled_then_turned', '0, 1, 0', '0, 1')):
        history, row = run_case(context, name, '3d', 'elastic', held.format(
            lower='roll', upper='weld', free='.false.') + f"""
&motion name = 'turn' {pull} {turn.format(axis=axis, angles=angles)} /
&motion name = 'roll' time = 0, 1, 2 {turn.format(axis=axis, angles=angles)} /
&step duration = 1 increments = 10 / &step duration = 1 increments = 40 /
""", mesh='disc')
        yield row

    history, row = run_case(context, 'twist', '3d', 'j2', held.format(
        lower='fixed', upper='friction', free='.true.') + """
&motion name = 'turn' direction = 0, 0, -1 time = 0, 1, 2 displacement = 0, 0.5, 0.5
  axis_point = 0, 0, 0 axis_direction = 0, 0, 1 angle = 0, 0, 0.5 /
&step duration = 1 increments = 10 / &step duration = 1 increments = 20 /
""", 'coulomb', mesh='disc')
    yield row
    angle, torque = history['angle_upper'], history['torque_upper_z']
    turned = -sum((torque[i] + torque[i + 1]) / 2 * (angle[i + 1] - angle[i])
                  for i in range(len(angle) - 1))
    done = history['external_work'][-1] - history['external_work'][10]
    yield context.row('twist: work while the tool turns by torque and angle', done, turned, 1e-3)

    history, row = run_case(context, 'edge', 'axisymmetric', 'j2', supports('axisymmetric') + f"""
&tool name = 'die' shape = 'cone' heights = {HEIGHT}, {HEIGHT + 4} radii = 10, 6 side = 'inside'
  motion = 'press' /
&motion name = 'press' velocity = 0, -3, 0 /
&contact name = 'wall' slave = 'billet' master = 'die' friction = 'friction' /
&step duration = 1 increments = 20 /
""", 'coulomb')
    yield row


def loads(context):
    """Pressure that follows, tractions that do not; two motions at one corner."""
    context.rectangle('ring', 4, 16, lambda x, y: (
        (10 + 10 * x) * math.cos(math.pi / 2 * y), (10 + 10 * x) * math.sin(math.pi / 2 * y)))
    ring = """
&boundary name = 'x' kind = 'symmetry' group = 'TOP' /
&boundary name = 'y' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'inside' kind = 'pressure' group = 'LEFT' pressure = {pressure}
  time = 0, 1, 2 factor = 0, 1, 0 /
&step duration = 1 increments = {steps} / &step duration = 1 increments = {steps} /
"""
    for geometry in ('fixed', 'updated'):
        history, row = run_case(context, f'ring_elastic_{geometry}', 'plane_strain', 'elastic',
                                ring.format(pressure=100, steps=4), geometry=geometry, mesh='ring')
        yield row
    history, row = run_case(context, 'ring_plastic', 'plane_strain', 'j2',
                            ring.format(pressure=150, steps=20), mesh='ring')
    yield row

    history, row = run_case(context, 'corner', 'plane_strain', 'j2', supports('plane_strain') + """
&boundary name = 'top' kind = 'velocity' group = 'TOP' components = 'y' velocity = 0, 3, 0 /
&boundary name = 'side' kind = 'velocity' group = 'RIGHT' velocity = -1.66, 3, 0 components = 'x' /
&step duration = 1 increments = 20 /
""")
    yield row
    for law in ('elastic', 'j2'):
        history, row = run_case(context, f'sudden_{law}', '3d', law, supports('3d') + """
&boundary name = 'top' kind = 'traction' group = 'ZMAX' traction = 20, 0, 203 /
&step duration = 1 increments = 2 /
""")
        yield row


def along(volume, value):
    """A vector along the axis of the billet."""
    return f'0, 0, {value}' if volume else f'0, {value}, 0'


def quarter_cylinder(x, y, z):
    """The unit square becomes a quarter of a disc, its sides x = 0 and y = 0 remain."""
    return (10 * x * math.sqrt(1 - y**2 / 2), 10 * y * math.sqrt(1 - x**2 / 2), HEIGHT * z)
