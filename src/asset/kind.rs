//! The interface of a kind of asset.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::AssetLimits;
use super::cache::Resident;
use crate::error::Result;

/// A kind of thing that is stored as its uploaded file.
pub trait Asset: Resident + Sized {
    /// The name of the kind: `volume`.
    const KIND: &'static str;
    /// The way to read its bytes, if they do not tell it themselves. It is part of its id.
    type How: Clone + Serialize + DeserializeOwned + Send;
    /// The description of an asset.
    type Info: Clone + Serialize + DeserializeOwned + Send;
    /// Reads an asset.
    ///
    /// # Errors
    /// [`crate::error::Error::Invalid`] when the bytes are not of this kind; [`crate::error::Error::TooLarge`] above the limits.
    fn read(bytes: &[u8], name: &str, how: Option<Self::How>, limits: &AssetLimits) -> Result<Self>;
    /// Its full description.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if its content cannot be read.
    fn info(&self, id: &str) -> Result<Self::Info>;
    /// Its description in lists.
    ///
    /// # Errors
    /// As [`Asset::info`].
    fn brief(&self, id: &str) -> Result<Self::Info>;
    /// Its id, if it has one, and its name.
    fn id_and_name(info: &Self::Info) -> (Option<&str>, &str);
    /// The extension of its file, after its content: letters, digits and points.
    fn extension(&self, bytes: &[u8]) -> &'static str;
}
