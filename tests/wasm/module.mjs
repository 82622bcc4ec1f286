// node --test tests/wasm/module.mjs: runs program.cpp, which build.sh has compiled to build/wasm/program.wasm.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { load, ModuleError, whyNoThreads } from '../../examples/web/wasm/module.mjs';

const name = fileURLToPath(new URL('../../build/wasm/program', import.meta.url));
const mebibyte = 2 ** 20;

/** Calls f(module), then ends the module's threads. */
async function using(options, f) {
    const module = await load(name, options);
    try {
        return await f(module);
    } finally {
        module.end();
    }
}
const hex = (bits) => BigInt.asUintN(64, bits).toString(16);

for (const threads of [1, 2])
    test(`the bits of a native build after 200 steps, on ${threads} thread(s)`, () => using({ threads }, (module) => {
        const { call } = module;
        assert.equal(module.threads, threads);
        assert.equal(hex(call.mpm(threads)), hex(call.mpm_stored()));
        assert.equal(hex(call.points(threads)), hex(call.points_stored()));
    }));

test('loops run on the threads that were asked for', async () => {
    for (const threads of [1, 2, 3])
        await using({ threads }, ({ call }) => {
            assert.equal(call.threads_of_loops(), threads);
            assert.equal(call.chunks_of_helper() > 0, threads > 1);
        });
});
test('threads allocate memory and make variables without harm to each other', () => using({ threads: 2 }, ({ call }) => {
    assert.equal(call.spoilt_blocks(), 0);
    assert.equal(call.made_once(), 1);
}));
test('without shared memory there is one thread, and the reason is said', async () => {
    const kept = globalThis.SharedArrayBuffer;
    delete globalThis.SharedArrayBuffer;
    try {
        assert.match(whyNoThreads(), /no shared memory.*Cross-Origin-Opener-Policy/);
        const module = await load(name, { threads: 2 });
        assert.equal(module.threads, 1);
        assert.equal(module.call.threads_of_loops(), 1);
        assert.ok(module.numbers(Uint8Array, 0, 1).buffer instanceof ArrayBuffer);
    } finally {
        globalThis.SharedArrayBuffer = kept;
    }
    assert.equal(whyNoThreads(), null);
});

const ends = {
    bad_cell_size: 'The cell size is -1 m; it must be positive and finite.',
    bad_particle: 'Before step 0, at 0 s: 1 of 1 particle is not finite, or left the domain. The first is particle 0 at '
        + '(0.5, 0.5, 0.5) m with velocity (nan, 0, 0) m/s, J = 1: not finite: its velocity. No step has done this: look '
        + 'at set_states(), edit_particles(), a restored state and the moduli.',
    throw_number: 'The program threw a value of the type i, which says nothing.',
    fill_memory: 'The program needs more memory than the 64 MiB (67108864 bytes) that the page gives it. Make the scene '
        + 'smaller.',
    large_grid: 'This grid would need 931 GiB (1000000000000 bytes) of memory; there are at most 64 MiB (67108864 bytes) '
        + 'here. Choose larger cells.',
    overflow_stack: 'The program made a mistake that ended it: memory access out of bounds',
};
for (const threads of [1, 2])
    for (const [what, sentence] of Object.entries(ends))
        test(`${what} ends the module with its sentence, on ${threads} thread(s)`, () => (
            using({ threads, memory: 64 * mebibyte }, (module) => {
                assert.throws(() => module.call[what](1e8), new ModuleError(sentence));
                assert.equal(module.ended.message, sentence);
                assert.throws(() => module.call.threads_of_loops(), new ModuleError(sentence));
                assert.throws(() => module.allocate(8), new ModuleError(sentence));
            })));

const endsOfHelper = {
    throw_on_helper: 'The helper threw this: ν ≥ ½.',
    trap_on_helper: 'The program made a mistake that ended it: unreachable',
};
for (const [what, sentence] of Object.entries(endsOfHelper)) {
    test(`${what} ends the call on the main thread`, () => using({ threads: 2 }, (module) => {
        assert.throws(() => module.call[what](), new ModuleError(sentence));
        assert.throws(() => module.call.threads_of_loops(), new ModuleError(sentence));
    }));
    test(`${what} does nothing without a helper`, () => using({}, ({ call }) => call[what]()));
}
test('end() ends the module', async () => {
    const module = await load(name, { threads: 2 });
    module.end();
    assert.throws(() => module.call.threads_of_loops(), /ended by end\(\)/);
});

test('numbers, texts and lines come out, and numbers go in', async () => {
    const lines = [];
    await using({ log: (line) => lines.push(line) }, (module) => {
        const { call } = module;
        assert.equal(module.text(call.greeting()), 'grüß dich');
        assert.deepEqual([...module.numbers(Float32Array, call.numbers(4), 4)], [0, 1, 2, 3]);
        const count = 10 * mebibyte; // the memory grows
        assert.equal(module.numbers(Float32Array, call.numbers(count), count)[count - 1], count - 1);
        const pointer = module.allocate(12);
        module.numbers(Float32Array, pointer, 3).set([1, 2, 4]);
        assert.equal(call.sum(pointer, 3), 7);
        module.release(pointer);
        call.write_lines();
    });
    assert.deepEqual(lines, ['first line', 'second line']);
});
test('only functions of the program are offered', () => using({}, ({ call }) => {
    assert.ok('mpm' in call && !Object.keys(call).some((key) => /^(_|firn_)/.test(key)));
}));
test('wrong options and files are refused', async () => {
    for (const threads of [0, 1.5, 65, '2', NaN])
        await assert.rejects(load(name, { threads }), /threads are asked for; give a whole number from 1 to 64/);
    await assert.rejects(load(`${name}_not`), { code: 'ENOENT' });
});
