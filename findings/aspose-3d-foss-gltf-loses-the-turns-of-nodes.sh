#!/usr/bin/env bash
# aspose-3d-foss: a glTF that it writes has the places of the nodes, not their turns and sizes; an STL has neither.
#
# aspose-3d-foss 26.1.0 makes scenes of nodes and meshes, and writes them. A skeleton is such nodes: each joint has a
# place and a turn. In glTF every node has its `translation` alone: a limb that is bent in the scene is straight in the
# file. In STL, which has no nodes, the vertices are those of the mesh, without even the place, so all parts of a body
# lie at the origin. Writing says nothing, and reading the glTF back gives the straight limb. In memory the turn is
# there (`global_transform`), but a scale is applied after it, along the axes of the parent. `euler_angles` of a
# quaternion made from pitch, yaw and roll of 0.2, 0.3, 0.4 are 0.4, 0.2, 0.3.
#
# Guessed before: the node's transform is kept in the files, and angles come back.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv python
python/bin/python -m pip install --quiet --no-compile numpy==2.2.6 aspose-3d-foss==26.1.0
python/bin/python - <<'PYTHON'
import json

import numpy as np
from aspose.threed import Mesh, Scene
from aspose.threed.utilities import Quaternion, Vector3, Vector4

corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)


def bone(scale):
    """A scene of one node: 1, 2, 3 metres away, turned by 90 degrees about z, and scaled along x."""
    mesh = Mesh()
    for corner in corners:
        mesh.control_points.append(Vector4(*corner, 1))
    for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)):
        mesh.create_polygon(list(face))
    scene = Scene()
    node = scene.root_node.create_child_node("shank", mesh)
    node.transform.translation = Vector3(1, 2, 3)
    node.transform.rotation = Quaternion.from_angle_axis(np.pi / 2, Vector3(0, 0, 1))
    node.transform.scaling = Vector3(scale, 1, 1)
    return scene, node


def placed(node):
    matrix = np.array(node.global_transform.transform_matrix.to_array()).reshape(4, 4)
    points = np.array([[point.x, point.y, point.z] for point in node.entity.control_points])
    return points @ matrix[:3, :3].T + matrix[:3, 3]


turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
scene, node = bone(1)
right = corners @ turn.T + [1, 2, 3]
assert np.allclose(placed(node), right)

scene.save("bone.gltf")
(written,) = [found for found in json.load(open("bone.gltf"))["nodes"] if "mesh" in found]
print("in the file:", written)
assert "rotation" not in written and "matrix" not in written and written["translation"] == [1, 2, 3]
again = Scene()
again.open("bone.gltf")
found = next(child for child in again.root_node.child_nodes if child.entity is not None)
print("knee to ankle: written", right[1] - right[0], "read", placed(found)[1] - placed(found)[0])
assert np.allclose(placed(found), corners + [1, 2, 3])

scene.save("bone.stl")
again.open("bone.stl")
solid = next(child for child in again.root_node.child_nodes if child.entity is not None)
points = np.unique(placed(solid).round(6), axis=0)
assert np.array_equal(points, np.unique(corners, axis=0)), points

# In memory: twice as long along its own x axis, which the turn makes the y axis of the world.
scaled = placed(bone(2)[1])
print("scaled to 2 along x, then turned to y:", scaled[1] - scaled[0], "right", turn @ [2, 0, 0])
assert np.allclose(scaled[1] - scaled[0], [0, 1, 0])
angles = Quaternion.from_euler_angle(0.2, 0.3, 0.4).euler_angles()
print("angles 0.2 0.3 0.4 come back as", round(angles.x, 6), round(angles.y, 6), round(angles.z, 6))
assert np.allclose([angles.x, angles.y, angles.z], [0.4, 0.2, 0.3])
PYTHON
