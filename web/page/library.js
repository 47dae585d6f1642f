// The library in its worker: questions and answers, and the files that it holds.
export class Library {
    constructor(onReady, onFailure) {
        this.onReady = onReady;
        this.onFailure = onFailure;
        this.files = new Map();
        this.count = 0;
        this.start();
    }

    start() {
        this.waiting = new Map();
        this.worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
        this.worker.onmessage = ({ data: { about, failure, id, answer, progress, milliseconds } }) => {
            const asked = this.waiting.get(id);
            if (about) {
                this.onReady(about);
            } else if (failure) {
                this.fail(failure);
            } else if (progress) {
                asked?.tell?.(progress);
            } else {
                this.waiting.delete(id);
                asked?.resolve({ ...answer, milliseconds });
                if (answer.isBroken) {
                    this.stop();
                }
            }
        };
        this.worker.onerror = ({ message }) => this.fail(message || "its worker does not start");
        // A question waits for the files that were there before it.
        this.sent = Promise.allSettled([...this.files].map(([key, file]) => this.send(key, file)));
    }

    // The library cannot be loaded: all questions end.
    fail(message) {
        this.failure = { message: `the library cannot be loaded: ${message}`, hint: "Reload the page. The browser needs WebAssembly with SIMD, as all have since 2023." };
        this.onFailure(this.failure);
        this.end(this.failure);
    }

    // Answers all questions with an error.
    end(error) {
        const waiting = [...this.waiting.values()];
        this.waiting.clear();
        waiting.forEach(({ resolve }) => resolve({ error }));
    }

    // Ends what runs, which the library itself cannot.
    stop() {
        this.worker.terminate();
        const waiting = [...this.waiting.values()];
        this.start();
        waiting.forEach(({ resolve }) => resolve({ error: { message: "stopped", hint: "Nothing was changed." } }));
    }

    async ask(command, given = {}, tell = null) {
        await this.sent;
        return this.post(command, given, tell);
    }

    post(command, given, tell = null, transfer = []) {
        if (this.failure) {
            return Promise.resolve({ error: this.failure });
        }
        this.count += 1;
        const id = this.count;
        return new Promise((resolve) => {
            this.waiting.set(id, { resolve, tell });
            this.worker.postMessage({ id, command, ...given }, transfer);
        });
    }

    tellToStop() {
        this.worker.postMessage({ command: "stop" });
    }

    async send(key, file) {
        const bytes = new Uint8Array(await file.arrayBuffer());
        await this.post("add", { key, name: file.name, bytes }, null, [bytes.buffer]);
    }

    // Adds a file and returns its key; fails if the browser cannot read it.
    async add(file) {
        this.count += 1;
        const key = this.count;
        await this.send(key, file);
        this.files.set(key, file);
        return key;
    }

    remove(key) {
        this.files.delete(key);
        return this.ask("remove", { key });
    }
}
