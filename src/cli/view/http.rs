//! HTTP for the page: one request a connection, parsed by `httparse`, so that no connection waits for another.

use std::fs::File;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

/// Largest size of the head of a request \[bytes\], and its largest number of headers.
const HEAD: usize = 16 << 10;
const HEADERS_MAX: usize = 64;
/// Time in which a client must send its request, and take each part of the answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// Headers of every answer: nothing is kept, guessed, framed or read by another origin.
const HEADERS: &str = "Cache-Control: no-store\r\n\
    X-Content-Type-Options: nosniff\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n\
    Cross-Origin-Opener-Policy: same-origin\r\n\
    Referrer-Policy: no-referrer\r\n\
    Content-Security-Policy: default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' data: blob:; frame-ancestors 'self'\r\n\
    Connection: close\r\n";

/// A request.
pub(super) struct Request<'a> {
    pub method: &'a str,
    /// Path without query.
    pub path: &'a str,
    /// Host to which the client believes to speak.
    pub host: Option<&'a [u8]>,
}

/// Content of an answer.
pub(super) enum Content {
    Bytes(Vec<u8>),
    Packed(&'static [u8]),
    Recording(File),
}

/// An answer.
pub(super) struct Reply {
    status: &'static str,
    kind: &'static str,
    /// Address to which the client is sent.
    location: Option<String>,
    content: Content,
}

impl Reply {
    pub(super) fn found(kind: &'static str, content: Content) -> Self {
        Self { status: "200 OK", kind, location: None, content }
    }

    pub(super) fn moved(location: String) -> Self {
        Self { status: "303 See Other", location: Some(location), ..Self::refused(404, "") }
    }

    pub(super) fn refused(code: u16, text: &str) -> Self {
        let status = match code {
            403 => "403 Forbidden",
            405 => "405 Method Not Allowed",
            400 => "400 Bad Request",
            _ => "404 Not Found",
        };
        let content = Content::Bytes(format!("{text}\n").into_bytes());
        Self { status, kind: "text/plain; charset=utf-8", location: None, content }
    }

    /// Writes the answer, without its content for HEAD.
    fn write(self, mut stream: &TcpStream, has_content: bool) -> io::Result<()> {
        let (size, encoding) = match &self.content {
            Content::Bytes(bytes) => (bytes.len() as u64, ""),
            Content::Packed(bytes) => (bytes.len() as u64, "Content-Encoding: gzip\r\n"),
            Content::Recording(file) => (file.metadata()?.len(), ""),
        };
        let location = self.location.map_or_else(String::new, |to| format!("Location: {to}\r\n"));
        let (status, kind) = (self.status, self.kind);
        let head = format!(
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {size}\r\n{encoding}{location}{HEADERS}\r\n"
        );
        stream.write_all(head.as_bytes())?;
        match self.content {
            _ if !has_content => Ok(()),
            Content::Bytes(bytes) => stream.write_all(&bytes),
            Content::Packed(bytes) => stream.write_all(bytes),
            // A file that grows meanwhile is sent as long as it was announced.
            Content::Recording(file) => io::copy(&mut file.take(size), &mut stream).map(drop),
        }
    }
}

/// Serves one request of a connection. A client that goes away is no fault.
pub(super) fn serve(stream: TcpStream, reply: impl FnOnce(&Request<'_>) -> Reply) {
    let _ = answered(&stream, reply);
    let _ = stream.shutdown(Shutdown::Write);
    // What the client still sends is read, or it may not see the answer.
    let _ = io::copy(&mut (&stream).take(HEAD as u64), &mut io::sink());
}

fn answered(mut stream: &TcpStream, reply: impl FnOnce(&Request<'_>) -> Reply) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let (mut bytes, mut part) = (Vec::new(), [0; 4096]);
    loop {
        let count = stream.read(&mut part)?;
        bytes.extend_from_slice(&part[..count]);
        let mut headers = [httparse::EMPTY_HEADER; HEADERS_MAX];
        let mut parsed = httparse::Request::new(&mut headers);
        match parsed.parse(&bytes) {
            Ok(httparse::Status::Complete(_)) => {
                let method = parsed.method.unwrap_or_default();
                let path = parsed.path.unwrap_or_default().split(['?', '#']).next().unwrap_or_default();
                let host = parsed.headers.iter().find(|header| header.name.eq_ignore_ascii_case("host"));
                let request = Request { method, path, host: host.map(|header| header.value) };
                return reply(&request).write(stream, method != "HEAD");
            }
            Ok(httparse::Status::Partial) if count > 0 && bytes.len() < HEAD => {}
            _ => return Reply::refused(400, "not a request of HTTP/1.1").write(stream, true),
        }
    }
}
