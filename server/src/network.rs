//! Zenoh: how the daemon's session is configured and opened.
//!
//! Owns the choices that keep one client from harming the others: a peer that listens on TCP, and for snapshots on UDP
//! where it is told to, and neither scouts nor gossips, puts that are dropped rather than waited for, bounded messages, bounded input rate, and access rules: the
//! peer forwards from client to client, so without them anybody could put snapshots and answer joins in its name.

use std::net::{Ipv4Addr, SocketAddr, TcpListener, UdpSocket};

use pita_protocol::Keys;
use pita_protocol::keys::{ANY_JOIN, ANY_STATUS};
use serde_json::json;

use crate::config::Network;

/// Longest input that passes Zenoh's filter, bytes. Above what the protocol allows, so that the daemon counts what is
/// somewhat too long; far below what would cost anything.
const INPUT_FILTER_BYTES: usize = 4096;
/// Connections that may be in their handshake: silent ones must not keep others out.
const ACCEPT_PENDING: u32 = 1000;
/// Time for a handshake, ms.
const ACCEPT_TIMEOUT_MS: u32 = 2000;
/// Longest wait for a client that does not read, where a message may not be dropped (replies, declarations), µs. Then
/// its connection is closed.
const WAIT_BEFORE_CLOSE_US: u32 = 50_000;
/// Batches of 64 KiB that wait for one client in the queue of snapshots and events. With Zenoh's 2 a burst is dropped for
/// healthy clients too; more only makes what a slow client gets older.
const QUEUE_BATCHES: u32 = 4;
/// Free ports tried, where one was found and then lost to somebody else.
const FREE_PORT_ATTEMPTS: usize = 5;

/// Why the daemon does not listen.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// An endpoint is not of the form that we listen on.
    #[error("network.{key}: {reason}")]
    Endpoint {
        /// Key of the configuration.
        key: &'static str,
        /// What is wrong with its value.
        reason: String,
    },
    /// The address cannot be had.
    #[error("cannot listen on {endpoint}: {reason}{}", hint(endpoint, reason))]
    Bind {
        /// Where.
        endpoint: String,
        /// Why.
        reason: std::io::Error,
    },
    /// Zenoh did not open.
    #[error("Zenoh does not open on {endpoint}: {reason}")]
    Zenoh {
        /// Where.
        endpoint: String,
        /// What it says.
        reason: String,
    },
}

fn hint(endpoint: &str, reason: &std::io::Error) -> String {
    match reason.kind() {
        std::io::ErrorKind::AddrInUse => format!(
            "\nIs another server running? Ask it: pita-server status --connect {endpoint}\n\
             Or take a free port: --listen tcp/127.0.0.1:0"
        ),
        std::io::ErrorKind::AddrNotAvailable => "\nNo interface of this machine has that address.".to_owned(),
        std::io::ErrorKind::PermissionDenied => {
            "\nPorts below 1024 are not for everybody: take a higher one.".to_owned()
        }
        _ => String::new(),
    }
}

/// What is listened on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// Everything, over TCP.
    Control,
    /// Snapshots, over UDP.
    Datagrams,
}

impl Use {
    fn key(self) -> &'static str {
        match self {
            Self::Control => "listen",
            Self::Datagrams => "datagrams",
        }
    }

    fn protocol(self) -> &'static str {
        match self {
            Self::Control => "tcp",
            Self::Datagrams => "udp",
        }
    }

    /// Takes and gives back the address, because that says more clearly than Zenoh why it cannot be had, and which port a
    /// 0 became.
    fn free_address(self, endpoint: &str, wanted: SocketAddr) -> Result<String, NetworkError> {
        let bound = match self {
            Self::Control => TcpListener::bind(wanted).and_then(|listener| listener.local_addr()),
            Self::Datagrams => UdpSocket::bind(wanted).and_then(|socket| socket.local_addr()),
        };
        let free = bound.map_err(|reason| NetworkError::Bind { endpoint: endpoint.to_owned(), reason })?;
        Ok(format!("{}/{free}", self.protocol()))
    }

    /// Names other than `localhost` are not resolved: whether a configuration is valid must not depend on the network.
    fn address(self, endpoint: &str) -> Result<SocketAddr, String> {
        let (protocol, other) = (self.protocol(), if self == Self::Control { Self::Datagrams } else { Self::Control });
        if endpoint.starts_with(&format!("{}/", other.protocol())) {
            return Err(format!(
                "{endpoint:?} belongs under network.{}: here it is {protocol}/ADDRESS:PORT, because {}",
                other.key(),
                match self {
                    Self::Control => "joins, inputs and events must not be lost",
                    Self::Datagrams => "over TCP a lost segment holds up the snapshots behind it",
                }
            ));
        }
        let address = endpoint.strip_prefix(protocol).and_then(|rest| rest.strip_prefix('/'));
        let numeric = address.and_then(|address| match address.strip_prefix("localhost:") {
            Some(port) => Some((Ipv4Addr::LOCALHOST, port.parse().ok()?).into()),
            None => address.parse().ok(),
        });
        numeric.ok_or_else(|| {
            format!(
                "{endpoint:?} is no endpoint, allowed is {protocol}/ADDRESS:PORT, for example {protocol}/127.0.0.1:7447"
            )
        })
    }
}

/// Where the daemon listens, real ports in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoints {
    /// Everything.
    pub control: String,
    /// Snapshots as datagrams.
    pub datagrams: Option<String>,
}

/// Opens the daemon's session, for inputs of so many `slots`; answers it with where it listens.
///
/// # Errors
/// [`NetworkError`], before anything listens.
pub async fn open(config: &Network, keys: &Keys, slots: u16) -> Result<(zenoh::Session, Endpoints), NetworkError> {
    let address = |of: Use, endpoint: &str| {
        of.address(endpoint).map_err(|reason| NetworkError::Endpoint { key: of.key(), reason })
    };
    let wanted = address(Use::Control, &config.listen)?;
    let datagrams = match config.datagrams.as_str() {
        "" => None,
        endpoint => Some(address(Use::Datagrams, endpoint)?),
    };
    let has_free_port = wanted.port() == 0 || datagrams.is_some_and(|datagrams| datagrams.port() == 0);
    let mut attempt = 1;
    loop {
        let control = Use::Control.free_address(&config.listen, wanted)?;
        let free = |wanted| Use::Datagrams.free_address(&config.datagrams, wanted);
        let endpoints = Endpoints { control, datagrams: datagrams.map(free).transpose()? };
        match zenoh::open(configuration(config, keys, slots, &endpoints)).await {
            Ok(session) => return Ok((session, endpoints)),
            Err(_) if has_free_port && attempt < FREE_PORT_ATTEMPTS => attempt += 1,
            Err(reason) => {
                return Err(NetworkError::Zenoh { endpoint: endpoints.control, reason: reason.to_string() });
            }
        }
    }
}

/// Checks that `config` names endpoints to listen on.
///
/// # Errors
/// The key, and text with the endpoint and what is allowed.
pub fn check_endpoints(config: &Network) -> Result<(), (&'static str, String)> {
    Use::Control.address(&config.listen).map_err(|reason| ("network.listen", reason))?;
    if !config.datagrams.is_empty() {
        Use::Datagrams.address(&config.datagrams).map_err(|reason| ("network.datagrams", reason))?;
    }
    Ok(())
}

fn configuration(config: &Network, keys: &Keys, slots: u16, endpoints: &Endpoints) -> zenoh::Config {
    let listen: Vec<_> = [Some(&endpoints.control), endpoints.datagrams.as_ref()].into_iter().flatten().collect();
    let inputs: Vec<_> = (0..slots).map(|slot| keys.input(slot)).collect();
    // Slot by slot: over the one connection of a router come the inputs of all behind it, all of them aimed at the same moment.
    let freq = config.input_rate_max_hz.get();
    let rates: Vec<_> = inputs.iter().map(|key| json!({ "key_expr": key, "freq": freq })).collect();
    let settings = [
        ("mode", json!("peer")),
        ("listen/endpoints", json!(listen)),
        ("scouting/multicast/enabled", json!(false)),
        ("scouting/gossip/enabled", json!(false)),
        ("timestamping/enabled", json!(false)),
        ("transport/unicast/accept_timeout", json!(ACCEPT_TIMEOUT_MS)),
        ("transport/unicast/accept_pending", json!(ACCEPT_PENDING)),
        ("transport/unicast/max_sessions", json!(config.connections_max.get())),
        ("transport/link/tx/lease", json!(config.lease_ms.get())),
        ("transport/link/tx/keep_alive", json!(4)),
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", json!(0)),
        ("transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments", json!(0)),
        ("transport/link/tx/queue/size/data_high", json!(QUEUE_BATCHES)),
        ("transport/link/tx/queue/congestion_control/block/wait_before_close", json!(WAIT_BEFORE_CLOSE_US)),
        ("transport/link/rx/max_message_size", json!(config.message_bytes_max.get())),
        (
            "low_pass_filter",
            json!([{ "flows": ["ingress"], "messages": ["put"], "key_exprs": [keys.all_inputs()], "size_limit": INPUT_FILTER_BYTES }]),
        ),
        ("downsampling", json!([{ "flows": ["ingress"], "messages": ["put"], "rules": rates }])),
    ];
    let mut zenoh = zenoh::Config::default();
    let settings = settings.into_iter().chain([("access_control", access_rules(keys, &inputs))]);
    for (key, value) in settings {
        // Keys and types are Zenoh's own and do not depend on input beyond the ranges of `Network`; a test has them all.
        zenoh.insert_json5(key, &value.to_string()).expect("a setting of Zenoh");
    }
    zenoh
}

/// What clients may do: put `inputs`, ask, listen, show their tokens. Everything else is denied.
fn access_rules(keys: &Keys, inputs: &[String]) -> serde_json::Value {
    let questions = [
        keys.join(),
        keys.all_says(),
        keys.describe(),
        keys.source(),
        keys.status(),
        keys.ticks(),
        keys.admin(),
        keys.keyframes(),
        ANY_JOIN.to_owned(),
        ANY_STATUS.to_owned(),
    ];
    let allow = |id: &str, flow: &str, messages: &[&str], key_exprs: &[String]| {
        json!({
            "id": id, "flows": [flow], "permission": "allow", "messages": messages, "key_exprs": key_exprs
        })
    };
    let everything = [
        "put",
        "delete",
        "declare_subscriber",
        "query",
        "reply",
        "declare_queryable",
        "liveliness_token",
        "liveliness_query",
        "declare_liveliness_subscriber",
    ];
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": [
            allow("inputs", "ingress", &["put"], inputs),
            allow("questions", "ingress", &["query"], &questions),
            allow("listening", "ingress", &["declare_subscriber"], &[keys.all_snapshots(), keys.all_cells(), keys.event()]),
            allow("tokens", "ingress", &["liveliness_token"], &[keys.all_live()]),
            allow("server", "egress", &everything, &["**".to_owned()]),
        ],
        "subjects": [{ "id": "anybody" }],
        "policies": [{
            "rules": ["inputs", "questions", "listening", "tokens", "server"],
            "subjects": ["anybody"],
        }],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ServerConfig;
    use pita_protocol::message::CellId;
    use std::time::Duration;
    use zenoh::Wait;

    #[test]
    fn zenoh_knows_every_setting() {
        let [control, datagrams] = ["tcp/127.0.0.1:7447", "udp/127.0.0.1:7447"].map(str::to_owned);
        let endpoints = Endpoints { control, datagrams: Some(datagrams) };
        configuration(&ServerConfig::built_in().network, &Keys::new("a").unwrap(), 3, &endpoints);
    }

    /// What arrives first at a client that listens on `key` while another client and then the server put there.
    async fn first_heard(server: &zenoh::Session, endpoint: &str, key: &str) -> Vec<u8> {
        let client = || async {
            let config = crate::status::client_configuration(endpoint).unwrap();
            zenoh::open(config).await.unwrap()
        };
        let (honest, mallory) = (client().await, client().await);
        let heard = honest.declare_subscriber(key).await.unwrap();
        // Its answer comes after everything that the client sent before: the server knows of the subscription, or has
        // seen the put.
        let ask = async |client: &zenoh::Session| {
            let reply = client.get("pita/a/status").await.unwrap().recv_async().await.unwrap();
            assert!(reply.result().is_ok());
        };
        ask(&honest).await;
        mallory.put(key, "mallory").await.unwrap();
        ask(&mallory).await;
        server.put(key, "server").await.unwrap();
        heard.recv_async().await.unwrap().payload().to_bytes().into_owned()
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn clients_cannot_speak_for_the_server() {
        let keys = Keys::new("a").unwrap();
        let config = Network { listen: "tcp/127.0.0.1:0".to_owned(), ..ServerConfig::built_in().network };
        let (server, Endpoints { control: endpoint, .. }) = open(&config, &keys, 4).await.unwrap();
        let answer = |query: zenoh::query::Query| drop(query.reply("pita/a/status", "").wait());
        server.declare_queryable(keys.status()).callback(answer).background().await.unwrap();
        let all = async {
            for key in [keys.snapshot(3), keys.cell(CellId { x: -1, z: 4 }, 2), keys.event()] {
                assert_eq!(first_heard(&server, &endpoint, &key).await, b"server", "{key}");
            }
        };
        tokio::time::timeout(Duration::from_secs(20), all).await.expect("in time");
    }

    fn checked(listen: &str, datagrams: &str) -> Result<(), (&'static str, String)> {
        let [listen, datagrams] = [listen, datagrams].map(str::to_owned);
        check_endpoints(&Network { listen, datagrams, ..ServerConfig::built_in().network })
    }

    #[test]
    fn endpoints_are_checked() {
        for good in ["tcp/127.0.0.1:7447", "tcp/[::1]:0", "tcp/localhost:65535"] {
            assert_eq!(checked(good, ""), Ok(()));
            assert_eq!(checked(good, &good.replace("tcp", "udp")), Ok(()));
        }
        for bad in
            ["", "127.0.0.1:7447", "tcp/127.0.0.1", "tcp/127.0.0.1:70000", "tcp/example.org:1", "quic/127.0.0.1:1"]
        {
            let (key, said) = checked(bad, "").unwrap_err();
            assert!(key == "network.listen" && said.contains("tcp/ADDRESS:PORT"), "{said}");
        }
        for bad in ["udp/127.0.0.1", "quic/127.0.0.1:7447", "udp/example.org:1"] {
            let (key, said) = checked("tcp/127.0.0.1:0", bad).unwrap_err();
            assert!(key == "network.datagrams" && said.contains("udp/ADDRESS:PORT"), "{said}");
        }
    }

    #[test]
    fn endpoints_that_were_mixed_up_are_named_with_where_they_belong() {
        let (key, said) = checked("udp/127.0.0.1:7447", "").unwrap_err();
        assert!(key == "network.listen" && said.contains("belongs under network.datagrams"), "{said}");
        let (key, said) = checked("tcp/127.0.0.1:7447", "tcp/127.0.0.1:7448").unwrap_err();
        assert!(key == "network.datagrams" && said.contains("belongs under network.listen"), "{said}");
    }

    #[test]
    fn a_taken_port_is_named_with_what_to_do() {
        let taken = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = taken.local_addr().unwrap();
        let said = Use::Control.free_address(&format!("tcp/{address}"), address).unwrap_err().to_string();
        for word in [&address.to_string(), "--listen", "pita-server status"] {
            assert!(said.contains(word), "{said:?} lacks {word:?}");
        }
    }
}
