// The form of the settings, made from the library's table. Its state is part of the page's address, without columns.
import { find, make, option } from "./dom.js";

// Settings that have their own place in the page.
const APART = ["columns", "with"];
const fields = new Map();
let kinds = new Map(), reading = [], extensions = [], listed = "";

export function begin(about, changed) {
    kinds = new Map(about.settings.map(({ name, kind }) => [name, kind]));
    reading = about.settings.filter(({ topic }) => topic === "Recording").map(({ name }) => name);
    const topics = new Map();
    for (const setting of about.settings.filter(({ name }) => !APART.includes(name))) {
        topics.set(setting.topic, [...topics.get(setting.topic) ?? [], setting]);
    }
    find("fields").replaceChildren(...[...topics].flatMap(([topic, settings]) => [
        make("h3", { textContent: topic }), make("div", { className: "group" }, ...settings.map(field)),
    ]));
    extensions = about.extensions;
    terms(null);
    restore();
    lock();
    find("form").oninput = () => {
        lock();
        save();
    };
    find("form").onchange = ({ target }) => changed(reading.includes(target.name));
}

function field({ name, kind, choices, default: usual, example, text }) {
    const note = make("small", { textContent: text, id: `about-${name}` });
    const described = { name, "aria-describedby": note.id };
    if (kind === "switch") {
        const input = make("input", { type: "checkbox", ...described });
        fields.set(name, input);
        return make("label", { className: "field check" }, input, ` ${name} `, note);
    }
    const input = kind === "choice"
        ? make("select", described, option("", usual ? `${usual} (usual)` : ""), ...choices.filter((of) => of.name !== usual).map((of) => option(of.name, of.name, { title: of.text })))
        : make("input", { placeholder: usual ? `${usual} (usual)` : `such as ${example}`, autocomplete: "off", spellcheck: false, ...described });
    fields.set(name, input);
    return make("label", { className: "field" }, name, input, note);
}

// Lists the terms of a model by their names; without names, the extensions of the DC motor.
export function terms(names) {
    const list = names?.map((name) => ({ name, text: "" })) ?? extensions;
    if (listed !== JSON.stringify(list)) {
        listed = JSON.stringify(list);
        find("extension-list").replaceChildren(...list.map(({ name, text }) => make("label", { title: text },
            make("input", { type: "checkbox", name: "extension", value: name }), text ? ` ${name}: ${text.split(";")[0]}` : ` ${name}`)));
    }
}

const chosen = () => [...document.querySelectorAll('[name="extension"]:checked')].map(({ value }) => value);
const mode = () => find("form").elements.extensions.value;

// The list of extensions is shown if it counts.
function lock() {
    find("extension-list").hidden = mode() !== "these";
}

// Returns the settings that were given, as the library takes them.
export function given() {
    const all = {};
    for (const [name, input] of fields) {
        const value = converted(name, input.type === "checkbox" ? input.checked : input.value.trim());
        if (value !== "" && value !== false && value.length !== 0) {
            all[name] = value;
        }
    }
    const extensions = mode() === "these" ? chosen() : mode() ? [mode()] : [];
    return extensions.length === 0 ? all : { ...all, with: extensions };
}

function converted(name, value) {
    const kind = kinds.get(name);
    if (kind === "list") {
        return value.split(",").map((item) => item.trim()).filter(Boolean);
    }
    const number = Number(value);
    return (kind === "number" || kind === "count") && value !== "" && Number.isFinite(number) ? number : value;
}

// Sets a setting to a value as a text.
export function set(name, value) {
    if (name === "with") {
        const names = value.split(",");
        const mode = value === "auto" || value === "" ? value : "these";
        document.querySelectorAll('[name="extensions"]').forEach((radio) => { radio.checked = radio.value === mode; });
        document.querySelectorAll('[name="extension"]').forEach((box) => { box.checked = names.includes(box.value); });
    } else if (fields.get(name)?.type === "checkbox") {
        fields.get(name).checked = value === "true";
    } else if (fields.has(name)) {
        fields.get(name).value = value;
    }
    lock();
    save();
}

// Forgets how recordings are to be read.
export function clearReading() {
    reading.filter((name) => fields.has(name)).forEach((name) => set(name, ""));
}

// Forgets all settings but how recordings are to be read: those of one machine mean nothing for another.
export function clear() {
    [...fields.keys()].filter((name) => !reading.includes(name)).forEach((name) => set(name, ""));
    set("with", "");
}

// Writes the settings to the address. Columns are left out: headings belong to a recording.
function save() {
    const text = new URLSearchParams(Object.entries(given()).map(([name, value]) => [name, String(value)])).toString();
    history.replaceState(null, "", text ? `#${text}` : location.pathname);
}

function restore() {
    for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
        set(name, value);
    }
}

// Returns the settings in a few words.
export function shown(settings, usual) {
    const rest = Object.entries(settings).filter(([name]) => name !== "columns");
    return rest.length === 0 ? usual : rest.map(([name, value]) => value === true ? name : `${name} ${value}`).join("; ");
}
