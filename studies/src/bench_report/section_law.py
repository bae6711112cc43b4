"""Random sections by trimesh: section_law.py COUNT MESH...   One JSON object; seconds are CPU seconds of one thread."""
import json
import sys
import time

try:
    import networkx, numpy, scipy, shapely, trimesh  # noqa: E401, F401 (sections need them all)
except ImportError as error:
    print(json.dumps({"missing": str(error)}))
    sys.exit(0)


def cut(mesh, planes):
    """How many planes hit, how many profiles they show, and their areas together: isotropic uniform random planes."""
    centre, radius = mesh.bounding_sphere.primitive.center, mesh.bounding_sphere.primitive.radius
    hits = profiles = 0
    area = 0.0
    for normal, offset in planes:
        section = mesh.section(plane_origin=centre + radius * offset * normal, plane_normal=normal)
        if section is None:
            continue
        flat = (section.to_2D if hasattr(section, "to_2D") else section.to_planar)()[0]
        hits += 1
        for polygon in flat.polygons_full:
            profiles += 1
            area += polygon.area
    return hits, profiles, area


def measure(path, count):
    mesh = trimesh.load(path, force="mesh", process=False)
    random = numpy.random.default_rng(1)
    best = None
    for _ in range(3):
        normals = random.normal(size=(count, 3))
        normals /= numpy.linalg.norm(normals, axis=1)[:, None]
        planes = list(zip(normals, random.uniform(-1, 1, count)))
        mesh.bounding_sphere  # found once, not a matter of sections
        start = time.process_time()
        hits, profiles, area = cut(mesh, planes)
        seconds = time.process_time() - start
        if best is None or seconds / hits < best["seconds_per_hit"]:
            best = {"seconds_per_hit": seconds / hits, "profiles_per_hit": profiles / hits, "mean_section_area": area / hits, "hits": hits}
    return best


count = int(sys.argv[1])
rows = [measure(path, count) for path in sys.argv[2:]]
print(json.dumps({"version": f"trimesh {trimesh.__version__}, Python {sys.version.split()[0]}", "rows": rows}))
