//! The facts that a set records about planting and simulation.

use skiagraph_core::body::Humanoid;
use skiagraph_physics::{PlantingReport, Push, SimulationReport, SimulationSettings};
use skiagraph_set::{ContactFacts, PushFacts, SimulationFacts};

pub(crate) fn planted(report: &PlantingReport) -> ContactFacts {
    ContactFacts {
        joints_moved_mm: Some([report.moved_mm, report.moved_most.mm]),
        raised_mm: (report.raised_mm > 0.0).then_some(report.raised_mm),
        ..ContactFacts::new("fix", report.to_string(), &report.after)
    }
}

pub(crate) fn simulated(body: &Humanoid, settings: &SimulationSettings, report: &SimulationReport) -> ContactFacts {
    let name = |link: usize| body.links.get(link).map_or_else(String::new, |link| link.name.clone());
    let push = |push: &Push| PushFacts {
        at_s: push.at_s,
        link: name(push.link),
        impulse_ns: push.impulse_ns,
        direction: push.direction.into_inner().into(),
    };
    ContactFacts {
        joints_moved_mm: Some([report.moved_mm, report.moved_most_mm]),
        simulation: Some(SimulationFacts {
            friction: settings.friction,
            root_wrench: settings.root_wrench,
            root_wrench_used: [report.root_wrench_mean, report.root_wrench_most],
            duration_s: report.duration_s,
            fell_at_s: report.fell_at_s,
            fell_at_frame: report.fell_at_frame,
            pushes: settings.pushes.iter().map(push).collect(),
        }),
        ..ContactFacts::new("simulate", report.to_string(), &report.quality)
    }
}
