//! Refusals of the server to give a log: it states its reason in a sentence only, which is read here and
//! nowhere else.

/// Kinds of refusal that call for different answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The server knows no such drone.
    NoSuchDrone,
    /// The drone's log is being downloaded for somebody else.
    OtherDownload,
    /// The drone did not answer in time.
    TimedOut,
    /// Refused for any other reason.
    Other,
}

impl Refusal {
    /// Kind of a refusal by the server's sentence (Skybrush Server 2.50.0).
    pub fn of(reason: &str) -> Self {
        let reason = reason.to_lowercase();
        let kinds = [
            ("no such uav", Self::NoSuchDrone),
            ("another log download", Self::OtherDownload),
            ("timed out", Self::TimedOut),
        ];
        kinds
            .iter()
            .find(|(words, _)| reason.contains(words))
            .map_or(Self::Other, |(_, kind)| *kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_of_the_server_are_known() {
        for (reason, kind) in [
            ("No such UAV: 7", Refusal::NoSuchDrone),
            ("Another log download is already in progress", Refusal::OtherDownload),
            ("Log download timed out", Refusal::TimedOut),
            ("disk full", Refusal::Other),
        ] {
            assert_eq!(Refusal::of(reason), kind, "{reason}");
        }
    }
}
