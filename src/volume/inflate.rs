//! A reader of bytes from a body that may be gzip. It inflates no more bytes than are asked for, so that a gzip bomb costs nothing.

use crate::error::{Error, Result};
use flate2::bufread::MultiGzDecoder;
use std::io::{ErrorKind, Read};

/// The greatest ratio by which deflate can shrink (a 258-byte match takes at least 2 bits). It bounds the number of bytes in a body.
const MAX_RATIO: u64 = 1032;

/// True if the bytes begin as gzip does (RFC 1952: the magic, and deflate, its only method).
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b, 8])
}

/// A forward reader over a plain or gzipped body.
pub(super) enum Source<'a> {
    /// The bytes that are left.
    Plain(&'a [u8]),
    /// A gzip stream of one or more members.
    Gzip {
        /// The decoder that gives the inflated bytes.
        decoder: Box<MultiGzDecoder<&'a [u8]>>,
        /// The length of the whole gzip stream.
        compressed: usize,
    },
}

impl<'a> Source<'a> {
    /// Reads the bytes as they are.
    pub fn plain(bytes: &'a [u8]) -> Self {
        Self::Plain(bytes)
    }

    /// Inflates the bytes as they are asked for.
    pub fn gzip(bytes: &'a [u8]) -> Self {
        Self::Gzip { decoder: Box::new(MultiGzDecoder::new(bytes)), compressed: bytes.len() }
    }

    /// True if this is gzip.
    pub fn compressed(&self) -> bool {
        matches!(self, Self::Gzip { .. })
    }

    /// The upper bound of the number of bytes that are left.
    pub fn at_most(&self) -> u64 {
        match self {
            Self::Plain(left) => left.len() as u64,
            Self::Gzip { compressed, .. } => (*compressed as u64).saturating_mul(MAX_RATIO),
        }
    }

    /// An estimate of the number of bytes that are left, for reserving memory. It is never more than a few times the body.
    pub fn about(&self) -> usize {
        match self {
            Self::Plain(left) => left.len(),
            Self::Gzip { compressed, .. } => compressed.saturating_mul(3),
        }
    }

    /// Fills `buffer`, and returns the number of bytes that were filled. It is less than the buffer only at the end of the data.
    pub fn fill(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let mut filled = 0;
        while filled < buffer.len() {
            let free = &mut buffer[filled..];
            let got = match self {
                Self::Plain(left) => left.read(free),
                Self::Gzip { decoder, .. } => decoder.read(free),
            };
            match got {
                Ok(0) => break,
                Ok(count) => filled += count,
                Err(cause) if cause.kind() == ErrorKind::Interrupted => {}
                Err(cause) if cause.kind() == ErrorKind::UnexpectedEof => {
                    return Err(Error::invalid("", "the gzip data end too early", "a complete gzip file"));
                }
                Err(cause) => {
                    return Err(Error::invalid(
                        "",
                        format!("the gzip data are damaged: {cause}"),
                        "an intact gzip file",
                    ));
                }
            }
        }
        Ok(filled)
    }

    /// Skips `count` bytes. It returns false if the data end before.
    pub fn skip(&mut self, mut count: u64) -> Result<bool> {
        if let Self::Plain(left) = self {
            let step = usize::try_from(count).unwrap_or(usize::MAX);
            let rest = left.get(step..);
            *left = rest.unwrap_or_default();
            return Ok(rest.is_some());
        }
        let mut buffer = [0; 4096];
        while count > 0 {
            let step = usize::try_from(count).unwrap_or(usize::MAX).min(buffer.len());
            let got = self.fill(&mut buffer[..step])?;
            if got < step {
                return Ok(false);
            }
            count -= got as u64;
        }
        Ok(true)
    }

    /// True if nothing is left. For gzip this also makes the decoder check the stream's checksum.
    pub fn at_end(&mut self) -> Result<bool> {
        Ok(self.fill(&mut [0])? == 0)
    }
}
