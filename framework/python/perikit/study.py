"""The folder of a study."""

import pathlib

import numpy

from .results import Results
from .tables import read_columns


class Study:
    """The table of a study, column by column, and the results of its runs."""

    def __init__(self, folder):
        """Raises FileNotFoundError where the folder holds no table.csv."""
        self.folder = pathlib.Path(folder)
        self.columns = read_columns(self.folder / "table.csv")

    def __repr__(self):
        return f"<perikit study in {self.folder}: {len(self)} runs, columns {', '.join(self.columns)}>"

    def __len__(self):
        return len(self.columns["run"])

    def __getitem__(self, name):
        """A column: numbers, or texts where some entry is none."""
        return self.columns[name]

    def where(self, **values):
        """Rows whose columns have these values, as indices; dots of keys are written as two underscores: kinematics__type="baqp"."""
        chosen = numpy.ones(len(self), dtype=bool)
        for name, value in values.items():
            chosen &= self.columns[name.replace("__", ".")] == value
        return numpy.flatnonzero(chosen)

    def results(self, row):
        """The results of a run."""
        return Results(self.folder / "runs" / str(int(self.columns["run"][row])))
