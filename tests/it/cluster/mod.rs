//! Work that is shared out between processes: shards in one folder, with locks and without, and a real
//! scheduler.

#[cfg(unix)]
mod no_locks;
#[cfg(unix)]
mod scripts;
mod shards;
#[cfg(unix)]
mod slurm;
#[cfg(unix)]
mod slurm_daemons;
