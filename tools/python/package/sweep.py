"""python3 -m bristle.sweep REQUEST: the part of `bristle sweep --dask` that talks to the scheduler.

In Python call bristle.sweep(...), the function (bristle/_sweep.py).
"""

import sys

if __name__ == "__main__":
    from bristle._sweep import main

    if len(sys.argv) != 2:
        sys.exit("bristle: python3 -m bristle.sweep is started by bristle sweep --dask ADDRESS")
    main(sys.argv[1])
