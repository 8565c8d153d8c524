//! A lithium polymer cell: its open-circuit voltage by charge, and the inverse.

/// Open-circuit voltage of a lithium polymer cell at charges of 0, 0.1, ... 1: a typical discharge curve.
const CELL_V: [f64; 11] = [3.27, 3.69, 3.73, 3.77, 3.80, 3.84, 3.87, 3.95, 4.02, 4.11, 4.20];

/// Open-circuit voltage of a cell, V, at a charge of 0..1.
pub fn cell_v(charge: f64) -> f64 {
    let place = charge.clamp(0.0, 1.0) * 10.0;
    let index = (place as usize).min(9);
    let (low, high) = (CELL_V[index], CELL_V[index + 1]);
    low + (high - low) * (place - index as f64)
}

/// Charge of a cell, 0..1, at an open-circuit voltage, V: the inverse of the discharge curve.
pub fn charge_of_cell(volts: f64) -> f64 {
    let above = CELL_V.partition_point(|known| *known <= volts).clamp(1, CELL_V.len() - 1);
    let (low, high) = (CELL_V[above - 1], CELL_V[above]);
    ((above - 1) as f64 + (volts - low) / (high - low)) / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cell_curve_is_monotonic_and_has_its_ends() {
        assert_eq!((cell_v(1.0), cell_v(0.0), cell_v(7.0)), (4.2, 3.27, 4.2));
        assert!(CELL_V.windows(2).all(|pair| pair[0] < pair[1]));
        assert!((cell_v(0.95) - 4.155).abs() < 1e-12);
        for charge in [0.0, 0.03, 0.5, 0.87, 1.0] {
            assert!((charge_of_cell(cell_v(charge)) - charge).abs() < 1e-12);
        }
    }
}
