"""Runs of swage that are watched, interrupted and continued; for verification cases.

    process = Process(context, 'case', ['--restart'], ranks=2)
    process.wait_for_row(5)
    process.send(signal.SIGUSR1)
    code, output = process.finish()

Standard library only, but for `fields`, which needs the environment .venv.
"""
import os
import pathlib
import resource
import signal
import subprocess
import time

from swage_verification import Fault, environment

RESULTS = ('.csv', '.sta', '.vtkhdf', '.log', '.restart.h5', '.restart.previous.h5', '.stop')
# Columns of the history that are relative to something already.
RELATIVE = ('mass_error', 'energy_error')
TIME_LIMIT = 120


def write_case(context, name, text):
    """NAME.nml in the folder of the case, without results of an earlier run."""
    for suffix in RESULTS:
        (context.folder / f'{name}{suffix}').unlink(missing_ok=True)
    (context.folder / f'{name}.nml').write_text(text, encoding='utf-8')


def run(context, name, options=(), ranks=1, variables=()):
    """Exit code and output of a run to its end."""
    return Process(context, name, options, ranks, variables).finish()


class Process:
    """A run of NAME.nml in the folder of the case; `variables` join its environment."""

    def __init__(self, context, name, options=(), ranks=1, variables=()):
        self.path = context.folder / name
        command = [str(context.swage), f'{name}.nml', *options]
        if ranks > 1:
            command = ['mpirun', '-n', str(ranks), *command]
        # A session of its own, by which all ranks are known
        self.process = subprocess.Popen(
            command, cwd=context.folder, env=environment() | dict(variables), stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding='utf-8', errors='replace',
            start_new_session=True)

    def n_row(self):
        """Finished increments, by the status file."""
        try:
            return self.path.with_suffix('.sta').read_bytes().count(b'done\n')
        except OSError:
            return 0

    def wait_for_row(self, n):
        """Wait until increment n is finished; false when the run ended before."""
        start = time.monotonic()
        while self.n_row() < n:
            if self.process.poll() is not None:
                return self.n_row() >= n
            if time.monotonic() - start > TIME_LIMIT:
                self.kill()
                raise Fault(f'{self.path.name}: no increment {n} after {TIME_LIMIT} s')
            time.sleep(0.001)
        return True

    def send(self, number, to_ranks=False):
        """A signal to swage or to mpirun, or to the ranks themselves; harmless when it has ended."""
        if to_ranks:
            self.signal_members('swage', number)
        elif self.process.poll() is None:
            self.process.send_signal(number)

    def signal_members(self, name, number):
        for member in self.members(name):
            try:
                os.kill(member, number)
            except ProcessLookupError:
                pass

    def kill(self):
        """End all ranks without warning."""
        self.signal_members('', signal.SIGKILL)
        self.process.communicate()

    def members(self, name='swage'):
        """Numbers of the processes of this run; of those whose program begins with a name."""
        found = []
        for path in pathlib.Path('/proc').glob('[0-9]*'):
            try:
                command, _, rest = (path / 'stat').read_text().partition('(')[2].rpartition(')')
                if command.startswith(name) and int(rest.split()[3]) == self.process.pid:
                    found.append(int(path.name))
            except (OSError, ValueError, IndexError):
                continue
        return found

    def limit(self, kind, value):
        """Set a limit (resource.RLIMIT_FSIZE, ...) of all ranks: a number of bytes, or a function
        that gives it from the size of the address space."""
        for number in self.members():
            try:
                pages = int(pathlib.Path(f'/proc/{number}/statm').read_text().split()[0])
                bound = value(pages * resource.getpagesize()) if callable(value) else value
                resource.prlimit(number, kind, (bound, bound))
            except (OSError, ProcessLookupError):
                continue

    def finish(self):
        """Exit code and output; a Fault when the run hangs."""
        try:
            output, _ = self.process.communicate(timeout=TIME_LIMIT)
        except subprocess.TimeoutExpired as fault:
            self.kill()
            raise Fault(f'{self.path.name}: did not end in {TIME_LIMIT} s') from fault
        return self.process.returncode, output


def fields(path):
    """All steps of a result file: [(time, {name: array})]."""
    import h5py
    steps = []
    with h5py.File(path, 'r') as file:
        root = file['VTKHDF']
        for i in range(int(root['Steps'].attrs['NSteps'])):
            first, n = int(root['Steps/PartOffsets'][i]), int(root['Steps/NumberOfParts'][i])
            arrays = {}
            for group, counts, offsets in (('PointData', 'NumberOfPoints', 'PointOffsets'),
                                           ('CellData', 'NumberOfCells', 'CellOffsets')):
                rows = int(root[counts][first:first + n].sum())
                start = int(root['Steps'][offsets][i].flat[0])
                if group == 'PointData':
                    arrays['Points'] = root['Points'][start:start + rows]
                for name in root[group]:
                    start = int(root[f'Steps/{group}Offsets'][name][i])
                    arrays[name] = root[group][name][start:start + rows]
            steps.append((float(root['Steps/Values'][i]), arrays))
    return steps


def differences(one, other):
    """What is not the same in the results of two runs, to the last bit."""
    found = []
    for suffix in ('.csv', '.sta'):
        if one.with_suffix(suffix).read_bytes() != other.with_suffix(suffix).read_bytes():
            found.append(suffix)
    steps, others = fields(one.with_suffix('.vtkhdf')), fields(other.with_suffix('.vtkhdf'))
    if len(steps) != len(others):
        found.append('number of results')
    for (time_one, arrays), (time_other, other_arrays) in zip(steps, others):
        if time_one != time_other or arrays.keys() != other_arrays.keys():
            found.append(f'result at {time_one}')
            continue
        found += [f'{name} at {time_one}' for name in arrays
                  if arrays[name].tobytes() != other_arrays[name].tobytes()]
    return found


def deviation(history, reference):
    """Largest difference of two histories: of each column by its largest value there, of what is
    relative already (errors of mass and energy, penetration by the cell size) as it is. Iterations
    do not count: one more may be needed where an error is as large as its tolerance."""
    if history.keys() != reference.keys() or len(history['time']) != len(reference['time']):
        return float('inf')
    worst = 0.0
    for name, values in reference.items():
        if name == 'iterations' or f'penetration_by_cell_{name[12:]}' in reference:
            continue
        size = max(abs(value) for value in values)
        if name in RELATIVE or name.startswith('penetration_by_cell_') or size == 0.0:
            size = 1.0
        worst = max(worst, max(abs(a - b) for a, b in zip(history[name], values)) / size)
    return worst
