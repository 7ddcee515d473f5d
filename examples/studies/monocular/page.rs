//! The page `results/monocular.md`.

use std::collections::BTreeMap;
use std::fmt::Write;

use skiagraph::evaluation::{Interval, ValueRange, mean_interval};

use super::learning::{Learned, Learning};
use super::parts::{Method, Tracked};
use super::units::{PROTOCOLS, Protocol, SUBJECTS, Subject};

/// All results, by the names of [`super::units`].
#[derive(Default)]
pub(crate) struct Measured {
    /// The program's commit.
    pub(crate) commit: String,
    /// By scenario.
    pub(crate) learning: BTreeMap<String, Learning>,
    /// By subject and protocol.
    pub(crate) tracked: BTreeMap<(String, String), Tracked>,
}

/// The metric of all tables: HumanEva error, mm.
pub(crate) const ERROR: &str = "humaneva_mm";

const INTRODUCTION: &str = "CMU recordings replace those of HumanEva, resampled to 60 Hz; training and test frames are disjoint; silhouettes \
    are clean. *The paper* is [GPDM graph]. Its figures are only a reference, because subjects, recordings and images differ. \
    [`monocular-notes.md`](monocular-notes.md) describes how settings were chosen, and on which takes.\n";

const PROTOCOLS_TEXT: &str = "Three protocols (combinations that are missing below were not measured):\n\n\
    * **As in the paper** (matched body, root given): actor and tracker have the same body, and the trackers with learned models are given the \
    true root of every frame. Only the articulated pose is estimated. (`apf` and `frozen` are not given the root.)\n\
    * **Standard mismatch, root tracked**: the tracker's body has other solids and joints than the actor's, length errors up to 3 % and \
    girth errors up to 10 %.\n\
    * **Lengths known, root tracked**: the same, but with the lengths of the subject's segments.\n";

const METHODS_TEXT: &str = "`graph`, `original` and `switching_*` have 1000 particles and one layer. `graph_refined` is the graph with \
    `refinement = {}`: descent on the outline in the latent space. `graph_annealed` is the graph with 5 layers of 200. `apf` is the annealed \
    particle filter with 5 layers of 200 and no learned model beyond its proposal. `nearest_training_pose` and `truth_refitted` know the \
    truth, and `frozen` never moves: they are references. On the library and on three recordings, `original` is one GPDM of all of them, \
    and `one_of_each` one GPDM per recording, which particles never leave. Errors are HumanEva's (mean distance of 15 markers), mm; \
    intervals are 95 % over seeds. *graph -* is the graph's error minus the method's, paired by seed, with its interval; if the interval \
    contains 0, the difference is not significant. *Models* is the number of GPDMs learned. *Brought back* counts the particles that left \
    the region known to their model and were reset to the nearest training latent.\n";

/// The graph compared with one GPDM: cases in which its error is lower, higher, and not significantly different.
fn against_original(measured: &Measured) -> [usize; 3] {
    let mut counts = [0; 3];
    for (.., tracked) in each(measured) {
        let [graph, original] = ["graph", "original"].map(|name| tracked.methods.get(name));
        if let Some((_, interval)) = graph.zip(original).and_then(|(graph, original)| difference(graph, original)) {
            let place = if interval.high < 0.0 { 0 } else { usize::from(interval.low <= 0.0) + 1 };
            counts[place] += 1;
        }
    }
    counts
}

/// The graph's errors under a protocol, on the paper's motions.
fn of_graph(measured: &Measured, protocol: &str) -> String {
    let cases = each(measured).filter(|(subject, of, _)| of.name == protocol && subject.paper.is_some());
    let errors = cases.filter_map(|(subject, _, tracked)| {
        Some(format!("{} mm ({})", mean(tracked.methods.get("graph")?, ERROR, 1), subject.title))
    });
    errors.collect::<Vec<_>>().join(", ")
}

/// The whole page.
pub(crate) fn page(measured: &Measured, seeds: u32) -> String {
    let [lower, higher, equal] = against_original(measured);
    let mut text = format!(
        "# Learned motion models, one camera\n\n\
         With a matched body and the root given, the error of the GPDM graph is {}; with the standard mismatch and a tracked root, {}. Compared \
         with one GPDM (`original`), the graph's error is significantly lower in {lower} of {} cases, higher in {higher}, and not \
         significantly different in {equal}.\n\n\
         ![Error of every method over the frames of the gesture, standard mismatch](monocular-gesture.svg)\n\n\
         ## Summary\n\n",
        of_graph(measured, "paper"),
        of_graph(measured, "standard"),
        lower + higher + equal,
    );
    text += "Error in mm with its 95 % interval; in square brackets the error after aligning the roots. *Switching* has a switching \
             probability of 0.05, the default.\n\n";
    text += "| motion, protocol | original | switching | graph | the paper's original, switching, graph | no learned model (`apf`) | never moving |\n\
             |---|---|---|---|---|---|---|\n";
    for (subject, protocol, tracked) in each(measured) {
        text += &summary_row(subject, protocol, tracked);
    }
    let _ = write!(text, "\n{PROTOCOLS_TEXT}");
    text += &learning_table(measured);
    let _ = write!(text, "\n## Tracking\n\n{METHODS_TEXT}\n");
    for (subject, protocol, tracked) in each(measured) {
        text += &table(subject, protocol, tracked);
    }
    let _ = write!(
        text,
        "## Method\n\nThe scenarios are `scenarios/monocular/*.toml`, with {seeds} seeds. {INTRODUCTION}\n\
         Made by `SKIAGRAPH_SEEDS={seeds} SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- monocular` at commit {}; all digits \
         are in `monocular.json`.\n",
        measured.commit
    );
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
        "| {}, {} | {original} | {switching} | {graph} | {paper} | {apf} | {frozen} |\n",
        subject.title, protocol.title
    )
}

fn learning_table(measured: &Measured) -> String {
    let mut text = "\n## Learning\n\nOne GPDM of all training frames compared with the graph, for the body with standard mismatch. *Reconstruction* is the \
        mean distance between recording and simulation ([GPDM graph], Eq. 9), rad^2 over all joints; the ratio of graph and one GPDM in the paper \
        (Fig. 3) is 9.7, 61.5 and 2.5 % on its walking, jogging and gesture. *Best latent* is the mean error, mm, of the best latent point of every \
        test frame at the true root; particles on the manifold cannot have a lower error. Seconds are those of the single learning thread.\n\n\
        | training, tested on | recordings | frames | models of the graph | reconstruction: one GPDM | graph | graph / one | best latent: one | graph | \
        learning, s: one | graph |\n|---|---|---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for (scenario, learning) in &measured.learning {
        let Learning { frames, recordings, one, graph } = learning;
        let of = |learned: &Learned| (learned.reconstruction, learned.best_latent_mm, learned.seconds);
        let ((a, b, c), (x, y, z)) = (of(one), of(graph));
        let _ = writeln!(
            text,
            "| {scenario} | {recordings} | {frames} | {} | {a:.4} | {x:.4} | {:.1} % | {b:.1} | {y:.1} | {c:.1} | {z:.1} |",
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
            "| {name} | {} | {ends} | {less} | {} | {} | {} | {models} | {} |",
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

/// The error of one method minus that of another, for each seed.
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
