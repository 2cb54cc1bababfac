//! What `sato stress` finds out, as a record and as a table.

use super::{CaseEntry, Settings, is_exact, is_native};
use crate::backend::BackendSpec;
use crate::measure::WrongAnswers;
use crate::report::{Provenance, table};
use serde::Serialize;
use std::fmt::Write;
use std::time::Duration;

/// The whole record.
#[derive(Clone, Debug, Serialize)]
pub struct StressReport {
    /// What made this report.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Answers asked for, over all cases and backends.
    pub answers_asked: u64,
    /// Answers judged.
    pub answers: u64,
    /// Time limit, if there was one.
    pub time_limit_s: Option<f64>,
    /// Wall-clock time.
    pub seconds: f64,
    /// The cases in the order in which they ran.
    pub cases: Vec<CaseReport>,
    /// Each backend over all cases.
    pub totals: Vec<BackendWrong>,
}

/// One case.
#[derive(Clone, Debug, Serialize)]
pub struct CaseReport {
    /// Its name.
    pub case: String,
    /// What is nasty about it.
    pub about: String,
    /// Different rays; a backend without a tree answers fewer of them.
    pub rays: u64,
    /// Those of them that something stops.
    pub occluded: u64,
    /// Whether all rays that it was to have were made, or the time limit came first.
    pub is_complete: bool,
    /// One for each backend.
    pub results: Vec<CaseResult>,
    /// Scenes and wrong rays that were written, relative to the output folder.
    pub files: Vec<String>,
}

/// One backend in one case.
#[derive(Clone, Debug, Serialize)]
pub struct CaseResult {
    /// Its spec with every key written out.
    pub backend: String,
    /// Rays that it answered.
    pub answers: u64,
    /// The wrong ones among its answers.
    #[serde(flatten)]
    pub wrong: WrongAnswers,
}

/// One backend over all cases.
#[derive(Clone, Debug, Serialize)]
pub struct BackendWrong {
    /// Its spec with every key written out.
    pub backend: String,
    /// What it belongs to in the table: its name and mode.
    pub group: String,
    /// Whether it is one of ours, and says that it is never wrong.
    pub is_exact: bool,
    /// Rays that it answered.
    pub answers: u64,
    /// Wrong answers among a million.
    pub wrong_per_million: f64,
    /// The wrong ones among its answers.
    #[serde(flatten)]
    pub wrong: WrongAnswers,
}

impl CaseReport {
    /// Of a case that has yet to run.
    pub(super) fn new(case: &CaseEntry, specs: &[BackendSpec]) -> Self {
        let result = |spec: &BackendSpec| CaseResult {
            backend: spec.full(),
            answers: 0,
            wrong: WrongAnswers::default(),
        };
        Self {
            case: case.name.into(),
            about: case.about.into(),
            rays: 0,
            occluded: 0,
            is_complete: true,
            results: specs.iter().map(result).collect(),
            files: Vec::new(),
        }
    }
}

impl StressReport {
    pub(super) fn new(
        provenance: Provenance,
        settings: &Settings,
        cases: Vec<CaseReport>,
        time: Duration,
    ) -> Self {
        let total = |(index, spec): (usize, &BackendSpec)| {
            let (mut answers, mut wrong) = (0, WrongAnswers::default());
            for result in cases.iter().map(|case| &case.results[index]) {
                answers += result.answers;
                wrong.merge(&result.wrong);
            }
            BackendWrong {
                backend: spec.full(),
                group: group(spec),
                is_exact: is_exact(spec),
                answers,
                wrong_per_million: wrong.per_million(answers),
                wrong,
            }
        };
        let totals: Vec<_> = settings.backends.iter().enumerate().map(total).collect();
        Self {
            provenance,
            answers_asked: settings.answers,
            answers: totals.iter().map(|t| t.answers).sum(),
            time_limit_s: settings.time_limit.map(|limit| limit.as_secs_f64()),
            seconds: time.as_secs_f64(),
            cases,
            totals,
        }
    }
}

/// Backends that share a column: those of one name and mode.
fn group(spec: &BackendSpec) -> String {
    match spec.find_value("mode") {
        Some(mode) => format!("{} {mode}", spec.name()),
        None if is_native(spec) => spec.name().to_string(),
        None => spec.full(),
    }
}

/// False and missed hits, short.
fn counts(wrong: &WrongAnswers) -> String {
    match (wrong.false_hits, wrong.missed_hits) {
        (0, 0) => "0".into(),
        (falsely, 0) => format!("{falsely} false"),
        (0, missed) => format!("{missed} missed"),
        (falsely, missed) => format!("{falsely} false, {missed} missed"),
    }
}

/// A row for each case, a column for each kind of backend; then who was wrong, and why.
pub fn stress_text(report: &StressReport) -> String {
    let mut groups: Vec<&str> = Vec::new();
    for total in &report.totals {
        if !groups.contains(&total.group.as_str()) {
            groups.push(&total.group);
        }
    }
    let members = |group: &str| {
        let of_group = |(_, total): &(usize, &BackendWrong)| total.group == group;
        report.totals.iter().enumerate().filter(of_group).map(|(i, _)| i).collect::<Vec<_>>()
    };
    let mut text = format!(
        "{} answers of {} backends judged in {:.0} s; wrong answers by case, of all backends of a \
         kind together\n\n",
        report.answers,
        report.totals.len(),
        report.seconds
    );
    let header = groups.iter().map(|group| match members(group).len() {
        1 => (*group).to_string(),
        n => format!("{group} ({n})"),
    });
    let columns = ["case", "rays", "occluded"].map(String::from);
    let mut rows = table(columns.into_iter().chain(header));
    for case in &report.cases {
        let mark = if case.is_complete { "" } else { "*" };
        let share = 100.0 * case.occluded as f64 / case.rays.max(1) as f64;
        let head = [case.case.clone(), format!("{}{mark}", case.rays), format!("{share:.1} %")];
        let sum = |group: &&str| {
            let mut wrong = WrongAnswers::default();
            members(group).into_iter().for_each(|i| wrong.merge(&case.results[i].wrong));
            counts(&wrong)
        };
        rows.add_row(head.into_iter().chain(groups.iter().map(sum)));
    }
    let of_group = |group: &&str| {
        let (mut answers, mut wrong) = (0, WrongAnswers::default());
        for index in members(group) {
            answers += report.totals[index].answers;
            wrong.merge(&report.totals[index].wrong);
        }
        (answers, wrong)
    };
    let per_million = |group: &&str| {
        let (answers, wrong) = of_group(group);
        format!("{:.2}", wrong.per_million(answers))
    };
    let head = ["in a million", "", ""].map(String::from);
    rows.add_row(head.into_iter().chain(groups.iter().map(per_million)));
    let _ = writeln!(text, "{}", rows.trim_fmt());
    if report.cases.iter().any(|case| !case.is_complete) {
        let _ = writeln!(text, "* cut short by the time limit");
    }
    let mut reasons = table(["backend", "reason", "false hits", "missed hits", "worst margin"]);
    let mut is_any = false;
    for group in &groups {
        for reason in of_group(group).1.reasons {
            is_any = true;
            reasons.add_row([
                (*group).to_string(),
                reason.reason.name().to_string(),
                reason.false_hits.to_string(),
                reason.missed_hits.to_string(),
                format!("{:.1e}", reason.worst_margin),
            ]);
        }
    }
    if is_any {
        let _ =
            writeln!(text, "\nwhy (up to some thousands of rays a case)\n{}", reasons.trim_fmt());
    }
    text.truncate(text.trim_end().len());
    text
}
