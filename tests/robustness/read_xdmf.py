"""Reads the sample run of write_sample.cpp.

read_xdmf.py structure DIR   checks results.xdmf with an XML parser: shapes, and that every named file is there
read_xdmf.py reader DIR      opens it with ParaView or meshio and compares times, points and values
Exit status 77 where no such reader is installed.
"""

import os
import sys
import xml.etree.ElementTree as ElementTree

POINTS, FRAMES = 24, 3
WIDTHS = {"displacement": 3, "cauchy": 9, "damage": 1}


def check(condition, message):
    if not condition:
        sys.exit(f"results.xdmf: {message}")


def structure(folder):
    root = ElementTree.parse(os.path.join(folder, "results.xdmf")).getroot()
    check(root.tag == "Xdmf" and root.get("Version") == "3.0", "is not XDMF 3.0")
    check(root.find("Domain/Information").get("Value") == 'sample <"&"> ü', "title is not kept")
    collection = root.find("Domain/Grid")
    check(collection.get("CollectionType") == "Temporal", "no temporal collection")
    grids = collection.findall("Grid")
    check([float(grid.find("Time").get("Value")) for grid in grids] == [0.0, 0.5, 1.0], "times differ")
    for grid in grids:
        topology = grid.find("Topology")
        check(topology.get("TopologyType") == "Polyvertex" and topology.get("NodesPerElement") == "1", "no Polyvertex topology")
        check(topology.find("DataItem") is not None, "no explicit connectivity")
        widths = {a.get("Name"): {"Scalar": 1, "Vector": 3, "Tensor": 9}[a.get("AttributeType")] for a in grid.findall("Attribute")}
        check(widths == {"id": 1, "material_id": 1, "volume": 1, **WIDTHS}, f"fields are {widths}")
        for item in grid.iter("DataItem"):
            file, dataset = item.text.split(":")
            check(not os.path.isabs(file) and os.path.exists(os.path.join(folder, file)), f"{file} is missing")
            check(item.get("Dimensions").split()[0] == str(POINTS), f"{dataset} has {item.get('Dimensions')}")


def with_paraview(folder):
    from paraview import servermanager, simple

    for reader in (simple.Xdmf3ReaderS, simple.Xdmf3ReaderT, simple.XDMFReader):
        if reader is simple.XDMFReader:
            source = reader(FileNames=[os.path.join(folder, "results.xdmf")])
        else:
            source = reader(FileName=[os.path.join(folder, "results.xdmf")])
        times = list(source.TimestepValues)
        check(times == [0.0, 0.5, 1.0], f"{reader.__name__}: times {times}")
        for frame, time in enumerate(times):
            source.UpdatePipeline(time)
            data = servermanager.Fetch(source)
            if data.IsA("vtkMultiBlockDataSet"):
                data = data.GetBlock(0)
            check(data.GetNumberOfPoints() == POINTS, f"{reader.__name__}: {data.GetNumberOfPoints()} points")
            check(data.GetNumberOfCells() == POINTS, f"{reader.__name__}: {data.GetNumberOfCells()} cells")
            check(data.GetPoint(23) == (3.0, 2.0, 1.0), f"{reader.__name__}: last point {data.GetPoint(23)}")
            for name, width in WIDTHS.items():
                array = data.GetPointData().GetArray(name)
                check(array is not None and array.GetNumberOfComponents() == width, f"{reader.__name__}: {name} is wrong")
                check(array.GetComponent(23, width - 1) == 100 * frame + 24 * width - 1, f"{reader.__name__}: values of {name}")
        print(f"{reader.__name__}: {len(times)} frames, {data.GetNumberOfCells()} cells, "
              f"{data.GetPointData().GetNumberOfArrays()} fields")


def with_meshio(folder):
    import meshio

    with meshio.xdmf.TimeSeriesReader(os.path.join(folder, "results.xdmf")) as reader:
        check(reader.num_steps == FRAMES, f"meshio: {reader.num_steps} frames")
        for frame in range(FRAMES):
            time, fields, _ = reader.read_data(frame)
            check(time == 0.5 * frame, f"meshio: time {time}")
            check(fields["displacement"][23, 2] == 100 * frame + 71, "meshio: values of displacement")
        print(f"meshio: {reader.num_steps} frames")


def main():
    mode, folder = sys.argv[1:3]
    if mode == "structure":
        return structure(folder)
    for reader, module in ((with_paraview, "paraview"), (with_meshio, "meshio")):
        try:
            __import__(module)
        except ImportError:
            continue
        return reader(folder)
    print("neither ParaView nor meshio is installed")
    return 77


if __name__ == "__main__":
    sys.exit(main())
