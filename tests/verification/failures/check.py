"""Forced failures: the right exit code, a message with the remedy, no result harmed, no hang.

A small billet under friction, saved after every increment, is denied what it needs: room on the
disk, memory, convergence, its mesh, its restart files, its results, its folder, peace while it
writes. Each failure on one and two ranks. What is counted are faults, 0 in every row; the run
prints them. A run that can go on afterwards must end as one that nothing happened to, to the last
bit on one rank and to 1e-8 on two.
"""
import random
import resource
import signal
import time

import swage_mesh_writer
import swage_process
from swage_process import Process, differences, deviation, run as run_case, write_case

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' /
&mesh file = '{mesh}.msh' /
&body name = 'billet' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'hardening' /
&flow_stress name = 'hardening' kind = 'linear' yield_stress = 200 hardening_modulus = 300 /
&tool name = 'upper' shape = 'plane' point = {top} normal = {down} motion = 'press' /
&tool name = 'lower' shape = 'plane' point = 0, 0, 0 normal = {up} /
&motion name = 'press' velocity = {velocity} /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.1 /
&contact name = 'top' slave = 'billet' master = 'upper' friction = 'dry' /
&contact name = 'bottom' slave = 'billet' master = 'lower' friction = 'dry' /
&step duration = 1 increments = {increments} maximum_cuts = {cuts} /
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = {iterations} /
&output double_precision = .true. {output} /
&restart {restart} /
"""
# The upper block has a round foot and is held by its contact alone.
BODIES = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = 'bodies.msh' /
&body name = 'lower' material = 'steel' group = 'LOWER_BODY' /
&body name = 'upper' material = 'steel' group = 'UPPER_BODY' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'hardening' /
&flow_stress name = 'hardening' kind = 'linear' yield_stress = 200 hardening_modulus = 300 /
&boundary name = 'base' kind = 'fixed' group = 'LOWER_BOTTOM' /
&boundary name = 'top' group = 'UPPER_TOP' {top} /
&contact name = 'middle' slave = 'UPPER_BOTTOM' master = 'LOWER_TOP' penalty_factor = 1000 /
&step duration = 1 increments = 1 maximum_cuts = 1 /
&solver tolerance = 1e-10 maximum_iterations = 3 /
"""
PLANE = {'dimension': 'axisymmetric', 'mesh': 'billet', 'top': '0, 15, 0', 'down': '0, -1, 0',
         'up': '0, 1, 0', 'velocity': '0, -2, 0'}
FINE = {**PLANE, 'mesh': 'fine'}
SOLID = {'dimension': '3d', 'mesh': 'block', 'top': '0, 0, 15', 'down': '0, 0, -1', 'up': '0, 0, 1',
         'velocity': '0, 0, -2'}
RESTART = '.restart.h5'
PREVIOUS = '.restart.previous.h5'
TOLERANCE = 1e-8
# What a program prints that did not end by its own will.
CRASHES = ('acktrace', 'SIGSEGV', 'SIGFPE', 'SIGABRT', 'SIGBUS', 'untime error', 'Error allocating',
           'MPI_ABORT', 'exited on signal')


def text(shape=None, **changes):
    keys = {'increments': 10, 'cuts': 10, 'iterations': 30, 'output': '', 'restart': 'every = 1'}
    return CASE.format(**{**(shape or PLANE), **keys, **changes})


def run(context):
    context.rectangle('billet', 5, 6, lambda x, y: (10 * x, 15 * y))
    context.rectangle('other', 5, 6, lambda x, y: (10 * x, 15 * y + 0.1 * x * (1 - x) * y * (1 - y)))
    context.box('block', 12, 12, 12, lambda x, y, z: (10 * x, 10 * y, 15 * z))
    context.bodies('bodies', {
        'LOWER': swage_mesh_writer.rectangle_mesh(6, 4, lambda x, y: (20 * x, 5 * y)),
        'UPPER': swage_mesh_writer.rectangle_mesh(
            7, 5, lambda x, y: (5 + 10 * x, 5 + 8 * y + 0.4 * (1 - y) * (2 * x - 1)**2))})
    context.rectangle('fine', 60, 60, lambda x, y: (10 * x, 15 * y))
    write_case(context, 'whole', text())
    code, output = run_case(context, 'whole')
    if code != 0:
        raise swage_process.Fault(f'whole: exit code {code}\n{output}')
    for ranks in (1, 2):
        for failure in FAILURES:
            faults = failure(context, ranks)
            for fault in faults:
                print(f'  {failure.__name__}, {ranks} ranks: {fault}', flush=True)
            yield context.zero(f'{(failure.__doc__ or "").strip().splitlines()[0]} {ranks} ranks: '
                               'faults', len(faults), 0)


def disk_full(context, ranks):
    """Disk full while results grow."""
    name = f'disk_{ranks}'
    write_case(context, name, text(FINE))
    process = Process(context, name, ranks=ranks)
    path = wait_for_save(context, name, process, 2)
    # More than a restart file asks for
    process.limit(resource.RLIMIT_FSIZE, path.stat().st_size + 100000)
    code, output = process.finish()
    faults = judge(code, 6, output, [f'no room for {name}.vtkhdf', 'make room'])
    code, output = run_case(context, name, ['--restart'], ranks)
    faults += judge(code, 0, output, ['goes on from'])
    if len(swage_process.fields(context.folder / f'{name}.vtkhdf')) != 11:
        faults.append('not all results are there')
    return faults


def disk_full_meanwhile(context, ranks):
    """Disk full while a result is being written."""
    name = f'meanwhile_{ranks}'
    faults = []
    generator = random.Random(5)
    for _ in range(4 if ranks == 1 else 8):
        write_case(context, name, text(FINE, restart='interval = 0'))
        process = Process(context, name, ranks=ranks)
        process.wait_for_row(2)
        path = context.folder / f'{name}.vtkhdf'
        size = path.stat().st_size
        while process.process.poll() is None and path.stat().st_size == size:
            time.sleep(0.0002)
        time.sleep(generator.uniform(0, 0.01))
        process.limit(resource.RLIMIT_FSIZE, path.stat().st_size)
        code, output = process.finish()
        faults += judge(code, 6, output, [f'no room for {name}.vtkhdf'])
        # The result in hand is finished, in the room that it was given
        if len(swage_process.fields(path)) < 3:
            faults.append('results are missing')
    return faults


def disk_full_for_restart(context, ranks):
    """Disk full for the restart file alone: the run goes on."""
    name = f'room_{ranks}'
    write_case(context, name, text(FINE, output="fields = 'body' every = 10"))
    process = Process(context, name, ranks=ranks)
    path = wait_for_save(context, name, process, 2)
    # More than a result of one field asks for
    process.limit(resource.RLIMIT_FSIZE, path.stat().st_size - 1)
    code, output = process.finish()
    faults = judge(code, 0, output, [f'warning: no room for {name}{RESTART}', 'make room'])
    code, output = run_case(context, name, ['--restart'], ranks)
    faults += judge(code, 0, output, [f'goes on from {name}{RESTART}'])
    return faults


def memory_short(context, ranks):
    """Memory short for the factors."""
    name = f'memory_{ranks}'
    write_case(context, name, text(SOLID))
    process = Process(context, name, ranks=ranks)
    # The cells are built, the factors are not
    while not process.path.with_suffix('.sta').exists() and process.process.poll() is None:
        time.sleep(0.0005)
    process.limit(resource.RLIMIT_AS, lambda size: size + 20000000 // ranks)
    code, output = process.finish()
    return judge(code, 5, output, ['memory is short', f'{name}.nml'])


def no_convergence(context, ranks):
    """No convergence at the smallest step."""
    name = f'hopeless_{ranks}'
    write_case(context, name, text(increments=2, cuts=1, iterations=3))
    code, output = run_case(context, name, ranks=ranks)
    faults = judge(code, 4, output, ['increment 1', 'Give more increments or cuts', '--restart',
                                     'contact top: 6 of 17 conditions touch',
                                     'changed their state in the last 5 iterations',
                                     'of a cell inside, at node '])
    # With what it lacked the run goes on
    context.folder.joinpath(f'{name}.nml').write_text(text(), encoding='utf-8')
    code, output = run_case(context, name, ['--restart'], ranks)
    return faults + judge(code, 0, output, []) + compare(context, name, 2, fields=False)


def no_convergence_between_bodies(context, ranks):
    """No convergence between bodies: which contact, and why."""
    name = f'bodies_{ranks}'
    faults = []
    for top, words in (
            ("kind = 'velocity' velocity = 0, -1",
             ['contact middle: ', ' of 8 conditions touch, 8 changed their state',
              ' of a cell inside, at node ', 'a smaller penalty_factor']),
            ("kind = 'pressure' pressure = -500",
             ['no contact touches: a body that no boundary holds rests on nothing'])):
        write_case(context, name, BODIES.format(top=top))
        code, output = run_case(context, name, ranks=ranks)
        faults += judge(code, 4, output, ['no convergence', 'largest force at node ', *words])
    return faults


def restart_file_damaged(context, ranks):
    """Restart file cut or altered: the one before it is taken."""
    faults = []
    generator = random.Random(7)
    for how in ('cut', 'empty', 'altered', 'header') if ranks == 1 else ('altered',):
        name = f'damaged_{ranks}'
        saved(context, name, ranks)
        path = context.folder / f'{name}{RESTART}'
        content = bytearray(path.read_bytes())
        if how == 'cut':
            content = content[:len(content) * 2 // 3]
        elif how == 'empty':
            content = b''
        else:
            place = generator.randrange(100) if how == 'header' else \
                generator.randrange(512, len(content))
            content[place] ^= 1 << generator.randrange(8)
        path.write_bytes(content)
        code, output = run_case(context, name, ['--restart'], ranks)
        # A header may say the same when a blank or the remark has changed
        words = [] if how == 'header' else ['warning: ', path.name, f'goes on from {name}{PREVIOUS}']
        faults += [f'{how}: {fault}' for fault in judge(code, 0, output, words)
                   + compare(context, name, ranks)]
    return faults


def restart_files_damaged(context, ranks):
    """Both restart files damaged."""
    name = f'both_{ranks}'
    saved(context, name, ranks)
    for suffix in (RESTART, PREVIOUS):
        path = context.folder / f'{name}{suffix}'
        path.write_bytes(path.read_bytes()[:-1])
    before = contents(context, name)
    code, output = run_case(context, name, ['--restart'], ranks)
    return judge(code, 6, output, [f'{name}{RESTART}', f'{name}{PREVIOUS}', 'without --restart']) \
        + unharmed(context, name, before)


def restart_of_another_mesh(context, ranks):
    """Restart file of another mesh, of another case."""
    name = f'alien_{ranks}'
    saved(context, name, ranks)
    before = contents(context, name)
    faults = []
    for change, words in ((text({**PLANE, 'mesh': 'other'}), 'mesh'),
                          (text().replace("'upper'", "'ram'"), 'tools')):
        context.folder.joinpath(f'{name}.nml').write_text(change, encoding='utf-8')
        code, output = run_case(context, name, ['--restart'], ranks)
        faults += judge(code, 2, output, [f'{name}{RESTART}', 'another case', words])
    return faults + unharmed(context, name, before)


def mesh_damaged(context, ranks):
    """Mesh file altered in twenty places."""
    name = f'mesh_{ranks}'
    saved(context, name, ranks)
    before = contents(context, name)
    whole = (context.folder / 'billet.msh').read_bytes()
    generator = random.Random(11)
    faults = []
    for _ in range(20 if ranks == 1 else 4):
        content = bytearray(whole)
        for _ in range(3):
            content[generator.randrange(len(content))] = generator.randrange(256)
        (context.folder / f'{name}.msh').write_bytes(content)
        context.folder.joinpath(f'{name}.nml').write_text(text({**PLANE, 'mesh': name}),
                                                          encoding='utf-8')
        code, output = run_case(context, name, ['--restart'], ranks)
        # Another mesh, a faulty one, or one without the groups of the case
        if code not in (2, 3):
            faults.append(f'exit code {code}')
        faults += judge(code, code, output, ['swage: error: '])
    return faults + unharmed(context, name, before)


def signals_while_writing(context, ranks):
    """Signals every other millisecond, also while files are written."""
    name = f'storm_{ranks}'
    write_case(context, name, text())
    faults, options, n_run = [], [], 0
    code = 75
    while code == 75 and n_run < 40:
        process = Process(context, name, options, ranks)
        start = process.n_row() if options else 0
        process.wait_for_row(start + 1)
        while process.process.poll() is None and process.n_row() < start + 4:
            process.send(signal.SIGUSR1, to_ranks=True)
            time.sleep(0.002)
        # TERM ends the ranks of mpirun at once: there the stop file does
        if ranks == 1:
            process.send(signal.SIGTERM)
        elif process.process.poll() is None:
            (context.folder / f'{name}.stop').touch()
        code, output = process.finish()
        (context.folder / f'{name}.stop').unlink(missing_ok=True)
        faults += judge(code, code, output, [])
        options = ['--restart']
        n_run += 1
    if code != 0:
        faults.append(f'exit code {code} after {n_run} runs')
    return faults + compare(context, name, ranks)


def folder_not_writable(context, ranks):
    """Folder of the results that cannot be written, that is not there, that is a file."""
    name = f'folder_{ranks}'
    write_case(context, name, text())
    faults = []
    for prefix, words in (('/sys/swage', ['make the folder /sys writable']),
                          ('nowhere/swage', ['nowhere', 'mkdir -p']),
                          ('billet.msh/swage', ['is a file, not a folder'])):
        code, output = run_case(context, name, ['--output', prefix], ranks)
        faults += judge(code, 6, output, words)
    return faults


def results_missing(context, ranks):
    """Results that are missing, shorter, or those of another run, at a restart."""
    faults = []
    for suffix in ('.csv', '.sta', '.vtkhdf'):
        for how in ('missing', 'short', 'other'):
            name = f'results_{ranks}'
            saved(context, name, ranks)
            path = context.folder / f'{name}{suffix}'
            if how == 'missing':
                path.unlink()
            elif how == 'short':
                path.write_bytes(path.read_bytes()[:100])
            elif suffix != '.vtkhdf':
                path.write_bytes(path.read_bytes().replace(b'1', b'2'))
            else:
                continue
            before = contents(context, name)
            code, output = run_case(context, name, ['--restart'], ranks)
            faults += [f'{suffix} {how}: {fault}' for fault in
                       judge(code, 6, output, [path.name]) + unharmed(context, name, before)]
        if ranks > 1:
            break
    return faults


FAILURES = (disk_full, disk_full_meanwhile, disk_full_for_restart, memory_short, no_convergence,
            no_convergence_between_bodies,
            restart_file_damaged, restart_files_damaged, restart_of_another_mesh, mesh_damaged, signals_while_writing,
            folder_not_writable, results_missing)


def saved(context, name, ranks):
    """A run that was stopped after some increments, two of them saved."""
    write_case(context, name, text())
    process = Process(context, name, ranks=ranks)
    process.wait_for_row(4)
    (context.folder / f'{name}.stop').touch()
    code, output = process.finish()
    (context.folder / f'{name}.stop').unlink(missing_ok=True)
    if code not in (0, 75):
        raise swage_process.Fault(f'{name}: exit code {code}\n{output[-2000:]}')


def wait_for_save(context, name, process, n):
    """The restart file of increment n, as soon as it is there: nothing is being written then."""
    path = context.folder / f'{name}{RESTART}'
    process.wait_for_row(n)
    while process.process.poll() is None:
        try:
            if f'increment {n},'.encode() in path.read_bytes()[:512]:
                break
        except OSError:
            pass
        time.sleep(0.0005)
    return path


def judge(code, expected, output, words):
    """Faults of a run: another exit code, words that its message lacks, signs of a crash, NaN."""
    faults = [] if code == expected else [f'exit code {code}, not {expected}:\n{output[-1500:]}']
    messages = [line for line in output.splitlines()
                if line.startswith(('swage: error: ', 'warning: ', 'goes on from', 'swage: '))]
    if expected not in (0, 75) and sum(line.startswith('swage: error: ') for line in messages) != 1:
        faults.append('not one message')
    faults += [f'no message says: {word}\n{output[-1500:]}' for word in words
               if word not in '\n'.join(messages)]
    return faults + [f'it crashed: {mark}\n{output[-1500:]}' for mark in CRASHES if mark in output]


def contents(context, name):
    return {path.name: path.read_bytes() for path in context.folder.glob(f'{name}.*')
            if path.suffix not in ('.nml', '.msh', '.log')}


def unharmed(context, name, before):
    """Faults of files that should have been left alone."""
    after = contents(context, name)
    return [f'{file} was harmed' for file in before if after.get(file) != before[file]] \
        + [f'{file} was left behind' for file in after if file not in before]


def resumed(context, name, ranks):
    """Faults of a run that goes on to its end."""
    code, output = run_case(context, name, ['--restart'], ranks)
    return judge(code, 0, output, []) + compare(context, name, ranks)


def compare(context, name, ranks, fields=True):
    """Faults of results that should be those of the whole run."""
    whole, path = context.folder / 'whole', context.folder / name
    if ranks == 1:
        found = differences(path, whole)
        return [f'differ from the whole run: {", ".join(found)}'] if found else []
    history = context.read_history(path.with_suffix('.csv'))
    error = deviation(history, context.read_history(whole.with_suffix('.csv')))
    faults = [] if error <= TOLERANCE else [f'the history differs by {error} from the whole run']
    if fields and len(swage_process.fields(path.with_suffix('.vtkhdf'))) != 11:
        faults.append('not all results are there')
    return faults
