"""A block dragged over another one: Coulomb friction between bodies, ranks, restart.

A plastic block is pressed on an elastic one by 0.3 mm, then dragged by 6 mm over its mesh, ten times
as long as it is fine. While it slides the forces are in the ratio of the coefficient; what one body
gets the other gives. Ranks share the conditions of contact: histories of 2, 3 and 4 ranks are that
of one, 1e-8 at a Newton tolerance of 1e-10; so they are in plane strain, and where a billet is upset
by an elastic tool onto which its side folds. Runs that go on from the middle of sliding end with the
same bits; on another number of ranks, with the same history.
"""
import swage_mesh_writer
import swage_process

CASE = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'blocks.msh' /
&body name = 'lower' material = 'steel' group = 'LOWER_BODY' /
&body name = 'upper' material = 'aluminium' group = 'UPPER_BODY' /
&material name = 'steel' law = 'elastic' young = 210000 poisson = 0.3 /
&material name = 'aluminium' law = 'j2' young = 70000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 100 hardening_modulus = 100 /
&boundary name = 'base' kind = 'fixed' group = 'LOWER_ZMIN' /
&boundary name = 'press' kind = 'displacement' group = 'UPPER_ZMAX' components = 'z'
  displacement = 0, 0, -0.3 time = 0, 0.2, 1 factor = 0, 1, 1 /
&boundary name = 'drag' kind = 'displacement' group = 'UPPER_ZMAX' components = 'x', 'y'
  displacement = 6, 0, 0 time = 0, 0.2, 1 factor = 0, 0, 1 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.2 method = 'return_mapping' /
&contact name = 'middle' slave = 'upper' master = 'lower' friction = 'dry' {keys} /
&step duration = 1 increments = 20 /
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = 40 /
&output double_precision = .true. every = 5 fields = 'displacement', 'contact_pressure' /
&restart {restart} /
"""
PLANE = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = 'strip.msh' /
&body name = 'lower' material = 'steel' group = 'LOWER_BODY' /
&body name = 'upper' material = 'aluminium' group = 'UPPER_BODY' /
&material name = 'steel' law = 'elastic' young = 210000 poisson = 0.3 /
&material name = 'aluminium' law = 'j2' young = 70000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 100 hardening_modulus = 100 /
&boundary name = 'base' kind = 'fixed' group = 'LOWER_BOTTOM' /
&boundary name = 'press' kind = 'displacement' group = 'UPPER_TOP' components = 'y'
  displacement = 0, -0.3 time = 0, 0.2, 1 factor = 0, 1, 1 /
&boundary name = 'drag' kind = 'displacement' group = 'UPPER_TOP' components = 'x'
  displacement = 6, 0 time = 0, 0.2, 1 factor = 0, 0, 1 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.2 method = 'return_mapping' /
&contact name = 'middle' slave = 'upper' master = 'lower' friction = 'dry' {keys} /
&step duration = 1 increments = 20 /
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = 40 /
&output double_precision = .true. every = 5 fields = 'displacement', 'contact_pressure' /
&restart {restart} /
"""
TOOL = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'billet.msh' /
&body name = 'billet' material = 'steel' group = 'BILLET' /
&body name = 'tool' material = 'tool_steel' group = 'TOOL' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'steel' /
&flow_stress name = 'steel' kind = 'linear' yield_stress = 200 hardening_modulus = 300 /
&material name = 'tool_steel' law = 'elastic' young = 210000 poisson = 0.3 /
&boundary name = 'x' kind = 'symmetry' group = 'XMIN' /
&boundary name = 'y' kind = 'symmetry' group = 'YMIN' /
&boundary name = 'z' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'press' kind = 'velocity' group = 'TOOL_TOP' velocity = 0, 0, -3 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.2 method = 'return_mapping' /
&contact name = 'face' slave = 'SKIN' master = 'TOOL_FACE' friction = 'dry' /
&step duration = 1 increments = 20 /
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = 40 /
&output double_precision = .true. every = 5 fields = 'displacement', 'contact_pressure' /
&restart {restart} /
"""
COEFFICIENT = 0.2
QUICK_RANKS = {'blocks': 3, 'plane': 4, 'elastic tool': 2}


def run(context):
    context.bodies('blocks', {
        'LOWER': swage_mesh_writer.box_mesh(10, 4, 3, lambda x, y, z: (20 * x, 8 * y, 5 * z)),
        'UPPER': swage_mesh_writer.box_mesh(
            4, 3, 3, lambda x, y, z: (2 + 8 * x, 1 + 6 * y, 5 + 6 * z))})

    whole = context.run_swage(CASE.format(keys='', restart=''), name='whole').history
    for name, history in (('l2', whole),
                          ('master/slave', context.run_swage(CASE.format(
                              keys="formulation = 'master_slave'", restart=''),
                              name='nodal').history)):
        pull, weight = history['reaction_drag_x'][-1], -history['reaction_press_z'][-1]
        yield context.row(f'{name}: force along by force across', pull / weight, COEFFICIENT, 0.002)
        yield context.row(f'{name}: force on the base', -history['reaction_base_x'][-1], pull, 1e-8)
        yield context.row(f'{name}: weight on the base', history['reaction_base_z'][-1], weight, 1e-8)
    yield context.below('l2: largest penetration by the cell', max(
        whole['penetration_by_cell_middle']), 1e-3)

    yield from ranks(context, 'blocks', CASE.format(keys='', restart=''), whole)
    yield from restart(context, 'blocks', CASE, 'whole', whole)

    context.bodies('strip', {
        'LOWER': swage_mesh_writer.rectangle_mesh(20, 5, lambda x, y: (20 * x, 5 * y)),
        'UPPER': swage_mesh_writer.rectangle_mesh(9, 6, lambda x, y: (2 + 8 * x, 5 + 6 * y))})
    plane = context.run_swage(PLANE.format(keys='', restart=''), name='plane', ranks=1).history
    pull, weight = plane['reaction_drag_x'][-1], -plane['reaction_press_y'][-1]
    yield context.row('plane: force along by force across', pull / weight, COEFFICIENT, 0.002)
    yield from ranks(context, 'plane', PLANE.format(keys='', restart=''), plane)
    yield from restart(context, 'plane', PLANE, 'plane', plane)

    context.make_mesh(swage_mesh_writer.billet_and_tool_geometry(2.2, 3.2), 3, 'billet')
    tool = context.run_swage(TOOL.format(restart=''), name='tool', ranks=1).history
    yield from ranks(context, 'elastic tool', TOOL.format(restart=''), tool)
    yield from restart(context, 'elastic tool', TOOL, 'tool', tool)


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
    swage_process.write_case(context, 'part', case.format(keys='', restart='every = 13'))
    swage_process.run(context, 'part')
    swage_process.run(context, 'part', ['--restart'])
    yield context.zero(f'{title}, from the middle of sliding: results that differ in a bit', len(
        swage_process.differences(context.folder / 'part', context.folder / name)), 0)
    if context.quick:
        return
    swage_process.write_case(context, 'part', case.format(keys='', restart='every = 13'))
    swage_process.run(context, 'part', ranks=3)
    swage_process.run(context, 'part', ['--restart'], ranks=2)
    history = context.read_history(context.folder / 'part.csv')
    yield context.zero(f'{title}, from 3 to 2 ranks: history',
                       swage_process.deviation(history, whole), 1e-8)
