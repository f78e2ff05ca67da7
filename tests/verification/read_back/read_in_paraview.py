"""For pvpython: read_in_paraview.py RESULT SUMMARY.json: what ParaView finds in a result."""
import json
import sys

from paraview import servermanager, simple


def summary(reader, time):
    """Points, cells, and the range of each component of each field at a time."""
    reader.UpdatePipeline(time)
    data = servermanager.Fetch(reader)
    ranges = {}
    for group in (data.GetPointData(), data.GetCellData()):
        for i in range(group.GetNumberOfArrays()):
            array = group.GetArray(i)
            ranges[array.GetName()] = [array.GetRange(k)
                                       for k in range(array.GetNumberOfComponents())]
    return {'time': time, 'points': data.GetNumberOfPoints(), 'cells': data.GetNumberOfCells(),
            'ranges': ranges}


source = simple.OpenDataFile(sys.argv[1])
source.UpdatePipelineInformation()
with open(sys.argv[2], 'w', encoding='utf-8') as output:
    version = simple.GetParaViewVersion()
    json.dump({'version': [version.major, version.minor],
               'steps': [summary(source, time) for time in source.TimestepValues]}, output)
