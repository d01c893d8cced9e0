//! How a session is asked for, and how it comes about.

use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use pita_protocol::{
    Keys, Message, keys,
    message::{JoinAccepted, JoinReply, JoinRequest, Role, Status},
};
use tokio::sync::mpsc;

use crate::{
    error::ClientError,
    interpolation::{InterpolationBuffer, InterpolationSettings},
    keeper::{self, EVENTS_MAX, Incoming, Keeper},
    session::{Session, Shared},
    transport,
    wire::Wire,
};

/// What a session is to be; ends in [`SessionBuilder::connect`].
#[derive(Clone, Debug)]
pub struct SessionBuilder {
    endpoint: String,
    name: String,
    role: Role,
    arena: Option<String>,
    connect_timeout: Duration,
    loss_timeout: Duration,
    interpolation: Option<InterpolationSettings>,
}

impl SessionBuilder {
    pub(crate) fn new(endpoint: &str, name: &str) -> Self {
        Self {
            endpoint: endpoint.to_owned(),
            name: name.to_owned(),
            role: Role::Player,
            arena: None,
            connect_timeout: Duration::from_secs(5),
            loss_timeout: Duration::from_secs(3),
            interpolation: Some(InterpolationSettings::default()),
        }
    }

    /// Watch only: no vehicle, no controls.
    pub fn spectator(mut self) -> Self {
        self.role = Role::Spectator;
        self
    }

    /// The arena to join. Otherwise the server is asked which one it runs.
    pub fn arena(mut self, arena: &str) -> Self {
        self.arena = Some(arena.to_owned());
        self
    }

    /// How long each step of connecting may take: reaching the endpoint, finding the arena, joining. 5 s by default.
    pub fn connect_timeout(mut self, timeout: Duration) -> Self {
        self.connect_timeout = timeout;
        self
    }

    /// How long no newer snapshot may arrive before the session counts as lost. 3 s by default.
    pub fn loss_timeout(mut self, timeout: Duration) -> Self {
        self.loss_timeout = timeout;
        self
    }

    /// How [`Session::world_at`] interpolates; `None` for a session that never asks for it and should not keep what it
    /// would need.
    pub fn interpolation(mut self, settings: Option<InterpolationSettings>) -> Self {
        self.interpolation = settings;
        self
    }

    /// Connects and joins, in one attempt.
    ///
    /// # Errors
    /// Any [`ClientError`] but [`Spectator`](ClientError::Spectator) and [`Ended`](ClientError::Ended).
    pub async fn connect(self) -> Result<Session, ClientError> {
        let request = JoinRequest { name: self.name.clone(), role: self.role };
        request.validate().map_err(ClientError::BadArgument)?;
        let zenoh = transport::open(&self.endpoint, self.connect_timeout).await?;
        let joined = self.join(&zenoh, request).await;
        if joined.is_err() {
            transport::close(&zenoh).await;
        }
        joined
    }

    async fn join(self, zenoh: &zenoh::Session, request: JoinRequest) -> Result<Session, ClientError> {
        let arena = match &self.arena {
            Some(name) => name.clone(),
            None => self.find_arena(zenoh).await?,
        };
        let keys = Keys::new(&arena).map_err(ClientError::BadArgument)?;

        // Before the join, so that no event between the description and the subscription is lost.
        let (events, incoming) = mpsc::channel(EVENTS_MAX);
        let event_subscriber = zenoh
            .declare_subscriber(keys.event())
            .callback(move |sample| keeper::forward(&sample.payload().to_bytes(), &events))
            .await
            .map_err(ClientError::transport("subscribe to events"))?;

        let payload = pita_protocol::encode(&request);
        let reply = transport::ask(zenoh, &keys.join(), "join", payload, self.connect_timeout).await?;
        let accepted = match reply.ok_or_else(|| self.no_arena())? {
            JoinReply::Accepted(accepted) => *accepted,
            JoinReply::Refused(refusal) => return Err(refusal.into()),
        };

        let shared = Arc::new(self.shared(&accepted));
        let receiving = Arc::clone(&shared);
        let snapshot_subscriber = zenoh
            .declare_subscriber(keys.snapshot(accepted.slot))
            .callback(move |sample| receiving.take_snapshot(&sample.payload().to_bytes(), Instant::now()))
            .await
            .map_err(ClientError::transport("subscribe to snapshots"))?;
        let wire = Arc::new(Wire::open(zenoh, &keys, &accepted, Arc::clone(&shared)).await?);
        let token = zenoh
            .liveliness()
            .declare_token(keys.live(accepted.slot, accepted.epoch))
            .await
            .map_err(ClientError::transport("declare the session alive"))?;
        let keeper = Keeper {
            zenoh: zenoh.clone(),
            keys,
            slot: accepted.slot,
            joined_at: accepted.description.event_sequence,
            loss_timeout: self.loss_timeout,
            keep_alive: (self.role == Role::Spectator)
                .then(|| Duration::from_millis(u64::from(accepted.input_timeout_ms)) / 3),
            shared: Arc::clone(&shared),
            wire: Arc::clone(&wire),
        };
        let keeper = tokio::spawn(keeper.run(Incoming(incoming)));
        Ok(Session::new(zenoh.clone(), accepted, shared, wire, keeper, (event_subscriber, snapshot_subscriber, token)))
    }

    async fn find_arena(&self, zenoh: &zenoh::Session) -> Result<String, ClientError> {
        let running: Vec<Status> = transport::ask_all(zenoh, keys::ANY_STATUS, "status", self.connect_timeout).await?;
        let mut names: Vec<String> = running.into_iter().map(|status| status.arena).collect();
        names.sort_unstable();
        names.dedup();
        match names.len() {
            0 => Err(self.no_arena()),
            1 => Ok(names.remove(0)),
            _ => Err(ClientError::SeveralArenas(names)),
        }
    }

    fn no_arena(&self) -> ClientError {
        let (endpoint, arena) = (self.endpoint.clone(), self.arena.clone());
        ClientError::NoArena { endpoint, arena, waited: self.connect_timeout }
    }

    fn shared(&self, accepted: &JoinAccepted) -> Shared {
        let period_s = 1.0 / f64::from(accepted.tick_hz);
        let interpolation = self
            .interpolation
            .map(|settings| (settings.delay, Mutex::new(InterpolationBuffer::new(settings, period_s))));
        let recent_max = self.interpolation.map_or(0, |settings| settings.frames_max.clamp(2, 256));
        Shared::new(accepted, recent_max, interpolation)
    }
}
