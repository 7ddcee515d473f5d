//! The motions and the protocols under which each is tracked.

use std::error::Error;
use std::path::Path;

use skiagraph::scenario::ScenarioFile;

/// A tracked motion.
pub(crate) struct Subject {
    /// Name in files.
    pub(crate) name: &'static str,
    /// The scenario, a file of `scenarios/monocular` without its ending.
    pub(crate) scenario: &'static str,
    /// Overrides of the scenario: frames to track.
    pub(crate) overrides: &'static [&'static str],
    /// Heading.
    pub(crate) title: &'static str,
    /// The paper's Table 3, mm: original, switching, graph.
    pub(crate) paper: Option<[f64; 3]>,
}

/// The tracker's input.
pub(crate) struct Protocol {
    /// Its name in files.
    pub(crate) name: &'static str,
    /// Heading.
    pub(crate) title: &'static str,
    overrides: &'static [&'static str],
    /// Whether trackers with learned models are given the true root of every frame.
    gives_roots: bool,
}

/// In the order in which they are tracked.
pub(crate) const SUBJECTS: [Subject; 8] = [
    Subject {
        name: "walking",
        scenario: "walking",
        overrides: &[],
        title: "walking",
        paper: Some([44.16, 56.09, 40.88]),
    },
    Subject {
        name: "jogging",
        scenario: "jogging",
        overrides: &[],
        title: "jogging",
        paper: Some([57.21, 57.55, 53.26]),
    },
    Subject {
        name: "gesture",
        scenario: "gesture",
        overrides: &[],
        title: "gesture",
        paper: Some([17.80, 16.33, 13.23]),
    },
    Subject {
        name: "library_walking",
        scenario: "library",
        overrides: &[
            "motion.clip=49_01.amc",
            "motion.skeleton=49.asf",
            "motion.first_frame=481",
            "motion.last_frame=600",
            "motion.sha256=ea482f9a4aec1cbc82af36e5d8cbeb4c4ae847d3f276155ee668cfe448346d3a",
            "motion.source=CMU 49_01",
        ],
        title: "walking, learned from the library",
        paper: None,
    },
    Subject {
        name: "library_jogging",
        scenario: "library",
        overrides: &[
            "motion.clip=14_14_f0401-1100.amc",
            "motion.skeleton=14.asf",
            "motion.first_frame=400",
            "motion.last_frame=590",
            "motion.sha256=76bb55ee31d00f63ab255adbce0ce0e86ced35fcde4e88a9561cc69dda2dcafa",
            "motion.source=CMU 14_14",
        ],
        title: "jogging, learned from the library",
        paper: None,
    },
    Subject {
        name: "library_gesture",
        scenario: "library",
        overrides: &[],
        title: "gesture, learned from the library",
        paper: None,
    },
    Subject {
        name: "long_gestures",
        scenario: "long_gestures",
        overrides: &[],
        title: "gesture, learned from three recordings",
        paper: None,
    },
    Subject {
        name: "gesture_hard",
        scenario: "gesture_hard",
        overrides: &[],
        title: "gesture with movements that the training lacks",
        paper: None,
    },
];

/// In the order in which they are tracked and reported.
pub(crate) const PROTOCOLS: [Protocol; 3] = [
    Protocol {
        name: "paper",
        title: "as in the paper: matched body, root given",
        overrides: &["actor.robot=tracker25", "tracker_body.mismatch=none"],
        gives_roots: true,
    },
    Protocol {
        name: "standard",
        title: "standard mismatch, root tracked",
        overrides: &["tracker_body.mismatch=standard"],
        gives_roots: false,
    },
    Protocol {
        name: "lengths",
        title: "lengths known, root tracked",
        overrides: &["tracker_body.mismatch=none"],
        gives_roots: false,
    },
];

/// A motion with a protocol.
#[derive(Clone, Copy)]
pub(crate) struct Unit {
    pub(crate) subject: &'static Subject,
    pub(crate) protocol: &'static Protocol,
}

impl Unit {
    /// All of them: the paper's motions with the two most important protocols, then the rest, the third protocol last.
    pub(crate) fn all() -> Vec<Self> {
        let of = |protocol| SUBJECTS.iter().map(move |subject| Self { subject, protocol });
        let mut units: Vec<Self> = PROTOCOLS.iter().flat_map(of).collect();
        units.sort_by_key(|unit| (unit.protocol.name == "lengths", unit.subject.paper.is_none()));
        units
    }

    /// Name in files.
    pub(crate) fn name(&self) -> String {
        format!("{}-{}", self.subject.name, self.protocol.name)
    }

    /// Whether it is tracked with the standard mismatch, as in the scenario's file; the table of learning is for that
    /// body.
    pub(crate) fn is_standard(&self) -> bool {
        self.protocol.name == "standard"
    }

    /// The scenario.
    pub(crate) fn file(&self, root: &Path, seeds: u32) -> Result<ScenarioFile, Box<dyn Error>> {
        let path = root.join(format!("scenarios/monocular/{}.toml", self.subject.scenario));
        let mut overrides = vec![format!("seeds={seeds}")];
        overrides.extend(self.subject.overrides.iter().chain(self.protocol.overrides).map(|o| (*o).to_owned()));
        let plain = ScenarioFile::open(&path, &overrides)?;
        if self.protocol.gives_roots {
            let learned = plain.scenario.methods.iter().filter(|(_, method)| method.name().contains("gpdm"));
            overrides.extend(learned.map(|(name, method)| format!("methods.{name}.{}.root=oracle", method.name())));
        }
        Ok(ScenarioFile::open(&path, &overrides)?)
    }
}
