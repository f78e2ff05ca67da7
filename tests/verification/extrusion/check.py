"""Extrusion through conical dies: the steady pressure between ideal work and Avitzur's bound.

A billet of radius 15 mm in a frictionless container is pushed through a cone of half angle a to the
radius Rf, friction m Y/sqrt(3) on the cone; perfectly plastic, E/Y = 1000. The edges of the die are
rounded, 2.5 mm, two cells and more; behind the narrowest place it recedes. The billet fills the die
from the start, so that the flow is steady at once. Its cells are flat in the billet, for the flow
stretches them, and cut all one way: with diagonals that alternate, every other node of the rod's
surface lies up to 0.8 % of the radius inside. Pressure p of the rear by Y, mean of the last two
thirds of the stroke:

  2 ln(R0/Rf) < p/Y <= 2 f(a) ln(R0/Rf) + 2/sqrt(3) [a/sin(a)^2 - cot(a) + m cot(a) ln(R0/Rf)],

the ideal work, and the power of Avitzur's spherical flow, f(a) by quadrature here.

Spherical flow bends all metal at two surfaces; bent on a longer way, while it is drawn out, metal
costs less: the cells find 10 to 14 % less, on 12 and 24 cells by the radius alike (within 1 %; the
ripple of the force, nodes that pass the rounded exit, below 2 %). What friction adds at 15 degrees
must be that of the bound, for the slip on the cone is the same: within 10 %, of which the rounded
ends of the cone are some. The rod has the radius of the die within 0.2 %, mass is conserved.

Coated: the billet's core and its coat, three times as hard, are one mesh of two materials. Its
pressure lies between ideal work by the rule of mixtures, 2 ln(R0/Rf) sum f_i Y_i, and Avitzur's
power of a billet that is hard throughout. Materials that leave bonded keep their shares of the
section, so the interface in the rod has the radius Rf sqrt(f_core), to 1 %; the volumes keep theirs
to 1e-3, and the interface stays one line from end to end. Metal that lay in the cone at the start
has had no coat drawn out over it: there the core expands, and necks in front of that.
"""
import math

import numpy

# Radius of the core by that of the billet, and yield stresses of both
CORE = 0.75
STRESSES = {'core': 100.0, 'coat': 300.0}

RADIUS, FILLET, RELIEF = 15.0, 2.5, math.radians(5)
REAR, FRONT = 10.0, 8.0
YIELD_STRESS = 200.0
# R0/Rf, half angle in degrees, m
ROWS = ((1.5, 15, 0.0), (1.5, 15, 0.1), (1.5, 30, 0.1), (2.0, 30, 0.0))

CASE = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' /
&mesh file = '{mesh}.msh' /
{bodies}
&boundary name = 'rear' kind = 'velocity' group = 'BOTTOM' components = 'y' velocity = 0, 10 /
&tool name = 'container' shape = 'cylinder' radius = 15 side = 'inside' /
&tool name = 'die' shape = 'profile' points = {points} fillets = 0, 2.5, 2.5, 0 side = 'left' /
&friction name = 'constant' kind = 'tresca' tresca_factor = {factor} regularisation_velocity = 0.1 /
&contact name = 'wall' slave = 'RIGHT' master = 'container' /
&contact name = 'cone' slave = 'RIGHT' master = 'die' friction = 'constant' /
&step duration = {duration} increments = {steps} /
&output every = {steps} double_precision = .true. /
"""


BODY = """
&body name = '{name}' material = '{name}' group = '{group}' /
&material name = '{name}' law = 'j2' young = {young} poisson = 0.3 flow_stress = '{name}' /
&flow_stress name = '{name}' kind = 'linear' yield_stress = {stress} hardening_modulus = 0 /
"""
SINGLE = BODY.format(name='metal', group='BODY', young=200000, stress=YIELD_STRESS)
DOUBLE = ''.join(BODY.format(name=name, group=name, young=1000 * stress, stress=stress)
                 for name, stress in STRESSES.items())


def run(context):
    pressures = {}
    for cells in (12,) if context.quick else (12, 24):
        for row in ROWS:
            ratio, angle, factor = row
            title = f'{cells} cells, R0/Rf = {ratio}, {angle} degrees, m = {factor}'
            pressure, ripple, done = extrude(context, cells, *row)
            yield context.above(f'{title}: p/Y above the ideal', pressure, 2 * math.log(ratio))
            yield context.below(f'{title}: p/Y below the bound', pressure, bound(*row))
            yield context.below(f'{title}: ripple of p/Y', ripple, 0.02)
            yield context.below(f'{title}: radius of the rod by that of the die, less 1',
                                unevenness(done, ratio, angle), 0.002)
            yield context.below(f'{title}: mass error',
                                max(abs(value) for value in done.history['mass_error']), 1e-4)
            if row in pressures:
                yield context.row(f'{title}: p/Y against 12 cells', pressure, pressures[row], 0.01)
            pressures[row] = pressure
        friction = pressures[ROWS[1]] - pressures[ROWS[0]]
        yield context.row(f'{cells} cells, R0/Rf = 1.5, 15 degrees: p/Y of m = 0.1 less that of 0',
                          friction, bound(*ROWS[1]) - bound(*ROWS[0]), 0.1)
        yield from coated(context, cells)


def coated(context, cells, ratio=1.2, angle=30):
    """Two materials on one mesh, without friction."""
    title = f'{cells} cells, coated, R0/Rf = {ratio}, {angle} degrees'
    pressure, ripple, done = extrude(context, cells, ratio, angle, 0.0, bodies=DOUBLE, stroke=12.0,
                                     name_cell=lambda x, y: 'core' if x < CORE * RADIUS * width(
                                         y, ratio, angle) else 'coat')
    mixed = CORE**2 * STRESSES['core'] + (1 - CORE**2) * STRESSES['coat']
    pressure *= YIELD_STRESS
    yield context.above(f'{title}: pressure above the ideal', pressure,
                        2 * math.log(ratio) * mixed)
    yield context.below(f'{title}: pressure below the bound', pressure,
                        bound(ratio, angle, 0.0) * STRESSES['coat'])
    yield context.below(f'{title}: ripple of the pressure', ripple, 0.02)

    step = done.results().step(-1)
    drawn = step.points - step.point_fields['displacement']
    corners, body = step.cells[5], step.cell_fields['body'][step.numbers[5]]
    shares = [[ring_volume(x, corners[body == k]) for k in (1, 2)] for x in (drawn, step.points)]
    fractions = [volumes[0] / sum(volumes) for volumes in shares]
    yield context.row(f'{title}: share of the core in the volume', fractions[1], fractions[0],
                      1e-3)
    for k, name in enumerate(STRESSES):
        yield context.row(f'{title}: volume of the {name}', shares[1][k], shares[0][k], 1e-3)

    edges = interface(corners, body)
    nodes, times = numpy.unique(edges, return_counts=True)
    yield context.zero(f'{title}: ends of the interface, less two', abs(sum(times == 1) - 2), 0)
    yield context.zero(f'{title}: places where it branches', sum(times > 2), 0)
    nodes = nodes[numpy.argsort(drawn[nodes, 1])]
    yield context.above(f'{title}: it runs from end to end, least rise',
                        min(numpy.diff(step.points[nodes, 1])), 0)
    began, ends = drawn[nodes, 1], step.points[nodes, 1]
    _, _, narrowest = die(ratio, angle)
    # What began in the cone is the front, that never flowed steadily
    left = ends > narrowest + FILLET
    radii = step.points[nodes, 0]
    steady = numpy.mean(radii[left & (began < -FILLET)])
    yield context.row(f'{title}: radius of the interface in the rod', steady, CORE * RADIUS / ratio,
                      0.01)
    cone = left & (began > -FILLET) & (began < narrowest)
    widest = numpy.argmax(numpy.where(cone, radii, 0))
    yield context.above(f'{title}: the core expands, widest place by the steady radius',
                        radii[widest] / steady, 1.02)
    yield context.below(f'{title}: and necks in front of it, narrowest by the steady radius',
                        min(radii[widest:]) / steady, 0.998)


def ring_volume(points, corners):
    """Of the rings that triangles (radius, height) sweep."""
    a, b, c = (points[corners[:, k]] for k in range(3))
    area = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    return 2 * math.pi * numpy.sum(area * (a + b + c)[:, 0] / 3)


def interface(corners, body):
    """Edges between cells of two bodies."""
    found = {}
    for cell, owner in zip(corners, body):
        for k in range(3):
            found.setdefault(tuple(sorted((cell[k], cell[k - 1]))), set()).add(owner)
    return numpy.array([edge for edge, owners in found.items() if len(owners) == 2])


def width(height, ratio, angle):
    """Radius of the die at a height, by that of the container."""
    return die(ratio, angle)[1](height) / RADIUS


def extrude(context, cells, ratio, angle, factor, bodies=SINGLE, name_cell=None, stroke=2.0):
    """Mean of p/Y, half of its range by the mean, and the run."""
    name = f'billet_{cells}_{ratio}_{angle}_{factor}'
    corners, wall, narrowest = die(ratio, angle)
    rear = REAR + stroke - 2
    length = rear + narrowest + FRONT
    flat = 3 if ratio < 2 else 4

    def place(x, y):
        height = -rear + length * y
        return x * wall(height), height

    context.rectangle(name, cells, round(flat * cells * length / RADIUS), place,
                      name_cell=name_cell)
    points = ', '.join(repr(value) for corner in corners for value in corner)
    done = context.run_swage(CASE.format(mesh=name, points=points, factor=factor,
                                         bodies=bodies, duration=stroke / 10,
                                         steps=round(20 * stroke) * cells // 12), name=name)
    force = done.history['reaction_rear_y']
    steady = numpy.array(force[len(force) // 3:]) / (YIELD_STRESS * math.pi * RADIUS**2)
    mean = numpy.mean(steady)
    return mean, (steady.max() - steady.min()) / (2 * mean), done


def die(ratio, angle):
    """Corners of the die, its radius at a height, and the height of the narrowest place.

    The cone begins at the height 0. The first segment leans away from the container's wall, which
    alone guides the metal there; the last one recedes.
    """
    a, narrow = math.radians(angle), RADIUS / ratio
    cut = FILLET * math.tan(a / 2)
    sharp = (RADIUS - narrow) / math.tan(a)
    narrowest = sharp + cut
    # The last fillet touches cone and relief, its centre at the height of the narrowest place
    middle, reach = (a - RELIEF) / 2, FILLET / math.cos((a + RELIEF) / 2)
    edge = (narrow + FILLET - reach * math.cos(middle), narrowest - reach * math.sin(middle))
    corners = [(RADIUS + 0.2, -20.0), (RADIUS, 0.0), edge,
               (edge[0] + 5 * math.sin(RELIEF), edge[1] + 5 * math.cos(RELIEF))]

    def wall(height):
        if height <= -cut:
            return RADIUS
        if height <= cut * math.cos(a):
            return RADIUS - FILLET + math.sqrt(FILLET**2 - (height + cut)**2)
        if height < sharp - cut * math.cos(a):
            return RADIUS - height * math.tan(a)
        if height < narrowest:
            return narrow + FILLET - math.sqrt(FILLET**2 - (height - narrowest)**2)
        return narrow

    return corners, wall, narrowest


def unevenness(done, ratio, angle):
    """Of the surface drawn inside of the cone that has left the die."""
    _, wall, narrowest = die(ratio, angle)
    step = done.results().step(-1)
    drawn = step.points - step.point_fields['displacement']
    radii = [step.points[i, 0] for i in numpy.unique(step.cells[5])
             if abs(drawn[i, 0] - wall(drawn[i, 1])) < 1e-6 and drawn[i, 1] < narrowest
             and step.points[i, 1] > narrowest + FILLET]
    return max(abs(radius * ratio / RADIUS - 1) for radius in radii)


def bound(ratio, angle, factor):
    """p/Y of Avitzur's spherical flow."""
    a = math.radians(angle)
    angles = a * (numpy.arange(2000) + 0.5) / 2000
    share = numpy.mean(numpy.sin(angles) * numpy.sqrt(1 - 11 / 12 * numpy.sin(angles)**2)) * a
    spread = 2 * share / math.sin(a)**2
    return 2 * spread * math.log(ratio) + 2 / math.sqrt(3) * (
        a / math.sin(a)**2 - 1 / math.tan(a) + factor / math.tan(a) * math.log(ratio))
