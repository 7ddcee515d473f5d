//! Text output of `skiagraph inspect`.

use super::output::counted;
use crate::benchmark_set::{FULL_HASH_COVERS, SET_HASH_COVERS};
use crate::body::DegreeOfFreedom;
use crate::experiment::{ClipSummary, Inspected, ModelSummary, RobotSummary, SetSummary, SkinSummary};
use crate::input::plain;

pub(super) fn in_words(name: &str, found: &Inspected) -> String {
    match found {
        Inspected::Model(model) => of_model(name, model),
        Inspected::Clip(clip) => of_clip(name, clip),
        Inspected::Robot(robot) => of_robot(name, robot),
        Inspected::Skin(skin) => of_skin(name, skin),
        Inspected::Set(set) => of_set(name, set),
    }
}

fn of_model(name: &str, s: &ModelSummary) -> String {
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
        text.push_str(&format!("\n  against  {kind}: mean {mean:.4} rad^2; this model has {share:.3} % of it"));
    }
    text.push_str(
        "\n\n  model  motion  first  frames  mean rad^2  max rad^2   (first: first frame, at the model's rate, from 0)",
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

fn of_clip(name: &str, s: &ClipSummary) -> String {
    let root = s.joints.first().map_or_else(String::new, |(joint, _)| plain(joint));
    let mut text = format!(
        "{name}: recording of {} frames at {} Hz, {:.2} s{}\n  skeleton {} joints, root {root}\n  height   {:.2} m\n  \
         path     {:.2} m along the ground",
        s.frames,
        s.frames_per_second,
        s.duration_s,
        if s.cyclic { ", one cycle" } else { "" },
        s.joints.len(),
        s.height_m,
        s.path_m,
    );
    if let Some(fit) = &s.fit {
        let worst =
            fit.worst.as_ref().map_or(String::new(), |(name, mm)| format!(", at worst {} {mm:.1} mm", plain(name)));
        text += &format!(
            "\n  fit      {:.1} mm from the recorded landmarks on average, on `actor`{worst}\n  limits   {}",
            fit.mean_mm,
            fit.limits_in_words()
        );
    }
    push_notes(&mut text, &s.notes);
    text
}

fn of_skin(name: &str, s: &SkinSummary) -> String {
    let mut text = format!(
        "{name}: skin {}\n  mesh     {} vertices, {} triangles, {}\n  height   {:.3} m as modelled\n  weights  {}\n  \
         soles    {:.1} mm below those of the solids of `{}`, standing",
        plain(&s.name),
        s.vertices,
        s.triangles,
        match s.open_edges {
            0 => "closed".to_owned(),
            1 => "1 edge that is not of two triangles".to_owned(),
            open => format!("{open} edges that are not of two triangles"),
        },
        s.height_m,
        s.weights,
        s.soles_below_solids_mm,
        s.body,
    );
    if let (Some(litres), Some([x, y, z])) = (s.litres, s.centre_from_links_mm) {
        text.push_str(&format!(
            "\n  volume   {litres:.1} litres; its centre lies ({x:.1}, {y:.1}, {z:.1}) mm from the centre of mass of the links \
             (ahead, left, up)"
        ));
    }
    if !s.segments.is_empty() {
        text.push_str(&format!("\n  segments {}", plain(s.segments.join(", "))));
    }
    let landmarks = match s.landmarks.as_slice() {
        [] => "none: modelled on the robot at its zero pose".to_owned(),
        named => plain(named.join(", ")),
    };
    text.push_str(&format!("\n  places   {landmarks}"));
    push_notes(&mut text, &s.notes);
    text
}

fn of_robot(name: &str, s: &RobotSummary) -> String {
    let ([solid_links, links], [moving, joints]) = (s.links, s.joints);
    let mut text = format!(
        "{name}: robot {}\n  links    {links}, {solid_links} of them with geometry\n  drawn    {}\n  joints   {joints}, {moving} of them \
        movable\n  \
         freedom  {} joint angles and 6 of the root\n  mass     {:.2} kg\n  height   {:.2} m from the lowest to the \
         highest joint",
        plain(&s.name),
        s.drawn.in_words(),
        s.degrees_of_freedom.len(),
        s.mass_kg,
        s.height_m,
    );
    if let Some(missing) = s.drawn.missing_in_words() {
        text.push_str(&format!("\n  undrawn  {missing}"));
    }
    if !s.missing_markers.is_empty() {
        text.push_str(&format!("\n  markers  none for {}", s.missing_markers.join(", ")));
    }
    push_notes(&mut text, &s.notes);
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

fn of_set(name: &str, s: &SetSummary) -> String {
    let bodies = match (s.matched, s.mismatch.as_deref(), &s.actor) {
        (Some(true), ..) => "matched: tracker and actor have the same body".to_owned(),
        (Some(false), Some(how), _) if !how.is_empty() => plain(how),
        (_, _, Some(actor)) => format!("actor {}, tracker {}", plain(actor), plain(&s.tracker_body)),
        (.., None) => format!("tracker {}", plain(&s.tracker_body)),
    };
    let training = match s.training_frames {
        0 => plain(s.learned_from.join("; ")),
        frames => format!("{frames} frames: {}", plain(s.learned_from.join("; "))),
    };
    let hashes =
        s.fault.as_ref().map_or_else(|| "all match files.sha256".to_owned(), |fault| format!("BROKEN: {fault}"));
    let mut text = format!(
        "{name}: benchmark set {}, {} frames at {} Hz\n  motion   {}\n  bodies   {bodies}\n  training {training}\n  \
         masks    {}\n  layers   {}\n  set hash {} ({SET_HASH_COVERS})\n  full hash {} ({FULL_HASH_COVERS})\n  files    {hashes}\n",
        plain(&s.name),
        s.frames,
        s.frames_per_second,
        plain(s.motion.as_deref().unwrap_or("not told: this set has no truth (render --truth)")),
        s.observation,
        if s.layers.is_empty() { "none".to_owned() } else { s.layers.join(", ") },
        s.set_hash,
        s.full_hash,
    );
    if let Some(fit) = &s.retargeting {
        text.push_str(&format!("  fit      {}\n", fit.in_words()));
    }
    for (name, value) in s.contact.iter().flat_map(|contact| contact.in_words()) {
        text.push_str(&format!("  contact  {name}: {value}\n"));
    }
    if !s.props.is_empty() {
        text.push_str(&format!("  props    {}\n", plain(s.props.join(", "))));
    }
    for camera in &s.cameras {
        let [width, height] = camera.size_px;
        let lens = if camera.distorts { "lens with distortion" } else { "no lens distortion" };
        let filming = camera.filming.iter().map(|words| format!(", {words}")).collect::<String>();
        text.push_str(&format!("\n  camera   {}, {width}x{height}, {lens}{filming}", plain(&camera.name)));
    }
    text
}

fn push_notes(text: &mut String, notes: &[String]) {
    for note in notes {
        text.push_str(&format!("\n  note     {}", plain(note)));
    }
}
