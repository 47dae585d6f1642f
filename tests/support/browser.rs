//! A headless browser that opens pages.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]

use std::path::Path;
use std::process::Command;

/// Returns a browser; `None` if there is none and skips are allowed.
pub fn browser() -> Option<&'static str> {
    let found = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success()));
    assert!(found.is_some() || std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no Chromium to open pages with");
    if found.is_none() {
        println!("SKIPPED: no Chromium");
    }
    found
}

/// Opens a page with more flags of the browser and returns its DOM, the console messages, and the network requests except those of the browser itself.
pub fn opened(browser: &str, folder: &Path, page: &Path, more: &[&str]) -> (String, String, Vec<String>) {
    let (log, profile) = (folder.join("net.json"), tempfile::tempdir_in(folder).unwrap());
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--enable-logging=stderr", "--dump-dom", "--virtual-time-budget=5000"])
        .args(more)
        .args([
            format!("--user-data-dir={}", profile.path().display()),
            format!("--log-net-log={}", log.display()),
            format!("file://{}", page.display()),
        ])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let asked = std::fs::read_to_string(&log).unwrap();
    let urls = asked.split("\"url\":\"").skip(1).map(|rest| rest.split('"').next().unwrap().to_owned());
    let host = |url: &str| url.split('/').nth(2).unwrap_or_default().to_owned();
    let own = |url: &String| host(url).ends_with(".google.com") || host(url).ends_with(".googleapis.com");
    let outside = urls.filter(|url| url.starts_with("http") || url.starts_with("ws")).filter(|url| !own(url)).collect();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr), outside)
}
