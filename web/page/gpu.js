// Evaluates jobs of the library on WebGPU: one bind group, one dispatch for each round, one copy of the sums.
export class Gpu {
    static async open() {
        if (!navigator.gpu) {
            throw new Error("this browser has no WebGPU");
        }
        const adapter = await navigator.gpu.requestAdapter({ powerPreference: "high-performance" });
        if (!adapter) {
            throw new Error("WebGPU has no adapter on this machine");
        }
        const { maxBufferSize, maxStorageBufferBindingSize } = adapter.limits;
        const device = await adapter.requestDevice({ requiredLimits: { maxBufferSize, maxStorageBufferBindingSize } });
        return new Gpu(adapter, device);
    }

    constructor({ info }, device) {
        this.name = info.description || [info.vendor, info.architecture || info.device].filter(Boolean).join(" ") || "GPU";
        this.device = device;
        this.pipelines = new Map();
        this.buffers = new Map();
        device.lost.then(({ message }) => { this.lost = `the device was lost: ${message}`; });
    }

    // Returns the pipeline of a shader, compiled once.
    pipeline(shader, numbers, kinds) {
        const key = kinds.join() + shader;
        if (!this.pipelines.has(key)) {
            const entries = kinds.map((type, n) => ({
                binding: numbers[n].binding,
                visibility: GPUShaderStage.COMPUTE,
                buffer: { type, hasDynamicOffset: n === 0 },
            }));
            const layout = this.device.createBindGroupLayout({ entries });
            const module = this.device.createShaderModule({ code: shader });
            const pipeline = this.device.createComputePipeline({
                layout: this.device.createPipelineLayout({ bindGroupLayouts: [layout] }),
                compute: { module, entryPoint: "evaluate" },
            });
            this.pipelines.set(key, { layout, pipeline });
        }
        return this.pipelines.get(key);
    }

    // Returns a buffer of at least this size; it is used again by later jobs.
    buffer(key, size, usage) {
        const own = this.buffers.get(key);
        if (own && own.size >= size && own.usage === usage) {
            return own;
        }
        own?.destroy();
        const made = this.device.createBuffer({ size: Math.ceil(size / 4) * 4, usage });
        this.buffers.set(key, made);
        return made;
    }

    // Returns the sums of a job, and frees it.
    async sums(job) {
        if (this.lost) {
            throw new Error(this.lost);
        }
        this.device.pushErrorScope("validation");
        this.device.pushErrorScope("out-of-memory");
        const [flat, kinds] = [job.buffers(), job.kinds()];
        const numbers = kinds.map((_, n) => ({ binding: flat[4 * n], usage: flat[4 * n + 1], size: flat[4 * n + 2], bound: flat[4 * n + 3] }));
        const { layout, pipeline } = this.pipeline(job.shader(), numbers, kinds);
        const entries = numbers.map(({ binding, usage, size, bound }) => {
            const buffer = this.buffer(binding, size, usage);
            const bytes = job.bytes(binding);
            if (bytes.length > 0) {
                this.device.queue.writeBuffer(buffer, 0, bytes);
            }
            return { binding, resource: { buffer, size: bound } };
        });
        const group = this.device.createBindGroup({ layout, entries });
        const [rounds, distance] = job.rounds();
        const result = numbers.find(({ binding }) => binding === job.sums());
        const readBack = this.buffer("read back", result.size, GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST);
        const encoder = this.device.createCommandEncoder();
        for (let round = 0; round < rounds; round += 1) {
            const pass = encoder.beginComputePass();
            pass.setPipeline(pipeline);
            pass.setBindGroup(0, group, [round * distance]);
            pass.dispatchWorkgroups(...job.workgroups());
            pass.end();
        }
        encoder.copyBufferToBuffer(this.buffers.get(result.binding), 0, readBack, 0, result.size);
        this.device.queue.submit([encoder.finish()]);
        job.free();
        const faults = [await this.device.popErrorScope(), await this.device.popErrorScope()].filter(Boolean);
        if (faults.length > 0) {
            throw new Error(faults[0].message);
        }
        await readBack.mapAsync(GPUMapMode.READ, 0, result.size);
        const sums = new Uint8Array(readBack.getMappedRange(0, result.size)).slice();
        readBack.unmap();
        return sums;
    }
}
