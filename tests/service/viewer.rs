//! The viewer as its users meet it: a real Chromium, driven by chromedriver, against the real server.
//!
//! One browser runs at a time, for the sake of small machines. `./dev test` installs `chromium` and `chromedriver`; without them these tests fail
//! and say so.

mod browser;

use std::path::Path;

use browser::{ANOTHER_PICTURE, DESKTOP, PHONE, Page};
use fantoccini::key::Key;
use serde_json::json;

fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).sum::<f64>() / a.len() as f64
}

fn assert_another(before: &[f64], after: &[f64], what: &str) {
    let difference = difference(before, after);
    assert!(difference > ANOTHER_PICTURE, "{what}: the picture has changed by {difference:.3} of 255 only");
}

/// A ball in a box of `side` voxels, as NRRD.
fn nrrd(side: usize) -> Vec<u8> {
    let mut file =
        format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: {side} {side} {side}\nspacings: 1 1 1\nencoding: raw\n\n")
            .into_bytes();
    let centre = (side - 1) as f64 / 2.0;
    for i in 0..side.pow(3) {
        let place = [i % side, i / side % side, i / side / side].map(|x| (x as f64 - centre) / centre);
        let r2: f64 = place.iter().map(|x| x * x).sum();
        file.push((255.0 * (1.0 - r2).clamp(0.0, 1.0)) as u8);
    }
    file
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_appears_and_refines() {
    let page = Page::open(DESKTOP).await;
    page.until("a first frame", "Number(document.querySelector('#picture').dataset.frame) > 0").await;
    page.settled().await;
    let picture = page.thumbnail().await;
    let brightest = picture.iter().copied().fold(0.0, f64::max);
    let darkest = picture.iter().copied().fold(255.0, f64::min);
    assert!(brightest > 20.0 && brightest - darkest > 20.0, "the picture is uniform: {darkest} to {brightest}");

    page.until("the state of the finished render", "document.querySelector('#state').textContent === 'done'").await;
    assert!(
        page.text("#samples").await.parse::<u32>().is_ok_and(|n| n > 0),
        "samples: {}",
        page.text("#samples").await
    );
    assert!(page.text("#error").await.ends_with('%'), "error: {}", page.text("#error").await);
    assert_ne!(page.text("#stopped").await, "–");
    page.until("the convergence chart", "document.querySelector('#convergence').naturalWidth > 0").await;
    page.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn mouse_and_keyboard_move_the_camera() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    let start = page.thumbnail().await;
    let dragged = page.after("a frame after the drag", page.drag("#picture", [0.0, 0.0], [180.0, -60.0])).await;
    assert_another(&start, &dragged, "after a drag");

    page.js("document.querySelector('#picture').focus()").await;
    let turned = page.after("a frame after arrow keys", page.press(&[char::from(Key::Left); 6])).await;
    assert_another(&dragged, &turned, "after arrow keys");
    let nearer = page.after("a frame after +", page.press(&['+', '+', '+'])).await;
    assert_another(&turned, &nearer, "after zooming in");

    let reset = page.after("a frame after 0", page.press(&['0'])).await;
    let off = difference(&start, &reset);
    assert!(off < ANOTHER_PICTURE, "reset is {off:.3} of 255 off the first view");
    page.press(&['?']).await;
    page.until("the list of keys", "document.querySelector('#keys').open").await;
    page.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_transfer_function_changes_the_picture() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    let start = page.thumbnail().await;
    let preset = page.after("a frame with the preset", page.select("#preset", "hls")).await;
    assert_another(&start, &preset, "with the preset hls");

    page.after("a frame with the preset", page.select("#preset", "ramp")).await;
    let before = page.thumbnail().await;
    let edited =
        page.after("a frame after the edit", page.drag("#transfer [data-index='1']", [0.0, 0.0], [-60.0, -20.0])).await;
    assert_another(&before, &edited, "after dragging a point");
    assert_eq!(page.find("#preset").await.prop("value").await.expect("its value").as_deref(), Some("custom"));
    let points = "document.querySelectorAll('#transfer [data-index]').length";
    let count = page.js(&format!("return {points}")).await;
    page.after("a frame without the point", page.press(&[char::from(Key::Delete)])).await;
    assert_eq!(page.js(&format!("return {points} + 1")).await, count);
    page.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_volume_is_exported_to_a_file() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    page.js("document.querySelector('#exports button').click()").await;
    page.until("the exported file", "document.querySelector('#exports button').dataset.state === 'done'").await;
    page.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn volumes_are_uploaded_and_deleted() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("tiny ball.nrrd");
    std::fs::write(&path, nrrd(16)).expect("a file");
    upload(&page, &path).await;
    assert!(page.text("#volume-list").await.contains("tiny ball.nrrd"));

    let drop = format!(
        "const data = new DataTransfer();
         data.items.add(new File([new Uint8Array({})], 'dropped.nrrd'));
         document.querySelector('#picture').dispatchEvent(new DragEvent('drop', {{ dataTransfer: data, bubbles: true, cancelable: true }}))",
        json!(nrrd(12))
    );
    page.after("a picture of the dropped volume", async {
        page.js(&drop).await;
        page.until(
            "the dropped volume's choice",
            "document.querySelector('#volume').selectedOptions[0].textContent === 'dropped.nrrd'",
        )
        .await;
    })
    .await;

    page.find("#volume-list .current .quiet").await.click().await.expect("delete");
    page.after("a picture of another volume", async {
        page.find("#confirm .danger").await.click().await.expect("yes");
    })
    .await;
    assert!(!page.text("#volume-list").await.contains("dropped.nrrd"));

    std::fs::write(folder.path().join("letter.nrrd"), b"Dear server, this is no volume.").expect("a file");
    page.find("#file")
        .await
        .send_keys(&folder.path().join("letter.nrrd").display().to_string())
        .await
        .expect("a choice");
    page.until("the refusal in words", "document.querySelector('#alert').textContent.includes('letter.nrrd')").await;
    page.close().await;
}

async fn upload(page: &Page, path: &Path) {
    let name = path.file_name().expect("a name").display().to_string();
    page.after("a picture of the uploaded volume", async {
        page.find("#file").await.send_keys(&path.display().to_string()).await.expect("a choice");
        let chosen = format!("document.querySelector('#volume').selectedOptions[0].textContent === {}", json!(name));
        page.until("the uploaded volume's choice", &chosen).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refused_value_is_named_and_marked() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    let step = "[data-pointer='/emission_absorption/step_voxels']";
    page.enter(step, "99").await;
    page.until(
        "the pointer in the alert",
        "document.querySelector('#alert').textContent.includes('/emission_absorption/step_voxels')",
    )
    .await;
    assert_eq!(page.find(step).await.attr("aria-invalid").await.expect("an attribute").as_deref(), Some("true"));
    page.after("a picture with a good value", page.enter(step, "1")).await;
    assert_eq!(page.text("#alert").await, "");
    assert_eq!(page.find(step).await.attr("aria-invalid").await.expect("an attribute"), None);
    page.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_phone_sees_the_picture_first() {
    let page = Page::open(PHONE).await;
    page.settled().await;
    assert!(!page.find("#panel").await.is_displayed().await.expect("whether it shows"));
    let scrolls = "return document.documentElement.scrollWidth > innerWidth";
    assert_eq!(page.js(scrolls).await, json!(false), "the page is wider than a phone");
    page.find("#panel-toggle").await.click().await.expect("the panel's button");
    assert!(page.find("#panel").await.is_displayed().await.expect("whether it shows"));
    assert!(page.find("#technique").await.is_displayed().await.expect("whether it shows"));
    assert_eq!(page.js(scrolls).await, json!(false), "the panel is wider than a phone");
    page.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_render_warns_of_stands_on_the_picture() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    assert_eq!(page.text("#stage #warnings").await, "");
    page.after("a picture with a long step", page.enter("[data-pointer='/emission_absorption/step_voxels']", "4"))
        .await;
    page.until("a warning", "document.querySelector('#stage #warnings').textContent.includes('more than two voxels')")
        .await;
    assert!(page.text("#stage #warnings").await.contains("measured 4, bound 2"));
    page.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_error_that_is_not_known_has_its_reason() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    page.after("a scattering view", page.select("#technique", "single_scatter")).await;
    page.settled().await;
    page.find("[data-pointer='/single_scatter/tracking']").await.select_by_label("march").await.expect("the march");
    page.until("the reason", "document.querySelector('#error-parts').textContent.includes('the bias of fixed steps')")
        .await;
    page.settled().await;
    page.until("the end", "document.querySelector('#error').textContent === 'not known'").await;
    page.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_charts_page_shows_what_was_measured() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    page.find("header a[href='charts.html']").await.click().await.expect("the link to the charts");
    page.until("the table of what to choose", "document.querySelectorAll('#choose tr').length > 10").await;
    page.js("document.querySelector('#cases').scrollIntoView()").await;
    page.until("a chart", "[...document.querySelectorAll('#cases img')].some((chart) => chart.naturalWidth > 100)")
        .await;
    let verdicts = page.text("#verdicts").await;
    assert!(verdicts.contains("biased and flagged") && !verdicts.contains("silent"), "{verdicts}");
    assert_eq!(page.text("#alert").await, "");
    page.close().await;
}

/// A volume is projected, its sinogram is looked at, and it is reconstructed beside it; a wrong upload is told in words.
#[tokio::test(flavor = "multi_thread")]
async fn the_tomography_page_projects_and_reconstructs() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    page.find("header a[href='tomography.html']").await.click().await.expect("the link to tomography");
    page.until("the volumes", "document.querySelectorAll('#volume option').length > 7").await;
    page.js("document.querySelector('#measured-views').value = 40").await;
    page.find("#measure button").await.click().await.expect("the button");
    page.until("a sinogram", "document.querySelector('#preview').naturalHeight === 40").await;
    page.until("a reconstruction", "document.querySelector('#facts').textContent.startsWith('40 views')").await;
    let picture = "document.querySelector('#reconstruction')";
    assert_eq!(page.js(&format!("return {picture}.naturalWidth")).await, 384);
    page.js(&format!("window.before = {picture}.src")).await;
    page.find("#technique").await.select_by_value("backprojection").await.expect("another method");
    page.until(
        "another picture",
        &format!("{picture}.alt.startsWith('backprojection') && {picture}.src !== window.before"),
    )
    .await;
    page.js(
        "document.querySelector('#view').value = 3; document.querySelector('#view').dispatchEvent(new Event('input'))",
    )
    .await;
    page.until("a view", "document.querySelector('#view-words').textContent.startsWith('View 3')").await;
    page.js("const files = new DataTransfer(); files.items.add(new File(['no numbers'], 'wrong.npy'));
         document.querySelector('#data').files = files.files; document.querySelector('#upload button').click()")
        .await;
    page.until("a refusal in words", "document.querySelector('#alert').textContent.includes('NumPy')").await;
    page.close().await;
}

/// With the box ticked, the planner chooses, and the page shows its choice and its reasons. Without, nothing is planned.
#[tokio::test(flavor = "multi_thread")]
async fn a_ticked_box_leaves_the_settings_to_the_planner() {
    let page = Page::open(DESKTOP).await;
    page.settled().await;
    page.js("document.querySelector('#planned').click()").await;
    page.until("a plan", "document.querySelector('#plan').textContent.includes('on the device')").await;
    page.settled().await;
    assert!(page.text("#plan").await.contains("sample"), "{}", page.text("#plan").await);
    // A sample or two tell little of their error, which the plan's pilots have measured.
    assert!(page.text("#error").await.contains("by the plan"), "{}", page.text("#error").await);
    page.after("a frame after +", page.press(&['+'])).await;
    page.settled().await;
    assert!(!page.text("#error").await.contains("by the plan"), "the plan was of another camera");
    page.close().await;
}
