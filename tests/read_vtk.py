# What `atoll export --vtk OUT` wrote of the run in DIR, read by VTK's own readers, is what pyarrow reads of the recording.
# Prints what it compared. Arguments: DIR OUT, and the number of each step.
import glob
import json
import math
import sys

import numpy
import pyarrow.parquet
import vtk
from vtkmodules.util.numpy_support import vtk_to_numpy

COLUMNS = ["id", "kind", "velocity", "spin", "tile", "rank"]


def read(reader, path):
    reader.SetFileName(path)
    reader.Update()
    assert reader.GetErrorCode() == 0, path
    return reader.GetOutput()


def cells(grid):
    """Means of corners, areas, numbers of corners, and the columns, a row for each cell."""
    points = vtk_to_numpy(grid.GetPoints().GetData())
    assert points.dtype == numpy.float64 and not points[:, 2].any()
    ends = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    polygons = [points[corners[a:b], :2] for a, b in zip(ends, ends[1:])]
    means = numpy.array([polygon.mean(axis=0) for polygon in polygons])
    areas = []
    for polygon, mean in zip(polygons, means):
        (x, y), (u, v) = (polygon - mean).T, numpy.roll(polygon - mean, -1, axis=0).T
        areas.append((x * v - y * u).sum() / 2)
    data = grid.GetCellData()
    names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]
    columns = {name: vtk_to_numpy(data.GetArray(name)) for name in names}
    types = [grid.GetCellType(i) for i in range(grid.GetNumberOfCells())]
    return means, numpy.array(areas), numpy.diff(ends), types, columns


def area(kind):
    if "box" in kind:
        return 4 * kind["box"][0] * kind["box"][1]
    return 12 * math.sin(math.pi / 12) * kind["circle"] ** 2


def check(grid, table, kinds):
    means, areas, corners, types, columns = cells(grid)
    assert list(columns) == COLUMNS, columns
    column = {name: table[name].to_numpy() for name in table.column_names}
    assert (columns["id"] == column["id"]).all() and columns["id"].dtype.itemsize == 8
    assert (columns["kind"] == column["kind"]).all()
    assert abs(means[:, 0] - column["x"]).max() < 1e-6 and abs(means[:, 1] - column["y"]).max() < 1e-6
    velocity = numpy.stack([column["vx"], column["vy"], 0 * column["vx"]], axis=1)
    assert (columns["velocity"] == velocity).all() and (columns["spin"] == column["omega"]).all()
    expected = numpy.array([area(kinds[kind]) for kind in column["kind"]])
    assert abs(areas / expected - 1).max() < 1e-5
    assert all((n, t) == ((4, 9) if "box" in kinds[kind] else (24, 7)) for n, t, kind in zip(corners, types, column["kind"]))
    return columns


run, out, *steps = sys.argv[1:]
files = sorted(glob.glob(f"{run}/rank-*/*.parquet"))
facts = pyarrow.parquet.read_metadata(files[0]).metadata
kinds, statics = json.loads(facts[b"atoll.kinds"]), json.loads(facts[b"atoll.statics"])
columns, rows = map(int, facts[b"atoll.tiles"].decode().split("x"))
x0, y0, x1, y1 = map(float, facts[b"atoll.domain"].decode().split())
tables = {file.split("rank-")[1][:5]: pyarrow.parquet.read_table(file) for file in files}
for step in steps:
    whole = []
    for rank, table in tables.items():
        table = table.filter(pyarrow.compute.equal(table["step"], int(step)))
        piece = f"{out}/bodies-{step:0>10}/rank-{rank}.vtu"
        found = check(read(vtk.vtkXMLUnstructuredGridReader(), piece), table, kinds)
        assert (found["rank"] == int(rank)).all()
        place = [((table[k].to_numpy() - low) / (high - low) * n).astype(int).clip(0, n - 1)
                 for k, low, high, n in [("x", x0, x1, columns), ("y", y0, y1, rows)]]
        assert (found["tile"] == place[1] * columns + place[0]).all()
        whole.append(table)
    check(read(vtk.vtkXMLPUnstructuredGridReader(), f"{out}/bodies-{step:0>10}.pvtu"), pyarrow.concat_tables(whole), kinds)
    print("step", step, "bodies", sum(len(table) for table in whole), "ranks", len(whole))
means, areas, _, types, data = cells(read(vtk.vtkXMLUnstructuredGridReader(), f"{out}/statics.vtu"))
assert abs(means - numpy.stack([statics["x"], statics["y"]], axis=1)).max() < 1e-6
assert (data["kind"] == numpy.array(statics["kind"]) + len(kinds)).all() and set(types) == {9}
assert abs(areas / [area(statics["kinds"][kind]) for kind in statics["kind"]] - 1).max() < 1e-5
print("statics", len(means))
