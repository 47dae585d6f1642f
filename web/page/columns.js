// Menus for the columns of the first recording. They write the setting "columns", with columns by their numbers and with their units.
import { find, make, option } from "./dom.js";

let columns = [], expressions = [], quantities = [], shown = "", inMenus = "", hasMenus = true, onChange = () => {};

export function begin(about, changed) {
    quantities = about.quantities;
    onChange = changed;
    find("columns-text").onchange = () => onChange();
}

const NOTE = "Each column has its first values and what is understood of it. The menus hold for all recordings.";

export const text = () => find("columns-text").value.trim();

export function set(value) {
    find("columns-text").value = value;
}

// Divides a setting into its items, at commas outside of quotation marks and brackets.
function items(list) {
    const found = [""];
    let depth = 0, isQuoted = false;
    for (const letter of list) {
        isQuoted = letter === "\"" ? !isQuoted : isQuoted;
        depth += isQuoted ? 0 : (letter === "(") - (letter === ")");
        if (letter === "," && !isQuoted && depth <= 0) {
            found.push("");
        } else {
            found[found.length - 1] += letter;
        }
    }
    return found.map((item) => item.trim()).filter(Boolean);
}

const quantityOf = (item) => item.split("=")[0].trim();

// Adds the items of a proposal to the setting in place of those for the same quantities.
export function propose(value) {
    const proposed = items(value), taken = proposed.map(quantityOf);
    set([...items(text()).filter((item) => !taken.includes(quantityOf(item))), ...proposed].join(","));
    onChange();
}

// Shows the tables of a preview; those of one form have the same menus. The signals of a model have no menus.
export function show(files, names, isOfModel = false) {
    if (hasMenus === isOfModel) {
        [hasMenus, shown] = [!isOfModel, ""];
        find("columns-note").textContent = isOfModel ? "The columns with their first values." : NOTE;
    }
    const tables = files.flatMap((tables, n) => tables.map((table) => ({ ...table, file: names[n] })));
    find("columns").hidden = tables.length === 0;
    // Menus in use stay as they are, with a scaling that is being typed.
    if (tables.length === 0 || shown === JSON.stringify(tables)) {
        return;
    }
    const form = ({ columns }) => columns.map(({ heading }) => heading).join("\u0000");
    const others = tables.filter((table) => form(table) !== form(tables[0]));
    const isSame = columns.length > 0 && shown !== "" && form(JSON.parse(shown)[0]) === form(tables[0]) && inMenus === written(tables[0].columns.map(begun));
    shown = JSON.stringify(tables);
    if (isSame) {
        return;
    }
    expressions = tables[0].expressions;
    columns = tables[0].columns.map(begun);
    inMenus = written(columns);
    const menus = hasMenus ? ["Quantity", "Unit", "Scaling"] : [];
    const heads = ["Heading", "First values", ...menus].map((head) => make("th", { scope: "col", textContent: head }));
    const rows = columns.map((column, n) => make("tr", {},
        make("th", { scope: "row", textContent: column.heading || `column ${n + 1}` }),
        make("td", { className: "cells", textContent: column.cells.slice(0, 4).map(shortened).join("   ") }),
        ...hasMenus ? [column.quantityMenu, column.unitMenu, column.scaling].map((menu) => make("td", {}, menu)) : []));
    const name = [tables[0].file, tables[0].part].filter(Boolean).join(", ");
    const caption = others.length === 0 ? name : `${name}; ${others.map(({ file }) => file).join(", ")} has other columns`;
    find("tables").replaceChildren(make("div", { className: "table" }, make("table", {},
        make("caption", { textContent: caption }), make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows))));
}

// Creates the menus of a column, with the quantity as which it is read.
function begun(column, n) {
    const name = column.heading || `column ${n + 1}`;
    const own = {
        ...column,
        quantityMenu: make("select", { "aria-label": `Quantity of ${name}` }, option("", "not used"),
            ...quantities.map((of) => option(of.name, of.name.replace("_", " "), { selected: of.name === column.used?.quantity }))),
        unitMenu: make("select", { "aria-label": `Unit of ${name}` }),
        scaling: make("input", { value: column.used?.scaling ?? "", size: 9, placeholder: "*12/255", autocomplete: "off", "aria-label": `Scaling of ${name}` }),
    };
    units(own, column.used?.unit ?? null);
    own.quantityMenu.onchange = () => {
        // A quantity has one column.
        columns.filter((other) => other !== own && other.quantityMenu.value === own.quantityMenu.value).forEach((other) => { other.quantityMenu.value = ""; units(other, null); });
        units(own, null);
        write();
    };
    own.unitMenu.onchange = write;
    own.scaling.onchange = write;
    return own;
}

// Returns a cell with nine characters at most.
const shortened = (cell) => (cell.length > 9 ? `${cell.slice(0, 8)}…` : cell);

// Fills the menu of units: the named one is chosen, else that of the heading, else the SI unit; a position has no usual unit.
function units(column, named) {
    const quantity = column.quantityMenu.value;
    const known = quantities.find(({ name }) => name === quantity)?.units ?? [];
    const same = (unit) => known.find((own) => own.toLowerCase() === unit.toLowerCase());
    const headed = column.unit && (column.quantity === quantity || same(column.unit)) ? column.unit : null;
    const unit = named ?? headed ?? (quantity === "position" ? "" : known[0] ?? "");
    const chosen = same(unit) ?? unit;
    const extra = chosen && !known.includes(chosen) ? [option(chosen)] : [];
    const open = quantity === "position" && !chosen ? [option("", "choose a unit")] : [];
    column.unitMenu.replaceChildren(...open, ...extra, ...known.map((name) => option(name)));
    column.unitMenu.value = chosen;
    column.unitMenu.disabled = known.length === 0;
    column.scaling.disabled = known.length === 0;
}

// Returns the setting as the menus have it.
function written(menus) {
    const chosen = menus.map((column, n) => ({ quantity: column.quantityMenu.value, n, column })).filter(({ quantity }) => quantity);
    const has = (quantity) => chosen.some((one) => one.quantity === quantity);
    // A position serves as the speed, and is left out beside one.
    const used = chosen.filter(({ quantity }) => quantity !== "position" || !has("speed"));
    const own = used.map(({ quantity, n, column }) => {
        const [scaling, unit] = [column.scaling.value.trim(), column.unitMenu.value];
        if (scaling.includes("..")) {
            return `${quantity}=#${n + 1}:${scaling}`;
        }
        const operations = scaling && !/^[*/+-]/.test(scaling) ? `*${scaling}` : scaling;
        return `${quantity}=#${n + 1}${operations}${unit ? `:${unit}` : ""}`;
    });
    // Expressions of columns have no menu and stay; a heading that names a quantity is read as it unless "-" says that there is none.
    const kept = items(text()).filter((item) => expressions.includes(quantityOf(item)) && !has(quantityOf(item)));
    const isKept = (quantity) => kept.some((item) => quantityOf(item) === quantity);
    const dropped = menus.map(({ quantity }) => quantity).filter((quantity) => quantity && quantity !== "position" && !has(quantity) && !isKept(quantity));
    return [...own, ...kept, ...[...new Set(dropped)].map((quantity) => `${quantity}=-`)].join(",");
}

function write() {
    inMenus = written(columns);
    set(inMenus);
    onChange();
}
