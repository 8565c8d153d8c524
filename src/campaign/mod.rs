//! Names of the files in a campaign folder.
