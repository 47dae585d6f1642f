//! Proves: in a browser, each page opens without console messages and network requests, with and without its script, fits widths
//! of 400, 800 and 1400 pixels, follows the dark scheme and prints on few pages; the script shows values, zooms all panels of a
//! figure together, hides curves and sorts tables.
//! Does not prove: that a page is beautiful.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]

use crate::support::browser::{browser, opened};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/");

fn ok(args: &[&str]) {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("motorfit"));
    command.env("XDG_CACHE_HOME", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"));
    let output = command.args(args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Writes a page of each command to a folder of its own, without script if `no_script`, and returns their paths.
fn pages(folder: &Path, no_script: bool) -> Vec<PathBuf> {
    let example = format!("{EXAMPLES}m2-step.csv");
    let log = format!("{EXAMPLES}pwm-log.csv");
    let columns = "time=ms:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=mA:mA";
    let study = folder.join("study.toml");
    let text = format!(
        "name = \"seeds\"\nrecordings = [\"{EXAMPLES}m2-step.csv\"]\nmethods = [\"gwo\"]\nseeds = \"1..3\"\n\
         population = [20]\ngenerations = [5]\n"
    );
    std::fs::write(&study, text).unwrap();
    let runs = folder.join(if no_script { "runs-plain" } else { "runs" }).display().to_string();
    let study = study.display().to_string();
    let commands: [(&str, Vec<&str>); 5] = [
        ("identify", vec!["identify", &example]),
        ("split", vec!["identify", &log, "--columns", columns, "--split", "0.7", "--with", "auto"]),
        ("inspect", vec!["inspect", &log, "--columns", columns]),
        ("compare", vec!["compare", "--preset", "paper", "--runs", "3", "--noise-records", "5"]),
        ("sweep", vec!["sweep", &study, "--out", &runs]),
    ];
    let write = |(name, mut args): (&str, Vec<&str>)| {
        let out = folder.join(format!("{name}{}", if no_script { "-plain" } else { "" }));
        let shown = out.display().to_string();
        args.extend([if name == "sweep" { "--report" } else { "--out" }, &shown]);
        if no_script {
            args.push("--no-script");
        }
        ok(&args);
        out.join("report.html")
    };
    commands.into_iter().map(write).collect()
}

/// Opens a page in frames of the given widths inside a page that runs `script` on each document as `page`, and returns the
/// values of the script.
fn asked(folder: &Path, page: &Path, widths: &[u32], script: &str, more: &[&str]) -> Vec<Value> {
    let text = std::fs::read_to_string(page).unwrap();
    let text = serde_json::to_string(&text).unwrap().replace("</", "<\\/");
    let frames = format!(
        "<!DOCTYPE html><meta charset=\"utf-8\"><meta name=\"color-scheme\" content=\"light dark\"><body><script>
        const ask = async () => {{
            const found = [];
            for (const width of {widths:?}) {{
                const frame = document.createElement('iframe');
                frame.width = width; frame.height = 900; frame.style.border = 0; frame.srcdoc = {text};
                const loaded = new Promise(done => frame.onload = done);
                document.body.append(frame);
                await loaded;
                const page = frame.contentDocument, view = frame.contentWindow;
                found.push(await (async () => {{ {script} }})());
            }}
            const shown = document.createElement('pre');
            shown.id = 'found'; shown.textContent = JSON.stringify(found);
            document.body.append(shown);
        }};
        ask().catch(error => console.error(String(error)));
        </script></body>"
    );
    let outer = folder.join("frames.html");
    std::fs::write(&outer, frames).unwrap();
    let (dom, said, outside) =
        opened(browser().unwrap(), folder, &outer, &[more, &["--window-size=1500,1000"]].concat());
    assert!(!said.contains("CONSOLE"), "{}: {said}", page.display());
    assert!(outside.is_empty(), "{outside:?}");
    let (_, rest) = dom.split_once("<pre id=\"found\">").unwrap_or_else(|| panic!("the script has not ended: {said}"));
    let found = rest.split("</pre>").next().unwrap().replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">");
    serde_json::from_str(&found).unwrap()
}

#[test]
fn pages_fit_all_widths_in_both_schemes_without_messages() {
    if browser().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // Elements that reach beyond the page, except in tables, which scroll; and colours of page, text and correlations.
    let script = "
        const wide = [...page.querySelectorAll('main *')].filter(e => !e.closest('.table') && !e.closest('svg')
            && e.getBoundingClientRect().right > view.innerWidth + 1);
        const style = view.getComputedStyle(page.body);
        const cell = page.querySelector('#correlation text');
        const narrow = [...page.querySelectorAll('svg.trace')].filter(e => e.closest('details') === null && e.clientWidth < 200);
        return { over: page.documentElement.scrollWidth - view.innerWidth, wide: wide.map(e => e.outerHTML.slice(0, 80)),
            back: style.backgroundColor, text: style.color, cell: cell && view.getComputedStyle(cell).fill,
            narrow: narrow.length, hidden: page.querySelectorAll('details:not([open])').length };";
    for no_script in [false, true] {
        for page in pages(folder.path(), no_script) {
            let text = std::fs::read_to_string(&page).unwrap();
            assert_eq!(text.contains("<script"), !no_script);
            assert_eq!(text.contains("script-src"), !no_script);
            let schemes: [(&[&str], _); 2] =
                [(&[], "rgb(255, 255, 255)"), (&["--blink-settings=preferredColorScheme=0"], "rgb(22, 24, 27)")];
            for (flags, back) in schemes {
                for found in asked(folder.path(), &page, &[400, 800, 1400], script, flags) {
                    assert!(found["over"].as_f64().unwrap() <= 0.0, "{}: {found}", page.display());
                    assert_eq!(found["wide"].as_array().unwrap().len(), 0, "{}: {found}", page.display());
                    assert_eq!(found["narrow"], 0, "{}: {found}", page.display());
                    assert_eq!(found["back"], back, "{}", page.display());
                    assert!(found["cell"].is_null() || found["cell"] == found["text"], "{found}");
                }
            }
        }
    }
    // Without the script, everything is in the page already.
    let plain = std::fs::read_to_string(folder.path().join("identify-plain/report.html")).unwrap();
    let full = std::fs::read_to_string(folder.path().join("identify/report.html")).unwrap();
    let body = |page: &str| {
        let main = page.split("<main>").nth(1).unwrap();
        main.split("<h2>Reproduction").next().unwrap().to_owned()
    };
    assert_eq!(body(&plain), body(&full));
}

#[test]
fn a_page_is_printed_on_few_sheets() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("identify").display().to_string();
    ok(&["identify", &format!("{EXAMPLES}m2-step.csv"), "--out", &out]);
    let sheet = folder.path().join("page.pdf");
    let flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"];
    let to = [format!("--print-to-pdf={}", sheet.display()), format!("file://{out}/report.html")];
    let profile = format!("--user-data-dir={}", folder.path().join("profile").display());
    assert!(Command::new(browser).args(flags).arg(profile).args(to).output().unwrap().status.success());
    let text = String::from_utf8_lossy(&std::fs::read(&sheet).unwrap()).into_owned();
    let sheets = text.matches("/Type /Page\n").count();
    assert!((1..=3).contains(&sheets), "{sheets} sheets");
}

/// Runs a script on the page of the example at a width of 800 pixels and returns its value.
fn acted(script: &str) -> Value {
    acted_on(&["identify", &format!("{EXAMPLES}m2-step.csv")], "page.querySelector('figure.traces')", script)
}

/// Runs `script` on the page of a command, with the actions on the figure that `figure` finds.
fn acted_on(command: &[&str], figure: &str, script: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    ok(&[command, &["--out", out.to_str().unwrap()]].concat());
    let script = format!("const figure = {figure};{ACTIONS}{script}");
    asked(folder.path(), &out.join("report.html"), &[800], &script, &[]).remove(0)
}

/// Functions for scripts that act on a page: a pointer on the panels of a figure, and what they show.
const ACTIONS: &str = "
    const panels = [...figure.querySelectorAll('svg.trace')];
    const point = (kind, part, panel = panels[0]) => {
        const box = panel.getBoundingClientRect();
        panel.dispatchEvent(new view.PointerEvent(kind, { clientX: box.left + part * box.width, clientY: box.top + 20,
            bubbles: true, button: 0, pointerType: 'mouse' }));
    };
    const boxes = () => panels.map(panel => panel.querySelector('.curves').getAttribute('viewBox').split(' ').map(Number));
    const labels = () => [...panels[panels.length - 1].querySelectorAll('.ticks .x')].map(e => Number(e.textContent.replace('\u{2212}', '-')));
    const press = name => [...figure.querySelectorAll('button')].find(e => e.title === name || e.textContent.trim() === name).click();";

#[test]
fn the_script_shows_values_and_zooms_all_panels_together() {
    if browser().is_none() {
        return;
    }
    let script = "
        const found = { whole: boxes() };
        point('pointermove', 0.5);
        found.values = [...figure.querySelectorAll('output')].map(e => e.textContent);
        point('pointerleave', 0.5);
        found.left = [...figure.querySelectorAll('output')].map(e => e.textContent).join('');
        point('pointerdown', 1 / 3); point('pointermove', 0.36); point('pointerup', 0.36);
        found.zoomed = boxes(); found.labels = labels();
        panels[0].dispatchEvent(new view.MouseEvent('dblclick', { bubbles: true }));
        found.again = boxes();
        press('Zoom in'); found.closer = boxes(); press('Move right'); found.later = boxes(); press('Zoom out'); press('Reset');
        found.reset = boxes();
        return found;";
    let found = acted(script);
    let boxes = |name: &str| -> Vec<[f64; 4]> { serde_json::from_value(found[name].clone()).unwrap() };
    let whole = [[0.0, 0.0, 1000.0, 200.0]; 5];
    assert_eq!(boxes("whole"), whole);
    // In the middle, at 1.5 s, the voltage is 10.5 V, and the simulated motor has a current of 1.18 A and a speed of 128.1 rad/s.
    let values: Vec<String> = serde_json::from_value(found["values"].clone()).unwrap();
    let number_after = |text: &str, name: &str| -> f64 {
        let (_, rest) = text.split_once(name).unwrap_or_else(|| panic!("{text}"));
        rest.trim_start_matches([':', ' ']).split([',', ' ', ':']).next().unwrap().parse().unwrap()
    };
    assert!((number_after(&values[0], "time") - 1.5).abs() < 2e-3, "{values:?}");
    assert!((number_after(&values[0], ": ") - 10.5).abs() < 0.02, "{values:?}");
    // A pixel of the drawing is 0.05 A and 0.7 rad/s; coordinates have a hundredth of it.
    assert!((number_after(&values[1], "model") - 1.18).abs() < 0.02, "{values:?}");
    assert!((number_after(&values[2], "model") - 128.1).abs() < 0.5, "{values:?}");
    assert!((number_after(&values[2], "measured") - 128.1).abs() < 5.0, "{values:?}");
    assert_eq!(found["left"], "");
    // The zoomed range is that of the pointer in all panels, the ordinates follow the curves.
    for [x, y, width, height] in boxes("zoomed") {
        assert!((x - 1000.0 / 3.0).abs() < 2.0 && (width - 26.7).abs() < 2.0, "{x} {width}");
        assert!(height > 0.0 && y.is_finite());
    }
    let labels: Vec<f64> = serde_json::from_value(found["labels"].clone()).unwrap();
    assert!(labels.len() >= 3 && labels.iter().all(|t| (0.99..1.09).contains(t)), "{labels:?}");
    assert_eq!((boxes("again"), boxes("reset")), (whole.to_vec(), whole.to_vec()));
    assert!(boxes("closer").iter().all(|[x, _, width, _]| (x - 250.0).abs() < 1e-6 && (width - 500.0).abs() < 1e-6));
    assert!(boxes("later").iter().all(|[x, _, width, _]| (x - 375.0).abs() < 1e-6 && (width - 500.0).abs() < 1e-6));
}

#[test]
fn the_script_hides_curves_and_sorts_tables() {
    if browser().is_none() {
        return;
    }
    let script = "
        const found = {};
        const shown = name => [...figure.querySelectorAll(`path[data-name=${name}]`)].map(e => view.getComputedStyle(e).display);
        const pressed = () => [...figure.querySelectorAll('.legend button')].map(e => e.getAttribute('aria-pressed'));
        found.before = [shown('measured'), shown('model'), pressed()];
        press('measured'); found.without = [shown('measured'), shown('model'), pressed()];
        press('measured'); found.after = [shown('measured'), shown('model'), pressed()];
        const table = [...page.querySelectorAll('table')].find(e => e.caption.textContent === 'Parameters');
        const head = table.tHead.rows[0].cells[1];
        const order = () => [...table.tBodies[0].rows].map(row => row.cells[0].textContent[0]).join('');
        found.orders = [order()];
        for (let n = 0; n < 3; n++) { head.querySelector('button').click(); found.orders.push(order(), head.getAttribute('aria-sort')); }
        return found;";
    let found = acted(script);
    let all = |of: &Value, display: &str| {
        of.as_array().unwrap().iter().all(|v| v == display) && !of.as_array().unwrap().is_empty()
    };
    for (state, measured, pressed) in
        [("before", "inline", "true"), ("without", "none", "false"), ("after", "inline", "true")]
    {
        assert!(all(&found[state][0], measured) && all(&found[state][1], "inline"), "{found}");
        assert_eq!(found[state][2], serde_json::json!([pressed, "true"]), "{state}");
    }
    // J 1.4e-4, B 6.8e-4, L 7.8e-3, K 0.073, R 0.92; the third click restores the order of the parameters.
    assert_eq!(
        found["orders"],
        serde_json::json!(["RLKBJ", "JBLKR", "ascending", "RKLBJ", "descending", "RLKBJ", null])
    );
}

/// The charts of a comparison: curves over a logarithmic axis, panels with axes of their own, and boxes in rows.
#[test]
fn the_script_shows_values_of_logarithms_and_zooms_panels_apart() {
    if browser().is_none() {
        return;
    }
    let command = ["compare", "--runs", "4", "--generations", "20", "--noise-records", "5"];
    let script = "
        const found = { labels: [...panels[0].querySelectorAll('.ticks .y')].map(e => e.textContent) };
        point('pointermove', 1);
        found.value = figure.querySelector('output').textContent;
        const cells = [...page.querySelectorAll('table')].find(e => e.caption.textContent.startsWith('Cost')).tBodies[0].rows;
        found.medians = [...cells].slice(0, 3).map(row => [row.cells[0].textContent, Number(row.cells[2].textContent)]);
        const beside = page.getElementById('block1-distributions'), own = [...beside.querySelectorAll('svg.trace')];
        const views = () => own.map(e => e.querySelector('.curves').getAttribute('viewBox').split(' ').map(Number));
        point('pointerdown', 0.25, own[1]); point('pointermove', 0.5, own[1]); point('pointerup', 0.5, own[1]);
        found.apart = views().map(view => view[2]);
        const boxes_of = page.getElementById('block1-errors').querySelector('svg.trace');
        found.names = [...boxes_of.querySelectorAll('text.row')].map(e => e.textContent);
        found.high = boxes_of.clientHeight;
        return found;";
    let found = acted_on(&command, "page.getElementById('block1-convergence')", script);
    let labels: Vec<String> = serde_json::from_value(found["labels"].clone()).unwrap();
    assert!(
        labels.len() >= 2 && labels.iter().all(|label| label.starts_with("10") || label.starts_with('0')),
        "{labels:?}"
    );
    // At the right end, the values under the pointer are the medians of the table; a hundredth of a pixel is 0.01 %.
    let text = found["value"].as_str().unwrap();
    assert!(text.starts_with("generation 20"), "{text}");
    for row in found["medians"].as_array().unwrap() {
        let (name, median) = (row[0].as_str().unwrap(), row[1].as_f64().unwrap());
        let shown: f64 = text
            .split(&format!(" {name} "))
            .nth(1)
            .unwrap()
            .split(',')
            .next()
            .unwrap()
            .replace('\u{2212}', "-")
            .parse()
            .unwrap();
        assert!((shown / median - 1.0).abs() < 0.01, "{name}: {shown}, {median}");
    }
    // Panels with axes of their own are zoomed one by one.
    let apart: Vec<f64> = serde_json::from_value(found["apart"].clone()).unwrap();
    assert!((apart[1] - 250.0).abs() < 2.0, "{apart:?}");
    assert!([apart[0], apart[2], apart[3]].iter().all(|width| (width - 1000.0).abs() < 1e-9), "{apart:?}");
    assert_eq!(found["names"], serde_json::json!(["gwo", "jaya", "ga", "sm"]));
    assert_eq!(found["high"], 4 * 46, "a row for each box");
}

#[test]
fn masked_outliers_do_not_widen_the_bands_and_leave_no_residual() {
    use motorfit::report::Recorded;
    use motorfit::report::figures::{residual_correlations, response_charts};
    use motorfit::setting::Setting;
    use motorfit::settings::{Given, Value, reading};
    let text = std::fs::read_to_string(format!("{EXAMPLES}m2-step.csv")).unwrap();
    let damaged = text.lines().enumerate().map(|(n, line)| match (n, line.rsplit_once(',')) {
        (900 | 2400, Some((rest, _))) => format!("{rest},99999\n"),
        _ => format!("{line}\n"),
    });
    let damaged: String = damaged.collect();
    let mut given = Given::default();
    given.put(Setting::Mask, Value::List(vec!["auto".to_owned()]));
    let record = reading(&given).unwrap().records_from_bytes(damaged.as_bytes(), None).unwrap().remove(0);
    let records = [record];
    let found = motorfit::identify::identify(&records, &Default::default()).unwrap();
    let modelled = found.modelled(&records).unwrap();
    let recorded = Recorded::from(&records[0]);
    let [complete, _] = response_charts("a", &recorded, &[("model", &modelled[0])], &[]);
    // The noise of the speed is 1.04 rad/s; with the outliers the band would be ±5000 rad/s.
    let speed = complete.panels.iter().find(|panel| panel.label == "speed [rad/s]").unwrap();
    let motorfit::report::Band::Half(band) = speed.series[1].band else { panic!("{:?}", speed.series[1].band) };
    assert!((band / (1.96 * 1.04) - 1.0).abs() < 0.05, "{band}");
    let left = complete.panels.last().unwrap().series[0].points.iter().filter(|(_, y)| y.is_nan()).count();
    assert_eq!(left, 2);
    assert!(complete.caption.contains("Excluded samples have no residual"));
    // The correlations are those of the noise: 99 % of the lags are within the limits.
    let of = residual_correlations("b", &recorded, &modelled[0], &[]).unwrap();
    for panel in of.panels {
        let outside = panel.series[0].points.iter().filter(|(_, r)| r.abs() > panel.limits[1][1]).count();
        assert!(outside <= 3, "{}: {outside}", panel.label);
    }
    // A segment that was excluded automatically has no residual either.
    let [complete, _] = response_charts("a", &recorded, &[("model", &modelled[0])], &[[0.1, 0.2]]);
    let left = complete.panels.last().unwrap().series[0].points.iter().filter(|(_, y)| y.is_nan()).count();
    assert!((102..=104).contains(&left), "{left}");
}

#[test]
fn the_policy_blocks_everything_else() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    ok(&["identify", &format!("{EXAMPLES}m2-step.csv"), "--out", path("identify").to_str().unwrap()]);
    let page = std::fs::read_to_string(path("identify").join("report.html")).unwrap();
    // An external image and another script are blocked, with console messages; without the policy the image is requested.
    for foreign in ["<img src=\"http://example.invalid/x.png\">", "<script>document.title = \"changed\"</script>"] {
        let evil = page.replace("<main>", &format!("<main>{foreign}"));
        std::fs::write(path("evil.html"), &evil).unwrap();
        let (dom, said, outside) = opened(browser, folder.path(), &path("evil.html"), &[]);
        assert!(said.contains("CONSOLE") && outside.is_empty(), "{said} {outside:?}");
        assert!(!dom.contains("<title>changed"));
        std::fs::write(path("open.html"), evil.replace("http-equiv=\"Content-Security-Policy\"", "")).unwrap();
        let (dom, _, outside) = opened(browser, folder.path(), &path("open.html"), &[]);
        assert!(
            outside.iter().any(|url| url.contains("example.invalid")) || dom.contains("<title>changed"),
            "{outside:?}"
        );
    }
}
