//! The command `view`: the page with recordings, served on the loopback address. The page computes; the program only hands out its files
//! and the recordings that were named, to those who know the token in the address.

use super::args::ViewArgs;
use super::prelude::*;
use std::cell::Cell;
use std::collections::HashMap;
use std::fs::File;
use std::hash::{BuildHasher, RandomState};
use std::io::Cursor;
use std::path::PathBuf;
use std::time::Duration;
use tiny_http::{Header, Method, Request, Response, Server};

/// Files of the page by their names; those that end in `.gz` are compressed. Empty in a program that was built without the page.
const PAGE: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/page.rs"));
/// Time between two checks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(100);
/// Headers of every answer: nothing is kept, guessed, framed or read by another origin.
const HEADERS: [(&str, &str); 6] = [
    ("Cache-Control", "no-store"),
    ("X-Content-Type-Options", "nosniff"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Referrer-Policy", "no-referrer"),
    // The page has a policy of its own; this one holds for its worker too.
    (
        "Content-Security-Policy",
        "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' data: blob:; frame-ancestors 'self'",
    ),
];

pub(super) fn run(args: &ViewArgs, style: &Style) -> Result<Outcome> {
    if PAGE.is_empty() {
        let hint =
            "Use the prebuilt program, or build the page with web/build and the program with MOTORFIT_PAGE=dist/web.";
        return Err(Error::usage("this program was built without the page", hint));
    }
    for path in &args.records {
        opened(path)?;
    }
    let view = View::new(args.records.clone())?;
    let address = view.address();
    data(&format!("{address}\n"))?;
    if !args.no_open
        && let Err(error) = open::that_detached(view.ticket())
    {
        style.note(&format!("no browser could be started ({error}): open the address in one"));
    }
    style.note("Ctrl-C ends it");
    while !signals::is_interrupted() {
        match view.server.recv_timeout(LOOK) {
            // A reader that went away is no fault.
            Ok(Some(request)) => drop(view.answer(request)),
            Ok(None) => {}
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

/// The server with its secret.
struct View {
    server: Server,
    port: u16,
    /// Part of the address that only its reader knows.
    token: String,
    /// Part of an address that leads to the page once, for the command line of the browser, which others on this machine may see.
    ticket: String,
    is_used: Cell<bool>,
    records: Vec<PathBuf>,
    /// Content of the page's files, with their names.
    files: HashMap<&'static str, &'static [u8]>,
}

/// Content of an answer.
enum Content {
    Bytes(Vec<u8>),
    Packed(&'static [u8]),
    Recording(File),
}

impl View {
    fn new(records: Vec<PathBuf>) -> Result<Self> {
        let server = Server::http("127.0.0.1:0").map_err(|error| unserved(&error))?;
        let port = server.server_addr().to_ip().map_or(0, |address| address.port());
        // The keys of a hash state are random numbers of the system.
        let secret = || {
            let half = || RandomState::new().hash_one(port);
            format!("{:016x}{:016x}", half(), half())
        };
        let (token, ticket, files) = (secret(), secret(), PAGE.iter().copied().collect());
        Ok(Self { server, port, token, ticket, is_used: Cell::new(false), records, files })
    }

    fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// Returns the address that leads to the page once.
    fn ticket(&self) -> String {
        format!("http://127.0.0.1:{}/{}", self.port, self.ticket)
    }

    /// Answers a request: 405 for a method that changes anything, 403 for another host, 404 without the token.
    fn answer(&self, request: Request) -> std::io::Result<()> {
        let host = format!("127.0.0.1:{}", self.port);
        let is_own = request.headers().iter().any(|h| h.field.equiv("Host") && h.value.as_str() == host);
        let path = request.url().split(['?', '#']).next().unwrap_or_default();
        if is_own && path.strip_prefix('/') == Some(self.ticket.as_str()) && !self.is_used.replace(true) {
            let to = Header::from_bytes("Location", format!("/{}/", self.token)).ok();
            let headers =
                HEADERS.into_iter().filter_map(|(name, value)| Header::from_bytes(name, value).ok()).chain(to);
            return request.respond(Response::new(303.into(), headers.collect(), std::io::empty(), Some(0), None));
        }
        let (code, kind, content) = match path.strip_prefix(&format!("/{}/", self.token)) {
            _ if !matches!(request.method(), Method::Get | Method::Head) => refused(405, "only GET and HEAD"),
            _ if !is_own => refused(403, "another host"),
            None => refused(404, "not found: the address of motorfit view has a token"),
            Some(name) => self.content(name),
        };
        let header = |(name, value): (&str, &str)| Header::from_bytes(name, value).ok();
        let mut headers: Vec<Header> = HEADERS.into_iter().chain([("Content-Type", kind)]).filter_map(header).collect();
        match content {
            Content::Bytes(bytes) => {
                let size = bytes.len();
                request.respond(Response::new(code.into(), headers, Cursor::new(bytes), Some(size), None))
            }
            Content::Packed(bytes) => {
                headers.extend(header(("Content-Encoding", "gzip")));
                request.respond(Response::new(code.into(), headers, Cursor::new(bytes), Some(bytes.len()), None))
            }
            Content::Recording(file) => request.respond(Response::new(code.into(), headers, file, None, None)),
        }
    }

    /// Returns the code, the media type and the content for a name below the token.
    fn content(&self, name: &str) -> (u16, &'static str, Content) {
        if name.is_empty() || name == "index.html" {
            let page = String::from_utf8_lossy(self.files.get("index.html").copied().unwrap_or_default());
            // The page looks for its recordings beside it.
            let page = page.replacen("<html lang=\"en\">", "<html lang=\"en\" data-served>", 1);
            return (200, media_type("index.html"), Content::Bytes(page.into_bytes()));
        }
        if name == "recordings.json" {
            return (200, "application/json", Content::Bytes(self.list().into_bytes()));
        }
        if let Some(number) = name.strip_prefix("recordings/") {
            let record = number.parse::<usize>().ok().and_then(|number| self.records.get(number));
            return match record.map(|path| opened(path)) {
                Some(Ok(file)) => (200, "application/octet-stream", Content::Recording(file)),
                Some(Err(error)) => refused(404, &error.to_string()),
                None => refused(404, "no such recording"),
            };
        }
        if let Some(bytes) = self.files.get(format!("{name}.gz").as_str()) {
            return (200, media_type(name), Content::Packed(bytes));
        }
        match self.files.get(name) {
            Some(bytes) => (200, media_type(name), Content::Bytes(bytes.to_vec())),
            None => refused(404, "no such file"),
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

fn refused(code: u16, text: &str) -> (u16, &'static str, Content) {
    (code, "text/plain; charset=utf-8", Content::Bytes(format!("{text}\n").into_bytes()))
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
