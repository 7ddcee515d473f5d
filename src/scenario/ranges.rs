//! Range checks that types cannot express.

use super::range_checks::{KeyError, RangeCheck, at_most, only_valid_with, require, within};
use super::{
    ActorSettings, CameraSettings, ContactMode, DistractorSettings, MotionSettings, PopulationName, PropSettings,
    RingSettings, Scenario, ShapeSettings, TrainingUse, camera_motion,
};
use skiagraph_core::body::{Blending, Sex, VARIED_GIRTHS, VARIED_LENGTHS};
use skiagraph_core::camera::{Camera, CameraError, CameraFile, MAX_IMAGE_SIZE};
use skiagraph_core::input::excerpt;
use skiagraph_truth::observing::{AXES, KEYPOINT_AXES, ObservationSettings, SilhouetteSource};

pub(crate) const MOST_SEEDS: u32 = 100_000;
const MOST_CLIPS: usize = 1_000;
const MOST_PROPS: usize = 1_000;
/// Greatest number of other people in a scene.
const MOST_DISTRACTORS: usize = 16;
pub(super) const MOST_CAMERAS: usize = 64;
const MOST_TAKES: usize = 200;
const MOST_WAYPOINTS: usize = 10_000;
const MOST_METHODS: usize = 64;
const FARTHEST: f64 = 1e4;
const LONGEST_NAME: usize = 200;

impl Scenario {
    /// The first invalid value, in the order of the format.
    pub(crate) fn first_problem(&self) -> RangeCheck {
        plain_name("name", &self.name)?;
        within("seeds", self.seeds, 1..=MOST_SEEDS)?;
        let repeated = self.truth_images.iter().enumerate().any(|(i, image)| self.truth_images[..i].contains(image));
        let found = format!("{:?}", self.truth_images).to_lowercase();
        require("truth_images", !repeated, "every image at most once", found)?;
        motion("motion", &self.motion)?;
        if let Some(training) = &self.training {
            require("training.clips", !training.clips.is_empty(), "at least one [[training.clips]]", "none")?;
            at_most("training.clips", training.clips.len(), MOST_CLIPS, "recordings")?;
            for (i, clip) in training.clips.iter().enumerate() {
                motion(&format!("training.clips[{i}]"), clip)?;
                let alone = clip.then.is_empty();
                let expected = "no further takes: give every recording its own [[training.clips]]";
                require(&format!("training.clips[{i}].then"), alone, expected, "some")?;
            }
        }
        actor(&self.actor)?;
        if let Some((length, girth)) = self.tracker_body.mismatch.percents() {
            within("tracker_body.mismatch.percent.length", length, 0.0..=50.0)?;
            within("tracker_body.mismatch.percent.girth", girth, 0.0..=50.0)?;
        }
        at_most("prop", self.prop.len(), MOST_PROPS, "props")?;
        for (i, p) in self.prop.iter().enumerate() {
            prop(&format!("prop[{i}]"), p)?;
            let again = self.prop[..i].iter().any(|other| other.name == p.name);
            require(&format!("prop[{i}].name"), !again, "a unique name", format!("{:?} twice", excerpt(&p.name)))?;
        }
        at_most("distractor", self.distractor.len(), MOST_DISTRACTORS, "distractors")?;
        for (i, d) in self.distractor.iter().enumerate() {
            distractor(&format!("distractor[{i}]"), d)?;
        }
        if let Some(r) = &self.rig.ring {
            ring(r)?;
        }
        at_most("rig.camera", self.rig.camera.len(), MOST_CAMERAS, "cameras")?;
        for (i, c) in self.rig.camera.iter().enumerate() {
            camera(&format!("rig.camera[{i}]"), c)?;
        }
        at_most("rig.file", self.rig.file.len(), MOST_CAMERAS, "files")?;
        for (i, f) in self.rig.file.iter().enumerate() {
            camera_file(&format!("rig.file[{i}]"), f)?;
        }
        let all = self.rig.count() + self.rig.leave_out.len();
        require("rig", all > 0, "at least one camera: [rig.ring], [[rig.file]] or [[rig.camera]]", "none")?;
        at_most("rig.leave_out", self.rig.leave_out.len(), 3 * MOST_CAMERAS, "cameras")?;
        observation(&self.observation)?;
        camera_motion::check(self)?;
        at_most("methods", self.methods.len(), MOST_METHODS, "methods")?;
        for (name, settings) in self.trackers() {
            let prefix = if self.methods.is_empty() { "tracker.".to_owned() } else { format!("methods.{name}.") };
            require(&prefix, is_tracker_name(name), "1 to 64 letters, digits, `-` or `_`", excerpt(name))?;
            let key = format!("{prefix}{}", settings.name());
            settings.first_problem(&key)?;
            let needed = settings.kind().training == TrainingUse::Required;
            require(&key, !needed || self.training.is_some(), "training motion: [[training.clips]]", "none")
                .map_err(|problem| problem.needing("training"))?;
            let has_keypoints = !settings.needs_keypoints() || self.observation.keypoints.is_some();
            require(&key, has_keypoints, "keypoints: [observation.keypoints] with a `layout`", "none")?;
        }
        let exchanged = self.observation.keypoints.map_or(0.0, |keypoints| keypoints.other_person);
        let expected = "0, or another person in the scene: [[distractor]]";
        let is_alone = self.distractor.is_empty();
        require("observation.keypoints.other_person", exchanged == 0.0 || !is_alone, expected, exchanged)?;
        let both = self.tracker.is_some() && !self.methods.is_empty();
        require("tracker", !both, "either [tracker.*] or [methods.NAME.*]", "both")
    }
}

fn motion(table: &str, m: &MotionSettings) -> RangeCheck {
    at_most(&format!("{table}.then"), m.then.len(), MOST_TAKES, "takes")?;
    for (table, take) in m.takes(table) {
        self::take(&table, &take)?;
    }
    within(&format!("{table}.join.blend_s"), m.join.blend_s, 0.02..=5.0)?;
    within(&format!("{table}.join.within_mm"), m.join.within_mm, 0.0..=10_000.0)?;
    for coordinate in m.start_m.into_iter().flatten() {
        within(&format!("{table}.start_m"), coordinate, -1000.0..=1000.0)?;
    }
    if let Some(heading) = m.heading_deg {
        within(&format!("{table}.heading_deg"), heading, -360.0..=360.0)?;
    }
    at_most(&format!("{table}.path_m"), m.path_m.len(), MOST_WAYPOINTS, "waypoints")?;
    for (index, coordinate) in m.path_m.iter().enumerate().flat_map(|(i, point)| point.iter().map(move |c| (i, c))) {
        within(&format!("{table}.path_m[{index}]"), *coordinate, -1000.0..=1000.0)?;
    }
    for (key, given) in [("start_m", m.start_m.is_some()), ("heading_deg", m.heading_deg.is_some())] {
        let placed = given && !m.path_m.is_empty();
        let expected = "either it or path_m, which begins at its first waypoint";
        require(&format!("{table}.{key}"), !placed, expected, "both")?;
    }
    if let Some(v) = &m.variation {
        within(&format!("{table}.variation.tempo_percent"), v.tempo_percent, 0.0..=20.0)?;
        within(&format!("{table}.variation.amplitude_percent"), v.amplitude_percent, 0.0..=30.0)?;
        within(&format!("{table}.variation.posture_deg"), v.posture_deg, 0.0..=20.0)?;
    }
    match m.frames {
        Some(frames) => within(&format!("{table}.frames"), frames, 2..=3_600_000),
        None => Ok(()),
    }
}

fn take(table: &str, m: &MotionSettings) -> RangeCheck {
    require(&format!("{table}.clip"), !m.clip.is_empty(), "a clip", "nothing")?;
    let has_own = !m.clip.to_ascii_lowercase().ends_with(".amc");
    only_valid_with(
        &format!("{table}.skeleton"),
        m.skeleton.is_none() || !has_own,
        "an .amc clip, because other formats contain the skeleton",
        format!("{:?}", excerpt(&m.clip)),
    )?;
    if let Some(first) = m.first_frame {
        require(&format!("{table}.first_frame"), first >= 1, "a frame number from 1", first)?;
    }
    if let Some(last) = m.last_frame {
        let first = m.first_frame.unwrap_or(1);
        require(&format!("{table}.last_frame"), last > first, format_args!("a frame after the first, {first}"), last)?;
    }
    within(&format!("{table}.frames_per_second"), m.frames_per_second, 1.0..=1000.0)?;
    for (key, value, range) in [
        ("loop_to_s", m.loop_to_s, 0.01..=3600.0),
        ("metres_per_unit", m.metres_per_unit, 1e-6..=1e3),
        ("source_hz", m.source_hz, 1.0..=10_000.0),
        ("speed", m.speed, 0.05..=20.0),
    ] {
        if let Some(value) = value {
            within(&format!("{table}.{key}"), value, range)?;
        }
    }
    if let Some(hash) = &m.sha256 {
        let sound = hash.len() == 64 && hash.chars().all(|c| c.is_ascii_hexdigit());
        require(&format!("{table}.sha256"), sound, "64 hexadecimal digits", format!("{:?}", excerpt(hash)))?;
    }
    Ok(())
}

fn shape(s: &ShapeSettings) -> RangeCheck {
    let contradicts = matches!(
        (s.population, s.sex),
        (Some(PopulationName::Women), Some(Sex::Male)) | (Some(PopulationName::Men), Some(Sex::Female))
    );
    require("actor.shape.sex", !contradicts, "the sex of the population", "the other sex")?;
    only_valid_with("actor.shape.seed", s.seed.is_none() || s.population.is_some(), "a population", "none")?;
    if let Some(stature) = s.stature_m {
        within("actor.shape.stature_m", stature, 1.0..=2.5)?;
    }
    if let Some(mass) = s.mass_kg {
        within("actor.shape.mass_kg", mass, 20.0..=300.0)?;
    }
    let tables = [
        ("lengths_m", &s.lengths_m, &VARIED_LENGTHS[..], 0.02..=1.5),
        ("girths", &s.girths, &VARIED_GIRTHS[..], 0.3..=3.0),
    ];
    for (table, given, known, range) in tables {
        for (name, value) in given {
            let key = format!("actor.shape.{table}.{name}");
            require(&key, known.contains(&name.as_str()), format!("one of {}", known.join(", ")), excerpt(name))?;
            within(&key, *value, range.clone())?;
        }
    }
    Ok(())
}

fn actor(a: &ActorSettings) -> RangeCheck {
    let is_blending_used = a.skin.is_some() || a.skin_blending == Blending::Linear;
    only_valid_with("actor.skin_blending", is_blending_used, "a `skin`", "none")?;
    if let Some(shape) = &a.shape {
        self::shape(shape)?;
    }
    let keys =
        [("friction", a.friction.is_some()), ("root_wrench", a.root_wrench.is_some()), ("push", a.push.is_some())];
    for (key, is_given) in keys {
        let is_valid = !is_given || a.contact == ContactMode::Simulate;
        let found = format_args!("contact = {:?}", a.contact).to_string().to_lowercase();
        only_valid_with(&format!("actor.{key}"), is_valid, "contact = \"simulate\"", found)
            .map_err(|problem| problem.needing("actor.contact"))?;
    }
    for (key, value) in [("friction", a.friction), ("root_wrench", a.root_wrench)] {
        if let Some(value) = value {
            within(&format!("actor.{key}"), value, 0.0..=10.0)?;
        }
    }
    let Some(push) = &a.push else { return Ok(()) };
    within("actor.push.at", push.at, 0.0..=3600.0)?;
    within("actor.push.impulse_ns", push.impulse_ns, 0.0..=10_000.0)?;
    let length = nalgebra::Vector3::from(push.direction).norm();
    let found = format!("{:?}", push.direction);
    require(
        "actor.push.direction",
        length > 1e-9 && length.is_finite(),
        "a direction (a vector other than zero)",
        found,
    )
}

fn observation(o: &ObservationSettings) -> RangeCheck {
    for axis in &AXES {
        let (key, strength) = (format!("observation.corruption.{}", axis.name), (axis.strength)(&o.corruption));
        within(&key, strength, 0.0..=axis.greatest)?;
        let corrupts = o.silhouette == SilhouetteSource::Corrupted;
        let expected = "0, or `observation.silhouette = \"corrupted\"`";
        require(&key, corrupts || !axis.of_masks || strength == 0.0, expected, strength)?;
    }
    for axis in o.keypoints.iter().flat_map(|_| &KEYPOINT_AXES) {
        let strength = o.keypoints.as_ref().map_or(0.0, axis.strength);
        within(&format!("observation.keypoints.{}", axis.name), strength, 0.0..=axis.greatest)?;
    }
    let images = &o.images;
    for (key, value, range) in [
        ("images.clothing_contrast", images.clothing_contrast, 0.0..=255.0),
        ("images.read_noise", images.read_noise, 0.0..=255.0),
        ("images.shot_noise", images.shot_noise, 0.0..=100.0),
        ("images.gain_drift", images.gain_drift, 0.0..=0.9),
        ("images.offset_drift", images.offset_drift, 0.0..=255.0),
        ("background.risk", o.background.risk.unwrap_or(1.0), 1e-9..=1e9),
    ] {
        within(&format!("observation.{key}"), value, range)?;
    }
    within("observation.images.background_frames", images.background_frames, 1..=1000)?;
    within("observation.images.jpeg_quality", images.jpeg_quality.unwrap_or(100), 1..=100)?;
    let cleaning = &o.background.cleaning;
    within("observation.background.cleaning.open_px", cleaning.open_px, 0..=100)?;
    within("observation.background.cleaning.close_px", cleaning.close_px, 0..=100)?;
    within("observation.background.cleaning.least_px", cleaning.least_px, 0..=1_000_000)?;
    Ok(())
}

fn distractor(table: &str, d: &DistractorSettings) -> RangeCheck {
    if let Some(own) = &d.name {
        name(&format!("{table}.name"), own)?;
    }
    motion(&format!("{table}.motion"), &d.motion)
}

fn prop(table: &str, p: &PropSettings) -> RangeCheck {
    name(&format!("{table}.name"), &p.name)?;
    for (key, length) in p.shape.lengths() {
        within(&format!("{table}.shape.{key}"), length, 0.001..=1000.0)?;
    }
    for (key, values, most) in [("place_m", p.place_m, FARTHEST), ("rotation_deg", p.rotation_deg, 360.0)] {
        for value in values {
            within(&format!("{table}.{key}"), value, -most..=most)?;
        }
    }
    Ok(())
}

fn ring(r: &RingSettings) -> RangeCheck {
    within("rig.ring.count", r.count, 1..=MOST_CAMERAS as u32)?;
    // nearer cameras would be inside the smallest body
    within("rig.ring.radius_m", r.radius_m, 0.5..=1000.0)?;
    within("rig.ring.height_m", r.height_m, -1000.0..=1000.0)?;
    above_ground("rig.ring.height_m", r.height_m)?;
    for (i, coordinate) in r.look_at_m.into_iter().flatten().enumerate() {
        within(&format!("rig.ring.look_at_m[{i}]"), coordinate, -FARTHEST..=FARTHEST)?;
    }
    within("rig.ring.first_azimuth_deg", r.first_azimuth_deg, -360.0..=360.0)?;
    if let Some(arc) = r.arc_deg {
        within("rig.ring.arc_deg", arc, 1.0..=359.0)?;
    }
    within("rig.ring.field_of_view_deg", r.field_of_view_deg, 1.0..=170.0)?;
    image_size("rig.ring.size_px", r.size_px)
}

pub(super) fn camera_file(table: &str, f: &CameraFile) -> RangeCheck {
    require(&format!("{table}.path"), !f.path.is_empty(), "a file", "nothing")?;
    if let Some(given) = &f.name {
        name(&format!("{table}.name"), given)?;
    }
    for (key, size) in [("size_px", f.size_px), ("calibrated_at_px", f.calibrated_at_px)] {
        size.map_or(Ok(()), |size| image_size(&format!("{table}.{key}"), size))?;
    }
    if let Some(first) = &f.first_camera {
        for coordinate in first.position_m.into_iter().chain(first.look_at_m) {
            within(&format!("{table}.first_camera"), coordinate, -FARTHEST..=FARTHEST)?;
        }
        above_ground(&format!("{table}.first_camera.position_m"), first.position_m[2])?;
    }
    match f.metres_per_unit {
        Some(unit) => within(&format!("{table}.metres_per_unit"), unit, 1e-6..=1e3),
        None => Ok(()),
    }
}

fn camera(table: &str, c: &CameraSettings) -> RangeCheck {
    image_size(&format!("{table}.size_px"), c.size_px)?;
    if let Some(given) = &c.name {
        name(&format!("{table}.name"), given)?;
    }
    let name = c.name.as_deref().unwrap_or("without a name");
    let [width, height] = c.size_px;
    let camera = Camera::from_opencv(name, c.matrix, c.rotation, c.translation_m, c.distortion, width, height);
    let camera = camera.map_err(|e| {
        let key = match e {
            CameraError::Rotation(_) => format!("{table}.rotation"),
            CameraError::Matrix(_) => format!("{table}.matrix"),
            _ => table.to_owned(),
        };
        KeyError::new(key, e.to_string())
    })?;
    above_ground(&format!("{table}.translation_m"), camera.centre().z)
}

fn above_ground(key: &str, height: f64) -> RangeCheck {
    require(key, height > 0.0, "a camera above the ground (z = 0)", format_args!("one at z = {height:.3} m"))
}

fn image_size(key: &str, size: [u32; 2]) -> RangeCheck {
    let sound = size.iter().all(|side| (1..=MAX_IMAGE_SIZE).contains(side));
    require(key, sound, format_args!("sides of 1 to {MAX_IMAGE_SIZE} px"), format!("{size:?}"))
}

pub(super) fn plain_name(key: &str, name: &str) -> RangeCheck {
    require(key, is_tracker_name(name), "1 to 64 letters, digits, `-` or `_`", format!("{:?}", excerpt(name)))
}

/// Whether a tracker may have this name, which is also that of a folder.
pub(crate) fn is_tracker_name(name: &str) -> bool {
    (1..=64).contains(&name.len()) && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'))
}

fn name(key: &str, name: &str) -> RangeCheck {
    let length = name.chars().count();
    let expected = format_args!("a name of 1 to {LONGEST_NAME} characters");
    require(key, (1..=LONGEST_NAME).contains(&length), expected, format_args!("{length}"))
}
