#!/bin/sh
# Runs a test program with the time of each test: `./dev test` has cargo run it so. Telling times is not stable in Rust's test harness,
# hence the variable, which is set for the program alone: set for the build, it would compile everything anew.
RUSTC_BOOTSTRAP=1 exec "$@" -Z unstable-options --report-time
