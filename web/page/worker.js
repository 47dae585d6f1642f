// Runs the library beside the page, which stays responsive.
import init, { Workbench, about } from "./motorfit_web.js";

const ready = init().then(() => postMessage({ about: JSON.parse(about()) }));

onmessage = async ({ data: { id, command, files, settings } }) => {
    await ready;
    const bench = new Workbench();
    try {
        for (const { name, bytes } of files) {
            bench.add(name, bytes);
        }
        const begin = performance.now();
        const answer = JSON.parse(bench[command](JSON.stringify(settings)));
        postMessage({ id, answer, milliseconds: performance.now() - begin });
    } catch (error) {
        postMessage({ id, answer: { error: { message: `the library failed: ${error}`, hint: "Reload the page and report this file's kind." } } });
    } finally {
        bench.free();
    }
};
