//! Limit on the data that a link carries.

use std::cell::RefCell;
use std::rc::Rc;

use crate::link::clock::Micros;

/// A limit in bytes per second, shared by the conversations on a link.
///
/// ```
/// use mavlink_station::S;
/// use mavlink_station::budget::Budget;
///
/// let link = Budget::new(5_760.0); // 57,600 baud
/// assert!(link.take(S, 4_000).is_ok());
/// let again = link.take(S, 4_000).unwrap_err();
/// assert!(again > S && again < 2 * S);
/// ```
#[derive(Clone, Debug)]
pub struct Budget(Rc<RefCell<Bucket>>);

#[derive(Debug)]
struct Bucket {
    per_s: f64,
    /// May be below zero: what was asked for on credit is paid back before more is asked for.
    tokens: f64,
    at: Micros,
}

impl Budget {
    /// A budget of this many bytes per second, on average.
    pub fn new(bytes_per_s: f64) -> Self {
        Self(Rc::new(RefCell::new(Bucket { per_s: bytes_per_s.max(1.0), tokens: 0.0, at: 0 })))
    }

    /// Takes bytes from the budget.
    ///
    /// # Errors
    ///
    /// The time at which to ask again, us, if the budget is used up.
    pub fn take(&self, now: Micros, bytes: u64) -> Result<(), Micros> {
        let mut bucket = self.0.borrow_mut();
        let passed_s = now.saturating_sub(bucket.at) as f64 / 1e6;
        bucket.at = now;
        // Half a second of idling is made up for, no more.
        bucket.tokens = (bucket.tokens + passed_s * bucket.per_s).min(bucket.per_s / 2.0);
        if bucket.tokens < 0.0 {
            return Err(now + (-bucket.tokens / bucket.per_s * 1e6) as Micros + 1);
        }
        bucket.tokens -= bytes as f64;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::clock::{MS, S};

    #[test]
    fn a_link_carries_its_rate_and_half_a_second_of_idling() {
        let link = Budget::new(1_000.0);
        // An hour of idling is worth 500 bytes: the next 600 are on credit, for 100 ms.
        assert_eq!(link.take(3_600 * S, 400), Ok(()));
        assert_eq!(link.take(3_600 * S, 200), Ok(()));
        assert_eq!(link.take(3_600 * S, 1), Err(3_600 * S + 100 * MS + 1));
        assert_eq!(link.take(3_600 * S + 50 * MS, 1), Err(3_600 * S + 100 * MS + 1));
        assert_eq!(link.take(3_600 * S + 101 * MS, 1), Ok(()));
    }

    #[test]
    fn over_a_minute_no_more_than_the_rate_is_taken() {
        let link = Budget::new(5_760.0);
        let (mut now, mut taken) = (0, 0);
        while now < 60 * S {
            match link.take(now, 239) {
                Ok(()) => taken += 239,
                Err(again) => {
                    assert!(again > now, "time goes on");
                    now = again;
                }
            }
        }
        assert!((60 * 5_760 - 239..=60 * 5_760 + 239).contains(&taken), "{taken}");
    }
}
