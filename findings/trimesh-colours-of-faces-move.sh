#!/usr/bin/env bash
# trimesh: in a PLY of triangles and quads the colours go to other faces, and half of a quad has none.
#
# Parts of a body are often marked by the colour of their faces. trimesh 5.2.0 cuts quads into triangles, and puts the
# halves in another order than that of the file: triangles first, then first halves, then second ones. The colours
# stay in the order of the file. So the first face, a quad of colour 10, has colour 30, and a triangle of colour 20
# has 10. A box of seven faces gives twelve triangles and seven colours; asking for the eighth, and saving the mesh,
# are errors. In a mesh of quads alone the first halves are right. Reading says nothing.
#
# Guessed before: colours stay with their faces.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 trimesh==5.2.0
python/bin/python - <<'PYTHON'
import trimesh

corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
quads = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def read(faces):
    """A mesh whose faces have the colours 10, 20, 30 ..., in the order of the file."""
    lines = ["ply", "format ascii 1.0", f"element vertex {len(corners)}", *(f"property float {axis}" for axis in "xyz")]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    lines += [*(f"property uchar {colour}" for colour in ("red", "green", "blue")), "end_header"]
    lines += [" ".join(map(str, corner)) for corner in corners]
    lines += [" ".join(map(str, (len(face), *face, 10 * index + 10, 0, 0))) for index, face in enumerate(faces)]
    with open("box.ply", "w") as file:
        file.write("\n".join(lines) + "\n")
    mesh = trimesh.load("box.ply", process=False)
    # The colour that a triangle should have is that of the face of the file that has its three corners.
    right = [
        next(10 * index + 10 for index, face in enumerate(faces) if set(triangle) <= set(face))
        for triangle in mesh.faces.tolist()
    ]
    return mesh, mesh.visual.face_colors[:, 0].tolist(), right


mesh, found, right = read([quads[0], (4, 5, 6), (4, 6, 7), *quads[2:]])
print("quads and triangles: colours", found, "right", right)
assert mesh.area == 6 and len(right) == 12
assert found == [10, 20, 30, 40, 50, 60, 70] and right[:7] == [20, 30, 10, 40, 50, 60, 70]
for act in (lambda: mesh.visual.face_colors[7], lambda: mesh.export(file_type="ply")):
    try:
        act()
        raise SystemExit("no error")
    except (IndexError, ValueError) as error:
        print(type(error).__name__, str(error)[:80])
_, found, right = read(quads)
print("quads: colours", found, "right", right)
assert found == right[:6] and len(right) == 12
_, found, right = read([(4, 5, 6), (4, 6, 7)])
assert found == right == [10, 20]
PYTHON
