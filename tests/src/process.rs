//! Child processes: their output is kept for messages, and none outlives its owner.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

pub use rustix::process::{Pid, Signal};

/// Lines of output that are kept, the first and the last of them.
const LINES_KEPT: usize = 400;

/// How often an end of a process is looked for.
const EXIT_POLL: Duration = Duration::from_millis(5);

/// A running child process.
pub struct Process {
    name: String,
    child: Child,
    input: Option<ChildStdin>,
    output: Arc<Output>,
}

/// What a child did not do.
#[derive(Debug, thiserror::Error)]
pub enum ProcessError {
    /// It could not be started.
    #[error("cannot start {name}: {source}")]
    Start {
        /// Name of the process.
        name: String,
        /// Why.
        source: std::io::Error,
    },
    /// It did not do what was waited for, in time or at all.
    #[error("{name} {what}; it printed:\n{output}")]
    Failed {
        /// Name of the process.
        name: String,
        /// What it did or did not do.
        what: String,
        /// What it had printed by then, both streams.
        output: String,
    },
}

impl Process {
    /// Starts `command`, with both output streams captured; its standard input ends with its owner.
    ///
    /// # Errors
    /// [`ProcessError::Start`] where it cannot be started.
    pub fn start(name: &str, command: &mut Command) -> Result<Self, ProcessError> {
        let error = |source| ProcessError::Start { name: name.to_owned(), source };
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(error)?;
        let output = Arc::new(Output::default());
        let streams: [Option<Box<dyn Read + Send>>; 2] =
            [child.stdout.take().map(|s| Box::new(s) as _), child.stderr.take().map(|s| Box::new(s) as _)];
        for stream in streams.into_iter().flatten() {
            output.read_on_a_thread(stream);
        }
        Ok(Self { name: name.to_owned(), input: child.stdin.take(), child, output })
    }

    /// Its process id.
    pub fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Sends it `signal`.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where it has ended.
    pub fn signal(&self, signal: Signal) -> Result<(), ProcessError> {
        let sent = rustix::process::kill_process(self.pid(), signal);
        sent.map_err(|error| self.failed(format!("could not be sent {signal:?}: {error}")))
    }

    /// Writes a line to its standard input.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where it does not read any more.
    pub fn tell(&mut self, line: &str) -> Result<(), ProcessError> {
        let told = self.input.as_mut().map_or(Ok(()), |input| writeln!(input, "{line}"));
        told.map_err(|error| self.failed(format!("could not be told \"{line}\": {error}")))
    }

    /// Ends its standard input.
    pub fn end_input(&mut self) {
        self.input = None;
    }

    /// Everything it printed so far, both streams.
    pub fn output(&self) -> String {
        self.output.text()
    }

    /// Number of sockets that it holds open; zero once it has ended.
    pub fn sockets(&self) -> usize {
        let folder = format!("/proc/{}/fd", self.pid());
        let targets = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|fd| std::fs::read_link(fd.path()));
        targets.flatten().filter(|target| target.to_string_lossy().starts_with("socket:")).count()
    }

    /// Waits until it has printed a line that contains `part`, and answers that line.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where it ends before, or `within` passes.
    pub fn line_with(&mut self, part: &str, within: Duration) -> Result<String, ProcessError> {
        match self.output.line_with(part, within) {
            Some(line) => Ok(line),
            None => Err(self.failed(format!("ended or waited {within:?} without printing \"{part}\""))),
        }
    }

    /// How it ended, if it has.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where the system does not say.
    pub fn exit_status(&mut self) -> Result<Option<ExitStatus>, ProcessError> {
        let status = self.child.try_wait();
        status.map_err(|error| self.failed(format!("cannot be waited for: {error}")))
    }

    /// Waits until it ends and its output is complete.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where `within` passes first.
    pub fn wait(&mut self, within: Duration) -> Result<ExitStatus, ProcessError> {
        let deadline = Instant::now() + within;
        loop {
            if let Some(status) = self.exit_status()? {
                self.output.await_end(deadline);
                return Ok(status);
            }
            if Instant::now() > deadline {
                return Err(self.failed(format!("did not end within {within:?}")));
            }
            std::thread::sleep(EXIT_POLL);
        }
    }

    /// Waits until it ends, which has to be with success.
    ///
    /// # Errors
    /// [`ProcessError::Failed`] where it fails, or `within` passes first.
    pub fn wait_for_success(&mut self, within: Duration) -> Result<(), ProcessError> {
        let status = self.wait(within)?;
        if status.success() { Ok(()) } else { Err(self.failed(format!("failed ({status})"))) }
    }

    /// An error that says `what` it did or did not do, and what it printed.
    pub fn failed(&self, what: String) -> ProcessError {
        ProcessError::Failed { name: self.name.clone(), what, output: self.output() }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail only where the process has been waited for already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Output of a process, shared with the threads that read it.
#[derive(Default)]
struct Output {
    lines: Mutex<Lines>,
    changed: Condvar,
}

#[derive(Default)]
struct Lines {
    kept: Vec<String>,
    dropped: usize,
    open_streams: usize,
}

impl Output {
    fn read_on_a_thread(self: &Arc<Self>, stream: Box<dyn Read + Send>) {
        let output = self.clone();
        output.lock().open_streams += 1;
        std::thread::spawn(move || {
            for line in BufReader::new(stream).split(b'\n').map_while(Result::ok) {
                output.push(String::from_utf8_lossy(&line).into_owned());
            }
            output.lock().open_streams -= 1;
            output.changed.notify_all();
        });
    }

    fn push(&self, line: String) {
        let mut lines = self.lock();
        if lines.kept.len() == LINES_KEPT {
            lines.kept.remove(LINES_KEPT / 2);
            lines.dropped += 1;
        }
        lines.kept.push(line);
        drop(lines);
        self.changed.notify_all();
    }

    fn line_with(&self, part: &str, within: Duration) -> Option<String> {
        let find = |lines: &Lines| lines.kept.iter().find(|line| line.contains(part)).cloned();
        let waiting = |lines: &mut Lines| find(lines).is_none() && lines.open_streams > 0;
        let waited = self.changed.wait_timeout_while(self.lock(), within, waiting);
        find(&waited.unwrap_or_else(PoisonError::into_inner).0)
    }

    fn await_end(&self, deadline: Instant) {
        let within = deadline.saturating_duration_since(Instant::now());
        // A grandchild may hold the streams open: then what came so far has to do.
        let _ = self.changed.wait_timeout_while(self.lock(), within, |lines| lines.open_streams > 0);
    }

    fn text(&self) -> String {
        let lines = self.lock();
        let mut text = lines.kept[..lines.kept.len() / 2].join("\n");
        if lines.dropped > 0 {
            // Writing into a String has no error.
            let _ = write!(text, "\n[{} lines left out]", lines.dropped);
        }
        text + "\n" + &lines.kept[lines.kept.len() / 2..].join("\n")
    }

    fn lock(&self) -> MutexGuard<'_, Lines> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOON: Duration = Duration::from_secs(20);

    fn shell(script: &str) -> Process {
        Process::start("shell", Command::new("sh").args(["-c", script])).unwrap()
    }

    #[test]
    fn both_streams_are_captured_and_lines_can_be_waited_for() {
        let mut process = shell("echo one; echo two >&2; exec sleep 60");
        assert_eq!(process.line_with("two", SOON).unwrap(), "two");
        assert_eq!(process.line_with("one", SOON).unwrap(), "one");
        assert_eq!(process.exit_status().unwrap(), None);
        process.signal(Signal::TERM).unwrap();
        assert!(!process.wait(SOON).unwrap().success());
    }

    #[test]
    fn an_error_shows_what_was_printed() {
        let mut process = shell("echo no such arena; exit 3");
        assert!(process.line_with("ready", SOON).unwrap_err().to_string().contains("no such arena"));
        assert_eq!(process.wait(SOON).unwrap().code(), Some(3));
        assert!(process.signal(Signal::TERM).is_err());
    }

    #[test]
    fn a_process_can_be_told_things() {
        let mut process = shell("while read line; do echo heard $line; done; echo over");
        process.tell("this").unwrap();
        assert_eq!(process.line_with("heard", SOON).unwrap(), "heard this");
        process.end_input();
        process.wait_for_success(SOON).unwrap();
        assert!(process.output().ends_with("over"));
        let failed = shell("exit 3").wait_for_success(SOON).unwrap_err();
        assert!(failed.to_string().contains("exit status: 3"), "{failed}");
    }

    #[test]
    fn a_flood_of_output_keeps_its_head_and_tail() {
        let mut process = shell("i=0; while [ $i -lt 2000 ]; do echo line $i; i=$((i+1)); done");
        process.wait(SOON).unwrap();
        let text = process.output();
        assert!(text.starts_with("line 0\n") && text.ends_with("line 1999"), "{text}");
        assert!(text.contains("[1600 lines left out]"), "{text}");
    }

    #[test]
    fn sockets_are_counted() {
        let (inherited, _other) = std::os::unix::net::UnixStream::pair().unwrap();
        assert_eq!(shell("exec sleep 60").sockets(), 0);
        rustix::io::fcntl_setfd(&inherited, rustix::io::FdFlags::empty()).unwrap();
        let mut process = shell("exec sleep 60");
        assert_eq!(process.sockets(), 1);
        process.signal(Signal::KILL).unwrap();
        process.wait(SOON).unwrap();
        assert_eq!(process.sockets(), 0);
    }

    #[test]
    fn a_stopped_process_ends_with_its_owner() {
        let process = shell("exec sleep 60");
        let pid = process.pid();
        process.signal(Signal::STOP).unwrap();
        drop(process);
        assert!(rustix::process::test_kill_process(pid).is_err());
    }
}
