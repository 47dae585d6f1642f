// The result with its files, and results side by side.
import { digits, find, make, printed } from "./dom.js";

const results = [];
let urls = [];

// Shows the answer to a command.
export function show(answer, { command, apply }) {
    urls.forEach((url) => URL.revokeObjectURL(url));
    urls = [];
    save("save-json", `${JSON.stringify(answer.document, null, 2)}\n`, "application/json");
    save("save-report", answer.report, "text/html");
    save("save-curves", answer.curves, "text/csv");
    find("result-title").textContent = { identify: "Result", check: "The model as it was understood" }[command] ?? "The recordings as they were read";
    next(answer.next, apply);
    find("report").srcdoc = answer.report;
    find("result").hidden = false;
}

function save(id, text, type) {
    find(id).hidden = text === undefined;
    if (text !== undefined) {
        urls.push(URL.createObjectURL(new Blob([text], { type })));
        find(id).href = urls.at(-1);
    }
}

// Offers the next step that the library recommends.
function next(step, apply) {
    const { setting, value, command, words } = step ? JSON.parse(step) : {};
    find("next").hidden = !step;
    if (setting) {
        find("next").replaceChildren("Recommended next: ", make("button", { type: "button", textContent: `${setting} ${value ?? "on"}`, onclick: () => apply(setting, value ?? "true") }));
    } else if (command) {
        find("next").replaceChildren(`Recommended next: ${command} the recordings.`);
    } else if (words) {
        find("next").replaceChildren(`Recommended next: ${words}`);
    }
}

// The report is as high as its content.
find("report").onload = ({ target }) => {
    const root = target.contentDocument.documentElement;
    const fit = () => { target.style.height = `${target.contentDocument.body.scrollHeight + 8}px`; };
    new ResizeObserver(fit).observe(root);
    fit();
};

// Adds a result to those that are compared.
export function compare(document, label) {
    results.push({ document, label });
    table();
}

function table() {
    find("comparison").hidden = results.length < 2;
    const names = [...new Set(results.flatMap(({ document }) => Object.keys(document.parameters)))];
    const heads = results.map((result) => make("th", { scope: "col" }, ...result.label.flatMap((line) => [line, make("br")]),
        make("button", { type: "button", className: "small", textContent: "Remove", "aria-label": `Remove ${result.label.join(", ")}`, onclick: () => {
            results.splice(results.indexOf(result), 1);
            table();
        } })));
    const row = (name, cells) => make("tr", {}, make("th", { scope: "row", textContent: name }), ...cells);
    const trust = results.map(({ document: { trust } }) => make("td", { className: trust.level, textContent: trust.level }));
    const fit = (of) => results.map(({ document }) => make("td", { textContent: document.fit_percent?.[of] == null ? "–" : `${digits(document.fit_percent[of], 4)} %` }));
    const outputs = [...new Set(results.flatMap(({ document }) => Object.keys(document.fit_percent ?? {})))];
    const body = [row("trust", trust), ...outputs.map((name) => row(`fit of the ${name}`, fit(name))),
        ...names.map((name) => row(unit(name), results.map(({ document }, n) => value(document.parameters[name], n > 0 ? results[0].document.parameters[name] : null))))];
    find("comparison-table").replaceChildren(make("table", {}, make("thead", {}, make("tr", {}, make("td"), ...heads)), make("tbody", {}, ...body)));
}

function unit(name) {
    const unit = results.map(({ document }) => document.parameters[name]?.unit).find(Boolean);
    return unit ? `${name} [${printed(unit)}]` : name;
}

// Returns the cell of a value with its error, and its difference from that of the first result.
function value(own, first) {
    if (own?.value == null) {
        return make("td", { textContent: "–" });
    }
    const error = own.std_error == null ? (own.fixed ? " fixed" : "") : ` ± ${digits(own.std_error, 2)}`;
    // A fixed value has no error; without the error of another one there is no scale.
    const [ours, theirs] = [own, first].map((of) => (of?.fixed ? 0 : of?.std_error ?? NaN));
    const joint = Math.hypot(ours, theirs);
    const apart = first?.value != null && joint > 0 ? make("div", { className: "cells", textContent: `${digits((own.value - first.value) / joint, 2)} standard errors apart` }) : null;
    return make("td", {}, `${digits(own.value, 5)}${error}`, apart);
}
