// Runs a firn program (program.wgsl and manifest.json) on a WebGPU device, in a browser, in node or in Deno.
//
//   const { manifest, code } = await fetchProgram('programs/NAME');
//   const domain = { lower: [0, 0, 0], upper: [1, 1, 1], cell_size: 1 / 32 };              // m
//   const device = await requestDevice(navigator.gpu, manifest, { particles: 1000, domain });
//   const program = await Program.create(device, manifest, code);
//   const simulation = await Simulation.create(program, { particles: 1000, domain });
//   simulation.set({ time_step: 1e-4, gravity: [0, -9.81, 0] });
//   simulation.write({ position, velocity, mass, volume, deformation_gradient });          // particle after particle
//   simulation.initialise();
//   simulation.step(100);
//   await simulation.check();     // throws the program's error, such as a particle that has left the domain
//   const position = await simulation.read('position');
//
// Particles of several materials are sets on one grid, each with its own program. The first one has the grid and takes
// the steps of all:
//   const water = await Simulation.create(programs.water, { particles: 1000, domain });
//   const sand = await Simulation.create(programs.sand, { particles: 500, domain }, water);
//   water.step(100);
import { FirnError, bindingSizes, blockWidth, checkLimits, extents, gridOf, groupsPerAxis, hasOwnBuffers, isOfParticles,
    mostSets, requiredLimits, wordsOfSet } from './firn_size.mjs';

export { FirnError, checkLimits, gridOf, requiredLimits };

const format = 1; // of the manifest
const noParticle = 0xffffffff;
const arrayTypes = { f32: Float32Array, i32: Int32Array, u32: Uint32Array };

/** What a buffer lacks of number c of a component: 1 on the diagonal of a matrix F, or of a number J, else 0. */
const lacking = (lessOne, count, c) => Number(lessOne && c % ({ 9: 4, 4: 3 }[count] ?? 1) === 0);

/** Fetches a program's manifest and code from the folder at `url`. */
export async function fetchProgram(url) {
    const get = async (name) => {
        const answer = await fetch(`${url.replace(/\/$/, '')}/${name}`);
        if (!answer.ok) throw new FirnError(`${answer.url} cannot be read: ${answer.status}.`);
        return answer;
    };
    const manifest = await (await get('manifest.json')).json();
    return { manifest, code: await (await get(manifest.code)).text() };
}

const fullSize = ({ particles, capacity = particles, domain, nodes, blocks, distances }) =>
    ({ capacity, blocks, distances, nodes: Array.from(domain ? gridOf(domain).nodes : nodes ?? []) });

/** Requests a device from `gpu` (navigator.gpu) with the limits for a program of this size, see Simulation.create(). */
export async function requestDevice(gpu, manifest, size, options = { powerPreference: 'high-performance' }) {
    const adapter = await gpu?.requestAdapter(options);
    if (!adapter)
        throw new FirnError('There is no WebGPU here: it needs a recent browser, and a page from https or localhost.');
    checkLimits(manifest, fullSize(size), adapter.limits);
    const usual = { // the limits of a device requested without any
        maxBufferSize: 2 ** 28, maxStorageBufferBindingSize: 2 ** 27, maxStorageBuffersPerShaderStage: 8,
        maxUniformBufferBindingSize: 2 ** 16, maxComputeInvocationsPerWorkgroup: 256, maxComputeWorkgroupSizeX: 256,
    };
    const more = Object.entries(requiredLimits(manifest, fullSize(size))).filter(([name, need]) => need > usual[name]);
    return adapter.requestDevice({ requiredLimits: Object.fromEntries(more) });
}

const watches = new WeakMap();

/** The errors of a device since the first call for it. */
function watched(device) {
    if (watches.has(device)) return watches.get(device);
    const watch = { lost: null, refused: [] };
    watches.set(device, watch);
    device.lost.then((info) => { watch.lost = info; });
    device.addEventListener('uncapturederror', ({ error }) => {
        if (watch.refused.length < 1000) watch.refused.push(error.message);
    });
    return watch;
}

/** A compiled program, for simulations of any size. */
export class Program {
    /** Compiles a program. Throws a FirnError with the compiler's messages, each with its line and column. */
    static async create(device, manifest, code) {
        if (manifest.format !== format)
            throw new FirnError(`${manifest.name} is of format ${manifest.format}; this host reads ${format}.`);
        const watch = watched(device), program = new Program();
        Object.assign(program, { device, manifest, kernels: new Map(), watch, refusals: watch.refused.length });
        device.pushErrorScope('validation');
        const module = device.createShaderModule({ label: manifest.name, code });
        const [info, error] = await Promise.all([module.getCompilationInfo(), device.popErrorScope()]);
        const messages = info.messages.filter(({ type }) => type === 'error')
            .map((m) => `${manifest.code}:${m.lineNum}:${m.linePos}: ${m.message.trim()}`);
        if (messages.length || error)
            throw new FirnError(messages.join('\n') || `${manifest.code}: ${error.message}`, { stage: 'shader' });
        await Promise.all(manifest.kernels.map((kernel) => program.#compile(module, kernel)));
        return program;
    }

    async #compile(module, kernel) {
        const { device, manifest } = this;
        const types = { uniform: 'uniform', read: 'read-only-storage', read_write: 'storage' };
        const fail = (error) => {
            const message = error.message.trim();
            throw new FirnError(`${manifest.code}: kernel ${kernel.entry}: ${message}`, { stage: 'pipeline' });
        };
        device.pushErrorScope('validation');
        const layout = device.createBindGroupLayout({ entries: kernel.bindings.map(({ binding, access }) =>
            ({ binding, visibility: GPUShaderStage.COMPUTE, buffer: { type: types[access] } })) });
        const created = device.createComputePipelineAsync({
            label: kernel.entry, layout: device.createPipelineLayout({ bindGroupLayouts: [layout] }),
            compute: { module, entryPoint: kernel.entry },
        });
        const [pipeline, error] = await Promise.all([created.catch(fail), device.popErrorScope()]);
        if (error) fail(error);
        this.kernels.set(kernel.entry, { ...kernel, layout, pipeline });
    }

    /** Throws if the device was lost or has refused a command. */
    check() {
        const { lost, refused } = this.watch, refusal = refused[this.refusals];
        if (lost) throw new FirnError(`The device was lost (${lost.reason}): ${lost.message}`, { lost: true });
        if (refusal) throw new FirnError(`The device refused a command: ${refusal}`);
    }
}

/** The buffers of one set of particles, and its steps; with those of the further sets on its grid, if there are any. */
export class Simulation {
    /**
     * @param program {Program}
     * @param size {{particles: number, capacity?: number, domain?: object, nodes?: number[], blocks?: number,
     *        distances?: number}} the number of particles; the most particles (default: their number); the domain, see
     *        gridOf(), or else the nodes along each axis; for a sparse grid, how many blocks of nodes it has memory for;
     *        how many numbers the buffer "distances" has (default: as the manifest says)
     * @param grid {Simulation} another set of particles, the first one on a grid of the same nodes: its buffers of the
     *        grid are used, and its steps take this set along
     */
    static async create(program, size, grid = null) {
        const { device, manifest } = program, full = fullSize(size), { capacity, nodes, blocks } = full;
        checkLimits(manifest, full, device.limits);
        if (grid) grid.#require(nodes, blocks);
        for (const scope of ['out-of-memory', 'validation']) device.pushErrorScope(scope);
        const create = (label, bytes, usage) =>
            device.createBuffer({ label, size: bytes, usage: usage | GPUBufferUsage.COPY_DST });
        const buffers = new Map(), shared = new Set();
        for (const { name, binding } of grid ? manifest.buffers.filter((each) => !isOfParticles(each)) : []) {
            buffers.set(binding, grid.#buffer(name).gpu);
            shared.add(binding);
        }
        for (const [binding, bytes] of bindingSizes(manifest, full))
            if (!shared.has(binding))
                buffers.set(binding, create(`binding ${binding}`, bytes,
                    GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC));
        const uniforms = new DataView(new ArrayBuffer(Math.ceil(manifest.uniforms.bytes / 16) * 16));
        buffers.set(manifest.uniforms.binding, create('uniforms', uniforms.byteLength, GPUBufferUsage.UNIFORM));
        const resources = (bindings) => bindings.map(({ binding }) =>
            ({ binding, resource: { buffer: buffers.get(binding) } }));
        const groups = new Map(Array.from(program.kernels.values(), ({ entry, layout, bindings }) =>
            [entry, device.createBindGroup({ layout, entries: resources(bindings) })]));
        const error = (await Promise.all([device.popErrorScope(), device.popErrorScope()])).find((each) => each);
        if (error) throw new FirnError(`There is no memory for ${capacity} particles: ${error.message}`);

        const simulation = new Simulation();
        Object.assign(simulation, { program, device, manifest, capacity, nodes, blocks, buffers, shared, groups,
            uniforms, values: {}, changed: true, steps: 0, particles: size.particles, domain: size.domain,
            sets: [simulation] });
        for (const field of manifest.uniforms.fields) simulation.#pack(field, field.default ?? undefined);
        const has = (name) => manifest.uniforms.fields.some((field) => field.name === name);
        const numbers = size.domain ? { ...gridOf(size.domain), cell_size: size.domain.cell_size } : {};
        const set_number = grid?.sets.length ?? 0;
        for (const [name, value] of Object.entries({ particles: size.particles, capacity, nodes, blocks, set_number,
            ...numbers }))
            if (has(name)) simulation.set(name, value);
        if (numbers.coordinates) simulation.writeBuffer('coordinates', numbers.coordinates);
        grid?.sets.push(simulation);
        return simulation;
    }

    /** Throws unless another set can be on this grid. */
    #require(nodes, blocks) {
        if (this.sets[0] !== this || this.shared.size)
            throw new FirnError('A further set of particles is created with the first one on its grid.');
        if (String(nodes) !== String(this.nodes) || blocks !== this.blocks)
            throw new FirnError('Sets of particles on one grid have the same nodes.');
        if (this.sets.length === mostSets)
            throw new FirnError(`There are ${mostSets} sets of particles on this grid, and no more can be.`);
    }

    /** Sets uniforms by name, in the manifest's units: set('time_step', 1e-4) or set({ gravity: [0, -9.81, 0] }). */
    set(names, value) {
        const { fields } = this.manifest.uniforms, all = typeof names === 'string' ? { [names]: value } : { ...names };
        const { time_step = this.values.time_step, cell_size = this.values.cell_size } = all;
        if (('time_step' in all || 'cell_size' in all) && time_step > 0 && cell_size > 0 &&
            fields.some(({ name }) => name === 'place_per_velocity'))
            all.place_per_velocity ??= time_step / cell_size;
        for (const [name, numbers] of Object.entries(all)) {
            const field = fields.find((each) => each.name === name);
            if (!field)
                throw new FirnError(`There is no uniform ${name}; there are ${fields.map((f) => f.name).join(', ')}.`);
            if (name === 'particles' && !(numbers <= this.capacity))
                throw new FirnError(`${numbers} particles do not fit into a capacity of ${this.capacity}.`);
            if (['nodes', 'capacity', 'blocks'].includes(name) && String(numbers) !== String(this[name]))
                throw new FirnError(`${name} cannot change after Simulation.create(): the buffers have that size.`);
            this.#pack(field, numbers);
            if (name === 'particles') this.particles = numbers;
        }
    }

    #pack({ name, type, offset }, value) {
        const [, width = 1, scalar] = /^(?:vec([234])<)?([fiu]32)>?$/.exec(type) ?? [];
        const numbers = value === undefined ? Array(Number(width)).fill(0) : [value].flat();
        const fits = { f32: Number.isFinite, u32: (n) => n === n >>> 0, i32: (n) => n === (n | 0) }[scalar];
        if (!fits || numbers.length !== Number(width) || !numbers.every(fits))
            throw new FirnError(`The uniform ${name} is ${type}; ${JSON.stringify(value)} is not.`);
        const put = { f32: 'setFloat32', i32: 'setInt32', u32: 'setUint32' }[scalar];
        numbers.forEach((number, i) => this.uniforms[put](offset + 4 * i, number, true));
        this.values[name] = value;
        this.changed = true;
    }

    #buffer(name) {
        const buffer = this.manifest.buffers.find((each) => each.name === name);
        if (!buffer) throw new FirnError(`There is no buffer ${name}.`);
        return { Type: arrayTypes[buffer.type], gpu: this.buffers.get(buffer.binding) };
    }

    /**
     * The place of a component: number c of particle i is at word (row + c) * capacity + i of `gpu`, a GPUBuffer from
     * which you can draw. If `less_one` is true, the buffer has the diagonal of a matrix, or the number, less 1.
     */
    component(name) {
        for (const buffer of this.manifest.buffers) {
            let row = 0;
            for (const component of buffer.components ?? []) {
                const { count, less_one = false } = component;
                if (component.name === name) return { row, count, less_one, ...this.#buffer(buffer.name) };
                row += component.count;
            }
        }
        const names = this.manifest.buffers.flatMap(({ components = [] }) => components.map((each) => each.name));
        throw new FirnError(`Particles have no component ${name}; they have ${names.join(', ')}.`);
    }

    /**
     * Writes components of the particles by name, each an array of particles * count numbers, all of particle `first`
     * first, up to the last particle. `position` [m] sets place and corner.
     */
    write({ position, ...values }, first = 0) {
        if (position) Object.assign(values, this.#split(position));
        const particles = this.particles - first;
        for (const [name, numbers] of Object.entries(values)) {
            const { row, count, less_one, Type, gpu } = this.component(name);
            if (numbers.length !== count * particles)
                throw new FirnError(`${name} has ${count} numbers for each of ${particles} particles; there are ` +
                    `${numbers.length} in all.`);
            for (let c = 0; c < count; ++c) {
                const one = new Type(particles);
                for (let i = 0; i < one.length; ++i) one[i] = numbers[i * count + c] - lacking(less_one, count, c);
                this.device.queue.writeBuffer(gpu, 4 * ((row + c) * this.capacity + first), one);
            }
        }
    }

    /** The fields of `count` particles of the material at rest and without strain that are not 0, by their names. */
    atRest(count) {
        const fields = this.manifest.buffers.flatMap(({ components = [] }) => components)
            .filter((component) => component.default !== undefined);
        return Object.fromEntries(fields.map(({ name, default: value }) => {
            const one = [value].flat();
            return [name, Float32Array.from({ length: count * one.length }, (_, k) => one[k % one.length])];
        }));
    }

    #box() {
        if (!this.domain) throw new FirnError('Positions need the domain, given to Simulation.create().');
        return this.domain;
    }

    #split(position) {
        const { lower, cell_size } = this.#box(), D = lower.length;
        const place = new Float32Array(position.length), corner = new Float32Array(position.length);
        for (let k = 0; k < position.length; ++k) {
            const cells = (position[k] - lower[k % D]) / cell_size;
            corner[k] = blockWidth * Math.floor(cells / blockWidth);
            place[k] = cells - corner[k];
        }
        return { place, corner };
    }

    /** Writes a whole buffer from a typed array that has its layout on the device. */
    writeBuffer(name, numbers) {
        const { gpu } = this.#buffer(name);
        if (numbers.byteLength !== gpu.size)
            throw new FirnError(`Buffer ${name} has ${gpu.size} bytes, not ${numbers.byteLength}.`);
        this.device.queue.writeBuffer(gpu, 0, numbers);
    }

    /** Lets the status' `time` count the steps from here on. */
    resetTime() {
        this.device.queue.writeBuffer(this.#buffer('status').gpu, 4 * this.manifest.status.time, new Uint32Array(1));
    }

    /** Lets steps with bound_time_step 2 take no more time than this [s] from here on. */
    setTimeLeft(left) {
        const high = Math.fround(left), { time_left } = this.manifest.status; // time_left_low is the next word
        this.device.queue.writeBuffer(this.#buffer('status').gpu, 4 * time_left, Float32Array.of(high, left - high));
    }

    /** Lets the next step count the places of these particles from the blocks in which they are. */
    sortNext() {
        const word = this.manifest.status.sort_needed + wordsOfSet * (this.values.set_number ?? 0);
        this.device.queue.writeBuffer(this.#buffer('status').gpu, 4 * word, Uint32Array.of(1));
    }

    /**
     * Runs the manifest's "initialise" for all sets on the grid. Call it once, after the particles were written, and
     * after parameters of the material have changed.
     */
    initialise() { this.run(this.manifest.initialise ?? []); }

    /** Takes `count` steps, `batch` in each submission: "step", or "step_sorted" (P2G through workgroup memory). */
    step(count = 1, schedule = 'step', batch = 16) {
        const entries = this.manifest[schedule];
        if (!Array.isArray(entries)) throw new FirnError(`${this.manifest.name} has no schedule ${schedule}.`);
        for (let left = count; left > 0; left -= batch) this.run(entries, Math.min(left, batch));
        this.steps += count;
    }

    /**
     * Submits the kernels in their order, `times` times. Each sees what the kernels before it wrote. One that uses
     * buffers of particles runs for all sets on the grid, or for the given ones, before the next one does.
     */
    run(entries, times = 1, sets = this.sets) {
        for (const set of sets) set.#send();
        const all = entries.flatMap((entry) => sets.filter((set) => set === this || set.#isOwn(entry))
            .map((set) => [set, entry]));
        const encoder = this.device.createCommandEncoder(), pass = encoder.beginComputePass();
        for (let i = 0; i < times; ++i) for (const [set, entry] of all) set.#dispatch(pass, entry);
        pass.end();
        this.device.queue.submit([encoder.finish()]);
    }

    #send() {
        this.program.check();
        const uniforms = this.buffers.get(this.manifest.uniforms.binding);
        if (this.changed) this.device.queue.writeBuffer(uniforms, 0, this.uniforms.buffer);
        this.changed = false;
    }

    #isOwn(entry) {
        const kernel = this.program.kernels.get(entry);
        if (!kernel) throw new FirnError(`${this.manifest.name} has no kernel ${entry}.`);
        return hasOwnBuffers(this.manifest, kernel);
    }

    #dispatch(pass, entry) {
        const kernel = this.program.kernels.get(entry), count = extents(this.manifest, this);
        if (!kernel) throw new FirnError(`${this.manifest.name} has no kernel ${entry}.`);
        const invocations = kernel.per === 'particle' ? this.particles : count[kernel.per];
        const groups = { block_workgroup: count.block, one_workgroup: 1 }[kernel.per] ??
            Math.max(1, Math.ceil(invocations / (kernel.workgroup_size ?? this.manifest.workgroup_size)));
        const x = Math.min(groups, groupsPerAxis), y = Math.ceil(groups / x);
        if (!(y <= groupsPerAxis)) throw new FirnError(`Kernel ${entry} (per ${kernel.per}) cannot be dispatched.`);
        pass.setPipeline(kernel.pipeline);
        pass.setBindGroup(0, this.groups.get(entry));
        pass.dispatchWorkgroups(x, y);
    }

    /** Reads a component, all numbers of particle 0 first; `position` [m] in 64 bits. Waits for earlier steps. */
    async read(name) {
        if (name === 'position') {
            const { lower, cell_size } = this.#box();
            const [place, corner] = [await this.read('place'), await this.read('corner')];
            return Float64Array.from(place, (p, k) => lower[k % lower.length] + cell_size * (corner[k] + p));
        }
        const { row, count, less_one, Type, gpu } = this.component(name);
        const rows = new Type(await this.#download(gpu, 4 * row * this.capacity, 4 * count * this.capacity));
        const numbers = new Type(count * this.particles);
        for (let c = 0; c < count; ++c)
            for (let i = 0; i < this.particles; ++i)
                numbers[i * count + c] = rows[c * this.capacity + i] + lacking(less_one, count, c);
        return numbers;
    }

    /** Reads a whole buffer in its layout on the device. */
    async readBuffer(name) {
        const { Type, gpu } = this.#buffer(name);
        return new Type(await this.#download(gpu, 0, gpu.size));
    }

    async #download(gpu, offset, size) {
        this.program.check();
        const staging = this.device.createBuffer({ size, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
        const encoder = this.device.createCommandEncoder();
        encoder.copyBufferToBuffer(gpu, offset, staging, 0, size);
        this.device.queue.submit([encoder.finish()]);
        try {
            await staging.mapAsync(GPUMapMode.READ);
            this.program.check();
            return staging.getMappedRange().slice(0);
        } catch (error) {
            const soon = new Promise((resolve) => { setTimeout(resolve, 100); });
            await Promise.race([this.device.lost, soon]); // the loss is reported after the refusal
            this.program.check();
            throw error;
        } finally {
            staging.destroy();
        }
    }

    /** Reads the buffer "status", its words by name: error, particle, set and steps are integers, the others floats. */
    async status() { return this.#named(await this.readBuffer('status')); }

    #named(words) {
        const floats = new Float32Array(words.buffer);
        const isWhole = (name) => ['error', 'particle', 'set', 'steps'].includes(name);
        return Object.fromEntries(Object.entries(this.manifest.status).map(([name, i]) =>
            [name, isWhole(name) ? words[i] >>> 0 : floats[i]]));
    }

    /**
     * Returns the status: status(), or that of the words of the buffer "status". Throws a FirnError with the program's
     * sentence if a step has failed.
     */
    async check(words = null) {
        const status = words ? this.#named(words) : await this.status(), { error: code, particle, set } = status;
        if (code === 0) return status;
        const sentence = this.manifest.errors?.[code] ?? `The program reports error ${code}.`;
        const of = this.sets.length > 1 && this.sets[set] ? ` of ${this.sets[set].manifest.material}` : '';
        const where = particle === noParticle ? '' : `particle ${particle}${of}, `;
        const message = `${sentence} (${where}at the latest in step ${this.steps})`;
        throw new FirnError(message, { code, particle, step: this.steps });
    }

    /** Frees the buffers, with those of the further sets on the grid. */
    destroy() {
        for (const set of this.sets)
            for (const [binding, buffer] of set.buffers) if (!set.shared.has(binding)) buffer.destroy();
    }
}
