"""bristle.sweep: runs a scene over a grid of parameters, on threads here or on a Dask cluster."""

import atexit
import collections
import json
import os
import shutil
import sys
import tempfile
import threading
import time
import warnings

import numpy as np

from ._bristle import Error, _check_table_file, _SweepRows, _SweepStudy
from ._calls import checked
from ._words import _table

_DTYPES = {"number": np.float64, "whole": np.int64, "hash": np.uint64, "text": object}


class SweepTable:
    """Rows of a study, in the order of their index. table["tip.kinetic"] is a column as a numpy array."""

    def __init__(self, study, rows):
        self._rows, self._study = rows, study.hash
        self._columns, self._units = {}, {}
        cells = [json.loads(line) for line in rows.lines()]
        for c, column in enumerate(study.columns):
            self._columns[column["name"]] = _column([row[c] for row in cells], column["type"])
            self._units[column["name"]] = column["unit"]

    @property
    def columns(self) -> "Dict[str, numpy.ndarray]":
        """Columns by name, as numpy arrays."""
        return self._columns

    @property
    def units(self) -> "Dict[str, str]":
        """Units of the columns by name; "" for pure numbers and texts."""
        return self._units

    @property
    def study(self) -> "str":
        """Hash of scene, motion files, ranges, seeds and results."""
        return self._study

    @property
    def hash(self) -> "str":
        """Hash of all rows without measured times: the table hash of `bristle sweep`."""
        return self._rows.table_hash()

    def __getitem__(self, name: "str") -> "numpy.ndarray":
        if name not in self._columns:
            raise KeyError(f"{name}; there are: {', '.join(self._columns)}")
        return self._columns[name]

    def __len__(self) -> "int":
        return len(self._columns["index"])

    @checked
    def write(self, path: "os.PathLike") -> "None":
        """Writes the table as CSV. For NetCDF: to_xarray().to_netcdf(path)."""
        self._rows.write(os.fspath(path))

    def to_pandas(self):
        """Returns a pandas.DataFrame; units are in its attrs["units"]."""
        import pandas

        frame = pandas.DataFrame(self._columns)
        frame.attrs["units"] = dict(self._units)
        return frame

    def to_xarray(self):
        """Returns an xarray.Dataset over `row`, with units in the variables' attrs."""
        import xarray

        return xarray.Dataset({name: ("row", values, {"units": self._units[name]})
                               for name, values in self._columns.items()})

    def __str__(self):
        return self._rows.summary()

    def __repr__(self):
        return f"{self}\n<bristle.SweepTable: {len(self)} rows, {len(self._columns)} columns, hash {self.hash}>"

    def _repr_html_(self):
        rows = range(min(len(self), 10))
        heads = [f"{name} {unit}" for name, unit in self._units.items()]
        return (_table(heads, [[column[r] for column in self._columns.values()] for r in rows]) +
                f"<p>{len(rows)} of {len(self)} rows</p>")


def _column(cells, kind):
    """Makes an array of a column's cells. A missing result (None) becomes NaN; in whole numbers and hashes, of rows that
    were refused, 0."""
    if kind == "hash":
        cells = [int(cell, 16) if cell is not None else 0 for cell in cells]
    elif kind == "whole":
        cells = [cell if cell is not None else 0 for cell in cells]
    return np.array([np.nan if cell is None and kind == "number" else cell for cell in cells], dtype=_DTYPES[kind])


def _text(value):
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ",".join(_text(v) for v in value) + "]"
    if isinstance(value, dict):
        return "{" + ",".join(f"{k}=" + (f'"{v}"' if isinstance(v, str) else _text(v)) for k, v in value.items()) + "}"
    return repr(value.item() if isinstance(value, np.generic) else value)


def _ranges(vary):
    """Returns a range "a:b:n" unchanged, and a list of values as a text with commas."""
    if not isinstance(vary, dict):
        return [os.fspath(v) for v in vary]
    return [f"{key}={r if isinstance(r, str) else ','.join(_text(v) for v in r)}" for key, r in vary.items()]


def _settings(values):
    return [f"{key}={_text(value)}" for key, value in (values or {}).items()]


@checked
def sweep(scene: "os.PathLike", vary: "Union[Dict, List[str]]", *, repeat: "int" = 1, seed: "Optional[int]" = None, set: "Optional[Dict]" = None,
          reference: "Optional[Dict]" = None, report: "Union[str, List[str]]" = (),
          window: "Optional[List[float]]" = None, steps: "Optional[int]" = None,
          out: "Optional[os.PathLike]" = None, threads: "int" = 0, isa: "Optional[str]" = None,
          client: "Optional[distributed.Client]" = None) -> "bristle.SweepTable":
    """Runs a scene once for every point of the ranges and returns a SweepTable, as `bristle sweep` does.

    vary: {"material.wood.kinetic": "0.2:0.6:5", "patch.tip.bristles": [100, 1000]}, or a list of such texts KEY=RANGE.
    repeat: rows at each point, with seeds by index.
    set, reference: {key: value}. report: names of results. window: (from, until), s. out: table file, CSV;
    until it is done its rows stand in `out`.part, from which the same call goes on.
    threads: rows at a time, 0 = one per core. client: a distributed.Client; its workers run the rows, may come and go
    meanwhile, and need this module but no common disk. The table is the same bit for bit either way.
    Warns of rows that the scene refused: their numbers are NaN, and the column failure says why. Raises bristle.Error,
    also if all rows were refused.
    """
    table = "" if out is None else os.fspath(out)
    _check_table_file(table)
    study = _SweepStudy(scene, _ranges(vary), repeat=repeat, seed=seed, set=_settings(set),
                        reference=_settings(reference), report=[report] if isinstance(report, str) else list(report),
                        window="" if window is None else f"{_text(window[0])}:{_text(window[1])}", steps=steps)
    rows = _SweepRows(study, table)
    try:
        if client is None:
            rows.run_on_threads(study, threads, isa or "")
        else:
            for row in _rows_by_dask(client, study.recipe(), rows.missing(), isa or ""):
                rows.add(row)
        if table:
            rows.write(table)
        rows.remove()
        refusal, of_all = rows.refusal()
        if of_all:
            raise Error(refusal)
        if refusal:
            warnings.warn("bristle.sweep: " + refusal, stacklevel=3)  # the caller of the checked function
    finally:
        rows.close()
    return SweepTable(study, rows)


# ---------------------------------------------------------------------------------------------------------- on workers

_studies = {}
_lock = threading.Lock()


def _study_here(recipe):
    """Returns this process's study of the recipe. Its files lie in a temporary folder that is deleted with the process.
    """
    with _lock:
        if recipe not in _studies:
            folder = tempfile.mkdtemp(prefix="bristle_sweep_")
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
            _studies.clear()  # keeps one study only: a worker outlives its studies
            _studies[recipe] = _SweepStudy.from_recipe(recipe, folder)
        return _studies[recipe]


def _same(recipe):
    return recipe


def _run_task(recipe, indices, isa):
    study = _study_here(recipe)
    start = time.perf_counter()
    return [study.run_row(index, isa) for index in indices], time.perf_counter() - start


# ------------------------------------------------------------------------------------------------------- by a scheduler

_TASK_SECONDS = 0.5  # s of work in a task; the scheduler takes a few milliseconds for each
_MOST_TRIES = 5  # times that rows are tried whose worker dies, each on up to four workers


class _Sizes:
    """Chooser of the number of rows in a task, from the time that earlier rows took."""

    def __init__(self, client, rows):
        self._client, self._left, self._per_row = client, rows, None
        self._threads, self._looked = 1, -10.0

    def threads(self):
        if time.monotonic() - self._looked > 1.0:  # workers may have come or gone
            self._threads = max(1, sum(self._client.nthreads().values()))
            self._looked = time.monotonic()
        return self._threads

    def done(self, rows, seconds):
        self._left -= rows
        now = seconds / rows
        self._per_row = now if self._per_row is None else 0.7 * self._per_row + 0.3 * now

    def rows(self):
        if self._per_row is None:
            return 1
        wanted = int(_TASK_SECONDS / max(self._per_row, 1e-6))
        return max(1, min(wanted, self._left // (4 * self.threads())))


def _rows_by_dask(client, recipe, indices, isa):
    """Yields rows as they are done. Rows of a lost worker run again on another."""
    if not client.nthreads():  # before the import, so that another object is refused where Dask is not installed
        print("bristle: the scheduler has no workers yet; waiting for them", file=sys.stderr)
    from distributed import as_completed

    # Sends the recipe with each task instead of scattering it, since scattered data are lost with their worker.
    shared = client.submit(_same, recipe, pure=False)
    waiting, parts, futures = collections.deque(indices), {}, {}
    tries, sizes, flying = collections.Counter(), _Sizes(client, len(indices)), as_completed()

    def send(part):
        future = client.submit(_run_task, shared, part, isa, pure=False)
        parts[future.key], futures[future.key] = part, future
        flying.add(future)

    def fill():
        while waiting and len(parts) < 2 * sizes.threads() + 2:
            send([waiting.popleft() for _ in range(min(sizes.rows(), len(waiting)))])

    try:
        fill()
        for future in flying:
            part = parts.pop(future.key)
            futures.pop(future.key)
            rows = _result(future, part, tries)
            if rows is None:
                if shared.status in ("cancelled", "lost", "error"):
                    shared = client.submit(_same, recipe, pure=False)
                send(part)
                continue
            sizes.done(len(part), rows[1])
            fill()
            yield from rows[0]
    finally:
        client.cancel(list(futures.values()))


def _result(future, part, tries):
    """Returns the rows of a finished task and their time; None if its worker was lost."""
    from distributed.scheduler import KilledWorker

    try:
        if future.status not in ("cancelled", "lost"):
            return future.result()
        lost = "the scheduler lost the task"
    except KilledWorker as error:
        lost = f"workers died: {error}"
    tries[part[0]] += 1
    if tries[part[0]] >= _MOST_TRIES:
        raise Error(f"row {part[0]} was lost {_MOST_TRIES} times: {lost}")
    return None
