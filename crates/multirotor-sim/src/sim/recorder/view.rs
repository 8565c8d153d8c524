//! A moment in the log's terms: north, east, down from home; Euler angles; latitude, longitude.
//!
//! This is the border to NED: everything before it has z up.

use nalgebra::{Matrix3, Vector3};

use skybrush_show::frame::{Geodetic, ShowFrame, metres_per_degree};

/// Converts from the show frame to what a log has.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    sin: f64,
    cos: f64,
    /// Of show x, clockwise from north, 0..360.
    heading_deg: f64,
    home_m: Vector3<f64>,
    /// Home, which is also the EKF's origin.
    pub(super) home: Geodetic,
    metres_per_degree: (f64, f64),
}

/// Attitude as roll, pitch (nose up), yaw (clockwise from north), degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::struct_field_names, reason = "the unit belongs to the name")]
pub(super) struct Euler {
    pub(super) roll_deg: f64,
    pub(super) pitch_deg: f64,
    /// 0..360.
    pub(super) yaw_deg: f64,
}

impl View {
    pub(super) fn new(frame: &ShowFrame, home_m: Vector3<f64>) -> Self {
        let (sin, cos) = frame.orientation_deg.to_radians().sin_cos();
        let home = frame.to_geodetic(home_m);
        Self {
            sin,
            cos,
            heading_deg: course_deg(cos, sin),
            home_m,
            home,
            metres_per_degree: metres_per_degree(home.lat_deg),
        }
    }

    /// A vector of the show frame as north, east, down.
    pub(super) fn ned(&self, show: &Vector3<f64>) -> Vector3<f64> {
        let (sin, cos) = (self.sin, self.cos);
        Vector3::new(cos * show.x + sin * show.y, sin * show.x - cos * show.y, -show.z)
    }

    /// A place of the show frame as north, east, down from home, m.
    pub(super) fn place(&self, show_m: &Vector3<f64>) -> Vector3<f64> {
        self.ned(&(show_m - self.home_m))
    }

    /// A place given as north, east, down from home, on the globe.
    pub(super) fn globe(&self, ned_m: &Vector3<f64>) -> Geodetic {
        let (north_m, east_m) = self.metres_per_degree;
        Geodetic {
            lat_deg: self.home.lat_deg + ned_m.x / north_m,
            lon_deg: self.home.lon_deg + ned_m.y / east_m,
            amsl_m: self.home.amsl_m - ned_m.z,
        }
    }

    /// Euler angles of a rotation from body (forward, left, up) to show frame.
    pub(super) fn euler(&self, rotation: &Matrix3<f64>) -> Euler {
        let forward = self.ned(&rotation.column(0).into_owned());
        let (left_up, up_up) = (rotation[(2, 1)], rotation[(2, 2)]);
        Euler {
            roll_deg: left_up.atan2(up_up).to_degrees(),
            pitch_deg: (-forward.z).clamp(-1.0, 1.0).asin().to_degrees(),
            yaw_deg: course_deg(forward.x, forward.y),
        }
    }

    /// Roll and pitch that bring the thrust into a direction (show frame, length 1) while heading
    /// along show x.
    pub(super) fn wanted(&self, direction: &Vector3<f64>) -> Euler {
        Euler {
            roll_deg: (-direction.y).clamp(-1.0, 1.0).asin().to_degrees(),
            pitch_deg: (-direction.x).atan2(direction.z).to_degrees(),
            yaw_deg: self.heading_deg,
        }
    }
}

/// Direction of a vector, clockwise from north, 0..360 degrees.
pub(super) fn course_deg(north: f64, east: f64) -> f64 {
    let degrees = east.atan2(north).to_degrees();
    if degrees < 0.0 { degrees + 360.0 } else { degrees }
}

/// Body axes forward, left, up to forward, right, down.
pub(super) fn frd(body: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(body.x, -body.y, -body.z)
}

impl Euler {
    /// As a quaternion from body (forward, right, down) to north, east, down: w, x, y, z.
    pub(super) fn quaternion(&self) -> [f64; 4] {
        let [(sr, cr), (sp, cp), (sy, cy)] = [self.roll_deg, self.pitch_deg, self.yaw_deg]
            .map(|degrees| (degrees.to_radians() / 2.0).sin_cos());
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, UnitQuaternion};

    fn view(orientation_deg: f64) -> View {
        let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 100.0 };
        View::new(&ShowFrame { origin, orientation_deg }, Vector3::new(1.0, 2.0, 0.5))
    }

    #[test]
    fn euler_angles_have_the_firmwares_signs() {
        let view = view(90.0);
        let level = view.euler(&Matrix3::identity());
        assert!((level.yaw_deg - 90.0).abs() < 1e-9 && level.roll_deg.abs() < 1e-9);
        // About forward: left side up is right side down, positive roll.
        let rolled = view.euler(Rotation3::from_axis_angle(&Vector3::x_axis(), 0.1).matrix());
        assert!((rolled.roll_deg - 0.1_f64.to_degrees()).abs() < 1e-9);
        // About left: nose down, negative pitch.
        let pitched = view.euler(Rotation3::from_axis_angle(&Vector3::y_axis(), 0.1).matrix());
        assert!((pitched.pitch_deg + 0.1_f64.to_degrees()).abs() < 1e-9);
        // About up: counter-clockwise, less yaw.
        let turned = view.euler(Rotation3::from_axis_angle(&Vector3::z_axis(), 0.1).matrix());
        assert!((turned.yaw_deg - (90.0 - 0.1_f64.to_degrees())).abs() < 1e-9);
    }

    #[test]
    fn wanted_attitude_is_that_of_a_body_with_its_thrust_there() {
        let view = view(30.0);
        let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.2)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), -0.1);
        let direction = tilt * Vector3::z();
        let (wanted, is) = (view.wanted(&direction), view.euler(tilt.matrix()));
        assert!((wanted.roll_deg - is.roll_deg).abs() < 1e-9, "{wanted:?} {is:?}");
        assert!((wanted.pitch_deg - is.pitch_deg).abs() < 1e-9, "{wanted:?} {is:?}");
    }

    #[test]
    fn quaternion_turns_like_the_angles() {
        let euler = Euler { roll_deg: 5.0, pitch_deg: -7.0, yaw_deg: 200.0 };
        let [w, x, y, z] = euler.quaternion();
        let same = UnitQuaternion::from_euler_angles(
            5.0_f64.to_radians(),
            -7.0_f64.to_radians(),
            200.0_f64.to_radians(),
        );
        let dot = w * same.w + x * same.i + y * same.j + z * same.k;
        assert!((dot.abs() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn up_in_the_show_is_negative_down_and_higher_on_the_globe() {
        let view = view(59.0);
        let ned = view.place(&Vector3::new(1.0, 2.0, 10.5));
        assert!((ned - Vector3::new(0.0, 0.0, -10.0)).norm() < 1e-12);
        assert!((view.globe(&ned).amsl_m - 110.5).abs() < 1e-9);
    }
}
