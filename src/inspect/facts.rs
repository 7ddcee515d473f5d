//! Texts about robots, recordings, skins and sets, which are the same on the terminal and on pages.

use std::collections::BTreeMap;

use super::{ClipSummary, RobotSummary, SetSummary, SkinSummary};
use skiagraph_report::FactGroup;
use skiagraph_set::{FULL_HASH_COVERS, SET_HASH_COVERS};

/// Names of facts with their values; names may occur several times.
pub type Facts = Vec<(&'static str, String)>;

impl ClipSummary {
    /// A heading of one line.
    pub fn heading(&self) -> String {
        let Self { frames, frames_per_second, duration_s, cyclic, .. } = self;
        let cycle = if *cyclic { ", one cycle" } else { "" };
        format!("recording of {frames} frames at {frames_per_second} Hz, {duration_s:.2} s{cycle}")
    }

    pub fn facts(&self) -> Facts {
        let root = self.joints.first().map_or("", |(joint, _)| joint);
        let mut facts = vec![
            ("skeleton", format!("{} joints, root {root}", self.joints.len())),
            ("height", format!("{:.2} m", self.height_m)),
            ("path", format!("{:.2} m along the ground", self.path_m)),
        ];
        if let Some(fit) = &self.fit {
            let worst = fit.worst.as_ref().map_or(String::new(), |(name, mm)| format!(", at worst {name} {mm:.1} mm"));
            let mean = format!("{:.1} mm from the recorded landmarks on average, on `actor`", fit.mean_mm);
            facts.extend([("fit", mean + &worst), ("limits", fit.describe_limits())]);
        }
        facts.push(("judged", self.judgement.clone()));
        facts.extend(joint_map(&self.joint_map));
        facts
    }
}

/// The joints of landmarks in the form that a scenario takes.
fn joint_map(map: &BTreeMap<String, String>) -> Option<(&'static str, String)> {
    let entries: Vec<String> = map.iter().map(|(landmark, joint)| format!("{landmark} = {joint:?}")).collect();
    (!map.is_empty()).then(|| ("joint_map", format!("{{ {} }}", entries.join(", "))))
}

impl RobotSummary {
    /// A heading of one line.
    pub fn heading(&self) -> String {
        format!("robot {}", self.name)
    }

    pub fn facts(&self) -> Facts {
        let ([solid_links, links], [moving, joints]) = (self.links, self.joints);
        let mut facts = vec![
            ("links", format!("{links}, {solid_links} of them with geometry")),
            ("drawn", self.drawn.describe()),
            ("joints", format!("{joints}, {moving} of them movable")),
            ("freedom", format!("{} joint angles and 6 of the root", self.degrees_of_freedom.len())),
            ("mass", format!("{:.2} kg", self.mass_kg)),
            ("height", format!("{:.2} m from the lowest to the highest joint", self.height_m)),
        ];
        facts.extend(self.drawn.describe_missing().map(|missing| ("undrawn", missing)));
        if !self.missing_markers.is_empty() {
            facts.push(("markers", format!("none for {}", self.missing_markers.join(", "))));
        }
        facts
    }
}

impl SkinSummary {
    /// A heading of one line.
    pub fn heading(&self) -> String {
        format!("skin {}", self.name)
    }

    pub fn facts(&self) -> Facts {
        let closed = match self.open_edges {
            0 => "closed".to_owned(),
            1 => "1 edge not shared by two triangles".to_owned(),
            open => format!("{open} edges not shared by two triangles"),
        };
        let below =
            format!("{:.1} mm below those of the solids of `{}`, standing", self.soles_below_solids_mm, self.body);
        let mut facts = vec![
            ("mesh", format!("{} vertices, {} triangles, {closed}", self.vertices, self.triangles)),
            ("height", format!("{:.3} m as modelled", self.height_m)),
            ("weights", self.weights.clone()),
            ("soles", below),
        ];
        if let (Some(litres), Some([x, y, z])) = (self.litres, self.centre_from_links_mm) {
            let volume = format!(
                "{litres:.1} litres; its centre is ({x:.1}, {y:.1}, {z:.1}) mm from the centre of mass of the links \
                 (forward, left, up)"
            );
            facts.push(("volume", volume));
        }
        if !self.segments.is_empty() {
            facts.push(("segments", self.segments.join(", ")));
        }
        let no_landmark = "none: modelled on the robot at its zero pose".to_owned();
        let landmarks = if self.landmarks.is_empty() { no_landmark } else { self.landmarks.join(", ") };
        facts.push(("places", landmarks));
        facts.extend(joint_map(&self.joint_map));
        facts
    }
}

impl SetSummary {
    /// A heading of one line.
    pub fn heading(&self) -> String {
        format!("benchmark set {}, {} frames at {} Hz", self.name, self.frames, self.frames_per_second)
    }

    /// The other facts, without its cameras.
    pub fn facts(&self) -> Facts {
        let no_truth = || match self.is_footage {
            true => "of a person, recorded: nobody knows the true poses".to_owned(),
            false => "unknown: this set has no truth (render --truth)".to_owned(),
        };
        let training = self.learned_from.join("; ");
        let mut facts = vec![
            ("motion", self.motion.clone().unwrap_or_else(no_truth)),
            ("bodies", self.bodies()),
            (
                "training",
                if self.training_frames == 0 {
                    training
                } else {
                    format!("{} frames: {training}", self.training_frames)
                },
            ),
            ("masks", self.observation.clone()),
            ("layers", if self.layers.is_empty() { "none".to_owned() } else { self.layers.join(", ") }),
            ("set hash", format!("{} ({SET_HASH_COVERS})", self.set_hash)),
            ("full hash", format!("{} ({FULL_HASH_COVERS})", self.full_hash)),
            (
                "files",
                self.fault.as_ref().map_or("all match files.sha256".to_owned(), |fault| format!("BROKEN: {fault}")),
            ),
        ];
        facts.extend(self.retargeting.as_ref().map(|fit| ("fit", fit.describe())));
        let contact = self.contact.iter().flat_map(|contact| contact.describe());
        facts.extend(contact.map(|(name, value)| ("contact", format!("{name}: {value}"))));
        if !self.props.is_empty() {
            facts.push(("props", self.props.join(", ")));
        }
        facts
    }

    fn bodies(&self) -> String {
        match (self.matched, self.mismatch.as_deref(), &self.actor) {
            (Some(true), ..) => "matched: tracker and actor have the same body".to_owned(),
            (Some(false), Some(how), _) if !how.is_empty() => how.to_owned(),
            (_, _, Some(actor)) => format!("actor {actor}, tracker {}", self.tracker_body),
            (.., None) => format!("tracker {}", self.tracker_body),
        }
    }
}

pub(super) fn grouped(heading: String, facts: Facts, notes: &[String]) -> Vec<FactGroup> {
    let facts = std::iter::once(("what", heading)).chain(facts).map(|(name, value)| (name.to_owned(), value)).collect();
    let notes: Vec<_> =
        notes.iter().enumerate().map(|(index, note)| (format!("note {}", index + 1), note.clone())).collect();
    let groups = [("Facts", facts), ("Notes", notes)];
    let filled = groups.into_iter().filter(|(_, facts)| !facts.is_empty());
    filled.map(|(title, facts)| FactGroup { title: title.to_owned(), facts }).collect()
}
