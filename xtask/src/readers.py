"""Opens every file of a folder with the programs that people read such files with, and checks what they see.

The folder is filled by `cargo xtask readers`. Prints one line per reader and file; the exit code is 1 if any check fails.
A reader that is not installed is reported and skipped; --all makes that a failure.
"""

import importlib
import json
import os
import sys

folder = sys.argv[1]
failures, skipped = 0, set()


def path(name):
    return os.path.join(folder, name)


def reads(package, *names):
    """Runs a check of one package on each file; the function gets the module, or a list of them, and the path."""

    def run(check):
        global failures
        try:
            module = importlib.import_module(package)
        except ImportError as error:
            skipped.add(f"{package} ({error})")
            return
        for name in names:
            try:
                check(module, path(name))
                print(f"{package}: {name}")
            except Exception as error:  # a reader may raise anything; every failure is reported
                failures += 1
                print(f"{package}: {name}: FAILED: {type(error).__name__}: {error}")

    return run


def equal(found, expected, what):
    if found != expected:
        raise AssertionError(f"{what} is {found}, not {expected}")


def volume(name):
    """The samples that the example `ramp` writes, axes (z, y, x, channel) or (z, y, x)."""
    import numpy

    z, y, x = numpy.mgrid[0:3, 0:4, 0:5]
    base = os.path.basename(name)
    if base.startswith("ids"):
        return (1 + x + 5 * y + 20 * z).astype("u4")
    if base.startswith("distances"):
        return (-0.25 * (x + 5 * y + 20 * z)).astype("f4")
    return numpy.stack([10 * x, 10 * y, 10 * z], axis=-1).astype("u1")


def same(found, name):
    import numpy

    expected = volume(name)
    equal(tuple(found.shape), expected.shape, "the shape")
    if not numpy.array_equal(found, expected):
        raise AssertionError("the samples differ")


def all_of(extension):
    return [f"{kind}.{extension}" for kind in ["ramp", "ids", "distances"]]


@reads("numpy", *all_of("npy"))
def _(numpy, file):
    same(numpy.load(file), file)


@reads("nrrd", *all_of("nrrd"))
def _(nrrd, file):
    samples, header = nrrd.read(file, index_order="C")
    same(samples, file)
    directions = header["space directions"][-3:]
    equal([float(directions[i][i]) for i in range(3)], [0.5, 1.0, 2.0], "the spacing")


@reads("tifffile", *all_of("tif"))
def _(tifffile, file):
    with tifffile.TiffFile(file) as tiff:
        same(tiff.asarray(), file)
        equal(tiff.is_imagej, True, "ImageJ's stack")
        equal(tiff.imagej_metadata["spacing"], 2.0, "the spacing along z")
        numerator, denominator = tiff.pages[0].tags["XResolution"].value
        equal(denominator / numerator, 0.5, "the spacing along x")


@reads("h5py", *all_of("h5"))
def _(h5py, file):
    with h5py.File(file) as hdf5:
        container = hdf5["DataContainers/ImageDataContainer"]
        equal(list(container["_SIMPL_GEOMETRY/SPACING"][:]), [0.5, 1.0, 2.0], "the spacing")
        equal(list(container["_SIMPL_GEOMETRY/DIMENSIONS"][:]), [5, 4, 3], "the size")
        (cells,) = container["CellData"].values()
        samples = cells[:]
        same(samples if samples.shape[-1] == 3 else samples[..., 0], file)


@reads("zarr", *all_of("zarr"))
def _(zarr, file):
    group = zarr.open_group(file, mode="r")
    samples = group["0"][:]
    same(samples.transpose(1, 2, 3, 0) if samples.shape[0] == 3 else samples[0], file)
    (scale, _) = group.attrs["ome"]["multiscales"][0]["datasets"][0]["coordinateTransformations"]
    equal(scale["scale"], [1, 2, 1, 0.5], "the spacing along c, z, y, x")


@reads("vtk", *all_of("vti"))
def _(vtk, file):
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkXMLImageDataReader()
    reader.SetFileName(file)
    reader.Update()
    image = reader.GetOutput()
    equal(image.GetSpacing(), (0.5, 1.0, 2.0), "the spacing")
    equal(image.GetNumberOfCells(), 60, "the number of cells")
    cells = vtk_to_numpy(image.GetCellData().GetArray(0))
    same(cells.reshape((3, 4, 5, -1)).squeeze(), file)


def polygons(vtk, reader, file):
    reader.SetFileName(file)
    reader.Update()
    return reader.GetOutput()


def closed_box(vtk, mesh):
    """The box of edges 1, 2, 3 that `stereology shape` writes is closed and has its volume."""
    triangles = vtk.vtkTriangleFilter()
    clean = vtk.vtkCleanPolyData()
    clean.SetInputData(mesh)
    triangles.SetInputConnection(clean.GetOutputPort())
    mass = vtk.vtkMassProperties()
    mass.SetInputConnection(triangles.GetOutputPort())
    mass.Update()
    if abs(mass.GetVolume() - 6.0) > 1e-4:
        raise AssertionError(f"the volume is {mass.GetVolume()}, not 6")
    edges = vtk.vtkFeatureEdges()
    edges.SetInputConnection(triangles.GetOutputPort())
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.Update()
    equal(edges.GetOutput().GetNumberOfCells(), 0, "the number of open edges")


@reads("vtk", "box.ply", "box.obj", "box.stl")
def _(vtk, file):
    reader = {".ply": vtk.vtkPLYReader, ".obj": vtk.vtkOBJReader, ".stl": vtk.vtkSTLReader}[file[-4:]]()
    closed_box(vtk, polygons(vtk, reader, file))


def particles():
    with open(path("packing.csv")) as table:
        return sum(1 for _ in table) - 1


@reads("vtk", "packing.vtp")
def _(vtk, file):
    equal(polygons(vtk, vtk.vtkXMLPolyDataReader(), file).GetNumberOfPoints(), particles(), "the number of particles")


@reads("vtk", "surfaces.vtp")
def _(vtk, file):
    mesh = polygons(vtk, vtk.vtkXMLPolyDataReader(), file)
    arrays = mesh.GetCellData().GetNumberOfArrays()
    if mesh.GetNumberOfPolys() < 20 * particles() or arrays == 0:
        raise AssertionError(f"{mesh.GetNumberOfPolys()} faces and {arrays} arrays")


@reads("vtk", "carved.ply")
def _(vtk, file):
    mesh = polygons(vtk, vtk.vtkPLYReader(), file)
    colours = mesh.GetPointData().GetScalars()
    equal(colours.GetNumberOfTuples(), mesh.GetNumberOfPoints(), "the number of colours")


@reads("vtk", "carved.glb", "atlas.glb")
def _(vtk, file):
    reader = vtk.vtkGLTFReader()
    reader.SetFileName(file)
    reader.ApplyDeformationsToGeometryOn()
    reader.Update()
    points = vtk.vtkCompositeDataGeometryFilter()
    points.SetInputConnection(reader.GetOutputPort())
    points.Update()
    if points.GetOutput().GetNumberOfPoints() < 8:
        raise AssertionError("no mesh in it")


@reads("damask", "ids.h5")
def _(damask, file):
    grid = damask.GeomGrid.load_DREAM3D(file, feature_IDs="FeatureIds")
    equal([int(n) for n in grid.cells], [5, 4, 3], "the number of cells")
    equal([round(float(s), 6) for s in grid.size], [2.5, 4.0, 6.0], "the size")
    same(grid.material.transpose(2, 1, 0).astype("u4"), file)


@reads("ovito.io", "packing.xyz")
def _(io, file):
    data = io.import_file(file).compute()
    equal(data.particles.count, particles(), "the number of particles")
    with open(path("packing.json")) as packing:
        box = json.load(packing)["box"]
    sides = box if isinstance(box, list) else [box] * 3
    for axis in range(3):
        if abs(data.cell[axis, axis] - sides[axis]) > 1e-6 * sides[axis]:
            raise AssertionError(f"the box is {data.cell[axis, axis]} along axis {axis}, not {sides[axis]}")
    if "Aspherical Shape" not in data.particles or "Orientation" not in data.particles:
        raise AssertionError(f"particles have {list(data.particles.keys())} only")


for package in sorted(skipped):
    print(f"not installed, so not checked: {package}")
if failures or (skipped and "--all" in sys.argv):
    sys.exit(1)
