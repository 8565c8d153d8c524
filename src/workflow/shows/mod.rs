//! Shows on disk: files of any kind, and the files of a campaign compared with its plan.

pub(crate) mod campaign_files;
pub mod load;
