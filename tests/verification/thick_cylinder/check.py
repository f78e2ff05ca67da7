"""Thick cylinder under internal pressure, plane strain, perfectly plastic: plastic radius, limit.

a = 100 mm, b = 200 mm, E = 210 GPa, nu = 0.3, Y = 240 MPa, k = Y/sqrt(3), `geometry = 'fixed'`. The
elastic displacement of the outside, 2 (1 - nu^2) p a^2 b/(E (b^2 - a^2)), is exact: 0.057778 at p =
100. Beyond p = 103.92, with the plastic zone up to the radius c,

  p = k (2 ln(c/a) + 1 - (c/b)^2),   p(c = b) = 2 k ln(b/a) = 192.091

and u(b) = 2 k c^2 (1 - nu^2)/(E b), of a Tresca material of the same k (Hill); both hold for von
Mises up to the elastic compressibility, 0.5 to 1 %: tolerance 2 %.

Limit load: a mesh carries at least p_lim, for its collapse is one of the motions of the solid, and
not 0.5 % more. The pressure rises until the outside runs away, then until no increment converges:
both within 0.5 %.

Elastic, u(b) is of order 2 in the size of the cells: 0.2 % at n = 16. The first ramp has 20
increments, for the grad-div term takes the pressure of the start of one: 3e-4 of u(b) in a single
increment.
"""
import math

import numpy
import swage_mesh_writer

BORE, OUTSIDE = 100.0, 200.0
YOUNG, POISSON, SHEAR_YIELD = 210000.0, 0.3, 240.0 / math.sqrt(3)
PRESSURES = (100, 120, 150, 180)
LIMIT = 2 * SHEAR_YIELD * math.log(OUTSIDE / BORE)
#: Displacement of the outside [mm] of which most is collapse: 0.24 at c = b.
COLLAPSED = 1.0
TRIANGLE = 5

CASE = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' geometry = 'fixed' /
&mesh file = 'quarter_{n}.msh' /
&body name = 'tube' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 210000 poisson = 0.3 flow_stress = 'perfect' /
&flow_stress name = 'perfect' kind = 'linear' yield_stress = 240 /
&boundary name = 'x' kind = 'symmetry' group = 'TOP' /
&boundary name = 'y' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'outside' kind = 'traction' group = 'RIGHT' traction = 0, 0, 0 /
&boundary name = 'bore' kind = 'pressure' group = 'LEFT' pressure = 1
  time = {times} factor = {pressures} /
{steps}
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
&output every = 1000 double_precision = .true.
  fields = 'displacement', 'stress', 'equivalent_plastic_strain' /
"""


def run(context):
    errors = {}
    for n in (8, 16, 32):
        context.rectangle(f'quarter_{n}', n, 2 * n, place)
        done = press(context, n, PRESSURES, (20, 4, 4, 4))
        results = done.results()
        states = [State(results.step(i)) for i in range(1, len(PRESSURES) + 1)]
        errors[n] = abs(states[0].outside / elastic_outside(PRESSURES[0]) - 1)
        if n == 16:
            yield from compare(context, n, states)
    for n in (8, 16):
        yield context.order(f'p 100: order of u(b), n {n} to {2 * n}', (1 / n, 0.5 / n),
                            (errors[n], errors[2 * n]), 2.0, 0.1)

    for n in (8, 16):
        done = press(context, n, (190, 1.01 * LIMIT), (5, 40), expect_exit=4)
        pressures = [190 + (1.01 * LIMIT - 190) * (time - 1) for time in done.history['time']]
        moved = done.history['displacement_outside_x']
        collapsed = next(p for p, u in zip(pressures, moved) if u > COLLAPSED)
        for what, p in (('u(b) beyond 1 mm', collapsed), ('no convergence', pressures[-1])):
            yield context.above(f'n {n}: pressure with {what}', p, LIMIT)
            yield context.below(f'n {n}: pressure with {what}', p, 1.005 * LIMIT)


def compare(context, n, states):
    """The states of a mesh of n layers against the closed forms."""
    for p, state in zip(PRESSURES, states):
        at = f'n {n}, p {p}'
        if p == 100:
            yield context.row(f'{at}: u(b)', state.outside, elastic_outside(p), 0.002)
            yield context.zero(f'{at}: plastic strain', state.plastic.max(), 0)
            continue
        radius = closed_radius(p)
        yield context.row(f'{at}: u(b)', state.outside,
                          2 * SHEAR_YIELD * radius**2 * (1 - POISSON**2) / YOUNG / OUTSIDE, 0.02)
        yield context.row(f'{at}: c', state.plastic_radius(), radius, 0.02)
        yield context.row(f'{at}: c by the volume', state.radius_by_volume(), radius,
                          radius * ((OUTSIDE / BORE)**(1 / n) - 1), absolute=True)


class State:
    """Cells and displacement of one result."""

    def __init__(self, step):
        corners = step.points[step.cells[TRIANGLE]]
        self.radius = numpy.linalg.norm(corners.mean(axis=1), axis=1)
        edges = corners[:, 1:] - corners[:, :1]
        self.area = abs(numpy.linalg.det(edges[:, :, :2]))
        fields = {name: values[step.numbers[TRIANGLE]] for name, values in step.cell_fields.items()}
        self.plastic = fields['equivalent_plastic_strain'].ravel()
        place = numpy.linalg.norm(step.points, axis=1)
        outside = place > OUTSIDE * (1 - 1e-6)
        moved = step.point_fields['displacement']
        self.outside = ((moved * step.points).sum(axis=1) / place)[outside].mean()

    def is_plastic(self):
        return self.plastic > 1e-3 * self.plastic.max()

    def plastic_radius(self):
        """Where the plastic strain, linear in r^-2, vanishes."""
        yielding = self.is_plastic()
        area = (BORE / self.radius[yielding])**2
        slope, constant = numpy.polyfit(area, self.plastic[yielding], 1)
        return BORE * (-slope / constant)**(1 / 2)

    def radius_by_volume(self):
        share = self.area[self.is_plastic()].sum() / self.area.sum()
        return (BORE**2 + share * (OUTSIDE**2 - BORE**2))**0.5


def press(context, n, pressures, increments, expect_exit=0):
    """Ramps from one pressure to the next."""
    pressures = [0, *pressures]
    return context.run_swage(CASE.format(
        n=n, times=', '.join(str(i) for i in range(len(pressures))),
        pressures=', '.join(str(p) for p in pressures),
        steps='\n'.join(f'&step duration = 1 increments = {count} maximum_cuts = 4 /'
                        for count in increments)), name=f'quarter_{n}_{len(increments)}',
        expect_exit=expect_exit)


def closed_radius(pressure):
    """Radius of the plastic zone, by bisection."""
    low, high = BORE, OUTSIDE
    for _ in range(100):
        radius = (low + high) / 2
        carried = SHEAR_YIELD * (2 * math.log(radius / BORE) + 1 - (radius / OUTSIDE)**2)
        low, high = (radius, high) if carried < pressure else (low, radius)
    return low


def elastic_outside(pressure):
    return 2 * (1 - POISSON**2) * pressure * BORE**2 * OUTSIDE / YOUNG / (OUTSIDE**2 - BORE**2)


def place(x, y):
    """Quarter of a ring, finer towards the bore."""
    radius, angle = BORE * (OUTSIDE / BORE)**x, math.pi / 2 * y
    return (radius * math.cos(angle) if y < 1 else 0.0, radius * math.sin(angle))
