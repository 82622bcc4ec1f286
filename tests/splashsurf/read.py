"""read.py PROGRAM FOLDER [PARTICLES [THREADS]]: splashsurf reads firn's particles, and its surface agrees with firn's.

PROGRAM is firn_splashsurf. Ends with 77, which counts as skipped, where pysplashsurf is not installed
(pip install pysplashsurf numpy). Prints how long both take, for which give a million particles.
"""
import subprocess
import sys
import time
from pathlib import Path

try:
    import numpy as np
    import pysplashsurf
except ImportError as missing:
    print(f"{missing}: skipped. Install it: pip install pysplashsurf numpy")
    sys.exit(77)


def elements(path):
    """Returns the vertices, and the triangles if there are any, of a binary PLY file of firn or splashsurf."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    kinds = {"float": "<f4", "double": "<f8", "uint": "<u4", "int": "<i4", "uint32": "<u4", "float32": "<f4"}
    counts, properties, name = {}, {}, None
    for line in data[:end].decode().split("\n"):
        word = line.split()
        if word[:1] == ["format"] and word[1] != "binary_little_endian":
            sys.exit(f"{path} is {word[1]}")
        if word[:1] == ["element"]:
            name = word[1]
            counts[name], properties[name] = int(word[2]), []
        if word[:1] == ["property"] and word[1] != "list":
            properties[name].append((word[2], kinds[word[1]]))
    vertices = np.frombuffer(data, np.dtype(properties["vertex"]), counts["vertex"], end)
    if not counts.get("face"):
        return vertices, None
    face = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    faces = np.frombuffer(data, face, counts["face"], end + vertices.nbytes)
    if not (faces["count"] == 3).all():
        sys.exit(f"{path} has faces that are no triangles")
    return vertices, faces["corners"]


def volume(x, triangles):
    """Returns the volume within a closed surface."""
    a, b, c = (x[triangles[:, k]].astype(float) - x[0] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def edges_that_are_not_of_two_triangles(triangles):
    """Counts the edges that are not there once in each direction."""
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    there = np.sort(directed[:, 0] << 32 | directed[:, 1])
    back = np.sort(directed[:, 1] << 32 | directed[:, 0])
    return len(there) - len(np.unique(there)) + int((there != back).sum())


def points_of(vertices):
    """Returns the positions of vertices as an array."""
    return np.stack([vertices[axis] for axis in "xyz"], axis=1)


def main(program, folder, particles="8000", threads="0"):
    """Compares the two surfaces."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    said = subprocess.run([program, str(folder), particles, threads], check=True, capture_output=True, text=True).stdout
    count, spacing, own_volume, vertex_count, triangle_count, own_seconds = (float(word) for word in said.split())

    points, _ = elements(folder / "points.ply")
    own, own_triangles = elements(folder / "surface.ply")
    wrong = []

    def check(right, what):
        if not right:
            wrong.append(what)

    check(len(points) == count, f"points.ply has {len(points)} points of {count:.0f}")
    check((len(own), len(own_triangles)) == (vertex_count, triangle_count), "surface.ply has other numbers of elements")
    check({"nx", "ny", "nz", "vx"} <= set(own.dtype.names), f"surface.ply has only {own.dtype.names}")
    check(edges_that_are_not_of_two_triangles(own_triangles) == 0, "firn's surface in the file is not closed")
    check(abs(volume(points_of(own), own_triangles) / own_volume - 1) < 1e-4, "the file's surface has another volume")

    # splashsurf as a program: it reads the file.
    out = folder / "splashsurf.ply"
    out.unlink(missing_ok=True)
    arguments = ["pysplashsurf", "reconstruct", str(folder / "points.ply"), f"-o={out}", f"-r={spacing / 2}", "-l=2.0",
                 "-c=1.0", "-t=0.6", "-q", f"-n={threads}" if int(threads) else "--mt-files=off"]
    pysplashsurf.run_splashsurf(arguments)
    theirs, their_triangles = elements(out)
    their_volume = volume(points_of(theirs), their_triangles)
    # By its own reading, of the array: the same surface, so the file has been read as it is.
    start = time.perf_counter()
    again = pysplashsurf.reconstruct_surface(points_of(points).astype(np.float32), particle_radius=spacing / 2,
                                             smoothing_length=2.0, cube_size=1.0, iso_surface_threshold=0.6,
                                             multi_threading=threads != "1").mesh
    their_seconds = time.perf_counter() - start
    check(abs(volume(again.vertices, again.triangles) / their_volume - 1) < 1e-3, "splashsurf reads other points")
    check(abs(their_volume / own_volume - 1) < 0.1, "the volumes differ by more than a tenth")
    print(f"{count:.0f} particles. firn: {own_seconds:.2f} s, {triangle_count:.0f} triangles, {own_volume:.4f} m³; "
          f"splashsurf: {their_seconds:.2f} s, {len(their_triangles)} triangles, {their_volume:.4f} m³")
    for what in wrong:
        print(f"wrong: {what}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
