"""Newton: iterations a step of the upsetting, and quadratic convergence at three states."""
import swage_mesh_writer


def sources(context):
    """(label, text of the input, mesh) of the upsetting in the section and, coarse, in 3D."""
    folder = context.root / 'input'
    name = 'upsetting_axisymmetric'
    text = (folder / name / f'{name}.nml').read_text(encoding='utf-8')
    geometry = (folder / name / f'{name}.geo').read_text(encoding='utf-8')
    context.make_mesh(geometry, 2, name)
    yield 'axisymmetric', text
    name = 'upsetting'
    text = (folder / name / f'{name}.nml').read_text(encoding='utf-8')
    # The input's own mesh is fine; its body is the group 'billet'
    coarse = swage_mesh_writer.cylinder_geometry(10, 30, 2.4).replace('BODY', 'billet')
    context.make_mesh(coarse, 3, name)
    yield '3D', text


def run(context):
    for label, text in sources(context):
        history = context.run_swage(text + '&solver tolerance = 1e-6 /\n', name=label).history
        steps = len(history['iterations']) - 1
        yield context.below(f'{label}: iterations a step', sum(history['iterations']) / steps, 6)
        yield context.row(f'{label}: steps', steps, 50, 0)
        yield from context.run_program('verify_newton', context.folder / f'{label}.nml', label)
