//! One direction of a conditioned connection: holds messages until they arrive.

use std::{
    cmp::Reverse,
    collections::BinaryHeap,
    sync::Mutex,
    time::{Duration, Instant},
};

use tokio::{sync::mpsc, time::sleep_until};

use super::{Conditions, Delivery, schedule::Schedule};
use crate::lock::lock;

/// Messages on their way; what finds no room is lost.
const HELD_MAX: usize = 4096;

/// Carries messages to where they go, after what they meet on the way.
#[derive(Debug)]
pub struct Link {
    schedule: Mutex<Schedule>,
    began: Instant,
    held: mpsc::Sender<Held>,
}

/// When it arrives, its place among those of the same instant, and what it is.
type Held = (Instant, u64, Vec<u8>);

impl Link {
    /// Gives what arrives to `sink`, on a task of its own that ends with the link.
    pub fn new(
        conditions: Conditions,
        delivery: Delivery,
        seed: u64,
        sink: impl FnMut(Vec<u8>) + Send + 'static,
    ) -> Self {
        let (held, arriving) = mpsc::channel(HELD_MAX);
        tokio::spawn(deliver(arriving, sink));
        Self { schedule: Mutex::new(Schedule::new(conditions, delivery, seed)), began: Instant::now(), held }
    }

    /// Sends `bytes` on their way; never waits.
    pub fn carry(&self, bytes: Vec<u8>) {
        let now_s = self.began.elapsed().as_secs_f64();
        let [first, second] = lock(&self.schedule).admit(now_s, bytes.len());
        if let Some(at_s) = second {
            self.hold(at_s, bytes.clone());
        }
        if let Some(at_s) = first {
            self.hold(at_s, bytes);
        }
    }

    fn hold(&self, at_s: f64, bytes: Vec<u8>) {
        let at = self.began + Duration::try_from_secs_f64(at_s).unwrap_or_default();
        let _ = self.held.try_send((at, 0, bytes));
    }
}

async fn deliver(mut arriving: mpsc::Receiver<Held>, mut sink: impl FnMut(Vec<u8>)) {
    let mut held: BinaryHeap<Reverse<Held>> = BinaryHeap::new();
    let mut count = 0;
    loop {
        let due = held.peek().map(|Reverse((at, ..))| *at);
        tokio::select! {
            taken = arriving.recv(), if held.len() < HELD_MAX => match taken {
                Some((at, _, bytes)) => {
                    count += 1;
                    held.push(Reverse((at, count, bytes)));
                }
                None => return,
            },
            () = sleep_until(due.unwrap_or_else(Instant::now).into()), if due.is_some() => {
                while held.peek().is_some_and(|Reverse((at, ..))| *at <= Instant::now()) {
                    held.pop().into_iter().for_each(|Reverse((_, _, bytes))| sink(bytes));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn messages_arrive_after_their_time_and_in_the_order_of_their_arrival() {
        let conditions = Conditions {
            latency: Duration::from_millis(30),
            jitter: Duration::from_millis(20),
            ..Conditions::default()
        };
        let (sender, mut received) = mpsc::unbounded_channel();
        let link = Link::new(conditions, Delivery::Stream, 1, move |bytes| drop(sender.send((Instant::now(), bytes))));
        let sent = Instant::now();
        (0..50u8).for_each(|n| link.carry(vec![n]));
        for n in 0..50u8 {
            let (at, bytes) = tokio::time::timeout(Duration::from_secs(20), received.recv()).await.unwrap().unwrap();
            assert_eq!(bytes, [n]);
            assert!(at - sent >= Duration::from_millis(10));
        }
        drop(link);
        assert!(received.recv().await.is_none(), "the task ends with the link");
    }
}
