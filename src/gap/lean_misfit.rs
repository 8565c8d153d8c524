//! How well the leans of a flight fit a vehicle in an updraft. A body leans a vehicle by the whole air speed, and who pulls
//! more leans less: how much drones lean in climbs and descents tells a drag that is missing, and the updraft, apart from
//! whatever the pulses tell.

use super::lean_fit::{
    FORM_SHARE, InAir, Leans, Point, SCATTER_RAD, SHEAR, SLOPE_STEP, bottom, hovering_gusts_mps,
    hovering_wind, usable,
};
use super::lean_law::LeanLaw;
use crate::numeric::differences_at_once;

/// Standard deviation of the linear part of a model's law: as a share, as bodies may differ from the model by some tenths,
/// and rad/(m/s). Chosen.
const LINEAR_DOUBT: (f64, f64) = (0.3, 0.003);
/// Standard deviation of its quadratic part, as a share. Chosen likewise.
const SQUARE_DOUBT: f64 = 0.3;
/// Share of their likelihood, in nats, that leans count with. Leans of one bin and the next err alike, whatever a line and a
/// parabola take up: in 18 foreign flights in less than 3 m/s of wind, the updraft in which they were likeliest was off by
/// 1.7 times its error (rms).
const COUNTED: f64 = 0.25;
/// Variables of the fit: mean wind (two), what the law's linear and quadratic parts differ by from the model's in standard
/// deviations, and the logarithms of gusts and scatter.
const COUNT: usize = 6;

/// How unlikely leans are by a vehicle's law in its updraft, nats, but for a constant: in the wind, with the gusts and by the
/// law near the vehicle's in which they are likeliest.
pub(super) fn misfit_nats(points: Vec<Point>, law: LeanLaw) -> f64 {
    let leans = Leans::of(points);
    let model = usable(law);
    let (share, least) = LINEAR_DOUBT;
    let linear_doubt = (share * model.linear).hypot(least);
    let in_air = |at: &[f64; COUNT]| {
        let law = LeanLaw {
            linear: model.linear + at[2] * linear_doubt,
            square: model.square * (at[3] * SQUARE_DOUBT).exp(),
            ..model
        };
        let (gust_mps, scatter_rad) = (at[4].exp(), at[5].exp());
        let air = InAir { mean_mps: [at[0], at[1]], law, gust_mps, scatter_rad };
        (air, [gust_mps, gust_mps, SHEAR, FORM_SHARE, FORM_SHARE])
    };
    let of_form = |point: &Point, lean_rad: f64, _: f64| {
        let along = point.velocity_mps[2] / leans.fastest_climb_mps;
        [0.0, 0.0, 0.0, lean_rad * along, lean_rad * (2.0 * along * along - 1.0)]
    };
    let rare = |at: &[f64; COUNT]| {
        let (air, _) = in_air(at);
        0.5 * (at[2] * at[2] + at[3] * at[3] + air.unusual())
    };
    let objective = |at: &[f64; COUNT]| leans.misfits_nats(&[in_air(at)], of_form)[0] + rare(at);
    let slopes = |at: &[f64; COUNT], value: f64| {
        let all = |all: &[[f64; COUNT]; COUNT]| {
            let mut misfits = leans.misfits_nats(&all.each_ref().map(in_air), of_form);
            misfits.iter_mut().zip(all).for_each(|(misfit, at)| *misfit += rare(at));
            misfits
        };
        differences_at_once(all, at, value, SLOPE_STEP)
    };
    let [x, y] = hovering_wind(&leans.points, model);
    let gusts_mps = hovering_gusts_mps(&leans.points, model, [x, y]);
    let start = [x, y, 0.0, 0.0, gusts_mps.ln(), SCATTER_RAD.ln()];
    let (_, nats) = bottom((start, f64::INFINITY), objective, slopes);
    if nats.is_finite() { COUNTED * nats } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;
    use crate::base::air::SEA_LEVEL_DENSITY;
    use crate::vehicle::library::builtin;

    /// Law of a small drone with such a body besides its own, rad/(m/s)², in an updraft, m/s.
    fn law(more: f64, updraft_mps: f64) -> LeanLaw {
        let vehicle = builtin("pixel").unwrap();
        LeanLaw { updraft_mps, ..LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0).with_body(more) }
    }

    /// Six ladders in 2 m/s of wind by a law, with a scatter of some hundredths of a degree.
    fn flown(law: LeanLaw) -> Vec<Point> {
        let ladders =
            (0..6).flat_map(|ladder| trial::ladder().into_iter().map(move |bin| (ladder, bin)));
        ladders
            .map(|(ladder, mut bin)| {
                let later_s = 90.0 * f64::from(ladder);
                (bin.start_s, bin.end_s) = (bin.start_s + later_s, bin.end_s + later_s);
                let scatter = |turns: f64| 0.0005 * (turns * bin.start_s).sin();
                let [ahead, aside] = law.lean([1.8, -0.9], bin.climb_mps());
                let lean_rad = [ahead + scatter(2.4), aside + scatter(1.7)];
                Point::of(&bin, 30.0, lean_rad)
            })
            .collect()
    }

    #[test]
    fn leans_of_climbs_and_descents_tell_the_updraft_and_a_body_that_is_missing() {
        let points = flown(law(0.003, 1.0));
        let nats =
            |more: f64, updraft_mps: f64| misfit_nats(points.clone(), law(more, updraft_mps));
        let there = nats(0.003, 1.0);
        for elsewhere_mps in [-1.0, 0.0, 2.0] {
            let more = nats(0.003, elsewhere_mps) - there;
            assert!(more > 3.0, "{elsewhere_mps}: {more} nats");
        }
        let without = nats(0.0, 1.0) - there;
        assert!(without > 1.0, "{without} nats");
    }
}
