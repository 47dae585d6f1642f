// The page: recordings and settings in, results out.
import * as columns from "./columns.js";
import { bytes, find, make, seconds } from "./dom.js";
import { Library } from "./library.js";
import * as machine from "./machine.js";
import * as results from "./results.js";
import * as search from "./search.js";
import * as settings from "./settings.js";

const recordings = [];
let latest = 0, isReady = false;

const library = new Library(begin, fail);

function begin(about) {
    if (isReady) {
        return;
    }
    isReady = true;
    find("version").textContent = about.motorfit;
    columns.begin(about, look);
    settings.begin(about, (isOfReading) => isOfReading && look());
    machine.begin(about, () => look());
    search.begin(about, { library, given, fail, used });
    document.body.dataset.ready = about.motorfit;
}

const used = () => recordings.filter(({ isUsed }) => isUsed);
const given = () => (columns.text() ? { ...settings.given(), columns: columns.text() } : settings.given());
const asked = () => ({ keys: used().map(({ key }) => key), machine: machine.given(), settings: JSON.stringify(given()) });

// Adds files; one that the browser cannot read, such as a folder, is named and left out. A model takes the place of the machine.
async function add(files) {
    let unreadable = null;
    for (const file of files) {
        try {
            if (/\.toml$/i.test(file.name)) {
                await machine.read(file);
                continue;
            }
            recordings.push({ name: file.name, size: file.size, key: await library.add(file), isUsed: true });
        } catch (error) {
            unreadable = { path: file.name, message: `cannot be read: ${error.message}`, hint: "Choose a file, not a folder, and choose it again if it has changed." };
        }
    }
    list();
    await look();
    if (unreadable) {
        fail(unreadable);
    }
}

function list() {
    find("list").replaceChildren(...recordings.map((recording) => make("li", {},
        make("label", {}, make("input", { type: "checkbox", checked: recording.isUsed, onchange: ({ target }) => {
            recording.isUsed = target.checked;
            look();
        } }), ` ${recording.name}`),
        make("span", { className: "note", textContent: bytes(recording.size) }),
        make("button", { type: "button", textContent: "Remove", "aria-label": `Remove ${recording.name}`, onclick: () => {
            recordings.splice(recordings.indexOf(recording), 1);
            library.remove(recording.key);
            list();
            look();
        } }))));
    sections();
}

function sections() {
    find("model").hidden = recordings.length === 0 && !machine.isModel();
    find("search").hidden = recordings.length === 0 || machine.isModel();
    find("columns").hidden = recordings.length === 0;
}

// Shows the columns, and then the recordings as they are read, or what was understood of a model, unless something else was asked for
// meanwhile.
async function look(then = machine.isModel() ? "check" : "inspect") {
    latest += 1;
    sections();
    const [number, names] = [latest, used().map(({ name }) => name)];
    if (names.length === 0 && !machine.isModel()) {
        columns.show([], []);
        find("error").hidden = true;
        return;
    }
    const preview = await library.ask("preview", asked());
    if (number !== latest) {
        return;
    }
    if (!preview.error) {
        columns.show(preview.files, names, machine.isModel());
        machine.understood(preview.machine);
    }
    await run(then);
}

async function run(command) {
    latest += 1;
    const label = [used().map(({ name }) => name).join(" and "), machine.shown(), settings.shown(given(), machine.isModel() ? "" : "linear motor")].filter(Boolean);
    const number = latest;
    if (used().length === 0 && command !== "check") {
        fail({ message: "there is no recording", hint: "Choose a file, or try the example." });
        return;
    }
    busy({ identify: "Identifying …", inspect: machine.isModel() ? "Identifying each recording …" : "Reading …" }[command] ?? "Reading …");
    const answer = await library.ask(command, asked());
    if (number !== latest) {
        return;
    }
    busy("");
    find("error").hidden = true;
    if (answer.error) {
        fail(answer.error);
        find("columns").open ||= answer.error.kind === "data" && answer.error.path !== machine.given().name;
        return;
    }
    find("status").textContent = `${command === "identify" ? "Identified" : "Read"} in ${seconds(answer.milliseconds)}.`;
    results.show(answer, { command, apply: (setting, value) => apply({ setting, value }, "identify") });
    if (command === "identify") {
        results.compare(answer.document, label);
        search.follow(answer.document.with);
    }
    document.body.dataset.done = command;
}

// Sets what the library proposes.
function apply({ setting, value }, command = "inspect") {
    if (setting === "columns") {
        columns.propose(value);
        return;
    }
    settings.set(setting, value);
    look(command);
}

function busy(text) {
    find("status").textContent = text;
    find("stop").hidden = !text;
}

function fail({ message, hint, path, part, line, column, proposal }) {
    const place = [path, part, line && `line ${line}`, column && `column ${column}`].filter(Boolean).join(", ");
    find("error").replaceChildren(...place ? [make("p", { className: "place", textContent: place })] : [],
        make("p", { textContent: sentence(message) }), make("p", { textContent: hint }),
        ...proposal ? [make("p", {}, make("button", { type: "button", textContent: `Use ${proposal.setting}: ${proposal.value}`, onclick: () => apply(proposal) }))] : []);
    find("error").hidden = false;
    find("error").scrollIntoView({ block: "nearest" });
    find("result").hidden = true;
    delete document.body.dataset.done;
}

const sentence = (text) => `${text.charAt(0).toUpperCase()}${text.slice(1)}${/[.!?]$/.test(text) ? "" : "."}`;

find("files").onchange = async ({ target }) => {
    await add([...target.files]);
    target.value = "";
};
find("form").onsubmit = (event) => {
    event.preventDefault();
    run("identify");
};
find("inspect").onclick = () => look("inspect");
find("stop").onclick = () => library.stop();
// The example is read as it is: own recordings are kept and not used, and how they are read is forgotten.
find("example").onclick = async () => {
    const response = await fetch(new URL("m2-step.csv", import.meta.url));
    const file = new File([await response.blob()], "m2-step.csv");
    recordings.forEach((recording) => { recording.isUsed = false; });
    columns.set("");
    settings.clearReading();
    recordings.push({ name: file.name, size: file.size, key: await library.add(file), isUsed: true });
    list();
    await look("identify");
};
document.ondragover = (event) => {
    event.preventDefault();
    find("drop").classList.add("over");
};
document.ondragleave = () => find("drop").classList.remove("over");
document.ondrop = (event) => {
    event.preventDefault();
    find("drop").classList.remove("over");
    add([...event.dataTransfer.files]);
};

// A page that the program serves has its recordings beside it, and needs no copy for times without a network.
async function served() {
    const fetched = async (path) => {
        const response = await fetch(path);
        if (!response.ok) {
            throw new Error(await response.text());
        }
        return response;
    };
    try {
        const names = await (await fetched("recordings.json")).json();
        await add(await Promise.all(names.map(async ({ name, path }) => new File([await (await fetched(path)).blob()], name))));
    } catch (error) {
        fail({ message: `the recordings were not handed out: ${error.message}`, hint: "Start motorfit view again, or choose the files here." });
    }
}

if (document.documentElement.dataset.served !== undefined) {
    served();
} else if ("serviceWorker" in navigator && window.isSecureContext) {
    const kept = () => { find("offline").textContent = "It works without a network from now on."; };
    navigator.serviceWorker.register("service-worker.js").then(() => navigator.serviceWorker.ready).then(kept, () => {});
}
