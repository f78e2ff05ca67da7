"""Bodies whose meshes do not match, tied to each other: patch test, two-layer beam, ranks, restart.

Two elastic blocks, E = 100, nu = 0.3, are tied by `&contact tied`. Under tension and under shear the
stress is uniform in both, whatever the meshes, also where the drawing leaves a gap between them: the
tie is integrated on the pieces that facets have in common, and is of one stiffness. In the shear
test tractions act all around, and the base is held.

A cantilever of two layers, glued, of E = 100 and 300, is bent by a hundredth of its length: the
force at its end is that of the one mesh whose layers share their nodes, and the jump between the layers is
that of the penalty; multipliers take it away. A plastic part of it follows in large strains: 1e-8 on
1 and 3 ranks, and the same bits after a restart.
"""
import numpy
import swage_mesh_writer
import swage_process

PATCH = """
&job units = 'mm-tonne-s' dimension = '{dimension}' geometry = 'fixed' /
&mesh file = '{mesh}.msh' /
&body name = 'lower' material = 'soft' group = 'LOWER_BODY' /
&body name = 'upper' material = 'soft' group = 'UPPER_BODY' /
&material name = 'soft' law = 'elastic' young = 100 poisson = 0.3 /
{loads}
&contact name = 'middle' {sides} tied = .true. {keys} /
&step duration = 1 increments = 1 /
&output double_precision = .true. fields = 'stress' /
&solver tolerance = 1e-11 pressure_tolerance = 1e-11 /
"""
BEAM = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = '{mesh}.msh' /
&body name = 'lower' material = 'soft' group = 'LOWER_BODY' /
&body name = 'upper' material = 'hard' group = 'UPPER_BODY' /
&material name = 'soft' law = '{law}' young = 100 poisson = 0.3 {flow} /
&material name = 'hard' law = 'elastic' young = 300 poisson = 0.3 /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 1 hardening_modulus = 5 /
&boundary name = 'clamp' kind = 'fixed' group = 'LOWER_LEFT', 'UPPER_LEFT' /
&boundary name = 'pull' kind = 'displacement' group = {right} components = 'y'
  displacement = 0, {way} time = 0, 1 factor = 0, 1 /
&contact name = 'glue' slave = 'UPPER_BOTTOM' master = 'LOWER_TOP' tied = .true. {keys} /
&step duration = 1 increments = {increments} /
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = 30 /
&output double_precision = .true. fields = 'displacement', 'contact_pressure' /
&restart {restart} /
"""
# Nodes of the lower block's top, 2D.
LOWER = (0, .13, .31, .47, .62, .83, 1)
LENGTH = 10


def run(context):
    for gap in (0, 0.02):
        lower = swage_mesh_writer.rectangle_mesh(
            len(LOWER) - 1, 4, lambda x, y: (LOWER[round(x * (len(LOWER) - 1))], 0.5 * y))
        upper = swage_mesh_writer.rectangle_mesh(9, 4, lambda x, y: (x, 0.5 + gap + 0.5 * y))
        context.bodies(f'plane_{gap}', {'LOWER': lower, 'UPPER': upper})
        context.bodies(f'space_{gap}', {
            'LOWER': swage_mesh_writer.box_mesh(4, 4, 2, lambda x, y, z: (x, y, 0.5 * z)),
            'UPPER': swage_mesh_writer.box_mesh(
                6, 5, 2, lambda x, y, z: (x, y, 0.5 + gap + 0.5 * z))})
    for title, mesh in (('2D', 'plane'), ('3D', 'space')):
        yield context.zero(f'{title}, tension', tension(context, mesh), 1e-10)
        yield context.zero(f'{title}, shear', shear(context, mesh), 1e-10)
        yield context.zero(f'{title}, tension, sides exchanged, whole bodies', tension(
            context, mesh, sides="slave = 'lower' master = 'upper'"), 1e-10)
        yield context.zero(f'{title}, tension, slave chosen', tension(
            context, mesh, sides="bodies = 'lower', 'upper'"), 1e-10)
        yield context.zero(f'{title}, tension, multipliers', tension(
            context, mesh, keys="enforcement = 'augmented_lagrangian' penalty_factor = 10"), 1e-10)
        yield context.zero(f'{title}, tension, gap of a fifth of a cell', tension(
            context, mesh, gap=0.02, keys='adjust = 0.03'), 1e-10)
    yield context.zero('axisymmetric, tension', tension(context, 'plane', 'axisymmetric'), 1e-10)
    yield from beam(context)


def tension(context, mesh, dimension=None, gap=0, sides=None, keys=''):
    """Largest error of the stress under a tension of 1."""
    across = 'Y' if mesh == 'plane' else 'Z'
    sides_held = ['LEFT'] if mesh == 'plane' else ['XMIN', 'YMIN']
    bottom, top = ('BOTTOM', 'TOP') if mesh == 'plane' else ('ZMIN', 'ZMAX')
    loads = [f"&boundary name = 'base' kind = 'symmetry' group = 'LOWER_{bottom}' /",
             f"&boundary name = 'load' kind = 'pressure' group = 'UPPER_{top}' pressure = -1 /"]
    loads += [f"&boundary name = '{body}_{side}' kind = 'symmetry' group = '{body}_{side}' /"
              for body in ('LOWER', 'UPPER') for side in sides_held]
    exact = numpy.zeros(6)
    exact['XYZ'.index(across)] = 1
    if mesh == 'plane' and not dimension:
        exact[2] = 0.3
    return patch(context, mesh, dimension, gap, loads, sides, keys, exact)


def shear(context, mesh):
    """Largest error of the stress under a shear of 1."""
    if mesh == 'plane':
        bottom, top, value, load = 'BOTTOM', 'TOP', '1, 0', {'LEFT': '0, -1', 'RIGHT': '0, 1'}
    else:
        bottom, top, value, load = 'ZMIN', 'ZMAX', '1, 0, 0', {'XMIN': '0, 0, -1', 'XMAX': '0, 0, 1'}
    loads = [f"&boundary name = 'base' kind = 'fixed' group = 'LOWER_{bottom}' /",
             f"&boundary name = 'load' kind = 'traction' group = 'UPPER_{top}' traction = {value} /"]
    loads += [f"&boundary name = '{body}_{side}' kind = 'traction' group = '{body}_{side}' "
              f'traction = {traction} /' for body in ('LOWER', 'UPPER')
              for side, traction in load.items()]
    exact = numpy.zeros(6)
    exact[3 if mesh == 'plane' else 5] = 1
    return patch(context, mesh, None, 0, loads, None, '', exact)


def patch(context, mesh, dimension, gap, loads, sides, keys, exact):
    bottom, top = ('BOTTOM', 'TOP') if mesh == 'plane' else ('ZMIN', 'ZMAX')
    sides = sides or f"slave = 'UPPER_{bottom}' master = 'LOWER_{top}'"
    done = context.run_swage(PATCH.format(
        dimension=dimension or {'plane': 'plane_strain', 'space': '3d'}[mesh], mesh=f'{mesh}_{gap}',
        loads='\n'.join(loads), sides=sides, keys=keys))
    if 'bodies' in sides and 'the slave is upper, the finer side' not in done.output:
        raise swage_process.Fault('the log does not say which side is the slave')
    return float(abs(done.results().step(-1).cell_fields['stress'] - exact).max())


def beam(context):
    """Two layers, tied and on one mesh."""
    factor = 1 if context.quick else 2
    parts = {name: swage_mesh_writer.rectangle_mesh(
        n * factor, 6 * factor, lambda x, y, bottom=bottom: (LENGTH * x, bottom + 0.5 * y),
        'alternating') for name, n, bottom in (('LOWER', 60, 0), ('UPPER', 80, 0.5))}
    context.bodies('layers', parts)
    context.rectangle(
        'whole', 80 * factor, 12 * factor, lambda x, y: (LENGTH * x, y), 'alternating',
        name_edge=lambda side, x, y: side if side in ('BOTTOM', 'TOP') else
        f"{'LOWER' if y < 0.5 else 'UPPER'}_{side}",
        name_cell=lambda x, y: 'LOWER_BODY' if y < 0.5 else 'UPPER_BODY')

    both = "'LOWER_RIGHT', 'UPPER_RIGHT'"

    def text(mesh='layers', keys='', law='elastic', way=0.1, increments=1, restart='', right=both):
        case = BEAM.format(mesh=mesh, keys=keys, law=law, way=way, increments=increments,
                           restart=restart, right=right,
                           flow="flow_stress = 'linear'" if law == 'j2' else '')
        if mesh == 'whole':
            case = '\n'.join(line for line in case.splitlines() if 'contact' not in line)
        if law == 'elastic':
            case = '\n'.join(line for line in case.splitlines() if '&flow_stress' not in line)
        return case

    # Only the hard layer is pulled: the tie carries the force to the other
    upper = "'UPPER_RIGHT'"
    for title, right in (('', both), (', by the upper layer', upper)):
        one = context.run_swage(text('whole', right=right), name='one').history['reaction_pull_y'][-1]
        for name, keys in (('penalty', ''), ('penalty 10', 'penalty_factor = 10'),
                           ('multipliers', "enforcement = 'augmented_lagrangian'")):
            done = context.run_swage(text(keys=keys, right=right), name='beam')
            yield context.row(f'beam{title}, {name}: force', done.history['reaction_pull_y'][-1],
                              one, 0.01)
        yield context.below(f'beam{title}, multipliers: gap by the cell',
                            done.history['penetration_by_cell_glue'][-1], 1e-4)

    # Contact where the nodes are one is doubted
    bonded = text('whole').replace('&step', "&contact name = 'glue' bodies = 'lower', 'upper' /\n&step")
    done = context.run_swage(bonded, name='bonded')
    yield context.row('bodies that share nodes: warnings that say so', done.output.count(
        'the bodies share 2 nodes of their surfaces, and are bonded'), 1, 0)
    yield context.row('and that they do not meet', done.output.count('at the start nowhere within'),
                      1, 0)

    # The balance of energies errs by the square of the turn in an increment: 1e-2 with 10 of them
    keys = {'law': 'j2', 'way': 4.0, 'increments': 36}
    whole = context.run_swage(text(**keys), name='tied').history['reaction_pull_y'][-1]
    one = context.run_swage(text('whole', **keys), name='one').history['reaction_pull_y'][-1]
    yield context.row('plastic beam: force', whole, one, 0.01)

    keys = {'law': 'j2', 'way': 1.5, 'increments': 14}
    whole = context.run_swage(text(**keys), name='plastic').history
    for n in (2, 3):
        ranks = context.run_swage(text(**keys), name='ranks', ranks=n).history
        # Nothing holds the beam along x: its forces there are rounding
        for history in (ranks, whole):
            for name in ('reaction_clamp_x', 'reaction_pull_x'):
                history.pop(name, None)
        yield context.zero(f'{n} ranks: history', swage_process.deviation(ranks, whole), 1e-8)
    swage_process.write_case(context, 'part', text(restart='every = 9', **keys))
    swage_process.run(context, 'part')
    swage_process.run(context, 'part', ['--restart'])
    yield context.zero('from the middle of bending: results that differ in a bit', len(
        swage_process.differences(context.folder / 'part', context.folder / 'plastic')), 0)
