"""Rolling: bite at the entry angle, neutral point, forward slip and roll force.

A plate of 4 mm in plane strain, perfectly plastic, upper half, against a roll of radius 100 mm that
leaves 2.8 mm, turning with a surface speed of 100 mm/s. The corner of the plate touches the roll at
the angle a where it is drawn, cos a = 1 - 1.2/200, tan a = 0.1100, and is pressed against it by P =
0.05 N/mm at the rear, 1e-4 of the plate's yield force. Coulomb friction mu.

Bite: the roll pulls the corner in when mu > tan a. Just below, mu = tan a/1.03, the plate must rest
while the roll slips, under the force of the roll that balances P at the corner's angle, P/(tan a -
mu) (cos a + mu sin a)/cos a: within 1 %, the share of the slip rate's regularisation and of what the
corner yields. Just above, mu = 1.03 tan a, the plate must go with the roll.

Steady rolling, mu = 0.2 and, a millimetre after the bite, 1.03 tan a: against the slabs of von Karman with constant mu, integrated here, the
vertical pressure and the horizontal one differing by 2 k. Slabs stay plane, the metal does not: the
contact is 3.2 mean thicknesses long. Limits: angle of the neutral point, where friction changes
sign, within 0.03 of that of the whole arc; roll force within 3 %; forward slip within 0.015 of the
roll's speed (slabs neglect that the surface lags or leads). Friction changes its sign once, and is
mu times the pressure away from there: within 1 %, the regularisation's share where the slip is 7 %
of the roll's speed and more. Forces along the plate are in equilibrium with P.

The first millimetre takes small increments: the pressure, and with it the pull, grows with the
corner's way into the roll, and only the falling friction of slow slip holds the plate back.
"""
import math

import numpy

RADIUS, ENTRY, EXIT = 100.0, 4.0, 2.8
SPEED, PUSH, SHEAR = 100.0, 0.05, 200 / math.sqrt(3)
ANGLE = math.acos(1 - (ENTRY - EXIT) / (2 * RADIUS))

CASE = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = '{mesh}.msh' /
&body name = 'plate' material = 'metal' group = 'BODY' /
&material name = 'metal' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'perfect' /
&flow_stress name = 'perfect' kind = 'linear' yield_stress = 200 hardening_modulus = 0 /
&boundary name = 'middle' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'rear' kind = 'traction' group = 'LEFT' traction = 0.025, 0 /
&tool name = 'roll' shape = 'cylinder' axis_point = 0, 101.4, 0 radius = 100 motion = 'turn' /
&motion name = 'turn' axis_point = 0, 101.4, 0 axis_direction = 0, 0, 1 angular_velocity = 1 /
&friction name = 'dry' kind = 'coulomb' coefficient = {friction!r} regularisation_velocity = 1 /
&contact name = 'gap' slave = 'TOP', 'RIGHT' master = 'roll' friction = 'dry' /
&step duration = 0.01 increments = 100 /
{more}
&output every = {every} double_precision = .true. /
"""


def run(context):
    plate(context, 'short', 6, 8.0)
    limit = math.tan(ANGLE)
    for friction in (limit / 1.03, 1.03 * limit):
        done = roll(context, 'short', friction, 'below' if friction < limit else 'above')
        moved = done.history['displacement_rear_x'][-1]
        if friction > limit:
            yield context.above('mu = 1.03 tan a: way of the plate by that of the roll', moved, 0.8)
            continue
        yield context.below('mu = tan a/1.03: way of the plate by that of the roll', moved, 0.01)
        end = done.results().step(-1)
        corner = numpy.flatnonzero(end.point_fields['contact_pressure'].ravel() > 0)
        yield context.row('mu = tan a/1.03: nodes that touch', len(corner), 1, 0)
        slope = math.tan(math.asin(-end.points[corner[0], 0] / RADIUS))
        yield context.row('mu = tan a/1.03: force on the resting corner [N/mm]',
                          done.history['force_roll_y'][-1],
                          PUSH * (1 + friction * slope) / (slope - friction), 0.01)
    for layers, friction in ((6, 0.2), (6, 1.03 * limit), (12, 0.2))[:1 if context.quick else 3]:
        plate(context, f'long_{layers}', layers, 22.0)
        count = 60 * layers
        done = roll(context, f'long_{layers}', friction, f'steady_{layers}_{friction:.2f}', count,
                    f'&step duration = 0.13 increments = {2 * count // 3} /\n'
                    f'&step duration = 0.06 increments = {count // 3} /')
        yield from steady(context, done, friction, f'{layers} layers, mu = {friction:.3f}')


def plate(context, name, layers, length):
    """The upper half, its corner on the roll."""
    right = -RADIUS * math.sin(ANGLE)
    context.rectangle(name, round(2 * layers * length / ENTRY), layers,
                      lambda x, y: (right - length * (1 - x), ENTRY / 2 * y), 'alternating')


def roll(context, mesh, friction, name, count=100, more=''):
    return context.run_swage(CASE.format(mesh=mesh, friction=friction, every=max(1, count // 15),
                                         more=more), name=name)


def steady(context, done, friction, title):
    """The last step, six results while 6 mm of the roll's surface pass."""
    results, history = done.results(), done.history
    neutral, force, slip = slabs(friction)
    last = [arc(results.step(i)) for i in range(-6, 0)]
    since = [i for i, time in enumerate(history['time']) if time >= last[0]['time']]
    yield context.row(f'{title}: neutral point by the arc', mean(last, 'neutral') / ANGLE,
                      neutral / ANGLE, 0.03, absolute=True)
    yield context.row(f'{title}: changes of sign of the friction', max(
        step['changes'] for step in last), 1, 0)
    yield context.zero(f'{title}: friction by mu times pressure, less 1', max(
        abs(step['ratio'] / friction - 1) for step in last), 0.01)
    yield context.row(f'{title}: force of the roll [N/mm]', numpy.mean(
        [history['force_roll_y'][i] for i in since]), force, 0.03)
    yield context.row(f'{title}: forward slip', (last[-1]['front'] - last[0]['front'])
                      / (SPEED * (last[-1]['time'] - last[0]['time'])) - 1, slip, 0.015,
                      absolute=True)
    yield context.row(f'{title}: force along the plate by that of the roll', numpy.mean(
        [history['force_roll_x'][i] for i in since]) / force, PUSH / force, 1e-5, absolute=True)


def mean(steps, name):
    return sum(step[name] for step in steps) / len(steps)


def arc(step):
    """Friction along the contact of a result."""
    pressure = step.point_fields['contact_pressure'].ravel()
    nodes = numpy.flatnonzero(pressure > 0)
    nodes = nodes[numpy.argsort(step.points[nodes, 0])]
    x, along = step.points[nodes, 0], step.point_fields['friction_traction'][nodes, 0]
    change = numpy.flatnonzero(along[:-1] * along[1:] <= 0)
    i = change[0]
    x_neutral = x[i] + (x[i + 1] - x[i]) * along[i] / (along[i] - along[i + 1])
    size = numpy.linalg.norm(step.point_fields['friction_traction'][nodes], axis=1)
    outer = abs(x - x_neutral) > 0.3 * RADIUS * ANGLE
    return {'time': step.time, 'neutral': math.asin(-x_neutral / RADIUS), 'changes': len(change),
            'ratio': numpy.mean((size / pressure[nodes])[outer]),
            'front': step.points[numpy.unique(step.cells[5]), 0].max()}


def slabs(friction, count=4000):
    """Angle of the neutral point, force of the roll and forward slip of plane slabs.

    With the horizontal pressure q, vertical q + 2 k, and p on the roll, at the angle f from the
    exit: d(h q)/df = 2 R p (sin f +- mu cos f), q + 2 k = p (1 -+ mu tan f), above after the
    neutral point, below before it; q = 0 at both ends.
    """
    step = ANGLE / count

    def thickness(angle):
        return EXIT + 2 * RADIUS * (1 - math.cos(angle))

    def vertical(sign, angle, step):
        def slope(angle, product):
            pressure = (product / thickness(angle) + 2 * SHEAR) / (
                1 - sign * friction * math.tan(angle))
            return 2 * RADIUS * pressure * (math.sin(angle) + sign * friction * math.cos(angle))

        product, found = 0.0, [2 * SHEAR]
        for _ in range(count):
            middle = product + step / 2 * slope(angle, product)
            product += step * slope(angle + step / 2, middle)
            angle += step
            found.append(product / thickness(angle) + 2 * SHEAR)
        return numpy.array(found)

    after, before = vertical(1, 0.0, step), vertical(-1, ANGLE, -step)[::-1]
    neutral = step * numpy.flatnonzero(after >= before)[0]
    angles = step * numpy.arange(count + 1)
    pressure = numpy.minimum(after, before) * RADIUS * numpy.cos(angles)
    force = step * (numpy.sum(pressure) - (pressure[0] + pressure[-1]) / 2)
    return neutral, force, thickness(neutral) * math.cos(neutral) / EXIT - 1
