"""Ranks: the same force history on 1, 2 and 3 ranks; a debug build runs the upsetting clean."""
import subprocess

import swage_mesh_writer

TOLERANCE = 1e-8


def run(context):
    folder = context.root / 'input' / 'upsetting'
    # The input's own mesh is fine; its body is the group 'billet'
    coarse = swage_mesh_writer.cylinder_geometry(10, 30, 2.4).replace('BODY', 'billet')
    context.make_mesh(coarse, 3, 'upsetting')
    text = (folder / 'upsetting.nml').read_text(encoding='utf-8')
    # Fixed steps: none may be cut
    text = text.replace('increments = 50', 'increments = 50, maximum_cuts = 0')
    text += '&solver tolerance = 1e-10, pressure_tolerance = 1e-10 /\n'
    histories = {ranks: context.run_swage(text, ranks=ranks, name=f'ranks_{ranks}').history
                 for ranks in (1, 2, 3)}
    columns = [name for name in histories[1] if name.startswith('force_')]
    force = max(abs(value) for name in columns for value in histories[1][name])
    for ranks in (2, 3):
        error = max(abs(a - b) for name in columns
                    for a, b in zip(histories[ranks][name], histories[1][name]))
        yield context.row(f'increments on {ranks} ranks', len(histories[ranks]['time']),
                          len(histories[1]['time']), 0)
        yield context.zero(f'forces on {ranks} ranks against 1, by the largest', error / force,
                           TOLERANCE)
        yield context.row(f'last force on {ranks} ranks', histories[ranks]['force_upper_z'][-1],
                          histories[1]['force_upper_z'][-1], TOLERANCE)
    if context.quick:
        return
    subprocess.run([context.root / 'tools' / 'setup', 'debug'], check=True)
    context.swage = context.root / 'build' / 'debug' / 'swage'
    text = text.replace('duration = 1', 'duration = 0.1').replace('increments = 50', 'increments = 5')
    for ranks in (1, 3):
        done = context.run_swage(text, ranks=ranks, name=f'debug_{ranks}')
        yield context.zero(f'debug build on {ranks} ranks: exit status', done.exit_code, 0)
        yield context.zero(f'debug build on {ranks} ranks: messages of the run-time checks',
                           sum('rror' in line or 'arning' in line
                               for line in done.output.splitlines()), 0)
        yield context.row(f'debug build on {ranks} ranks: force at 5 %',
                          done.history['force_upper_z'][-1], histories[1]['force_upper_z'][5],
                          TOLERANCE)
