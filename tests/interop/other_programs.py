"""What other programs do to files like ours: one function for every tested row of docs/other-programs.md.

    python3 other_programs.py EXPORTS SET [ROW ...]

EXPORTS has a folder for every export of SET, which has the truth images depth and parts. A row whose program is not installed here is
left out. Each other row is run; what it prints is `ROW PROGRAM VERSION`. A row fails if the program no longer does what the page says,
or if the page names another version: then look again, and change the page.
"""

import importlib.metadata
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile
import warnings
from contextlib import redirect_stderr, redirect_stdout

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
import numpy as np

warnings.simplefilter("ignore")
PAGE = pathlib.Path(__file__).parents[2] / "docs/other-programs.md"
ROBOTS = pathlib.Path(__file__).parents[2] / "robots"
ROWS = {}


def row(name, package):
    """Registers a function under the row's name; `package` is the distribution whose version the page states."""

    def register(function):
        ROWS[name] = (package, function)
        return function

    return register


def exr(files):
    return str(files / "truth/layers/cam00/000003.exr")


def depth(files):
    return str(files / "truth/layers/cam00/000003-depth.png")


# ---- images -------------------------------------------------------------------------------------------------------------------------
@row("oiio-parts", "OpenImageIO")
def _(out, files):
    import OpenImageIO as oiio

    image = oiio.ImageInput.open(exr(files))
    part = image.spec().channelnames.index("id.part")
    plain, right = image.read_image()[..., part], image.read_image("uint")[..., part]
    assert plain.dtype == np.float32 and plain.max() < 1e-6 and right.max() > 1
    assert np.array_equal(np.round(plain.astype(float) * 2**32), right)


@row("exr-window", "OpenEXR")
def _(out, files):
    import OpenEXR

    # the recipe of the page: paste the data window into the display window
    part = OpenEXR.File(exr(files), separate_channels=True).parts[0]
    (x, y), (right, bottom) = part.header["dataWindow"]
    width, height = part.header["displayWindow"][1] + 1
    box = part.channels["depth.Z"].pixels
    assert box.shape == (bottom - y + 1, right - x + 1) != (height, width)
    whole = np.zeros((height, width), box.dtype)
    whole[y : bottom + 1, x : right + 1] = box
    import cv2

    millimetres = cv2.imread(depth(files), cv2.IMREAD_UNCHANGED)
    assert np.abs(np.where(np.isfinite(whole), whole, 0) * 1000 - millimetres).max() <= 1


@row("opencv-exr", "opencv-python-headless")
def _(out, files):
    import cv2

    assert cv2.imread(exr(files), cv2.IMREAD_UNCHANGED) is None


@row("opencv-depth", "opencv-python-headless")
def _(out, files):
    import cv2

    plain, right = cv2.imread(depth(files)), cv2.imread(depth(files), cv2.IMREAD_UNCHANGED)
    assert plain.dtype == np.uint8 and plain.ndim == 3 and right.dtype == np.uint16
    assert np.array_equal(plain[..., 0], right // 256)


@row("pillow-depth", "Pillow")
def _(out, files):
    from PIL import Image

    image = Image.open(depth(files))
    assert np.asarray(image).max() > 255 and set(np.unique(np.asarray(image.convert("L")))) == {0, 255}


@row("webdataset-depth", "webdataset")
def _(out, files):
    import webdataset
    from PIL import Image

    with tempfile.TemporaryDirectory() as folder:
        shard = pathlib.Path(folder, "000000.tar")
        with tarfile.open(shard, "w") as tar:
            tar.add(depth(files), "000003_cam00.depth.png")
        samples = lambda *decoders: next(iter(webdataset.WebDataset(str(shard), shardshuffle=False).decode(*decoders)))["depth.png"]
        own = lambda key, data: np.asarray(Image.open(io.BytesIO(data))) if key.endswith("depth.png") else None
        assert samples("l8").dtype == np.uint8 and samples("l8").max() == 255
        # a decoder of one's own goes first
        assert samples(own, "l8").max() == np.asarray(Image.open(depth(files))).max() > 255


# ---- cameras and keypoints ----------------------------------------------------------------------------------------------------------
@row("opencv-undistort", "opencv-python-headless")
def _(out, files):
    import cv2

    matrix, lens = np.array([[300.0, 0, 320], [0, 300, 240], [0, 0, 1]]), np.array([-0.25, 0.05, 0, 0, 0])
    corner = np.array([[[0.0, 0.0]]])

    def pixels_off(**more):
        ideal = cv2.undistortPoints(corner, matrix, lens, **more)[0, 0]
        pixel, _ = cv2.projectPoints(np.array([[[*ideal, 1.0]]]), np.zeros(3), np.zeros(3), matrix, lens)
        return np.linalg.norm(pixel - corner)

    more = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    assert pixels_off() > 1 and pixels_off(criteria=more) < 0.01, (pixels_off(), pixels_off(criteria=more))


@row("pycocotools-sigmas", "pycocotools")
def _(out, files):
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    with redirect_stdout(io.StringIO()):
        data = COCO(str(out / "coco/annotations.json"))
        found = data.loadRes([{**one, "score": 1.0} for one in data.dataset["annotations"]])
        score = COCOeval(data, found, "keypoints")
        try:
            score.evaluate()
            raise AssertionError("17 sigmas were taken for 15 points")
        except ValueError as error:
            assert "(15,) (17,)" in str(error)
        score.params.kpt_oks_sigmas = np.full(15, 0.08)
        score.evaluate(), score.accumulate(), score.summarize()
    assert score.stats[0] == 1.0


@row("sleap-hidden", "sleap-io")
def _(out, files):
    import sleap_io

    own = json.loads((out / "coco/annotations.json").read_text())["annotations"]
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()):
        sleap_io.save_coco(sleap_io.load_coco(str(out / "coco/annotations.json")), f"{folder}/again.json")
        again = json.loads(pathlib.Path(folder, "again.json").read_text())["annotations"]
    flags = lambda all: {int(flag) for one in all for flag in one.get("keypoints", [])[2::3]}
    assert 1 in flags(own) and 1 not in flags(again)


@row("evo-straight", "evo")
def _(out, files):
    from evo.core.geometry import GeometryException
    from evo.core.trajectory import PoseTrajectory3D

    line = np.zeros((20, 3))
    line[:, 0] = np.linspace(0, 1, 20)
    path = lambda points: PoseTrajectory3D(points, np.tile([1.0, 0, 0, 0], (20, 1)), np.arange(20) / 10)
    try:
        path(line + 0.1).align(path(line))
        raise AssertionError("a straight path was aligned")
    except GeometryException:
        pass


@row("pose2sim-filters", "pose2sim")
def _(out, files):
    import pandas
    from Pose2Sim import filtering

    at = lambda cutoff: {"filtering": {"butterworth": {"order": 4, "cut_off_frequency": cutoff}}}
    time = np.arange(600) / 60
    wave = pandas.Series(np.cos(2 * np.pi * 6 * time))
    halved = filtering.butterworth_filter_1d(at(6), 60, wave)
    # at the cut-off frequency half of the amplitude is left: -6 dB
    assert abs(halved[200:400].max() - 0.5) < 0.02
    assert np.array_equal(halved, filtering.butterworth_filter_1d(at(6.9), 60, wave))
    outliers = pandas.Series(0.001 * np.sin(np.arange(40.0)))
    outliers[[0, 20, 39]] = 5.0
    cleaned = filtering.hampel_filter(outliers)
    assert cleaned[0] == cleaned[39] == 5.0 and abs(cleaned[20]) < 0.01


@row("anipose-order", "aniposelib")
def _(out, files):
    from aniposelib.cameras import Camera, CameraGroup

    cameras = [Camera(name=f"camera {index}", size=(640, 480)) for index in range(12)]
    with tempfile.TemporaryDirectory() as folder:
        CameraGroup(cameras).dump(f"{folder}/calibration.toml")
        again = [camera.get_name() for camera in CameraGroup.load(f"{folder}/calibration.toml").cameras]
    assert again[:4] == ["camera 0", "camera 1", "camera 10", "camera 11"]


def noisy(cameras, sigma):
    """Points before the cameras, and their images with plain noise."""
    random = np.random.default_rng(1)
    points = random.uniform(-0.5, 0.5, (300, 3))
    return points, cameras.project(points).reshape(len(cameras.cameras), -1, 2) + random.normal(0, sigma, (len(cameras.cameras), 300, 2))


def ring():
    from aniposelib.cameras import Camera, CameraGroup
    import cv2

    cameras = []
    for index in range(5):
        turn = cv2.Rodrigues(np.array([0.0, 2 * np.pi * index / 5, 0]))[0]
        matrix = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
        cameras.append(Camera(matrix, np.zeros(5), (640, 480), cv2.Rodrigues(turn)[0], np.array([0, 0, 4.0]), str(index)))
    return CameraGroup(cameras)


@row("anipose-ransac", "aniposelib")
def _(out, files):
    cameras = ring()
    points, images = noisy(cameras, 2.0)
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        plain = cameras.triangulate(images)
        ransac = cameras.triangulate_ransac(images)[0]
    error = lambda found: np.nanmean(np.linalg.norm(found - points, axis=1))
    assert error(ransac) > 1.15 * error(plain), (error(ransac), error(plain))


@row("anipose-lenses", "aniposelib")
def _(out, files):
    cameras = ring()
    _, images = noisy(cameras, 0.5)
    before = [camera.get_focal_length() for camera in cameras.cameras]
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        cameras.bundle_adjust(images, verbose=False)
    assert all(camera.get_focal_length() != own for camera, own in zip(cameras.cameras, before))


@row("caliscope-gaps", "caliscope")
def _(out, files):
    import pandas
    from caliscope.core.point_data import ImagePoints

    frames = [*range(5), *range(15, 20)]
    table = {"sync_index": frames, "cam_id": 0, "object_id": 0, "keypoint_id": 0, "img_loc_x": [float(f) for f in frames], "img_loc_y": 0.0}
    filled = ImagePoints(pandas.DataFrame(table)).fill_gaps(3).df
    found = dict(zip(filled["sync_index"], filled["img_loc_x"]))
    # a point that moves by a pixel a frame: frame 5 of a gap of ten is put at 6.75
    assert set(found) == {*frames, 5, 6, 7} and abs(found[5] - 6.75) < 1e-9


# ---- motions ------------------------------------------------------------------------------------------------------------------------
@row("bvhtools-time", "bvhTools")
def _(out, files):
    from bvhTools.bvhIO import readBvh
    from bvhTools.bvhMotionEditor import resampleFPS

    with redirect_stdout(io.StringIO()):
        motion = readBvh(str(out / "bvh/actor.bvh")).motion
        slower = resampleFPS(readBvh(str(out / "bvh/actor.bvh")), 20).motion
    # the last frame keeps its place in the list, not its time
    last = lambda motion: (motion.numFrames - 1) * motion.frameTime
    assert slower.frames[-1] == motion.frames[-1] and abs(last(slower) - last(motion)) > 0.02


@row("three-offsets", "three")
def _(out, files):
    script = """
    const { BVHLoader } = await import(process.argv[1] + '/examples/jsm/loaders/BVHLoader.js');
    const bvh = 'HIERARCHY ROOT a { OFFSET 10 20 30 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation End Site { OFFSET 0 1 0 } } '
      .replace(/([{}]|OFFSET|CHANNELS|ROOT|End)/g, '\\n$1').replace(/([{}])/g, '$1\\n') + '\\nMOTION\\nFrames: 1\\nFrame Time: 0.1\\n1 2 3 0 0 0\\n';
    const clip = new BVHLoader().parse(bvh.trim()).clip;
    console.log(Array.from(clip.tracks[0].values).join(' '));
    """
    answer = subprocess.run(["node", "--input-type=module", "-e", script, three()], capture_output=True, text=True)
    assert answer.stdout.split() == ["11", "22", "33"], answer


def three():
    return str(pathlib.Path(os.environ["SKIAGRAPH_THREE"]) / "node_modules/three")


# ---- robots -------------------------------------------------------------------------------------------------------------------------
@row("mujoco-masses", "mujoco")
def _(out, files):
    import mujoco

    text = (ROBOTS / "tracker25.urdf").read_text()
    line = re.search("<mujoco>.*</mujoco>", text)[0]
    model = lambda options: mujoco.MjModel.from_xml_string(text.replace(line, options))
    try:
        model("")
        raise AssertionError("links without mass were taken")
    except ValueError as error:
        assert "mass and inertia of moving bodies" in str(error)
    fused, whole = model(line.replace(' fusestatic="false"', "")), model(line)
    names = lambda model: [model.body(index).name for index in range(model.nbody)]
    assert "pelvis" not in names(fused) and "pelvis" in names(whole)
    assert abs(whole.body_mass.sum() - 73) < 0.01 and fused.body_mass.sum() < 63


@row("pybullet-masses", "pybullet")
def _(out, files):
    # in a process of its own: it prints a warning for every link past Python's output
    script = """
import pybullet, sys
pybullet.connect(pybullet.DIRECT)
robot = pybullet.loadURDF(sys.argv[1])
print()
print(*(pybullet.getDynamicsInfo(robot, link)[0] for link in range(-1, pybullet.getNumJoints(robot))))
"""
    robot = str(ROBOTS / "tracker25.urdf")
    answer = subprocess.run([sys.executable, "-c", script, robot], capture_output=True, text=True, check=True).stdout
    masses = [float(word) for word in answer.splitlines()[-1].split()]
    assert abs(sum(masses) - 98) < 0.01 and masses.count(1.0) == 25


@row("pinocchio-order", "pin")
def _(out, files):
    import pinocchio

    joints = list(pinocchio.buildModelFromUrdf(str(ROBOTS / "tracker25.urdf")).names)
    file = re.findall(r'<joint name="([^"]+)" type="revolute"', (ROBOTS / "tracker25.urdf").read_text())
    assert joints[1:] != file and joints.index("left_hip_flexion") < joints.index("left_shoulder_flexion")
    assert file.index("left_hip_flexion") > file.index("left_shoulder_flexion")


CHAIN = """<robot name="chain"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="first" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="second" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/><mimic joint="first" multiplier="2" offset="0.1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="third" type="revolute"><parent link="c"/><child link="d"/><axis xyz="0 0 1"/><mimic joint="second" multiplier="0.5"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""
PLANAR = """<robot name="planar"><link name="a"/><link name="b"/>
<joint name="slide" type="planar"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>"""


def with_file(text, function):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "robot.urdf")
        path.write_text(text)
        with redirect_stdout(io.StringIO()):
            return function(str(path))


def heading(matrix):
    return np.arctan2(matrix[1, 0], matrix[0, 0])


@row("yourdfpy-chains", "yourdfpy")
def _(out, files):
    import yourdfpy

    robot = with_file(CHAIN, yourdfpy.URDF.load)
    robot.update_cfg([0.3])
    # the third joint should add half of the second's 0.7 rad to 1.0
    assert abs(heading(robot.get_transform("d", "a")) - 1.0) < 1e-9
    assert with_file(PLANAR, yourdfpy.URDF.load).num_dofs == 2


@row("urchin-chains", "urchin")
def _(out, files):
    import urchin

    robot = with_file(CHAIN, urchin.URDF.load)
    frames = {link.name: matrix for link, matrix in robot.link_fk(cfg={"first": 0.3}).items()}
    assert abs(heading(frames["d"]) - 1.0) < 1e-9
    try:
        with_file(PLANAR, urchin.URDF.load).link_fk(cfg={"slide": [1.0, 2.0, 0.3]})
        raise AssertionError("three numbers were taken")
    except ValueError as error:
        assert "(2,)" in str(error)


@row("pinocchio-planar", "pin")
def _(out, files):
    import pinocchio

    model = with_file(PLANAR, pinocchio.buildModelFromUrdf)
    assert (model.nq, model.nv) == (4, 3)


def installed(package):
    if package == "three":
        return json.loads(pathlib.Path(three(), "package.json").read_text())["version"]
    return importlib.metadata.version(package)


def main():
    out, files, chosen = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:]
    page = PAGE.read_text()
    failed = False
    for name, (package, check) in ROWS.items():
        if chosen and name not in chosen:
            continue
        try:
            version = installed(package)
        except (importlib.metadata.PackageNotFoundError, KeyError, FileNotFoundError):
            continue
        print(name, package, version)
        lines = [line for line in page.splitlines() if f"`{name}` |" in line]
        try:
            assert lines and all(f" {version} " in line for line in lines), f"docs/other-programs.md does not say this of {version}"
            check(out, files)
        except Exception as error:
            failed = True
            print(f"  {name}: {type(error).__name__}: {error}", file=sys.stderr)
    sys.exit(failed)


main()
