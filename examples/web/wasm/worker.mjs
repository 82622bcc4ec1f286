// A helper thread of a program on shared memory; module.mjs starts it.
import { endOf, importsOf } from './module.mjs';

async function serve({ compiled, memory, index, top, tls, ending }, say) {
    try {
        const { exports } = await WebAssembly.instantiate(compiled, importsOf(compiled, memory, console.log));
        exports.__stack_pointer.value = top;
        exports.__wasm_init_tls(tls);
        say('ready');
        exports.firn_serve(index);
    } catch (error) {
        tell(memory, ending >>> 0, endOf(error).message);
    }
}

/** Writes how this thread ended the program, unless another thread has done so. */
function tell(memory, ending, sentence) {
    const state = new Int32Array(memory.buffer, ending, 1), room = new Uint8Array(memory.buffer, ending + 4, 4091);
    if (Atomics.compareExchange(state, 0, 0, 1) !== 0) return;
    room.set(new TextEncoder().encode(sentence).subarray(0, room.length));
    Atomics.store(state, 0, 2);
}

if (typeof process === 'object' && process.versions?.node)
    import('node:worker_threads').then(({ parentPort, workerData }) => {
        serve(workerData, (text) => parentPort.postMessage(text));
    });
else globalThis.onmessage = ({ data }) => serve(data, (text) => globalThis.postMessage(text));
