//! A game for strangers: what they ask to be hidden, and what they are given of it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::BlindError;
use super::foreign;
use super::hide::{KINDS, kind_of, unit};
use super::scenario::{AirClass, Base, Cell, Protocol, Scenario};
use super::vehicles::true_vehicle;
use super::worlds::Worlds;
use crate::base::rng::{Purpose, stream};
use crate::effects::EffectError;
use crate::effects::select::resolved;

/// Name and version of the format of `game.json`.
pub const GAME_SCHEMA: &str = "updraft.blind-game/1";
/// Share of the games that hide nothing when nobody says what is hidden.
pub const NOTHING_SHARE: f64 = 0.25;
/// Gusts of a wind that somebody asks for, as a share of it; as in the benchmark.
const WIND_GUST_SHARE: f64 = 0.15;
/// Stream of what a game hides when nobody says what.
const CHOICE: u64 = u64::MAX - 3;

/// Request for a game.
#[derive(Clone, Debug, PartialEq)]
pub struct Game {
    /// Seed of all that is random but the nonce.
    pub seed: u64,
    /// Protocol that is flown.
    pub protocol: Protocol,
    /// Motion of the air beside what is stated.
    pub air: AirClass,
    /// Known vehicle, which is handed to the search.
    pub base: Base,
    /// Rows of the grid.
    pub rows: u16,
    /// Columns of the grid.
    pub columns: u16,
    /// Speed of the horizontal wind, m/s; `None`: drawn, and none in still air.
    pub wind_mps: Option<f64>,
    /// Steady updraft, m/s, up positive.
    pub updraft_mps: f64,
    /// Choice of what is hidden.
    pub hidden: Choice,
}

/// Choice of what a game hides.
#[derive(Clone, Debug, PartialEq)]
pub enum Choice {
    /// Drawn: nothing in [`NOTHING_SHARE`] of all games, else one effect of the library.
    Drawn,
    /// Nothing is hidden.
    Nothing,
    /// These effects, by the names of [`KINDS`], each with its size in the unit of its kind; `None`: its
    /// size is drawn.
    These(Vec<(String, Option<f64>)>),
}

impl Game {
    /// Draws the truth of the game.
    ///
    /// # Errors
    /// As [`Scenario::draw`]; a size that cannot be hidden.
    pub fn truth(&self) -> Result<Scenario, BlindError> {
        let sizes: Vec<(String, Option<f64>)> = match &self.hidden {
            Choice::Drawn => self.drawn().map(|name| (name, None)).into_iter().collect(),
            Choice::Nothing => Vec::new(),
            Choice::These(sizes) => sizes.clone(),
        };
        let cell = Cell {
            worlds: Worlds::Home,
            protocol: self.protocol,
            air: self.air,
            base: self.base,
            hidden: sizes.iter().map(|(name, _)| name.clone()).collect(),
            side: self.rows,
            columns: (self.columns != self.rows).then_some(self.columns),
        };
        let told = |error: BlindError| error.of_vehicle(self.base.vehicle_name());
        let mut truth = Scenario::draw(self.seed, &cell).map_err(told)?;
        for (hidden, (name, size)) in truth.hidden.iter_mut().zip(&sizes) {
            let (base, protocol, width_m) = (self.base, self.protocol, cell.width_m());
            *hidden = kind_of(name)?.draw_sized(self.seed, base, protocol, width_m, *size)?;
        }
        self.blow(&mut truth);
        flyable(&truth)?;
        Ok(truth)
    }

    /// What the seed hides: the name of a kind, or nothing.
    fn drawn(&self) -> Option<String> {
        let rng = &mut stream(self.seed, CHOICE, Purpose::Hidden);
        if unit(rng) < NOTHING_SHARE {
            return None;
        }
        let takes = KINDS.iter().filter(|kind| !kind.foreign && kind.bases.contains(&self.base));
        let names: Vec<&str> = takes.map(|kind| kind.name).collect();
        let place = unit(rng) * names.len() as f64;
        names.get(place as usize).map(|name| (*name).to_owned())
    }

    /// Gives a truth the wind and the updraft that were asked for. The wind keeps its direction.
    fn blow(&self, truth: &mut Scenario) {
        let is_still = self.air == AirClass::Still;
        let air = &mut truth.nuisance.air;
        air.updraft_mps = self.updraft_mps;
        if let Some(wind_mps) = self.wind_mps.or(is_still.then_some(0.0)) {
            let [x, y] = air.wind_mps;
            let factor = wind_mps / x.hypot(y);
            air.wind_mps = [x * factor, y * factor];
            air.wind_gust_mps = if is_still { 0.0 } else { WIND_GUST_SHARE * wind_mps };
        }
    }
}

/// Refuses a truth whose effects have values out of their bounds.
fn flyable(truth: &Scenario) -> Result<(), BlindError> {
    resolved(&true_vehicle(truth, 1)?)?;
    for hidden in truth.hidden.iter().filter(|hidden| hidden.foreign) {
        let Some(found) = foreign::find(&hidden.effect) else { continue };
        let definition = found.effect.definition();
        for parameter in definition.parameters {
            let Some(&value) = hidden.parameters.get(parameter.name) else { continue };
            if !(parameter.low..=parameter.high).contains(&value) {
                return Err(BlindError::Effect(EffectError::Bounds {
                    effect: definition.name,
                    name: parameter.name,
                    value,
                    low: parameter.low,
                    high: parameter.high,
                    unit: parameter.unit,
                }));
            }
        }
    }
    Ok(())
}

/// What a player is given of a game, beside the flight itself: `game.json`. It says nothing of what is
/// hidden.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GameFile {
    /// Format name and version: `updraft.blind-game/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// SHA-256 of the sealed truth, published before the flight.
    pub truth_sha256: String,
    /// The known vehicle.
    pub vehicle: String,
    /// The protocol.
    pub protocol: Protocol,
    /// The motion of the air.
    pub air: AirClass,
    /// Rows of the grid.
    pub rows: u16,
    /// Columns of the grid.
    pub columns: u16,
    /// Files of the flight as it was flown.
    pub files: Vec<FileDigest>,
}

/// A file and its hash.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileDigest {
    /// Path below the game's folder, with `/` between its parts.
    pub path: String,
    /// SHA-256, hexadecimal.
    pub sha256: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn game(seed: u64, base: Base) -> Game {
        Game {
            seed,
            protocol: Protocol::Paper,
            air: AirClass::Moderate,
            base,
            rows: 2,
            columns: 3,
            wind_mps: None,
            updraft_mps: 0.0,
            hidden: Choice::Drawn,
        }
    }

    const BASES: [Base; 4] = [Base::Airsim, Base::Pixel, Base::Phantom4, Base::Sitl];

    #[test]
    fn about_a_quarter_hides_nothing_and_every_effect_of_the_library_has_its_turn() {
        for base in BASES {
            let mut count = std::collections::BTreeMap::<String, u32>::new();
            for seed in 0..400 {
                let name = game(seed, base).drawn().unwrap_or_default();
                *count.entry(name).or_default() += 1;
            }
            let nothing = count.remove("").unwrap();
            assert!((80..=120).contains(&nothing), "{nothing}");
            let takes = |kind: &&super::super::hide::HiddenKind| {
                !kind.foreign && kind.bases.contains(&base)
            };
            assert_eq!(count.len(), KINDS.iter().filter(takes).count(), "{count:?}");
        }
    }

    #[test]
    fn a_drawn_truth_can_be_flown_on_every_vehicle() {
        for base in BASES {
            for seed in 0..40 {
                let truth = game(seed, base).truth().unwrap();
                assert_eq!((truth.slots(), truth.nuisance.charges.len()), (6, 6));
            }
        }
    }

    #[test]
    fn sizes_that_are_asked_for_are_hidden_as_they_are() {
        let of = |name: &str, size: f64| {
            let hidden = Choice::These(vec![(name.to_owned(), Some(size))]);
            Game { hidden, ..game(3, Base::Airsim) }.truth()
        };
        for (name, size) in [("battery", 0.7), ("velocity-bias", -0.2), ("motor-thermal", 9.0)] {
            assert_eq!(of(name, size).unwrap().hidden[0].value(), size, "{name}");
        }
        for (name, size) in [("rotor-inflow", 20.0), ("vortex-ring", 0.05), ("step", -12.0)] {
            let truth = of(name, size).unwrap();
            let words =
                if name == "step" { "-12.000 us".to_owned() } else { format!("{size:.3} ") };
            assert!(truth.hidden[0].words.starts_with(&words), "{}", truth.words());
            assert_eq!(truth.hidden[0].value() < 0.0, size < 0.0, "{name}");
        }
        // The other parameters are those that the seed draws in any case.
        let drawn = Choice::These(vec![("motor-thermal".to_owned(), None)]);
        let drawn = Game { hidden: drawn, ..game(3, Base::Airsim) }.truth().unwrap();
        let asked = of("motor-thermal", 9.0).unwrap();
        let time_s = |truth: &Scenario| truth.hidden[0].parameters["time_s"];
        assert_eq!(time_s(&drawn), time_s(&asked));
        assert_eq!(drawn.nuisance, asked.nuisance);
    }

    #[test]
    fn sizes_that_make_no_sense_are_refused_with_those_that_do() {
        let error = |base: Base, name: &str, size: f64| {
            let hidden = Choice::These(vec![(name.to_owned(), Some(size))]);
            Game { hidden, ..game(3, base) }.truth().unwrap_err().to_string()
        };
        let said = error(Base::Airsim, "battery", 40.0);
        assert!(said.contains("a size of 40; it can be 0.05 to 3 share"), "{said}");
        let said = error(Base::Airsim, "battery", -0.5);
        assert!(said.contains("a size of -0.5"), "{said}");
        let said = error(Base::Airsim, "rotor-inflow", f64::NAN);
        assert!(said.contains("a size of NaN"), "{said}");
        let said = error(Base::Sitl, "rotor-inflow", 20.0);
        assert!(said.contains("cannot be hidden from arducopter-sitl"), "{said}");
        // More than the rotors of this vehicle can lose.
        let said = error(Base::Pixel, "vortex-ring", 0.36);
        assert!(said.contains("a size of 0.36; it can be"), "{said}");
    }

    #[test]
    fn the_wind_and_the_updraft_are_those_that_are_asked_for() {
        let drawn = game(5, Base::Pixel).truth().unwrap().nuisance.air;
        let wind = |air: &crate::blind::air::AirScales| air.wind_mps[0].hypot(air.wind_mps[1]);
        assert!((1.0..=6.0).contains(&wind(&drawn)));
        let asked = Game { wind_mps: Some(9.0), updraft_mps: -0.4, ..game(5, Base::Pixel) };
        let air = asked.truth().unwrap().nuisance.air;
        assert!((wind(&air) - 9.0).abs() < 1e-9);
        assert!((air.wind_gust_mps - 1.35).abs() < 1e-9);
        assert_eq!((air.updraft_mps, air.shared_mps), (-0.4, drawn.shared_mps));
        let still = Game { air: AirClass::Still, ..asked };
        let air = still.truth().unwrap().nuisance.air;
        assert_eq!((air.shared_mps, air.local_mps, air.wind_gust_mps), (0.0, 0.0, 0.0));
        assert!((wind(&air) - 9.0).abs() < 1e-9);
        let calm = Game { wind_mps: None, ..still }.truth().unwrap().nuisance.air;
        assert_eq!(wind(&calm), 0.0);
    }
}
