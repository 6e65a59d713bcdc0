"""The folder of a run."""

import pathlib
import re
import tomllib

import h5py
import numpy

from .tables import Named, read_columns


class Results:
    """Everything that a run has left in its folder; read when asked for.

    Points are in input order: those of a lattice with x fastest. All numbers are float64 in the units of the scene (SI in those of perikit).
    A run that is still going, or was killed, shows its finished frames.
    """

    def __init__(self, folder):
        """folder: of a run, or its results.h5. Raises FileNotFoundError where it holds no results."""
        folder = pathlib.Path(folder)
        self.folder = folder.parent if folder.name == "results.h5" else folder
        if not (self.folder / "results.h5").exists():
            raise FileNotFoundError(f"{self.folder} holds no results.h5: not the folder of a perikit run")

    def __repr__(self):
        return f"<perikit results in {self.folder}: {len(self.position)} points, {len(self.frames)} frames>"

    def _reference(self, name):
        with h5py.File(self.folder / "reference.h5") as file:
            return file[name][()]

    @property
    def position(self):
        """Positions in the reference state, (points, 3) [m]."""
        return self._reference("position")

    @property
    def volume(self):
        """Volumes, (points,) [m^3]."""
        return self._reference("volume")

    @property
    def material_id(self):
        """0 for [material], k for the k-th [[region]], (points,)."""
        return self._reference("material_id")

    @property
    def sets(self):
        """Indices of the points of each named set, by name."""
        with h5py.File(self.folder / "reference.h5") as file:
            return Named("set", self.folder, {name[4:]: file[name][()] for name in file if name.startswith("set_")})

    @property
    def frames(self):
        """Indices of the frames that are there, ascending."""
        return sorted(int(path.stem) for path in (self.folder / "frames").glob("*.h5") if path.stem.isdigit())

    def _frame(self, frame):
        """The file of a frame and its index, counted from the last where it is negative."""
        frames = self.frames
        index = frames[frame] if -len(frames) <= frame < 0 else frame
        if index not in frames:
            raise IndexError(f"no frame {frame} in {self.folder}; there are {frames[0]} ... {frames[-1]}" if frames else f"no frames in {self.folder}")
        return h5py.File(self.folder / "frames" / f"{index:08d}.h5"), index

    @property
    def times(self):
        """Time [s], or load parameter, of each frame."""
        times = []
        for frame in self.frames:
            with self._frame(frame)[0] as file:
                times.append(float(file.attrs["time"]))
        return numpy.array(times)

    def fields(self, frame=-1):
        """Names of the point fields that a frame holds."""
        with self._frame(frame)[0] as file:
            return sorted(re.sub("^state_", "state:", name) for name in file)

    def field(self, name, frame=-1):
        """A point field of a frame (negative: from the last): scalars (points,), vectors (points, 3), tensors (points, 3, 3)."""
        file, index = self._frame(frame)
        with file:
            dataset = re.sub("^state:", "state_", name)
            if dataset not in file:
                raise KeyError(f"no field '{name}' in frame {index} of {self.folder}; there are: {', '.join(self.fields(frame))}")
            values = file[dataset][()]
        return values.reshape(-1, 3, 3) if values.ndim == 2 and values.shape[1] == 9 else values

    def deformed(self, frame=-1, factor=1.0):
        """Positions plus `factor` times the displacement, (points, 3) [m]."""
        return self.position + factor * self.field("displacement", frame)

    def table(self, frame=-1):
        """A frame as columns by name, one row a point: x, y, z, volume and every field, a column for each component (displacement_x, cauchy_xy)."""
        position = self.position
        columns = Named("column", f"frame {frame} of {self.folder}", {axis: position[:, k] for k, axis in enumerate("xyz")})
        columns["volume"] = self.volume
        for name in self.fields(frame):
            values = self.field(name, frame)
            if values.ndim == 1:
                columns[name] = values
            for index in numpy.ndindex(values.shape[1:]) if values.ndim > 1 else ():
                columns[name + "_" + "".join("xyz"[k] for k in index)] = values[(slice(None), *index)]
        return columns

    @property
    def history(self):
        """history.csv as columns by name: step, time, energies [J], and what [output] history asks for."""
        return read_columns(self.folder / "history.csv")

    @property
    def scene(self):
        """The scene as it was run, every default written out, as nested dictionaries."""
        with open(self.folder / "scene.toml", "rb") as file:
            return tomllib.load(file)

    @property
    def log(self):
        """run.log as text."""
        return (self.folder / "run.log").read_text(encoding="utf-8")
