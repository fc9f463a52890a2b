//! Sinograms as assets. The stored file is the parts of an upload, one after the other.

use super::AssetLimits;
use super::cache::Resident;
use super::kind::Asset;
use crate::error::Result;
use crate::tomography::{Sinogram, SinogramInfo, SinogramParts};

impl Resident for Sinogram {
    fn resident_bytes(&self) -> u64 {
        self.bytes()
    }
}

impl Asset for Sinogram {
    const KIND: &'static str = "sinogram";
    type How = SinogramParts;
    type Info = SinogramInfo;

    fn read(bytes: &[u8], name: &str, how: Option<SinogramParts>, limits: &AssetLimits) -> Result<Self> {
        let alone = || SinogramParts { meta: None, lengths: [bytes.len(), 0, 0] };
        let most = limits.volume.max_volume_bytes / size_of::<f32>() as u64;
        Self::read(bytes, name, &how.unwrap_or_else(alone), usize::try_from(most).unwrap_or(usize::MAX))
    }

    fn info(&self, id: &str) -> Result<SinogramInfo> {
        Ok(Self::info(self, id, true))
    }

    fn brief(&self, id: &str) -> Result<SinogramInfo> {
        Ok(Self::info(self, id, false))
    }

    fn id_and_name(info: &SinogramInfo) -> (Option<&str>, &str) {
        (Some(&info.id), &info.name)
    }

    fn extension(&self, _: &[u8]) -> &'static str {
        "sinogram"
    }
}
