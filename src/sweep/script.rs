//! Scripts for Slurm. What they do is left to `skiagraph sweep cell --shard`: Slurm only decides where and when.

use std::path::Path;

use crate::input::shell_word;

/// How often what is missing is submitted again by itself.
pub(super) const ROUNDS: usize = 3;
/// How often a task that said "try again" (exit code 75) is begun again.
const RETRIES: usize = 5;

/// What scripts are written for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Job<'a> {
    /// The sweep's name.
    pub(super) name: &'a str,
    /// The sweep's folder, absolute.
    pub(super) root: &'a Path,
    /// This program.
    pub(super) program: &'a Path,
    /// Number of shards.
    pub(super) shards: usize,
    /// Minutes that a shard may take.
    pub(super) minutes: u64,
    /// How often the sweep was submitted again.
    pub(super) round: usize,
    /// More arguments of `sbatch`.
    pub(super) extra: &'a [String],
}

/// The script of one task: one shard.
pub(super) fn task(job: &Job<'_>) -> String {
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
         # 75: try again. Some sites do so themselves (RequeueExit), others have to be asked.\n\
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

/// The script of the job that ends a sweep: it submits again what is missing, and gathers.
pub(super) fn closer(job: &Job<'_>) -> String {
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

/// A path in a line that begins with `#SBATCH`.
fn in_directive(path: &Path) -> String {
    let text = path.to_string_lossy().replace('%', "%%");
    if text.contains(' ') { format!("\"{text}\"") } else { text }
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    fn job<'a>(root: &'a Path, extra: &'a [String]) -> Job<'a> {
        Job { name: "walk", root, program: Path::new("/opt/a b/skiagraph"), shards: 40, minutes: 50, round: 0, extra }
    }

    /// Bash takes the script.
    fn assert_parses(script: &str) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), script).unwrap();
        let checked = Command::new("bash").arg("-n").arg(file.path()).output().unwrap();
        assert!(checked.status.success(), "{script}\n{}", String::from_utf8_lossy(&checked.stderr));
    }

    #[test]
    fn slurms_task_runs_its_shard_and_asks_for_another_try() {
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
    fn the_closer_gathers_or_submits_again_and_gives_up_in_the_end() {
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
