//! What the arbiter says of a class of rays.

use super::table::table;
use crate::measure::{Judgement, WrongAnswers};
use serde::Serialize;
use std::fmt::Write;

/// Who was wrong in disputes, and whether anybody was where all agree.
#[derive(Clone, Debug, Serialize)]
pub struct JudgementReport {
    /// Rays that contenders disagree on; all were judged.
    pub disputed_rays: u64,
    /// Rays that were judged though all agree on them.
    pub sampled_rays: u64,
    /// Those of them that all are wrong on.
    pub wrong_in_sample: WrongAnswers,
    /// One entry for each contender.
    pub backends: Vec<BackendJudgement>,
}

/// One contender's wrong answers in disputes.
#[derive(Clone, Debug, Serialize)]
pub struct BackendJudgement {
    /// Its spec as given.
    pub backend: String,
    /// Among a million rays of the class.
    pub wrong_per_million: f64,
    /// How many, which way and why.
    #[serde(flatten)]
    pub wrong: WrongAnswers,
}

impl JudgementReport {
    /// Of `rays` rays in all, for contenders of these specs.
    pub fn new(judgement: &Judgement, rays: usize, specs: &[String]) -> Self {
        let backends = specs.iter().zip(&judgement.wrong).map(|(spec, wrong)| BackendJudgement {
            backend: spec.clone(),
            wrong_per_million: wrong.per_million(rays as u64),
            wrong: wrong.clone(),
        });
        Self {
            disputed_rays: judgement.disputed.len() as u64,
            sampled_rays: judgement.sampled as u64,
            wrong_in_sample: judgement.wrong_in_sample.clone(),
            backends: backends.collect(),
        }
    }

    /// As lines below the agreement.
    pub(super) fn text(&self) -> String {
        let wrong = &self.wrong_in_sample;
        let sample = format!(
            "of {} rays that all agree on, {} are wrong ({} false, {} missed)",
            self.sampled_rays,
            wrong.total(),
            wrong.false_hits,
            wrong.missed_hits
        );
        let mut text = String::new();
        if self.disputed_rays == 0 {
            let _ = writeln!(text, "arbiter: {sample}");
        } else {
            let _ = writeln!(text, "arbiter: {} rays in dispute; {sample}", self.disputed_rays);
            let columns =
                ["wrong in disputes", "false hits", "missed hits", "in a million", "worst margin"];
            let mut rows = table(columns);
            for backend in &self.backends {
                let wrong = &backend.wrong;
                let margins = wrong.reasons.iter().map(|r| r.worst_margin);
                let worst = margins.reduce(f64::max);
                rows.add_row([
                    backend.backend.clone(),
                    wrong.false_hits.to_string(),
                    wrong.missed_hits.to_string(),
                    format!("{:.3}", backend.wrong_per_million),
                    worst.map_or_else(|| "-".into(), |margin| format!("{margin:.1e}")),
                ]);
                for reason in &wrong.reasons {
                    rows.add_row([
                        format!("  {}", reason.reason.name()),
                        reason.false_hits.to_string(),
                        reason.missed_hits.to_string(),
                        String::new(),
                        format!("{:.1e}", reason.worst_margin),
                    ]);
                }
            }
            let _ = writeln!(text, "{}", rows.trim_fmt());
        }
        text
    }
}
