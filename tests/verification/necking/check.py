"""Necking of a bar (input/bar_tension): largest force and the elongation where it occurs.

Considere: the force of a homogeneous bar is largest where d sigma/d e = sigma, here at e =
0.122074, sigma = 697.23 MPa: 79.73 kN for a radius of 6.413 mm, at an elongation of 7.128 mm with
elasticity.

A prism whose end is free to contract is homogeneous up to there. With elasticity everywhere, the
section included, F = sigma A0 exp((1 - 2 nu) sigma/E - e), e = ep + sigma/E, has its maximum at
79.576 kN and 7.120 mm, found here on ep. Force by the section within 1e-5: steps of 0.0035 in
strain, order 2; the elongation, where the force is flat, within 0.1 %.

The input: its mesh is an imperfection, with a section 0.5 % smaller than the circle that varies
along the bar, and its clamped ends hold a radius of bar back, so the neck starts early: the force
within 1 %, the elongation can only be smaller (5.94 mm; 6.66 mm on that mesh with a free end).

Both are followed to 0.65 of the time of the input, past the maximum, which is that of the parabola
through three increments. One eighth is computed: four times its force, twice its elongation.
"""
import math

FORCE, ELONGATION = 79.73e3, 7.128
RADIUS, HALF_LENGTH = 6.413, 26.667
WHOLE = 'duration = 1\n  increments = 70\n'
CLAMPED = "kind = 'velocity'\n"


def run(context):
    source = context.root / 'input' / 'bar_tension'
    context.make_mesh((source / 'bar_tension.geo').read_text(encoding='utf-8'), 3, 'bar_tension')
    text = (source / 'bar_tension.nml').read_text(encoding='utf-8')
    if WHOLE not in text or CLAMPED not in text:
        raise RuntimeError('input/bar_tension is not the one this case knows')
    text = text.replace(WHOLE, 'duration = 0.65\n  increments = 65\n')
    text += "&output every = 65 fields = 'displacement' /\n"

    context.box('prism', 2, 2, 4, quarter_cylinder)
    prism = text.replace(CLAMPED, CLAMPED + "  components = 'z'\n").replace('bar_tension', 'prism')
    for name, group in (('bar', 'BODY'), ('x0', 'XMIN'), ('y0', 'YMIN'), ('z0', 'ZMIN'),
                        ('end', 'ZMAX')):
        prism = prism.replace(f"group = '{name}'", f"group = '{group}'")
    elongation, force, _ = pull(context, 'prism', prism)
    largest, at = considere()
    yield context.row('homogeneous: largest force by the section', force, largest, 1e-5)
    yield context.row('homogeneous: elongation at the largest force', elongation, at, 0.001)

    elongation, force, last = pull(context, 'bar_tension', text, by_section=False)
    yield context.row('input: largest force', force, FORCE, 0.01)
    yield context.below('input: elongation at the largest force', elongation, ELONGATION)
    yield context.below('input: force after the neck by the largest', last / force, 0.95)


def considere():
    """Largest force of a homogeneous bar, and its elongation there."""
    young, poisson = 206900.0, 0.29

    def state(plastic):
        stress = 450 + 129.24 * plastic + 265 * (1 - math.exp(-16.93 * plastic))
        strain = plastic + stress / young
        section = math.pi * RADIUS**2 * math.exp((1 - 2 * poisson) * stress / young - strain)
        return stress * section, 2 * HALF_LENGTH * (math.exp(strain) - 1)

    return max(state(1e-6 * i) for i in range(90000, 150000))


def pull(context, name, text, by_section=True):
    """Elongation at the largest force, that force, and the force at the end; by the section of the
    mesh times that of the circle if wanted."""
    history = context.run_swage(text + '&solver tolerance = 1e-6 /\n', name=name).history
    factor = 4.0
    if by_section:
        factor = math.pi * RADIUS**2 / (history['volume'][0] / HALF_LENGTH)
    force = [factor * value for value in history['reaction_end_z']]
    elongation, largest = top([2 * value for value in history['displacement_end_z']], force)
    return elongation, largest, force[-1]


def quarter_cylinder(x, y, z):
    """The unit square becomes a quarter of a disc, its sides x = 0 and y = 0 remain."""
    return (RADIUS * x * math.sqrt(1 - y**2 / 2), RADIUS * y * math.sqrt(1 - x**2 / 2),
            HALF_LENGTH * z)


def top(x, y):
    """Place and height of the top of the parabola through the largest value and its neighbours,
    at equal distances."""
    i = y.index(max(y))
    before, largest, after = y[i - 1:i + 2]
    shift = 0.5 * (before - after) / (before - 2 * largest + after)
    return x[i] + shift * (x[i + 1] - x[i]), largest - 0.25 * (before - after) * shift
