"""Restarts: a run that was saved, stopped or killed ends as one that was not.

A billet upset between tools under friction that bonds and breaks, with multipliers on one side and
a penalty on the other, pressed, lifted and pressed again, with a kink between points of the grid:
everything that an increment hands to the next is in use. Bits are compared on one rank: the history, the status file,
all fields. Sums over ranks have another order on another number of ranks, and differ by rounding:
1e-8 at a Newton tolerance of 1e-10.

Killed at any time means: at increments and moments within them from a fixed seed. A moment is
seldom in the middle of a write, so a run is killed after write number N of a file, too (see
kill_writes.c): numbers from a fixed seed, and closely spaced ones through one result.
"""
import random
import shutil
import signal
import subprocess
import time

import swage_process
from swage_process import Process, differences, deviation, run as run_case, write_case

CASE = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' /
&mesh file = 'billet.msh' /
&body name = 'billet' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'swift'
  kinematic_modulus = 100 /
&flow_stress name = 'swift' kind = 'swift' strength = 500 prestrain = 0.01 exponent = 0.2 /
&tool name = 'upper' shape = 'plane' point = 0, 15, 0 normal = 0, -1, 0 motion = 'press' /
&tool name = 'lower' shape = 'plane' point = 0, 0, 0 normal = 0, 1, 0 /
&motion name = 'press' direction = 0, -1, 0 time = 0, 1, 1.23, 2 displacement = 0, 1.5, 1.49, 2.5 /
&friction name = 'bond' kind = 'coulomb' coefficient = 0.12 method = 'return_mapping' /
&friction name = 'limit' kind = 'coulomb_tresca' coefficient = 0.1 tresca_factor = 0.5 /
&contact name = 'top' slave = 'billet' master = 'upper' friction = 'bond' /
&contact name = 'bottom' slave = 'billet' master = 'lower' friction = 'limit'
  enforcement = 'augmented_lagrangian' /
&step name = 'press' duration = 1 increments = 10 /
&step name = 'again' duration = 1 increments = 10 /
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = 30 /
&output double_precision = .true. every = 2 /
&restart {restart} /
"""
KILLS = 10
# Files by a part of their names, and after how many of their writes a run is killed; and the kills
# while one result is written, of RESULTS.
WRITES = {'.vtkhdf': 16, '.restart': 2, '.csv': 1, '.sta': 1}
RESULTS, CLOSE = 11, 8
TOLERANCE = 1e-8


def run(context):
    context.rectangle('billet', 6, 9, lambda x, y: (10 * x, 15 * y))
    write_case(context, 'whole', CASE.format(restart=''))
    expect(context, 'whole', 0)
    whole = context.folder / 'whole'
    yield from bits(context, whole)
    yield from requests(context, whole)
    yield from kills(context, whole)
    yield from writes(context, whole)
    yield from ranks(context, whole)


def bits(context, whole):
    """Go on from three points, in contact, after lifting and at the second pressing."""
    for every, options in ((9, ['from']), (13, ['--restart']), (19, ['--restart'])):
        write_case(context, 'part', CASE.format(restart=f'every = {every}'))
        expect(context, 'part', 0)
        if options == ['from']:
            # The one before the last
            text = CASE.format(restart="from = 'part.restart.previous.h5'")
            (context.folder / 'part.nml').write_text(text, encoding='utf-8')
            options = []
        expect(context, 'part', 0, options)
        yield context.zero(f'saved every {every} increments: results that differ in a bit',
                           len(differences(context.folder / 'part', whole)), 0)


def requests(context, whole):
    """Signals, the stop file and the clock, on one rank and, but for TERM, on two."""
    for ranks in (1, 2):
        # USR1: save and go on
        write_case(context, 'usr1', CASE.format(restart='interval = 0'))
        process = Process(context, 'usr1', ranks=ranks)
        process.wait_for_row(4)
        process.send(signal.SIGUSR1)
        code, _ = process.finish()
        saved = (context.folder / 'usr1.restart.h5').exists()
        yield context.row(f'USR1, {ranks} ranks: exit code and restart files', code + saved, 1, 0)
        yield same(context, f'USR1, {ranks} ranks', 'usr1', whole, ranks)

        # A stop file: save and stop
        write_case(context, 'stop', CASE.format(restart='interval = 0'))
        process = Process(context, 'stop', ranks=ranks)
        process.wait_for_row(5)
        (context.folder / 'stop.stop').touch()
        code, _ = process.finish()
        left = (context.folder / 'stop.stop').exists()
        yield context.row(f'stop file, {ranks} ranks: exit code, and files left', code + left, 75, 0)
        expect(context, 'stop', 0, ['--restart'], ranks)
        yield same(context, f'stop file, {ranks} ranks', 'stop', whole, ranks)

    # TERM: the same
    write_case(context, 'term', CASE.format(restart='interval = 0'))
    process = Process(context, 'term')
    process.wait_for_row(6)
    process.send(signal.SIGTERM)
    code, _ = process.finish()
    yield context.row('TERM: exit code', code, 75, 0)
    expect(context, 'term', 0, ['--restart'])
    yield same(context, 'TERM', 'term', whole, 1)

    # The clock: every run saves itself after one increment and stops; the last finds nothing to do
    write_case(context, 'clock', CASE.format(restart='wall_clock_limit = 1e-3'))
    codes = [run_case(context, 'clock')[0]]
    while codes[-1] == 75 and len(codes) < 100:
        codes.append(run_case(context, 'clock', ['--restart'])[0])
    yield context.row('a limit of the clock: last exit code', codes[-1], 0, 0)
    yield context.row('a limit of the clock: runs',
                      len(codes), whole.with_suffix('.sta').read_text().count('done'), 0)
    yield same(context, 'a limit of the clock', 'clock', whole, 1)


def kills(context, whole):
    """Ten times in a run on one rank, three times on two."""
    generator = random.Random(20)
    for ranks, n_kill in ((1, KILLS), (2, 3)):
        write_case(context, 'killed', CASE.format(restart='every = 1'))
        points = sorted(generator.sample(range(1, 20), n_kill))
        options, unreadable = [], 0
        for point in points:
            process = Process(context, 'killed', options, ranks)
            process.wait_for_row(point)
            time.sleep(generator.uniform(0, 0.03))
            process.kill()
            unreadable += not readable(context)
            options = ['--restart'] if saved(context) else []
        expect(context, 'killed', 0, options, ranks)
        yield context.zero(f'killed {n_kill} times, {ranks} ranks: results that could not be read',
                           unreadable, 0)
        yield same(context, f'killed {n_kill} times, {ranks} ranks', 'killed', whole, ranks)


def writes(context, whole):
    """In the middle of writing a file, on one rank."""
    compiler = shutil.which('cc')
    if compiler is None:
        yield context.skip('killed in the middle of a write', 'there is no C compiler cc')
        return
    library = context.folder / 'kill_writes.so'
    subprocess.run([compiler, '-shared', '-fPIC', '-o', library, context.source / 'kill_writes.c',
                    '-ldl'], check=True)
    generator = random.Random(41)
    unreadable, failed, different = 0, 0, 0
    for part, n_kill in WRITES.items():
        variables = {'LD_PRELOAD': str(library), 'KILL_FILE': f'/killed{part}'}
        for number in numbers(context, part, n_kill, generator, variables):
            write_case(context, 'killed', CASE.format(restart='every = 1'))
            code, _ = run_case(context, 'killed', variables=variables | {'KILL_WRITE': str(number)})
            if code != -signal.SIGKILL:
                raise swage_process.Fault(f'not killed at write {number} of {part}')
            there = saved(context)
            unreadable += there and not readable(context)
            code, output = run_case(context, 'killed', ['--restart'] if there else [])
            if code != 0:
                print(f'  killed at write {number} of {part}: {output[-300:]}', flush=True)
                failed += 1
            else:
                different += bool(differences(context.folder / 'killed', whole))
    what = 'killed in the middle of a write'
    yield context.zero(f'{what}: results that could not be read', unreadable, 0)
    yield context.zero(f'{what}: restarts that failed', failed, 0)
    yield context.zero(f'{what}: results that differ in a bit', different, 0)


def numbers(context, part, n_kill, generator, variables):
    """After which writes to kill."""
    write_case(context, 'killed', CASE.format(restart='every = 1'))
    count = context.folder / 'writes'
    run_case(context, 'killed', variables=variables | {'KILL_COUNT': str(count)})
    n_write = int(count.read_text())
    found = generator.sample(range(1, n_write + 1), n_kill)
    if part == '.vtkhdf':
        first = n_write // 3
        found += range(first, first + n_write // RESULTS, max(1, n_write // RESULTS // CLOSE))
    return found


def saved(context):
    """Whether a run that was killed left a restart file; without, it begins again."""
    return any((context.folder / f'killed.restart{word}.h5').exists() for word in ('', '.previous'))


def readable(context):
    """Whether it left results that can be read."""
    try:
        swage_process.fields(context.folder / 'killed.vtkhdf')
    except (OSError, KeyError, ValueError, IndexError, RuntimeError):
        return False
    return True


def ranks(context, whole):
    """Go on with one rank more."""
    reference = context.read_history(whole.with_suffix('.csv'))
    for before, after in ((1, 2), (2, 3)):
        write_case(context, 'ranks', CASE.format(restart='every = 12'))
        expect(context, 'ranks', 0, ranks=before)
        expect(context, 'ranks', 0, ['--restart'], after)
        history = context.read_history(context.folder / 'ranks.csv')
        yield context.zero(f'from {before} to {after} ranks: history',
                           deviation(history, reference), TOLERANCE)


def same(context, what, name, whole, ranks):
    """The results of a run against those of the whole one: bits on one rank, numbers on more."""
    if ranks == 1:
        return context.zero(f'{what}: results that differ in a bit',
                            len(differences(context.folder / name, whole)), 0)
    reference = context.read_history(whole.with_suffix('.csv'))
    history = context.read_history(context.folder / f'{name}.csv')
    return context.zero(f'{what}: history', deviation(history, reference), TOLERANCE)


def expect(context, name, code, options=(), ranks=1):
    """Run, and refuse another exit code."""
    found, output = run_case(context, name, options, ranks)
    if found != code:
        raise swage_process.Fault(f'{name}: exit code {found}, not {code}\n{output[-2000:]}')
