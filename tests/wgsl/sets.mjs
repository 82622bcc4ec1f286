// Several sets of particles on one grid, with a source, by examples/web/firn.mjs and sources.mjs: the bits of the CPU.
//
//   sets.mjs FOLDER
//
// firn_webgpu_tank has written FOLDER. Run through firn_dawn of cmake/webgpu.sh.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import process from 'node:process';
import { pathToFileURL } from 'node:url';
import { Program, Simulation, requestDevice } from '../../examples/web/firn.mjs';
import { Run, Source } from '../../examples/web/sources.mjs';
import { runTests } from './chromium.mjs';

const dawn = await import(pathToFileURL(join(process.env.FIRN_WEBGPU, 'node_modules/webgpu/index.js')));
Object.assign(globalThis, dawn.globals);
const gpu = dawn.create(['backend=vulkan']);
const [folder] = process.argv.slice(2);
const read = (...path) => readFileSync(join(folder, ...path));
const { domain, source, time, steps, start, end } = JSON.parse(read('sets.json'));
const names = ['fluid', 'sand', 'snow', 'fixed_corotated'];
const numbersIn = (file, Type) => new Type(new Uint8Array(read(file)).buffer);
const manifests = names.map((name) => JSON.parse(read(name, 'manifest.json')));
const poured = 3 * source.position.length / 2;

const device = await requestDevice(gpu, manifests[0], { particles: 10_000, domain });
const programs = await Promise.all(names.map((name, k) =>
    Program.create(device, manifests[k], read(name, 'program.wgsl').toString())));

/** Calls f(component, from its rows in a file: number c of particle i). */
function forComponents(manifest, files, f) {
    for (const { name: buffer, components = [] } of manifest.buffers) {
        if (!files[buffer]) continue;
        const numbers = numbersIn(files[buffer], Float32Array);
        let row = 0;
        for (const component of components) {
            const first = row;
            f(component, (i, c) => numbers[(first + c) * files.particles + i]);
            row += component.count;
        }
    }
}

const matrix = { 9: 4, 4: 3 };
const lacking = ({ count, less_one }, c) => Number(less_one === true && c % (matrix[count] ?? 1) === 0);

/** The tank and its run, until a time [s]. `batches`: how many steps each call of advance() takes. */
async function pour(batches, schedule = 'step', until = time) {
    let first = null;
    for (const [k, name] of names.entries()) {
        const files = start[name], { particles } = files;
        const capacity = particles + (name === source.set ? poured : 1);
        const set = await Simulation.create(programs[k], { particles, capacity, domain }, first);
        first ??= set;
        forComponents(manifests[k], files, (component, at) => {
            const { count } = component;
            set.write({ [component.name]: Float32Array.from({ length: count * particles }, (_, j) =>
                at(Math.floor(j / count), j % count) + lacking(component, j % count)) });
        });
        set.set('time_step', 1);
    }
    first.initialise();
    const run = new Run(first, () => schedule), { position, volume, density, velocity, rate } = source;
    run.addSource(first.sets[names.indexOf(source.set)], new Source({ samples: { position, volume }, density, velocity,
        rate, start: source.start, end: source.end }));
    while (run.time < until) await run.advance(until - run.time, batches);
    return run;
}

/** Compares all numbers of the particles with the CPU's, particle by particle, by their ids. */
async function compare({ simulation }) {
    let compared = 0;
    for (const [k, name] of names.entries()) {
        const set = simulation.sets[k], files = end[name], before = numbersIn(start[name].ids, Uint32Array);
        assert.equal(set.particles, files.particles, `particles of ${name}`);
        const ids = [...before, ...Array.from({ length: set.particles - before.length }, (_, i) => before.length + i)];
        const indexOf = new Map(ids.map((id, i) => [id, i]));
        const index = Array.from(numbersIn(files.ids, Uint32Array), (id) => indexOf.get(id));
        const rows = {}; // as they are on the device
        for (const { name: buffer } of manifests[k].buffers)
            if (files[buffer]) rows[buffer] = await set.readBuffer(buffer);
        forComponents(manifests[k], files, ({ name: component, count }, at) => {
            const { row } = set.component(component);
            const buffer = manifests[k].buffers.find(({ components = [] }) =>
                components.some((each) => each.name === component)).name;
            let unlike = 0, example = '';
            for (let i = 0; i < index.length; ++i) for (let c = 0; c < count; ++c, ++compared) {
                const got = rows[buffer][(row + c) * set.capacity + index[i]], expected = at(i, c);
                if (got === expected) continue; // 0 and -0 are equal
                ++unlike;
                example ||= `number ${c} of particle ${index[i]}: ${got}, expected ${expected}`;
            }
            assert.equal(unlike, 0, `${name}, ${component}: ${unlike} numbers differ, such as ${example}`);
        });
    }
    return compared;
}

await runTests({
    async 'four sets and a source take the steps of the CPU, to the bit'() {
        const run = await pour(Infinity);
        assert.equal(run.steps, steps);
        assert.equal(run.time, time);
        assert.equal(run.simulation.sets[0].particles - start.fluid.particles, poured);
        console.log(`     ${steps} steps, ${await compare(run)} numbers`);
        run.simulation.destroy();
    },
    async 'and with any number of steps at once, sorted by block'() {
        const run = await pour(3, 'step_sorted');
        assert.equal(run.steps, steps);
        await compare(run);
        run.simulation.destroy();
    },
    async 'particles that a source has given bound the next step'() {
        const { simulation } = await pour(0, 'step', 0), run = new Run(simulation), due = 1 / 1024;
        run.addSource(simulation.sets[1], new Source({ samples: { position: [0.5, 0.8], volume: 1e-4 }, density: 1600,
            velocity: [0, 60], start: due, end: due }));
        await run.advance(due);
        const { signal_speed: speed } = await simulation.status(), { time_step_safety: safety } = simulation.manifest;
        assert.ok(speed > 60, `the fastest signal has ${speed} m/s`);
        await run.advance(1, 1);
        assert.ok(Math.abs(run.status.time_step * speed / (safety * domain.cell_size) - 1) < 1e-5);
        assert.equal(simulation.sets[1].particles, start.sand.particles + 1);
        simulation.setTimeLeft(0.1);
        const { time_left: high, time_left_low: low } = await simulation.status();
        assert.ok(high !== 0.1 && Math.abs(high + low - 0.1) < 1e-15, `${high} + ${low} s are left`);
        simulation.destroy();
    },
});
device.destroy();
