// The page: files and settings in, results of the worker out.
const find = (id) => document.getElementById(id);
const worker = new Worker("worker.js", { type: "module" });
const files = [];
const waiting = new Map();
let count = 0;

worker.onmessage = ({ data }) => {
    if (data.about) {
        document.body.dataset.ready = data.about.motorfit;
        return;
    }
    waiting.get(data.id)?.(data);
    waiting.delete(data.id);
};

function ask(command, settings) {
    const id = ++count;
    return new Promise((resolve) => {
        waiting.set(id, resolve);
        worker.postMessage({ id, command, files, settings });
    });
}

async function add(list) {
    for (const file of list) {
        files.push({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) });
    }
    show();
    await run("inspect");
}

function show() {
    find("list").replaceChildren(...files.map((file, n) => {
        const item = document.createElement("li");
        const remove = document.createElement("button");
        remove.type = "button";
        remove.textContent = "Remove";
        remove.setAttribute("aria-label", `Remove ${file.name}`);
        remove.onclick = () => {
            files.splice(n, 1);
            show();
        };
        item.append(`${file.name}, ${size(file.bytes.length)} `, remove);
        return item;
    }));
    find("settings-section").hidden = files.length === 0;
}

const size = (bytes) => bytes < 1e3 ? `${bytes} B` : bytes < 1e6 ? `${(bytes / 1e3).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;

function settings() {
    const form = new FormData(find("form"));
    const items = (name) => form.get(name).split(",").map((item) => item.trim()).filter(Boolean);
    return { columns: form.get("columns"), with: items("with"), fix: items("fix") };
}

let last = [];

async function run(command) {
    if (files.length === 0) {
        return;
    }
    find("status").textContent = command === "identify" ? "Identifying …" : "Reading …";
    find("error").hidden = true;
    const { answer, milliseconds } = await ask(command, settings());
    last.forEach(URL.revokeObjectURL);
    if (answer.error) {
        find("status").textContent = "";
        fail(answer.error);
        return;
    }
    find("status").textContent = `Done in ${milliseconds < 1000 ? `${milliseconds.toFixed(0)} ms` : `${(milliseconds / 1000).toFixed(1)} s`}.`;
    const url = (text, type) => URL.createObjectURL(new Blob([text], { type }));
    last = [url(JSON.stringify(answer.document, null, 2), "application/json"), url(answer.report, "text/html")];
    [find("json").href, find("html").href] = last;
    find("report").srcdoc = answer.report;
    find("result-section").hidden = false;
    find("result").textContent = command === "identify" ? "Parameters" : "Recordings as read";
    document.body.dataset.done = command;
}

function fail({ message, hint, path, part, line, column }) {
    const place = [path, part, line && `line ${line}`, column && `column ${column}`].filter(Boolean).join(", ");
    const paragraph = (text) => Object.assign(document.createElement("p"), { textContent: text });
    find("error").replaceChildren(paragraph(place ? `${place}: ${message}` : message), paragraph(hint));
    find("error").hidden = false;
    find("result-section").hidden = true;
}

find("report").onload = ({ target }) => {
    target.style.height = `${target.contentDocument.documentElement.scrollHeight}px`;
};
find("files").onchange = ({ target }) => add(target.files);
find("form").onsubmit = (event) => {
    event.preventDefault();
    run("identify");
};
find("inspect").onclick = () => run("inspect");
find("example").onclick = async () => {
    const response = await fetch("m2-step.csv");
    files.length = 0;
    files.push({ name: "m2-step.csv", bytes: new Uint8Array(await response.arrayBuffer()) });
    show();
    await run("identify");
};
document.ondragover = (event) => {
    event.preventDefault();
    find("drop").classList.add("over");
};
document.ondragleave = () => find("drop").classList.remove("over");
document.ondrop = (event) => {
    event.preventDefault();
    find("drop").classList.remove("over");
    add(event.dataTransfer.files);
};
