"""Elastic dies: deflection between bounds and against rigid tools, and nodes that must not penetrate.

The case input/elastic_tools: both dies carry the same force. The mean deflection of the lower die's
face under the billet lies between that of a bar of its section, F L / E A, and of a half-space under
a uniform pressure, 16 p a (1 - nu^2) / (3 pi E) (Timoshenko and Goodier, Theory of Elasticity,
section 139). The billet stays thicker than between rigid tools, most in the middle.

A coarse billet is upset by a fine elastic tool, and by a coarse one. Nodes of the tool, the master,
enter the billet between its nodes where conditions are those of the slave's nodes alone; the
quasi-symmetric formulation sees them.
"""
import math

import swage_mesh_writer

YOUNG, POISSON = 210000, 0.3
RIGID = """
&tool name = 'lower' shape = 'plane' point = 0, 0, 0 normal = 0, 1, 0 /
&tool name = 'upper' shape = 'plane' point = 0, 12, 0 normal = 0, -1, 0 motion = 'ram' /
&motion name = 'ram' velocity = 0, -5, 0 /
"""

# Half a billet, 10 x 10 mm, under a tool of 20 x 15 mm
UPSETTING = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' /
&mesh file = '{mesh}.msh' /
&body name = 'billet' material = 'steel' group = 'BILLET_BODY' /
&body name = 'tool' material = 'tool_steel' group = 'TOOL_BODY' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'steel' /
&flow_stress name = 'steel' kind = 'linear' yield_stress = 300 hardening_modulus = 300 /
&material name = 'tool_steel' law = 'elastic' young = 210000 poisson = 0.3 /
&boundary name = 'middle' kind = 'symmetry' group = 'BILLET_BOTTOM' /
&boundary name = 'press' kind = 'velocity' group = 'TOOL_TOP' velocity = 0, -2 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.1 /
&contact name = 'face' slave = 'billet' master = 'TOOL_BOTTOM' friction = 'dry' {keys} /
&step duration = 1 increments = 20 /
&output every = 20 double_precision = .true. fields = 'body', 'penetration' /
"""
# Cells of the billet and of the tool along their faces of 10 and 20 mm.
MESHES = {'fine tool': (8, 48), 'coarse tool': (24, 12)}
FORMULATIONS = {'master/slave': "formulation = 'master_slave'", 'l2': ''}


def run(context):
    yield from deflection(context)
    yield from penetration(context)


def deflection(context):
    case = context.root / 'input' / 'elastic_tools' / 'elastic_tools'
    geometry = case.with_suffix('.geo').read_text(encoding='utf-8')
    context.make_mesh(geometry, 2, 'elastic_tools')
    billet = [line for line in geometry.splitlines()
              if 'Physical' not in line or '"billet"' in line]
    context.make_mesh('\n'.join(billet) + '\n', 2, 'rigid')
    text = case.with_suffix('.nml').read_text(encoding='utf-8')
    elastic = context.run_swage(text, name='elastic')
    history = elastic.history
    force = history['reaction_bed_y'][-1]
    yield context.row('force on the bed [N]', force, -history['reaction_ram_y'][-1], 1e-4)

    step, start = at(elastic, 1.0), at(elastic, 0.0)
    radius = math.sqrt(history['contact_area_below'][-1] / math.pi)
    face = [i for i, (x, y, _) in enumerate(start.points) if abs(y) < 1e-6
            and x < radius and start.points[i][1] - step.points[i][1] > 1e-6 and on_die(start, i)]
    face.sort(key=lambda i: start.points[i][0])
    sunk = [(start.points[i][0], start.points[i][1] - step.points[i][1]) for i in face]
    mean = mean_over_disc(sunk)
    pressure = force / (math.pi * radius**2)
    half_space = 16 * pressure * radius * (1 - POISSON**2) / (3 * math.pi * YOUNG)
    yield context.above('mean deflection of the lower die [mm], at least', mean,
                        force * 30 / (YOUNG * math.pi * 30**2))
    yield context.below('mean deflection of the lower die [mm], at most', mean, half_space)
    yield context.above('deflection on the axis by the mean', sunk[0][1] / mean, 1.05)

    rigid = context.run_swage(rigid_case(text), name='rigid')
    difference = [thickness(elastic, r) - thickness(rigid, r) for r in (0.0, 0.9)]
    yield context.above('billet thicker than between rigid tools, middle [mm]', difference[0],
                        2 * mean)
    yield context.above('middle by rim', difference[0] / difference[1], 1.02)
    worst = max(history['penetration_by_cell_below'] + history['penetration_by_cell_above'])
    yield context.below('largest penetration by the cell', worst, 5e-3)
    draw(context, elastic, sunk)


def rigid_case(text):
    """The input with rigid planes in place of the dies."""
    kept = []
    for group in text.split('\n&'):
        words = group.split()
        if words[0] == 'body' and ("'lower'" in words or "'upper'" in words):
            continue
        if words[0] == 'boundary':
            continue
        kept.append(group.replace('lower_face', 'lower').replace('upper_face', 'upper')
                    .replace('elastic_tools.msh', 'rigid.msh'))
    return '\n&'.join(kept) + RIGID


def at(run, time):
    results = run.results()
    return results.step(min(range(len(results.times)), key=lambda k: abs(results.times[k] - time)))


def corners(step):
    """Triangles and the body of each."""
    for kind, cells in step.cells.items():
        if cells.shape[1] == 3:
            yield from zip(cells, step.cell_fields['body'][step.numbers[kind]])


def on_die(step, point):
    return any(body != 1 and point in cell for cell, body in corners(step))


def points_of(step, body):
    return sorted({int(point) for cell, own in corners(step) if own == body for point in cell})


def mean_over_disc(values):
    """Of (radius, value), linear between."""
    whole = area = 0.0
    for (r, u), (s, v) in zip(values, values[1:]):
        ring = s * s - r * r
        whole += ring * (u + v) / 2
        area += ring
    return whole / area


def thickness(run, share):
    """Of the billet under load, at a share of the radius of its ends."""
    start, step = at(run, 0.0), at(run, 1.0)
    billet = points_of(start, 1)
    ends = {}
    for y in (0.0, 12.0):
        line = sorted((start.points[i][0], step.points[i][0], step.points[i][1]) for i in billet
                      if abs(start.points[i][1] - y) < 1e-6)
        ends[y] = value_at(share * line[-1][1], [(x, y_now) for _, x, y_now in line])
    return ends[12.0] - ends[0.0]


def value_at(x, line):
    """Linear between the points of a line, constant beyond."""
    if x <= line[0][0]:
        return line[0][1]
    for (a, u), (b, v) in zip(line, line[1:]):
        if a <= x <= b:
            return u + (v - u) * (x - a) / (b - a)
    return line[-1][1]


def penetration(context):
    """Nodes of the tool in the billet, up to 85 % of the radius: the edge folds."""
    for title, (n_billet, n_tool) in MESHES.items():
        mesh = title.replace(' ', '_')
        context.bodies(mesh, {
            'BILLET': swage_mesh_writer.rectangle_mesh(
                n_billet, n_billet, lambda x, y: (10 * x, 10 * y)),
            'TOOL': swage_mesh_writer.rectangle_mesh(
                n_tool, 3 * n_tool // 4, lambda x, y: (20 * x, 10 + 15 * y))})
        depth = {}
        for name, keys in FORMULATIONS.items():
            done = context.run_swage(UPSETTING.format(mesh=mesh, keys=keys),
                                     name=f'{mesh}_{name.replace("/", "_")}')
            start, step = at(done, 0.0), at(done, 1.0)
            depth[name] = deepest(start, step)
            yield context.row(f'{title}, {name}: its nodes in the billet [mm]', depth[name], 0,
                              math.inf)
        if title == 'fine tool':
            yield context.above('fine tool: nodes in the billet, master/slave by l2',
                                depth['master/slave'] / depth['l2'], 5)
        else:
            # Every node of the billet is on a facet of the tool: there is little to see
            cell = 20 / n_tool
            yield context.below('coarse tool: nodes in the billet by the cell, l2',
                                depth['l2'] / cell, 1e-3)


def deepest(start, step):
    lines = []
    for body in (1, 2):
        at_face = [i for i in points_of(start, body) if abs(start.points[i][1] - 10) < 1e-6]
        lines.append(sorted((step.points[i][0], step.points[i][1]) for i in at_face))
    billet, tool = lines
    return max(value_at(x, billet) - y for x, y in tool if x < 0.85 * billet[-1][0])


def draw(context, elastic, sunk):
    """The deflected face: build/verification/elastic_tools/deflection.png."""
    import os
    os.environ.setdefault('MPLBACKEND', 'Agg')
    import matplotlib.pyplot as plt
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout='constrained')
    left.plot(elastic.history['displacement_ram_y'],
              [f / 1000 for f in elastic.history['reaction_bed_y']])
    left.set_xlabel('displacement of the ram [mm]')
    left.set_ylabel('force [kN]')
    right.plot([x for x, _ in sunk], [-1000 * y for _, y in sunk], 'o-')
    right.set_xlabel('radius [mm]')
    right.set_ylabel('face of the lower die under load [µm]')
    figure.savefig(context.folder / 'deflection.png', dpi=120)
    plt.close(figure)
