//! Labels: looks of whole numbers in place of a function, also where a volume holds labels and nobody says so.

use std::sync::Arc;

use super::Parameters;
use super::plan::{Colours, Prepared};
use crate::error::{Error, Result};
use crate::scene::labels::Labels;
use crate::scene::transfer::{TABLE_SIZE, TransferFunction, TransferRequest};
use crate::scene::transfer_table::TransferTable;
use crate::technique::PreparedView;
use crate::volume::{DataKind, MOST_VALUES, Volume};

/// Each place in the list of labels has an entry of its own.
const _: () = assert!(MOST_VALUES <= TABLE_SIZE);

impl Parameters {
    /// The parameters with labels' looks, if the volume holds labels and nothing that is given speaks against it.
    pub(super) fn suiting(&self, volume: Option<&Volume>) -> Self {
        let open = self.transfer_function.is_none() && self.regions.is_none() && self.cuda_sample.is_none();
        let labels = |volume: &Volume| volume.contents().is_ok_and(|contents| contents.kind == DataKind::Labels);
        let preset = TransferRequest { preset: Some("labels".into()), ..TransferRequest::default() };
        let of_labels = Self { transfer_function: Some(preset), ..self.clone() };
        let possible = open && volume.is_some_and(labels) && of_labels.check_together("").is_ok();
        if possible { of_labels } else { self.clone() }
    }

    /// The view of labels that are larger than a table: the table is that of their places in the list of all labels.
    pub(super) fn prepared_by_places(self, volume: &Arc<Volume>) -> Result<Arc<dyn PreparedView>> {
        let (function, named) = self.transfer_function(volume)?;
        let indexed = volume.indexed()?.clone();
        let places = indexed.volume.range();
        let function = match function {
            TransferFunction::Labels(looks) => Labels::Indexed(Box::new(looks), indexed.values.clone()),
            _ => return Err(Error::internal("labels without looks")),
        };
        let table = TransferTable::new(TransferFunction::Labels(function), places);
        let mut plan = self.plan(&indexed.volume, table.opaque(), format!("transfer function: {named}"))?;
        plan.reasons.push(format!("{} different labels", indexed.values.len() + indexed.sharing));
        if indexed.sharing > 0 {
            let most = indexed.values.len();
            plan.reasons.push(format!("labels beyond the first {most} share the looks of others: {}", indexed.sharing));
        }
        let colours = Colours::Function(Box::new(table));
        Ok(Arc::new(Prepared { parameters: self, volume: indexed.volume, colours, function_of_values: None, plan }))
    }
}
