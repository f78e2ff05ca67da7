"""What a verification case sees: rows, and a context that makes meshes, runs programs and reads
results. Standard library only, but for `Run.results`, which needs the environment .venv.

A case is tests/verification/NAME/check.py:

    \"\"\"One line: what is verified.\"\"\"
    SLOW = True              # optional: left out by tools/verify --quick

    def run(context):
        context.rectangle('cook', 16, 16, lambda x, y: (48*x, 44*x + y*(44 - 28*x)))
        done = context.run_swage('''&job ... / &mesh file = 'cook.msh' / ...''')
        yield context.row('tip', done.history['tip_y'][-1], 17.66012, 1e-4)

Rows print as they are yielded. A row is ok when its error is at most its tolerance. tools/verify
adds one for the energies of all the runs of the case; see Context.energy_rows.
"""
import collections
import csv
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import swage_mesh_writer

Row = collections.namedtuple('Row', 'name computed reference error tolerance')
Skip = collections.namedtuple('Skip', 'name reason')

# Of the external work: what the other energies may leave of it, at any time of any run.
ENERGY_TOLERANCE = 1e-3


class Fault(Exception):
    """A case cannot go on: something does not run, or ends otherwise than expected."""


def environment():
    """That of tools/setup: one thread a rank, more ranks than cores allowed, fast kernels."""
    wanted = {'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1',
              'OMPI_MCA_rmaps_base_oversubscribe': '1', 'OMPI_MCA_mpi_yield_when_idle': '1',
              'OMPI_MCA_hwloc_base_binding_policy': 'none'}
    if os.geteuid() == 0:
        wanted |= {'OMPI_ALLOW_RUN_AS_ROOT': '1', 'OMPI_ALLOW_RUN_AS_ROOT_CONFIRM': '1'}
    # OpenBLAS of Debian 12 takes its slowest kernels on processors younger than itself
    try:
        flags = pathlib.Path('/proc/cpuinfo').read_text(encoding='utf-8')
    except OSError:
        flags = ''
    if 'avx512dq' in flags:
        wanted['OPENBLAS_CORETYPE'] = 'SKYLAKEX'
    elif 'avx2' in flags:
        wanted['OPENBLAS_CORETYPE'] = 'HASWELL'
    return {**wanted, **os.environ}


class History(dict):
    """Columns of a history by name, as lists of numbers; `units` has their labels."""

    def __init__(self, path):
        super().__init__()
        self.units = {}
        with open(path, newline='', encoding='utf-8') as file:
            table = csv.reader(file)
            header = next(table, [])
            rows = [row for row in table if row]
        for i, title in enumerate(header):
            name, label = re.fullmatch(r'(.*?)(?: \[(.*)\])?', title).groups()
            self[name] = [float(row[i]) for row in rows]
            self.units[name] = label or ''

    def __missing__(self, name):
        raise Fault(f'the history has no column {name}; it has {", ".join(self)}')


class Run:
    """A finished run of swage: `exit_code`, `output` (both streams), `seconds`, `prefix` (a path:
    results are prefix.csv, prefix.vtkhdf, ...)."""

    def __init__(self, prefix, exit_code, output, seconds):
        self.prefix, self.exit_code, self.output, self.seconds = prefix, exit_code, output, seconds
        self._history = None

    def path(self, suffix):
        """A result file, as path('.sta')."""
        return self.prefix.with_name(self.prefix.name + suffix)

    @property
    def history(self):
        """Columns of the history; see History."""
        if self._history is None:
            if not self.path('.csv').exists():
                raise Fault(f'there is no {self.path(".csv")}')
            self._history = History(self.path('.csv'))
        return self._history

    def results(self):
        """The fields: see class Results in tools/swage_results.py (numpy arrays)."""
        import swage_results
        return swage_results.Results(swage_results.result_of(self.prefix))


class Context:
    """One case at work. Paths: `root` of the repository, `source` of the case (with its check.py),
    `folder` for its files (build/verification/NAME, emptied at the start), `build`
    (build/release), `programs` (verification programs of the case) and `swage`, the program.
    `kind` is the folder of tests: 'verification' or 'benchmarks'.
    `ranks`: what tools/verify --ranks says, else 1. `quick`: whether tools/verify --quick runs.
    """

    def __init__(self, root, name, ranks=1, quick=False, build='release', kind='verification'):
        self.root, self.name, self.ranks, self.quick = root, name, ranks, quick
        self.source = root / 'tests' / kind / name
        self.folder = root / 'build' / kind / name
        self.build = root / 'build' / build
        self.programs = self.build / kind / name
        self.swage = self.build / 'swage'
        self._energy_errors = []
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)

    # --- Rows

    @staticmethod
    def row(name, computed, reference, tolerance, error=None, absolute=False):
        """A value against its reference: relative error, absolute where asked for or where the
        reference is 0; or the error given."""
        if error is None:
            error = abs(computed - reference)
            if reference != 0 and not absolute:
                error /= abs(reference)
        return Row(name, float(computed), float(reference), float(error), float(tolerance))

    @staticmethod
    def below(name, computed, limit):
        """A value that may not exceed a limit: the error is the excess, which must be 0."""
        return Row(name, float(computed), float(limit), excess(computed - limit), 0.0)

    @staticmethod
    def above(name, computed, limit):
        """A value that may not fall below a limit."""
        return Row(name, float(computed), float(limit), excess(limit - computed), 0.0)

    @staticmethod
    def zero(name, error, tolerance):
        """An error that is computed as such."""
        return Row(name, float(error), 0.0, abs(float(error)), float(tolerance))

    @staticmethod
    def skip(name, reason):
        """In place of rows that cannot be had here; it is counted apart, and said."""
        return Skip(name, reason)

    @staticmethod
    def order(name, sizes, errors, expected, tolerance, two_sided=False):
        """Order of convergence between the last two of the errors, for sizes that fall. One-sided
        unless said: a higher order is no fault."""
        slope = math.log(errors[-2] / errors[-1]) / math.log(sizes[-2] / sizes[-1])
        error = abs(expected - slope) if two_sided else excess(expected - slope)
        return Row(name, slope, float(expected), error, float(tolerance))

    def energy_rows(self):
        """The energy balance of the runs so far: the worst of those held to each tolerance."""
        for limit in sorted({limit for _, _, limit in self._energy_errors}):
            runs = [(error, name) for error, name, held in self._energy_errors if held == limit]
            error, name = max(runs, key=weight)
            yield self.zero(f'energy balance, {len(runs)} runs, worst {name}', error, limit)

    # --- Meshes, in `folder`

    def rectangle(self, name, n, m, place=None, diagonal='rising', name_edge=None, name_cell=None):
        """NAME.msh: structured triangles; see swage_mesh_writer.write_rectangle. Returns its path."""
        return swage_mesh_writer.write_rectangle(self.folder / f'{name}.msh', n, m, place, diagonal,
                                                 name_edge, name_cell)

    def box(self, name, n, m, k, place=None, name_cell=None):
        """NAME.msh: structured tetrahedra; see swage_mesh_writer.write_box."""
        return swage_mesh_writer.write_box(self.folder / f'{name}.msh', n, m, k, place, name_cell)

    def bodies(self, name, bodies):
        """NAME.msh: several bodies; see swage_mesh_writer.write_bodies."""
        return swage_mesh_writer.write_bodies(self.folder / f'{name}.msh', bodies)

    def cylinder(self, name, radius, height, size, quarter=False):
        """NAME.msh: tetrahedra by Gmsh, groups BODY, BOTTOM, TOP, SIDE (and XMIN, YMIN)."""
        text = swage_mesh_writer.cylinder_geometry(radius, height, size, quarter)
        return self.make_mesh(text, 3, name)

    def make_mesh(self, geometry, dimension, name='mesh', version='4.1'):
        """NAME.msh by Gmsh from the text of a .geo file."""
        source, mesh = self.folder / f'{name}.geo', self.folder / f'{name}.msh'
        source.write_text(geometry, encoding='utf-8')
        program = self.root / '.venv' / 'bin' / 'gmsh'
        if not program.exists():
            raise Fault('Gmsh is not installed: run tools/setup')
        # By the interpreter of the environment: the script's first line names another.
        command = [program.with_name('python'), program, source, f'-{dimension}', '-o', mesh,
                   '-format', {'4.1': 'msh41', '2.2': 'msh22'}[version], '-nopopup',
                   '-setnumber', 'General.NumThreads', '1', '-setnumber', 'Mesh.RandomSeed', '1',
                   '-v', '2']
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode or not mesh.exists() or 'Error' in done.stdout:
            raise Fault(f'{done.stdout}Gmsh made no mesh from {source}')
        return mesh

    # --- Programs

    def run_program(self, name, *arguments, ranks=1, timeout=1800):
        """Run tests/verification/CASE/NAME.f90 as built; returns the rows it prints (module
        swage_test_rows)."""
        program = self.programs / name
        if not program.exists():
            raise Fault(f'{program} is not built: run tools/setup release')
        _, output, _ = self._run([program, *arguments], ranks, 0, timeout, name)
        rows = []
        for line in output.splitlines():
            if line.startswith('row;'):
                _, title, *values = line.split(';')
                rows.append(Row(title, *(float(value) for value in values)))
        if not rows:
            raise Fault(f'{program} printed no row:\n{output}')
        return rows

    def run_swage(self, nml, ranks=None, expect_exit=0, name='case', timeout=1800,
                  energy_tolerance=ENERGY_TOLERANCE):
        """Run swage on the text of an input file, or on a file, whose text is copied: it becomes
        NAME.nml in `folder`, and paths in it start there. A Fault unless it ends with
        `expect_exit` (None: however it likes). The energies must balance to `energy_tolerance`,
        of which a case that asks for more states the reason. Returns a Run."""
        if not self.swage.exists():
            raise Fault(f'{self.swage} is not built: run tools/setup release')
        if isinstance(nml, pathlib.Path):
            nml = nml.read_text(encoding='utf-8')
        source = self.folder / f'{name}.nml'
        source.write_text(nml, encoding='utf-8')
        code, output, seconds = self._run([self.swage, source], ranks or self.ranks, expect_exit,
                                          timeout, name)
        run = Run(self.folder / name, code, output, seconds)
        if code == 0:
            errors = [(abs(error), name) for error in run.history['energy_error']]
            self._energy_errors.append((*max(errors, key=weight), energy_tolerance))
        return run

    @staticmethod
    def read_history(path):
        """Columns of a history file; see History."""
        return History(path)

    def _run(self, command, ranks, expect_exit, timeout, name):
        if ranks > 1:
            command = ['mpirun', '-n', str(ranks), *command]
        start = time.monotonic()
        try:
            done = subprocess.run(command, cwd=self.folder, env=environment(), timeout=timeout,
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, encoding='utf-8', errors='replace')
        except subprocess.TimeoutExpired as fault:
            raise Fault(f'{name}: not finished after {timeout} s') from fault
        (self.folder / f'{name}.out').write_text(done.stdout, encoding='utf-8')
        if expect_exit is not None and done.returncode != expect_exit:
            tail = '\n'.join(done.stdout.splitlines()[-20:])
            raise Fault(f'{name}: exit status {done.returncode} instead of {expect_exit}, in '
                        f'{self.folder}\n{tail}')
        return done.returncode, done.stdout, time.monotonic() - start


def read_totals(output):
    """What the last lines of a run say, None where it has none: increments, iterations (those of cut
    increments too), cuts, factorisations, CPU seconds, and by phase `phases`, CPU seconds, and
    `walls`, wall-clock seconds."""
    found = re.search(r'(\d+) increments to .*?, (\d+) iterations .*?, (\d+) cuts '
                      r'\((\d+) iterations lost', output)
    cpu = re.search(r'^CPU (\S+) s: (.*)$', output, re.M)
    wall = re.search(r'^elapsed (\S+): (.*)$', output, re.M)
    factors = re.search(r'^(\d+) factorisations', output, re.M)
    if not found or not cpu or not wall:
        return None
    increments, iterations, cuts, lost = (int(word) for word in found.groups())

    def phases(text):
        return {name: float(value) for name, value in re.findall(r'([a-z]+) ([\d.]+) s', text)}

    return {'increments': increments, 'iterations': iterations + lost, 'cuts': cuts,
            'factorisations': int(factors[1]) if factors else 0, 'cpu': float(cpu[1]),
            'phases': phases(cpu[2]), 'walls': phases(wall[2])}


def weight(entry):
    """For comparing (number, ...): a NaN is larger than any number."""
    return entry[0] != entry[0], entry[0]


def excess(value):
    """The positive part; a NaN stays one."""
    return float(value) if not value <= 0 else 0.0


def load(path):
    """The module of a check.py."""
    import importlib.util
    spec = importlib.util.spec_from_file_location(f'check_{path.parent.name}', path)
    module = importlib.util.module_from_spec(spec)
    sys.dont_write_bytecode = True
    spec.loader.exec_module(module)
    return module
