"""Spheres packed by spheropack: packing.py DIAMETERS.json FRACTION...   One JSON object; seconds are CPU seconds of one thread.

DIAMETERS.json holds a list of diameters for each FRACTION.
"""
import json
import sys
import time
from importlib.metadata import version

try:
    import numpy
    import spheropack
except ImportError as error:
    print(json.dumps({"missing": str(error)}))
    sys.exit(0)


def measure(diameters, fraction):
    radii = numpy.array(diameters) / 2
    best = None
    for _ in range(3 if len(radii) < 5000 else 1):
        start = time.process_time()
        packing = spheropack.pack(radii=radii, density=fraction, growth_rate=0.3, seed=1)
        seconds = time.process_time() - start
        if best is None or seconds < best["seconds"]:
            best = {
                "seconds": seconds,
                "fraction": float((4 / 3 * numpy.pi * packing.radii**3).sum() / numpy.prod(packing.container.lengths)),
                "status": str(packing.status),
            }
    return best


with open(sys.argv[1], encoding="utf-8") as file:
    sizes = json.load(file)
rows = [measure(diameters, float(fraction)) for diameters, fraction in zip(sizes, sys.argv[2:])]
print(json.dumps({"version": f"spheropack {version('spheropack')}, growth rate .3, Python {sys.version.split()[0]}", "rows": rows}))
