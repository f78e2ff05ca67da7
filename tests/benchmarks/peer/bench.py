"""Works W1 and W2 beside CalculiX: force, CPU seconds and iterations of both in one run.

One eighth of a steel billet, radius 10 and height 30 mm, is upset in increments of 1 % of its
height: W1 between sticking tools (the end face is driven), W2 between rigid tools with Coulomb
friction 0.2 and the side folding onto them. CalculiX (Debian package calculix-ccx) takes linear
(C3D4) and quadratic (C3D10) tetrahedra, its direct solver SPOOLES and default controls; contact
surface to surface, penalty 1e6 and stick slope 1e4 N/mm3, which it must be told. The error is that
of the force at 30 % against the finest quadratic mesh. Draws error against CPU seconds of the run
to 30 %: build/benchmarks/peer/error_against_cpu.png.
"""
import calculix
import swage_mesh_writer

RADIUS, HALF_HEIGHT = 10.0, 15.0
# Cell sizes for about 2, 10 and 30 thousand nodes
LINEAR = {'2k': 0.89, '10k': 0.4866, '30k': 0.3249}
QUADRATIC = {'2k': 1.8976, '10k': 1.0075}
MARK = 0.3
SECONDS = 3600

CASE = """&job units = 'mm-tonne-s', dimension = '3d' /
&mesh file = '{mesh}.msh' /
&body name = 'billet', material = 'steel', group = 'BODY' /
&material name = 'steel', law = 'j2', young = 200000, poisson = 0.3, flow_stress = 'steel' /
&flow_stress name = 'steel', kind = 'linear', yield_stress = 200, hardening_modulus = 300 /
&boundary name = 'x', kind = 'symmetry', group = 'XMIN' /
&boundary name = 'y', kind = 'symmetry', group = 'YMIN' /
&boundary name = 'z', kind = 'symmetry', group = 'BOTTOM' /
{driven}
&step duration = {end}, increments = {increments} /
&output every = 50 /
"""
DRIVEN = {
    'W1': "&boundary name = 'press', kind = 'velocity', group = 'TOP', velocity = 0, 0, -15 /",
    'W2': """&tool name = 'press', shape = 'plane', point = 0, 0, 15, normal = 0, 0, -1,
      motion = 'down' /
&motion name = 'down', velocity = 0, 0, -15 /
&friction name = 'dry', kind = 'coulomb', coefficient = 0.2 /
&contact name = 'press', slave = 'billet', master = 'press', friction = 'dry' /"""}
COLUMN = {'W1': 'reaction_press_z', 'W2': 'force_press_z'}


def run(context):
    with_peer = calculix.program() is not None
    if not with_peer:
        context.say('CalculiX is not installed (apt-get install calculix-ccx): Swage alone')
    points = {'Swage P1+/P1': [], 'CalculiX C3D4': [], 'CalculiX C3D10': []}
    context.title('work', 'code', 'mesh', 'nodes', 'end', 'force at 30 % [kN]', 'at the end [kN]',
                  'iterations', 'cuts', 'CPU [s]', 's an iteration')

    meshes = ['2k'] if context.quick else list(LINEAR)
    for name in meshes:
        mesh = make(context, LINEAR[name], 1, name)
        row = swage(context, 'W1', name, MARK)
        context.line('W1', 'Swage P1+/P1', name, len(mesh.nodes), *row)
        points['Swage P1+/P1'].append((row[5], row[1]))
    if with_peer:
        for kind, sizes, order in (('C3D4', LINEAR, 1), ('C3D10', QUADRATIC, 2)):
            for name in meshes:
                if name not in ('2k', '10k'):
                    continue
                mesh = make(context, sizes[name], order, f'{name}_{kind}')
                row = peer(context, mesh, 'W1', f'{name}_{kind}', MARK)
                context.line('W1', f'CalculiX {kind}', name, len(mesh.nodes), *row)
                points[f'CalculiX {kind}'].append((row[5], row[1]))

    for name in meshes[:2]:
        for work in ('W1', 'W2'):
            mesh = make(context, LINEAR[name], 1, name)
            row = swage(context, work, name, 0.5)
            context.line(work, 'Swage P1+/P1', name, len(mesh.nodes), *row)
    if with_peer:
        for work in ('W1', 'W2'):
            mesh = make(context, QUADRATIC['2k'], 2, '2k_C3D10')
            row = peer(context, mesh, work, f'{work}_2k_C3D10', 0.5)
            context.line(work, 'CalculiX C3D10', '2k', len(mesh.nodes), *row)
    draw(context, points)


def make(context, size, order, name):
    """The quarter of the upper half: a Gmsh mesh with straight edges, uniform, by Delaunay."""
    geometry = swage_mesh_writer.cylinder_geometry(RADIUS, HALF_HEIGHT, size, quarter=True)
    geometry += (f'Mesh.MeshSizeMin = {size};\nMesh.MeshSizeMax = {size};\n'
                 f'Mesh.Algorithm3D = 1;\nMesh.ElementOrder = {order};\n'
                 'Mesh.SecondOrderLinear = 1;\n')
    return calculix.Mesh(context.make_mesh(geometry, 3, name, version='2.2'))


def swage(context, work, mesh, end):
    """End, forces at MARK and the end, iterations, cuts, CPU seconds, seconds an iteration."""
    text = CASE.format(mesh=mesh, driven=DRIVEN[work], end=end, increments=round(100 * end))
    done = context.run_swage(text, name=f'{work}_{mesh}_{end:.0%}'.rstrip('%'), ranks=1,
                             timeout=SECONDS, expect_exit=None)
    time, force = done.history['time'], done.history[COLUMN[work]]
    forces = {t: 4e-3 * abs(f) for t, f in zip(time, force)}
    counts = context.counts(done)
    return result(forces, counts['iterations'], counts['cuts'], counts['cpu'])


def peer(context, mesh, work, name, end):
    """As of [[swage]]."""
    done = calculix.run(context.folder, name, calculix.deck(mesh, work, end), SECONDS)
    forces = {t * end: f for t, f in done['forces'].items()}
    return result(forces, done['iterations'], done['cuts'], done['cpu'])


def result(forces, iterations, cuts, cpu):
    return (f'{max(forces):.0%}', at(forces, MARK), forces[max(forces)], iterations, cuts, cpu,
            cpu / max(1, iterations))


def at(forces, reduction):
    """Force at a reduction, between two increments by a straight line."""
    below = max((t for t in forces if t <= reduction + 1e-9), default=0.0)
    above = min((t for t in forces if t >= reduction - 1e-9), default=None)
    if above is None:
        return float('nan')
    if above <= below:
        return forces[below]
    return forces[below] + (forces[above] - forces[below]) * (reduction - below) / (above - below)


def draw(context, points):
    """Error of the force at MARK against CPU seconds."""
    import os
    os.environ.setdefault('MPLBACKEND', 'Agg')
    import matplotlib.pyplot as plt
    finest = points['CalculiX C3D10'] or points['Swage P1+/P1']
    reference = finest[-1][1]
    figure, axes = plt.subplots(figsize=(6.4, 4.6), layout='constrained')
    for (name, values), mark in zip(points.items(), 'os^'):
        shown = [(cpu, abs(force / reference - 1)) for cpu, force in values if force != reference]
        if shown:
            axes.loglog(*zip(*shown), mark + '-', label=name)
    axes.set_xlabel('CPU [s] of the run to 30 %')
    axes.set_ylabel(f'error of the force at {MARK:.0%}, against {reference:.2f} kN')
    axes.legend(frameon=False)
    axes.grid(which='both', alpha=0.3)
    path = context.folder / 'error_against_cpu.png'
    figure.savefig(path, dpi=150)
    context.say(f'picture {path.relative_to(context.root)}')
