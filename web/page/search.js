// A search that is watched: the population in planes of two parameters, the lowest cost over generations, and the rates of this
// browser.
import { digits, find, make, option, printed, seconds } from "./dom.js";

let library, given, fail, used, planes = [], history = [], isDrawn = true, selected = [];

export function begin(about, page) {
    ({ library, given, fail, used } = page);
    find("search-method").replaceChildren(...about.searches.map(({ name, text }) => option(name, name, { title: text })));
    library.ask("adapter").then(({ adapter, error }) => {
        if (adapter) {
            find("search-device").append(option("gpu", `WebGPU: ${adapter}`));
        }
        find("gpu-text").textContent = adapter ? `WebGPU is there: ${adapter}.` : `Without a GPU: ${error.message}. The CPU evaluates everything.`;
        document.body.dataset.gpu = adapter ?? "";
    });
    find("search-form").onsubmit = (event) => {
        event.preventDefault();
        start();
    };
    find("search-stop").onclick = () => library.tellToStop();
    find("measure").onclick = measure;
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    addEventListener("resize", redraw);
}

// Takes the extensions of the latest result, which "auto" stands for in a search.
export function follow(names) {
    selected = names;
}

function asked() {
    const all = given();
    if (all.with?.includes("auto")) {
        all.with = selected;
    }
    const number = (id) => Number(find(id).value);
    const own = { method: find("search-method").value, population: number("search-population"), generations: number("search-generations") };
    return {
        keys: used().map(({ key }) => key),
        settings: JSON.stringify({ ...all, ...own }),
        onGpu: find("search-device").value === "gpu",
        isPaced: find("search-pace").value === "frame",
    };
}

function busy(isBusy) {
    find("search-stop").hidden = !isBusy;
    find("search-form").querySelectorAll("button:not(#search-stop)").forEach((button) => { button.disabled = isBusy; });
}

async function start() {
    busy(true);
    find("search-status").textContent = "Searching …";
    delete document.body.dataset.searched;
    history = [];
    const answer = await library.ask("search", asked(), (told) => {
        if (told.facts) {
            layOut(told.facts);
            return;
        }
        history.push([told.generation, told.best[0]]);
        planes.forEach((plane) => { plane.told = told; });
        find("search-now").textContent = `Generation ${told.generation}, cost ${digits(told.best[0], 5)}.`;
        redraw();
    });
    busy(false);
    find("search-now").textContent = "";
    if (answer.error) {
        fail(answer.error);
        find("search-status").textContent = "";
        return;
    }
    const { generation, best, evaluations, milliseconds, samples, isStopped } = answer.done;
    history.push([generation, best[0]]);
    redraw();
    const rate = 1e3 * evaluations * samples / milliseconds;
    const found = planes.axes.map(({ name, unit }, n) => `${name} = ${digits(best[n + 1], 4)} ${printed(unit)}`).join(", ");
    find("search-status").textContent = `${isStopped ? "Stopped" : "Ended"} after ${generation} generations and ${evaluations} evaluations, ${seconds(milliseconds)} of computing, ${digits(rate, 2)} candidate-steps/s. Cost ${digits(best[0], 5)}: ${found}. Identify gives the errors.`;
    document.body.dataset.searched = String(best[0]);
}

// Creates a drawing for each pair of parameters, and one for the cost.
function layOut({ axes }) {
    const pairs = Array.from({ length: Math.floor(axes.length / 2) }, (_, n) => [2 * n, 2 * n + 1]);
    if (axes.length % 2 === 1 && axes.length > 1) {
        pairs.push([axes.length - 2, axes.length - 1]);
    }
    const drawing = (label) => {
        const canvas = make("canvas", { role: "img", "aria-label": label });
        find("planes").append(make("figure", {}, canvas, make("figcaption", { textContent: label })));
        return canvas;
    };
    const named = ({ name, unit }) => `${name} [${printed(unit)}]`;
    find("planes").replaceChildren();
    planes = pairs.map(([x, y]) => ({ canvas: drawing(`${named(axes[y])} over ${named(axes[x])} within the bounds, logarithmic if these are positive`), x: axes[x], y: axes[y], at: [x, y], told: null }));
    planes.axes = axes;
    planes.cost = drawing("Lowest cost over generations, logarithmic");
}

function redraw() {
    if (!isDrawn) {
        return;
    }
    isDrawn = false;
    requestAnimationFrame(() => {
        isDrawn = true;
        const style = getComputedStyle(document.documentElement);
        const [ink, soft, link, mark] = ["--text", "--soft", "--link", "--mark"].map((name) => style.getPropertyValue(name));
        planes.forEach((plane) => cloud(plane, { ink, soft, link, mark }));
        if (planes.cost) {
            curve(planes.cost, { soft, link });
        }
    });
}

// Returns the context of a canvas of the sharpness of the screen, cleared, with its size.
function cleared(canvas) {
    const ratio = devicePixelRatio || 1, { clientWidth: width, clientHeight: height } = canvas;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    context.font = "12px system-ui, sans-serif";
    return { context, width, height };
}

const EDGE = { left: 12, right: 12, top: 12, bottom: 24 };

function cloud({ canvas, x, y, at, told }, { soft, link, mark }) {
    const { context, width, height } = cleared(canvas);
    const place = ({ min, max }, length) => (min > 0 ? (value) => Math.log(value / min) / Math.log(max / min) * length : (value) => (value - min) / (max - min) * length);
    const [right, up] = [place(x, width - EDGE.left - EDGE.right), place(y, height - EDGE.top - EDGE.bottom)];
    const point = (a, b) => [EDGE.left + right(a), height - EDGE.bottom - up(b)];
    context.fillStyle = soft;
    context.fillText(digits(x.min, 2), EDGE.left, height - 8);
    context.textAlign = "right";
    context.fillText(digits(x.max, 2), width - EDGE.right, height - 8);
    context.textAlign = "center";
    context.fillText(x.name, width / 2, height - 8);
    context.textAlign = "left";
    context.fillText(`${y.name}  ${digits(y.max, 2)}`, EDGE.left, EDGE.top + 4);
    context.fillText(digits(y.min, 2), EDGE.left, height - EDGE.bottom - 4);
    if (!told) {
        return;
    }
    const count = planes.axes.length, rows = told.values.length / count, step = Math.max(1, Math.floor(rows / 4000));
    context.fillStyle = link;
    context.globalAlpha = 0.55;
    for (let row = 0; row < rows; row += step) {
        const [left, top] = point(told.values[row * count + at[0]], told.values[row * count + at[1]]);
        context.fillRect(left - 1.5, top - 1.5, 3, 3);
    }
    context.globalAlpha = 1;
    if (told.best.length > 0) {
        context.strokeStyle = mark;
        context.lineWidth = 2;
        context.beginPath();
        context.arc(...point(told.best[1 + at[0]], told.best[1 + at[1]]), 6, 0, 2 * Math.PI);
        context.stroke();
    }
}

function curve(canvas, { soft, link }) {
    const { context, width, height } = cleared(canvas);
    const points = history.filter(([, cost]) => cost > 0 && Number.isFinite(cost));
    if (points.length < 2) {
        return;
    }
    const costs = points.map(([, cost]) => Math.log(cost)), [low, high] = [Math.min(...costs), Math.max(...costs)];
    const last = points.at(-1)[0], first = points[0][0];
    context.strokeStyle = link;
    context.lineWidth = 2;
    context.beginPath();
    points.forEach(([generation], n) => {
        const left = EDGE.left + (generation - first) / Math.max(1, last - first) * (width - EDGE.left - EDGE.right);
        const top = EDGE.top + 16 + (high - costs[n]) / Math.max(1e-9, high - low) * (height - EDGE.top - EDGE.bottom - 24);
        context.lineTo(left, top);
    });
    context.stroke();
    context.fillStyle = soft;
    context.fillText(`cost ${digits(Math.exp(high), 3)}`, EDGE.left, EDGE.top + 4);
    context.fillText(`generation ${first}`, EDGE.left, height - 8);
    context.textAlign = "right";
    context.fillText(`${digits(Math.exp(low), 3)} at generation ${last}`, width - EDGE.right, height - 8);
}

// Measures the rates of this browser with a million candidates.
const COUNT = 1_000_000;

async function measure() {
    busy(true);
    delete document.body.dataset.measured;
    const isGpu = find("search-device").querySelector('[value="gpu"]') !== null;
    const { error, rates, isStopped } = await library.ask("measure", { ...asked(), onGpu: isGpu, count: COUNT }, ({ measured: { name, done } }) => {
        find("search-now").textContent = `Evaluating on the ${name.toUpperCase()}: ${done.toLocaleString("en")} of ${COUNT.toLocaleString("en")} candidates.`;
    });
    busy(false);
    find("search-now").textContent = "";
    find("search-status").textContent = isStopped ? "Stopped." : "";
    if (error || isStopped) {
        return error && fail(error);
    }
    const row = (name, time) => make("tr", {}, make("th", { scope: "row", textContent: name }), ...[seconds(1e3 * time), digits(COUNT / time, 2), digits(COUNT * rates.steps / time, 2)].map((cell) => make("td", { textContent: cell })));
    const heads = ["", "Time", "Candidates/s", "Candidate-steps/s"].map((head) => make("th", { scope: "col", textContent: head }));
    const rows = [row("CPU, one thread of WebAssembly", rates.cpu), ...rates.gpu ? [row(`WebGPU, ${rates.adapter}`, rates.gpu)] : []];
    const caption = `A million candidates of ${rates.steps} samples in this browser${rates.gpu ? `; costs differ by at most ${digits(rates.difference, 1)} of their value` : ""}.`;
    find("rates").replaceChildren(make("table", {}, make("caption", { textContent: caption }), make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows)));
    document.body.dataset.measured = JSON.stringify(rates);
}
