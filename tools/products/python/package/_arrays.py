"""Arrays of motions and responses: numpy structured arrays over the structs that a step reads and writes."""

import numpy

from ._bristle import Error, Status, motion_dtype, response_dtype
from ._calls import checked


@checked
def motions(ids: "numpy.ndarray[numpy.uint64]", normal_load: "numpy.ndarray[numpy.float64]" = 0.0) -> "numpy.recarray":
    """Returns an array of motions for these patches, at rest under `normal_load` (N, one or one per patch).

    Columns are views: motions.displacement[:, 0] = dx, or motions["displacement"]. displacement: m over the step;
    velocity (m/s) is used where has_velocity is set, else displacement / dt.
    """
    ids = numpy.atleast_1d(ids)
    array = numpy.zeros(ids.size, motion_dtype).view(numpy.recarray)
    array["id"] = ids
    array["normal_load"] = normal_load
    return array


def _computed(of, name, outputs):
    """Returns the column, or the value of one record; raises bristle.Error where no step has written it."""
    # A step leaves NaN in outputs that the patch does not compute. `snaps` is a whole number and cannot be NaN, so for
    # it the column of another output is tested.
    missing = numpy.isnan(of["mean" if outputs == "mean" else "dissipated"])
    if missing.any():
        row = f" of row {int(numpy.argwhere(missing)[0][0])}" if isinstance(of, numpy.ndarray) else ""
        raise Error(f"responses.{name}{row}: no step has computed it; add the patch with "
                    f'PatchOptions(outputs="{outputs}") or "all"')
    return of[name]


def _output(name, outputs, doc):
    return property(lambda self: _computed(self, name, outputs), doc=doc)


class _Outputs:
    """Names of outputs that a patch computes only if asked."""

    mean = _output("mean", "mean", "N, force on the moving body averaged over the step.")
    dissipated = _output("dissipated", "energy", "J, lost in snaps in this step.")
    contact_loss = _output("contact_loss", "energy", "J, energy of bristles that lost contact.")
    damper_work = _output("damper_work", "energy", "J, taken by dampers and lubricant.")
    snaps = _output("snaps", "energy", "Of representatives, in this step; an infinite brush: an estimate.")


class Response(_Outputs, numpy.record):
    """The response of one patch: a row of bristle.Responses."""


class Responses(_Outputs, numpy.recarray):
    """Responses of a step. Columns are views, by name and by attribute.

    end, elastic, damper, mean: N, on the moving body; status: flags of bristle.Status. Where a patch was not asked for
    mean or energy, responses["mean"] is NaN and responses.mean raises bristle.Error.
    """

    def check(self) -> "bristle.Responses":
        """Raises bristle.Error for the first patch that was not stepped as asked, with its status; else returns self."""
        rows = numpy.flatnonzero(self["status"])
        if rows.size:
            status = Status(int(self["status"][rows[0]]))
            raise Error(f"responses: {rows.size} of {self.size} patches were not stepped as asked; the first is row "
                        f"{rows[0]}: {status!r}")
        return self

    # Gives rows of derived arrays the type bristle.Response, which numpy.recarray would lose.
    def __array_finalize__(self, other):
        pass

    def __getitem__(self, index):
        item = numpy.ndarray.__getitem__(self, index)
        is_column = isinstance(item, numpy.ndarray) and item.dtype.names is None
        return item.view(numpy.ndarray) if is_column else item


@checked
def responses(size: "int") -> "bristle.Responses":
    """Returns an array for the responses to `size` motions: bristle.Responses."""
    array = numpy.zeros(size, numpy.dtype((Response, response_dtype))).view(Responses)
    for name in ("mean", "dissipated", "contact_loss", "damper_work"):
        array[name] = numpy.nan
    return array


Response.__module__ = Responses.__module__ = "bristle"
