// Keeps the page for times without a network. The name of the cache has the digest of its files.
const OWN = `motorfit-${new URL(self.registration.scope).pathname}-`;
const CACHE = `${OWN}{DIGEST}`;
const FILES = {FILES};

self.addEventListener("install", (event) => {
    event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(FILES.map((file) => new Request(file, { cache: "reload" })))).then(() => self.skipWaiting()));
});

self.addEventListener("activate", (event) => {
    const old = (names) => names.filter((name) => name.startsWith(OWN) && name !== CACHE);
    event.waitUntil(caches.keys().then((names) => Promise.all(old(names).map((name) => caches.delete(name)))).then(() => self.clients.claim()));
});

// The page itself comes from the network where there is one, so that a new version is seen; its files never change.
self.addEventListener("fetch", (event) => {
    const { request } = event;
    if (request.method !== "GET" || new URL(request.url).origin !== location.origin) {
        return;
    }
    const kept = () => caches.match(request, { ignoreSearch: true });
    const answer = request.mode === "navigate"
        ? fetch(request).catch(async () => await kept() ?? await caches.match("./"))
        : kept().then((found) => found ?? fetch(request));
    event.respondWith(answer);
});
