//! What can be chosen about a session.

use std::time::Duration;

use pita_protocol::{
    Message,
    message::{JoinAccepted, JoinRequest, ResumeProof, Role},
    seal::{SessionKey, prove},
};

use crate::{
    conditioner::ConditionerSettings, datagrams, error::ClientError, interpolation::InterpolationSettings, join::join,
    session::Session, transport,
};

/// What a session is to be; ends in [`SessionBuilder::connect`].
#[derive(Clone, Debug)]
pub struct SessionBuilder {
    pub(crate) endpoint: String,
    name: String,
    pub(crate) role: Role,
    pub(crate) arena: Option<String>,
    pub(crate) connect_timeout: Duration,
    pub(crate) loss_timeout: Duration,
    pub(crate) interpolation: Option<InterpolationSettings>,
    pub(crate) conditioner: Option<ConditionerSettings>,
    pub(crate) datagrams: Option<String>,
    bytes_per_s: Option<u32>,
    resume: Option<ResumeTicket>,
    #[cfg(feature = "prediction")]
    pub(crate) prediction: bool,
}

/// What lets a session go on over another connection; see [`SessionBuilder::resume`]. A secret.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResumeTicket {
    arena: String,
    slot: u16,
    epoch: u32,
    key: SessionKey,
}

impl ResumeTicket {
    pub(crate) fn of(accepted: &JoinAccepted) -> Self {
        Self {
            arena: accepted.description.arena.clone(),
            slot: accepted.slot,
            epoch: accepted.epoch,
            key: accepted.session_key.clone(),
        }
    }

    fn proof(&self) -> ResumeProof {
        let Self { slot, epoch, .. } = *self;
        ResumeProof { slot, epoch, proof: prove(slot, epoch, &self.key) }
    }
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
            conditioner: None,
            datagrams: None,
            bytes_per_s: None,
            resume: None,
            #[cfg(feature = "prediction")]
            prediction: false,
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

    /// Takes snapshots as datagrams from the server's `network.datagrams` (`udp/HOST:PORT`), over a connection of their
    /// own: where packets get lost, a lost one does not hold up those behind it. Where none come through, snapshots come
    /// over the first connection after all. Otherwise all of it comes over TCP.
    pub fn datagrams(mut self, endpoint: &str) -> Self {
        self.datagrams = Some(endpoint.to_owned());
        self
    }

    /// How much of the state to be sent, bytes/s, for a slow connection: 8000 at least. Otherwise what the server gives.
    pub fn bytes_per_s(mut self, budget: u32) -> Self {
        self.bytes_per_s = Some(budget);
        self
    }

    /// Goes on with an earlier session, in the same slot and car, where the server still keeps them. A ticket is good for
    /// once: the session that comes of it has one of its own.
    pub fn resume(mut self, ticket: ResumeTicket) -> Self {
        self.arena = Some(ticket.arena.clone());
        self.resume = Some(ticket);
        self
    }

    /// Whether to predict the own vehicle, for [`Session::own_vehicle_at`]. Each input then steps it a few ticks, which
    /// takes some tenths of a millisecond. Off by default.
    #[cfg(feature = "prediction")]
    pub fn prediction(mut self, on: bool) -> Self {
        self.prediction = on;
        self
    }

    /// Makes the network worse than it is, to see what comes of it.
    pub fn conditioner(mut self, settings: Option<ConditionerSettings>) -> Self {
        self.conditioner = settings;
        self
    }

    /// Connects and joins, in one attempt.
    ///
    /// # Errors
    /// Any [`ClientError`] but [`Spectator`](ClientError::Spectator) and [`Ended`](ClientError::Ended).
    pub async fn connect(self) -> Result<Session, ClientError> {
        let resume = self.resume.as_ref().map(ResumeTicket::proof);
        let Self { name, role, bytes_per_s, .. } = self.clone();
        let mut request = JoinRequest { name, role, bytes_per_s, cells_along: false, resume };
        request.validate().map_err(ClientError::BadArgument)?;
        self.datagrams.as_deref().map_or(Ok(()), datagrams::check)?;
        let zenoh = transport::open(&self.endpoint, self.connect_timeout).await?;
        let datagrams = match &self.datagrams {
            Some(endpoint) => datagrams::open(endpoint, self.connect_timeout).await,
            None => None,
        };
        request.cells_along = datagrams.is_some();
        let joined = join(&self, &zenoh, datagrams, request).await;
        if joined.is_err() {
            transport::close(&zenoh).await;
        }
        joined
    }
}
