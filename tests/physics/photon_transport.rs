//! `photon_transport` against closed forms and an independent simulation in double precision.

mod boundaries;
mod extremes;
mod gammas;
mod oracle;
mod phases;
mod published;
mod random;
mod resumed;
mod run;
mod threads;
mod trackers;
mod truth;
