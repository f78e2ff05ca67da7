"""Hertz's contact of a ball and of a roller with a rigid plane (input/hertz).

Radius 10 mm, E = 210 GPa, nu = 0.3, E* = E/(1 - nu^2). The ball under P = 1000 N:

  a = (3 P R/(4 E*))^(1/3) = 0.31913 mm,  p0 = 3 P/(2 pi a^2) = 4688.34 MPa,  approach a^2/R

the roller under F = 1000 N/mm: a = 2 (F R/(pi E*))^(1/2) = 0.23489 mm, p0 = 2 F/(pi a) = 2710.28;
both with the pressure p0 (1 - (x/a)^2)^(1/2).

Meshes of the input with cells of a/5, a/10 and a/20 at the contact, geometry updated, the default
penalty. The half-width lies between the last node that touches and the next one, and may miss a by
one cell. Peak pressure 3 % at a/10, both that of the node in the middle and the largest. The
profile, rms over the nodes up to 0.9 a by p0: 1 % at a/10, 0.5 % at a/20, of order 1 as a pressure
until Hertz's own error shows (a/R = 0.03, strains of 2 %): 0.1 % of the roller. Approach: 2 %, as
a/R. Penetration, which a penalty needs, below 1 % of the approach.

Inside the ball, nu = 0.3: the largest von Mises stress is 0.620 p0, 0.481 a below the surface:
from the stresses on the axis, sigma_z = -p0/(1 + s^2), sigma_r = p0 (1/(2 (1 + s^2)) - (1 + nu)(1 -
s arctan(1/s))) at the depth s a. 2 % and one cell, at a/20.
"""
import math

import numpy

RADIUS, MODULUS = 10.0, 210000.0 / (1 - 0.3**2)
LOAD = 1000.0
TRIANGLE = 5


def run(context):
    width = (3 * LOAD * RADIUS / 4 / MODULUS)**(1 / 3)
    peak = 3 * LOAD / (2 * math.pi * width**2)
    yield from press(context, 'hertz', 'ball', width, peak)
    width = 2 * math.sqrt(LOAD * RADIUS / math.pi / MODULUS)
    yield from press(context, 'hertz_line', 'roller', width, 2 * LOAD / (math.pi * width))


def press(context, case, title, width, peak):
    """One of the two, on three meshes."""
    source = context.root / 'input' / 'hertz'
    geometry = (source / f'{case}.geo').read_text(encoding='utf-8')
    text = (source / f'{case}.nml').read_text(encoding='utf-8')
    errors = {}
    for n in (5, 10, 20):
        size = width / n
        name = f'{title}_{n}'
        context.make_mesh(replaced(geometry, {'h = 0.016': f'h = {size!r}'}), 2, name)
        # The force of the plane is what is prescribed as far as Newton goes
        done = context.run_swage(replaced(text, {f"'{case}.msh'": f"'{name}.msh'"})
                                 + '&solver tolerance = 1e-7 /\n', name=name)
        step = done.results().step(-1)
        x, pressure = skin(step)
        inner = abs(x) < 0.9 * width
        exact = peak * numpy.sqrt(1 - (x[inner] / width)**2)
        errors[n] = math.sqrt(((pressure[inner] - exact)**2).mean()) / peak
        if n == 10:
            yield from compare(context, f'{title}, h a/{n}', done.history, x, pressure, width, peak,
                               size)
        if n == 20 and case == 'hertz':
            yield from inside(context, step, width, peak, size)
    for n, tolerance in ((10, 0.01), (20, 0.005)):
        yield context.zero(f'{title}, h a/{n}: profile, rms by p0', errors[n], tolerance)
    yield context.order(f'{title}: order of the profile, h a/5 to a/10', (1 / 5, 1 / 10),
                        (errors[5], errors[10]), 1.0, 0.1)


def skin(step):
    """Places and contact pressures of the nodes of the circle, in the order of x."""
    node = numpy.unique(step.cells[TRIANGLE])
    drawn = (step.points - step.point_fields['displacement'])[node] - (0, RADIUS, 0)
    node = node[abs(numpy.linalg.norm(drawn, axis=1) - RADIUS) < 1e-6 * RADIUS]
    node = node[numpy.argsort(step.points[node, 0])]
    return step.points[node, 0], step.point_fields['contact_pressure'].ravel()[node]


def compare(context, title, history, x, pressure, width, peak, size):
    """The nodes of the skin, in the order of x."""
    last = numpy.flatnonzero(pressure > 0).max()
    yield context.row(f'{title}: half-width', (x[last] + x[last + 1]) / 2, width, size,
                      absolute=True)
    yield context.row(f'{title}: pressure in the middle', pressure[abs(x).argmin()], peak, 0.03)
    yield context.row(f'{title}: largest pressure', pressure.max(), peak, 0.03)
    approach = -history['displacement_equator_y'][-1]
    yield context.row(f'{title}: force of the plane', -history['force_plane_y'][-1], LOAD, 1e-6)
    if title.startswith('ball'):
        yield context.row(f'{title}: approach', approach, width**2 / RADIUS, 0.02)
    yield context.below(f'{title}: penetration by the approach',
                        history['penetration_touch'][-1] / approach, 0.01)


def inside(context, step, width, peak, size):
    """The largest von Mises stress and its depth."""
    def stress(s):
        along = -1 / (1 + s**2)
        across = 1 / (2 * (1 + s**2)) - 1.3 * (1 - s * math.atan(1 / s))
        return abs(across - along)

    deepest = max(range(1, 2000), key=lambda i: stress(i / 1000)) / 1000
    cells = step.cells[TRIANGLE]
    found = step.cell_fields['equivalent_stress'].ravel()[step.numbers[TRIANGLE]]
    largest = found.argmax()
    depth = step.points[cells[largest], 1].mean()
    yield context.row('ball, h a/20: largest von Mises stress by p0', found[largest] / peak,
                      stress(deepest), 0.02)
    yield context.row('ball, h a/20: its depth by a', depth / width, deepest, size / width,
                      absolute=True)


def replaced(text, words):
    """Every word must be there: else the input is not the one this case knows."""
    for old, new in words.items():
        if old not in text:
            raise RuntimeError(f'input/hertz does not have {old}')
        text = text.replace(old, new)
    return text
