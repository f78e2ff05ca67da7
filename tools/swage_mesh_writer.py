"""Structured meshes and simple geometries for verification cases; standard library only.

Meshes are written as Gmsh files, version 2.2, with named physical groups. `place` maps a point of
the unit square or cube to its place; coordinates are written with all digits.
"""
import itertools


def write_msh(path, points, groups):
    """Write a mesh: `groups` is a list of (name, dimension, cells), cells as tuples of point
    numbers from 0."""
    lines = ['$MeshFormat', '2.2 0 8', '$EndMeshFormat', '$PhysicalNames', str(len(groups))]
    lines += [f'{dimension} {tag} "{name}"' for tag, (name, dimension, _) in enumerate(groups, 1)]
    lines += ['$EndPhysicalNames', '$Nodes', str(len(points))]
    for number, point in enumerate(points, 1):
        x, y, z = (*point, 0.0)[:3]
        lines.append(f'{number} {x!r} {y!r} {z!r}')
    lines += ['$EndNodes', '$Elements', str(sum(len(cells) for _, _, cells in groups))]
    number = 0
    for tag, (_, _, cells) in enumerate(groups, 1):
        for cell in cells:
            number += 1
            kind = {1: 15, 2: 1, 3: 2, 4: 4}[len(cell)]
            lines.append(f'{number} {kind} 2 {tag} {tag} ' + ' '.join(str(p + 1) for p in cell))
    lines.append('$EndElements')
    path.write_text('\n'.join(lines) + '\n', encoding='utf-8')
    return path


def determinant(points, cell):
    """Twice the area of a triangle, six times the volume of a tetrahedron; signed."""
    first = points[cell[0]]
    edges = [[b - a for a, b in zip(first, points[p])] for p in cell[1:]]
    if len(edges) == 2:
        (a, b), (c, d) = (edge[:2] for edge in edges)
        return a * d - b * c
    (a, b, c), (d, e, f), (g, h, i) = edges
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def oriented(points, cells):
    """The cells, with two points exchanged where the orientation is negative."""
    return [cell if determinant(points, cell) > 0 else (*cell[:-2], cell[-1], cell[-2])
            for cell in cells]


def bodies(points, cells, name_cell):
    """Groups of cells: BODY, or what `name_cell` says of the middle of each."""
    groups = {}
    for cell in oriented(points, cells):
        middle = [sum(x) / len(cell) for x in zip(*(points[p] for p in cell))]
        groups.setdefault(name_cell(*middle) if name_cell else 'BODY', []).append(cell)
    return [(name, len(group[0]) - 1, group) for name, group in groups.items()]


def floats(point):
    return tuple(float(x) for x in point)


def write_bodies(path, parts):
    """Bodies that share no node, each the points and groups of rectangle_mesh or box_mesh; groups
    are called after them: {'UPPER': ...} has UPPER_BODY, UPPER_TOP and so on."""
    points, groups = [], []
    for body, (own_points, own_groups) in parts.items():
        first = len(points)
        points += own_points
        groups += [(f'{body}_{name}', dimension, [tuple(p + first for p in cell) for cell in cells])
                   for name, dimension, cells in own_groups]
    return write_msh(path, points, groups)


def write_rectangle(path, *arguments, **keywords):
    """The file of a rectangle_mesh."""
    return write_msh(path, *rectangle_mesh(*arguments, **keywords))


def rectangle_mesh(n, m, place=None, diagonal='rising', name_edge=None, name_cell=None):
    """n x m rectangles of two triangles. Groups BODY, LEFT, RIGHT, BOTTOM, TOP of the unit square.

    diagonal: 'rising' from (i, j) to (i + 1, j + 1), 'falling', or 'alternating' (symmetric under
    reflection where n and m are even).
    name_edge: the group of an edge, given that side's name and the middle of the edge, where a side
    has several.
    name_cell: the group of a triangle, given its middle, in place of BODY.
    """
    place = place or (lambda x, y: (x, y))
    points = [floats(place(i / n, j / m)) for j in range(m + 1) for i in range(n + 1)]

    def at(i, j):
        return j * (n + 1) + i

    cells = []
    for j, i in itertools.product(range(m), range(n)):
        a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
        rising = diagonal == 'rising' or (diagonal == 'alternating' and (i + j) % 2 == 0)
        cells += [(a, b, c), (a, c, d)] if rising else [(a, b, d), (b, c, d)]
    sides = {'LEFT': [(at(0, j + 1), at(0, j)) for j in range(m)],
             'RIGHT': [(at(n, j), at(n, j + 1)) for j in range(m)],
             'BOTTOM': [(at(i, 0), at(i + 1, 0)) for i in range(n)],
             'TOP': [(at(i + 1, m), at(i, m)) for i in range(n)]}
    edges = {}
    for side, pairs in sides.items():
        for pair in pairs:
            middle = [sum(x) / 2 for x in zip(*(points[p] for p in pair))]
            edges.setdefault(name_edge(side, *middle) if name_edge else side, []).append(pair)
    return points, [*bodies(points, cells, name_cell),
                    *((name, 1, pairs) for name, pairs in edges.items())]


def write_box(path, *arguments, **keywords):
    """The file of a box_mesh."""
    return write_msh(path, *box_mesh(*arguments, **keywords))


def box_mesh(n, m, k, place=None, name_cell=None):
    """n x m x k boxes of six tetrahedra around the rising diagonal (Kuhn). Groups BODY, XMIN, XMAX,
    YMIN, YMAX, ZMIN, ZMAX of the unit cube.

    name_cell: the group of a tetrahedron, given its middle, in place of BODY.
    """
    place = place or (lambda x, y, z: (x, y, z))
    size = (n, m, k)
    lattice = [(i, j, l) for l in range(k + 1) for j in range(m + 1) for i in range(n + 1)]
    points = [floats(place(i / n, j / m, l / k)) for i, j, l in lattice]
    step = (1, n + 1, (n + 1) * (m + 1))

    cells = []
    for l, j, i in itertools.product(range(k), range(m), range(n)):
        corner = i * step[0] + j * step[1] + l * step[2]
        for order in itertools.permutations(range(3)):
            way = [corner]
            for axis in order:
                way.append(way[-1] + step[axis])
            cells.append(tuple(way))

    groups = bodies(points, cells, name_cell)
    for axis, end in itertools.product(range(3), (0, 1)):
        faces = []
        for cell in cells:
            on = [p for p in cell if lattice[p][axis] == end * size[axis]]
            if len(on) == 3:
                faces.append(tuple(on))
        groups.append(('XYZ'[axis] + ('MIN', 'MAX')[end], 2, faces))
    return points, groups


def cylinder_geometry(radius, height, size, quarter=False):
    """Gmsh text of a cylinder about z from z = 0. Groups BODY, BOTTOM, TOP, SIDE; of the quarter
    x, y > 0 also XMIN and YMIN, its planes of symmetry."""
    angle = 'Pi/2' if quarter else '2*Pi'
    near = 1e-6 * max(radius, height)
    boxes = [('BOTTOM', (-1, -1, 0), (1, 1, 0)), ('TOP', (-1, -1, 1), (1, 1, 1))]
    if quarter:
        boxes += [('XMIN', (0, -1, 0), (0, 1, 1)), ('YMIN', (-1, 0, 0), (1, 0, 1))]
    text = [f'SetFactory("OpenCASCADE");', f'r = {radius!r}; h = {height!r}; e = {near!r};',
            f'Cylinder(1) = {{0, 0, 0, 0, 0, h, r, {angle}}};',
            f'MeshSize {{:}} = {size!r};', 'Physical Volume("BODY") = {1};', 'rest() = Surface {:};']
    for name, low, high in boxes:
        corners = ', '.join([f'{a}*r - e, {b}*r - e, {c}*h - e' for a, b, c in [low]]
                            + [f'{a}*r + e, {b}*r + e, {c}*h + e' for a, b, c in [high]])
        text += [f's() = Surface In BoundingBox {{{corners}}};',
                 f'Physical Surface("{name}") = s();', 'rest() -= s();']
    text.append('Physical Surface("SIDE") = rest();')
    return '\n'.join(text) + '\n'
