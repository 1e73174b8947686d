//! One worker as a process: its group, its pipes, and its end.
//!
//! Three threads serve the pipes, so that no wait of ours can be held up by a worker that neither reads nor writes. The
//! process has a group of its own: the terminal's Ctrl-C does not reach it, and whatever it starts is ended with it. Some
//! renderers start programs in groups of their own (a browser); these are found by a mark in their environment.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

use serde_json::{Map, Value};

/// Bytes of a message's line at most: descriptions of all models are some tens of thousands.
const LONGEST_LINE: usize = 1 << 24;
/// Bytes of a line of the log that are kept.
const LONGEST_WORD: usize = 1 << 12;
/// Lines of the log that are kept.
const LAST_WORDS: usize = 40;
/// Lines of the log that a message quotes.
const QUOTED: usize = 3;
/// Messages that may wait to be looked at; a worker that writes more has to wait.
const WAITING: usize = 16;
/// The variable that marks the environment of a worker and of all that it starts.
const MARK: &str = "LOOKMATCH_WORKER";

/// How a worker is started.
#[derive(Clone, Debug, PartialEq)]
pub struct Launch {
    /// The program.
    pub program: PathBuf,
    /// Its arguments.
    pub args: Vec<OsString>,
    /// Variables that are added to its environment.
    pub env: Vec<(OsString, OsString)>,
}

impl Launch {
    /// What to call a worker that has not said its name: its script, else its program.
    pub(crate) fn label(&self) -> String {
        let script = self.args.iter().map(Path::new).find(|path| path.extension().is_some());
        script.unwrap_or(&self.program).file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// A request: its line and the bytes after it.
type Packet = (Vec<u8>, Arc<[u8]>);

/// What comes from a worker.
#[derive(Debug)]
pub(crate) enum Event {
    /// A message and the bytes after it.
    Message(Map<String, Value>, Vec<u8>),
    /// Something that is no message, described; nothing after it can be understood.
    Garbage(String),
    /// The end of its output.
    Ended,
}

/// A running worker. Dropping it ends its whole group.
pub(crate) struct Process {
    child: Child,
    requests: Option<Sender<Packet>>,
    events: Receiver<Event>,
    /// Bytes that may follow the next message.
    most_bytes: Arc<AtomicUsize>,
    last_words: Arc<Mutex<VecDeque<String>>>,
    listener: JoinHandle<()>,
    mark: String,
    /// How it ended, once that is known: its number may be another's then.
    ended: Option<String>,
}

impl Process {
    /// Starts a worker whose log is appended to a file, if one is given.
    pub(crate) fn start(launch: &Launch, log: Option<&Path>) -> io::Result<Self> {
        let log = log.map(|path| OpenOptions::new().create(true).append(true).open(path)).transpose()?;
        let mark = new_mark();
        let mut command = Command::new(&launch.program);
        command.args(&launch.args).envs(launch.env.iter().map(|(name, value)| (name, value)));
        command.env(MARK, &mark).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn()?;
        let (stdin, stdout, stderr) = match (child.stdin.take(), child.stdout.take(), child.stderr.take()) {
            (Some(stdin), Some(stdout), Some(stderr)) => (stdin, stdout, stderr),
            _ => unreachable!("all three were asked for"),
        };
        let (requests, outbox) = channel();
        let (inbox, events) = sync_channel(WAITING);
        let most_bytes = Arc::new(AtomicUsize::new(0));
        let last_words = Arc::new(Mutex::new(VecDeque::new()));
        let (limit, words, id) = (most_bytes.clone(), last_words.clone(), child.id());
        thread::spawn(move || write_requests(stdin, &outbox));
        thread::spawn(move || read_events(stdout, &inbox, &limit));
        let listener = thread::spawn(move || listen(stderr, &words, log, id));
        Ok(Self {
            child,
            requests: Some(requests),
            events,
            most_bytes,
            last_words,
            listener,
            mark,
            ended: None,
        })
    }

    /// The process's number.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends a line and the bytes after it; up to `most_bytes` may come with the answer. Where the worker is gone, that is
    /// seen when its answer is waited for.
    pub(crate) fn send(&self, line: Vec<u8>, data: Arc<[u8]>, most_bytes: usize) {
        self.most_bytes.store(most_bytes, Ordering::Release);
        if let Some(requests) = &self.requests {
            requests.send((line, data)).ok();
        }
    }

    /// What comes next, if anything comes within a time.
    pub(crate) fn receive(&self, wait: Duration) -> Option<Event> {
        match self.events.recv_timeout(wait) {
            Ok(event) => Some(event),
            // Its children may keep the pipe open, and its last answer may still be on its way.
            Err(RecvTimeoutError::Timeout) if self.has_ended() => {
                Some(self.events.recv_timeout(Duration::from_millis(100)).unwrap_or(Event::Ended))
            }
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Event::Ended),
        }
    }

    /// True once the process has ended. It is not reaped yet: its number, which is that of its group, remains taken.
    #[cfg(unix)]
    fn has_ended(&self) -> bool {
        use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};
        let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        waitid(WaitId::Pid(Pid::from_child(&self.child)), look).map_or(true, |status| status.is_some())
    }

    #[cfg(not(unix))]
    fn has_ended(&self) -> bool {
        false
    }

    /// Waits until the process has ended, but not for ever.
    pub(crate) fn wait(&self, most: Duration) -> bool {
        wait_until(most, || self.has_ended())
    }

    /// Ends the process and all that it started; says how the process ended, by itself where it did so already.
    pub(crate) fn kill(&mut self) -> String {
        if let Some(ended) = &self.ended {
            return ended.clone();
        }
        #[cfg(unix)]
        {
            let group = rustix::process::Pid::from_child(&self.child);
            rustix::process::kill_process_group(group, rustix::process::Signal::KILL).ok();
        }
        self.child.kill().ok();
        let status = self.child.wait().map_or_else(|error| error.to_string(), |status| status.to_string());
        kill_marked(&self.mark);
        self.ended = Some(status.clone());
        status
    }

    /// The last lines of the log. Of a worker that has just ended, they may still be on their way.
    pub(crate) fn last_words(&self) -> String {
        if self.ended.is_some() || self.has_ended() {
            wait_until(Duration::from_millis(300), || self.listener.is_finished());
        }
        let words = lock(&self.last_words);
        let quoted = words.iter().skip(words.len().saturating_sub(QUOTED));
        quoted.map(String::as_str).collect::<Vec<_>>().join(" | ")
    }

    /// Closes the worker's input, which asks it to end.
    pub(crate) fn close_input(&mut self) {
        self.requests = None;
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Locks even where another thread panicked: what is held here is whole after every step.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn wait_until(most: Duration, is_so: impl Fn() -> bool) -> bool {
    let end = Instant::now() + most;
    while !is_so() {
        if Instant::now() > end {
            return false;
        }
        thread::sleep(Duration::from_millis(5));
    }
    true
}

/// A mark that no other worker on this machine has.
fn new_mark() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_nanos();
    format!("{}-{}-{now}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed))
}

/// Ends what a worker started in groups of their own.
#[cfg(target_os = "linux")]
fn kill_marked(mark: &str) {
    let wanted = format!("{MARK}={mark}");
    for entry in std::fs::read_dir("/proc").into_iter().flatten().flatten() {
        let Some(id) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else { continue };
        // Those of other users cannot be read, and are not ours.
        let Ok(environment) = std::fs::read(entry.path().join("environ")) else { continue };
        if environment.split(|byte| *byte == 0).any(|variable| variable == wanted.as_bytes()) {
            let id = rustix::process::Pid::from_raw(id);
            id.map(|id| rustix::process::kill_process(id, rustix::process::Signal::KILL).ok());
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn kill_marked(_: &str) {}

fn write_requests(mut stdin: ChildStdin, outbox: &Receiver<Packet>) {
    while let Ok((line, data)) = outbox.recv() {
        let written = stdin.write_all(&line).and_then(|()| stdin.write_all(&data));
        if written.and_then(|()| stdin.flush()).is_err() {
            return;
        }
    }
}

fn read_events(stdout: ChildStdout, inbox: &SyncSender<Event>, most_bytes: &AtomicUsize) {
    let mut stdout = BufReader::new(stdout);
    loop {
        let event = read_event(&mut stdout, most_bytes);
        let is_message = matches!(event, Event::Message(..));
        if inbox.send(event).is_err() || !is_message {
            return;
        }
    }
}

fn read_event(stdout: &mut impl BufRead, most_bytes: &AtomicUsize) -> Event {
    match stdout.fill_buf() {
        Ok([]) | Err(_) => return Event::Ended,
        Ok([b'{', ..]) => (),
        // What is no message may have no end either.
        Ok(garbage) => return Event::Garbage(unexpected(garbage)),
    }
    let line = match read_line(stdout, LONGEST_LINE) {
        Ok(line) if !line.is_empty() => line,
        _ => return Event::Ended,
    };
    let Ok(message) = serde_json::from_slice::<Map<String, Value>>(&line) else {
        return Event::Garbage(unexpected(&line));
    };
    let bytes = match message.get("bytes") {
        None => 0,
        Some(bytes) => bytes.as_u64().unwrap_or(u64::MAX),
    };
    let most = most_bytes.load(Ordering::Acquire) as u64;
    if bytes > most {
        let found = &message["bytes"];
        return Event::Garbage(format!("bytes is {found} where at most {most} may follow"));
    }
    let mut data = Vec::with_capacity(bytes as usize);
    match stdout.take(bytes).read_to_end(&mut data) {
        Ok(read) if read as u64 == bytes => Event::Message(message, data),
        _ => Event::Ended,
    }
}

/// A line with its end; what is longer than `longest` comes in pieces, and nothing at the end.
fn read_line(from: &mut impl BufRead, longest: usize) -> io::Result<Vec<u8>> {
    let mut line = Vec::new();
    from.take(longest as u64).read_until(b'\n', &mut line)?;
    Ok(line)
}

/// What came in place of a message: its beginning.
fn unexpected(output: &[u8]) -> String {
    let line = output.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let text = String::from_utf8_lossy(&line[..line.len().min(200)]);
    format!("'{}'; expected a JSON object on a line", text.escape_debug())
}

/// Keeps the last lines of the log, and copies all of it to a file; each line says which process wrote it.
fn listen(stderr: ChildStderr, last_words: &Mutex<VecDeque<String>>, mut log: Option<File>, id: u32) {
    let mut stderr = BufReader::new(stderr);
    while let Ok(line) = read_line(&mut stderr, LONGEST_WORD) {
        if line.is_empty() {
            return;
        }
        let text = String::from_utf8_lossy(&line);
        let text = text.trim_end();
        if let Some(file) = &mut log {
            // A full disk must not end a render.
            file.write_all(format!("[{id}] {text}\n").as_bytes()).ok();
        }
        if !text.trim().is_empty() {
            let mut words = lock(last_words);
            words.push_back(text.chars().take(300).collect());
            let surplus = words.len().saturating_sub(LAST_WORDS);
            words.drain(..surplus);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(output: &[u8], most: usize) -> Event {
        read_event(&mut BufReader::new(output), &AtomicUsize::new(most))
    }

    #[test]
    fn messages_carry_bytes() {
        let Event::Message(message, data) = event(b"{\"id\": 3, \"bytes\": 2}\n\nxrest", 2) else { panic!() };
        assert_eq!((message["id"].as_u64(), data.as_slice()), (Some(3), b"\nx".as_slice()));
    }

    #[test]
    fn what_is_no_message_is_described() {
        let garbage = |output: &[u8]| match event(output, 2) {
            Event::Garbage(text) => text,
            other => panic!("{other:?}"),
        };
        assert!(garbage(b"Saved: a.png\n{}").contains("'Saved: a.png'; expected a JSON object"));
        assert!(garbage(b"[1]\n").contains("[1]"));
        assert!(garbage(b"{\"bytes\": 3}\nabc").contains("bytes is 3 where at most 2"));
        assert!(garbage(b"{\"bytes\": -1}\nabc").contains("bytes is -1"));
        assert!(garbage(b"\n").contains("''"));
    }

    #[test]
    fn an_end_in_the_middle_is_an_end() {
        assert!(matches!(event(b"", 2), Event::Ended));
        assert!(matches!(event(b"{\"bytes\": 2}\nx", 2), Event::Ended));
    }

    #[test]
    fn workers_are_called_by_their_scripts() {
        let launch = |args: &[&str]| Launch {
            program: "/usr/bin/python3".into(),
            args: args.iter().map(OsString::from).collect(),
            env: Vec::new(),
        };
        assert_eq!(launch(&["/a/mitsuba_worker.py", "x"]).label(), "mitsuba_worker.py");
        assert_eq!(launch(&["-q"]).label(), "python3");
    }
}
