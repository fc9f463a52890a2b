//! Streams, the queue and the end of the service: slow readers, many readers, fairness, cancellation, SIGTERM.

mod readers;
mod shutdown;
mod turns;
