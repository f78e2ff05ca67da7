"""Upsetting of discs with friction: mean pressure against the upper bound and the slab.

Discs of d/h = 2, 4, 8 between flat tools, half of the height, rigid and perfectly plastic in the
limit: E/Y = 1e5, shortened by 0.1 %, of which elasticity is a hundredth. The mean pressure by Y is
between that of homogeneous work, 1, and of the field that slides without bulging,

  1 + m d/(3 sqrt(3) h), friction m k constant (Siebel; Avitzur's disc),

an upper bound. At m <= 0.3 the true field is near it: 3 %. At m = 0.5 and 1 it is not, and only the
bounds hold. For Coulomb friction the slab, 2 (e^x - 1 - x)/x^2, x = mu d/h, is no bound but has the
same field: 3 % as well. mu = 0.2 at d/h = 8 is left out: k would limit friction in the middle.

d/h is that of the section and height at the end. Friction counts fully from a hundredth of the
radius on: `regularisation_velocity` is a thousandth of the tool's. Cells twice as large change the
mean pressure by less than 0.2 % at m <= 0.3. The same limit by a viscous material without
elasticity, exponent of the rate 0.01: 0.1 %.
"""
import math

YIELD_STRESS = 2.0
RADIUS = 10.0
REDUCTION = 0.001

CASE = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' /
&mesh file = '{mesh}.msh' /
&body name = 'disc' material = 'metal' group = 'BODY' /
&material name = 'metal' {law} /
&flow_stress name = 'perfect' kind = 'linear' yield_stress = 2 /
&boundary name = 'middle' kind = 'symmetry' group = 'BOTTOM' /
&tool name = 'upper' shape = 'plane' point = 0, {height}, 0 normal = 0, -1, 0 motion = 'press' /
&motion name = 'press' velocity = 0, {velocity}, 0 /
&friction name = 'rough' {friction} regularisation_velocity = {slip} /
&contact name = 'top' slave = 'TOP' master = 'upper' friction = 'rough' /
&step duration = 1 increments = 4 /
&output every = 4 fields = 'displacement' /
"""
PLASTIC = "law = 'j2' young = 2e5 poisson = 0.3 flow_stress = 'perfect'"


def run(context):
    for slenderness in (2, 4, 8):
        for n in (8, 16):
            context.rectangle(mesh(slenderness, n), n * max(1, slenderness // 4), n // 2,
                              lambda x, y: (RADIUS * x, RADIUS / slenderness * y))
        yield from shear(context, slenderness)
        for coefficient in (0.05, 0.1, 0.2)[:2 if slenderness == 8 else 3]:
            friction = f"kind = 'coulomb' coefficient = {coefficient}"
            pressure, at = upset(context, slenderness, 16, friction)
            x = coefficient * at
            yield context.row(f'd/h {slenderness}, mu {coefficient}: mean pressure by Y', pressure,
                              2 * (math.exp(x) - 1 - x) / x**2, 0.03)

    exponent = 0.01
    consistency = YIELD_STRESS / math.sqrt(3) / (math.sqrt(3) * REDUCTION)**exponent
    viscous, _ = upset(context, 2, 16, "kind = 'tresca' tresca_factor = 0.3 flow_stress = 2",
                       f"law = 'norton_hoff' consistency = {consistency!r} "
                       f'rate_sensitivity = {exponent} reference_rate = {REDUCTION}')
    plastic, _ = upset(context, 2, 16, "kind = 'tresca' tresca_factor = 0.3")
    yield context.row('d/h 2, m 0.3: viscous against plastic', viscous, plastic, 0.001)


def shear(context, slenderness):
    """Constant friction m k."""
    for factor in (0.1, 0.3, 0.5, 1.0):
        friction = f"kind = 'tresca' tresca_factor = {factor}"
        coarse, _ = upset(context, slenderness, 8, friction)
        pressure, at = upset(context, slenderness, 16, friction)
        bound = 1 + factor * at / 3 / math.sqrt(3)
        title = f'd/h {slenderness}, m {factor}: mean pressure by Y'
        yield context.above(title, pressure, 1)
        yield context.below(title, pressure, bound)
        if factor <= 0.3:
            yield context.row(title, pressure, bound, 0.03)
            yield context.row(f'{title}, cells twice as large', coarse, pressure, 0.002)


def mesh(slenderness, n):
    return f'disc_{slenderness}_{n}'


def upset(context, slenderness, n, friction, law=PLASTIC):
    """Mean pressure by the yield stress, and diameter by height, at the end."""
    height = RADIUS / slenderness
    speed = REDUCTION * height
    history = context.run_swage(CASE.format(
        mesh=mesh(slenderness, n), law=law, height=height, velocity=-speed, slip=0.001 * speed,
        friction=friction), name=mesh(slenderness, n)).history
    height += history['position_upper_y'][-1]
    section = history['volume'][-1] / height
    return (history['force_upper_y'][-1] / section / YIELD_STRESS,
            math.sqrt(section / math.pi) / height)
