"""CSV files of perikit as numpy columns."""

import csv

import numpy


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
    return {name: column([row[k] for row in rows]) for k, name in enumerate(header)}
