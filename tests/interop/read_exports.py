"""Reads an exported set with the usual reader of its format: python3 read_exports.py FORMAT EXPORT SET

Compares what the reader finds with the set's own files (NumPy and the standard library). If the reader is not installed, it
prints the package's name and exits with code 77.
"""

import csv
import json
import pathlib
import sys

import numpy as np

kind, out, root = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
truth = np.load(root / "truth/truth.npz", allow_pickle=False)
cameras = json.loads((root / "cameras.json").read_text())["cameras"]
markers, names = truth["markers"], list(truth["marker_names"])
T, C = len(markers), len(cameras)


def need(module):
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError as error:
        print(f"{module}: {error}")
        sys.exit(77)


def png(path):
    """Grey pixels of an 8-bit PNG without interlacing, using the standard library only."""
    import zlib

    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        length, name = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        if name == b"IHDR":
            width, height = (int.from_bytes(data[at + 8 + i : at + 12 + i], "big") for i in (0, 4))
        if name == b"IDAT":
            packed += data[at + 8 : at + 8 + length]
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, width + 1)
    image = np.zeros((height, width), np.uint8)
    for y, row in enumerate(rows):
        line, above = row[1:].astype(int), image[y - 1].astype(int) if y else np.zeros(width, int)
        left = upper_left = 0
        for x in range(width):
            if row[0] == 4:
                p = left + above[x] - upper_left
                best = min((abs(p - left), 0, left), (abs(p - above[x]), 1, above[x]), (abs(p - upper_left), 2, upper_left))
                guess = best[2]
            else:
                guess = (0, left, above[x], (left + above[x]) // 2)[row[0]]
            image[y, x] = left = (line[x] + guess) % 256
            upper_left = above[x]
    return image


def mask(camera, frame):
    return png(root / f"observations/cam{camera:02}/silhouette/{frame:06}.png") > 0


def project(camera, points):
    """OpenCV's camera model with the set's own parameters."""
    K, R, t = (np.array(camera[key]) for key in ("K", "R", "t"))
    k1, k2, p1, p2, k3 = camera["distortion"]
    p = points @ R.T + t
    x, y = p[..., 0] / p[..., 2], p[..., 1] / p[..., 2]
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = K[0, 0] * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + K[0, 2]
    v = K[1, 1] * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + K[1, 2]
    return np.stack([u, v], -1)


def coco():
    need("pycocotools")
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    data = COCO(str(out / "annotations.json"))
    assert len(data.imgs) == T * C and data.cats[1]["keypoints"] == names
    for image in data.imgs.values():
        camera, frame = (image["id"] - 1) % C, (image["id"] - 1) // C
        assert (out / "images" / image["file_name"]).is_file() and image["frame"] == frame
        [found] = data.loadAnns(data.getAnnIds(image["id"]))
        own = mask(camera, frame)
        assert np.array_equal(data.annToMask(found).astype(bool), own)
        ys, xs = np.nonzero(own)
        assert found["bbox"] == [xs.min(), ys.min(), xs.max() + 1 - xs.min(), ys.max() + 1 - ys.min()]
        assert found["area"] == own.sum()
        points = np.array(found["keypoints"]).reshape(-1, 3)
        known = points[:, 2] > 0
        assert np.array_equal(known, truth["in_view"][frame, camera])
        assert np.array_equal(points[:, 2] == 2, truth["visible"][frame, camera])
        assert np.allclose(points[known, :2], project(cameras[camera], markers[frame])[known], atol=1e-9)
        assert found["num_keypoints"] == known.sum()
    for kind in ("segm", "keypoints"):
        estimate = [{**a, "score": 1.0} for a in json.loads((out / "annotations.json").read_text())["annotations"]]
        score = COCOeval(data, data.loadRes(estimate), kind)
        if kind == "keypoints":
            score.params.kpt_oks_sigmas = np.full(15, 0.08)
        score.evaluate(), score.accumulate(), score.summarize()
        assert score.stats[0] == 1.0, kind


def opencv():
    cv2 = need("cv2")
    for camera in cameras:
        storage = cv2.FileStorage(str(out / f"{camera['name']}.yml"), cv2.FILE_STORAGE_READ)
        mat = lambda key: storage.getNode(key).mat()
        assert storage.getNode("image_width").real() == camera["width"]
        assert storage.getNode("name").string() == camera["name"]
        assert np.array_equal(mat("camera_matrix"), camera["K"]) and np.array_equal(mat("R"), camera["R"])
        points = markers[~np.isnan(markers).any(-1)].reshape(-1, 3)
        pixels, _ = cv2.projectPoints(points, mat("rvec"), mat("T"), mat("camera_matrix"), mat("distortion_coefficients"))
        assert np.allclose(pixels[:, 0], project(camera, points), atol=1e-6)


def npz():
    import subprocess

    found = np.load(out / "truth.npz", allow_pickle=False)
    for name in truth.files:
        assert np.array_equal(found[name], truth[name], equal_nan=truth[name].dtype.kind == "f"), name
    assert np.array_equal(found["K"], [c["K"] for c in cameras]) and np.array_equal(found["t"], [c["t"] for c in cameras])
    for index, camera in enumerate(cameras):
        assert np.allclose(found["joints_2d"][:, index], project(camera, truth["joints"]), atol=1e-9, equal_nan=True)
        assert np.allclose(found["markers_2d"][:, index], project(camera, markers), atol=1e-9, equal_nan=True)
    assert np.array_equal(found["image_size"], [[c["width"], c["height"]] for c in cameras])
    answer = subprocess.run([sys.executable, out / "read_truth.py", out], check=True, capture_output=True, text=True).stdout
    assert f"{T} frames" in answer, answer


def bvh():
    bvhio = need("bvhio")
    root_joint = bvhio.readAsHierarchy(str(out / "actor.bvh"))
    links, places = list(truth["link_names"]), truth["link_frames"][..., :3]
    for frame in range(T):
        root_joint.loadPose(frame)
        found = {joint.Name: np.array(joint.PositionWorld) for joint, _, _ in root_joint.layout()}
        for index, name in enumerate(links):
            x, y, z = found[name] / 100
            # the file's x, y, z are the set's y, z, x
            assert np.allclose([z, x, y], places[frame, index], atol=2e-5), (frame, name, [z, x, y], places[frame, index])


def trc():
    # cells of the rows of names and axes and of the frames: readers of tables move columns if they differ
    rows = (out / "markers.trc").read_text().splitlines()
    assert {len(row.split("\t")) for row in rows[3:5] + rows[6:]} == {2 + 3 * len(names)}
    assert rows[3].split("\t")[2::3] == names
    opensim = need("opensim")
    table = opensim.TimeSeriesTableVec3(str(out / "markers.trc"))
    assert list(table.getColumnLabels()) == names and table.getNumRows() == T
    assert table.getTableMetaDataString("Units") == "mm"
    for frame, time in enumerate(table.getIndependentColumn()):
        assert abs(time - frame / truth["fps"]) < 1e-6
        row = table.getRowAtIndex(frame)
        found = np.array([[row[m][i] for i in range(3)] for m in range(15)]) / 1000
        # Y is up: x, z, -y
        assert np.allclose(found, markers[frame] @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), atol=1e-6)


def c3d():
    ezc3d = need("ezc3d")
    found = ezc3d.c3d(str(out / "markers.c3d"))
    point = found["parameters"]["POINT"]
    assert point["LABELS"]["value"] == names and point["UNITS"]["value"] == ["mm"]
    assert point["RATE"]["value"][0] == truth["fps"] and found["data"]["points"].shape == (4, 15, T)
    assert point["Y_SCREEN"]["value"] == ["+Z"] and point["FRAMES"]["value"][0] == T
    assert np.allclose(found["data"]["points"][:3].transpose(2, 1, 0) / 1000, markers, atol=1e-6)
    assert (found["data"]["meta_points"]["residuals"] == 0).all()
    reader = need("c3d")
    with open(out / "markers.c3d", "rb") as file:
        found = reader.Reader(file)
        points = np.array([frame for _, frame, _ in found.read_frames()])
        assert found.point_rate == found.analog_rate == truth["fps"]
    assert np.allclose(points[..., :3] / 1000, markers, atol=1e-6) and (points[..., 3] == 0).all()


def colmap():
    pycolmap = need("pycolmap")
    model = pycolmap.Reconstruction(str(out))
    assert model.num_cameras() == C == model.num_images()
    for index, camera in enumerate(cameras):
        image = next(i for i in model.images.values() if i.name == f"{camera['name']}/000000.png")
        seen = truth["visible"][0, index]
        assert sum(point.has_point3D() for point in image.points2D) == seen.sum() == len(image.points2D)
        for point in image.points2D:
            place = model.points3D[point.point3D_id].xyz
            assert np.allclose(place, markers[0, point.point3D_id - 1])
            # COLMAP's pixel centres are at halves
            assert np.allclose(image.project_point(place), point.xy, atol=1e-6)
            assert np.allclose(point.xy - 0.5, project(camera, place), atol=1e-6)


def croissant():
    mlcroissant = need("mlcroissant")
    data = mlcroissant.Dataset(str(out / "croissant.json"))
    rows = list(data.records("frames"))
    assert len(rows) == T * C
    for index, row in enumerate(rows):
        camera, frame = index % C, index // C
        text = lambda key: row[f"frames/{key}"].decode()
        assert text("camera") == cameras[camera]["name"] and row["frames/frame"] == frame
        assert (png(out / text("image")) > 0).sum() == row["frames/area_px"] == mask(camera, frame).sum()


def webdataset():
    wds = need("webdataset")
    shards = sorted(str(path) for path in out.glob("*.tar"))
    samples = list(wds.WebDataset(shards, shardshuffle=False))
    assert len(samples) == T * C
    for index, sample in enumerate(samples):
        camera, frame = index % C, index // C
        assert sample["__key__"] == f"{frame:06}_cam{camera:02}"
        own = (root / f"observations/cam{camera:02}/silhouette/{frame:06}.png").read_bytes()
        facts = json.loads(sample["json"])
        assert sample["mask.png"] == own and facts["K"] == cameras[camera]["K"]
        for name, end in (("layers.exr", ".exr"), ("colour.exr", "-colour.exr"), ("depth.png", "-depth.png")):
            layer = root / f"truth/layers/cam{camera:02}/{frame:06}{end}"
            assert (name in sample) == layer.exists()
            assert name not in sample or sample[name] == layer.read_bytes()
        assert np.allclose(facts["joints"], truth["joints"][frame])
        for marker, pixel in enumerate(facts["markers_2d"]):
            assert (pixel is not None) == truth["in_view"][frame, camera, marker]
            assert pixel is None or np.allclose(pixel, project(cameras[camera], markers[frame, marker]))
        if (root / "observations/keypoints.npz").exists():
            own = zip(facts["keypoints"].items(), sorted(zip(found_names(), expected_keypoints()[frame, camera].tolist())), strict=True)
            assert all(name == expected and (point or [0, 0, 0]) == at for (name, point), (expected, at) in own)
        else:
            assert "keypoints" not in facts


def tum():
    need("evo")
    from evo.tools import file_interface

    found = file_interface.read_tum_trajectory_file(str(out / "root.txt"))
    assert np.allclose(found.positions_xyz, truth["root"][:, :3]) and np.allclose(found.timestamps, np.arange(T) / truth["fps"])
    assert np.allclose(found.orientations_quat_wxyz, truth["root"][:, 3:])


def cal(path, camera):
    numbers = np.loadtxt(path)
    fc, cc, alpha, kc, R, t, om = np.split(numbers, [2, 4, 5, 10, 19, 22])
    assert [fc[0], fc[1], cc[0], cc[1]] == [camera["K"][0][0], camera["K"][1][1], camera["K"][0][2], camera["K"][1][2]]
    assert alpha == [0] and np.array_equal(kc, camera["distortion"]) and np.array_equal(R.reshape(3, 3), camera["R"])
    assert np.allclose(t / 1000, camera["t"], atol=1e-7)
    angle = np.linalg.norm(om)
    x, y, z = om / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    assert np.allclose(turned, camera["R"], atol=1e-9)


def humaneva():
    for camera in cameras:
        cal(out / "Calibration_Data" / f"{camera['name']}.cal", camera)


def found_names():
    return np.load(root / "observations/keypoints.npz", allow_pickle=False)["keypoint_names"].tolist()


def expected_keypoints():
    """x, y, confidence (T, C, 17, 3) of the set's keypoints, the missing ones 0."""
    found = np.load(root / "observations/keypoints.npz", allow_pickle=False)
    points = np.concatenate([found["keypoints"], found["confidence"][..., None]], -1)
    missing = np.isnan(points).any(-1)
    assert missing.any() and not missing.all()
    points[missing] = 0
    return points


def people(folder, called, lens=False):
    """Compares with the set's keypoints; with `lens`, after the lenses were put back into exported points without."""
    expected = expected_keypoints()
    for frame, camera in np.ndindex(expected.shape[:2]):
        name = called(camera)
        image = json.loads((folder / f"{name}_json/{name}_{frame:012}_keypoints.json").read_text())
        if not expected[frame, camera].any():
            assert image["people"] == []
            continue
        [person] = image["people"]
        found = np.reshape(person["pose_keypoints_2d"], (17, 3))
        if lens:
            K, seen = np.array(cameras[camera]["K"]), found[:, 2] > 0
            rays = np.column_stack([(found[seen, :2] - K[:2, 2]) / K.diagonal()[:2], np.ones(seen.sum())])
            found[seen, :2] = project({**cameras[camera], "R": np.eye(3), "t": np.zeros(3)}, rays)
        assert np.allclose(found, expected[frame, camera], atol=1e-4), (frame, camera)


def tables_of(path):
    try:
        import tomllib
    except ImportError:
        need("tomllib")
    return tomllib.loads(path.read_text())


def calibration(path, expected=cameras):
    tables = tables_of(path)
    assert [key for key in tables if key != "metadata"] == [f"cam_{index:02}" for index in range(C)]
    same_cameras(tables.values(), expected)


def same_cameras(tables, expected=cameras):
    cv2 = need("cv2")
    points = markers[~np.isnan(markers).any(-1)].reshape(-1, 3)
    for camera, table in zip(expected, tables):
        assert table["size"] == [camera["width"], camera["height"]]
        rotation, translation, matrix, lens = (np.array(table[key]) for key in ("rotation", "translation", "matrix", "distortions"))
        pixels, _ = cv2.projectPoints(points, rotation, translation, matrix, lens)
        assert np.allclose(pixels[:, 0], project(camera, points), atol=1e-6)


def openpose():
    people(out, lambda camera: cameras[camera]["name"])
    assert (out / "keypoints.txt").read_text().split()[-1] == "right_ankle"


def pose2sim():
    people(out / "pose", lambda camera: f"cam{camera:02}", lens=True)
    calibration(out / "calibration/Calib.toml", [{**camera, "distortion": [0.0] * 5} for camera in cameras])
    import tomllib

    config = tomllib.loads((out / "Config.toml").read_text())
    assert config["project"]["frame_rate"] == 60 and config["pose"]["pose_model"] == "COCO_17"
    assert config["triangulation"]["undistort_points"] is False


def anipose():
    calibration(out / "calibration.toml")
    found, expected = np.load(out / "points.npz", allow_pickle=False), expected_keypoints().transpose(1, 0, 2, 3)
    missing = ~expected.any(-1)
    assert np.array_equal(np.isnan(found["points"]).any(-1), missing)
    assert np.allclose(found["points"][~missing], expected[..., :2][~missing], atol=1e-4)
    assert np.allclose(found["scores"], expected[..., 2]) and found["names"][0] == "nose" and found["fps"] == 60


def caliscope():
    expected = expected_keypoints()
    rows = np.genfromtxt(out / "image_points.csv", delimiter=",", names=True)
    at = tuple(rows[name].astype(int) for name in ("sync_index", "cam_id", "keypoint_id"))
    found = np.zeros_like(expected)
    found[at] = np.stack([rows[name] for name in ("img_loc_x", "img_loc_y", "confidence")], -1)
    assert np.allclose(found, expected, atol=1e-4) and np.allclose(rows["frame_time"], rows["sync_index"] / 60)
    tables = tables_of(out / "camera_array.toml")["cameras"]
    assert [(key, table["cam_id"]) for key, table in tables.items()] == [(str(camera), camera) for camera in range(C)]
    same_cameras(tables.values())


globals()[kind]()
print(f"{kind}: read back")
