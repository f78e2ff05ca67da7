"""One rank against two: wall-clock seconds by phase, and memory a rank.

The upsetting with about 30 thousand nodes to 10 % of reduction; nothing else may run meanwhile.
Rounding differs between numbers of ranks, and with it the count of factorisations, by one or two:
the time of one, and of one iteration with it, is given besides.
"""
import re

import upsetting_work


def run(context):
    mesh = '2k' if context.quick else '30k'
    upsetting_work.make_mesh(context, mesh)
    walls, memory, iterations, work = {}, {}, {}, {}
    for ranks in (1, 2):
        done = context.run_swage(upsetting_work.text(mesh, 0.1), ranks=ranks,
                                 name=f'{mesh}_{ranks}', timeout=7200)
        counts = context.counts(done)
        walls[ranks], iterations[ranks] = counts['walls'], counts['iterations']
        found = re.search(r'(\d+) factorisations, \d+ solutions, (\d+) linear iterations', done.output)
        work[ranks] = dict(zip(('factorisation', 'solution'), map(int, found.groups())))
        memory[ranks] = float(re.search(r'(\d+) MB on the largest rank', done.output)[1])
    context.title('phase, or a part of it    ', '1 rank [s]', '2 ranks [s]', 'speed-up')
    for phase in walls[1]:
        one, two = walls[1][phase], walls[2][phase]
        context.line(phase, one, two, one / two if two > 0 else float('nan'))
    pair = [sum(walls[ranks].get(phase, 0.0) for phase in ('factorisation', 'solution'))
            for ranks in (1, 2)]
    context.line('factorisation and solution', *pair, pair[0] / pair[1])
    for phase, unit in (('factorisation', 'one factorisation'), ('solution', 'one linear iteration')):
        each = [walls[ranks][phase] / work[ranks][phase] for ranks in (1, 2)]
        context.line(unit, *(f'{value:.4f}' for value in each), each[0] / each[1])
    context.line('factorisations', work[1]['factorisation'], work[2]['factorisation'], '')
    context.line('linear iterations', work[1]['solution'], work[2]['solution'], '')
    context.line('Newton iterations', iterations[1], iterations[2], '')
    context.line('memory of a rank [MB]', memory[1], memory[2], f'ratio {memory[2] / memory[1]:.3f}')
