//! The command `view`: the page with recordings, served on the loopback address. The page computes; the program only hands out its files
//! and the recordings that were named, to those who know the token in the address.

mod http;

use super::args::ViewArgs;
use super::prelude::*;
use http::{Content, Reply, Request};
use std::collections::HashMap;
use std::fs::File;
use std::hash::{BuildHasher, RandomState};
use std::io::ErrorKind;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Files of the page by their names; those that end in `.gz` are compressed. Empty in a program that was built without the page.
const PAGE: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/page.rs"));
/// Time between two looks for connections and for Ctrl-C.
const LOOK: Duration = Duration::from_millis(10);

pub(super) fn run(args: &ViewArgs, style: &Style) -> Result<Outcome> {
    if PAGE.is_empty() {
        let hint =
            "Use the prebuilt program, or build the page with web/build and the program with MOTORFIT_PAGE=dist/web.";
        return Err(Error::usage("this program was built without the page", hint));
    }
    for path in &args.records {
        opened(path)?;
    }
    let listener = TcpListener::bind("127.0.0.1:0").map_err(|error| unserved(&error))?;
    listener.set_nonblocking(true).map_err(|error| unserved(&error))?;
    let port = listener.local_addr().map_err(|error| unserved(&error))?.port();
    let view = Arc::new(View::new(port, args.records.clone()));
    data(&format!("{}\n", view.address()))?;
    if !args.no_open
        && let Err(error) = open::that_detached(view.ticket())
    {
        style.note(&format!("no browser could be started ({error}): open the address in one"));
    }
    style.note("Ctrl-C ends it");
    while !signals::is_interrupted() {
        match listener.accept() {
            Ok((stream, _)) => {
                let view = view.clone();
                // A connection that cannot be served is closed; the browser asks again.
                let _ = std::thread::Builder::new().spawn(move || http::serve(stream, |request| view.reply(request)));
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(LOOK),
            // A connection that ended before it was accepted is no fault of the server.
            Err(error) if error.kind() == ErrorKind::ConnectionAborted => {}
            Err(error) => return Err(unserved(&error)),
        }
    }
    Ok(Outcome::Done)
}

fn unserved(error: &dyn std::fmt::Display) -> Error {
    Error::data(format!("the page cannot be served: {error}"), "Check that programs may listen on 127.0.0.1.")
}

/// Opens a recording, and refuses a folder.
fn opened(path: &Path) -> Result<File> {
    let unreadable = |error: &dyn std::fmt::Display| {
        Error::data(format!("cannot be read: {error}"), "Check the path and its permissions.").in_file(path)
    };
    let file = File::open(path).map_err(|error| unreadable(&error))?;
    match file.metadata() {
        Ok(facts) if facts.is_file() => Ok(file),
        // A pipe could be read once, and the page may ask again.
        Ok(_) => Err(unreadable(&"it is no file, expected a recording")),
        Err(error) => Err(unreadable(&error)),
    }
}

/// The page, its recordings and its secrets.
struct View {
    port: u16,
    /// Part of the address that only its reader knows.
    token: String,
    /// Part of an address that leads to the page once, for the command line of the browser, which others on this machine may see.
    ticket: String,
    is_used: AtomicBool,
    records: Vec<PathBuf>,
    /// Content of the page's files, with their names.
    files: HashMap<&'static str, &'static [u8]>,
}

impl View {
    fn new(port: u16, records: Vec<PathBuf>) -> Self {
        // The keys of a hash state are random numbers of the system.
        let secret = || {
            let half = || RandomState::new().hash_one(port);
            format!("{:016x}{:016x}", half(), half())
        };
        let (token, ticket, files) = (secret(), secret(), PAGE.iter().copied().collect());
        Self { port, token, ticket, is_used: AtomicBool::new(false), records, files }
    }

    fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// Returns the address that leads to the page once.
    fn ticket(&self) -> String {
        format!("http://127.0.0.1:{}/{}", self.port, self.ticket)
    }

    /// Answers a request: 405 for a method that changes anything, 403 for another host, 404 without the token.
    fn reply(&self, request: &Request<'_>) -> Reply {
        if !matches!(request.method, "GET" | "HEAD") {
            return Reply::refused(405, "only GET and HEAD");
        }
        if request.host != Some(format!("127.0.0.1:{}", self.port).as_bytes()) {
            return Reply::refused(403, "another host");
        }
        if request.path.strip_prefix('/') == Some(self.ticket.as_str()) && !self.is_used.swap(true, Ordering::Relaxed) {
            return Reply::moved(format!("/{}/", self.token));
        }
        match request.path.strip_prefix(&format!("/{}/", self.token)) {
            None => Reply::refused(404, "not found: the address of motorfit view has a token"),
            Some(name) => self.content(name),
        }
    }

    /// Returns the content for a name below the token.
    fn content(&self, name: &str) -> Reply {
        if name.is_empty() || name == "index.html" {
            let page = String::from_utf8_lossy(self.files.get("index.html").copied().unwrap_or_default());
            // The page looks for its recordings beside it.
            let page = page.replacen("<html lang=\"en\">", "<html lang=\"en\" data-served>", 1);
            return Reply::found(media_type("index.html"), Content::Bytes(page.into_bytes()));
        }
        if name == "recordings.json" {
            return Reply::found("application/json", Content::Bytes(self.list().into_bytes()));
        }
        if let Some(number) = name.strip_prefix("recordings/") {
            let record = number.parse::<usize>().ok().and_then(|number| self.records.get(number));
            return match record.map(|path| opened(path)) {
                Some(Ok(file)) => Reply::found("application/octet-stream", Content::Recording(file)),
                Some(Err(error)) => Reply::refused(404, &error.to_string()),
                None => Reply::refused(404, "no such recording"),
            };
        }
        if let Some(bytes) = self.files.get(format!("{name}.gz").as_str()) {
            return Reply::found(media_type(name), Content::Packed(bytes));
        }
        match self.files.get(name) {
            Some(bytes) => Reply::found(media_type(name), Content::Bytes(bytes.to_vec())),
            None => Reply::refused(404, "no such file"),
        }
    }

    /// Returns the names of the recordings and the addresses of their bytes, as JSON.
    fn list(&self) -> String {
        let one = |(n, path): (usize, &PathBuf)| {
            let name = path.file_name().map_or_else(|| path.to_string_lossy(), |name| name.to_string_lossy());
            serde_json::json!({ "name": name, "path": format!("recordings/{n}") })
        };
        serde_json::Value::from(self.records.iter().enumerate().map(one).collect::<Vec<_>>()).to_string()
    }
}

fn media_type(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "wasm" => "application/wasm",
        "json" => "application/json",
        _ => "text/plain; charset=utf-8",
    }
}
