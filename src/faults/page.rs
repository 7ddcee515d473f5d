//! The report of planted faults as text for the terminal and as Markdown.

use serde_json::json;

use super::{FaultReport, FaultVerdict, PlantedFault};
use crate::scenario::TrackerSettings;
use skiagraph_core::input::{hex_sha256, plain};

impl FaultVerdict {
    fn words(self) -> &'static str {
        match self {
            Self::Silent => "SILENT",
            Self::Noticed => "noticed",
            Self::NoEffect => "no effect",
            Self::Undecided => "undecided",
            Self::NotApplicable => "not applicable",
        }
    }
}

impl PlantedFault {
    fn change(&self) -> String {
        self.change_mm.map_or_else(|| "-".to_owned(), |change| format!("{change:.1}"))
    }

    fn lost(&self) -> String {
        self.lost.map_or_else(|| "-".to_owned(), |lost| format!("{:.0} %", 100.0 * lost))
    }
}

impl FaultReport {
    fn summary(&self) -> String {
        let count = |verdict| self.faults.iter().filter(|fault| fault.verdict == verdict).count();
        format!(
            "{} on {}, {} seed{}: faults that change the estimates and are not noticed: {}; noticed: {}; without effect: {}; \
             undecided: {}; not applicable: {}",
            self.tracker,
            self.set,
            self.seeds.len(),
            if self.seeds.len() == 1 { "" } else { "s" },
            count(FaultVerdict::Silent),
            count(FaultVerdict::Noticed),
            count(FaultVerdict::NoEffect),
            count(FaultVerdict::Undecided),
            count(FaultVerdict::NotApplicable),
        )
    }

    fn meaning(&self) -> String {
        let noise = if self.noise_mm > 0.0 {
            format!(
                "two runs without a fault differ by up to {:.1} mm at one seed, and a change of up to twice that is undecided",
                self.noise_mm
            )
        } else {
            "without a fault, the tracker repeats to the bit".to_owned()
        };
        format!(
            "change: mean distance of all markers from the estimates without the fault, same seed; {noise}; lost: frames \
             without an estimate, {:.0} % without a fault",
            100.0 * self.lost
        )
    }
}

pub(crate) fn faults_text(report: &FaultReport) -> String {
    let row = |fault: &PlantedFault| {
        let message = fault.message.as_ref().map(|message| format!("\n      {message}")).unwrap_or_default();
        format!(
            "  {:<19}  {:<14}  {:>9}  {:>6}  {}{message}",
            fault.fault,
            fault.verdict.words(),
            fault.change(),
            fault.lost(),
            fault.what
        )
    };
    let head = format!("  {:<19}  {:<14}  {:>9}  {:>6}  {}", "fault", "", "change mm", "lost", "what is wrong");
    let rows = report.faults.iter().map(row);
    let lines: Vec<String> = [report.summary(), String::new(), head].into_iter().chain(rows).collect();
    format!("{}\n\n  {}", lines.join("\n"), report.meaning())
}

/// What a table of faults is made from, as a hash in its first line.
pub(crate) fn faults_source(set_hash: &str, tracker: &TrackerSettings, seeds: &[u64], only: &[String]) -> String {
    hex_sha256(json!([set_hash, tracker, seeds, only]).to_string().as_bytes())
}

/// A Markdown file; `source` is that of [`faults_source`]. The first line also has a hash of the rest, by which an
/// edited file is recognised.
pub(crate) fn faults_markdown(report: &FaultReport, source: &str) -> String {
    let cell = |text: &str| plain(text).replace('|', "\\|");
    let row = |fault: &PlantedFault| {
        let message = fault.message.as_deref().map(cell).unwrap_or_default();
        let (verdict, change, lost) = (fault.verdict.words(), fault.change(), fault.lost());
        format!("| `{}` | {} | {verdict} | {change} | {lost} | {message} |\n", fault.fault, fault.what)
    };
    let rows: String = report.faults.iter().map(row).collect();
    let body = format!(
        "# Planted faults\n\n{}.\n\n\
         | fault | what is wrong | | change, mm | frames without an estimate | what it says |\n\
         |---|---|---|---|---|---|\n{rows}\n{}. Set hash {}.\n",
        cell(&report.summary()),
        report.meaning(),
        report.set_hash
    );
    format!("<!-- skiagraph {} faults {source} {} -->\n{body}", env!("CARGO_PKG_VERSION"), hex_sha256(body.as_bytes()))
}
