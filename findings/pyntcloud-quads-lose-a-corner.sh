#!/usr/bin/env bash
# pyntcloud: a mesh of quads has half of its surface, as each quad is read as one triangle.
#
# Faces of a PLY file may have any number of corners; meshes of bodies are mostly made of quads. pyntcloud 0.3.1 reads
# an ASCII file by its columns, and takes the first three corners of each face. A box of six quads is six triangles
# with an area of 3, where the box has 6, and the rest is holes. So is a mesh of quads and triangles. Points that are
# drawn from the surface lie on one half of it. Nothing is said. Meshes of triangles are right.
#
# Guessed before: quads and triangles, in the order of the file.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 scipy==1.15.3 pandas==2.2.3
python/bin/python -m pip install --quiet --no-compile --no-deps pyntcloud==0.3.1
python/bin/python - <<'PYTHON'
import numpy as np
from pyntcloud import PyntCloud

# A box of 1 x 1 x 1, whose six sides have an area of 6.
corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
quads = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
halves = [half for a, b, c, d in quads for half in ((a, b, c), (a, c, d))]


def write(faces):
    lines = ["ply", "format ascii 1.0", f"element vertex {len(corners)}", *(f"property float {axis}" for axis in "xyz")]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(str, corner)) for corner in corners]
    lines += [" ".join(map(str, (len(face), *face))) for face in faces]
    with open("box.ply", "w") as file:
        file.write("\n".join(lines) + "\n")


def area(places, triangles):
    a, b, c = (places[triangles[:, corner]] for corner in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


assert area(np.array(corners, float), np.array(halves)) == 6
for name, faces, right in (("triangles", halves, True), ("quads", quads, False), ("both", halves[:2] + quads[1:], False)):
    write(faces)
    cloud = PyntCloud.from_file("box.ply")
    triangles = cloud.mesh[["v1", "v2", "v3"]].to_numpy()
    found = area(cloud.points[["x", "y", "z"]].to_numpy(float), triangles)
    print(f"{name}: {len(faces)} faces in the file, {len(triangles)} triangles with an area of {found}")
    assert list(cloud.mesh.columns) == ["v1", "v2", "v3"]
    assert found == (6 if right else 3 + 0.5 * (name == "both"))
PYTHON
