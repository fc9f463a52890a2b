//! Volumes as assets.

use super::AssetLimits;
use super::cache::Resident;
use super::kind::Asset;
use crate::error::Result;
use crate::volume::{RawParams, Volume, VolumeInfo, is_gzip, read};

impl Resident for Volume {
    fn resident_bytes(&self) -> u64 {
        self.bytes_in_all()
    }
}

impl Asset for Volume {
    const KIND: &'static str = "volume";
    type How = RawParams;
    type Info = VolumeInfo;

    fn read(bytes: &[u8], name: &str, how: Option<RawParams>, limits: &AssetLimits) -> Result<Self> {
        read(bytes, name, how, &limits.volume)
    }

    fn info(&self, id: &str) -> Result<VolumeInfo> {
        VolumeInfo::of_upload(id, self)
    }

    fn brief(&self, id: &str) -> Result<VolumeInfo> {
        Ok(self.info(id)?.brief())
    }

    fn id_and_name(info: &VolumeInfo) -> (Option<&str>, &str) {
        (info.id.as_deref(), &info.name)
    }

    fn extension(&self, bytes: &[u8]) -> &'static str {
        match self.format() {
            "nifti" if is_gzip(bytes) => "nii.gz",
            "nifti" => "nii",
            "nrrd" => "nrrd",
            _ => "raw",
        }
    }
}
