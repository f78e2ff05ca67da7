"""Thick sphere under internal pressure, perfectly plastic: plastic radius, stresses, unloading.

a = 100 mm, b = 200 mm, E = 210 GPa, nu = 0.3, Y = 240 MPa, `geometry = 'fixed'`. Closed forms
(Hill): the pressure p at which the plastic zone reaches the radius c, the displacement of the
outside, and the hoop stress in the plastic zone are

  p = 2 Y ln(c/a) + (2 Y/3)(1 - (c/b)^3),   u(b) = Y c^3 (1 - nu)/(E b^2),
  sigma_theta(r) = Y - p + 2 Y ln(r/a);     p(c = a) = 140, p(c = b) = 332.71

Unloading is elastic up to twice the first: sigma_theta(a) falls by 5 p/7. Above, the bore yields in
reverse: up to a radius where p is that of a virgin sphere of twice the yield stress (102.4 mm at p
= 300), and sigma_theta = -Y - 2 Y ln(r/a) there (the elastic formula would give -274 at the bore).
All stress paths are radial, so the number of increments does not matter.

Meshes: a meridian section of n x 2 n, and an eighth in 3D of n layers, all finer towards the bore
in a geometric series. Stress and strain of a cell are constant; values at a radius come from all
plastic cells by the form of the closed solution with free coefficients: c is where the plastic
strain, linear in r^-3, vanishes, stress at the bore the constant of 1, ln(r/a) and, unloaded,
(a/r)^3 - 1. A plastic zone of less than a cell (p = 150) has no such profile; c by the volume of
the plastic cells is known to one cell.

Tolerances: u(b) 1 %, c 2 % and one cell, stress at the bore 1 % of Y. Order of u(b), its largest
error over the pressures: at least 1, that of a front which lies somewhere in a cell.
"""
import itertools
import math

import numpy
import swage_mesh_writer

BORE, OUTSIDE = 100.0, 200.0
YOUNG, POISSON, YIELD_STRESS = 210000.0, 0.3, 240.0
PRESSURES = (150, 200, 250, 300, 320)
TRIANGLE, TETRAHEDRON = 5, 10

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' geometry = 'fixed' /
&mesh file = '{mesh}.msh' /
&body name = 'shell' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 210000 poisson = 0.3 flow_stress = 'perfect' /
&flow_stress name = 'perfect' kind = 'linear' yield_stress = 240 /
{symmetry}
&boundary name = 'bore' kind = 'pressure' group = 'BORE' pressure = 1
  time = {times} factor = {pressures} /
{steps}
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
&output every = 1000 double_precision = .true.
  fields = 'displacement', 'stress', 'equivalent_plastic_strain' /
"""


def run(context):
    errors = {}
    for n in (8, 16, 32):
        write_section(context.folder / f'section_{n}.msh', n)
        states = load(context, f'section_{n}', 'axisymmetric', PRESSURES, 4)
        errors[n] = largest_error(PRESSURES, states)
        if n == 16:
            yield from compare(context, f'section, n {n}', PRESSURES, states, n)
    yield context.order('section: order of u(b), n 8 to 32', (1 / 8, 1 / 32),
                        (errors[8], errors[32]), 1.0, 0.05)
    yield from unload(context)

    pressures = (200, 250, 300)
    for n in (8, 16):
        write_octant(context.folder / f'octant_{n}.msh', n)
        states = load(context, f'octant_{n}', '3d', pressures, 1)
        errors[n] = largest_error(pressures, states)
    yield from compare(context, '3d, n 16', pressures, states, 16)
    yield context.order('3d: order of u(b), n 8 to 16', (1 / 8, 1 / 16), (errors[8], errors[16]),
                        1.0, 0.05)


def largest_error(pressures, states):
    """Of the displacement of the outside."""
    return max(abs(state.outside / closed_outside(p) - 1) for p, state in zip(pressures, states))


def compare(context, title, pressures, states, n):
    """The states of a mesh of n layers against the closed forms."""
    row = context.row
    for p, state in zip(pressures, states):
        radius, at = closed_radius(p), f'{title}, p {p}'
        yield row(f'{at}: u(b)', state.outside, closed_outside(p), 0.01)
        yield row(f'{at}: c by the volume', state.radius_by_volume(), radius,
                  cell_size(radius, n), absolute=True)
        if radius - BORE > cell_size(BORE, n):
            yield row(f'{at}: c', state.plastic_radius(), radius, 0.02)
            yield row(f'{at}: hoop stress at the bore', state.hoop_at_bore(), YIELD_STRESS - p,
                      0.01 * YIELD_STRESS, absolute=True)


def unload(context):
    """To no pressure from 200, 250 (elastic) and 300 (yields in reverse)."""
    for p in (200, 250, 300):
        loaded, free = load(context, 'section_32', 'axisymmetric', (p, 0), 4)
        yielding = free.plastic - loaded.plastic > 1e-6 * YIELD_STRESS / YOUNG
        title = f'section, n 32, unloaded from {p}'
        if p < 300:
            yield context.zero(f'{title}: cells that yield', yielding.sum(), 0)
            yield context.row(f'{title}: hoop stress at the bore', free.hoop_at_bore(unloaded=True),
                              YIELD_STRESS - p - 5 * p / 7, 0.01 * YIELD_STRESS, absolute=True)
        else:
            # As the virgin sphere of 2 Y
            radius = closed_radius(p, 2 * YIELD_STRESS)
            yield context.above(f'{title}: cells that yield', yielding.sum(), 1)
            yield context.row(f'{title}: radius of reverse yield', free.radius[yielding].max(),
                              radius, cell_size(radius, 32), absolute=True)
            at_bore = free.hoop + 2 * YIELD_STRESS * numpy.log(free.radius / BORE)
            yield context.row(f'{title}: hoop stress at the bore', at_bore[yielding].mean(),
                              -YIELD_STRESS, 0.01 * YIELD_STRESS, absolute=True)


class State:
    """Cells and displacement of one result; centroids and mean values of the sphere."""

    def __init__(self, step, kind):
        corners = step.points[step.cells[kind]]
        centre = corners.mean(axis=1)
        self.radius = numpy.linalg.norm(centre, axis=1)
        edges = corners[:, 1:] - corners[:, :1]
        if kind == TRIANGLE:
            self.volume = (2 * math.pi * centre[:, 0]
                           * abs(numpy.linalg.det(edges[:, :, :2])) / 2)
        else:
            self.volume = abs(numpy.linalg.det(edges)) / 6
        fields = {name: values[step.numbers[kind]] for name, values in step.cell_fields.items()}
        self.plastic = fields['equivalent_plastic_strain'].ravel()
        direction = centre / self.radius[:, None]
        xx, yy, zz, xy, yz, xz = fields['stress'].T
        x, y, z = direction.T
        self.radial = (xx * x**2 + yy * y**2 + zz * z**2
                       + 2 * (xy * x * y + yz * y * z + xz * x * z))
        # The mean of the two directions, in the section one of them is ZZ
        self.hoop = (xx + yy + zz - self.radial) / 2
        place = numpy.linalg.norm(step.points, axis=1)
        outside = place > OUTSIDE * (1 - 1e-6)
        moved = step.point_fields['displacement']
        self.outside = ((moved * step.points).sum(axis=1) / place.clip(1))[outside].mean()

    def is_plastic(self):
        return self.plastic > 1e-3 * self.plastic.max()

    def plastic_radius(self):
        """Where the plastic strain, linear in r^-3, vanishes."""
        yielding = self.is_plastic()
        volume = (BORE / self.radius[yielding])**3
        slope, constant = numpy.polyfit(volume, self.plastic[yielding], 1)
        return BORE * (-slope / constant)**(1 / 3)

    def radius_by_volume(self):
        share = self.volume[self.is_plastic()].sum() / self.volume.sum()
        return (BORE**3 + share * (OUTSIDE**3 - BORE**3))**(1 / 3)

    def hoop_at_bore(self, unloaded=False):
        yielding = self.is_plastic()
        relative = self.radius[yielding] / BORE
        forms = [numpy.ones_like(relative), numpy.log(relative)]
        if unloaded:
            forms.append(relative**-3 - 1)
        return numpy.linalg.lstsq(numpy.array(forms).T, self.hoop[yielding], rcond=None)[0][0]


def load(context, mesh, dimension, pressures, increments):
    """States at the ends of ramps from one pressure to the next."""
    pressures = [0, *pressures]
    symmetry = {'axisymmetric': 'X', '3d': 'XYZ'}[dimension]
    done = context.run_swage(CASE.format(
        dimension=dimension, mesh=mesh, times=', '.join(str(i) for i in range(len(pressures))),
        pressures=', '.join(str(p) for p in pressures),
        symmetry='\n'.join(f"&boundary name = '{plane}' kind = 'symmetry' group = '{plane}' /"
                           for plane in symmetry),
        steps=f'&step duration = 1 increments = {increments} /\n' * (len(pressures) - 1)),
        name=f'{mesh}_{pressures[1]}_{len(pressures)}')
    results = done.results()
    kind = TRIANGLE if dimension == 'axisymmetric' else TETRAHEDRON
    return [State(results.step(i), kind) for i in range(1, len(pressures))]


def closed_radius(pressure, yield_stress=YIELD_STRESS):
    """Radius of the plastic zone, by bisection."""
    low, high = BORE, OUTSIDE
    for _ in range(100):
        radius = (low + high) / 2
        carried = 2 * yield_stress * (math.log(radius / BORE) + (1 - (radius / OUTSIDE)**3) / 3)
        low, high = (radius, high) if carried < pressure else (low, radius)
    return low


def closed_outside(pressure):
    return YIELD_STRESS * closed_radius(pressure)**3 * (1 - POISSON) / YOUNG / OUTSIDE**2


def cell_size(radius, n):
    """Thickness of a layer of the mesh."""
    return radius * ((OUTSIDE / BORE)**(1 / n) - 1)


def graded(x):
    """Radius of a fraction of the thickness, in a geometric series."""
    return BORE * (OUTSIDE / BORE)**x


def write_section(path, n):
    """Quarter of a meridian section; groups BODY, BORE and X, the equator."""
    def place(x, y):
        angle = math.pi / 2 * y
        return (graded(x) * math.cos(angle) if y < 1 else 0.0, graded(x) * math.sin(angle))

    names = {'LEFT': 'BORE', 'BOTTOM': 'X'}
    swage_mesh_writer.write_rectangle(path, n, 2 * n, place,
                                      name_edge=lambda side, x, y: names.get(side, side))


def write_octant(path, n):
    """An eighth: triangles of the octahedron's face, n along an edge, blown up to the sphere; n
    layers of prisms between the radii, each cut into three tetrahedra. Groups BODY, BORE, X, Y,
    Z, the planes of symmetry."""
    number = {corner: i for i, corner in enumerate(
        corner for corner in itertools.product(range(n + 1), repeat=3) if sum(corner) == n)}
    points = []
    for layer in range(n + 1):
        for corner in number:
            # Angles, not the chord, are equal along the edges
            blown = [math.sin(math.pi / 2 * c / n) for c in corner]
            points.append([graded(layer / n) * c / math.hypot(*blown) for c in blown])
    triangles = []
    for i, j, k in number:
        if k > 0:
            triangles.append([(i, j, k), (i + 1, j, k - 1), (i, j + 1, k - 1)])
        if j > 0 and k > 0:
            triangles.append([(i, j, k), (i + 1, j - 1, k), (i + 1, j, k - 1)])
    triangles = [sorted(number[corner] for corner in triangle) for triangle in triangles]

    def at(layer, corners):
        return tuple(layer * len(number) + corner for corner in corners)

    def cut(layer, corners):
        """Prism over sorted corners: neighbours cut their common side alike."""
        below, above = at(layer, corners), at(layer + 1, corners)
        return [(*below[:i + 1], *above[i:]) for i in range(len(corners))]

    cells = [cell for layer in range(n) for triangle in triangles for cell in cut(layer, triangle)]
    groups = [('BODY', 3, swage_mesh_writer.oriented(points, cells)),
              ('BORE', 2, [at(0, triangle) for triangle in triangles])]
    for axis, name in enumerate('XYZ'):
        edge = sorted(i for corner, i in number.items() if corner[axis] == 0)
        near = {i: corner for corner, i in number.items() if corner[axis] == 0}
        pairs = [sorted(pair) for pair in itertools.combinations(edge, 2)
                 if sum(abs(p - q) for p, q in zip(near[pair[0]], near[pair[1]])) == 2]
        groups.append((name, 2, [face for layer in range(n) for pair in pairs
                                 for face in cut(layer, pair)]))
    swage_mesh_writer.write_msh(path, points, groups)
