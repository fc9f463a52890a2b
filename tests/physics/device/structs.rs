//! Structs that the host and the device share.

use cloudchamber::device::program::{Source, Variant};
use cloudchamber::device::structs::Layout;
use cloudchamber::run;

use super::open;

/// The offsets of every field and the size, as the device's compiler sees them, of all structs in one program.
fn offsets_on_the_device(layouts: &'static [Layout]) -> Vec<usize> {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::new();
    layouts.iter().for_each(|layout| text += &(layout.opencl_text)());
    text += "kernel void offsets(global int *out) {\n    if (get_global_id(0) > 0) return;\n";
    let mut count = 0;
    for layout in layouts {
        for (field, _) in (layout.offsets)() {
            text += &format!("    out[{count}] = (int)__builtin_offsetof({}, {field});\n", layout.name);
            count += 1;
        }
        text += &format!("    out[{count}] = (int)sizeof({});\n", layout.name);
        count += 1;
    }
    std::fs::write(folder.path().join("offsets.cl"), text + "}\n").unwrap();
    let mut device = open(None, Some(folder.path()));
    let source = Source { kernel: "offsets", words: String::new, structs: Vec::new, variants: Vec::new, common: 0 };
    let variant = Variant::new("offsets", None, &[]);
    device.build(&source, &variant).unwrap();
    let mut out = vec![-1i32; count];
    let buffer = device.upload(bytemuck::cast_slice(&out), 0).unwrap();
    device.run(&variant, &[("out", &buffer)], 1).unwrap();
    device.read(&buffer, 0, &mut out).unwrap();
    out.into_iter().map(|v| usize::try_from(v).unwrap()).collect()
}

#[test]
fn structs_lie_the_same_on_host_and_device() {
    let mut layouts: Vec<Layout> = Vec::new();
    for layout in run::sources().flat_map(|source| (source.structs)()) {
        if layouts.iter().all(|known| known.name != layout.name) {
            layouts.push(layout);
        }
    }
    assert!(layouts.len() >= 10, "{} structs", layouts.len());
    let host: Vec<(&str, usize)> = layouts
        .iter()
        .flat_map(|l| (l.offsets)().into_iter().chain([("size", l.size)]).map(|(_, at)| (l.name, at)))
        .collect();
    let device = offsets_on_the_device(layouts.leak());
    let differ: Vec<_> = host.iter().zip(&device).filter(|((_, host), device)| host != *device).collect();
    assert!(differ.is_empty() && host.len() == device.len(), "{differ:?}");
}
