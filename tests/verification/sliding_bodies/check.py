"""A block dragged over another one: Coulomb friction between bodies, ranks, restart.

A plastic block is pressed on an elastic one by 0.3 mm, then dragged by 6 mm over its mesh, ten times
as long as it is fine. While it slides the forces are in the ratio of the coefficient; what one body
gets the other gives. Ranks share the conditions of contact: histories of 2, 3 and 4 ranks are that
of one, 1e-8 at a Newton tolerance of 1e-10; so they are in plane strain, and where a billet is upset
by an elastic tool onto which its side folds. Runs that go on from the middle of sliding end with the
same bits; on another number of ranks, with the same history. All variants of `quasi_symmetric` fold
the side without a cut, but `interpolation`, which stalls where its stiffness is left out and then
goes on. Forces on the billet are those of `l2` to 0.1 %; on the coarser tool `interpolation` has up
to 22 % less, for slave nodes that no node of the master sees press nobody.
"""
import swage_mesh_writer
import swage_peer_works
import swage_process
import swage_verification

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' /
&mesh file = '{mesh}.msh' /
&body name = 'lower' material = 'steel' group = 'LOWER_BODY' /
&body name = 'upper' material = 'aluminium' group = 'UPPER_BODY' /
&material name = 'steel' law = 'elastic' young = 210000 poisson = 0.3 /
&material name = 'aluminium' law = 'j2' young = 70000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 100 hardening_modulus = 100 /
&boundary name = 'base' kind = 'fixed' group = '{base}' /
&boundary name = 'press' kind = 'displacement' group = '{top}' {press}
  time = 0, 0.2, 1 factor = 0, 1, 1 /
&boundary name = 'drag' kind = 'displacement' group = '{top}' {drag}
  time = 0, 0.2, 1 factor = 0, 0, 1 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.2 {method} /
&contact name = 'middle' slave = 'upper' master = 'lower' friction = 'dry' {keys} /
&step duration = 1 increments = 20 /
{settings}
"""
SETTINGS = """
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = 40 /
&output double_precision = .true. every = 5 fields = 'displacement', 'contact_pressure' /
&restart {restart} /
"""
METHOD = "method = 'return_mapping'"
COEFFICIENT = 0.2
FOLDING = {'averaged': "gap = 'averaged'", 'lumped': "projection = 'lumped'",
           'lumped, averaged': "projection = 'lumped' gap = 'averaged'",
           'nodal': "projection = 'nodal'", 'interpolation': "projection = 'interpolation'"}
QUICK_RANKS = {'blocks': 3, 'plane': 4, 'elastic tool': 2}


def blocks(keys='', restart=''):
    return CASE.format(dimension='3d', mesh='blocks', base='LOWER_ZMIN', top='UPPER_ZMAX',
                       press="components = 'z' displacement = 0, 0, -0.3",
                       drag="components = 'x', 'y' displacement = 6, 0, 0",
                       method=METHOD, keys=keys, settings=SETTINGS.format(restart=restart))


def strip(restart=''):
    return CASE.format(dimension='plane_strain', mesh='strip', base='LOWER_BOTTOM', top='UPPER_TOP',
                       press="components = 'y' displacement = 0, -0.3",
                       drag="components = 'x' displacement = 6, 0",
                       method=METHOD, keys='', settings=SETTINGS.format(restart=restart))


def elastic_tool(restart='', keys=''):
    return swage_peer_works.tool_case('billet', friction=METHOD, contact=keys,
                                      more=SETTINGS.format(restart=restart))


def run(context):
    context.bodies('blocks', {
        'LOWER': swage_mesh_writer.box_mesh(10, 4, 3, lambda x, y, z: (20 * x, 8 * y, 5 * z)),
        'UPPER': swage_mesh_writer.box_mesh(
            4, 3, 3, lambda x, y, z: (2 + 8 * x, 1 + 6 * y, 5 + 6 * z))})

    whole = context.run_swage(blocks(), name='whole').history
    nodal = context.run_swage(blocks("formulation = 'master_slave'"), name='nodal').history
    for name, history in (('l2', whole), ('master/slave', nodal)):
        pull, weight = history['reaction_drag_x'][-1], -history['reaction_press_z'][-1]
        yield context.row(f'{name}: force along by force across', pull / weight, COEFFICIENT, 0.002)
        yield context.row(f'{name}: force on the base', -history['reaction_base_x'][-1], pull, 1e-8)
        yield context.row(f'{name}: weight on the base', history['reaction_base_z'][-1], weight, 1e-8)
    yield context.below('l2: largest penetration by the cell', max(
        whole['penetration_by_cell_middle']), 1e-3)

    yield from ranks(context, 'blocks', blocks(), whole)
    yield from restart(context, 'blocks', blocks, 'whole', whole)

    context.bodies('strip', {
        'LOWER': swage_mesh_writer.rectangle_mesh(20, 5, lambda x, y: (20 * x, 5 * y)),
        'UPPER': swage_mesh_writer.rectangle_mesh(9, 6, lambda x, y: (2 + 8 * x, 5 + 6 * y))})
    plane = context.run_swage(strip(), name='plane', ranks=1).history
    pull, weight = plane['reaction_drag_x'][-1], -plane['reaction_press_y'][-1]
    yield context.row('plane: force along by force across', pull / weight, COEFFICIENT, 0.002)
    yield from ranks(context, 'plane', strip(), plane)
    yield from restart(context, 'plane', strip, 'plane', plane)

    context.make_mesh(swage_peer_works.tool_geometry(2.2, 3.2), 3, 'billet')
    tool = context.run_swage(elastic_tool(), name='tool', ranks=1).history
    yield from ranks(context, 'elastic tool', elastic_tool(), tool)
    yield from restart(context, 'elastic tool', elastic_tool, 'tool', tool)
    for name, keys in FOLDING.items():
        if name == 'interpolation' and context.quick:
            continue
        done = context.run_swage(elastic_tool(keys=keys), name=f'tool_{name.replace(", ", "_")}')
        if name != 'interpolation':
            yield context.zero(f'elastic tool, {name}: cuts',
                               swage_verification.read_totals(done.output)['cuts'], 0)
        yield context.row(f'elastic tool, {name}: force on the billet',
                          done.history['reaction_z_z'][-1], tool['reaction_z_z'][-1], 1e-3)


def ranks(context, title, text, whole):
    for n in (2, 3, 4):
        if context.quick and n != QUICK_RANKS[title]:
            continue
        name = title.replace(' ', '_') + f'_{n}'
        history = context.run_swage(text, name=name, ranks=n).history
        yield context.zero(f'{title}, {n} ranks: history',
                           swage_process.deviation(history, whole), 1e-8)


def restart(context, title, case, name, whole):
    """Go on from after increment 13, on one rank, and on two with what three have saved."""
    if context.quick and title == 'elastic tool':
        return
    swage_process.write_case(context, 'part', case(restart='every = 13'))
    swage_process.run(context, 'part')
    swage_process.run(context, 'part', ['--restart'])
    yield context.zero(f'{title}, from the middle of sliding: results that differ in a bit', len(
        swage_process.differences(context.folder / 'part', context.folder / name)), 0)
    if context.quick:
        return
    swage_process.write_case(context, 'part', case(restart='every = 13'))
    swage_process.run(context, 'part', ranks=3)
    swage_process.run(context, 'part', ['--restart'], ranks=2)
    history = context.read_history(context.folder / 'part.csv')
    yield context.zero(f'{title}, from 3 to 2 ranks: history',
                       swage_process.deviation(history, whole), 1e-8)
