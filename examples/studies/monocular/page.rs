//! The page `results/monocular.md`.

use std::collections::BTreeMap;
use std::fmt::Write;

use skiagraph::evaluation::{Interval, ValueRange, mean_interval};

use super::learning::{Learned, Learning};
use super::parts::{Method, Tracked};
use super::units::{PROTOCOLS, Protocol, SUBJECTS, Subject};

/// What was measured, by the names of [`super::units`].
#[derive(Default)]
pub(crate) struct Measured {
    /// By scenario.
    pub(crate) learning: BTreeMap<String, Learning>,
    /// By subject and protocol.
    pub(crate) tracked: BTreeMap<(String, String), Tracked>,
}

/// The metric of all tables: HumanEva error, mm.
pub(crate) const ERROR: &str = "humaneva_mm";

const INTRODUCTION: &str = "CMU recordings stand in place of HumanEva's, resampled to 60 Hz; training and test frames are apart; silhouettes \
    are clean. *The paper* is the one that introduced GPDM graphs for one camera, [GPDM graph] of `REFERENCES.md`. Its figures are a reference, \
    not a like for like comparison: subject, recording and images differ. What was tried before, and on which other takes, is told in \
    [`monocular-notes.md`](monocular-notes.md).\n";

const PROTOCOLS_IN_WORDS: &str = "Every motion is tracked under three protocols:\n\n\
    * **As in the paper** (matched body, root given): actor and tracker have one body, and the trackers with learned models are given the true \
    root of every frame. What is left is the articulated pose. (`apf` and `frozen` are not given the root.)\n\
    * **Standard mismatch, root tracked**: the tracker's body has other solids and joints than the actor's, lengths that are up to 3 % and \
    girths that are up to 10 % wrong.\n\
    * **Lengths known, root tracked**: the same, but with the lengths of the subject's segments.\n";

const METHODS_IN_WORDS: &str = "`graph`, `original` and `switching_*` have 1000 particles and one layer; `graph_refined` is the graph with \
    `refinement = {}`: descent on the outline in the latent space; `graph_annealed` is the graph under 5 \
    layers of 200; `apf` is the annealed particle filter with 5 layers of 200 and no learned model beyond its proposal. \
    `nearest_training_pose` and `truth_refitted` know the truth, and `frozen` never moves: they are floors. Errors are HumanEva's (mean \
    distance of 15 markers), mm; intervals are 95 % over seeds. On the \
    library and on three recordings `original` is one GPDM of all of them, `one_of_each` one GPDM of each, which particles never leave. \
    *graph -* is the graph's error less the method's, seed by seed, with \
    its interval: where that holds 0 nothing was told apart.\n";

/// The whole page.
pub(crate) fn page(measured: &Measured, seeds: u32) -> String {
    let mut text = format!(
        "# Learned motion models, one camera\n\n\
         Made by `SKIAGRAPH_SEEDS={seeds} SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- monocular`; all digits are in `monocular.json`. {seeds} seeds. The \
         scenarios are `scenarios/monocular/*.toml`. {INTRODUCTION}\n{PROTOCOLS_IN_WORDS}\n## In one table\n\n"
    );
    text += "Error in mm and its 95 % interval; in brackets what is left once the roots lie on each other. *switching* is the one with a \
             probability of 0.05, the default.\n\n";
    text += "| motion, protocol | original | switching | graph | the paper's three | without a learned model (`apf`) | never moving |\n\
             |---|---|---|---|---|---|---|\n";
    for (subject, protocol, tracked) in each(measured) {
        text += &summary_row(subject, protocol, tracked);
    }
    text += &learning_table(measured);
    let _ = write!(text, "\n## Tracking\n\n{METHODS_IN_WORDS}\n");
    for (subject, protocol, tracked) in each(measured) {
        text += &table(subject, protocol, tracked);
    }
    text
}

fn each(measured: &Measured) -> impl Iterator<Item = (&'static Subject, &'static Protocol, &Tracked)> {
    let units = SUBJECTS.iter().flat_map(|subject| PROTOCOLS.iter().map(move |protocol| (subject, protocol)));
    units.filter_map(|(subject, protocol)| {
        let tracked = measured.tracked.get(&(subject.name.to_owned(), protocol.name.to_owned()))?;
        Some((subject, protocol, tracked))
    })
}

fn summary_row(subject: &Subject, protocol: &Protocol, tracked: &Tracked) -> String {
    let cell = |name: &str| {
        let Some(method) = tracked.methods.get(name) else { return "-".to_owned() };
        let ends = interval(method).map_or(String::new(), |i| format!(" ({:.1} to {:.1})", i.low, i.high));
        format!("{}{ends} [{}]", mean(method, ERROR, 1), mean(method, "mpjpe_root_mm", 1))
    };
    let paper = subject.paper.filter(|_| protocol.name == "paper");
    let paper = paper.map_or_else(|| "-".to_owned(), |of| of.map(|mm| mm.to_string()).join(", "));
    let [original, switching, graph, apf, frozen] = ["original", "switching_p05", "graph", "apf", "frozen"].map(cell);
    format!(
        "| {}, {} | {original} | {switching} | **{graph}** | {paper} | {apf} | {frozen} |\n",
        subject.title, protocol.title
    )
}

fn learning_table(measured: &Measured) -> String {
    let mut text = "\n## Learning\n\nOne GPDM of all training frames against the graph, for the body with standard mismatch. *Reconstruction* is the mean \
        distance between recording and simulation (Eq. 9), rad^2 over all joints; the paper (Fig. 3) has 9.7, 61.5 and 2.5 % on its walking, \
        jogging and gesture. *Best latent* is the mean error, mm, of the best latent point of every test frame at the true root: no particle on \
        the manifold does better. Seconds are those of the one thread that learns.\n\n\
        | training, tested on | recordings | frames | models of the graph | reconstruction: one GPDM | graph | graph / one | best latent: one | graph | \
        learning, s: one | graph |\n|---|---|---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for (scenario, learning) in &measured.learning {
        let Learning { frames, recordings, one, graph } = learning;
        let of = |learned: &Learned| (learned.reconstruction, learned.best_latent_mm, learned.seconds);
        let ((a, b, c), (x, y, z)) = (of(one), of(graph));
        let _ = writeln!(
            text,
            "| {scenario} | {recordings} | {frames} | {} | {a:.4} | {x:.4} | **{:.1} %** | {b:.1} | {y:.1} | {c:.1} | {z:.1} |",
            graph.models,
            100.0 * x / a
        );
    }
    text
}

fn table(subject: &Subject, protocol: &Protocol, tracked: &Tracked) -> String {
    let mut text = format!(
        "### {}, {}\n\nBodies: {}. {} test frames.\n\n\
         | method | error, mm | 95 % interval | graph -, mm | root-relative, mm | energy gap | frames far off | models | brought back |\n\
         |---|---|---|---|---|---|---|---|---|\n",
        subject.title,
        protocol.title,
        if tracked.bodies.is_empty() { "matched" } else { &tracked.bodies },
        tracked.frames
    );
    let graph = tracked.methods.get("graph");
    for (name, method) in &tracked.methods {
        let ends = interval(method).map_or("-".to_owned(), |i| format!("{:.1} to {:.1}", i.low, i.high));
        let less = graph.filter(|_| name != "graph").and_then(|graph| difference(graph, method));
        let less = less.map_or("-".to_owned(), |(mean, i)| format!("{mean:+.1} ({:+.1} to {:+.1})", i.low, i.high));
        let models = method.models.map_or("-".to_owned(), |n| n.to_string());
        let _ = writeln!(
            text,
            "| {name} | **{}** | {ends} | {less} | {} | {} | {} | {models} | {} |",
            mean(method, ERROR, 1),
            mean(method, "mpjpe_root_mm", 1),
            mean(method, "energy_gap", 4),
            mean(method, "track_loss", 3),
            method.brought_back,
        );
    }
    if protocol.name == "standard" {
        let _ = write!(
            text,
            "\n![Error of every method over the frames of {}](monocular-{}.svg)\n",
            subject.title, subject.name
        );
    }
    text + "\n"
}

/// The error of one method less that of another, seed by seed.
fn difference(one: &Method, other: &Method) -> Option<(f64, Interval)> {
    let differences: Vec<f64> = one.by_seed(ERROR).iter().zip(other.by_seed(ERROR)).map(|(a, b)| a - b).collect();
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    Some((mean, mean_interval(&[differences], ValueRange::Any)?.0))
}

fn interval(method: &Method) -> Option<Interval> {
    method.summary.metrics.get(ERROR)?.ci95
}

fn mean(method: &Method, metric: &str, digits: usize) -> String {
    method.mean(metric).map_or_else(|| "-".to_owned(), |m| format!("{m:.digits$}"))
}
