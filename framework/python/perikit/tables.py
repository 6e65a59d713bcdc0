"""Columns with names, and the CSV files of perikit as such."""

import csv

import numpy


class Named(dict):
    """A dictionary of arrays that answers a name it does not have with those that it has."""

    def __init__(self, kind, place, items=()):
        """kind: what an entry is, "column"; place: where it was looked for, "out/bar/history.csv"."""
        super().__init__(items)
        self.kind, self.place = kind, place

    def __missing__(self, name):
        raise KeyError(f"no {self.kind} '{name}' in {self.place}; there are: {', '.join(self) or 'none'}")


def column(texts):
    """Numbers where all entries are numbers (an empty one is nan), else the texts themselves."""
    try:
        return numpy.array([float(text) if text else numpy.nan for text in texts])
    except ValueError:
        return numpy.array(texts)


def read_columns(path):
    """The columns of a CSV file with a header, by name, in its order."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    header, rows = rows[0], rows[1:]
    return Named("column", path, {name: column([row[k] for row in rows]) for k, name in enumerate(header)})
