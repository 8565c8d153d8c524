//! Records with any gaps: what cannot be told is absent, and nothing fails.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use turbulence_statistics::points::{At, advection, by_distance};
use turbulence_statistics::spectrum::{Instrument, cross, mean, spectrum};
use turbulence_statistics::{Record, moments};

/// Values in stretches of about `kept`, with gaps of about `lost` between them.
fn record(random: &mut Pcg64, [kept, lost]: [usize; 2]) -> Record {
    let mut values = Vec::new();
    while values.len() < 400 {
        for _ in 0..random.random_range(0..=2 * kept) {
            values.push(Some(random.random_range(-1.0..1.0)));
        }
        values.extend((0..random.random_range(0..=2 * lost)).map(|_| None));
    }
    Record::new(1.0, values.into_iter().take(400))
}

#[test]
fn records_of_short_stretches_have_no_spectrum_and_do_no_harm() {
    let mut random = Pcg64::seed_from_u64(4);
    let instrument = Instrument::default();
    let mut without = 0;
    for kept in [0, 1, 5, 20, 60, 200] {
        for lost in [1, 4, 15, 60] {
            let all: Vec<Record> = (0..7).map(|_| record(&mut random, [kept, lost])).collect();
            let refs: Vec<&Record> = all.iter().collect();
            let bands = spectrum(&all[0], &instrument);
            without += usize::from(bands.is_empty());
            for band in bands.iter().chain(&mean(&refs, &instrument)) {
                assert!(
                    band.density.is_finite() && band.low <= band.high,
                    "{kept} {lost} {band:?}"
                );
            }
            let _ = cross(&all[0], &all[1], &instrument);
            let _ = moments::variance(&all[0], 0.0, 0.03);
            let _ = moments::mean_variance(&refs, &[0.0; 7], 0.03);
            let _ = moments::skewness(&all[0], 0.0);
            let places = all.iter().enumerate();
            let points: Vec<At<'_>> = places
                .map(|(k, record)| At { place_m: [10.0 * k as f64, (k % 3) as f64], record })
                .collect();
            let _ = advection(&points, 30.0);
            let _ = by_distance(&points, 10.0, 20, 0.03);
        }
    }
    assert!((4..20).contains(&without), "{without} of 24 without a spectrum");
}
