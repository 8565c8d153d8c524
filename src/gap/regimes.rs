//! The map of disagreement: the residual by climb speed, height, time, wind, voltage, place, drone.

use rand_distr::{Distribution as _, StandardNormal};

use super::compare::Comparison;
use super::dependence::Dependence;
use super::error::GapError;
use super::explain::Found;
use super::gls::Pulses;
use super::noise::Whitener;
use super::verdict::Regime;
use crate::base::rng::{Purpose, stream};
use crate::numeric::{extent, mean, rms};

/// Classes of a continuous regime. For drawing only.
const CLASSES: usize = 8;
/// Simulated flights for the standard errors: known to 9 %. Chosen for time.
const DRAWS: usize = 60;

/// The class of a group's drone in a bin: label and place on the axis.
type ClassOf<'a> = Box<dyn Fn(usize, usize, usize) -> Option<(String, f64)> + 'a>;
/// A class with its bins: group, drone, bin.
type Class = (String, f64, Vec<(usize, usize, usize)>);

/// One way of holding bins apart: its name and the class of a bin: (label, place on the axis).
struct Axis<'a> {
    by: Dependence,
    of: ClassOf<'a>,
}

/// The residual before and after in each regime; drone means are removed but for the drones' own.
///
/// # Errors
/// Effects of a vehicle that are not valid.
pub(super) fn regimes(
    before: &Comparison,
    after: &Comparison,
    found: &Found,
    seed: u64,
) -> Result<Vec<Regime>, GapError> {
    let start = before.residual(&before.vehicle, found.gusts_mps)?;
    let end = after.residual(&found.vehicle, found.gusts_mps)?;
    let patterns = after.patterns(&found.vehicle, found.gusts_mps)?;
    let whitener = Whitener::new(&patterns, &found.noise.hyper);
    let draws: Vec<Pulses> = (0..DRAWS)
        .map(|index| {
            let mut rng = stream(seed, index as u64, Purpose::Resampling);
            centred(&whitener.simulate(|| StandardNormal.sample(&mut rng)))
        })
        .collect();
    let (flat_start, flat_end) = (centred(&start), centred(&end));
    let responses: Vec<Vec<f64>> =
        patterns.iter().map(|group| group.responses(&found.noise.hyper)).collect();
    let mut rows = Vec::new();
    for axis in axes(after) {
        let by_drone = axis.by.is_of_drones();
        let (from, to) = if by_drone { (&start, &end) } else { (&flat_start, &flat_end) };
        let mut classes: Vec<Class> = Vec::new();
        for (group, drones) in to.iter().enumerate() {
            for (drone, bins) in drones.iter().enumerate() {
                for bin in 0..bins.len() {
                    let Some((label, x)) = (axis.of)(group, drone, bin) else { continue };
                    match classes.iter_mut().find(|class| class.0 == label) {
                        Some(class) => class.2.push((group, drone, bin)),
                        None => classes.push((label, x, vec![(group, drone, bin)])),
                    }
                }
            }
        }
        classes.sort_by(|a, b| a.1.total_cmp(&b.1));
        for (label, x, places) in classes {
            let over = |pulses: &Pulses| {
                mean(places.iter().map(|(g, d, b)| pulses[*g][*d][*b])).unwrap_or(f64::NAN)
            };
            let response = mean(places.iter().map(|(group, _, bin)| responses[*group][*bin]));
            let before_us = over(from);
            rows.push(Regime {
                by: axis.by,
                label,
                x,
                before_us: (before_us, rms(draws.iter().map(over)).unwrap_or_default()),
                after_us: over(to),
                before_mps: before_us / response.unwrap_or_default().max(1.0),
                bins: places.len(),
            });
        }
    }
    Ok(rows)
}

/// Pulses without each drone's mean.
fn centred(pulses: &Pulses) -> Pulses {
    let drone = |bins: &Vec<f64>| {
        let centre = mean(bins).unwrap_or_default();
        bins.iter().map(|value| value - centre).collect()
    };
    pulses.iter().map(|drones| drones.iter().map(drone).collect()).collect()
}

fn axes(after: &Comparison) -> Vec<Axis<'_>> {
    let signals = &after.scene.signals;
    let groups = &after.data.groups;
    let classed =
        move |by: Dependence, unit: &'static str, of: fn(&crate::effects::Signals) -> f64| {
            let (low, high) = extent(signals.iter().flatten().map(of)).unwrap_or_default();
            let width = ((high - low) / CLASSES as f64).max(1e-9);
            Axis {
                by,
                of: Box::new(move |group, _, bin| {
                    let value = of(signals.get(group)?.get(bin)?);
                    let class = (((value - low) / width) as usize).min(CLASSES - 1);
                    let from = low + class as f64 * width;
                    let label = format!("{from:.1} to {:.1} {unit}", from + width);
                    Some((label, from + width / 2.0))
                }),
            }
        };
    let mut axes = vec![
        Axis {
            by: Dependence::Climb,
            of: Box::new(move |group, _, bin| {
                let bin = groups.get(group)?.bins.get(bin)?;
                (!bin.is_horizontal())
                    .then(|| (format!("{:+.1} m/s", bin.climb_mps()), bin.climb_mps()))
            }),
        },
        classed(Dependence::Height, "m", |s| s.height_m),
        classed(Dependence::Time, "s", |s| s.time_s),
        classed(Dependence::Wind, "m/s", |s| s.horizontal_mps),
        classed(Dependence::Lean, "deg", |s| s.tilt_rad.to_degrees()),
        Axis {
            by: Dependence::Drone,
            of: Box::new(move |group, drone, _| {
                let slot = *groups.get(group)?.slots.get(drone)?;
                Some((format!("slot {slot}"), f64::from(slot)))
            }),
        },
        Axis {
            by: Dependence::Place,
            of: Box::new(move |group, drone, _| {
                let count = *groups.get(group)?.neighbours.get(drone)?;
                Some((format!("{count:.0} neighbours"), count))
            }),
        },
    ];
    if let Some(charge) = after.scene.charge() {
        axes.push(Axis {
            by: Dependence::Voltage,
            of: Box::new(move |group, drone, bin| {
                let share = charge.get(group)?.get(drone)?.get(bin)?;
                let class = (share * 10.0).floor().clamp(0.0, 9.0);
                let label = format!("charge {:.0} to {:.0} %", class * 10.0, class * 10.0 + 10.0);
                Some((label, class / 10.0 + 0.05))
            }),
        });
    }
    axes
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::trial;
    use super::*;

    #[test]
    fn a_continuous_regime_has_classes_of_one_width_around_their_values() {
        let comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        let axes = axes(&comparison);
        let time = axes.iter().find(|axis| axis.by == Dependence::Time).unwrap();
        let times: Vec<f64> =
            comparison.scene.signals[0].iter().map(|signals| signals.time_s).collect();
        let (first_s, last_s) = extent(times.iter().copied()).unwrap();
        let half_s = (last_s - first_s) / CLASSES as f64 / 2.0;
        let mut labels = BTreeSet::new();
        for (bin, time_s) in times.iter().enumerate() {
            let (label, middle_s) = (time.of)(0, 0, bin).unwrap();
            assert!((time_s - middle_s).abs() < half_s + 1e-9, "{time_s} s: {label}");
            labels.insert(label);
        }
        assert_eq!(labels.len(), CLASSES, "{labels:?}");
    }
}
