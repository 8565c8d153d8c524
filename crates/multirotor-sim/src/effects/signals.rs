//! Signals: the inputs of the closed forms.

/// One steady moment of flight. The default is hover in calm air at sea level, far from the ground,
/// of the fleet's mean drone with a full battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signals {
    /// Vertical speed relative to the air, m/s, up positive.
    pub climb_mps: f64,
    /// Horizontal speed relative to the air, m/s.
    pub horizontal_mps: f64,
    /// Lean of the rotor axis into the wind, rad.
    pub tilt_rad: f64,
    /// Height above ground, m.
    pub height_m: f64,
    /// Time since the motors started, s.
    pub time_s: f64,
    /// Air density as a share of sea level's.
    pub density_ratio: f64,
    /// Charge drawn from the battery, Ah.
    pub charge_used_ah: f64,
    /// Vertical acceleration, m/s², up positive.
    pub acceleration_mps2: f64,
    /// The drone's deviation from the fleet in standard deviations of the effect.
    pub deviation: f64,
    /// Drones next to this one in the array, 0..8.
    pub neighbours: f64,
    /// Change of the hover pulse by the rest of the model, us.
    pub increment_us: f64,
    /// Change of the model's pulse per vertical air speed, us/(m/s).
    pub sensitivity: f64,
}

impl Default for Signals {
    fn default() -> Self {
        Self {
            climb_mps: 0.0,
            horizontal_mps: 0.0,
            tilt_rad: 0.0,
            height_m: 100.0,
            time_s: 0.0,
            density_ratio: 1.0,
            charge_used_ah: 0.0,
            acceleration_mps2: 0.0,
            deviation: 0.0,
            neighbours: 0.0,
            increment_us: 0.0,
            sensitivity: 0.0,
        }
    }
}

impl Signals {
    /// Air speed along the rotor axis, m/s: leaning into the wind adds to the climb.
    pub fn axial_mps(&self) -> f64 {
        let (sin, cos) = self.tilt_rad.sin_cos();
        self.climb_mps * cos + self.horizontal_mps * sin
    }

    /// Air speed across the rotor axis, m/s.
    pub fn edgewise_mps(&self) -> f64 {
        let (sin, cos) = self.tilt_rad.sin_cos();
        (self.horizontal_mps * cos - self.climb_mps * sin).abs()
    }
}
