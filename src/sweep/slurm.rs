//! Submits a sweep to Slurm. The scripts call `skiagraph sweep cell --shard`; Slurm only schedules them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::estimate::cost_of;
use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use super::results::SweepResults;
use super::shards::{shard, to_ranges};
use crate::artefacts::{LockedPlace, output, write_whole};
use crate::common::{ExperimentError, to_json};
use crate::input::{plain, shell_word};

/// The folders of scripts and of Slurm's logs.
const SCRIPTS: &str = "submit";
const LOGS: &str = "log";
/// The record of the last submission.
const SUBMITTED: &str = "submitted.json";
/// Slurm's default maximum array size, for clusters that do not report theirs.
const DEFAULT_ARRAY: usize = 1001;
/// Factor between the time limit and the estimated time of a shard, since nodes differ.
const SLACK: u64 = 4;

/// Maximum number of automatic submissions.
const ROUNDS: usize = 3;
/// Maximum number of restarts of a task with exit code 75 (try again).
const RETRIES: usize = 5;

/// Options for submitting a sweep.
#[derive(Clone, Debug)]
pub struct SubmitOptions {
    /// Target time of a shard, minutes.
    pub minutes: u32,
    /// Number of shards; by default from the estimated time.
    pub shards: Option<usize>,
    /// Number of previous automatic submissions.
    pub round: usize,
    /// Neither write nor submit anything.
    pub dry_run: bool,
    /// Additional arguments for `sbatch`.
    pub extra: Vec<String>,
}

/// A submission, or the submission that a dry run would make.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submission {
    /// Number of shards.
    pub shards: usize,
    /// Shards with missing cells, in the format of job arrays.
    pub array: String,
    /// Paths and texts of the scripts.
    pub scripts: Vec<(PathBuf, String)>,
    /// The commands.
    pub commands: Vec<String>,
    /// Job ids; empty for a dry run.
    pub jobs: Vec<String>,
}

#[derive(Debug, Serialize, Deserialize)]
struct Submitted {
    schema: String,
    shards: usize,
    jobs: Vec<String>,
}

/// Submits all shards with missing cells, and a closing job that depends on them: it submits missing cells again and
/// gathers the results.
///
/// # Errors
/// [`ExperimentError::Engine`] with Slurm's error message, [`ExperimentError::Artefact`] while another process submits,
/// [`ExperimentError::Queued`] while jobs of this sweep are queued.
pub fn submit(sweep: &PlannedSweep, options: &SubmitOptions) -> Result<Submission, ExperimentError> {
    let cells = sweep.cells()?;
    let statuses = SweepResults::new(sweep).statuses(&cells);
    let missing: Vec<SweepCell> =
        cells.iter().zip(&statuses).filter(|(_, status)| status.is_none()).map(|(cell, _)| cell.clone()).collect();
    let shards = match options.shards {
        Some(shards) => shards,
        None => estimate_shards(sweep, &missing, options.minutes)?,
    }
    .clamp(1, cells.len().max(1));
    let has_missing = |part: &usize| shard(&cells, *part, shards).any(|at| statuses[at].is_none());
    let parts: Vec<usize> = (1..=shards).filter(has_missing).collect();
    let root = fs::canonicalize(&sweep.root).map_err(output(&sweep.root, "find"))?;
    let program = std::env::current_exe().map_err(output(Path::new("skiagraph"), "find the program itself"))?;
    let job = Job {
        name: &sweep.plan.name,
        root: &root,
        program: &program,
        shards,
        minutes: SLACK * u64::from(options.minutes),
        round: options.round,
        extra: &options.extra,
    };
    let folder = root.join(SCRIPTS);
    let [task_script, closing_script] = ["shard.sh", "close.sh"].map(|name| folder.join(name));
    let scripts = vec![(task_script.clone(), task(&job)), (closing_script.clone(), closer(&job))];
    let mut submission =
        Submission { shards, array: to_ranges(&parts), scripts, commands: Vec::new(), jobs: Vec::new() };
    if options.dry_run {
        let blocks = blocks(&parts, array_limit().unwrap_or(DEFAULT_ARRAY));
        submission.commands =
            blocks.iter().map(|block| shell_line(&array_command(block, &options.extra, &task_script))).collect();
        // job ids are known only after submission
        submission.commands.push(shell_line(&closing_command("<jobs above>", &options.extra, &closing_script)));
        return Ok(submission);
    }
    // held during the submission
    let _place = LockedPlace::take(&sweep.root.join(SCRIPTS))?;
    if options.round == 0 {
        refuse_queued(sweep)?;
    }
    if parts.is_empty() {
        return Ok(submission);
    }
    let limit = array_limit()?;
    for folder in [&folder, &root.join(LOGS)] {
        fs::create_dir_all(folder).map_err(output(folder, "create the directory"))?;
    }
    for (path, text) in &submission.scripts {
        write_whole(path, text.as_bytes())?;
    }
    for block in blocks(&parts, limit) {
        submission.call(&array_command(&block, &options.extra, &task_script))?;
    }
    submission.call(&closing_command(&submission.jobs.join(":"), &options.extra, &closing_script))?;
    let schema = "skiagraph.sweep_submitted/1".to_owned();
    let submitted = Submitted { schema, shards, jobs: submission.jobs.clone() };
    write_whole(&sweep.root.join(SUBMITTED), &to_json(&submitted)?)?;
    Ok(submission)
}

/// Number of shards that each take about this many minutes.
fn estimate_shards(sweep: &PlannedSweep, missing: &[SweepCell], minutes: u32) -> Result<usize, ExperimentError> {
    if missing.is_empty() {
        return Ok(1);
    }
    let cost = cost_of(missing, |cell| sweep.scenario(cell), &sweep.plan, 1)?;
    let share = missing.len() as f64 / sweep.plan.cells as f64;
    let whole = cost.core_s / share.max(1e-9);
    Ok((whole / (60.0 * f64::from(minutes))).ceil() as usize)
}

impl Submission {
    /// Calls `sbatch`, which prints the id of the job: `123` or `123;cluster`.
    fn call(&mut self, command: &[String]) -> Result<(), ExperimentError> {
        self.commands.push(shell_line(command));
        let answer = output_of(command)?;
        self.jobs.push(answer.trim().split(';').next().unwrap_or_default().to_owned());
        Ok(())
    }
}

/// Divides shards into job arrays: the offset of each array, and the indices within it.
fn blocks(parts: &[usize], limit: usize) -> Vec<(usize, Vec<usize>)> {
    let most = limit.saturating_sub(1).max(1);
    let mut blocks: Vec<(usize, Vec<usize>)> = Vec::new();
    for part in parts {
        let offset = (part - 1) / most * most;
        match blocks.last_mut() {
            Some((known, indices)) if *known == offset => indices.push(part - offset),
            _ => blocks.push((offset, vec![part - offset])),
        }
    }
    blocks
}

/// The command that submits an array with one task per shard.
fn array_command((offset, indices): &(usize, Vec<usize>), extra: &[String], script: &Path) -> Vec<String> {
    let array = [format!("--array={}", to_ranges(indices)), format!("--export=ALL,SKIAGRAPH_OFFSET={offset}")];
    sbatch(array, extra, script)
}

/// The command that submits the closing job, which waits for the others.
fn closing_command(jobs: &str, extra: &[String], script: &Path) -> Vec<String> {
    sbatch([format!("--dependency=afterany:{jobs}")], extra, script)
}

fn sbatch<const N: usize>(arguments: [String; N], extra: &[String], script: &Path) -> Vec<String> {
    let own = ["sbatch", "--parsable"].map(str::to_owned);
    [&own[..], &arguments, extra, &[script.display().to_string()]].concat()
}

/// The cluster's maximum array size.
fn array_limit() -> Result<usize, ExperimentError> {
    let config = output_of(&["scontrol", "show", "config"].map(str::to_owned))?;
    let value = |line: &str| line.strip_prefix("MaxArraySize")?.split('=').nth(1)?.trim().parse().ok();
    Ok(config.lines().find_map(value).unwrap_or(DEFAULT_ARRAY))
}

/// Refuses to submit while jobs of an earlier submission are queued or running.
fn refuse_queued(sweep: &PlannedSweep) -> Result<(), ExperimentError> {
    let Ok(bytes) = fs::read(sweep.root.join(SUBMITTED)) else { return Ok(()) };
    let Ok(last) = serde_json::from_slice::<Submitted>(&bytes) else { return Ok(()) };
    if last.jobs.is_empty() {
        return Ok(());
    }
    // squeue fails for ids that it no longer knows: then no job is queued
    let queued = output_of(&[
        "squeue".to_owned(),
        "--noheader".to_owned(),
        "--format=%i".to_owned(),
        format!("--jobs={}", last.jobs.join(",")),
    ]);
    match queued {
        Ok(queued) if !queued.trim().is_empty() => Err(ExperimentError::Queued {
            path: sweep.root.clone(),
            jobs: queued.split_whitespace().take(5).collect::<Vec<_>>().join(", "),
        }),
        _ => Ok(()),
    }
}

/// The standard output of a command.
fn output_of(command: &[String]) -> Result<String, ExperimentError> {
    let Some((program, arguments)) = command.split_first() else { return Ok(String::new()) };
    let failed = |detail: String| ExperimentError::Engine { command: shell_line(command), detail };
    let done = Command::new(program).args(arguments).output().map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => failed(format!(
            "`{program}` is not on the PATH: run this command on a node where jobs are submitted, or print the scripts \
             with --dry-run"
        )),
        _ => failed(e.to_string()),
    })?;
    if done.status.success() {
        Ok(String::from_utf8_lossy(&done.stdout).into_owned())
    } else {
        Err(failed(plain(String::from_utf8_lossy(&done.stderr).trim())))
    }
}

fn shell_line(command: &[String]) -> String {
    command.iter().map(|part| shell_word(part)).collect::<Vec<_>>().join(" ")
}

/// The values in the scripts.
#[derive(Clone, Copy, Debug)]
struct Job<'a> {
    /// The sweep's name.
    name: &'a str,
    /// Absolute path of the sweep's folder.
    root: &'a Path,
    /// Path of this program.
    program: &'a Path,
    /// Number of shards.
    shards: usize,
    /// Time limit of a shard, minutes.
    minutes: u64,
    /// Number of previous automatic submissions.
    round: usize,
    /// Additional arguments for `sbatch`.
    extra: &'a [String],
}

/// The script of a task, which runs one shard.
fn task(job: &Job<'_>) -> String {
    let (program, root) = (quoted(job.program), quoted(job.root));
    format!(
        "#!/bin/bash\n\
         #SBATCH --job-name=skiagraph-{name}\n\
         #SBATCH --output={log}/%A_%a.txt\n\
         #SBATCH --open-mode=append\n\
         #SBATCH --cpus-per-task=1\n\
         #SBATCH --time={minutes}\n\
         #SBATCH --requeue\n\
         shard=$((SLURM_ARRAY_TASK_ID + ${{SKIAGRAPH_OFFSET:-0}}))\n\
         {program} sweep cell {root} --shard \"$shard/{shards}\"\n\
         code=$?\n\
         # 75: try again. Some sites requeue such tasks themselves (RequeueExit), others do not.\n\
         if [ \"$code\" = 75 ] && [ \"${{SLURM_RESTART_COUNT:-0}}\" -lt {RETRIES} ]; then\n\
         \x20 scontrol requeue \"${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}\" && sleep 60\n\
         fi\n\
         exit \"$code\"\n",
        name = job.name,
        log = in_directive(&job.root.join("log")),
        minutes = job.minutes,
        shards = job.shards,
    )
}

/// The script of the closing job: it submits missing cells again, or gathers the results.
fn closer(job: &Job<'_>) -> String {
    let (program, root) = (quoted(job.program), quoted(job.root));
    let head = format!(
        "#!/bin/bash\n\
         #SBATCH --job-name=skiagraph-{}-close\n\
         #SBATCH --output={}/close_%j.txt\n\
         #SBATCH --time=60\n",
        job.name,
        in_directive(&job.root.join("log")),
    );
    let more: String = job.extra.iter().map(|argument| format!(" {}", shell_word(argument))).collect();
    let more = if more.is_empty() { more } else { format!(" --{more}") };
    let again = format!("{program} sweep submit {root} --shards {} --round {}{more}", job.shards, job.round + 1);
    let again = if job.round + 1 < ROUNDS {
        format!("exec {again}\n")
    } else {
        format!(
            "echo \"still missing after {ROUNDS} rounds: $missing\" >&2\n\
             {program} sweep gather {root} --allow-partial\n\
             exit 1\n"
        )
    };
    format!(
        "{head}missing=$({program} sweep status {root} --missing) || exit\n\
         if [ -z \"$missing\" ]; then exec {program} sweep gather {root}; fi\n\
         {again}"
    )
}

fn quoted(path: &Path) -> String {
    shell_word(&path.to_string_lossy())
}

/// A path for a line that begins with `#SBATCH`.
fn in_directive(path: &Path) -> String {
    let text = path.to_string_lossy().replace('%', "%%");
    if text.contains(' ') { format!("\"{text}\"") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_split_at_the_clusters_limit() {
        let parts: Vec<usize> = (1..=25).filter(|part| part % 7 != 0).collect();
        // indices 1 to 9 of an array of at most 10
        let found = blocks(&parts, 10);
        let offsets: Vec<usize> = found.iter().map(|(offset, _)| *offset).collect();
        assert_eq!(offsets, [0, 9, 18]);
        assert!(found.iter().flat_map(|(_, indices)| indices).all(|index| (1..=9).contains(index)));
        let again: Vec<usize> =
            found.iter().flat_map(|(offset, indices)| indices.iter().map(move |i| offset + i)).collect();
        assert_eq!(again, parts);
    }

    #[test]
    fn the_closer_depends_on_all_arrays() {
        let extra = ["--partition=cpu".to_owned()];
        let arrays = blocks(&[1, 2, 3, 5], 4);
        let mut commands: Vec<Vec<String>> =
            arrays.iter().map(|block| array_command(block, &extra, Path::new("/s/shard.sh"))).collect();
        commands.push(closing_command("17:18", &extra, Path::new("/s/close.sh")));
        assert_eq!(
            commands.iter().map(|command| shell_line(command)).collect::<Vec<_>>(),
            [
                "sbatch --parsable --array=1-3 --export=ALL,SKIAGRAPH_OFFSET=0 --partition=cpu /s/shard.sh",
                "sbatch --parsable --array=2 --export=ALL,SKIAGRAPH_OFFSET=3 --partition=cpu /s/shard.sh",
                "sbatch --parsable --dependency=afterany:17:18 --partition=cpu /s/close.sh",
            ]
        );
    }
    fn job<'a>(root: &'a Path, extra: &'a [String]) -> Job<'a> {
        Job { name: "walk", root, program: Path::new("/opt/a b/skiagraph"), shards: 40, minutes: 50, round: 0, extra }
    }

    /// Bash parses the script.
    fn assert_parses(script: &str) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), script).unwrap();
        let checked = Command::new("bash").arg("-n").arg(file.path()).output().unwrap();
        assert!(checked.status.success(), "{script}\n{}", String::from_utf8_lossy(&checked.stderr));
    }

    #[test]
    fn a_task_runs_its_shard_and_requeues_itself() {
        let root = Path::new("/scratch/it's/walk");
        let script = task(&job(root, &[]));
        assert_parses(&script);
        for words in [
            "#SBATCH --output=/scratch/it's/walk/log/%A_%a.txt\n",
            "shard=$((SLURM_ARRAY_TASK_ID + ${SKIAGRAPH_OFFSET:-0}))\n",
            "'/opt/a b/skiagraph' sweep cell '/scratch/it'\\''s/walk' --shard \"$shard/40\"\n",
            "scontrol requeue \"${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}\"",
            "#SBATCH --time=50\n",
        ] {
            assert!(script.contains(words), "no {words} in {script}");
        }
    }

    #[test]
    fn the_closer_gathers_or_submits_again_and_finally_gives_up() {
        let extra = ["--partition=long jobs".to_owned()];
        let first = job(Path::new("/scratch/walk"), &extra);
        let script = closer(&first);
        assert_parses(&script);
        assert!(
            script.contains("sweep submit /scratch/walk --shards 40 --round 1 -- '--partition=long jobs'\n"),
            "{script}"
        );
        assert!(script.contains("if [ -z \"$missing\" ]; then exec") && script.contains("sweep gather /scratch/walk"));
        let last = closer(&Job { round: ROUNDS - 1, ..first });
        assert_parses(&last);
        assert!(!last.contains("sweep submit") && last.contains("--allow-partial"), "{last}");
    }
}
