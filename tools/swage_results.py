"""Reading what Swage writes: VTKHDF results and CSV histories. Used by tools/plot and tests."""
import csv
import json
import pathlib
import re

import h5py
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

LINE, TRIANGLE, TETRAHEDRON = 3, 5, 10
CORNERS = {LINE: 2, TRIANGLE: 3, TETRAHEDRON: 4}


def attribute(thing, name, default=''):
    """A text attribute of an HDF5 file or dataset."""
    value = thing.attrs.get(name, default)
    return value.decode() if isinstance(value, bytes) else str(value)


class Step:
    """The grid of one step with all parts together; points shared by parts appear once a part.

    `cells[kind]` holds the corners of the cells of a kind, `numbers[kind]` their places in the
    arrays of `cell_fields`.
    """

    def __init__(self, time, parts):
        self.time = time
        points, self.cells, self.numbers = [], {}, {}
        corners = {kind: [] for kind in CORNERS}
        numbers = {kind: [] for kind in CORNERS}
        n_point = n_cell = 0
        for part in parts:
            points.append(vtk_to_numpy(part.GetPoints().GetData()).reshape(-1, 3))
            kinds = vtk_to_numpy(part.GetCellTypes()) if part.GetNumberOfCells() else []
            kinds = numpy.asarray(kinds)
            start = vtk_to_numpy(part.GetCells().GetOffsetsArray())
            ids = vtk_to_numpy(part.GetCells().GetConnectivityArray())
            for kind, width in CORNERS.items():
                found = numpy.flatnonzero(kinds == kind)
                corners[kind].append(ids[start[found][:, None] + numpy.arange(width)] + n_point)
                numbers[kind].append(found + n_cell)
            n_point += len(points[-1])
            n_cell += len(kinds)
        self.points = numpy.concatenate(points)
        for kind, width in CORNERS.items():
            self.cells[kind] = numpy.concatenate(corners[kind]).reshape(-1, width).astype(int)
            self.numbers[kind] = numpy.concatenate(numbers[kind]).astype(int)
        self.point_fields = self._fields([part.GetPointData() for part in parts])
        self.cell_fields = self._fields([part.GetCellData() for part in parts])
        self.n_cell = n_cell

    @staticmethod
    def _fields(groups):
        names = [groups[0].GetArrayName(i) for i in range(groups[0].GetNumberOfArrays())]
        return {name: numpy.concatenate([vtk_to_numpy(group.GetArray(name)) for group in groups])
                for name in names}


def result_of(stem):
    """The result file of a run, CASE.vtkhdf, or the index of its files: CASE.hdf.series."""
    path, index = pathlib.Path(f'{stem}.vtkhdf'), pathlib.Path(f'{stem}.hdf.series')
    return index if index.exists() and not path.exists() else path


class Results:
    """A result file, or a series of files of one step each by its index."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        if self.path.suffix == '.series':
            entries = json.loads(self.path.read_text(encoding='utf-8'))['files']
            self._files = [self.path.with_name(entry['name']) for entry in entries]
            self.times = [float(entry['time']) for entry in entries]
        else:
            self._files = [self.path]
        with h5py.File(self._files[0] if self._files else self.path, 'r') as file:
            root = file['VTKHDF']
            self.title = attribute(file, 'title', self.path.stem)
            self.dimension = attribute(file, 'dimension').lower()
            self.length_unit = attribute(root['Points'], 'unit') if 'Points' in root else ''
            self.time_unit = (attribute(root['Steps/Values'], 'unit') if 'Steps' in root
                              else attribute(file, 'time').rpartition(' ')[2])
            self.units = {name: attribute(data, 'unit') for group in ('PointData', 'CellData')
                          for name, data in root[group].items()}
            self.descriptions = {name: attribute(data, 'description')
                                 for group in ('PointData', 'CellData')
                                 for name, data in root[group].items()}
            n_step = int(root['Steps'].attrs['NSteps']) if 'Steps' in root else len(self._files)
        if n_step == 0:
            raise ValueError(f'{self.path} holds no finished step')
        self._reader = None
        self._read = None
        if self.path.suffix != '.series':
            self._open(self.path)
            information = self._reader.GetOutputInformation(0)
            key = vtkStreamingDemandDrivenPipeline.TIME_STEPS()
            self.times = [information.Get(key, i) for i in range(information.Length(key))]

    def _open(self, path):
        if path == self._read:
            return
        self._reader = vtkHDFReader()
        self._reader.SetFileName(str(path))
        self._reader.UpdateInformation()
        self._read = path

    def step(self, number):
        """One step by its number, from 0; negative numbers count from the end."""
        time = self.times[number]
        if self.path.suffix == '.series':
            self._open(self._files[number])
            self._reader.Update()
        else:
            # pyvista's reader has no times, hence VTK's own
            self._reader.UpdateTimeStep(time)
        data = self._reader.GetOutputDataObject(0)
        if data.IsA('vtkPartitionedDataSet'):
            parts = [data.GetPartition(i) for i in range(data.GetNumberOfPartitions())]
        else:
            parts = [data]
        parts = [part for part in parts if part is not None and part.GetNumberOfPoints() > 0]
        if not parts:
            raise ValueError(f'{self.path}: the step at time {time} has no points')
        return Step(time, parts)


class History:
    """A history table: `columns[name]` is an array, `units[name]` its unit."""

    def __init__(self, path):
        with open(path, newline='', encoding='utf-8') as file:
            rows = list(csv.reader(file))
        if len(rows) < 2:
            raise ValueError(f'{path} holds no row')
        self.columns, self.units = {}, {}
        # A run that was killed may leave half a line
        rows = [rows[0]] + [row for row in rows[1:] if len(row) == len(rows[0])]
        for title, *values in zip(*rows):
            name, unit = re.fullmatch(r'\s*(\S+)\s*(?:\[(.*)\])?\s*', title).groups()
            self.columns[name] = numpy.array(values, dtype=float)
            self.units[name] = unit or ''

    def vectors(self, kind):
        """Columns `<kind>_<name>_x` and so on: {name: {component: values}} and their unit."""
        found, unit = {}, ''
        for title, values in self.columns.items():
            match = re.fullmatch(rf'{kind}_(.+)_([xyzr])', title)
            if match:
                found.setdefault(match[1], {})[match[2]] = values
                unit = self.units[title]
        return found, unit
