"""A tube of four layers bent a little, bonded and sliding (input/tube_bending).

Layers of radii 20, 21, 22, 23, 24 mm, E = 70, 110, 200, 70 GPa and equal Poisson's ratios strain
alike, bonded or not: plane sections stay plane, every layer has the stress E kappa x, and

  M = kappa sum E pi/4 (b^4 - a^4) = 1.534776e10 N mm^2 kappa

The mesh of the input, 24 cells around the half, 64 along and one over each layer; the metals elastic;
kappa R = 5e-4, so that the section stays round. Corners of the circles lie a little outside, where
the polygons have the second moment of area of the circles.

One word of the input, `treatment`, makes the difference: contacts that bonds close are left out.

The moment is that of the grips, the curvature that of the sections between 1/8 and 7/8 of the
length. 1 %: linear displacements over cells of 3.75 mm by 2.9 mm are too stiff by 0.8 %, which falls
with their square. At the ends the grips hold the sections from contracting across, which makes the
whole tube stiffer by 0.7 % more: the moment by the angle of the grips, 2 %. Bonded and sliding
layers differ by less than 0.1 %; the quick run, with sliding layers only on a mesh of 24 cells along,
which is too stiff by 5 %, rests on that.
"""
import math

import numpy

LENGTH, OUTSIDE, ANGLE = 240.0, 24.0, 2.5e-3
LAYERS = ((70000.0, 20, 21), (110000.0, 21, 22), (200000.0, 22, 23), (70000.0, 23, 24))
STIFFNESS = sum(young * math.pi / 4 * (b**4 - a**4) for young, a, b in LAYERS)


def run(context):
    source = context.root / 'input' / 'tube_bending'
    geometry = (source / 'tube_bending.geo').read_text(encoding='utf-8')
    text = (source / 'tube_bending.nml').read_text(encoding='utf-8')
    yield context.row('stiffness of the circles', STIFFNESS, 1.534776e10, 1e-6)

    fine = {}
    for treatment in ('bonded',) if context.quick else ('bonded', 'contact'):
        step, moment = bend(context, text, geometry, treatment, 64)
        if treatment == 'bonded':
            yield context.row('stiffness of the polygons of the mesh', polygons(step), STIFFNESS,
                              1e-6)
            yield context.zero('facets inside the bonded tube', inner_facets(step), 0)
        fine[treatment] = moment / curvature(step, 1 / 8)
        yield context.row(f'{treatment}: moment by the curvature of the middle', fine[treatment],
                          STIFFNESS, 0.01)
        yield context.row(f'{treatment}: moment by the angle of the grips',
                          moment / (2 * ANGLE / LENGTH), STIFFNESS, 0.02)
        yield context.below(f'{treatment}: curvature by the radius', curvature(step, 1 / 8) * OUTSIDE,
                            1e-3)
    if context.quick:
        for treatment in ('bonded', 'contact'):
            step, moment = bend(context, text, geometry, treatment, 24)
            fine[treatment] = moment / curvature(step, 1 / 8)
    yield context.row('sliding by bonded layers: moment by the curvature',
                      fine['contact'] / fine['bonded'], 1.0, 1e-3)


def bend(context, text, geometry, treatment, n):
    """The last result and the moment of the whole tube."""
    name = f'{treatment}_{n}'
    context.make_mesh(replaced(geometry, {'n_along = 64;': f'n_along = {n};'}), 3, name)
    words = {"'tube_bending.msh'": f"'{name}.msh'", "law = 'j2'": "law = 'elastic'",
             "  flow_stress = 'aluminium'\n": '', "  flow_stress = 'titanium'\n": '',
             "  flow_stress = 'steel'\n": '', '0.7853981634': repr(ANGLE),
             'increments = 45': 'increments = 1', 'every = 9': 'double_precision = .true.',
             "treatment = 'bonded'": f"treatment = '{treatment}'"}
    done = context.run_swage(replaced(text, words), name=name)
    torques = [done.history[f'torque_grip_{end}_y'][-1] for end in 'ab']
    return done.results().step(-1), abs(torques[0] - torques[1])


def drawn(step):
    """Nodes of the bodies: where they were drawn, and their displacements."""
    nodes = numpy.unique(step.cells[10])
    moved = step.point_fields['displacement'][nodes]
    return step.points[nodes] - moved, moved


def curvature(step, margin):
    """Of the part between two sections, by the turn of both."""
    place, moved = drawn(step)
    turns = []
    for z in (margin * LENGTH, (1 - margin) * LENGTH):
        here = abs(place[:, 2] - z) < 1e-6 * LENGTH
        x, along = place[here, 0], moved[here, 2]
        turns.append((x * (along - along.mean())).sum() / (x * x).sum())
    return abs(turns[1] - turns[0]) / (LENGTH * (1 - 2 * margin))


def polygons(step):
    """The stiffness of the section as it is meshed."""
    place, _ = drawn(step)
    end = place[abs(place[:, 2]) < 1e-6 * LENGTH]
    radii = sorted(set(numpy.round(numpy.hypot(end[:, 0], end[:, 1]), 6)))
    if len(radii) != 5:
        raise RuntimeError(f'the section has {len(radii)} circles')
    n = 2 * (sum(abs(numpy.hypot(end[:, 0], end[:, 1]) - radii[0]) < 1e-4) - 1)
    side = 2 * math.pi / n
    second = [n / 24 * math.sin(side) * (2 + math.cos(side)) * r**4 for r in radii]
    return sum(young * (b - a) for (young, _, _), a, b in zip(LAYERS, second, second[1:]))


def inner_facets(step):
    """Facets of one cell only that lie on none of the faces of the whole tube: where neighbours do
    not share them."""
    cells = step.cells[10]
    facets = numpy.concatenate([cells[:, part] for part in ([0, 1, 2], [0, 1, 3], [0, 2, 3],
                                                            [1, 2, 3])])
    kept, count = numpy.unique(numpy.sort(facets, axis=1), axis=0, return_counts=True)
    corners = (step.points - step.point_fields['displacement'])[kept[count == 1]]
    radius = numpy.hypot(corners[..., 0], corners[..., 1])
    on_face = numpy.zeros(len(corners), dtype=bool)
    for distance in (corners[..., 1], corners[..., 2], corners[..., 2] - LENGTH,
                     radius - radius.min(), radius - radius.max()):
        on_face |= (abs(distance) < 1e-3).all(axis=1)
    return int((~on_face).sum())


def replaced(text, words):
    """Every word must be there: else the input is not the one this case knows."""
    for old, new in words.items():
        if old not in text:
            raise RuntimeError(f'input/tube_bending does not have {old}')
        text = text.replace(old, new)
    return text
