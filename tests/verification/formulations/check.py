"""Comparison of formulations by tools/compare: a coarse round punch pressed into a fine block.

The tool's own measures first: two squares drawn into each other by a hundredth have that
penetration, nodes of both sides, in the plane and in space. A case is run for a part of its time, by
the formulations asked for and by no other; one that cannot converge is a line of the table and no
end of the comparison.

The slave is the coarser side. By nodal master/slave its nodes stay out of the master, but nodes of
the master come through between them; the quasi-symmetric formulation holds both sides off: at
least 10 times less deep (theory manual, section 10, with the figure of all formulations, which the
full run draws anew).
"""
import csv
import math
import shutil
import subprocess
import types

import swage_mesh_writer
from swage_verification import Fault

OVERLAP = 0.01


def run(context):
    import swage_compare
    for title, kind, mesh in (('2D', 5, swage_mesh_writer.rectangle_mesh),
                              ('3D', 10, swage_mesh_writer.box_mesh)):
        step = overlapping(kind, mesh)
        found = swage_compare.measure(step, [({1}, {2})])
        for side in ('slave', 'master'):
            for measure in ('maximum', 'rms'):
                yield context.row(f'{title}, squares drawn into each other: {side}, {measure}',
                                  found[f'{side}_{measure}'], OVERLAP, 1e-12)
        # Diagonals lead to nodes of the same pressure: 9 of 33 edges in space
        yield context.row(f'{title}, pressures of 1 and 2 in turn: roughness', found['roughness'],
                          {5: 1.0, 10: math.sqrt(24 / 33)}[kind] / 1.5, 1e-12)

    source = context.source / 'formulations'
    for suffix in ('.nml', '.geo'):
        shutil.copy(source.with_suffix(suffix), context.folder)
    names = ['l2', 'master-slave', 'symmetric']
    table = compare(context, 'formulations', 0, *(['--formulations', ','.join(names)]
                                                   if context.quick else []))
    if context.quick:
        yield context.zero('lines of the table that were not asked for',
                           len(set(table) ^ set(names)), 0)
    for name in names:
        yield context.zero(f'{name}: has come to the end', table[name]['outcome'] != 'done', 0)
        yield context.zero(f'{name}: CPU seconds of phases beyond those of the run', max(
            0.0, sum(number(table[name], phase) for phase in ('cells', 'contact', 'factorisation',
                                                              'solution', 'ordering', 'output'))
            - number(table[name], 'cpu') - 0.05), 0)
        yield context.row(f'{name}: force', number(table[name], 'force'),
                          number(table['l2'], 'force'), 0.05)
    key = 'master_in_slave_max'
    yield context.above('nodes of the master in the slave: master/slave by l2',
                        number(table['master-slave'], key) / number(table['l2'], key), 10)

    # A tenth of the time in a single iteration an increment
    text = (context.folder / 'formulations.nml').read_text(encoding='utf-8')
    (context.folder / 'hasty.nml').write_text(
        text.replace('increments = 20', 'increments = 20 maximum_cuts = 0')
        + '\n&solver maximum_iterations = 1 /\n', encoding='utf-8')
    table = compare(context, 'hasty', 1, '--formulations', 'l2,lumped', '--until', '0.1')
    for name in ('l2', 'lumped'):
        yield context.zero(f'{name} in one iteration: said to fail',
                           not table[name]['outcome'].startswith('failed')
                           or 'no convergence' not in table[name]['reason'], 0)


def compare(context, case, expected, *options):
    """The lines of the table by formulation: {title without unit: text}."""
    done = subprocess.run([context.root / 'tools' / 'compare', f'{case}.nml', *options],
                          cwd=context.folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True)
    if done.returncode != expected:
        raise Fault(f'tools/compare: exit status {done.returncode}\n{done.stdout[-2000:]}')
    if not (context.folder / f'{case}_compare.png').exists():
        raise Fault('tools/compare has drawn no figure')
    with open(context.folder / f'{case}_compare.csv', newline='', encoding='utf-8') as file:
        titles, *lines = csv.reader(file)
    names = [title.partition(' ')[0] for title in titles]
    return {line[0]: dict(zip(names, line)) for line in lines}


def number(line, title):
    return float(line[title])


def overlapping(kind, mesh):
    """A result of two bodies of sides 1, the second 1 higher less the overlap; the first has the
    pressures 1 and 2 in turn."""
    import numpy
    points, cells, bodies, pressure = [], [], [], []
    for body, n in ((1, 3), (2, 4)):
        height = (body - 1) * (1 - OVERLAP)
        sizes = (n, n) if kind == 5 else (n, n, n)
        own, groups = mesh(*sizes, lambda *x, height=height: (*x[:-1], x[-1] + height))
        first = sum(len(part) for part in points)
        # Wider than the other one: at the sides of the same width nodes would lie on the edge
        wide = numpy.array([(*point, 0.0)[:3] for point in own])
        wide[:, :len(sizes) - 1] *= 1 if body == 1 else 1.2
        wide[:, :len(sizes) - 1] -= 0 if body == 1 else 0.1
        points.append(wide)
        pressure.append([1.0 + (round(sum(x) * n) % 2) for x in own])
        cells.append(numpy.array(groups[0][2]) + first)
        bodies += [body] * len(cells[-1])
    kinds = {5: numpy.zeros((0, 3), int), 10: numpy.zeros((0, 4), int)}
    numbers = {5: numpy.zeros(0, int), 10: numpy.zeros(0, int)}
    kinds[kind] = numpy.concatenate(cells)
    numbers[kind] = numpy.arange(len(kinds[kind]))
    return types.SimpleNamespace(
        points=numpy.concatenate(points), cells=kinds, numbers=numbers,
        cell_fields={'body': numpy.array(bodies)},
        point_fields={'contact_pressure': numpy.concatenate(pressure)})
