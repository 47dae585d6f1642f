// Runs the library beside the page, which stays responsive. A message has a number, by which its answers are recognized.
import init, { Rates, Search, Workbench, about } from "./motorfit_web.js";
import { Gpu } from "./gpu.js";

const files = new Map();
let bench = null, chosen = "", understood = {}, gpu = null, isStopped = false;
const ready = init().then(() => postMessage({ about: JSON.parse(about()) }));
ready.catch((error) => postMessage({ failure: String(error?.message ?? error) }));
const pause = (milliseconds = 0) => new Promise((resolve) => setTimeout(resolve, milliseconds));

// Returns the workbench with the files of the keys given and a machine; throws the error of its text.
function opened({ keys, machine = { name: "", text: "" } }) {
    if (!bench || chosen !== keys.join()) {
        const [before, made] = [bench, new Workbench()];
        bench = null;
        before?.free();
        keys.forEach((key) => made.add(files.get(key).name, files.get(key).bytes));
        [bench, chosen] = [made, keys.join()];
    }
    understood = JSON.parse(bench.machine(machine.name, machine.text));
    if (understood.error) {
        throw JSON.stringify(understood);
    }
    return bench;
}

// Returns the device, opened once, and anew after it was lost.
async function device() {
    gpu ??= Gpu.open();
    try {
        const own = await gpu;
        if (!own.lost) {
            return own;
        }
    } catch (error) {
        gpu = null;
        throw error;
    }
    gpu = null;
    return device();
}

// Frees an object of the library; after a failure of the library that fails too.
function release(object) {
    try {
        object.free();
    } catch {
        // The failure itself is reported.
    }
}

// Time of a frame [ms].
const FRAME = 1000 / 60;

// Passes generations to the page with their candidates, at most one a frame. A paced search waits for the frame.
async function search({ settings, onGpu, isPaced, ...of }, tell) {
    const gpu = onGpu ? await device() : null;
    const run = new Search(opened(of), settings, onGpu);
    isStopped = false;
    try {
        const facts = JSON.parse(run.facts());
        if (facts.error) {
            return facts;
        }
        tell({ facts });
        let shown = 0, generation = 0, best = [], milliseconds = 0;
        for (let values = run.candidates(); values.length > 0 && !isStopped; values = run.candidates()) {
            const begin = performance.now();
            const job = run.begin_generation();
            run.finish_generation(job ? await gpu.sums(job) : new Uint8Array());
            best = [...run.best()];
            generation += 1;
            const now = performance.now();
            milliseconds += now - begin;
            if (isPaced || now - shown > FRAME) {
                tell({ generation, values, best });
                await pause(isPaced ? FRAME - (now - shown) : 0);
                shown = performance.now();
            }
        }
        return { done: { generation, best, evaluations: run.evaluations(), milliseconds, samples: facts.samples, isStopped } };
    } finally {
        release(run);
    }
}

// Candidates of a part: a tenth of a second on the CPU, and what fits buffers on a device.
const PART_CPU = 4096, PART_GPU = 65536;

// Measures the rates of CPU and device on one sample of candidates, and how far their costs differ.
async function measure({ settings, count, onGpu, ...of }, tell) {
    const gpu = onGpu ? await device() : null;
    const run = new Rates(opened(of), settings, count);
    isStopped = false;
    try {
        const found = { count, steps: run.steps(), cpu: null, gpu: null, difference: null };
        const costs = {};
        const most = Math.min(PART_GPU, run.most_on_device());
        for (const [name, part] of gpu ? [["gpu", most], ["cpu", PART_CPU]] : [["cpu", PART_CPU]]) {
            let seconds = 0;
            costs[name] = [];
            for (let first = 0; first < count && !isStopped; first += part) {
                run.take(first, Math.min(part, count - first));
                if (name === "gpu" && first === 0) {
                    // The first submission compiles the shader.
                    await gpu.sums(run.job());
                }
                const begin = performance.now();
                const own = name === "cpu" ? run.on_cpu() : run.costs(await gpu.sums(run.job()));
                seconds += (performance.now() - begin) / 1e3;
                costs[name].push(own);
                tell({ measured: { name, done: Math.min(count, first + part), count } });
                await pause();
            }
            found[name] = seconds;
        }
        if (gpu) {
            const [ours, theirs] = ["cpu", "gpu"].map((name) => costs[name].flatMap((part) => [...part]));
            const apart = (cost, other) => (cost === other ? 0 : Math.abs(other / cost - 1));
            found.difference = ours.reduce((most, cost, n) => Math.max(most, Number.isNaN(apart(cost, theirs[n])) ? Infinity : apart(cost, theirs[n])), 0);
            found.adapter = gpu.name;
        }
        return { rates: found, isStopped };
    } finally {
        release(run);
    }
}

const commands = {
    add: ({ key, name, bytes }) => files.set(key, { name, bytes }) && {},
    remove: ({ key }) => files.delete(key) && {},
    preview: ({ settings, ...of }) => ({ ...JSON.parse(opened(of).preview(settings)), machine: understood }),
    check: ({ settings, ...of }) => JSON.parse(opened(of).check(settings)),
    inspect: ({ settings, ...of }) => JSON.parse(opened(of).inspect(settings)),
    identify: ({ settings, ...of }) => JSON.parse(opened(of).identify(settings)),
    adapter: async () => ({ adapter: (await device()).name }),
    search,
    measure,
};

// Errors of the library are texts of JSON; any other one is a defect or a lost device.
function failure(error) {
    if (typeof error === "string") {
        return JSON.parse(error);
    }
    if (error instanceof WebAssembly.RuntimeError) {
        const hint = "The library was started again. Please report this recording and its settings.";
        return { error: { message: `the library failed: ${error.message}`, hint }, isBroken: true };
    }
    return { error: { message: String(error?.message ?? error), hint: "Try again, or use the CPU." } };
}

onmessage = async ({ data: { id, command, ...given } }) => {
    if (command === "stop") {
        isStopped = true;
        return;
    }
    const begin = performance.now();
    let answer;
    try {
        await ready;
        answer = await commands[command](given, (progress) => postMessage({ id, progress }));
    } catch (error) {
        answer = failure(error);
    }
    postMessage({ id, answer, milliseconds: performance.now() - begin });
};
