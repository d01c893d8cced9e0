//! Sending side of a session: seals and puts input packets.

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicU32, Ordering},
    },
    time::{Duration, Instant},
};

use pita_protocol::{
    Keys, Message,
    message::{Controls, JoinAccepted, SayReply, SayRequest},
    seal::{SessionKey, seal},
};
use zenoh::{
    Wait,
    pubsub::Publisher,
    qos::{CongestionControl, Priority},
};

use crate::{
    conditioner::{ConditionerSettings, Delivery, Link},
    error::ClientError,
    lock::lock,
    outbox::Outbox,
    shared::Shared,
    transport,
};

/// How long the answer to something that was said is waited for.
const SAY_TIMEOUT: Duration = Duration::from_secs(5);

/// Sends the inputs of one session, and what it says.
#[derive(Debug)]
pub struct Wire {
    publisher: Arc<Publisher<'static>>,
    conditioner: Option<Link>,
    key_expr: String,
    session_key: SessionKey,
    outbox: Mutex<Outbox>,
    shared: Arc<Shared>,
    say: Say,
}

/// What chat needs.
#[derive(Debug)]
struct Say {
    zenoh: zenoh::Session,
    key_expr: String,
    epoch: u32,
    sequence: AtomicU32,
}

impl Wire {
    /// Declares the publisher of the session's inputs.
    pub async fn open(
        zenoh: &zenoh::Session,
        keys: &Keys,
        accepted: &JoinAccepted,
        shared: Arc<Shared>,
        conditioner: Option<ConditionerSettings>,
    ) -> Result<Self, ClientError> {
        let key_expr = keys.input(accepted.slot);
        let publisher = zenoh
            .declare_publisher(key_expr.clone())
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::InteractiveHigh)
            .express(true)
            .await
            .map_err(ClientError::transport("declare the input publisher"))?;
        let publisher = Arc::new(publisher);
        let outbox = Mutex::new(Outbox::new(accepted.epoch));
        let conditioner = conditioner.map(|settings| {
            let publisher = Arc::clone(&publisher);
            // What is lost here is lost like anything else on this way.
            let put = move |bytes: Vec<u8>| drop(publisher.put(bytes).wait());
            Link::new(settings.up, Delivery::Datagrams, settings.seed.rotate_left(32), put)
        });
        let say = Say {
            zenoh: zenoh.clone(),
            key_expr: keys.say(accepted.slot),
            epoch: accepted.epoch,
            sequence: AtomicU32::new(1),
        };
        Ok(Self { publisher, conditioner, key_expr, session_key: accepted.session_key.clone(), outbox, shared, say })
    }

    /// Says `text` to everybody.
    pub async fn say(&self, text: &str) -> Result<(), ClientError> {
        let Say { zenoh, key_expr, epoch, sequence } = &self.say;
        let sequence = sequence.fetch_add(1, Ordering::Relaxed);
        let request = SayRequest { epoch: *epoch, sequence, text: text.to_owned() };
        request.validate().map_err(ClientError::BadArgument)?;
        let sealed = seal(&request, &self.session_key, key_expr);
        match transport::ask(zenoh, key_expr, "say", sealed, SAY_TIMEOUT).await? {
            Some(SayReply::Said) => Ok(()),
            Some(SayReply::Refused(refusal)) => Err(ClientError::NotSaid(refusal)),
            None => Err(ClientError::Transport { action: "say anything", reason: "the server does not answer".into() }),
        }
    }

    /// Sends `controls` for the first tick that they can reach; answers their sequence number.
    pub async fn send(&self, controls: Controls, leave: bool) -> Result<u32, ClientError> {
        controls.validate().map_err(ClientError::BadArgument)?;
        let now = Instant::now();
        let (acknowledged, tick) = {
            let inbox = lock(&self.shared.inbox);
            (inbox.acknowledgement(), inbox.input_tick(now))
        };
        #[cfg(feature = "prediction")]
        self.shared.predict(tick, &controls);
        let (sequence, packet) = lock(&self.outbox).packet(controls, tick, acknowledged, leave);
        let sealed = seal(&packet, &self.session_key, &self.key_expr);
        lock(&self.shared.inbox).note_sent(sequence, tick, sealed.len(), now);
        match &self.conditioner {
            Some(link) => link.carry(sealed),
            None => self.publisher.put(sealed).await.map_err(ClientError::transport("send input"))?,
        }
        Ok(sequence)
    }
}
