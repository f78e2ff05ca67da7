"""Results read back by others: VTK and ParaView find the steps, points and extrema as written.

What was written is known in two ways. A bar with its ends held and pulled has as many points as the
mesh and known extrema: 1e-6, single precision. For a billet between tools, on one and two ranks, it
is what h5py finds in the file without knowing what it means; readers must find the same numbers: 0.

VTK is that of PyPI (.venv), by its own reader and by pyvista. ParaView runs where pvpython is
installed and may be 5.11, which reads the series of files of `per_step_files`; from 5.12 it reads
the single file, too. Where pvpython is missing its rows are skipped, unless the environment says
SWAGE_PARAVIEW=required.
"""
import json
import os
import pathlib
import shutil
import subprocess

import h5py
import numpy
import pyvista

import swage_results
import swage_verification

TETRAHEDRON = 10

BAR = """
&job units = 'mm-tonne-s' dimension = '3d' geometry = 'fixed' /
&mesh file = 'bar.msh' /
&body name = 'bar' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'elastic' young = 200000 poisson = 0.3 /
&boundary name = 'x' kind = 'symmetry' group = 'XMIN' /
&boundary name = 'y' kind = 'symmetry' group = 'YMIN' /
&boundary name = 'z' kind = 'symmetry' group = 'ZMIN' /
&boundary name = 'end' kind = 'velocity' group = 'ZMAX' components = 'z' velocity = 0, 0, 0.01 /
&step duration = 1 increments = 6 /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
&output every = 3 per_step_files = {per_step} /
"""
BILLET = """
&job units = 'mm-tonne-s' dimension = '3d' title = 'Billet "A"' /
&mesh file = 'bar.msh' /
&body name = 'billet' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 200 hardening_modulus = 300 /
&boundary name = 'x' kind = 'symmetry' group = 'XMIN' /
&boundary name = 'y' kind = 'symmetry' group = 'YMIN' /
&tool name = 'upper' shape = 'plane' point = 0, 0, 10 normal = 0, 0, -1 motion = 'press' /
&tool name = 'lower' shape = 'plane' point = 0, 0, 0 normal = 0, 0, 1 /
&motion name = 'press' velocity = 0, 0, -1 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.2 /
&contact name = 'top' slave = 'billet' master = 'upper' friction = 'dry' /
&contact name = 'bottom' slave = 'billet' master = 'lower' friction = 'dry' /
&step duration = 1 increments = 4 /
&output per_step_files = {per_step} double_precision = {double} /
"""


def run(context):
    context.box('bar', 3, 4, 5, lambda x, y, z: (4 * x, 6 * y, 10 * z))
    results = []
    for per_step in (False, True):
        name = 'bar_series' if per_step else 'bar'
        done = context.run_swage(BAR.format(per_step=logical(per_step)), ranks=1, name=name)
        yield from known(context, name, done.results())
        results.append(done)
    for ranks in (1, 2):
        for per_step in (False, True):
            name = f'billet_{"series_" if per_step else ""}{ranks}'
            done = context.run_swage(BILLET.format(per_step=logical(per_step),
                                                   double=logical(ranks == 2)),
                                     ranks=ranks, name=name)
            yield context.row(f'{name}, VTK: steps', len(done.results().times), 5, 0)
            yield from same(context, f'{name}, VTK', by_vtk(done.results()), written(done))
            results.append(done)
            if per_step:
                yield from same(context, f'{name}, pyvista', by_pyvista(done), written(done))
    yield from in_paraview(context, results)


def logical(value):
    return '.true.' if value else '.false.'


def known(context, name, results):
    """The bar: 0.01 mm longer in 10 mm, in results at 0, 0.5 and 1 s."""
    yield context.row(f'{name}: steps', len(results.times), 3, 0)
    yield context.row(f'{name}: time of the second', results.times[1], 0.5, 1e-15)
    last = results.step(-1)
    yield context.row(f'{name}: points', len(last.points), 4 * 5 * 6, 0)
    yield context.row(f'{name}: tetrahedra', len(last.cells[TETRAHEDRON]), 6 * 3 * 4 * 5, 0)
    displacement = last.point_fields['displacement'].astype(float)
    stress = last.cell_fields['stress'].astype(float)
    yield context.row(f'{name}: largest displacement', displacement[:, 2].max(), 0.01, 1e-6)
    yield context.row(f'{name}: smallest displacement', displacement[:, 0].min(), -0.3 * 4e-3, 1e-6)
    yield context.row(f'{name}: largest stress zz', stress[:, 2].max(), 200.0, 1e-6)
    yield context.zero(f'{name}: largest stress xy by zz', abs(stress[:, 3]).max() / 200.0, 1e-6)


def written(done):
    """What h5py finds: for each step points, cells and ranges of components."""
    index = swage_results.result_of(done.prefix)
    if index.suffix == '.series':
        names = [entry['name'] for entry in json.loads(index.read_text(encoding='utf-8'))['files']]
        steps = []
        for name in names:
            with h5py.File(index.with_name(name), 'r') as file:
                steps += raw_steps(file['VTKHDF'])
        return steps
    with h5py.File(index, 'r') as file:
        return raw_steps(file['VTKHDF'])


def raw_steps(root):
    counts = {'PointData': root['NumberOfPoints'][:], 'CellData': root['NumberOfCells'][:]}
    parts = [slice(None)]
    if 'Steps' in root:
        n = int(root['Steps'].attrs['NSteps'])
        starts, sizes = root['Steps/PartOffsets'][:n], root['Steps/NumberOfParts'][:n]
        parts = [slice(start, start + size) for start, size in zip(starts, sizes)]
    steps = []
    for number, part in enumerate(parts):
        ranges = {}
        for group, count in counts.items():
            for name, data in root[group].items():
                first = root[f'Steps/{group}Offsets/{name}'][number] if 'Steps' in root else 0
                ranges[name] = ranges_of(data[first:first + count[part].sum()])
        steps.append({'points': int(counts['PointData'][part].sum()),
                      'cells': int(counts['CellData'][part].sum()), 'ranges': ranges})
    return steps


def ranges_of(values):
    columns = numpy.asarray(values, float).reshape(len(values), -1)
    return [(column.min(), column.max()) for column in columns.T]


def by_vtk(results):
    steps = []
    for number in range(len(results.times)):
        step = results.step(number)
        fields = {**step.point_fields, **step.cell_fields}
        steps.append({'points': len(step.points), 'cells': step.n_cell,
                      'ranges': {name: ranges_of(values) for name, values in fields.items()}})
    return steps


def by_pyvista(done):
    index = swage_results.result_of(done.prefix)
    steps = []
    for entry in json.loads(index.read_text(encoding='utf-8'))['files']:
        # This reader knows its files by the other ending
        path = index.with_name(pathlib.Path(entry['name']).stem + '.vtkhdf')
        shutil.copy(index.with_name(entry['name']), path)
        data = pyvista.read(path)
        parts = list(data) if isinstance(data, pyvista.PartitionedDataSet) else [data]
        fields = {name: numpy.concatenate([part[name] for part in parts])
                  for name in parts[0].array_names}
        steps.append({'points': sum(part.n_points for part in parts),
                      'cells': sum(part.n_cells for part in parts),
                      'ranges': {name: ranges_of(values) for name, values in fields.items()}})
    return steps


def same(context, title, found, expected):
    """Points, cells and extrema of all steps, as sums of differences."""
    yield context.row(f'{title}: steps as written', len(found), len(expected), 0)
    for key in ('points', 'cells'):
        yield context.row(f'{title}: {key} of all steps', sum(step[key] for step in found),
                          sum(step[key] for step in expected), 0)
    difference = 0.0
    for one, other in zip(found, expected):
        if set(one['ranges']) != set(other['ranges']):
            raise swage_verification.Fault(f'{title}: fields {sorted(one["ranges"])} instead of '
                                           f'{sorted(other["ranges"])}')
        for name, ranges in other['ranges'].items():
            difference = max(difference, abs(numpy.array(one['ranges'][name])
                                             - numpy.array(ranges)).max())
    yield context.zero(f'{title}: extrema of {len(expected[0]["ranges"])} fields', difference, 0)


def in_paraview(context, results):
    program = shutil.which('pvpython')
    if program is None:
        if os.environ.get('SWAGE_PARAVIEW') == 'required':
            raise swage_verification.Fault('there is no pvpython; on Debian or Ubuntu: apt-get '
                                           'install --no-install-recommends paraview '
                                           'python3-paraview')
        yield context.skip('ParaView', 'there is no pvpython (apt-get install '
                           '--no-install-recommends paraview python3-paraview)')
        return
    for done in results:
        path = swage_results.result_of(done.prefix)
        summary = done.path('.paraview.json')
        # Neither a screen nor the packages of .venv
        surroundings = {key: value for key, value in os.environ.items()
                        if key not in ('DISPLAY', 'PYTHONPATH', 'VIRTUAL_ENV')}
        if path.suffix != '.series' and version(program, surroundings) < (5, 12):
            continue
        called = subprocess.run(
            [program, '--force-offscreen-rendering', context.source / 'read_in_paraview.py', path,
             summary], env={**surroundings, 'XDG_RUNTIME_DIR': str(context.folder)}, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300)
        if called.returncode or not summary.exists():
            raise swage_verification.Fault(f'pvpython cannot read {path}:\n{called.stdout}')
        found = json.loads(summary.read_text(encoding='utf-8'))
        title = f'{done.prefix.name}, ParaView {".".join(map(str, found["version"]))}'
        times = [step['time'] for step in found['steps']]
        yield context.row(f'{title}: last time', times[-1], done.results().times[-1], 1e-15)
        yield from same(context, title, found['steps'], written(done))


def version(program, surroundings):
    """(major, minor) of ParaView."""
    called = subprocess.run([program, '--version'], env=surroundings, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return tuple(int(number) for number in called.stdout.split()[-1].split('.')[:2])
