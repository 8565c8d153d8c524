//! Effects that no algorithm can split with the paper's protocol, fixed in advance.

/// Classes of effects that cannot be told apart; an effect may be in several. Shared drift of the
/// air belongs to the first, but is never named: the noise model explains it.
pub const CLASSES: &[&[&str]] = &[
    &["battery", "motor-thermal"],
    &["translational-lift", "tilt-formula", "blade-flapping"],
    &["parasitic-drag", "thrust-curve"],
    &["vortex-ring", "parasitic-drag", "thrust-curve"],
    &["mass-spread", "thrust-spread"],
];

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
    fn every_member_is_in_the_library() {
        for effect in CLASSES.iter().copied().flatten() {
            assert!(crate::effects::find(effect).is_some(), "{effect}");
        }
    }

    #[test]
    fn classes_overlap_without_being_one() {
        assert!(equivalent("vortex-ring", "parasitic-drag"));
        assert!(!equivalent("battery", "parasitic-drag"));
        assert!(is_single("rotor-inflow") && !is_single("battery"));
    }
}
