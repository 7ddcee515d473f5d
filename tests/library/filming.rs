//! Cameras that move, and cameras with their own exposure times: every image is computed in two independent ways.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use sha2::{Digest, Sha256};
use skiagraph_core::body::{Humanoid, Motion, Pose, Prop, Solid, shipped};
use skiagraph_core::camera::{Camera, CameraKeyframe, CameraPath, CameraRig, CameraTiming, RigMoment, TimedRig};
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;
use skiagraph_set::{BenchmarkSet, BlindSet, TruthImage};
use skiagraph_track::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings};
use skiagraph_truth::observing::{
    CorruptedObserver, Corruption, ObservationSettings, Observer, TruthImageObserver, WantedTruthImages, observe,
};
use skiagraph_truth::scene::GroundTruth;

const RATE: f64 = 60.0;
const SIZE: [u32; 2] = [160, 120];

fn actor() -> Humanoid {
    shipped("actor").unwrap()
}

fn cameras() -> Vec<Camera> {
    let camera = |name, eye, distortion| crate::made_up_set::camera(name, eye, distortion, SIZE);
    vec![
        camera("front", [3.0, 0.8, 1.3], [0.0; 5]),
        camera("lens", [-1.0, 2.8, 1.6], [-0.18, 0.06, 0.002, -0.001, -0.01]),
    ]
}

fn rig() -> CameraRig {
    CameraRig { cameras: cameras() }
}

/// The body moves forward, turns and swings every joint.
fn motion(frames: usize) -> Motion {
    let root = |frame: usize| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3 + 0.05 * frame as f64);
        Isometry3::from_parts(Translation3::new(0.03 * frame as f64, 0.1, 0.97), turn)
    };
    let angle = |frame: usize, i: usize| 0.15 * (f64::from(i as u32 * 7) + 0.35 * frame as f64).sin();
    crate::made_up_set::motion(&actor(), frames, RATE, root, angle)
}

fn truth_of_static_rig(frames: usize) -> GroundTruth {
    GroundTruth::from_motion(actor(), &motion(frames), &rig()).unwrap()
}

fn keyframe(time_s: f64, position: [f64; 3]) -> CameraKeyframe {
    CameraKeyframe { time_s, position, look_at: [0.1, 0.0, 1.0], roll: 0.0 }
}

fn moving_path() -> CameraPath {
    let way = [keyframe(0.0, [3.0, 0.8, 1.3]), keyframe(0.06, [2.8, 0.2, 1.6]), keyframe(0.15, [2.5, -1.0, 1.1])];
    CameraPath::new("front", way.to_vec()).unwrap()
}

fn timed(timing: CameraTiming) -> TimedRig {
    TimedRig::new(rig(), Vec::new(), vec![timing; 2]).unwrap()
}

fn differing(a: &Mask, b: &Mask) -> u64 {
    a.count() + b.count() - 2 * a.count_common(b)
}

#[test]
fn a_camera_with_one_keyframe_equals_a_static_camera_bit_for_bit() {
    let path = CameraPath::new("front", vec![keyframe(0.0, [3.0, 0.8, 1.3])]).unwrap();
    let filming = TimedRig::new(rig(), vec![Some(path)], Vec::new()).unwrap();
    assert_eq!(filming.rig(), &rig());
    let truth = truth_of_static_rig(6);
    let filmed = GroundTruth::from_motion(actor(), &motion(6), &filming).unwrap();
    assert_eq!(filmed, truth);
    let observer = Observer::new(&filmed, &filming);
    for expected in observe(&truth, &rig()) {
        assert_eq!(observer.observe(expected.frame).silhouettes, expected.silhouettes);
    }
}

#[test]
fn a_camera_that_moves_with_the_body_sees_the_same_mask_in_every_frame() {
    let step = Vector3::new(0.0625, -0.03125, 0.0);
    let place = |frame: usize| Translation3::from(Vector3::new(0.0, 0.1, 0.97) + step * frame as f64);
    let walk = crate::made_up_set::motion(
        &actor(),
        5,
        RATE,
        |frame| Isometry3::from_parts(place(frame), UnitQuaternion::identity()),
        |_, i| 0.1 * (i as f64).sin(),
    );
    let moving_along = |frame: f64| CameraKeyframe {
        time_s: frame / RATE,
        position: (Point3::new(3.0, 0.8, 1.3) + step * frame).into(),
        look_at: (Point3::new(0.1, 0.0, 1.0) + step * frame).into(),
        roll: 0.0,
    };
    let path = CameraPath::new("front", vec![moving_along(0.0), moving_along(4.0)]).unwrap();
    let filming = TimedRig::new(rig(), vec![Some(path)], Vec::new()).unwrap();
    let truth = GroundTruth::from_motion(actor(), &walk, &filming).unwrap();
    let observer = Observer::new(&truth, &filming);
    let first = observer.observe(0);
    assert!(first.silhouettes[0].count() > 500);
    for frame in 1..5 {
        let seen = observer.observe(frame);
        assert!(
            differing(&seen.silhouettes[0], &first.silhouettes[0]) <= 2,
            "the masks differ only by rounding on the outline"
        );
        assert!(
            differing(&seen.silhouettes[1], &first.silhouettes[1]) > 50,
            "the other camera is static, so its masks differ"
        );
        assert_eq!(truth.frames[frame].visible[0], truth.frames[0].visible[0]);
    }
}

#[test]
fn a_camera_that_is_late_sees_a_later_moment_of_the_motion() {
    let twice = motion(8).made_continuous(&actor()).resampled(&actor(), 2.0 * RATE).unwrap();
    let finer = GroundTruth::from_motion(actor(), &twice, &rig()).unwrap();
    let truth = truth_of_static_rig(8);
    // an offset of half a frame gives every other frame of the motion at twice the rate
    for (offset_s, shift) in [(0.5 / RATE, 1), (-0.5 / RATE, -1), (2.0 / RATE, 4)] {
        let filming = timed(CameraTiming { offset_s, ..CameraTiming::default() });
        let filmed = GroundTruth::from_motion(actor(), &motion(8), &filming).unwrap();
        let observer = Observer::new(&truth, &filming);
        for frame in 1..6 {
            let seen = observer.observe(frame);
            let finer_frame = (2 * frame as i64 + shift) as usize;
            let expected = Observer::new(&finer, &rig()).observe(finer_frame);
            for (found, expected) in seen.silhouettes.iter().zip(&expected.silhouettes) {
                assert!(differing(found, expected) <= 1, "{} at {offset_s}", differing(found, expected));
            }
            assert_eq!(filmed.frames[frame].in_view, finer.frames[finer_frame].in_view);
            assert_eq!(filmed.frames[frame].visible, finer.frames[finer_frame].visible);
            let moment = seen.moment.unwrap();
            assert!((moment.exposed_s[0].unwrap() - (frame as f64 / RATE + offset_s)).abs() < 1e-12);
        }
    }
}

#[test]
fn a_rolling_shutter_of_a_moving_camera_takes_each_row_from_a_global_shutter_image_at_the_rows_time() {
    let delay = 0.8 / RATE / f64::from(SIZE[1]);
    let rolling = CameraTiming { line_delay_s: delay, offset_s: 0.002, every: 1 };
    let filming = TimedRig::new(rig(), vec![Some(moving_path())], vec![rolling; 2]).unwrap();
    let solid = Solid::Box { link_from_box: Isometry3::translation(1.2, 0.2, 0.4), half_extents: [0.05, 0.2, 0.4] };
    let props = vec![Prop { name: "box".into(), solid }];
    let truth = GroundTruth::among(actor(), &motion(6), &filming, props, Vec::new()).unwrap();
    let seen = Observer::new(&truth, &filming).observe(2);
    let wanted = WantedTruthImages { normals: true, ..WantedTruthImages::default() };
    for camera in 0..2 {
        let layers = TruthImageObserver::new(&truth, &filming, camera, wanted).look(2).unwrap();
        let (mut pixels, mut depths, mut rows_that_differ) = (0, 0, 0);
        for row in (0..SIZE[1]).step_by(7) {
            let at_once = CameraTiming { offset_s: 0.002 + delay * f64::from(row), ..CameraTiming::default() };
            let path = (camera == 0).then(moving_path);
            let paths = if camera == 0 { vec![path] } else { Vec::new() };
            let global = TimedRig::new(rig(), paths, vec![at_once; 2]).unwrap();
            let image = &Observer::new(&truth, &global).observe(2).silhouettes[camera];
            let differ = |x: &u32| image.get(*x, row) != seen.silhouettes[camera].get(*x, row);
            pixels += (0..SIZE[0]).filter(differ).count();
            let expected = TruthImageObserver::new(&truth, &global, camera, wanted).look(2).unwrap();
            let at = |x: u32| (row * SIZE[0] + x) as usize;
            let other = |x: &u32| {
                let (a, b) = (at(*x), at(*x));
                layers.depth.part[a] != expected.depth.part[b]
                    || (layers.depth.depth[a] - expected.depth.depth[b]).abs() > 1e-4
                    || (0..3).any(|c| (layers.normals[a][c] - expected.normals[b][c]).abs() > 1e-3)
            };
            depths += (0..SIZE[0]).filter(other).count();
            rows_that_differ += 1;
        }
        assert!(rows_that_differ > 10 && pixels <= 2 && depths <= 2, "camera {camera}: {pixels} and {depths} pixels");
    }
    let global = TimedRig::new(rig(), vec![Some(moving_path())], Vec::new()).unwrap();
    let at_once = Observer::new(&truth, &global).observe(2);
    assert!(differing(&at_once.silhouettes[0], &seen.silhouettes[0]) > 20, "a global shutter gives a different image");
}

#[test]
fn corruption_of_times_is_added_to_the_cameras_own_times() {
    let truth = truth_of_static_rig(6);
    let own = timed(CameraTiming { line_delay_s: 2e-5, ..CameraTiming::default() });
    let corruption = Corruption { line_delay_us: 30.0, ..Corruption::default() };
    let both = CorruptedObserver::new(&truth, &own, corruption, 3).observe(2);
    let sum = timed(CameraTiming { line_delay_s: 2e-5 + 1e-6 * 30.0, ..CameraTiming::default() });
    assert_eq!(both.silhouettes, Observer::new(&truth, &sum).observe(2).silhouettes);
    // a tracker knows only the camera's own times
    assert_eq!(both.moment, own.moment(2, truth.frames[2].time_s));
    let slow = timed(CameraTiming { every: 2, ..CameraTiming::default() });
    let lossy = Corruption { dropped_frames: 0.5, ..Corruption::default() };
    let observer = CorruptedObserver::new(&truth, &slow, lossy, 3);
    for frame in 0..6 {
        let seen = observer.observe(frame);
        assert_eq!(seen.has_image(0), frame % 2 == 0);
        assert_eq!(seen.silhouettes[0].is_empty(), frame % 2 == 1);
    }
}

#[test]
fn flow_leads_to_the_next_image_of_a_moving_camera() {
    let timing = CameraTiming { every: 2, offset_s: 0.004, line_delay_s: 0.0 };
    let filming = TimedRig::new(rig(), vec![Some(moving_path())], vec![timing]).unwrap();
    let truth = GroundTruth::from_motion(actor(), &motion(6), &filming).unwrap();
    let wanted = WantedTruthImages { flow: true, ..WantedTruthImages::default() };
    let observer = TruthImageObserver::new(&truth, &filming, 0, wanted);
    assert!(observer.look(1).is_none(), "frame 1 has no image");
    let layers = observer.look(2).unwrap();
    let smooth = motion(6).made_continuous(&actor());
    let links = |time_s: f64| actor().link_frames(&smooth.at_frame(&actor(), time_s * RATE).unwrap());
    let (now_s, then_s) = (2.0 / RATE + 0.004, 4.0 / RATE + 0.004);
    let (now, then) = (filming.camera_at(0, now_s), filming.camera_at(0, then_s));
    let mut seen = 0;
    for (index, part) in layers.depth.part.iter().enumerate().filter(|(_, part)| **part > 0).step_by(11) {
        let (x, y) = ((index % 160) as f64 + 0.5, (index / 160) as f64 + 0.5);
        let ray = now.ray_through(&nalgebra::Point2::new(x, y)).unwrap().into_inner();
        let along = f64::from(layers.depth.depth[index]) / (now.camera_from_world.rotation * ray).z;
        let link = *part as usize - 1;
        let in_link = links(now_s)[link].inverse() * (now.centre() + ray * along);
        let pixel = then.project(&(links(then_s)[link] * in_link)).unwrap();
        let [u, v] = layers.flow[index].map(f64::from);
        assert!((pixel.x - x - u).abs() < 2e-3 && (pixel.y - y - v).abs() < 2e-3, "{pixel} {x} {y} {u} {v}");
        seen += 1;
    }
    assert!(seen > 100);
    assert!(observer.look(4).unwrap().flow.iter().all(|flow| flow[0].is_nan()), "the last image has no flow");
}

#[test]
fn a_likelihood_uses_the_cameras_of_the_frame_that_have_an_image() {
    let slow = CameraTiming { every: 2, ..CameraTiming::default() };
    let timings = vec![CameraTiming::default(), slow];
    let filming = TimedRig::new(rig(), vec![Some(moving_path())], timings).unwrap();
    let truth = GroundTruth::from_motion(actor(), &motion(6), &filming).unwrap();
    let observer = Observer::new(&truth, &filming);
    let likelihood = |rig: &CameraRig| {
        SilhouetteLikelihood::new(actor(), rig, SilhouetteSettings::default()).unwrap().with_descent()
    };
    let energy_and_cost = |likelihood: &mut SilhouetteLikelihood, seen: &Observation, pose: &Pose| {
        likelihood.prepare(seen).unwrap();
        let mut scratch = likelihood.scratch();
        let energy = likelihood.energy(pose, &mut scratch);
        (energy, likelihood.linearise(pose, 2.0, &mut scratch).unwrap().cost)
    };
    let mut of_all = likelihood(filming.rig());
    for frame in [4, 3, 2, 5] {
        let seen = observer.observe(frame);
        let (own, other) = (&truth.frames[frame].pose, &truth.frames[frame - 2].pose);
        // static cameras at the same places: only those that have an image
        let mut static_rig = seen.rig(filming.rig()).into_owned();
        static_rig.cameras.truncate(if frame % 2 == 0 { 2 } else { 1 });
        let silhouettes = seen.silhouettes[..static_rig.cameras.len()].to_vec();
        let static_view = Observation { silhouettes, moment: None, ..seen.clone() };
        for pose in [own, other] {
            assert_eq!(
                energy_and_cost(&mut of_all, &seen, pose),
                energy_and_cost(&mut likelihood(&static_rig), &static_view, pose)
            );
        }
        assert!(energy_and_cost(&mut of_all, &seen, own).0 < 0.5 * energy_and_cost(&mut of_all, &seen, other).0);
    }
    let moment = observer.observe(2).moment.map(|moment| RigMoment { exposed_s: vec![None], ..moment });
    let wrong = of_all.prepare(&Observation { moment, ..observer.observe(2) }).unwrap_err();
    assert!(wrong.to_string().contains("poses and times of 2 cameras"), "{wrong}");
}

fn filmed_set() -> BenchmarkSet {
    let slow = CameraTiming { every: 3, offset_s: 0.004, line_delay_s: 5e-5 };
    let filming = TimedRig::new(rig(), vec![Some(moving_path())], vec![CameraTiming::default(), slow]).unwrap();
    crate::made_up_set::assemble_filmed("filmed", &filming, &motion(8), &ObservationSettings::default())
}

#[test]
fn a_set_stores_where_its_cameras_are_and_which_took_an_image() {
    let (set, folder) = (filmed_set(), tempfile::tempdir().unwrap());
    set.write_with_truth_images(folder.path(), &[TruthImage::Depth]).unwrap();
    let read = BenchmarkSet::read(folder.path()).unwrap();
    assert_eq!((&read.truth, &read.blind.moments), (&set.truth, &set.blind.moments));
    let filming = &read.truth.rig;
    let blind = BlindSet::read(folder.path()).unwrap();
    for frame in 0..8 {
        let observation = blind.observation(frame).unwrap();
        assert_eq!(observation, set.blind.observation(frame).unwrap());
        assert_eq!((observation.has_image(0), observation.has_image(1)), (true, frame % 3 == 0));
        let time_s = frame as f64 / RATE;
        let near = |a: &Camera, b: &Camera| (a.centre() - b.centre()).norm() < 1e-9;
        let (stored, known) = (blind.rig_at(frame), filming.rig_at(time_s));
        assert!(stored.cameras.iter().zip(&known.cameras).all(|(a, b)| near(a, b)));
        assert!(stored.cameras.iter().zip(&observation.rig(&blind.rig).cameras).all(|(a, b)| a == b));
    }
    let words = blind.moments.as_ref().unwrap().describe(1, RATE).unwrap();
    assert!(words.contains("images of 3 of 8 frames") && words.contains("4.000 ms late"), "{words}");
    assert!(words.contains("50.000 us from row to row") && !words.contains("moves"), "{words}");
    assert!(blind.moments.as_ref().unwrap().describe(0, RATE).unwrap().starts_with("moves"));
}

#[test]
fn a_set_of_static_cameras_has_format_1_and_no_files_of_moving_cameras() {
    let (set, folder) = (crate::made_up_set::assemble("still", cameras(), &motion(3)), tempfile::tempdir().unwrap());
    set.write(folder.path()).unwrap();
    let text = |file: &str| std::fs::read_to_string(folder.path().join(file)).unwrap();
    assert!(text("set.toml").contains("skiagraph.set/1") && text("cameras.json").contains("skiagraph.cameras/1"));
    assert!(!text("cameras.json").contains("frames") && !text("README.txt").contains("cameras.npz"));
    assert!(!text("files.sha256").contains("cameras.npz") && !text("files.sha256").contains("filming.json"));
    assert!(set.blind.moments.is_none() && set.truth.rig.is_still());
}

#[test]
fn a_set_of_moving_cameras_has_the_same_bytes_on_any_number_of_threads() {
    let listing = |threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            filmed_set().write_with_truth_images(folder.path(), &[TruthImage::Depth, TruthImage::Normals]).unwrap()
        });
        std::fs::read_to_string(folder.path().join("files.sha256")).unwrap()
    };
    assert_eq!(listing(1), listing(3));
}

#[test]
fn an_invalid_file_of_cameras_is_an_error_that_names_it() {
    let (set, folder) = (filmed_set(), tempfile::tempdir().unwrap());
    set.write(folder.path()).unwrap();
    let path = folder.path().join("truth/filming.json");
    let good = std::fs::read_to_string(&path).unwrap();
    let listing = folder.path().join("files.sha256");
    let before = std::fs::read_to_string(&listing).unwrap();
    let hash = |bytes: &[u8]| Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    for (from, to, words) in [
        ("\"every\": 3", "\"every\": 0", "`every` from 1 to"),
        ("\"line_delay_s\": 0.00005", "\"line_delay_s\": -1.0", "line_delay_s"),
        ("\"lens\"", "\"length\"", "the cameras of cameras.json"),
        ("skiagraph.filming/1", "skiagraph.filming/7", "skiagraph.filming/7"),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from}");
        std::fs::write(&path, &bad).unwrap();
        std::fs::write(&listing, before.replace(&hash(good.as_bytes()), &hash(bad.as_bytes()))).unwrap();
        let error = BenchmarkSet::read(folder.path()).unwrap_err().to_string();
        assert!(error.contains("filming.json") && error.contains(words), "{error}");
    }
}
