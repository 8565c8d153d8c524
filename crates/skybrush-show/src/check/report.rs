//! Findings of the checks, for people and for programs.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Write as _};

use schemars::JsonSchema;
use serde::Serialize;

use untrusted_io::names::listed;
use untrusted_io::number::{brief, fixed};

use super::cause::causes;

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// The show must not be flown like this.
    Error,
    /// The show can be flown; somebody should know this.
    Warning,
}

/// One thing that is wrong, with the drones, the time, the value and the limit.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// Name of the check: `distance`, `fence`, ...
    pub check: &'static str,
    /// Names of the drones concerned; empty when it is about the show as a whole.
    pub drones: Vec<String>,
    /// Show time at which it begins, s; absent when it is not about a moment.
    pub time_s: Option<f64>,
    /// Show time at which it ends, s.
    pub end_s: Option<f64>,
    /// The worst value.
    pub value: Option<f64>,
    /// The limit that the value breaks.
    pub limit: Option<f64>,
    /// Unit of value and limit; empty for counts.
    pub unit: &'static str,
    /// What is wrong, one sentence.
    pub message: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl Finding {
    /// A finding about the show as a whole, without a number: what else is known is filled in.
    pub fn new(
        severity: Severity,
        check: &'static str,
        message: String,
        remedy: &'static str,
    ) -> Self {
        Self {
            severity,
            check,
            drones: vec![],
            time_s: None,
            end_s: None,
            value: None,
            limit: None,
            unit: "",
            message,
            remedy,
        }
    }
}

/// The worst value that a check met, whether or not it breaks the limit.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Margin {
    /// Name of the check.
    pub check: &'static str,
    /// The quantity in words: `closest approach`.
    pub quantity: &'static str,
    /// Its worst value in the show.
    pub value: f64,
    /// The limit, if there is one.
    pub limit: Option<f64>,
    /// Unit of value and limit; empty for counts.
    pub unit: &'static str,
    /// Names of the drones concerned.
    pub drones: Vec<String>,
    /// Show time of the worst value, s.
    pub time_s: Option<f64>,
}

/// How many findings a check has, shown or not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Count {
    /// Errors found.
    pub errors: usize,
    /// Warnings found.
    pub warnings: usize,
    /// How many of both are not listed among the findings.
    pub omitted: usize,
    /// Whether the check stopped counting, so that there may be more.
    pub at_least: bool,
}

/// Everything that the checks found in a show.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct CheckReport {
    /// Number of drones in the show.
    pub drones: usize,
    /// Duration of the longest trajectory, s.
    pub duration_s: f64,
    /// What is wrong, by severity, time and drone; at most some for each check.
    pub findings: Vec<Finding>,
    /// Number of findings for each check that has any.
    pub counts: BTreeMap<&'static str, Count>,
    /// The worst value of each quantity that was checked.
    pub margins: Vec<Margin>,
    /// What was not checked, and against what the rest was, one sentence each.
    pub notes: Vec<String>,
}

impl CheckReport {
    /// Number of errors, including those that the report does not list.
    pub fn errors(&self) -> usize {
        self.counts.values().map(|count| count.errors).sum()
    }

    /// Number of warnings, including those that the report does not list.
    pub fn warnings(&self) -> usize {
        self.counts.values().map(|count| count.warnings).sum()
    }

    /// Whether the show may be flown: there are no errors.
    pub fn passed(&self) -> bool {
        self.errors() == 0
    }

    /// The report with every finding on a line of its own, where its display has one line for each cause.
    pub fn each_finding(&self) -> String {
        let mut text = String::new();
        let mut remedies: BTreeSet<(&str, &str)> = BTreeSet::new();
        for finding in &self.findings {
            let _ = writeln!(text, "{finding}");
            if !finding.remedy.is_empty() && remedies.insert((finding.check, finding.remedy)) {
                let _ = writeln!(text, "  help: {}", finding.remedy);
            }
        }
        let rest = Self { findings: Vec::new(), ..self.clone() };
        text + &rest.to_string()
    }

    /// The margin of a check, by its name.
    pub fn margin(&self, check: &str) -> Option<&Margin> {
        self.margins.iter().find(|margin| margin.check == check)
    }
}

/// `3.000 m`, `17 drones`, `5`.
struct Quantity(f64, &'static str);

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value, unit) = *self;
        match unit {
            "" => f.write_str(&fixed(value, 0)),
            "B" | "mm" | "drones" | "times" => write!(f, "{} {unit}", fixed(value, 0)),
            "s" => write!(f, "{} {unit}", fixed(value, 1)),
            _ => write!(f, "{} {unit}", brief(value)),
        }
    }
}

fn among(drones: &[String]) -> String {
    listed(drones.iter().map(String::as_str))
}

impl Finding {
    /// `error[fence]`.
    pub(super) fn head(&self) -> String {
        let severity = match self.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        format!("{severity}[{}]", self.check)
    }

    /// ` at 1.000..2.000 s`; empty where it is not about a moment.
    pub(super) fn when(&self) -> String {
        match (self.time_s, self.end_s) {
            (Some(from), Some(to)) if to - from >= 0.0005 => format!(" at {from:.3}..{to:.3} s"),
            (Some(from), _) => format!(" at {from:.3} s"),
            (None, _) => String::new(),
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.head())?;
        if !self.drones.is_empty() {
            write!(f, " {}", among(&self.drones))?;
        }
        write!(f, "{}: {}", self.when(), self.message)
    }
}

impl Margin {
    /// ` between Drone 3 and Drone 4 at 123.4 s`; nothing for a zero, which is the same everywhere.
    fn place(&self) -> String {
        if self.value == 0.0 {
            return String::new();
        }
        let drones = match self.drones.len() {
            0 => String::new(),
            2 => format!(" between {}", among(&self.drones)),
            _ => format!(" of {}", among(&self.drones)),
        };
        let time = self.time_s.map_or(String::new(), |time_s| format!(" at {time_s:.1} s"));
        drones + &time
    }
}

impl fmt::Display for Margin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}{}", self.quantity, Quantity(self.value, self.unit), self.place())?;
        if let Some(limit) = self.limit {
            write!(f, ", limit {}", Quantity(limit, self.unit))?;
        }
        Ok(())
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut remedies: BTreeSet<(&str, &str)> = BTreeSet::new();
        for cause in causes(&self.findings) {
            writeln!(f, "{cause}")?;
            for finding in cause.findings() {
                if !finding.remedy.is_empty() && remedies.insert((finding.check, finding.remedy)) {
                    writeln!(f, "  help: {}", finding.remedy)?;
                }
            }
        }
        for (check, count) in &self.counts {
            if count.omitted > 0 {
                let least = if count.at_least { "at least " } else { "" };
                writeln!(f, "{check}: and {least}{} more", count.omitted)?;
            }
        }
        if !self.margins.is_empty() {
            writeln!(f, "{:<17} {:>12} {:>12}  of what", "check", "worst", "limit")?;
        }
        for margin in &self.margins {
            let limit = margin
                .limit
                .map_or(String::new(), |limit| Quantity(limit, margin.unit).to_string());
            let worst = Quantity(margin.value, margin.unit).to_string();
            write!(f, "{:<17} {worst:>12} {limit:>12}  {}", margin.check, margin.quantity)?;
            writeln!(f, "{}", margin.place())?;
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        let number = |count: usize, word: &str| match count {
            1 => format!("1 {word}"),
            _ => format!("{count} {word}s"),
        };
        write!(
            f,
            "{}, {:.1} s: {}, {}",
            number(self.drones, "drone"),
            self.duration_s,
            number(self.errors(), "error"),
            number(self.warnings(), "warning"),
        )
    }
}

/// Warnings whose words are remembered.
const MOST_TOLD: usize = 10_000;

/// Collects findings: bounded in memory, in an order that depends on the show alone.
#[derive(Debug)]
pub struct Collector {
    per_check: usize,
    kept: BTreeMap<&'static str, Vec<(usize, Finding)>>,
    /// Where the warning with these words is among those of its check.
    told: BTreeMap<(&'static str, String), usize>,
    counts: BTreeMap<&'static str, Count>,
    margins: Vec<Margin>,
    notes: Vec<String>,
}

/// Errors first, then by time, then by the drone's place in the show; the message settles ties.
fn by_urgency(a: &(usize, Finding), b: &(usize, Finding)) -> std::cmp::Ordering {
    let moment = |finding: &Finding| finding.time_s.unwrap_or(f64::NEG_INFINITY);
    (a.1.severity.cmp(&b.1.severity))
        .then_with(|| moment(&a.1).total_cmp(&moment(&b.1)))
        .then_with(|| a.0.cmp(&b.0))
        .then_with(|| a.1.check.cmp(b.1.check))
        .then_with(|| a.1.message.cmp(&b.1.message))
}

impl Collector {
    /// Keeps at most this many findings of each check.
    pub(super) fn new(per_check: usize) -> Self {
        Self {
            per_check,
            kept: BTreeMap::new(),
            told: BTreeMap::new(),
            counts: BTreeMap::new(),
            margins: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Adds a finding about the drone with this index (the first of them, if several).
    ///
    /// A warning that is the same for many drones is one with many drones: a fleet that flies low by
    /// design is told so once.
    pub fn add(&mut self, drone: usize, finding: Finding) {
        if finding.severity == Severity::Warning && self.joins(&finding) {
            return;
        }
        let count = self.counts.entry(finding.check).or_default();
        match finding.severity {
            Severity::Error => count.errors += 1,
            Severity::Warning => count.warnings += 1,
        }
        let kept = self.kept.entry(finding.check).or_default();
        kept.push((drone, finding));
        if kept.len() > self.per_check.saturating_mul(4).saturating_add(64) {
            kept.sort_by(by_urgency);
            kept.truncate(self.per_check);
            self.told.clear();
        }
    }

    /// Adds the drone of a warning to the same one of other drones, if that was told.
    fn joins(&mut self, finding: &Finding) -> bool {
        let [name] = finding.drones.as_slice() else { return false };
        let kept = self.kept.entry(finding.check).or_default();
        let words = (finding.check, format!("{:?} {}", finding.time_s, finding.message));
        if let Some((_, same)) = self.told.get(&words).and_then(|at| kept.get_mut(*at))
            && same.end_s == finding.end_s
        {
            same.drones.push(name.clone());
            return true;
        }
        if self.told.len() > MOST_TOLD {
            self.told.clear();
        }
        self.told.insert(words, kept.len());
        false
    }

    /// Marks a check as stopped before it had counted everything.
    pub fn incomplete(&mut self, check: &'static str) {
        self.counts.entry(check).or_default().at_least = true;
    }

    /// Adds the worst value of a quantity.
    pub fn margin(&mut self, margin: Margin) {
        self.margins.push(margin);
    }

    /// Adds something that the reader must know about the whole check.
    pub fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    pub(super) fn finish(self, drones: usize, duration_s: f64) -> CheckReport {
        let Self { per_check, kept, mut counts, margins, notes, told: _ } = self;
        let mut all = Vec::new();
        for (check, mut findings) in kept {
            findings.sort_by(by_urgency);
            findings.truncate(per_check);
            if let Some(count) = counts.get_mut(check) {
                count.omitted = count.errors + count.warnings - findings.len();
            }
            all.extend(findings);
        }
        all.sort_by(by_urgency);
        let findings = all.into_iter().map(|(_, finding)| finding).collect();
        CheckReport { drones, duration_s, findings, counts, margins, notes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(severity: Severity, time_s: f64, drone: usize) -> Finding {
        Finding {
            severity,
            check: "speed-up",
            drones: vec![format!("Drone {drone}")],
            time_s: Some(time_s),
            end_s: None,
            value: Some(4.0),
            limit: Some(3.0),
            unit: "m/s",
            message: "too fast".into(),
            remedy: "slow down",
        }
    }

    #[test]
    fn keeps_the_first_and_counts_the_rest() {
        let mut collector = Collector::new(3);
        for drone in (0..1000).rev() {
            let message = format!("too fast by {drone} m/s");
            let warning = Finding { message, ..finding(Severity::Warning, 5.0, drone) };
            collector.add(drone, warning);
            collector.add(drone, finding(Severity::Error, 7.0, drone));
        }
        let report = collector.finish(1000, 60.0);
        let names: Vec<_> = report.findings.iter().map(|f| f.drones[0].as_str()).collect();
        assert_eq!(names, ["Drone 0", "Drone 1", "Drone 2"]);
        assert!(report.findings.iter().all(|f| f.severity == Severity::Error));
        assert_eq!((report.errors(), report.warnings()), (1000, 1000));
        assert!(report.to_string().contains("speed-up: and 1997 more"), "{report}");
        assert_eq!(report.to_string().matches("help: slow down").count(), 1);
    }

    #[test]
    fn the_same_warning_of_many_drones_is_one() {
        let mut collector = Collector::new(20);
        for drone in 0..49 {
            collector.add(drone, finding(Severity::Warning, 5.0, drone));
            collector.add(drone, finding(Severity::Error, 7.0, drone));
        }
        collector.add(49, finding(Severity::Warning, 5.5, 49));
        let report = collector.finish(50, 60.0);
        assert_eq!((report.errors(), report.warnings()), (49, 2));
        let one = report.findings.iter().find(|found| found.severity == Severity::Warning);
        assert!(one.is_none_or(|found| found.drones.len() == 49), "{report}");
    }

    #[test]
    fn a_margin_says_what_where_and_when() {
        let margin = Margin {
            check: "distance",
            quantity: "closest approach",
            value: 6.97,
            limit: Some(3.0),
            unit: "m",
            drones: vec!["Drone 3".into(), "Drone 4".into()],
            time_s: Some(123.4),
        };
        assert_eq!(
            margin.to_string(),
            "closest approach 6.97 m between Drone 3 and Drone 4 at 123.4 s, limit 3.00 m"
        );
    }
}
