//! Shows on the disk: files of any kind, and the files of a campaign held against its plan.

pub(crate) mod campaign_files;
pub mod load;
