"""What print, notebooks, pandas and xarray show of the classes of the module. Importing this adds it to them."""

import html

from . import _bristle


def _micrometres(metres):
    return f"{1e6 * metres:.4g} um"


def _material_facts(material):
    """Returns the names and values that print shows of a material; raises bristle.Error if one is out of range."""
    material.validate()
    law = material.snap_length
    facts = [("friction over load, sliding slowly", f"{material.kinetic_coefficient():.4g}"),
             ("highest at first loading", f"{material.peak_coefficient():.4g}"),
             ("presliding length", _micrometres(material.residual_length + law.mean)),
             ("bristles", f"{material.bristles_in_contact(1.0):.4g} per newton, {material.snap_rule}"),
             ("snap lengths", f"{law.law}, {_micrometres(law.mean)}, cv {law.cv:.3g}")]
    if material.ageing_strength:
        facts.append(("ageing", f"{material.ageing_form}, {material.ageing_strength:.3g} from {material.ageing_time:.3g} s"))
    if material.speed_strengthening:
        facts.append(("strengthening with speed", f"{material.speed_strengthening:.3g} per e-fold"))
    return facts


def _table(heads, rows):
    def line(cells, tag):
        return "<tr>" + "".join(f"<{tag}>{html.escape(str(cell))}</{tag}>" for cell in cells) + "</tr>"

    return "<table>" + (line(heads, "th") if heads else "") + "".join(line(row, "td") for row in rows) + "</table>"


def _material_text(self):
    try:
        return "; ".join(f"{name}: {value}" for name, value in _material_facts(self))
    except _bristle.Error as error:
        return f"{self!r}, which no patch takes: {error}"


def _material_html(self):
    try:
        return _table(("material", ""), _material_facts(self))
    except _bristle.Error:
        return f"<p>{html.escape(_material_text(self))}</p>"


def _batch_repr(self):
    try:
        patches = f"{len(self)} patches, "
    except _bristle.Error:  # another thread is stepping the batch
        patches = ""
    return f"<bristle.PatchBatch: {patches}{self.threads} thread{'s' if self.threads != 1 else ''}, {self.isa}>"


def _batch_html(self):
    try:
        patches = len(self)
    except _bristle.Error as error:  # another thread is stepping the batch
        patches = error
    return _table(("batch", ""), (("patches", patches), ("threads", self.threads), ("instruction set", self.isa)))


def _fit_repr(self):
    def interval(name, text):
        e = self.parameters.get(name)
        return [f"{name} {text(e.value)} ({text(e.low)} to {text(e.high)})"] if e is not None and e.determined else []

    found = [*interval("kinetic", "{:.4g}".format), *interval("peak", "{:.4g}".format),
             *interval("presliding_length", _micrometres)]
    return (f"<bristle.FitResult: {', '.join(found) or 'nothing determined'}; explains {100 * self.explained:.1f} % "
            f"of {len(self.force)} samples>")


def _fit_rows(self):
    return [(name, e.value, e.low, e.high, e.determined, e.why) for name, e in self.parameters.items()]


_FIT_COLUMNS = ("parameter", "value", "low", "high", "determined", "why")


def _fit_html(self):
    rows = [(name, f"{value:.5g}", f"{low:.5g} to {high:.5g}" if determined else f"not determined: {why}")
            for name, value, low, high, determined, why in _fit_rows(self)]
    return _table(("parameter, SI units", "value", "95 % interval"), rows) + f"<p>{html.escape(repr(self)[1:-1])}</p>"


def _fit_to_pandas(self):
    """The parameters as a pandas.DataFrame in SI units: value, low, high, determined, why."""
    rows = _fit_rows(self)
    import pandas

    return pandas.DataFrame(rows, columns=_FIT_COLUMNS).set_index("parameter")


def _fit_to_xarray(self):
    """The parameters as an xarray.Dataset over `parameter` in SI units; low and high are NaN if not determined."""
    names, *columns = zip(*_fit_rows(self))
    import numpy
    import xarray

    return xarray.Dataset(
        {name: ("parameter", numpy.array(values, float if name in ("low", "high") else None))
         for name, values in zip(_FIT_COLUMNS[1:], columns)}, {"parameter": list(names)})


def _run_html(self):
    rows = []
    for name, forces in self.forces.items():
        size = (forces**2).sum(axis=1) ** 0.5
        rows.append((name, f"{size.max():.4g}" if len(size) else "", f"{size[-1]:.4g}" if len(size) else ""))
    return (_table(("patch", "highest friction, N", "at the end, N"), rows) +
            f"<p>{self.steps} steps, state hash {self.state_hash:016x}</p>")


def _run_to_pandas(self):
    """A row a step: t (s); of each patch <name>.fx, .fy (N, on the body), .dx, .dy (m, over the step), .load (N)."""
    columns = {"t": self.t}
    for name, forces in self.forces.items():
        motions = self.motions[name]
        columns[f"{name}.fx"], columns[f"{name}.fy"] = forces[:, 0], forces[:, 1]
        columns[f"{name}.dx"], columns[f"{name}.dy"] = motions["displacement"][:, 0], motions["displacement"][:, 1]
        columns[f"{name}.load"] = motions["normal_load"]
    import pandas

    return pandas.DataFrame(columns)


def _run_to_xarray(self):
    """An xarray.Dataset: force (N, on the body) and displacement (m, over the step) by patch, t and axis; load (N)."""
    names = list(self.forces)
    import numpy
    import xarray

    axes = ("patch", "t", "axis")
    shape = (len(names), len(self.t), 2)  # also where no patch is recorded
    of = [self.motions[name] for name in names]
    return xarray.Dataset(
        {"force": (axes, numpy.reshape([self.forces[name] for name in names], shape), {"units": "N"}),
         "displacement": (axes, numpy.reshape([motions["displacement"] for motions in of], shape), {"units": "m"}),
         "load": (axes[:2], numpy.reshape([motions["normal_load"] for motions in of], shape[:2]), {"units": "N"})},
        {"patch": names, "t": ("t", self.t, {"units": "s"}), "axis": ["x", "y"]})


_bristle.Material.__str__ = _material_text
_bristle.Material._repr_html_ = _material_html
_bristle.PatchBatch.__repr__ = _batch_repr
_bristle.PatchBatch._repr_html_ = _batch_html
if hasattr(_bristle, "FitResult"):
    _bristle.FitResult.__repr__ = _fit_repr
    _bristle.FitResult._repr_html_ = _fit_html
    _bristle.FitResult.to_pandas = _fit_to_pandas
    _bristle.FitResult.to_xarray = _fit_to_xarray
    _bristle.SceneRun._repr_html_ = _run_html
    _bristle.SceneRun.to_pandas = _run_to_pandas
    _bristle.SceneRun.to_xarray = _run_to_xarray
