"""What tools/compare measures on results: penetration, roughness of the pressure, force and stroke.
Needs the environment .venv."""
import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import mutable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkStaticCellLocator

from swage_results import TETRAHEDRON, TRIANGLE

# Facets face each other when their normals are at more than this angle, as a cosine
FACING = -0.5
# A node is at the other side when it is nearer than this share of the size of a facet there
REACH = 0.3


# --- Sides

def sides(groups, contacts, folder):
    """The bodies of each contact between bodies, by number from 1: [(slaves, masters)]."""
    bodies = [group for group in groups if group.kind == 'body']
    numbers = {body.get('name', f'body_{i}'): i for i, body in enumerate(bodies, 1)}
    named = []
    for contact in contacts:
        slave, master = contact.values.get('slave', []), contact.values.get('master', [])
        # `bodies` leaves the choice of the slave to the program
        named.append((slave, master) if slave else [[name] for name in
                                                    contact.values.get('bodies', ['', ''])])
    names = {name for pair in named for side in pair for name in side}
    of_group = {}
    if names - numbers.keys():
        mesh = next(group.get('file') for group in groups if group.kind == 'mesh')
        of_group = bodies_of_groups(folder / mesh, names - numbers.keys(),
                                    {body.get('group'): i for i, body in enumerate(bodies, 1)})
    found = []
    for pair in named:
        found.append(tuple({number for name in side for number in (
            [numbers[name]] if name in numbers else of_group.get(name, []))} for side in pair))
    return found


def bodies_of_groups(mesh, names, number_of_group):
    """The bodies whose surface groups of facets are, by the nodes they share."""
    import gmsh
    gmsh.initialize(['swage', '-v', '1'])
    try:
        gmsh.open(str(mesh))
        nodes = {}
        for dimension, tag in gmsh.model.getPhysicalGroups():
            name = gmsh.model.getPhysicalName(dimension, tag) or str(tag)
            if name not in names and name not in number_of_group:
                continue
            tags = nodes.setdefault(name, set())
            for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
                for corners in gmsh.model.mesh.getElements(dimension, entity)[2]:
                    tags.update(int(corner) for corner in corners)
    finally:
        gmsh.finalize()
    return {name: [number for group, number in number_of_group.items()
                   if len(nodes[name] & nodes.get(group, set())) > 0.5 * len(nodes[name])]
            for name in names if nodes.get(name)}


# --- Penetration and pressure

class Surface:
    """The outer facets of some bodies, lines in the plane: points, corners counterclockwise seen from
    outside, normals of facets and nodes, sizes."""

    def __init__(self, step, bodies):
        kind = TETRAHEDRON if len(step.cells[TETRAHEDRON]) else TRIANGLE
        tag = step.cell_fields['body'][step.numbers[kind]]
        parts, first = [], 0
        points, pressure = [], []
        field = step.point_fields.get('contact_pressure')
        for body in sorted(bodies):
            cells = step.cells[kind][tag == body]
            if len(cells) == 0:
                continue
            # Parts of ranks repeat the points they share
            used, local = numpy.unique(cells, return_inverse=True)
            places, index = numpy.unique(step.points[used], axis=0, return_inverse=True)
            index = index.reshape(-1)
            parts.append(outer_facets(index[local.reshape(-1)].reshape(cells.shape)) + first)
            points.append(places)
            if field is not None:
                largest = numpy.zeros(len(places))
                numpy.maximum.at(largest, index, field.ravel()[used])
                pressure.append(largest)
            first += len(places)
        self.points = numpy.concatenate(points)
        self.facets = numpy.concatenate(parts)
        self.pressure = numpy.concatenate(pressure) if pressure else None
        corners = self.points[self.facets]
        if self.facets.shape[1] == 3:
            normal = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            self.size = numpy.sqrt(numpy.linalg.norm(normal, axis=1))
        else:
            along = corners[:, 1] - corners[:, 0]
            normal = numpy.column_stack([along[:, 1], -along[:, 0], 0 * along[:, 0]])
            self.size = numpy.linalg.norm(normal, axis=1)
        self.normal = normal / numpy.linalg.norm(normal, axis=1)[:, None]

    def edges(self):
        """Pairs of neighbouring nodes, each once."""
        pairs = [self.facets[:, [0, 1]]]
        if self.facets.shape[1] == 3:
            pairs += [self.facets[:, [1, 2]], self.facets[:, [2, 0]]]
        return numpy.unique(numpy.sort(numpy.concatenate(pairs), axis=1), axis=0)

    def locator(self):
        data = vtkPolyData()
        points = vtkPoints()
        points.SetData(numpy_to_vtk(numpy.ascontiguousarray(self.points), deep=True))
        data.SetPoints(points)
        n = self.facets.shape[1]
        cells = vtkCellArray()
        cells.SetData(n, numpy_to_vtkIdTypeArray(
            numpy.ascontiguousarray(self.facets.ravel(), dtype=numpy.int64), deep=True))
        if n == 3:
            data.SetPolys(cells)
        else:
            data.SetLines(cells)
        found = vtkStaticCellLocator()
        found.SetDataSet(data)
        found.BuildLocator()
        # It would not outlive the data
        found.swage_data = data
        return found


def outer_facets(cells):
    """Facets of one cell only, seen from outside counterclockwise; lines in the plane so that the
    outside is on the right."""
    if cells.shape[1] == 4:
        choices = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    else:
        choices = [[0, 1], [1, 2], [2, 0]]
    facets = numpy.concatenate([cells[:, choice] for choice in choices])
    _, first, count = numpy.unique(numpy.sort(facets, axis=1), axis=0, return_index=True,
                                   return_counts=True)
    return facets[first[count == 1]]


def depths(surface, other):
    """How deep the nodes of a surface that are near another one lie in it: numbers of nodes, and
    depths, negative outside."""
    locator, point, near = other.locator(), [0.0] * 3, []
    cell, part, square = mutable(0), mutable(0), mutable(0.0)
    box = other.points.min(axis=0), other.points.max(axis=0)
    margin = REACH * other.size.max()
    for node, outward in zip(*node_normals(surface)):
        x = surface.points[node]
        if (x < box[0] - margin).any() or (x > box[1] + margin).any():
            continue
        locator.FindClosestPoint(x, point, cell, part, square)
        facet = int(cell)
        normal = other.normal[facet]
        if square ** 0.5 > REACH * other.size[facet] or outward @ normal > FACING:
            continue
        near.append((node, -(x - numpy.array(point)) @ normal))
    nodes = numpy.array([node for node, _ in near], dtype=int)
    return nodes, numpy.array([depth for _, depth in near])


def node_normals(surface):
    """Numbers of the nodes of facets and their normals. At an edge a node has one for each smooth
    part: it comes once for each direction, of facets within 60 degrees of it."""
    n = surface.facets.shape[1]
    node, facet = surface.facets.ravel(), numpy.repeat(numpy.arange(len(surface.facets)), n)
    total = numpy.zeros((len(surface.points), 3))
    numpy.add.at(total, node, surface.normal[facet] * surface.size[facet, None] ** (n - 1))
    length = numpy.linalg.norm(total, axis=1)
    smooth = total / numpy.maximum(length, 1e-300)[:, None]
    nodes, normals = [], []
    agree = numpy.einsum('ij,ij->i', smooth[node], surface.normal[facet]) > 0.9
    sharp = numpy.zeros(len(surface.points), dtype=bool)
    sharp[node[~agree]] = True
    used = numpy.unique(node)
    nodes.append(used[~sharp[used]])
    normals.append(smooth[nodes[0]])
    # One normal a direction at edges and corners
    rows = sharp[node]
    if rows.any():
        keys = numpy.column_stack([node[rows], numpy.round(2 * surface.normal[facet[rows]])])
        _, first = numpy.unique(keys, axis=0, return_index=True)
        nodes.append(node[rows][first])
        normals.append(surface.normal[facet[rows]][first])
    return numpy.concatenate(nodes), numpy.concatenate(normals)


def measure(step, sides):
    """Penetration of both sides at a step, and the roughness of the pressure of the slaves."""
    found = {'slave': [], 'master': []}
    jumps, pressures = [], []
    for slaves, masters in sides:
        slave, master = Surface(step, slaves), Surface(step, masters)
        nodes, depth = depths(slave, master)
        found['slave'].append(depth)
        found['master'].append(depths(master, slave)[1])
        if slave.pressure is None:
            continue
        touches = numpy.zeros(len(slave.points), dtype=bool)
        touches[nodes] = True
        touches &= slave.pressure > 0
        edges = slave.edges()
        edges = edges[touches[edges].all(axis=1)]
        jumps.append(slave.pressure[edges[:, 0]] - slave.pressure[edges[:, 1]])
        pressures.append(slave.pressure[touches])
    row = {}
    for name, parts in found.items():
        deep = numpy.concatenate(parts) if parts else numpy.zeros(0)
        if len(deep):
            deep = numpy.maximum(deep, 0.0)
            row[f'{name}_maximum'] = float(deep.max())
            row[f'{name}_rms'] = float(numpy.sqrt((deep**2).mean()))
    if jumps and sum(len(part) for part in jumps):
        jump, pressure = numpy.concatenate(jumps), numpy.concatenate(pressures)
        row['roughness'] = float(numpy.sqrt((jump**2).mean()) / pressure.mean())
    return row


# --- Force and stroke

def curve(history):
    """Torque against angle of the tool that turns farthest, else the largest force against the
    largest stroke: x, y, and what they are called."""
    turns = {name[len('angle_'):]: values for name, values in history.columns.items()
             if name.startswith('angle_')}
    name = max(turns, key=lambda tool: abs(turns[tool]).max(), default=None)
    if name is not None and abs(turns[name]).max() > 1e-9:
        torques, unit = history.vectors('torque')
        y = strongest(torques[name])
        return {'x': abs(turns[name]), 'y': abs(y), 'unit': unit,
                'label': f'torque of {name} against its angle', 'stroke': 'angle [rad]'}
    moves, unit = history.vectors('position')
    kind = 'force'
    if not any(travel(components).max() > 0 for components in moves.values()):
        moves, unit = history.vectors('displacement')
        kind = 'reaction'
    if not moves:
        return None
    name = max(moves, key=lambda key: travel(moves[key]).max())
    forces, force_unit = history.vectors(kind)
    if name not in forces:
        return None
    return {'x': travel(moves[name]), 'y': abs(strongest(forces[name])), 'unit': force_unit,
            'label': f'force of {name} against its stroke', 'stroke': f'stroke [{unit}]'}


def travel(components):
    return numpy.sqrt(sum((values - values[0]) ** 2 for values in components.values()))


def strongest(components):
    return max(components.values(), key=lambda values: abs(values).max())
