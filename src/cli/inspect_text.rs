//! Text output of `skiagraph inspect`.

use super::output::counted;
use crate::inspect::{ClipSummary, Facts, Inspected, ModelSummary, RobotSummary, SetSummary};
use skiagraph_core::body::DegreeOfFreedom;
use skiagraph_core::input::plain;

pub(super) fn describe(name: &str, found: &Inspected) -> String {
    match found {
        Inspected::Model(model) => describe_model(name, model),
        Inspected::Clip(clip) => describe_clip(name, clip),
        Inspected::Robot(robot) => describe_robot(name, robot),
        Inspected::Skin(skin) => {
            let text = list_facts(name, &skin.heading(), skin.facts(), &skin.notes);
            skin.motion.as_ref().map_or(text.clone(), |clip| format!("{text}\n\n{}", describe_clip(name, clip)))
        }
        Inspected::Set(set) => describe_set(name, set),
    }
}

fn describe_clip(name: &str, clip: &ClipSummary) -> String {
    list_facts(name, &clip.heading(), clip.facts(), &clip.notes)
}

fn describe_model(name: &str, s: &ModelSummary) -> String {
    let facts = &s.facts;
    let mut text = format!(
        "{name}: {}, {}, {}, {}\n  robot    {}\n  rate     {} Hz",
        facts.kind(),
        counted(s.models.len(), "model"),
        counted(s.candidates, "candidate"),
        counted(s.inter_transitions, "inter-transition"),
        plain(&facts.robot.name),
        facts.frames_per_second,
    );
    for from in &facts.learned_from {
        text.push_str(&format!("\n  learned from {}, {} frames", plain(&from.clip), from.frames));
    }
    let error = &s.reconstruction_error_rad2;
    text.push_str(&format!(
        "\n  error    mean {:.4} rad^2, max {:.4} rad^2 between recording and simulation",
        error.mean, error.max
    ));
    if let Some(other) = &s.against {
        let (kind, mean) = (other.kind, other.reconstruction_error_rad2.mean);
        let share = 100.0 * other.ratio;
        text.push_str(&format!("\n  against  {kind}: mean {mean:.4} rad^2; this model's error is {share:.3} % of it"));
    }
    text.push_str(
        "\n\n  model  motion  first  frames  mean rad^2  max rad^2   (first: first frame, at the model's rate, counted from 0)",
    );
    for (index, model) in s.models.iter().enumerate() {
        let error = &model.reconstruction_error_rad2;
        text.push_str(&format!(
            "\n  {index:>5}  {:>6}  {:>5}  {:>6}  {:>10.4}  {:>9.4}",
            model.motion, model.first, model.frames, error.mean, error.max
        ));
    }
    text
}

fn list_facts(name: &str, heading: &str, facts: Facts, notes: &[String]) -> String {
    let mut text = format!("{name}: {}", plain(heading));
    for (fact, value) in facts.into_iter().chain(notes.iter().map(|note| ("note", note.clone()))) {
        text.push_str(&format!("\n  {fact:<8} {}", plain(value)));
    }
    text
}

fn describe_robot(name: &str, s: &RobotSummary) -> String {
    let mut text = list_facts(name, &s.heading(), s.facts(), &s.notes);
    let width = s.degrees_of_freedom.iter().map(|dof| dof.name.len()).max().unwrap_or(0).max("angle".len());
    text.push_str(&format!("\n\n  {:<width$}    lower    upper  velocity   effort", "angle"));
    let shown = |value: f64| if value.is_finite() { format!("{value:.3}") } else { "-".to_owned() };
    for DegreeOfFreedom { name, lower, upper, max_velocity, max_effort } in &s.degrees_of_freedom {
        let name = plain(name);
        let [lower, upper, velocity, effort] = [*lower, *upper, *max_velocity, *max_effort].map(shown);
        text.push_str(&format!("\n  {name:<width$}  {lower:>7}  {upper:>7}  {velocity:>8}  {effort:>7}"));
    }
    text
}

fn describe_set(name: &str, s: &SetSummary) -> String {
    let mut text = list_facts(name, &s.heading(), s.facts(), &[]) + "\n";
    for camera in &s.cameras {
        let [width, height] = camera.size_px;
        let lens = if camera.distorts { "lens with distortion" } else { "no lens distortion" };
        let filming = camera.filming.iter().map(|words| format!(", {words}")).collect::<String>();
        text.push_str(&format!("\n  camera   {}, {width}x{height}, {lens}{filming}", plain(&camera.name)));
    }
    text
}
