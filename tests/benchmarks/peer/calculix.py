"""The works of the benchmark `peer` for CalculiX: input decks from Gmsh meshes, runs, forces.

One eighth of a billet is upset, as in bench.py. Forces are those of the whole billet in kN.
"""
import re
import resource
import shutil
import subprocess
import time

import swage_verification

# Gmsh numbers the last two edges of a quadratic tetrahedron the other way round
ABAQUS_ORDER = {4: [0, 1, 2, 3], 10: [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]}
# Corners of the faces of a tetrahedron, in CalculiX's order
FACES = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]
TOOL = {'width': 25.0, 'height': 5.0}


def program():
    """The path of CalculiX, or None."""
    return shutil.which('ccx')


class Mesh:
    """Nodes, tetrahedra with the groups they are of, and boundary groups of a Gmsh file, version 2.2
    ASCII."""

    def __init__(self, path):
        lines = iter(path.read_text(encoding='utf-8').splitlines())
        names, self.nodes, self.cells, self.bodies, self.groups = {}, {}, [], [], {}
        for line in lines:
            if line == '$PhysicalNames':
                for _ in range(int(next(lines))):
                    dimension, tag, name = next(lines).split(maxsplit=2)
                    names[int(dimension), int(tag)] = name.strip('"')
            elif line == '$Nodes':
                for _ in range(int(next(lines))):
                    number, *place = next(lines).split()
                    self.nodes[int(number)] = [float(x) for x in place]
            elif line == '$Elements':
                for _ in range(int(next(lines))):
                    _, kind, n_tag, *rest = (int(word) for word in next(lines).split())
                    corners = rest[n_tag:]
                    if kind in (4, 11):
                        self.cells.append([corners[i] for i in ABAQUS_ORDER[len(corners)]])
                        self.bodies.append(names[3, rest[0]])
                    elif kind in (2, 9):
                        self.groups.setdefault(names[2, rest[0]], []).append(corners)

    def nodes_of(self, group):
        return sorted({node for corners in self.groups[group] for node in corners})

    def faces_of(self, groups):
        """(cell, face) of the boundary triangles of some groups, both from 1."""
        wanted = {frozenset(corners[:3]) for group in groups for corners in self.groups[group]}
        return [(number, face + 1) for number, cell in enumerate(self.cells, 1)
                for face, corners in enumerate(FACES)
                if frozenset(cell[i] for i in corners) in wanted]


def listed(numbers):
    """Numbers in lines of at most 16."""
    numbers = list(numbers)
    return [', '.join(str(n) for n in numbers[i:i + 16]) for i in range(0, len(numbers), 16)]


def deck(mesh, work, end, coefficient=0.2, penalty=1e6, stick_slope=1e4):
    """The input of a work up to a reduction of height, in increments of 1 %."""
    kind = {4: 'C3D4', 10: 'C3D10'}[len(mesh.cells[0])]
    # CalculiX reads the first 20 characters of a number
    lines = ['*NODE, NSET=NALL']
    lines += [f'{number}, {x:.12g}, {y:.12g}, {z:.12g}' for number, (x, y, z) in mesh.nodes.items()]
    lines += [f'*ELEMENT, TYPE={kind}, ELSET=BILLET']
    for number, cell in enumerate(mesh.cells, 1):
        lines.append(f'{number}, ' + ', '.join(str(node) for node in cell))
    for name in ('XMIN', 'YMIN', 'BOTTOM', 'TOP'):
        lines += [f'*NSET, NSET={name}', *listed(mesh.nodes_of(name))]
    lines += ['*MATERIAL, NAME=STEEL', '*ELASTIC', '200000., .3', '*PLASTIC', '200., 0.',
              '1400., 4.', '*SOLID SECTION, ELSET=BILLET, MATERIAL=STEEL']
    stroke = 15.0 * end
    driven = 'TOP'
    if work == 'W2':
        first_node, first_cell = max(mesh.nodes) + 1, len(mesh.cells) + 1
        width, height = TOOL['width'], TOOL['height']
        lines.append('*NODE, NSET=TOOL')
        corners = [(0, 0), (width, 0), (width, width), (0, width)]
        for i, (x, y) in enumerate(corners * 2):
            z = 15.0 + (height if i > 3 else 0.0)
            lines.append(f'{first_node + i}, {x!r}, {y!r}, {z!r}')
        lines += ['*ELEMENT, TYPE=C3D8, ELSET=BLOCK', f'{first_cell}, '
                  + ', '.join(str(first_node + i) for i in range(8)),
                  '*MATERIAL, NAME=RIGID', '*ELASTIC', '210000., .3',
                  '*SOLID SECTION, ELSET=BLOCK, MATERIAL=RIGID',
                  '*SURFACE, NAME=SKIN, TYPE=ELEMENT']
        lines += [f'{cell}, S{face}' for cell, face in mesh.faces_of(['TOP', 'SIDE'])]
        lines += ['*SURFACE, NAME=PRESS, TYPE=ELEMENT', f'{first_cell}, S1',
                  '*SURFACE INTERACTION, NAME=DRY',
                  '*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR', f'{penalty!r}',
                  '*FRICTION', f'{coefficient!r}, {stick_slope!r}',
                  '*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE', 'SKIN, PRESS']
        driven = 'TOOL'
    increment = 0.01 / end
    lines += ['*BOUNDARY', 'XMIN, 1, 1', 'YMIN, 2, 2', 'BOTTOM, 3, 3',
              f'*STEP, NLGEOM, INC={int(1000 * end)}', '*STATIC',
              f'{increment!r}, 1., 1e-6, {increment!r}', '*BOUNDARY',
              f'{driven}, 1, 2, 0.', f'{driven}, 3, 3, {-stroke!r}',
              f'*NODE PRINT, NSET={driven}, TOTALS=ONLY', 'RF', '*END STEP']
    return '\n'.join(lines) + '\n'


def two_bodies(mesh, groups, slave, master, behaviour, kind):
    """Lines of a deck for all bodies of a mesh, with their contact."""
    cell = {4: 'C3D4', 10: 'C3D10'}[len(mesh.cells[0])]
    lines = ['*NODE, NSET=NALL']
    lines += [f'{number}, {x:.12g}, {y:.12g}, {z:.12g}' for number, (x, y, z) in mesh.nodes.items()]
    for body in sorted(set(mesh.bodies)):
        lines.append(f'*ELEMENT, TYPE={cell}, ELSET={body}')
        lines += [f'{number}, ' + ', '.join(str(node) for node in nodes)
                  for number, nodes in enumerate(mesh.cells, 1) if mesh.bodies[number - 1] == body]
    for name in groups:
        lines += [f'*NSET, NSET={name}', *listed(mesh.nodes_of(name))]
    for group in (slave, master):
        lines.append(f'*SURFACE, NAME={group}, TYPE=ELEMENT')
        lines += [f'{number}, S{face}' for number, face in mesh.faces_of([group])]
    if kind == 'NODE TO SURFACE':
        lines += [f'*SURFACE, NAME={slave}_NODES, TYPE=NODE', *map(str, mesh.nodes_of(slave))]
        slave += '_NODES'
    return [*lines, '*SURFACE INTERACTION, NAME=DRY',
            '*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR', *behaviour,
            f'*CONTACT PAIR, INTERACTION=DRY, TYPE={kind}, ADJUST=0.001', f'{slave}, {master}']


def deck_of_tool(mesh, stroke, increments, kind, coefficient=0.2, penalty=1e6, stick_slope=1e4):
    """The input of W3."""
    step = 1 / increments
    lines = two_bodies(mesh, ('XMIN', 'YMIN', 'BOTTOM', 'TOOL_TOP'), 'SKIN', 'TOOL_FACE',
                       [f'{penalty!r}', '*FRICTION', f'{coefficient!r}, {stick_slope!r}'], kind)
    lines += ['*MATERIAL, NAME=STEEL', '*ELASTIC', '200000., .3', '*PLASTIC', '200., 0.',
              '1400., 4.', '*SOLID SECTION, ELSET=BILLET, MATERIAL=STEEL',
              '*MATERIAL, NAME=HARD', '*ELASTIC', '210000., .3',
              '*SOLID SECTION, ELSET=TOOL, MATERIAL=HARD',
              '*BOUNDARY', 'XMIN, 1, 1', 'YMIN, 2, 2', 'BOTTOM, 3, 3',
              '*STEP, NLGEOM, INC=1000', '*STATIC', f'{step!r}, 1., 1e-6, {step!r}', '*BOUNDARY',
              'TOOL_TOP, 1, 2, 0.', f'TOOL_TOP, 3, 3, {-stroke!r}',
              '*NODE PRINT, NSET=TOOL_TOP, TOTALS=ONLY', 'RF', '*END STEP']
    return '\n'.join(lines) + '\n'


def deck_of_cubes(mesh, kind, penalty=1e6):
    """The input of W4."""
    lines = two_bodies(mesh, ('XMIN', 'YMIN', 'BOTTOM'), 'UPPER_FACE', 'LOWER_FACE',
                       [f'{penalty!r}'], kind)
    lines += ['*MATERIAL, NAME=STEEL', '*ELASTIC', '210000., .3',
              *(f'*SOLID SECTION, ELSET={body}, MATERIAL=STEEL' for body in ('LOWER', 'UPPER')),
              '*BOUNDARY', 'XMIN, 1, 1', 'YMIN, 2, 2', 'BOTTOM, 3, 3',
              '*ELSET, ELSET=ALL', 'LOWER, UPPER', '*STEP', '*STATIC', '1., 1.', '*DLOAD']
    lines += [f'{number}, P{face}, 100.' for number, face in mesh.faces_of(['TOP'])]
    lines += ['*EL PRINT, ELSET=ALL', 'S', '*END STEP']
    return '\n'.join(lines) + '\n'


def largest_error(path, component, value):
    """Largest distance of a component of the stress from a value, at all points of a .dat file."""
    worst = 0.0
    for line in path.read_text(encoding='utf-8').splitlines():
        words = line.split()
        if len(words) == 8 and words[0].isdigit():
            worst = max(worst, abs(float(words[2 + component]) - value))
    return worst


def run(folder, name, text, timeout):
    """Run a deck. Returns forces [kN] on the whole billet by time (0 to 1), iterations, cuts, CPU seconds and
    whether it ended."""
    (folder / f'{name}.inp').write_text(text, encoding='utf-8')
    environment = swage_verification.environment()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.monotonic()
    with open(folder / f'{name}.out', 'w', encoding='utf-8') as out:
        try:
            code = subprocess.run([program(), name], cwd=folder, env=environment, timeout=timeout,
                                  stdout=out, stderr=subprocess.STDOUT).returncode
        except subprocess.TimeoutExpired:
            code = None
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    forces = {0.0: 0.0}
    data = folder / f'{name}.dat'
    if data.exists():
        for moment, values in re.findall(r'total force .*? and time\s+(\S+)\s+([^\n]+)',
                                         data.read_text(encoding='utf-8', errors='replace')):
            forces[float(moment)] = 4e-3 * abs(float(values.split()[2]))
    status = (folder / f'{name}.sta')
    iterations = cuts = 0
    if status.exists():
        rows = [line.split() for line in status.read_text(encoding='utf-8').splitlines()]
        rows = [row for row in rows if len(row) >= 6 and row[0].isdigit()]
        iterations = sum(int(row[3]) for row in rows)
        cuts = sum(row[2].endswith('U') for row in rows)
    return {'forces': forces, 'iterations': iterations, 'cuts': cuts, 'ended': code == 0,
            'cpu': after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            'wall': time.monotonic() - start}
