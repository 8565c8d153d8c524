//! Effects that no algorithm can split with the paper's protocol, fixed in advance.

use super::tables::CLASSES;

/// Whether two effects are equal or in one class.
pub fn equivalent(left: &str, right: &str) -> bool {
    left == right || CLASSES.iter().any(|class| class.contains(&left) && class.contains(&right))
}

/// Whether an effect is in no class with another.
pub fn is_single(effect: &str) -> bool {
    !CLASSES.iter().any(|class| class.contains(&effect))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_overlap_without_being_one() {
        assert!(equivalent("vortex-ring", "parasitic-drag"));
        assert!(!equivalent("battery", "parasitic-drag"));
        assert!(is_single("rotor-inflow") && !is_single("battery"));
    }
}
