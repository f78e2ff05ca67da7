"""The linear solver of whole upsettings against a naive one: ratios, and growth with the mesh.

Contact, friction, defaults; to 20 % of reduction. The naive solver: the symmetric part of every
matrix of a run with `mumps`, factorised in double precision with MUMPS' own ordering PORD. Its
time is that run's iterations times the mean of five matrices (bench_solver.f90). With 30 thousand
nodes the run with `mumps` is left out: its iterations are taken to be those of the other.
"""
import math
import re

import upsetting_work


def run(context):
    sizes = ['2k'] if context.quick else ['2k', '10k', '30k']
    context.title('mesh', 'nodes', 'iterations', 'with mumps', 'run [s]', 'solver [s]', 'naive [s]',
                  'ratio')
    points = []
    for name in sizes:
        upsetting_work.make_mesh(context, name)
        runs = {}
        for solver in ('mumps_lagged', 'mumps'):
            # The iterations of a direct run grow little with the mesh: the largest is not run
            if solver == 'mumps' and name == '30k':
                continue
            text = upsetting_work.text(name, 0.2, f"linear_solver = '{solver}'", every=20)
            done = context.run_swage(text, name=f'{name}_{solver}', timeout=7200)
            runs[solver] = context.counts(done)
            nodes = int(re.search(r'^mesh: (\d+) nodes', done.output, re.M)[1])
        kept = runs['mumps_lagged']
        iterations = runs.get('mumps', kept)['iterations']
        seconds = sum(kept['phases'][phase] for phase in ('ordering', 'factorisation', 'solution'))
        case = context.folder / f'{name}_mumps_lagged.nml'
        naive = None
        for line in context.run_benchmark('bench_solver', case).splitlines():
            cells = [cell.strip() for cell in line.split(';')]
            if cells[:2] == ['mean', 'naive']:
                naive = float(cells[2]) + float(cells[3])
        total = iterations * naive
        context.line(name, nodes, kept['iterations'], iterations, kept['cpu'], seconds, total,
                     seconds / total)
        points.append((nodes, kept['cpu'], seconds))
    if len(points) > 1:
        growth = math.log(points[-1][0] / points[0][0])
        whole, solver = (math.log(points[-1][i] / points[0][i]) / growth for i in (1, 2))
        context.say(f'growth exponents: whole run {whole:.2f}, linear solver {solver:.2f}')
