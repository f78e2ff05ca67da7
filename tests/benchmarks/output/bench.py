"""Writing results: megabytes a second beside a plain copy, and memory that it takes of the ranks.

The same grid on 1, 2 and 4 ranks: 20 steps of 50 000 cells, or 5 of 500 000. `others`: the largest
of the ranks but rank 0. All ranks write together; should rank 0 collect, its memory would grow
with the number of ranks, and with the grid, as that of the others does not. What MPI-IO buffers on
rank 0 (32 MB in Open MPI) does not grow.
"""
import os
import time


def run(context):
    cells, steps = (50000, 20) if context.quick else (500000, 5)
    context.title('ranks', 'MB', 'elapsed [s]', 'MB/s', 'plain MB/s', 'rank 0 [MB]', 'others [MB]')
    for ranks in (1, 2, 4):
        answer = context.run_benchmark('bench_output', context.folder, str(cells), str(steps),
                                       ranks=ranks)
        size, seconds, *memory = (float(word) for word in answer.split())
        context.line(ranks, size, seconds, size / seconds, plain(context, size),
                     memory[2] - memory[0], memory[3] - memory[1])
    (context.folder / 'bench_output.vtkhdf').unlink()


def plain(context, size):
    """Megabytes a second of one process that writes as many bytes, in pieces of a megabyte."""
    path, piece = context.folder / 'plain', os.urandom(10**6)
    start = time.monotonic()
    with open(path, 'wb') as file:
        for _ in range(round(size)):
            file.write(piece)
    seconds = time.monotonic() - start
    path.unlink()
    return size / seconds
