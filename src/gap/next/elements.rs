//! Elements that a proposed flight can be made of, and its template.
//!
//! Each element breaks a confounding that the paper's ladder has (docs/physics.md, 4.3).

use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::mission::plan::Plan;

/// Order of the ladder's rungs.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Slow to fast, as in the paper: speed grows with time.
    Rising,
    /// Shuffled: what depends on speed separates from drifts.
    Shuffled,
    /// Shuffled, with one rung flown again at the end: a drift shows without any model.
    Repeated,
}

/// Horizontal legs.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Legs {
    /// None: only the wind blows from the side.
    None,
    /// There and back at 3 m/s on one heading.
    Slow,
    /// Also at 6 m/s across it.
    SlowAndFast,
}

/// The elements of a flight.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_excessive_bools, reason = "each is an element that is there or not")]
pub struct Elements {
    /// Two interleaved half fleets fly the ladder half a cycle apart.
    pub counter_phase: bool,
    /// Order of the rungs.
    pub order: Order,
    /// All seven rungs of the paper's ladder; else three.
    pub all_rungs: bool,
    /// Legs of 20 s; else 13 s.
    pub long_legs: bool,
    /// Horizontal legs.
    pub legs: Legs,
    /// Hovers at two heights at both ends.
    pub heights: bool,
    /// 30 s of hover at 0.4 m.
    pub low_hover: bool,
    /// Batteries charged in steps, the least of them to 62 % or what brings it home with the reserve.
    pub charge: bool,
    /// 40 g under every fourth drone.
    pub payload: bool,
}

/// Longest and shortest leg, s: the paper's, and the shortest that leaves two bins of 3 s after settling.
const LEG_S: (f64, f64) = (20.0, 13.0);
/// Hovers between legs, s: the paper's.
const HOVER_S: f64 = 10.0;
/// Height of the lower hovers, m: the paper's baseline.
const LOW_M: f64 = 20.0;
/// Height of the upper hovers, m, as in the counter-phase template. Chosen: far from the lower ones, within
/// what shows may fly.
const HIGH_M: f64 = 52.0;
/// Lower hovers of a counter-phase flight, m: two metres more, for what the halves drift apart in height.
const LOW_COUNTER_M: f64 = 22.0;
/// Height of the hover near the ground, m: some 8 us of ground effect on a show drone (docs/physics.md,
/// 2.4), and room for an error of height. Chosen.
const LOWEST_M: f64 = 0.4;
/// Length of that hover, s: eight bins. Chosen.
const LOWEST_S: f64 = 30.0;
/// Speed of slow horizontal legs, m/s, and their length, s, as in the counter-phase template. Chosen.
const SLOW: (f64, f64) = (3.0, 12.0);
/// Speed of fast horizontal legs, m/s, and their length, s, as in the counter-phase template. Chosen: lift
/// is quadratic in the speed, and show limits end not far above.
const FAST: (f64, f64) = (6.0, 10.0);
/// Velocity step that starting and stopping at the fast legs' speed takes, m/s: the speed with some room.
const FAST_STEP_MPS: f64 = 6.5;
/// Least charge of a staggered fleet, as in the flights of docs/physics.md, 4.2.
const LEAST_CHARGE: f64 = 0.62;
/// Mass of the payload, kg: a tenth of a show drone, 28.6 us (docs/physics.md, 4.3).
pub(crate) const PAYLOAD_KG: f64 = 0.04;
/// One drone in this many carries it: ten of 42 determine the sensitivity to 5 %.
pub(crate) const PAYLOAD_EVERY: usize = 4;

impl Elements {
    /// Everything that can be flown without touching the drones' masses.
    pub const ALL: Self = Self {
        counter_phase: true,
        order: Order::Repeated,
        all_rungs: true,
        long_legs: true,
        legs: Legs::SlowAndFast,
        heights: true,
        low_hover: true,
        charge: true,
        payload: false,
    };

    /// Elements of the paper's ladder.
    pub const PAPER: Self = Self {
        counter_phase: false,
        order: Order::Rising,
        all_rungs: true,
        long_legs: true,
        legs: Legs::None,
        heights: false,
        low_hover: false,
        charge: false,
        payload: false,
    };

    /// The flights with one element less.
    pub fn simpler(self) -> Vec<Self> {
        let mut simpler = Vec::new();
        let mut also = |is: bool, other: Self| {
            if is {
                simpler.push(other);
            }
        };
        also(self.payload, Self { payload: false, ..self });
        also(self.low_hover, Self { low_hover: false, ..self });
        also(self.heights, Self { heights: false, ..self });
        also(self.legs == Legs::SlowAndFast, Self { legs: Legs::Slow, ..self });
        also(self.legs == Legs::Slow, Self { legs: Legs::None, ..self });
        also(self.order == Order::Repeated, Self { order: Order::Shuffled, ..self });
        also(self.order == Order::Shuffled, Self { order: Order::Rising, ..self });
        also(self.all_rungs, Self { all_rungs: false, ..self });
        also(self.long_legs, Self { long_legs: false, ..self });
        also(self.charge, Self { charge: false, ..self });
        also(self.counter_phase, Self { counter_phase: false, ..self });
        simpler
    }

    /// The elements that a flight's plan does not show.
    #[must_use]
    pub fn flown(self) -> Self {
        Self { charge: false, payload: false, ..self }
    }

    fn speeds_mps(self) -> &'static [f64] {
        match (self.order, self.all_rungs) {
            (Order::Rising, true) => &[0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5],
            (Order::Rising, false) => &[1.0, 2.0, 3.5],
            (Order::Shuffled, true) => &[2.0, 0.5, 3.0, 1.5, 3.5, 1.0, 2.5],
            (Order::Shuffled, false) => &[2.0, 3.5, 1.0],
            (Order::Repeated, true) => &[2.0, 0.5, 3.0, 1.5, 3.5, 1.0, 2.5, 2.0],
            (Order::Repeated, false) => &[2.0, 3.5, 1.0, 2.0],
        }
    }

    fn leg_s(self) -> f64 {
        if self.long_legs { LEG_S.0 } else { LEG_S.1 }
    }

    /// Purpose of each element, one line each.
    pub fn words(self) -> Vec<&'static str> {
        let order = match self.order {
            Order::Rising => "rungs from slow to fast",
            Order::Shuffled => "shuffled rungs: speed separates from time",
            Order::Repeated => "shuffled rungs and one again: speed separates from time",
        };
        let mut words = vec![order];
        let mut also = |is: bool, text: &'static str| {
            if is {
                words.push(text);
            }
        };
        also(
            self.counter_phase,
            "two half fleets in counter-phase: what depends on climb separates from the air that all \
             share",
        );
        also(!self.all_rungs, "three rungs instead of seven");
        also(!self.long_legs, "legs of 13 s instead of 20 s");
        also(
            self.legs != Legs::None,
            "horizontal legs: air from the side separates from everything",
        );
        also(self.heights, "hovers at two heights at both ends: height separates from time");
        also(self.low_hover, "30 s of hover at 0.4 m: the ground shows");
        also(self.charge, "staggered charge: battery sag separates from time");
        also(self.payload, "40 g under every fourth drone: a known step of the weight");
        words
    }

    /// Preparations that the crew must make before flying a plan of these elements, one sentence
    /// each.
    pub fn briefing(self, plan: &Plan) -> Vec<String> {
        let mut briefing = Vec::new();
        if self.charge {
            briefing.push(format!(
                "Charge the batteries in steps from {:.0} % to 100 %, evenly over the grid: equal \
                 charge hides battery sag.",
                100.0 * lowest_charge(plan)
            ));
        }
        if self.payload {
            briefing.push(
                "Fasten 40 g under every fourth drone (slots 1, 5, 9 ...), at its centre, and weigh \
                 all drones: their offsets in the verdict over the known step are the sensitivity \
                 to weight."
                    .to_owned(),
            );
        }
        if self.low_hover {
            briefing.push(
                "The last hover is 0.4 m above the take-off place: flat ground and nobody near. \
                 Firmware 4.6 lands early and cuts it short: fly it on 4.4."
                    .to_owned(),
            );
        }
        briefing
    }

    /// The template: `site`, grid and vehicle are those of a plan that was flown. `why` are comment
    /// lines for its head; `vehicle` is the template's word for the vehicle.
    pub fn template(
        self,
        title: &str,
        plan: &Plan,
        vehicle: &str,
        why: &[String],
        briefing: &[String],
    ) -> String {
        let mut text = String::new();
        let mut line = |content: &str| {
            let _ = writeln!(text, "{content}");
        };
        for comment in why {
            line(format!("# {}", plain(comment)).trim_end());
        }
        line("schema = \"updraft.template/1\"");
        line("name = \"next\"");
        line(&format!("title = {}", quoted(title)));
        line("purpose = \"calibration\"");
        line(&format!("vehicle = {}", quoted(vehicle)));
        if !briefing.is_empty() {
            line("\nbriefing = [");
            for sentence in briefing {
                line(&format!("    {},", quoted(sentence)));
            }
            line("]");
        }
        let site = &plan.site;
        line("\n[site]");
        line(&format!("origin = [{:?}, {:?}]", site.origin_lat_deg, site.origin_lon_deg));
        line(&format!("ground_amsl_m = {:?}", site.ground_amsl_m));
        if site.ground_assumed {
            line("ground_assumed = true");
        }
        line(&format!("orientation_deg = {:?}", site.orientation_deg));
        line("\n[grid]");
        if let Some(grid) = plan.grid {
            line(&format!("rows = {}\ncolumns = {}", grid.rows, grid.columns));
            if plan.slots.len() != (grid.rows * grid.columns) as usize {
                line(&format!("drones = {}", plan.slots.len()));
            }
            line(&format!("spacing_m = {:?}", grid.spacing_m));
        } else {
            line(&format!("drones = {}\nspacing_m = 7.0", plan.slots.len()));
        }
        self.numbers(&mut line);
        self.steps(&mut line);
        text
    }

    fn numbers(self, line: &mut dyn FnMut(&str)) {
        let low_m = if self.counter_phase { LOW_COUNTER_M } else { LOW_M };
        let speeds: Vec<String> =
            self.speeds_mps().iter().map(|speed| format!("{speed:?}")).collect();
        line("\n[parameters]");
        line(&format!("speeds_mps = [{}]", speeds.join(", ")));
        line(&format!("leg_s = {:?}", self.leg_s()));
        line(&format!("hover_s = {HOVER_S:?}"));
        line(&format!("baseline_m = {low_m:?}"));
        if self.heights {
            line(&format!("high_m = {HIGH_M:?}"));
        }
        if self.legs != Legs::None {
            line(&format!("slow_mps = {:?}", SLOW.0));
        }
        if self.legs == Legs::SlowAndFast {
            line(&format!("fast_mps = {:?}", FAST.0));
        }
        if self.counter_phase {
            // Half of a rung: up, hover, down, hover.
            line(&format!("half_cycle_s = {:?}", self.leg_s() + HOVER_S));
        }
        line("\n[takeoff]\naltitude_m = 5.0\nspeed_mps = 1.0");
        line("\n[landing]\nend_altitude_m = 2.5\nspeed_mps = 0.5");
        line("\n[fence]\nroom_m = 30.0\nmargin_m = 10.0");
        if self.legs == Legs::SlowAndFast {
            line("\n[limits]");
            line(&format!("max_velocity_step_mps = {FAST_STEP_MPS:?}"));
        }
        if self.counter_phase {
            line("\n[[groups]]\nname = \"even\"\nselect = \"checkerboard-even\"");
            line("\n[[groups]]\nname = \"odd\"\nselect = \"checkerboard-odd\"");
            line("offset_s = \"$half_cycle_s\"");
        }
    }

    fn steps(self, line: &mut dyn FnMut(&str)) {
        let hover = "\n[[steps]]\nkind = \"hover\"\nduration_s = \"$hover_s\"";
        let climb = |to: &str, speed: &str| {
            format!("\n[[steps]]\nkind = \"climb\"\nto_m = {to}\nspeed_mps = {speed}")
        };
        let both_heights = |line: &mut dyn FnMut(&str)| {
            line(&climb("\"$high_m\"", "2.0"));
            line(hover);
            line(&climb("\"$baseline_m\"", "2.0"));
            line(hover);
        };
        if self.heights {
            both_heights(line);
        } else {
            line(&climb("\"$baseline_m\"", "2.0"));
            line(hover);
        }
        if self.counter_phase {
            line("\n# The two halves are half a cycle apart from here ...");
            line("[[steps]]\nkind = \"stagger\"");
        }
        line("\n[[steps]]\nkind = \"repeat\"\nspeeds_mps = \"$speeds_mps\"");
        for direction in ["up", "down"] {
            line(&format!("\n[[steps.steps]]\nkind = \"leg\"\ndirection = \"{direction}\""));
            line("duration_s = \"$leg_s\"");
            line("\n[[steps.steps]]\nkind = \"hover\"\nduration_s = \"$hover_s\"");
        }
        if self.counter_phase {
            line("\n# ... to here: what follows is flown together.");
            line("[[steps]]\nkind = \"rejoin\"");
        }
        let mut there_and_back = |headings: [f64; 2], speed: &str, (_, leg_s): (f64, f64)| {
            for heading in headings {
                line(&format!("\n[[steps]]\nkind = \"horizontal\"\nheading_deg = {heading:?}"));
                line(&format!("speed_mps = \"{speed}\"\nduration_s = {leg_s:?}"));
                line("\n[[steps]]\nkind = \"hover\"\nduration_s = 6.0");
            }
        };
        if self.legs != Legs::None {
            there_and_back([0.0, 180.0], "$slow_mps", SLOW);
        }
        if self.legs == Legs::SlowAndFast {
            there_and_back([90.0, 270.0], "$fast_mps", FAST);
        }
        if self.heights {
            both_heights(line);
        }
        if self.low_hover {
            line(&climb("3.0", "2.0"));
            line(&climb(&format!("{LOWEST_M:?}"), "0.5"));
            line(&format!("\n[[steps]]\nkind = \"hover\"\nduration_s = {LOWEST_S:?}"));
            line(&climb("3.0", "0.5"));
        }
    }
}

/// Charge of the emptiest battery of a staggered fleet, share of full: it comes home with the reserve.
pub fn lowest_charge(plan: &Plan) -> f64 {
    let limits = &plan.limits;
    let needed = plan.duration_ms as f64 / 1000.0 / limits.endurance_s.max(1.0);
    (needed + limits.endurance_reserve).clamp(LEAST_CHARGE, 1.0)
}

/// A TOML string.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Without anything that ends a comment.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
