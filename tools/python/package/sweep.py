"""python3 -m bristle.sweep REQUEST: the part of `bristle sweep --dask` that talks to the scheduler.

In Python call bristle.sweep(...), the function (bristle/_sweep.py); after `import bristle.sweep` that name is this module,
which can be called just the same.
"""

import sys
import types

from bristle._sweep import main, sweep


class _Callable(types.ModuleType):
    def __call__(self, *arguments, **options):
        return sweep(*arguments, **options)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("bristle: python3 -m bristle.sweep is started by bristle sweep --dask ADDRESS")
    main(sys.argv[1])
else:
    sys.modules[__name__].__class__ = _Callable
