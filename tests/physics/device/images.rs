//! Volumes as images.

use std::process::Command;

#[test]
fn a_volume_read_as_an_image_looks_the_same() {
    let scene = |voxel: &str| {
        format!(
            r#"{{"technique": "emission_absorption", "volume": {{"builtin": "{voxel}", "resolution": 40}},
            "image": {{"width": 48, "height": 40}}, "budget": {{"samples": 2}}, "emission_absorption": {{"shading": true}}}}"#
        )
    };
    for builtin in ["marschner_lobb", "shepp_logan", "smoke"] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.json");
        std::fs::write(&file, scene(builtin)).unwrap();
        let render = |images: &str| {
            let out = folder.path().join(format!("{images}.exr"));
            let mut command = Command::new(env!("CARGO_BIN_EXE_cloudchamber"));
            command.arg("render").arg(&file).args(["--lanes", "1", "--volume-images", images, "--data-dir"]);
            let output = command.arg(folder.path()).arg("-o").arg(&out).output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let picture = exr::prelude::read_first_rgba_layer_from_file(
                out,
                |size, _| vec![[0.0f32; 3]; size.width() * size.height()],
                |pixels: &mut Vec<[f32; 3]>, at, (r, g, b, _): (f32, f32, f32, f32)| {
                    pixels[at.y() * 48 + at.x()] = [r, g, b]
                },
            );
            picture.unwrap().layer_data.channel_data.pixels
        };
        let (buffer, image) = (render("false"), render("true"));
        let worst = buffer.iter().flatten().zip(image.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-3, "{builtin}: {worst:e}");
        assert!(buffer.iter().flatten().any(|v| *v > 0.05), "{builtin} is there");
    }
}
