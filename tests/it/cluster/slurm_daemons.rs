//! A real scheduler of our own: munge, the controller of Slurm and its nodes, on this machine, until the value
//! is dropped.

use std::fs;
use std::io::Read as _;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use tempfile::TempDir;
use updraft::workflow::clock::{Clock as _, SystemClock};

/// So long a daemon may take to come up.
const UP: Duration = Duration::from_mins(1);

pub(super) struct Slurm {
    folder: TempDir,
    daemons: Vec<Child>,
    nodes: Vec<Child>,
}

/// Time on the wall since a clock was started.
pub(super) fn elapsed(begun: &SystemClock) -> Duration {
    Duration::from_micros(begun.now())
}

/// Programs that it takes, from Debian's packages `slurm-wlm` and `munge`.
fn missing() -> Option<&'static str> {
    let programs =
        ["munged", "slurmctld", "slurmd", "sbatch", "squeue", "sinfo", "scancel", "scontrol"];
    let places = ["/usr/sbin", "/usr/bin", "/sbin", "/bin", "/usr/local/sbin", "/usr/local/bin"];
    let is_there =
        |program: &str| places.iter().any(|place| Path::new(place).join(program).exists());
    programs.into_iter().find(|program| !is_there(program))
}

fn program(name: &str) -> Command {
    let mut command = Command::new(name);
    let path = std::env::var("PATH").unwrap_or_default();
    command.env("PATH", format!("{path}:/usr/sbin:/sbin")).stdin(Stdio::null());
    command
}

/// Ports in a row that nobody listens on.
fn ports(count: u16) -> u16 {
    let free = |port: u16| TcpListener::bind(("127.0.0.1", port)).is_ok();
    let begin = 20_000 + u16::try_from(std::process::id() % 20_000).unwrap();
    let starts = (begin..60_000).step_by(16);
    starts.into_iter().find(|start| (*start..start + count).all(free)).unwrap()
}

impl Slurm {
    /// Starts it; otherwise the reason why it cannot run here.
    pub(super) fn start(nodes: u16) -> Result<Self, String> {
        if let Some(program) = missing() {
            return Err(format!(
                "{program} is not installed (Debian: apt-get install slurm-wlm munge)"
            ));
        }
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        for below in ["munge", "state", "spool", "run", "log"] {
            fs::create_dir(root.join(below)).unwrap();
        }
        let mode = |path: &Path, mode| {
            fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
        };
        mode(root, 0o755);
        mode(&root.join("munge"), 0o755);
        let mut key = vec![0; 1024];
        fs::File::open("/dev/urandom").and_then(|mut source| source.read_exact(&mut key)).unwrap();
        let key_path = root.join("munge/key");
        fs::write(&key_path, key).unwrap();
        mode(&key_path, 0o400);
        fs::write(root.join("slurm.conf"), config(root, ports(nodes + 1), nodes)).unwrap();
        let mut slurm = Self { folder, daemons: Vec::new(), nodes: Vec::new() };
        slurm.munged();
        slurm.wait("munge", |slurm| slurm.path("munge/munge.sock").exists())?;
        let controller = slurm.daemon("slurmctld", &["-D", "-c", "-f"]);
        slurm.daemons.push(controller);
        for node in 1..=nodes {
            slurm.start_node(node);
        }
        slurm.wait("the nodes", |slurm| slurm.idle_nodes() == usize::from(nodes))?;
        Ok(slurm)
    }

    pub(super) fn path(&self, below: &str) -> PathBuf {
        self.folder.path().join(below)
    }

    /// The variable by which its programs find it.
    pub(super) fn environment(&self) -> (&'static str, PathBuf) {
        ("SLURM_CONF", self.path("slurm.conf"))
    }

    /// Runs one of its programs.
    pub(super) fn run(&self, name: &str, args: &[&str]) -> String {
        let (variable, value) = self.environment();
        let output = program(name).args(args).env(variable, value).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// Kills a node's daemon as a crash would; its tasks go on, and nobody hears of them.
    pub(super) fn kill_node(&mut self, node: usize) {
        let daemon = &mut self.nodes[node - 1];
        daemon.kill().unwrap();
        daemon.wait().unwrap();
    }

    /// Starts tasks now that wait for some minutes after they were queued again.
    pub(super) fn hurry(&self) {
        for job in self.run("squeue", &["-h", "-r", "-t", "PD", "-o", "%i"]).lines() {
            self.run("scontrol", &["update", &format!("JobId={job}"), "StartTime=now"]);
        }
    }

    fn munged(&mut self) {
        let place = |below: &str| self.path(below).to_string_lossy().into_owned();
        let args = [
            "--foreground".to_owned(),
            "--force".to_owned(),
            format!("--key-file={}", place("munge/key")),
            format!("--socket={}", place("munge/munge.sock")),
            format!("--pid-file={}", place("munge/munged.pid")),
            format!("--seed-file={}", place("munge/seed")),
            format!("--log-file={}", place("log/munged.log")),
        ];
        let daemon =
            program("munged").args(args).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        self.daemons.push(daemon.unwrap());
    }

    fn daemon(&self, name: &str, args: &[&str]) -> Child {
        let config = self.path("slurm.conf");
        let command = &mut program(name);
        command.args(args).arg(config).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    fn start_node(&mut self, node: u16) {
        let daemon = self.daemon("slurmd", &["-D", "-N", &format!("n{node}"), "-f"]);
        self.nodes.push(daemon);
    }

    fn idle_nodes(&self) -> usize {
        let states = self.run("sinfo", &["-h", "-N", "-o", "%T"]);
        states.lines().filter(|state| *state == "idle").count()
    }

    /// Waits, and notices when a daemon has died.
    fn wait(&mut self, what: &str, is_up: impl Fn(&Self) -> bool) -> Result<(), String> {
        let begun = SystemClock::start();
        while !is_up(self) {
            for daemon in self.daemons.iter_mut().chain(&mut self.nodes) {
                if let Some(status) = daemon.try_wait().unwrap() {
                    return Err(format!("a daemon ended while waiting for {what}: {status}"));
                }
            }
            if elapsed(&begun) > UP {
                let log = fs::read_to_string(self.path("log/slurmctld.log")).unwrap_or_default();
                return Err(format!("{what} did not come up: {log}"));
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        Ok(())
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        self.run("scancel", &["--state=RUNNING,PENDING", "--user=root"]);
        // In the reverse order of their start.
        for daemon in self.nodes.iter_mut().rev().chain(self.daemons.iter_mut().rev()) {
            if daemon.try_wait().ok().flatten().is_none() {
                let _ = Command::new("kill").arg(daemon.id().to_string()).status();
                let begun = SystemClock::start();
                while daemon.try_wait().ok().flatten().is_none()
                    && elapsed(&begun) < Duration::from_secs(10)
                {
                    std::thread::sleep(Duration::from_millis(20));
                }
                let _ = daemon.kill();
                let _ = daemon.wait();
            }
        }
    }
}

/// Configuration for one machine, without root, that listens on the loopback address alone.
fn config(root: &Path, port: u16, nodes: u16) -> String {
    let root = root.display();
    let output = Command::new("id").arg("-un").output().unwrap();
    let user = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    let (first, last) = (port + 1, port + nodes);
    format!(
        "ClusterName=t{port}
SlurmctldHost=localhost(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={port}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={root}/munge/munge.sock
StateSaveLocation={root}/state
SlurmdSpoolDir={root}/spool/%n
SlurmctldPidFile={root}/run/slurmctld.pid
SlurmdPidFile={root}/run/slurmd.%n.pid
SlurmctldLogFile={root}/log/slurmctld.log
SlurmdLogFile={root}/log/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
SchedulerParameters=sched_min_interval=100000,batch_sched_delay=0,bf_interval=1
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
JobCompType=jobcomp/none
ReturnToService=2
SlurmdTimeout=5
KillWait=5
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
NodeName=n[1-{nodes}] NodeHostname=localhost NodeAddr=127.0.0.1 Port=[{first}-{last}] CPUs=1 RealMemory=500
PartitionName=debug Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"
    )
}
