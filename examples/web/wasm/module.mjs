// Loads a program of firn's that build.sh compiled to WebAssembly, in a browser or in node:
//
//     const module = await load('NAME', { threads: 2 });
//     module.call.step(10);                                        // an exported function of the program
//     module.numbers(Float32Array, module.call.positions(), 300);  // a view of the module's memory
//
// If the program throws, the call throws a ModuleError with the exception's sentence; from then on every call does.

const inNode = typeof process === 'object' && Boolean(process.versions?.node);
const page = 65536; // bytes
const firstPages = 512; // as build.sh says

/** The program has ended: it threw an exception, ran out of memory or made a mistake. */
export class ModuleError extends Error {
    name = 'ModuleError';
}

/** Why threads cannot be used here; null if they can. */
export function whyNoThreads() {
    if (typeof SharedArrayBuffer === 'undefined' || !(inNode || globalThis.crossOriginIsolated))
        return 'The page has no shared memory: the server must send the headers Cross-Origin-Opener-Policy: '
            + 'same-origin and Cross-Origin-Embedder-Policy: require-corp.';
    if (!inNode && !(typeof WorkerGlobalScope === 'function' && globalThis instanceof WorkerGlobalScope))
        return 'The page itself may not wait for threads: load the module in a web worker.';
    return null;
}

/**
 * Loads and starts a program.
 * @param name     the URL of NAME.wasm without .wasm; in node also a path
 * @param threads  the number of threads of firn's loops. One if threads cannot be used here: see module.threads.
 * @param memory   the most memory that the program gets [bytes]
 * @param log      called with each line that the program writes
 */
export async function load(name, { threads = 1, memory = 2 ** 31, log = console.log } = {}) {
    if (!(Number.isInteger(threads) && threads >= 1 && threads <= 64))
        throw new RangeError(`${threads} threads are asked for; give a whole number from 1 to 64.`);
    if (whyNoThreads()) threads = 1;
    const bytes = await bytesOf(`${name}.wasm`), shared = threads > 1;
    if (!shared) unshare(bytes, name);
    const compiled = await WebAssembly.compile(bytes);
    const module = new Module(makeMemory(memory, shared), log);
    await module.start(compiled, threads);
    return module;
}

async function bytesOf(name) {
    const url = new URL(name, inNode ? `file://${process.cwd()}/` : globalThis.location.href);
    if (url.protocol === 'file:') return (await import('node:fs/promises')).readFile(url);
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url} cannot be loaded: ${response.status} ${response.statusText}`);
    return new Uint8Array(await response.arrayBuffer());
}

/** Makes the program import a memory that is not shared: clears the bit that says so after the import's names. */
function unshare(bytes, name) {
    const names = [3, ...new TextEncoder().encode('env'), 6, ...new TextEncoder().encode('memory'), 2];
    const shared = 2, at = bytes.findIndex((_, start) => names.every((byte, k) => bytes[start + k] === byte));
    if (at < 0) throw new Error(`${name}.wasm imports no memory; compile it with build.sh.`);
    bytes[at + names.length] &= ~shared;
}

/** A memory that can grow to `bytes`, or to less if the browser does not give that much. */
function makeMemory(bytes, shared) {
    for (let maximum = Math.min(Math.floor(bytes / page), 65536); ; maximum = Math.floor(maximum / 2)) {
        const limits = { initial: firstPages, maximum: Math.max(maximum, firstPages), shared };
        try {
            return { memory: new WebAssembly.Memory(limits), most: limits.maximum * page };
        } catch (error) {
            if (maximum <= firstPages) throw error;
        }
    }
}

/** The text at `pointer`, of `length` bytes or up to the first zero. */
function textAt(memory, pointer, length) {
    const bytes = new Uint8Array(memory.buffer, pointer >>> 0);
    return new TextDecoder().decode(bytes.slice(0, length ?? bytes.indexOf(0)));
}

/** What the program imports. `log` gets the lines that it writes. */
export function importsOf(compiled, memory, log) {
    const open = { 1: '', 2: '' }; // lines that are not yet ended
    const system = {
        clock_time_get(clock, _precision, to) {
            const now = performance.now() + (clock === 0 ? performance.timeOrigin : 0); // ms
            new DataView(memory.buffer).setBigUint64(to >>> 0, BigInt(Math.round(now * 1e6)), true);
            return 0;
        },
        fd_write(file, parts, count, written) {
            if (!(file in open)) return 8; // no such file
            const view = new DataView(memory.buffer);
            let bytes = 0;
            for (let k = 0; k < count; ++k) {
                const at = (parts >>> 0) + 8 * k, length = view.getUint32(at + 4, true);
                open[file] += textAt(memory, view.getUint32(at, true), length);
                bytes += length;
            }
            const lines = open[file].split('\n');
            open[file] = lines.pop();
            lines.forEach((line) => log(line));
            view.setUint32(written >>> 0, bytes, true);
            return 0;
        },
        proc_exit(status) {
            throw new ModuleError(`The program ended itself with status ${status}.`);
        },
    };
    const imports = {
        env: { memory },
        firn: {
            end(pointer, length) {
                throw new ModuleError(textAt(memory, pointer, length));
            },
        },
        wasi_snapshot_preview1: system,
    };
    // There are no files, and no other services of a system.
    for (const { module, name, kind } of WebAssembly.Module.imports(compiled))
        if (module === 'wasi_snapshot_preview1' && kind === 'function') system[name] ??= () => 52; // not supported
    return imports;
}

/** How the program has ended, from what a call threw. */
export function endOf(error) {
    if (error instanceof ModuleError) return error;
    return new ModuleError(`The program made a mistake that ended it: ${error.message}`, { cause: error });
}

class Module {
    /** The program's functions, by name. */
    call = {};
    /** The number of threads of firn's loops. */
    threads = 1;
    /** The ModuleError with which the program ended; null while it runs. */
    ended = null;
    #memory;
    #most;
    #log;
    #exports;
    #helpers = [];

    constructor({ memory, most }, log) {
        this.#memory = memory;
        this.#most = most;
        this.#log = log;
    }

    async start(compiled, threads) {
        const instance = await WebAssembly.instantiate(compiled, importsOf(compiled, this.#memory, this.#log));
        this.#exports = instance.exports;
        for (const [name, value] of Object.entries(instance.exports))
            if (typeof value === 'function' && !/^(_|firn_)/.test(name))
                this.call[name] = (...values) => this.#guarded(value, values);
        this.#guarded(instance.exports.firn_memory, [this.#most]);
        this.#guarded(instance.exports._initialize, []);
        if (threads > 1) await this.#startHelpers(compiled, threads);
    }

    /** The memory's numbers from `pointer` on, as a view. Make a new one after each call: memory may have moved. */
    numbers(Type, pointer, count) {
        return new Type(this.#memory.buffer, pointer >>> 0, count);
    }
    /** The text, ended by a zero, at `pointer`. */
    text(pointer) {
        return textAt(this.#memory, pointer);
    }
    /** The address of new memory, for what is handed to the program. */
    allocate(bytes) {
        return this.#guarded(this.#exports.firn_allocate, [bytes]) >>> 0;
    }
    release(pointer) {
        this.#guarded(this.#exports.firn_release, [pointer]);
    }
    /** Ends the program and its threads. */
    end() {
        this.#end(new ModuleError('The program was ended by end().'));
    }

    #guarded(run, values) {
        this.#look();
        if (this.ended) throw this.ended;
        try {
            return run(...values);
        } catch (error) {
            throw this.#end(endOf(error));
        }
    }
    #end(error) {
        this.ended ??= error;
        for (const helper of this.#helpers) helper.terminate();
        this.#helpers = [];
        return this.ended;
    }
    /** Looks whether another thread has ended the program. */
    #look() {
        if (this.ended || this.#helpers.length === 0) return;
        const at = this.#exports.firn_ending() >>> 0;
        if (Atomics.load(new Int32Array(this.#memory.buffer), at / 4) === 2)
            this.#end(new ModuleError(this.text(at + 4)));
    }

    async #startHelpers(compiled, threads) {
        const url = new URL('worker.mjs', import.meta.url), stack = 2 ** 20;
        const { __tls_size: size, __tls_align: alignment } = this.#exports;
        const started = [];
        for (let index = 1; index < threads; ++index) {
            const top = this.allocate(stack + alignment.value + size.value) + stack;
            const tls = Math.ceil(top / alignment.value) * alignment.value;
            const data = { compiled, memory: this.#memory, index, top: top & ~15, tls, ending: this.#exports.firn_ending() };
            started.push(this.#startHelper(url, data));
        }
        await Promise.all(started);
        this.threads = threads;
        this.#guarded(this.#exports.firn_lend, [threads]);
    }
    async #startHelper(url, data) {
        if (inNode) {
            const { Worker } = await import('node:worker_threads');
            const helper = new Worker(url, { workerData: data });
            this.#helpers.push(helper);
            await new Promise((done, fail) => helper.once('message', done).once('error', fail));
            helper.unref();
        } else {
            const helper = new Worker(url, { type: 'module' });
            this.#helpers.push(helper);
            helper.postMessage(data);
            await new Promise((done, fail) => {
                helper.onmessage = done;
                helper.onerror = (event) => fail(new Error(event.message ?? `${url} cannot be loaded`));
            });
        }
    }
}
