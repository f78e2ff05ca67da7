"""Works W1 to W4 beside CalculiX: force, CPU seconds and iterations of both in one run.

One eighth of a steel billet, radius 10 and height 30 mm, is upset in increments of 1 % of its
height: W1 between sticking tools (the end face is driven), W2 between rigid tools with Coulomb
friction 0.2 and the side folding onto them. CalculiX (Debian package calculix-ccx) takes linear
(C3D4) and quadratic (C3D10) tetrahedra, its direct solver SPOOLES and default controls; contact
surface to surface, penalty 1e6 and stick slope 1e4 N/mm3, which it must be told. The error is that
of the force at 30 % against the finest quadratic mesh. Draws error against CPU seconds of the run
to 30 %: build/benchmarks/peer/error_against_cpu.png.

W3: the quarter of an elastic block of 32 x 32 x 8 mm is pressed by 3 mm on the billet in 20
increments, friction 0.2; meshes do not match. W4: two elastic cubes of other cells under 100 MPa,
whose stress is uniform; CalculiX surface to surface (S2S)
and node to surface (N2S); Kratos 10.4.4 was measured apart.
"""
import calculix
import swage_mesh_writer
import swage_peer_works

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

# W3: cells of the tool, linear and quadratic.
TOOL_CELL, QUADRATIC_TOOL_CELL = 1.25, 2.5
PEER_CONTACT = {'SURFACE TO SURFACE': 'S2S', 'NODE TO SURFACE': 'N2S'}
FORMULATIONS = {'l2': '', 'nodal': "formulation = 'master_slave'"}


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
    elastic_tool(context, meshes, with_peer)
    patch(context, with_peer)


def elastic_tool(context, meshes, with_peer):
    """W3, and where the time goes, in three increments at the largest size."""
    context.title('work', 'code', 'mesh', 'nodes', 'force at 1.2 mm [kN]', 'at 3.0 mm [kN]',
                  'iterations', 'cuts', 'CPU [s]', 's an iteration')
    for name in meshes[:2]:
        mesh = make_tool(context, LINEAR[name], TOOL_CELL, 1, f'tool_{name}')
        for formulation in FORMULATIONS:
            done = run_tool(context, f'tool_{name}', formulation, 20)
            counts = context.counts(done)
            force = [-4e-3 * f for f in done.history['reaction_press_z']]
            i = min(range(len(force)), key=lambda j: abs(done.history['time'][j] - 0.4))
            context.line('W3', f'Swage {formulation}', name, len(mesh.nodes), force[i], force[-1],
                         counts['iterations'], counts['cuts'], counts['cpu'],
                         counts['cpu'] / counts['iterations'])
    if with_peer:
        mesh = make_tool(context, QUADRATIC['2k'], QUADRATIC_TOOL_CELL, 2, 'tool_2k_C3D10')
        for kind in PEER_CONTACT:
            text = calculix.deck_of_tool(mesh, swage_peer_works.STROKE, 20, kind)
            done = calculix.run(context.folder, f'tool_{kind[:4].lower()}', text, SECONDS)
            row = result(done['forces'], done['iterations'], done['cuts'], done['cpu'])
            context.line('W3', f'CalculiX {PEER_CONTACT[kind]}', '2k', len(mesh.nodes),
                         at(done['forces'], 0.4), row[2], *row[3:])

    if len(meshes) < 3:
        return
    size = f'tool_{meshes[2]}'
    mesh = make_tool(context, LINEAR[meshes[2]], TOOL_CELL, 1, size)
    context.title('mesh', 'nodes', 'contact', 'CPU [s]', 'not the solver', 'cells', 'contact')
    for formulation in FORMULATIONS:
        counts = context.counts(run_tool(context, size, formulation, 3))
        cpu, phases = counts['cpu'], counts['phases']
        solver = sum(phases[name] for name in ('ordering', 'factorisation', 'solution'))
        context.line(meshes[2], len(mesh.nodes), formulation, cpu, f'{1 - solver / cpu:.0%}',
                     f"{phases['cells'] / cpu:.0%}", f"{phases['contact'] / cpu:.0%}")


def make_tool(context, size, tool_size, order, name):
    geometry = swage_peer_works.tool_geometry(size, tool_size)
    geometry += f'Mesh.ElementOrder = {order};\nMesh.SecondOrderLinear = 1;\n'
    return calculix.Mesh(context.make_mesh(geometry, 3, name, version='2.2'))


def run_tool(context, mesh, formulation, increments):
    """Of the 20 increments so many."""
    text = swage_peer_works.tool_case(mesh, swage_peer_works.STROKE * increments / 20, increments,
                                      contact=FORMULATIONS[formulation], more='&output every = 20 /')
    return context.run_swage(text, name=f'{mesh}_{formulation}', ranks=1, timeout=SECONDS)


def patch(context, with_peer):
    """W4: the largest error of the stress."""
    context.title('work', 'contact', 'largest error of the stress')
    geometry = swage_peer_works.cubes_geometry(3.3, 2.3)
    mesh = calculix.Mesh(context.make_mesh(geometry, 3, 'cubes', version='2.2'))
    for name, keys in FORMULATIONS.items():
        done = context.run_swage(swage_peer_works.cubes_case(keys), name=f'cubes_{name}')
        context.line('W4', f'Swage {name}', swage_peer_works.error_of_cubes(done))
    if with_peer:
        for kind in PEER_CONTACT:
            name = f'cubes_{kind[:4].lower()}'
            calculix.run(context.folder, name, calculix.deck_of_cubes(mesh, kind), SECONDS)
            error = calculix.largest_error(context.folder / f'{name}.dat', 2, -100.0) / 100
            context.line('W4', f'CalculiX {PEER_CONTACT[kind]}', error)
    context.line('W4', "Kratos' mortar", 0.046)


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
