//! A TCP relay between a client and a server that carries only so many bytes a second to the client, or none.
//!
//! Unlike the client library's conditioner it sits below Zenoh: what does not pass fills the sockets and queues of the
//! server, as over a slow line.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt, copy};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::task::JoinHandle;

/// How often bytes pass.
const STEP: Duration = Duration::from_millis(10);
/// What the relay itself holds of what the server sends, bytes; the system doubles it.
const RECEIVE_BUFFER: u32 = 4096;

/// A running relay; dropping it cuts the connections.
pub struct Relay {
    /// Where clients connect.
    pub endpoint: String,
    bytes_per_s: Arc<AtomicU64>,
    task: JoinHandle<()>,
}

impl Relay {
    /// Relays to the server at `endpoint`, `tcp/ADDRESS:PORT`, at `bytes_per_s`.
    ///
    /// # Errors
    /// An endpoint of another form, or no port.
    pub async fn start(endpoint: &str, bytes_per_s: u64) -> io::Result<Self> {
        let server: std::net::SocketAddr = endpoint
            .strip_prefix("tcp/")
            .and_then(|address| address.parse().ok())
            .ok_or(io::ErrorKind::InvalidInput)?;
        let listener = TcpListener::bind("127.0.0.1:0").await?;
        let endpoint = format!("tcp/{}", listener.local_addr()?);
        let rate = Arc::new(AtomicU64::new(bytes_per_s));
        let of_connections = Arc::clone(&rate);
        let task = tokio::spawn(async move {
            let mut connections = tokio::task::JoinSet::new();
            while let Ok((client, _)) = listener.accept().await {
                connections.spawn(connect(client, server, Arc::clone(&of_connections)));
            }
        });
        Ok(Self { endpoint, bytes_per_s: rate, task })
    }

    /// From now on so many bytes pass a second; 0 freezes it.
    pub fn set_rate(&self, bytes_per_s: u64) {
        self.bytes_per_s.store(bytes_per_s, Ordering::Relaxed);
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.task.abort();
    }
}

async fn connect(client: TcpStream, server: std::net::SocketAddr, rate: Arc<AtomicU64>) -> io::Result<()> {
    let socket = TcpSocket::new_v4()?;
    socket.set_recv_buffer_size(RECEIVE_BUFFER)?;
    let server = socket.connect(server).await?;
    client.set_nodelay(true)?;
    server.set_nodelay(true)?;
    let ((mut from_client, to_client), (from_server, mut to_server)) = (client.into_split(), server.into_split());
    tokio::select! {
        ended = copy(&mut from_client, &mut to_server) => ended.map(drop),
        ended = trickle(from_server, to_client, &rate) => ended,
    }
}

async fn trickle(mut from: OwnedReadHalf, mut to: OwnedWriteHalf, rate: &AtomicU64) -> io::Result<()> {
    let mut steps = tokio::time::interval(STEP);
    let mut buffer = vec![0; RECEIVE_BUFFER as usize];
    let mut allowed = 0.0;
    loop {
        let since = tokio::time::Instant::now();
        steps.tick().await;
        let step = since.elapsed().max(STEP).as_secs_f64();
        allowed = (allowed + rate.load(Ordering::Relaxed) as f64 * step).min(buffer.len() as f64);
        let most = allowed as usize;
        if most > 0 {
            let Ok(read) = tokio::time::timeout(STEP, from.read(&mut buffer[..most])).await else { continue };
            match read? {
                0 => return Ok(()),
                read => {
                    to.write_all(&buffer[..read]).await?;
                    allowed -= read as f64;
                }
            }
        }
    }
}
