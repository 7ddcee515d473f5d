//! `skiagraph explain`: repeats a run with its inputs replaced by the truth, and divides its error among them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::cell::Cells;
use super::errors::ErrorProfile;
use super::explanation::{Cause, CauseParts, ExplainedCell, Explanation, NotReplaced, Repetition, SCHEMA};
use super::page::page;
use super::player::{INPUTS, Player, Sees};
use super::shares::{Subset, shapley, single, subsets};
use super::source::RepeatableRun;
use super::swap::check_observations;
use super::worst::{choose_worst, worst_seconds};
use super::{EXPLAIN_FILE, EXPLAIN_PAGE};
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, MadeBy};
use crate::common::{ExperimentError, Progress, to_json};
use crate::runs::MoreOf;
use crate::tracking::program::hashes_in;
use crate::tracking::unfinished_run::UnfinishedRun;
use skiagraph_eval::{ValueRange, mean_interval};
use skiagraph_set::BenchmarkSet;

const QUICK_SEEDS: usize = 2;

#[derive(Clone, Copy, Debug, Default)]
pub struct ExplainOptions<'a> {
    /// Whether only single inputs and all together are replaced.
    pub quick: bool,
    /// Whether a tracker whose repetition differs is explained all the same.
    pub accepts_chance: bool,
    /// Number of seeds, of the run's first; by default all, with `quick` two.
    pub seeds: Option<usize>,
    /// Number of worst seconds that are written as sets, and whether these begin with the run's first frame.
    pub worst: (usize, bool),
    /// The command line of the run's program, if another program tracked.
    pub exec: Option<&'a str>,
    /// Where the run's set is.
    pub from: MoreOf<'a>,
}

/// Explains a run, and writes `explain.json` and `explain.html` into a folder.
///
/// # Errors
/// [`ExperimentError`]; nothing is written then but finished repetitions, with which the same command goes on.
pub fn explain(
    run: &Path,
    to: Destination<'_>,
    options: &ExplainOptions<'_>,
    progress: &dyn Progress,
) -> Result<Explanation, ExperimentError> {
    let inputs = [run.to_owned()].into_iter().chain(options.from.sets.iter().cloned());
    Inputs::new(inputs.clone()).keep_from(to.path)?;
    let source = RepeatableRun::read(run, options.exec, options.from, progress)?;
    let made_by = made_by(run, &source, options);
    let directory = Artefact::begin_unless(to, ArtefactKind::Folder, difference(to.path, &made_by))?;
    let unfinished = UnfinishedRun::begin(to, &of_repetitions(&made_by, &source))?;
    let directory = directory.made_by(made_by);
    let explanation = of_run(run, &source, inputs.collect(), options, (&directory, &unfinished), progress);
    let explanation = explanation.map_err(|error| unfinished.with_progress(error))?;
    directory.write(EXPLAIN_PAGE, page(&explanation)?.as_bytes())?;
    directory.write(EXPLAIN_FILE, &to_json(&explanation)?)?;
    directory.finish()?;
    unfinished.finish();
    Ok(explanation)
}

/// What determines the error of every repetition, and which of them are wanted.
fn made_by(run: &Path, source: &RepeatableRun, options: &ExplainOptions<'_>) -> MadeBy {
    let mut settings = json!(source.tracker);
    settings["--calibrate"] = json!(source.set.blind.start.calibrate);
    settings["--quick"] = json!(options.quick);
    settings["seeds"] = json!(chosen_seeds(source, options));
    let made_by = MadeBy::new("skiagraph explain", settings);
    made_by.of("run", run.display().to_string()).of("set", &source.record.set_hash)
}

/// The same for any number of seeds, with the files of its program, and quick or not.
fn of_repetitions(made_by: &MadeBy, source: &RepeatableRun) -> MadeBy {
    let mut each = made_by.of_each_seed();
    each.settings["--quick"] = Value::Null;
    each.inputs.extend(source.record.program.iter().flat_map(|program| hashes_in(&program.command)));
    each
}

/// How an explanation in a folder differs, if this one should not replace it: it is of another run, or fuller.
fn difference(folder: &Path, made_by: &MadeBy) -> Option<String> {
    let Some(there) = MadeBy::at(folder) else { return made_by.difference_at(folder) };
    let seeds = |of: &MadeBy| of.settings["seeds"].as_array().map_or(0, Vec::len);
    let is_fuller = there.settings["--quick"] == false && made_by.settings["--quick"] == true;
    let mut same = there.of_each_seed();
    same.settings["--quick"] = made_by.settings["--quick"].clone();
    let fuller = "it is a fuller explanation of the same run, without --quick or of more seeds";
    let other = same.difference(&made_by.of_each_seed());
    other.or_else(|| (is_fuller || seeds(&there) > seeds(made_by)).then(|| fuller.to_owned()))
}

fn chosen_seeds(source: &RepeatableRun, options: &ExplainOptions<'_>) -> Vec<u64> {
    let all = source.tracked.estimates.sequences.len();
    let usual = if options.quick { all.min(QUICK_SEEDS) } else { all };
    let count = options.seeds.unwrap_or(usual).clamp(1, all.max(1));
    source.tracked.estimates.seeds.iter().copied().take(count).collect()
}

fn of_run(
    run: &Path,
    source: &RepeatableRun,
    hidden: Vec<PathBuf>,
    options: &ExplainOptions<'_>,
    (directory, unfinished): (&Artefact, &UnfinishedRun),
    progress: &dyn Progress,
) -> Result<Explanation, ExperimentError> {
    let (set, sees) = (&source.set, Sees::of(&source.tracker));
    let (players, mut left_out) = players(source, sees);
    if players.contains(&Player::Time) || players.contains(&Player::Observations) {
        check_observations(set)?;
    }
    let seeds = chosen_seeds(source, options);
    let count = seeds.len();
    if let Some(wanted) = options.seeds.filter(|wanted| *wanted > count) {
        progress.note(&format!("--seeds {wanted}: the run has {count}, and all of them are explained"));
    }
    let needed = subsets(players.len(), options.quick);
    let mut cells = Cells::new(source, seeds.clone(), hidden, unfinished);
    let worst = choose_worst(source, &cells, options.worst, progress)?;
    let finished = needed.iter().skip(1).map(|subset| cells.finished(&members(&players, *subset))).sum();
    note_cost(source, (needed.len() - 1, count, finished), options.quick, players.len(), progress);
    let of_run: Vec<ErrorProfile> =
        source.tracked.estimates.sequences.iter().take(count).map(|sequence| cells.error(sequence)).collect();
    let repetition = repeat(source, &mut cells, options.accepts_chance, progress)?;
    let mut errors: BTreeMap<Subset, Vec<ErrorProfile>> = BTreeMap::from([(0, of_run)]);
    for (done, subset) in needed.iter().enumerate().skip(1) {
        progress.set_status(&format!("run {done} of {}", needed.len() - 1));
        errors.insert(*subset, cells.errors(&members(&players, *subset), progress)?);
    }
    let descent = match left_out.iter().any(|left| left.player == Player::Search) {
        true => None,
        false => cells.error_of_descent(&players, progress)?,
    };
    if descent.is_none() && !left_out.iter().any(|left| left.player == Player::Search) {
        let reason = "only trackers that compare silhouettes alone have a descent";
        left_out.push(NotReplaced { player: Player::Search, name: Player::Search.title(sees, set), reason });
    }
    let mut explanation = Explanation {
        schema: SCHEMA,
        run: run.display().to_string(),
        scenario: set.blind.name.clone(),
        set_hash: set.blind.set_hash.clone(),
        tracker: source.record.tracker.clone(),
        seeds,
        version: env!("CARGO_PKG_VERSION"),
        quick: options.quick,
        repetition,
        sentence: String::new(),
        error_mm: 0.0,
        causes: Vec::new(),
        interaction_mm: None,
        interaction: None,
        rest_mm: 0.0,
        rest: CauseParts::new(&ErrorProfile::zero(0)),
        frames_without_image: frames_without_image(set),
        left_out,
        cells: Vec::new(),
        frames_per_second: set.blind.frames_per_second,
        worst: worst_seconds(source, &mut cells, worst, directory, progress)?,
    };
    explanation.divide(source, &players, &errors, descent.as_ref());
    explanation.sentence = explanation.describe();
    Ok(explanation)
}

fn frames_without_image(set: &BenchmarkSet) -> Option<usize> {
    let is_blind = |frame: &usize| (0..set.blind.rig.cameras.len()).all(|camera| !set.blind.has_image(camera, *frame));
    Some((0..set.blind.frame_count).filter(is_blind).count()).filter(|count| *count > 0)
}

impl Explanation {
    fn divide(
        &mut self,
        source: &RepeatableRun,
        players: &[Player],
        errors: &BTreeMap<Subset, Vec<ErrorProfile>>,
        descent: Option<&ErrorProfile>,
    ) {
        let (set, sees) = (&source.set, Sees::of(&source.tracker));
        let none = ErrorProfile::zero(set.blind.frame_count);
        let whole: Subset = (1 << players.len()) - 1;
        let of_seed = |subset: Subset, seed: usize| errors.get(&subset).and_then(|all| all.get(seed)).unwrap_or(&none);
        let mean = |subset| ErrorProfile::mean(errors.get(&subset).map_or(&[], Vec::as_slice));
        let is_quick = self.quick && players.len() > 1;
        let seeds = 0..self.seeds.len();
        let divided: Vec<(Vec<ErrorProfile>, Option<ErrorProfile>)> = seeds
            .clone()
            .map(|seed| match is_quick {
                true => {
                    let (parts, interaction) = single(players.len(), |subset| of_seed(subset, seed));
                    (parts, Some(interaction))
                }
                false => (shapley(players.len(), |subset| of_seed(subset, seed)), None),
            })
            .collect();
        let before = mean(0);
        self.error_mm = before.total;
        for (index, player) in players.iter().enumerate() {
            let parts: Vec<ErrorProfile> = divided.iter().map(|(parts, _)| parts[index].clone()).collect();
            let alone = before.total - mean(1 << index).total;
            self.causes.push(cause(*player, sees, source, &parts, alone));
        }
        if let Some(descent) = descent {
            let parts: Vec<ErrorProfile> = seeds.map(|seed| of_seed(whole, seed).minus(descent)).collect();
            let alone = ErrorProfile::mean(&parts).total;
            self.causes.push(cause(Player::Search, sees, source, &parts, alone));
        }
        let interactions: Vec<ErrorProfile> = divided.into_iter().filter_map(|(_, interaction)| interaction).collect();
        let interaction = is_quick.then(|| ErrorProfile::mean(&interactions));
        (self.interaction_mm, self.interaction) =
            (interaction.as_ref().map(|mean| mean.total), interaction.as_ref().map(CauseParts::new));
        let rest = descent.cloned().unwrap_or_else(|| mean(whole));
        (self.rest_mm, self.rest) = (rest.total, CauseParts::new(&rest));
        let total = |error: &ErrorProfile| error.total;
        self.cells = errors
            .iter()
            .map(|(subset, errors)| ExplainedCell {
                replaced: members(players, *subset),
                error_mm: errors.iter().map(total).collect(),
            })
            .collect();
        self.cells.extend(descent.map(|descent| ExplainedCell {
            replaced: players.iter().copied().chain([Player::Search]).collect(),
            error_mm: vec![descent.total],
        }));
    }
}

fn cause(player: Player, sees: Sees, source: &RepeatableRun, seeds: &[ErrorProfile], alone_mm: f64) -> Cause {
    let totals: Vec<f64> = seeds.iter().map(|seed| seed.total).collect();
    let part = ErrorProfile::mean(seeds);
    Cause {
        player,
        name: player.title(sees, &source.set),
        fault: player.fault(&source.set, sees),
        error_mm: part.total,
        interval: mean_interval(&[totals], ValueRange::Any).map(|(interval, _)| interval),
        alone_mm,
        parts: CauseParts::new(&part),
    }
}

fn members(players: &[Player], subset: Subset) -> Vec<Player> {
    players.iter().enumerate().filter(|(index, _)| subset & (1 << index) != 0).map(|(_, player)| *player).collect()
}

/// The inputs that are replaced, and what is left out, with the reason.
fn players(source: &RepeatableRun, sees: Sees) -> (Vec<Player>, Vec<NotReplaced>) {
    let (set, kind) = (&source.set, source.tracker.kind());
    let reason = |player: Player| match player {
        Player::Body if kind.model_file().is_some() => Some("the model file belongs to the given body"),
        Player::Search if kind.search.is_none() => Some("only trackers that compare silhouettes have a descent"),
        Player::Search => None,
        player if player.differs(set, sees) => None,
        _ => Some("the tracker has the truth already"),
    };
    let (mut players, mut left_out) = (Vec::new(), Vec::new());
    for player in INPUTS.into_iter().chain([Player::Search]) {
        match reason(player) {
            Some(reason) => left_out.push(NotReplaced { player, name: player.title(sees, set), reason }),
            None if player == Player::Search => {}
            None => players.push(player),
        }
    }
    (players, left_out)
}

fn note_cost(
    source: &RepeatableRun,
    (runs, seeds, finished): (usize, usize, usize),
    quick: bool,
    inputs: usize,
    progress: &dyn Progress,
) {
    let time = source.record.timing.map(|timing| {
        let of_seed = timing.seconds / source.record.seeds.len().max(1) as f64;
        format!(", about {:.0} s at the speed of the run", of_seed * (runs * seeds - finished + 1) as f64)
    });
    let fewer = subsets(inputs, true).len() - 1;
    let cheaper = if quick || fewer == runs { String::new() } else { format!(" (with --quick {fewer})") };
    let counted = |count: usize, thing: &str| format!("{count} {thing}{}", if count == 1 { "" } else { "s" });
    progress.note(&format!(
        "{} of {}{cheaper}, and one seed to check that the run repeats{}",
        counted(runs, "run"),
        counted(seeds, "seed"),
        time.unwrap_or_default()
    ));
    if finished > 0 {
        progress.note(&format!("resumed: {finished} of {} were finished before the interruption", runs * seeds));
    }
}

/// Repeats the first seed with nothing replaced.
///
/// # Errors
/// [`ExperimentError::Malformed`] if the estimates differ and chance is not accepted.
fn repeat(
    source: &RepeatableRun,
    cells: &mut Cells<'_>,
    accepts_chance: bool,
    progress: &dyn Progress,
) -> Result<Repetition, ExperimentError> {
    let seed = cells.seeds.first().copied().unwrap_or_default();
    let tracked = cells.track(&source.set, &[seed], false, progress)?;
    let (again, before) = (tracked.estimates.sequences.first(), source.tracked.estimates.sequences.first());
    let error = |sequence: Option<_>| sequence.map_or(f64::NAN, |sequence| cells.error(sequence).total);
    let is_identical = again.map(|sequence| &sequence.markers) == before.map(|sequence| &sequence.markers);
    let found = Repetition { seed, is_identical, error_mm: error(again), error_in_run_mm: error(before) };
    if is_identical {
        return Ok(found);
    }
    let difference = format!(
        "with nothing replaced, seed {seed} gives {:.3} mm, in the run {:.3} mm",
        found.error_mm, found.error_in_run_mm
    );
    if accepts_chance {
        progress.note(&format!(
            "{difference}: the tracker is not deterministic, so small parts may be chance; other repetitions may \
             differ by much more"
        ));
        return Ok(found);
    }
    Err(ExperimentError::Argument {
        argument: "RUN",
        detail: format!(
            "{difference}: the tracker is not deterministic, or was made by another version (of the run: {}), so that \
             causes cannot be told from chance; run it again with this version, or use --accept-chance",
            source.record.version
        ),
    })
}
