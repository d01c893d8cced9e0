//! A stream that nobody waits for: what people read of a daemon must not hold it up where they do not read.
//!
//! Owns a thread and a bounded queue for one stream. Text that finds the queue full is dropped.

use std::io::{self, Write};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

/// Texts that wait for a stream that takes no more.
const WAITING_MAX: usize = 256;
/// How long [`Output::flush`] waits for such a stream.
const FLUSH_TIMEOUT: Duration = Duration::from_millis(500);

/// The way to a stream; its clones write to the same one.
#[derive(Clone, Debug)]
pub struct Output {
    queue: SyncSender<Item>,
}

#[derive(Debug)]
enum Item {
    Text(Vec<u8>),
    /// Dropped, once everything before it is written.
    Mark(SyncSender<()>),
}

impl Output {
    /// Writes to `stream` on a thread of its own.
    ///
    /// # Errors
    /// Where there is no thread.
    pub fn to(mut stream: impl Write + Send + 'static) -> io::Result<Self> {
        let (queue, items) = sync_channel(WAITING_MAX);
        thread::Builder::new().name("output".to_owned()).spawn(move || {
            for item in items {
                match item {
                    // Where the stream is closed nobody reads it, and the daemon goes on.
                    Item::Text(text) => drop(stream.write_all(&text).and_then(|()| stream.flush())),
                    Item::Mark(mark) => drop(mark),
                }
            }
        })?;
        Ok(Self { queue })
    }

    /// Prints `text` and a line end.
    pub fn print(&self, text: &str) {
        self.offer(Item::Text(format!("{text}\n").into_bytes()));
    }

    /// Waits until everything is written, but not for long where the stream takes no more.
    pub fn flush(&self) {
        let (mark, written) = sync_channel(1);
        self.offer(Item::Mark(mark));
        // An error says that the mark was dropped or the time is over: both end the wait.
        let _ = written.recv_timeout(FLUSH_TIMEOUT);
    }

    fn offer(&self, item: Item) {
        let _ = self.queue.try_send(item);
    }
}

/// For logs, which come in whole lines.
impl Write for Output {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        self.offer(Item::Text(text.to_vec()));
        Ok(text.len())
    }

    /// Logs are not waited for.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// Passes text on, after a word that it may.
    struct Gate(Receiver<()>, Sender<Vec<u8>>);

    impl Write for Gate {
        fn write(&mut self, text: &[u8]) -> io::Result<usize> {
            self.0.recv().map_err(io::Error::other)?;
            self.1.send(text.to_vec()).map_err(io::Error::other)?;
            Ok(text.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_stuck_stream_holds_nobody_up_and_what_fits_is_written_in_order() {
        let ((open, gate), (passed, written)) = (channel(), channel());
        let output = Output::to(Gate(gate, passed)).unwrap();
        (0..10 * WAITING_MAX).for_each(|i| output.print(&i.to_string()));
        output.flush();
        assert!(written.try_recv().is_err());
        (0..3).for_each(|_| open.send(()).unwrap());
        let lines: Vec<_> = (0..3).map(|_| written.recv_timeout(Duration::from_secs(20)).unwrap()).collect();
        assert_eq!(lines, [b"0\n", b"1\n", b"2\n"]);
    }
}
