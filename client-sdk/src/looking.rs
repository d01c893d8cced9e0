//! The task that follows which cells a session may take: subscribes to their keys, and asks for keyframes that are missing.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use pita_protocol::{
    Keys, encode,
    message::{CellId, KeyframesRequest, KeyframesWanted},
};
use zenoh::pubsub::Subscriber;

use crate::{
    cell_inbox::Wish,
    conditioner::{ConditionerSettings, Delivery, Link},
    lock::lock,
    shared::Shared,
    transport,
};

/// How long keyframes are waited for, before they are asked for again.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);
/// From one question to the next at least.
const QUESTION_GAP: Duration = Duration::from_millis(50);
/// Apart from the seeds of other links.
const SEED: u64 = 0x63656c6c;

/// Follows the cells of one session.
pub struct Looking {
    zenoh: zenoh::Session,
    keys: Keys,
    shared: Arc<Shared>,
    /// All cells come over one, like one network.
    link: Option<Arc<Link>>,
    /// What a question takes on its way there and back, over a bad network.
    way: Duration,
    /// Else they come along with the session's snapshots.
    subscribes: bool,
    /// With how often the cell had fallen silent before.
    layers: BTreeMap<(CellId, u8), (u32, Subscriber<()>)>,
}

impl Looking {
    /// Takes no cells yet; they come on their own keys where it `subscribes`.
    pub fn new(
        zenoh: zenoh::Session,
        keys: Keys,
        shared: Arc<Shared>,
        conditioner: Option<ConditionerSettings>,
        subscribes: bool,
    ) -> Self {
        let sink = Arc::clone(&shared);
        let link = conditioner.map(|settings| {
            let take = move |bytes: Vec<u8>| sink.take_cell(&bytes, Instant::now());
            Arc::new(Link::new(settings.down, Delivery::Datagrams, settings.seed ^ SEED, take))
        });
        let way = conditioner.map_or(Duration::ZERO, |settings| settings.up.latency + settings.down.latency);
        Self { zenoh, keys, shared, link, way, subscribes, layers: BTreeMap::new() }
    }

    /// Runs until it is aborted.
    pub async fn run(mut self) {
        loop {
            let (wishes, wanted) = lock(&self.shared.inbox).cells_to_do();
            if self.subscribes {
                self.follow(&wishes).await;
            }
            if wanted.is_empty() {
                self.shared.cells_changed.notified().await;
            } else {
                self.ask(wanted).await;
                tokio::time::sleep(QUESTION_GAP).await;
            }
        }
    }

    /// Subscribes to what is wished for, and to nothing else; anew to cells that have fallen silent.
    async fn follow(&mut self, wishes: &[Wish]) {
        let wished = |cell: CellId, layer: u8, silences: u32| {
            wishes.iter().any(|wish| wish.cell == cell && layer < wish.layers && wish.silences == silences)
        };
        // Dropped, they are taken back: beside one of the same key a new one would not be declared to the server.
        self.layers.retain(|&(cell, layer), &mut (silences, _)| wished(cell, layer, silences));
        for wish in wishes {
            for layer in 0..wish.layers {
                if self.layers.contains_key(&(wish.cell, layer)) {
                    continue;
                }
                match self.subscribe(self.keys.cell(wish.cell, layer)).await {
                    Ok(subscriber) => drop(self.layers.insert((wish.cell, layer), (wish.silences, subscriber))),
                    Err(error) => tracing::debug!("subscribing to a cell: {error}"),
                }
            }
        }
    }

    async fn subscribe(&self, key: String) -> zenoh::Result<Subscriber<()>> {
        let subscriber = self.zenoh.declare_subscriber(key);
        match &self.link {
            Some(link) => {
                let link = Arc::clone(link);
                subscriber.callback(move |sample| link.carry(sample.payload().to_bytes().into_owned())).await
            }
            None => {
                let shared = Arc::clone(&self.shared);
                subscriber.callback(move |sample| shared.take_cell(&sample.payload().to_bytes(), Instant::now())).await
            }
        }
    }

    async fn ask(&self, cells: Vec<KeyframesWanted>) {
        tokio::time::sleep(self.way).await;
        let request = encode(&KeyframesRequest { cells });
        let asked = transport::ask(&self.zenoh, &self.keys.keyframes(), "keyframes", request, ANSWER_TIMEOUT).await;
        match asked {
            Ok(Some(answer)) => lock(&self.shared.inbox).take_keyframes(&answer, Instant::now()),
            Ok(None) => {}
            Err(error) => {
                tracing::debug!("asking for keyframes: {error}");
                lock(&self.shared.inbox).count_malformed();
            }
        }
    }
}
