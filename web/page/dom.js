// Elements of the page.
export const find = (id) => document.getElementById(id);

// Creates an element with properties and children; properties with a hyphen are attributes.
export function make(name, properties = {}, ...children) {
    const node = document.createElement(name);
    for (const [key, value] of Object.entries(properties)) {
        if (key.includes("-")) {
            node.setAttribute(key, value);
        } else {
            node[key] = value;
        }
    }
    node.append(...children.filter((child) => child !== null));
    return node;
}

export const option = (value, text = value, properties = {}) => make("option", { value, textContent: text, ...properties });

// Returns a number with significant digits, as a reader writes it.
export function digits(value, count) {
    if (value === null || value === undefined || !Number.isFinite(value)) {
        return "–";
    }
    const text = Math.abs(value) >= 1e-4 && Math.abs(value) < 1e6 || value === 0 ? String(Number(value.toPrecision(count))) : value.toExponential(count - 1);
    return text.replace("-", "−").replace(/e\+?(−|-)?(\d+)/, (_, sign, power) => `·10${sign ? "⁻" : ""}${[...power].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]).join("")}`);
}

// Returns a unit with the signs of print.
export const printed = (unit) => unit.replaceAll("*", "·").replaceAll("^2", "²").replace("ohm", "Ω");

export const bytes = (size) => size < 1e3 ? `${size} B` : size < 1e6 ? `${(size / 1e3).toFixed(1)} kB` : `${(size / 1e6).toFixed(1)} MB`;

export const seconds = (milliseconds) => milliseconds < 1000 ? `${milliseconds.toFixed(0)} ms` : `${(milliseconds / 1e3).toFixed(1)} s`;
