//! A quiet world of each plant, and a short ladder.

use foreign_worlds::air::{Air, AirSettings, Shear};
use foreign_worlds::battery::BatterySettings;
use foreign_worlds::flight::{Flown, Site, span_s};
use foreign_worlds::hidden::HiddenEffect;
use foreign_worlds::noise::NoiseSettings;
use foreign_worlds::plant::{BladeElement, Motor, Plant, Rotor, ThrustLaw};
use foreign_worlds::{Drone, Target, World, fly};

pub(crate) const LAW: Plant = Plant::ThrustLaw(ThrustLaw {
    mass_kg: 1.0,
    full_thrust_n: 18.3,
    drag_m2: [0.006, 0.006, 0.1],
    lag_s: 0.05,
});

pub(crate) const BLADES: Plant = Plant::BladeElement(BladeElement {
    mass_kg: 0.4,
    rotor: Rotor {
        radius_m: 0.0762,
        blades: 2.0,
        chord_m: 0.014,
        pitch_m: 0.0635,
        lift_slope: 5.2,
        section_drag: 0.03,
        induced_factor: 1.15,
    },
    motor: Motor {
        speed_radps_per_v: 233.0,
        resistance_ohm: 0.22,
        no_load_a: 0.44,
        supply_v: 7.9,
        inertia_kgm2: 3e-6,
    },
    side_m2: 0.01,
    top_m2: 0.02,
});

/// No wind, no noise, nothing hidden.
pub(crate) fn quiet(plant: &Plant) -> World {
    World {
        seed: 5,
        plant: plant.clone(),
        thrust_spread: 0.0,
        air: AirSettings {
            updraft_mps: 0.0,
            shared_mps: 0.0,
            shared_s: 40.0,
            own_mps: 0.0,
            own_s: 8.0,
            field: None,
            thermal: None,
            wind_mps: [0.0; 2],
            shear: Shear::None,
            gust_share: 0.0,
            gust_s: 60.0,
            own_gust_share: 0.0,
            own_gust_s: 5.0,
        },
        battery: BatterySettings {
            cells: 2.0,
            capacity_ah: 5.0,
            resistance_ohm: 0.05,
            reference_v: 7.9,
        },
        noise: NoiseSettings {
            pulse_white_us: 0.0,
            pulse_coloured_us: 0.0,
            pulse_coloured_s: 5.0,
            velocity_mps: 0.0,
            velocity_s: 1.0,
            height_m: 0.0,
            height_s: 60.0,
            clock_s: 0.0,
            level_deg: 0.0,
            rate_hz: 10.0,
        },
        hidden: Vec::new(),
        telemetry: None,
    }
}

pub(crate) fn hiding(plant: &Plant, kind: &str, values: &[f64]) -> World {
    let effect = HiddenEffect { kind: kind.to_owned(), values: values.to_vec() };
    World { hidden: vec![effect], ..quiet(plant) }
}

/// Up to 10 m at 1 m/s, hover, 20 s up at 2 m/s, hover, 20 s down, hover, down to 3 m.
pub(crate) fn ladder(time_s: f64) -> Target {
    let legs = [
        (10.0, 1.0),
        (10.0, 0.0),
        (20.0, 2.0),
        (10.0, 0.0),
        (20.0, -2.0),
        (10.0, 0.0),
        (7.0, -1.0),
    ];
    let (mut from_s, mut height_m) = (0.0, 0.0);
    for (length_s, climb_mps) in legs {
        let into_s = (time_s - from_s).min(length_s);
        if into_s >= 0.0 {
            let at_m = height_m + climb_mps * into_s;
            if time_s < from_s + length_s {
                return Target {
                    position_m: [0.0, 0.0, at_m],
                    velocity_mps: [0.0, 0.0, climb_mps],
                };
            }
        }
        from_s += length_s;
        height_m += climb_mps * length_s;
    }
    Target { position_m: [0.0, 0.0, height_m], velocity_mps: [0.0; 3] }
}

pub(crate) fn flown(world: &World) -> (Flown, Vec<u8>) {
    let drone = Drone {
        slot: 3,
        home_m: [0.0; 3],
        has_left: false,
        charge: 1.0,
        target: &ladder,
        takeoff_s: 0.0,
        end_s: 87.0,
        site: Site { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 190.0, orientation_deg: 30.0 },
        start: (2421, 129_618_000),
    };
    let air = Air::new(&world.air, span_s(0.0, 87.0), world.seed);
    let mut bytes = Vec::new();
    let flown = fly(world, &air, &drone, &mut bytes).unwrap();
    (flown, bytes)
}
