//! Watches one quantity of one drone against an upper limit, over the pieces in order.

use super::bernstein::Poly;
use super::report::{Collector, Finding, Margin, Severity};
use super::track::Track;
use untrusted_io::number::fixed;

/// Precision of extrema, in the unit of the quantity.
const PRECISION: f64 = 1e-6;
/// Stretches nearer to each other than this are one, s.
const JOINT_S: f64 = 1e-6;

/// A quantity that is watched, with its limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quantity {
    /// Name of the check.
    pub(super) check: &'static str,
    /// The quantity for margins: `fastest climb`.
    pub(super) label: &'static str,
    /// What the value refers to, when there are several: a zone of the fence.
    pub(super) object: Option<Object>,
    /// The quantity in a sentence: `climbs at`.
    pub(super) verb: &'static str,
    pub(super) unit: &'static str,
    pub(super) severity: Severity,
    pub(super) remedy: &'static str,
    /// Greatest value allowed (least, when `least`).
    pub(super) limit: f64,
    /// What exceeding must be more than, for the rounding of files.
    pub(super) tolerance: f64,
    /// Whether the polynomials are the square of the quantity.
    pub(super) squared: bool,
    /// Whether the limit is a least value; polynomials and values come as they are.
    pub(super) least: bool,
}

/// One of several things of a kind: `exclusion zone 2`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Object {
    pub(super) kind: &'static str,
    /// From 1, as `inspect` counts them.
    pub(super) number: usize,
}

/// A time in which the limit was broken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub(super) from_s: f64,
    pub(super) to_s: f64,
    pub(super) worst: f64,
    pub(super) worst_s: f64,
}

/// A quantity of one drone: its worst value and where it broke the limit.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    what: Quantity,
    /// (value, time s), with `least` negated so that greater is always worse.
    worst: Option<(f64, f64)>,
    stretches: Vec<Stretch>,
}

impl Watch {
    pub(super) fn new(what: Quantity) -> Self {
        Self { what, worst: None, stretches: Vec::new() }
    }

    fn signed_limit(&self) -> f64 {
        if self.what.least { -self.what.limit } else { self.what.limit }
    }

    /// Whether nothing new can come of values that are at most (with `least`, at least) this.
    pub(super) fn is_dull(&self, bound: f64) -> bool {
        let bound = if self.what.least { -bound } else { bound };
        bound <= self.signed_limit() + self.what.tolerance
            && self.worst.is_some_and(|(most, _)| bound <= most)
    }

    /// Looks at a polynomial over [0, 1] that takes `duration_s` from `start_s`.
    pub(super) fn feed(&mut self, poly: &Poly, start_s: f64, duration_s: f64) {
        let poly = if self.what.least { poly.times(-1.0) } else { *poly };
        let squared = self.what.squared;
        let plain = |value: f64| if squared { value.max(0.0).sqrt() } else { value };
        let limit = self.signed_limit();
        let most = poly.maximum(|value| {
            if squared { PRECISION * (2.0 * plain(value) + PRECISION) } else { PRECISION }
        });
        let (value, time_s) = (plain(most.value), start_s + most.u * duration_s);
        self.note(value, time_s);
        if value > limit + self.what.tolerance {
            let level = if squared { limit * limit.abs() } else { limit };
            for (from, to) in poly.times(-1.0).below(-level) {
                let part = poly.restrict(from, to).maximum(|_| PRECISION);
                self.broken(Stretch {
                    from_s: start_s + from * duration_s,
                    to_s: start_s + to * duration_s,
                    worst: plain(part.value),
                    worst_s: start_s + (from + part.u * (to - from)) * duration_s,
                });
            }
        }
    }

    /// Looks at a single value.
    pub(super) fn feed_instant(&mut self, value: f64, time_s: f64) {
        let value = if self.what.least { -value } else { value };
        self.note(value, time_s);
        if value > self.signed_limit() + self.what.tolerance {
            self.broken(Stretch { from_s: time_s, to_s: time_s, worst: value, worst_s: time_s });
        }
    }

    /// Looks at a stretch whose worst value is known.
    pub(super) fn feed_stretch(&mut self, stretch: Stretch) {
        let sign = if self.what.least { -1.0 } else { 1.0 };
        let stretch = Stretch { worst: sign * stretch.worst, ..stretch };
        self.note(stretch.worst, stretch.worst_s);
        if stretch.worst > self.signed_limit() + self.what.tolerance {
            self.broken(stretch);
        }
    }

    /// The worst value so far, if any.
    pub(super) fn worst(&self) -> Option<f64> {
        self.worst.map(|(value, _)| if self.what.least { -value } else { value })
    }

    fn note(&mut self, value: f64, time_s: f64) {
        if self.worst.is_none_or(|(most, _)| value > most + PRECISION) {
            self.worst = Some((value, time_s));
        }
    }

    fn broken(&mut self, stretch: Stretch) {
        match self.stretches.last_mut() {
            Some(last) if stretch.from_s <= last.to_s + JOINT_S => {
                last.to_s = last.to_s.max(stretch.to_s);
                if stretch.worst > last.worst + PRECISION {
                    (last.worst, last.worst_s) = (stretch.worst, stretch.worst_s);
                }
            }
            _ => self.stretches.push(stretch),
        }
    }
}

/// Reports one quantity of all drones: findings for each, and the worst of all as the margin.
pub(super) fn report<'t>(
    watches: impl Iterator<Item = (&'t Track<'t>, Watch)>,
    collector: &mut Collector,
) {
    let mut most: Option<(f64, f64, &Track<'_>, Quantity)> = None;
    for (track, watch) in watches {
        let what = watch.what;
        let sign = if what.least { -1.0 } else { 1.0 };
        if let Some((value, time_s)) = watch.worst
            && most.is_none_or(|(greatest, ..)| value > greatest + PRECISION)
        {
            most = Some((value, time_s, track, what));
        }
        for stretch in &watch.stretches {
            let value = sign * stretch.worst;
            let object = what
                .object
                .map_or(String::new(), |object| format!(" from {} {}", object.kind, object.number));
            let message = format!(
                "{} {} {unit}{object} at {:.3} s, limit {} {unit}",
                what.verb,
                fixed(value, 3),
                stretch.worst_s,
                fixed(what.limit, 3),
                unit = what.unit,
            );
            let finding = Finding {
                severity: what.severity,
                check: what.check,
                drones: vec![track.name()],
                time_s: Some(stretch.from_s),
                end_s: (stretch.to_s > stretch.from_s).then_some(stretch.to_s),
                value: Some(value),
                limit: Some(what.limit),
                unit: what.unit,
                message,
                remedy: what.remedy,
            };
            collector.add(track.index, finding);
        }
    }
    if let Some((value, time_s, track, what)) = most {
        let sign = if what.least { -1.0 } else { 1.0 };
        collector.margin(Margin {
            check: what.check,
            quantity: what.label,
            value: sign * value,
            limit: Some(what.limit),
            unit: what.unit,
            drones: vec![track.name()],
            time_s: Some(time_s),
        });
    }
}
