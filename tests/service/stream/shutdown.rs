//! SIGTERM: new work is refused, running work gets its time, streams end, the exit code is 0.

use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use futures_util::StreamExt;
use serde_json::json;

use crate::common::Server;
use crate::support::*;

/// The exit code. It fails if the server does not end in time, since a wait for a hanging process would hang too.
fn exit_code(server: &mut Server) -> Option<i32> {
    let started = Instant::now();
    let stat = format!("/proc/{}/stat", server.pid());
    while !std::fs::read_to_string(&stat).unwrap().contains(") Z ") {
        assert!(started.elapsed() < PATIENCE, "the server does not end");
        std::thread::sleep(Duration::from_millis(20));
    }
    // The wait status has the signal that killed the process in its low byte.
    let status = std::fs::read_to_string(&stat).unwrap().trim().rsplit(' ').next().unwrap().to_owned();
    println!("wait status {status}");
    server.wait()
}

#[tokio::test]
async fn sigterm_lets_running_renders_finish_and_refuses_new_ones() {
    let mut server = Server::start();
    let api = Api::new(&server);
    let path = api.start(&with(endless(), "/budget/time_ms", json!(3000))).await;
    let frames = api.get(&format!("{path}/frames")).await;
    let told = api.get(&format!("{path}/events")).await;
    let last = format!("{path}/frame.png?wait=final");
    let waiting = api.get(&last);
    let drain = async {
        api.until(&path, "visible", |r| r["samples"].as_u64() >= Some(1)).await;
        server.terminate();
        let started = Instant::now();
        let refused = loop {
            let ready = api.get("/readyz").await;
            if ready.status() != 200 {
                break ready;
            }
            assert!(started.elapsed() < PATIENCE);
        };
        problem(refused, 503, "ready while draining").await;
        let refused = api.post(&small(), "application/json").await;
        assert!(refused.headers()["retry-after"].to_str().unwrap().parse::<u64>().unwrap() >= 1);
        problem(refused, 503, "new work while draining").await;
        assert_eq!(api.get_json(&path).await["state"], "running");
    };
    let (waited, ()) = tokio::join!(waiting, drain);
    assert_eq!(waited.status(), 200);
    let last = waited.bytes().await.unwrap();
    let (parts, closed) = all_parts(frames).await;
    assert!(closed, "the stream ends by its boundary");
    assert!(parts.last().unwrap().is_final() && parts.last().unwrap().body == last);
    let told = events(&told.text().await.unwrap());
    assert_eq!((told.last().unwrap().0.as_str(), &told.last().unwrap().2["stopped_by"]), ("final", &json!("time")));
    assert_eq!(exit_code(&mut server), Some(0));
}

#[tokio::test]
async fn sigterm_ends_renders_that_take_too_long() {
    let mut server = Server::start_with(&["--drain-ms", "200"]);
    let api = Api::new(&server);
    let path = api.start(&endless()).await;
    let mut frames = api.get(&format!("{path}/frames")).await.bytes_stream();
    frames.next().await.unwrap().unwrap();
    let told = api.get(&format!("{path}/events")).await;
    server.terminate();
    let terminated = Instant::now();
    while let Some(piece) = frames.next().await {
        if piece.is_err() {
            let code = exit_code(&mut server);
            panic!("the stream broke off after {:?}, exit code {code:?}: {piece:?}", terminated.elapsed());
        }
    }
    let told = events(&told.text().await.unwrap());
    assert!(["cancelled", "progress"].contains(&told.last().unwrap().0.as_str()), "{told:?}");
    assert_eq!(exit_code(&mut server), Some(0));
}

#[tokio::test]
async fn sigterm_waits_for_no_idle_stalled_or_half_sent_connection() {
    let mut server = Server::start_with(&["--drain-ms", "200"]);
    let api = Api::new(&server);
    let path = api.start(&endless()).await;
    api.until(&path, "visible", |r| r["samples"].as_u64() >= Some(1)).await;
    let send = |bytes: String| {
        let mut socket = TcpStream::connect(server.address()).unwrap();
        socket.write_all(bytes.as_bytes()).unwrap();
        socket
    };
    let open = [
        send(String::new()),
        send("GET /healthz HTTP/1.1\r\nHos".into()),
        send("POST /v1/volumes HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\nabc".into()),
        send(format!("GET {path}/frames HTTP/1.1\r\nHost: x\r\n\r\n")),
        send(format!("GET {path}/events HTTP/1.1\r\nHost: x\r\n\r\n")),
    ];
    std::thread::sleep(Duration::from_millis(300));
    server.terminate();
    assert_eq!(exit_code(&mut server), Some(0));
    drop(open);
}

#[tokio::test]
async fn sigterm_before_the_kernels_are_built_ends_it_as_well() {
    let mut server = Server::spawn(&[]);
    server.terminate();
    assert_eq!(exit_code(&mut server), Some(0));
}

#[tokio::test]
async fn sigterm_with_nothing_to_do_ends_at_once() {
    let mut server = Server::start();
    let started = Instant::now();
    server.terminate();
    assert_eq!(exit_code(&mut server), Some(0));
    assert!(started.elapsed() < Duration::from_secs(8), "the ten seconds are for renders: {:?}", started.elapsed());
}
