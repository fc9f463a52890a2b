//! What a kind of asset is.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::AssetLimits;
use super::cache::Resident;
use crate::error::Result;

/// A kind of thing that is stored as the file that it was uploaded in.
pub trait Asset: Resident + Sized {
    /// What it is called: `volume`.
    const KIND: &'static str;
    /// What says how its bytes are to be read, where they do not say so themselves. It is part of its id.
    type How: Clone + Serialize + DeserializeOwned + Send;
    /// What is told of it.
    type Info: Clone + Serialize + DeserializeOwned + Send;
    /// Reads one.
    ///
    /// # Errors
    /// [`crate::error::Error::Invalid`] where the bytes are none of this kind; [`crate::error::Error::TooLarge`] above the limits.
    fn read(bytes: &[u8], name: &str, how: Option<Self::How>, limits: &AssetLimits) -> Result<Self>;
    /// All that is told of it.
    fn info(&self, id: &str) -> Self::Info;
    /// What is told of it in lists.
    fn brief(&self, id: &str) -> Self::Info;
    /// Its id, where it has one, and its name.
    fn id_and_name(info: &Self::Info) -> (Option<&str>, &str);
    /// The extension of its file, after its content: letters, digits and points.
    fn extension(&self, bytes: &[u8]) -> &'static str;
}
