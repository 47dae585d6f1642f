// The machine: the DC motor, a built-in model, or a text of the reader's own.
import { find, option, printed } from "./dom.js";
import * as settings from "./settings.js";

// The value of the menu for a text of the reader's own, which no model has as its name.
const OWN = "machine.toml";
let texts = new Map(), name = OWN, url = null, onChange = () => {};

export function begin(about, changed) {
    texts = new Map(about.models.map((of) => [of.name, of.text]));
    onChange = changed;
    find("machine").replaceChildren(option("", "DC motor"), ...about.models.map((of) => option(of.name, `${of.name}: ${of.title}`)), option(OWN, "a model of your own"));
    find("machine").onchange = ({ target }) => {
        if (target.value !== OWN) {
            find("text").value = texts.get(target.value) ?? "";
        }
        settings.clear();
        draw();
        onChange();
    };
    find("text").oninput = () => {
        if (find("machine").value !== OWN) {
            [find("machine").value, name] = [OWN, OWN];
        }
        draw();
    };
    find("apply").onclick = () => onChange();
    // Changes of the text and the menu are not settings.
    ["input", "change"].forEach((kind) => ["text", "machine"].forEach((id) => find(id).addEventListener(kind, (event) => event.stopPropagation())));
}

// Returns the machine as the library takes it.
export function given() {
    const own = find("machine").value;
    return { name: own === OWN ? name : own, text: find("text").value };
}

export const isModel = () => find("machine").value !== "";
export const shown = () => (isModel() ? given().name : "");

// Takes the text of a file.
export async function read(file) {
    find("text").value = await file.text();
    [find("machine").value, name] = [OWN, file.name];
    find("equations").open = true;
    settings.clear();
    draw();
}

// Shows what belongs to a model, or to the DC motor.
function draw() {
    find("equations").hidden = !isModel();
    find("signals").hidden = !isModel();
    find("terms-title").textContent = isModel() ? "Optional terms" : "Beyond the linear motor";
    find("terms-usual").textContent = isModel() ? "those of the text" : "nothing";
    if (url) {
        URL.revokeObjectURL(url);
    }
    url = URL.createObjectURL(new Blob([find("text").value], { type: "text/plain" }));
    [find("save-text").href, find("save-text").download] = [url, given().name.endsWith(".toml") ? given().name : OWN];
}

// Takes what the library understood of a model: its terms, and the signals that it needs.
export function understood(document) {
    settings.terms(isModel() ? document.all_terms : null);
    if (!isModel()) {
        return;
    }
    const signals = [...document.inputs, ...document.outputs].filter((of, n, all) => all.findIndex(({ name }) => name === of.name) === n);
    const one = (of) => `${of.name}${of.unit === "1" ? "" : ` [${printed(of.unit)}]`}`;
    find("signals").textContent = `The model has the signals ${signals.map(one).join(", ")}. Columns are found by their headings: these names, or those that the text gives as “column”.`;
    find("columns-text").placeholder = signals.slice(0, 2).map((of) => `${of.name}=HEADING:${of.unit}`).join(",");
}
