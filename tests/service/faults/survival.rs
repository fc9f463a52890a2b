//! After all faults the server renders as before, and its memory is as before.

use std::time::{Duration, Instant};

use super::{bodies, cameras, fields, voxels};
use crate::common::Server;
use crate::support::*;

#[tokio::test]
async fn after_every_fault_the_server_renders_and_its_memory_is_what_it_was() {
    let server = Server::start();
    let api = Api::new(&server);
    let picture = api.png(&small()).await;
    let before = server.resident_bytes();
    // The faults come twice: a cost that is paid once (an allocator's arenas) is not lost each time.
    for _ in 0..2 {
        bodies::broken_json(&server).await;
        fields::refused_by_name(&server).await;
        cameras::refused_by_name(&server).await;
        voxels::refused(&server).await;
        // The uploads break off: each announces a gigabyte and sends a megabyte, twenty times.
        for _ in 0..20 {
            let head = "POST /v1/volumes HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000000\r\n\r\n";
            let mut socket = std::net::TcpStream::connect(server.address()).unwrap();
            let bytes = [head.as_bytes(), &vec![0; 1 << 20][..]].concat();
            drop(std::io::Write::write_all(&mut socket, &bytes));
        }
    }
    assert_eq!(api.png(&small()).await, picture, "it renders as before");
    let started = Instant::now();
    let growth = loop {
        let growth = server.resident_bytes().saturating_sub(before);
        if growth < 64 << 20 || started.elapsed() > Duration::from_secs(10) {
            break growth;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    };
    assert!(growth < 64 << 20, "{} MiB more than before", growth >> 20);
}
