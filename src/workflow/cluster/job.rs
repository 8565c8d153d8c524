//! A job on a cluster: what is computed, where, and with which resources.

use std::path::PathBuf;

use super::results::Results;
use crate::base::plain::Shown as _;
use crate::campaign::items::{self, ItemsRecord};
use crate::workflow::error::WorkflowError;
use crate::workflow::words::shell;

/// Resources that each task asks the scheduler for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Resources {
    /// Processors of a task.
    pub cpus: u16,
    /// Longest time of a task, as Slurm reads it; `None`: the partition's default.
    pub time: Option<String>,
    /// Memory of a task, as Slurm reads it.
    pub mem: Option<String>,
    /// Partition of the cluster; `None`: its default.
    pub partition: Option<String>,
    /// Account that is charged.
    pub account: Option<String>,
    /// Further options of sbatch, each as it is written: `--qos=long`.
    pub more: Vec<String>,
}

/// Items of a command's work, each with a file of its result.
#[derive(Clone, Debug)]
pub struct Items {
    /// A result, in a word or two: "blind flight".
    pub name: &'static str,
    /// Folder of the work.
    pub folder: PathBuf,
    /// Files of the results.
    pub results: Results,
    /// File that the merge writes when it has put all results together; `None`: it writes none of its own.
    pub product: Option<PathBuf>,
    /// Settings that all items of the folder have; `None`: each item is checked by itself.
    pub record: Option<ItemsRecord>,
    /// Whether items are made in a folder that can be chosen with `--scratch` and was not.
    pub has_scratch: bool,
}

/// Work that is shared out to the tasks of an array.
#[derive(Clone, Debug)]
pub struct Job {
    /// The command that is run, without its options: `blind`.
    pub command: &'static str,
    /// Items of the work.
    pub items: Items,
    /// Path of the program.
    pub program: PathBuf,
    /// Arguments of the program, without those that share the work out.
    pub args: Vec<String>,
    /// Folder in which the program is run.
    pub cwd: PathBuf,
    /// Folder for scripts, output and record of the job.
    pub folder: PathBuf,
    /// Resources of each task.
    pub resources: Resources,
}

impl Job {
    /// Refuses what cannot stand in a script.
    ///
    /// # Errors
    ///
    /// [`WorkflowError::Usage`] for line breaks in arguments or paths.
    pub fn check(&self) -> Result<(), WorkflowError> {
        let paths = [&self.program, &self.cwd, &self.folder].map(|path| path.to_string_lossy());
        let resources = &self.resources;
        let options = [&resources.time, &resources.mem, &resources.partition, &resources.account];
        let given = options.into_iter().flatten().chain(&resources.more).chain(&self.args);
        let given = given.map(String::as_str).chain(paths.iter().map(AsRef::as_ref));
        for text in given {
            if text.contains(char::is_control) {
                return Err(WorkflowError::Usage(format!(
                    "a script for Slurm cannot have a line break, a tab or another control character in an \
                     argument or a path: {text:?}"
                )));
            }
        }
        // Options of sbatch have no way to write these.
        for path in [&self.folder, &self.cwd] {
            if path.to_string_lossy().contains(['"', '\\']) {
                return Err(WorkflowError::Usage(format!(
                    "a script for Slurm cannot have a quotation mark or a backslash in a path: {}",
                    path.shown()
                )));
            }
        }
        Ok(())
    }

    /// Refuses a folder that holds other work, whose results would be taken for this one's.
    ///
    /// # Errors
    ///
    /// If the results there are of other settings, another version or another kind.
    pub fn fits(&self) -> Result<(), WorkflowError> {
        let Some(record) = &self.items.record else { return Ok(()) };
        Ok(items::check(&self.items.folder, record)?)
    }

    /// The command line, for people and shells.
    pub fn line(&self) -> String {
        let words =
            std::iter::once("updraft".to_owned()).chain(self.args.iter().map(|word| shell(word)));
        words.collect::<Vec<_>>().join(" ")
    }

    /// The command line of the program itself, for a script.
    pub(super) fn exec(&self) -> String {
        let program = shell(&self.program.to_string_lossy());
        let args = self.args.iter().map(|word| shell(word));
        std::iter::once(program).chain(args).collect::<Vec<_>>().join(" ")
    }
}
