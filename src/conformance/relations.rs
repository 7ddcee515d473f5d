//! Scenes that are the same in another form: a tracker should do as well in them as in the original.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;

use crate::common::ExperimentError;
use crate::prepare::PreparedScene;
use crate::rendering::observer::observer;
use crate::scenario::{Scenario, ScenarioFile};
use skiagraph_core::body::{Motion, Pose};
use skiagraph_core::camera::{Camera, CameraRig, TimedRig};
use skiagraph_set::{BenchmarkSet, StepSpread, Training};
use skiagraph_truth::observing::{KeypointSettings, ObservationSettings};
use skiagraph_truth::scene::GroundTruth;

/// How far the world is moved, metres.
const SHIFT_M: [f64; 3] = [3.0, -2.0, 0.0];

/// A change that should not matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// Left and right are exchanged: in the motion, the cameras and the images.
    Mirrored,
    /// The world is turned by a quarter about the vertical.
    Turned,
    /// The world is moved over the ground.
    Shifted,
    /// The cameras are in the opposite order.
    CameraOrder,
    /// The first camera is there twice.
    CameraTwice,
    /// The frame in the middle is there twice.
    FrameTwice,
}

impl Relation {
    pub const ALL: [Self; 6] =
        [Self::Mirrored, Self::Turned, Self::Shifted, Self::CameraOrder, Self::CameraTwice, Self::FrameTwice];

    /// In words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Mirrored => "mirrored world",
            Self::Turned => "world turned by 90 degrees",
            Self::Shifted => "world moved by (3, -2) m",
            Self::CameraOrder => "cameras in the opposite order",
            Self::CameraTwice => "first camera twice",
            Self::FrameTwice => "one frame twice",
        }
    }

    /// The frame that only repeats the one before, in this form of a scene with so many frames.
    pub(super) fn repeated_frame(self, frames: usize) -> Option<usize> {
        (self == Self::FrameTwice).then_some(frames / 2 + 1)
    }

    /// The scene of a scenario in this form; `scene` is the original.
    pub(super) fn applied(
        self,
        file: &ScenarioFile,
        mocap: Option<&std::path::Path>,
        scene: &PreparedScene,
    ) -> Result<PreparedScene, ExperimentError> {
        let cameras = &scene.rig.rig().cameras;
        match self {
            Self::Mirrored => mirrored(file, mocap, scene),
            Self::Turned => moved(scene, &quarter_turn()),
            Self::Shifted => moved(scene, &Isometry3::from(Translation3::from(SHIFT_M))),
            Self::CameraOrder => with_cameras(scene, cameras.iter().rev().cloned().collect()),
            Self::CameraTwice => {
                let again =
                    cameras.first().map(|first| Camera { name: format!("{}_again", first.name), ..first.clone() });
                with_cameras(scene, cameras.iter().cloned().chain(again).collect())
            }
            Self::FrameTwice => with_frame_twice(scene),
        }
    }
}

fn quarter_turn() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    Isometry3::from_parts(Translation3::identity(), turn)
}

/// The set of a scene with exact silhouettes, and exact keypoints if the scenario has any: noise would differ.
pub(super) fn exact_set(scenario: &Scenario, scene: &PreparedScene) -> Result<BenchmarkSet, ExperimentError> {
    let keypoints = scenario.observation.keypoints.map(|settings| KeypointSettings::exact(settings.layout));
    let settings = ObservationSettings { keypoints, ..ObservationSettings::default() };
    let facts = keypoints.is_some().then(|| settings.facts());
    let parts = scene.set_parts(&scenario.name, facts.as_ref());
    let observer = observer(&scene.ground_truth, &scene.rig, &settings)?;
    Ok(BenchmarkSet::assemble(&parts, |frame| observer.observe(frame))?)
}

/// The scene with another motion, start and rig; the bodies stay.
fn rebuilt(
    scene: &PreparedScene,
    motion: &Motion,
    refitted: Motion,
    cameras: Vec<Camera>,
) -> Result<PreparedScene, ExperimentError> {
    let rig = TimedRig::from(&CameraRig { cameras });
    let ground_truth = GroundTruth::from_motion(scene.ground_truth.actor.clone(), motion, &rig)?;
    Ok(PreparedScene { ground_truth, refitted, rig, ..scene.clone() })
}

fn with_cameras(scene: &PreparedScene, cameras: Vec<Camera>) -> Result<PreparedScene, ExperimentError> {
    rebuilt(scene, &scene.ground_truth.motion(), scene.refitted.clone(), cameras)
}

fn with_frame_twice(scene: &PreparedScene) -> Result<PreparedScene, ExperimentError> {
    let cameras = scene.rig.rig().cameras.clone();
    let motion = with_middle_twice(scene.ground_truth.motion());
    rebuilt(scene, &motion, with_middle_twice(scene.refitted.clone()), cameras)
}

fn with_middle_twice(mut motion: Motion) -> Motion {
    let middle = motion.poses.len() / 2;
    motion.poses.extend(motion.poses.get(middle).cloned());
    if let Some(after) = motion.poses.get_mut(middle..) {
        after.rotate_right(1);
    }
    motion
}

fn moved(scene: &PreparedScene, by: &Isometry3<f64>) -> Result<PreparedScene, ExperimentError> {
    let cameras = scene.rig.rig().cameras.iter().map(|camera| moved_camera(camera, by)).collect();
    let (mut motion, mut refitted) = (scene.ground_truth.motion(), scene.refitted.clone());
    motion.poses.iter_mut().chain(&mut refitted.poses).for_each(|pose| move_pose(pose, by));
    let mut rebuilt = rebuilt(scene, &motion, refitted, cameras)?;
    move_pose(&mut rebuilt.start.pose, by);
    match &mut rebuilt.start.training {
        Training::Motions(training) => {
            training.motions.iter_mut().flat_map(|motion| &mut motion.poses).for_each(|pose| move_pose(pose, by));
        }
        // the spread of the root is along the world's axes
        Training::Spread(spread) => *spread = StepSpread::of_motion(&rebuilt.start.body, &rebuilt.refitted)?,
    }
    Ok(rebuilt)
}

fn move_pose(pose: &mut Pose, by: &Isometry3<f64>) {
    pose.world_from_root = by * pose.world_from_root;
}

fn moved_camera(camera: &Camera, by: &Isometry3<f64>) -> Camera {
    Camera { camera_from_world: camera.camera_from_world * by.inverse(), ..camera.clone() }
}

/// The mirrored motion in front of mirrored cameras, whose images are mirrored too. A scenario mirrors at the plane
/// y = 0, and may then move the body to its start; the cameras follow.
fn mirrored(
    file: &ScenarioFile,
    mocap: Option<&std::path::Path>,
    scene: &PreparedScene,
) -> Result<PreparedScene, ExperimentError> {
    let mut other = file.clone();
    other.scenario.motion.mirror = !other.scenario.motion.mirror;
    let mirror = PreparedScene::new(&other, mocap)?;
    let first = |scene: &PreparedScene| scene.refitted.poses.first().map(|pose| pose.world_from_root);
    let (Some(before), Some(after)) = (first(scene), first(&mirror)) else { return Ok(mirror) };
    let onward = after * reflected(&before).inverse();
    let cameras = scene.rig.rig().cameras.iter().map(|camera| moved_camera(&mirrored_camera(camera), &onward));
    let cameras = cameras.collect();
    rebuilt(&mirror, &mirror.ground_truth.motion(), mirror.refitted.clone(), cameras)
}

/// A frame reflected at the plane y = 0, with its own y axis reversed.
fn reflected(frame: &Isometry3<f64>) -> Isometry3<f64> {
    let at = frame.translation.vector;
    let turn = frame.rotation.quaternion();
    // the axis of a rotation is a pseudovector: its x and z parts change sign
    let turn = nalgebra::Quaternion::new(turn.w, -turn.i, turn.j, -turn.k);
    Isometry3::from_parts(Translation3::new(at.x, -at.y, at.z), UnitQuaternion::new_normalize(turn))
}

/// The camera behind a mirror at the plane y = 0: its image is the mirrored one of the original.
fn mirrored_camera(camera: &Camera) -> Camera {
    let original = camera.camera_from_world;
    let centre = original.inverse() * Point3::origin();
    let centre = Point3::new(centre.x, -centre.y, centre.z);
    // the rows of R are the camera's axes; the mirrored camera's right is the reflection of the original's left
    let rows = original.rotation.to_rotation_matrix();
    let axis = |row: usize, sign: f64| {
        let v = rows.matrix().row(row).transpose();
        Vector3::new(v.x, -v.y, v.z) * sign
    };
    let matrix = nalgebra::Matrix3::from_columns(&[axis(0, -1.0), axis(1, 1.0), axis(2, 1.0)]).transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(matrix));
    let translation = Translation3::from(-(rotation * centre.coords));
    let mut mirrored = camera.clone();
    mirrored.camera_from_world = Isometry3::from_parts(translation, rotation);
    mirrored.pinhole.principal_point[0] = f64::from(camera.pinhole.width) - camera.pinhole.principal_point[0];
    // x changes its sign: so does the tangential term that is even in x
    mirrored.distortion.p2 = -camera.distortion.p2;
    mirrored
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> ScenarioFile {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/smoke/matched.toml");
        ScenarioFile::open(path.as_ref(), &["last_frame=3".to_owned()]).unwrap()
    }

    fn sets(relation: Relation) -> [BenchmarkSet; 2] {
        let file = small();
        let scene = PreparedScene::new(&file, None).unwrap();
        let changed = relation.applied(&file, None, &scene).unwrap();
        [&scene, &changed].map(|scene| exact_set(&file.scenario, scene).unwrap())
    }

    /// The share of pixels that differ, after `place` maps a pixel of the first set's image to the second's.
    fn differing(relation: Relation, place: impl Fn(usize, [u32; 2], u32) -> (usize, [u32; 2])) -> f64 {
        let [before, after] = sets(relation);
        let [before, after] = [&before, &after].map(|set| set.blind.observation(2).unwrap().silhouettes);
        let (mut set, mut differ) = (0, 0);
        for (camera, mask) in before.iter().enumerate() {
            for (x, y) in (0..mask.height()).flat_map(|y| (0..mask.width()).map(move |x| (x, y))) {
                let (other, [u, v]) = place(camera, [x, y], mask.width());
                set += u32::from(mask.get(x, y));
                differ += u32::from(mask.get(x, y) != after[other].get(u, v));
            }
        }
        assert!(set > 1000, "{set}");
        f64::from(differ) / f64::from(set)
    }

    #[test]
    fn a_moved_world_is_seen_as_before_to_the_pixel() {
        for relation in [Relation::Turned, Relation::Shifted] {
            assert!(differing(relation, |camera, pixel, _| (camera, pixel)) < 1e-3, "{relation:?}");
        }
    }

    #[test]
    fn a_mirrored_world_is_seen_in_mirrored_images() {
        let share = differing(Relation::Mirrored, |camera, [x, y], width| (camera, [width - 1 - x, y]));
        assert!(share < 0.01, "{share}");
        assert!(
            differing(Relation::Mirrored, |camera, pixel, _| (camera, pixel)) > 0.02,
            "they are not the same images"
        );
    }

    #[test]
    fn cameras_and_frames_are_where_the_relation_says() {
        let last = small().scenario.rig.ring.unwrap().count as usize - 1;
        assert_eq!(differing(Relation::CameraOrder, |camera, pixel, _| (last - camera, pixel)), 0.0);
        let [before, after] = sets(Relation::CameraTwice);
        let seen = after.blind.observation(1).unwrap().silhouettes;
        assert_eq!((before.blind.rig.cameras.len() + 1, &seen[0]), (seen.len(), seen.last().unwrap()));
        let [before, after] = sets(Relation::FrameTwice);
        let masks = |set: &BenchmarkSet, frame| set.blind.observation(frame).unwrap().silhouettes;
        let (frames, middle) = (before.blind.frame_count, before.blind.frame_count / 2);
        assert_eq!(after.blind.frame_count, frames + 1);
        assert_eq!(masks(&after, middle), masks(&after, middle + 1));
        assert_eq!(Relation::FrameTwice.repeated_frame(frames), Some(middle + 1));
        assert_eq!((masks(&after, 0), masks(&after, frames)), (masks(&before, 0), masks(&before, frames - 1)));
    }
}
