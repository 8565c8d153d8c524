//! Findings of one cause as one line: which drones, and the worst of them.

use std::collections::BTreeMap;
use std::fmt;

use untrusted_io::names::listed;

use super::report::{Finding, Severity};

/// Findings that differ in nothing but drones, times and numbers. Displayed as one line, in which a finding that stands
/// for many is the worst of them.
#[derive(Clone, Debug)]
pub struct Cause<'a> {
    findings: Vec<&'a Finding>,
}

impl<'a> Cause<'a> {
    /// The findings, in the order of the report; never none.
    pub fn findings(&self) -> &[&'a Finding] {
        &self.findings
    }

    /// The first finding.
    pub fn first(&self) -> Option<&'a Finding> {
        self.findings.first().copied()
    }

    /// The finding farthest beyond its limit; the first where there is no number.
    fn worst(&self) -> Option<&'a Finding> {
        let beyond = |finding: &Finding| match (finding.value, finding.limit) {
            (Some(value), Some(limit)) => (value - limit).abs(),
            _ => 0.0,
        };
        let worse = |best: &'a Finding, other: &'a Finding| {
            if beyond(other) > beyond(best) { other } else { best }
        };
        self.findings.iter().copied().reduce(worse)
    }
}

/// Findings by their causes, in the order in which the causes came first.
pub fn causes(findings: &[Finding]) -> Vec<Cause<'_>> {
    let mut causes: Vec<Cause<'_>> = Vec::new();
    let mut known: BTreeMap<(Severity, &str, String), usize> = BTreeMap::new();
    for finding in findings {
        let key = (finding.severity, finding.check, without_numbers(&finding.message));
        if let Some(cause) = known.get(&key).and_then(|at| causes.get_mut(*at)) {
            cause.findings.push(finding);
        } else {
            known.insert(key, causes.len());
            causes.push(Cause { findings: vec![finding] });
        }
    }
    causes
}

fn without_numbers(message: &str) -> String {
    let mut pattern = String::with_capacity(message.len());
    for c in message.chars() {
        let is_number = c.is_ascii_digit() || (c == '.' && pattern.ends_with('#'));
        match c {
            _ if is_number && pattern.ends_with('#') => {}
            _ if is_number => pattern.push('#'),
            '-' => {}
            _ => pattern.push(c),
        }
    }
    pattern
}

impl fmt::Display for Cause<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(first), Some(worst)) = (self.first(), self.worst()) else { return Ok(()) };
        if self.findings.len() == 1 {
            return first.fmt(f);
        }
        let names = listed(self.findings.iter().flat_map(|one| &one.drones).map(String::as_str));
        let said = |one: &Finding| (one.time_s, one.end_s, one.message.clone());
        let has_names = !names.is_empty();
        let are_pairs = self.findings.iter().all(|one| one.drones.len() == 2);
        write!(f, "{}", first.head())?;
        if has_names {
            write!(f, " {names}")?;
        }
        if are_pairs {
            write!(f, ", {} pairs", self.findings.len())?;
        } else if self.findings.iter().all(|one| said(one) == said(first)) {
            return write!(f, "{}: {}", first.when(), first.message);
        } else {
            write!(f, ", {} findings", self.findings.len())?;
        }
        let who = listed(worst.drones.iter().map(String::as_str));
        let space = if who.is_empty() { "" } else { " " };
        write!(f, "; the worst:{space}{who}{}: {}", worst.when(), worst.message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(drones: &[u32], time_s: f64, value: f64) -> Finding {
        Finding {
            drones: drones.iter().map(|n| format!("Drone {n}")).collect(),
            time_s: Some(time_s),
            value: Some(value),
            limit: Some(10.0),
            unit: "m",
            ..Finding::new(
                Severity::Error,
                "fence",
                format!("keeps {value:.3} m at {time_s:.3} s, limit 10.000 m"),
                "fly elsewhere",
            )
        }
    }

    #[test]
    fn one_cause_is_one_line() {
        let mut findings: Vec<_> = (1..=12)
            .chain([14, 16])
            .map(|n| finding(&[n], f64::from(n), 8.0 - 0.1 * f64::from(n)))
            .collect();
        findings.push(Finding::new(Severity::Warning, "fence", "keeps 1 m".into(), ""));
        let lines: Vec<String> = causes(&findings).iter().map(ToString::to_string).collect();
        assert_eq!(
            lines,
            [
                "error[fence] drones 1-12, 14 and 16, 14 findings; the worst: Drone 16 at 16.000 s: keeps 6.400 m \
                 at 16.000 s, limit 10.000 m",
                "warning[fence]: keeps 1 m",
            ]
        );
    }

    #[test]
    fn what_is_the_same_of_all_is_said_once() {
        let findings: Vec<_> = (1..=3).map(|n| finding(&[n], 2.0, 8.0)).collect();
        let line = causes(&findings)[0].to_string();
        assert_eq!(
            line,
            "error[fence] drones 1-3 at 2.000 s: keeps 8.000 m at 2.000 s, limit 10.000 m"
        );
        let pairs = [finding(&[1, 2], 2.0, 1.0), finding(&[1, 3], 2.0, 2.0)];
        let line = causes(&pairs)[0].to_string();
        assert_eq!(
            line,
            "error[fence] drones 1-3, 2 pairs; the worst: Drone 1 and Drone 2 at 2.000 s: keeps 1.000 m at \
             2.000 s, limit 10.000 m"
        );
    }
}
