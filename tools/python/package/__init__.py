"""Brush-model friction: patches of elastic bristles that stick, bend and snap, stepped by SIMD kernels.

SI units. Forces act on the moving body.
"""

try:
    import numpy as _numpy
except ImportError as _error:
    raise ImportError("bristle needs numpy, which this Python does not have: pip install numpy, or on Debian "
                      "apt install python3-numpy") from _error

from . import _bristle
from ._bristle import *
from ._bristle import __version__
from ._arrays import Response, Responses, motions, responses

if hasattr(_bristle, "_SweepStudy"):
    from ._sweep import SweepTable, sweep


def __getattr__(name):
    """Says of a name that this build leaves out why it does."""
    why = getattr(_bristle, "__getattr__", None)
    if why is not None:
        return why(name)
    raise AttributeError(f"module 'bristle' has no attribute '{name}'")
