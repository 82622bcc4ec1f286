// What examples/web/firn.mjs promises, on a device, with a program of four lines a kernel. Run through firn_dawn.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import process from 'node:process';
import { test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { FirnError, Program, Simulation, checkLimits, gridOf, requestDevice } from '../../examples/web/firn.mjs';
import { Run, Source } from '../../examples/web/sources.mjs';

const dawn = await import(pathToFileURL(join(process.env.FIRN_WEBGPU, 'node_modules/webgpu/index.js')));
Object.assign(globalThis, dawn.globals);
const gpu = dawn.create(['backend=vulkan']);

// The workgroups are of one invocation, so that few particles already need a second row of them.
const manifest = {
    format: 1, name: 'of the test', code: 'program.wgsl', dimension: 2, workgroup_size: 1,
    uniforms: { binding: 0, bytes: 56, fields: [
        { name: 'particles', type: 'u32', offset: 0 }, { name: 'capacity', type: 'u32', offset: 4 },
        { name: 'nodes', type: 'vec2<u32>', offset: 8 }, { name: 'gravity', type: 'vec2<f32>', offset: 16 },
        { name: 'time_step', type: 'f32', offset: 24, default: 0.5 }, { name: 'cell_size', type: 'f32', offset: 28 },
        { name: 'place_per_velocity', type: 'f32', offset: 32 }, { name: 'stiffness', type: 'f32', offset: 36 },
        { name: 'cells', type: 'vec2<f32>', offset: 40 },
        { name: 'stop_at', type: 'u32', offset: 48, default: 1000000 },
    ] },
    buffers: [
        { name: 'motion', binding: 1, per: 'particle', type: 'f32', components: [
            { name: 'place', count: 2 }, { name: 'corner', count: 2 }, { name: 'mass', count: 1 }] },
        { name: 'visits', binding: 2, per: 'particle', type: 'u32', components: [{ name: 'visits', count: 1 }] },
        { name: 'echo', binding: 3, per: 'program', type: 'u32', count: 14 },
        { name: 'status', binding: 4, per: 'program', type: 'u32', count: 4 },
        { name: 'coordinates', binding: 5, per: 'axis_node', type: 'f32', count: 1 },
    ],
    kernels: [
        { entry: 'visit', per: 'particle', bindings: [
            { binding: 0, access: 'uniform' }, { binding: 2, access: 'read_write' },
            { binding: 4, access: 'read_write' }] },
        { entry: 'repeat', per: 'one_workgroup', bindings: [
            { binding: 0, access: 'uniform' }, { binding: 3, access: 'read_write' }] },
    ],
    initialise: ['repeat'], step: ['visit'], status: { error: 0, particle: 1, signal_speed: 2 },
    errors: { 7: 'A particle was visited too often.' },
};
const code = `
@group(0) @binding(0) var<uniform> words: array<vec4<u32>, 4>;
@group(0) @binding(2) var<storage, read_write> visits: array<u32>;
@group(0) @binding(3) var<storage, read_write> echo: array<u32>;
@group(0) @binding(4) var<storage, read_write> status: array<atomic<u32>>;
@compute @workgroup_size(1)
fn visit(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = group.y * groups.x + group.x;
    if (i >= words[0].x) { return; }
    visits[i] += 1u;
    atomicStore(&status[2], bitcast<u32>(1.5f));
    if (i == 3u && visits[i] >= words[3].x) { atomicStore(&status[1], i); atomicStore(&status[0], 7u); }
}
@compute @workgroup_size(1)
fn repeat() { for (var k = 0u; k < 14u; k++) { echo[k] = words[k / 4u][k % 4u]; } }
`;

const domain = { lower: [-1, 2], upper: [0.3, 3], cell_size: 0.1 };
const openDevice = () => requestDevice(gpu, manifest, { particles: 10, domain });
const device = await openDevice();
const program = await Program.create(device, manifest, code);
const create = (particles = 10, more = {}) => Simulation.create(program, { particles, domain, ...more });

test('a shader that does not compile is reported with its line and column', async () => {
    await assert.rejects(Program.create(device, manifest, code.replace('words[0].x', 'nothing')),
        (error) => error instanceof FirnError && /program\.wgsl:9:14: .*nothing/s.test(error.message));
});

test('a kernel that needs another binding than the manifest says is named', async () => {
    const kernels = [manifest.kernels[0], { ...manifest.kernels[1], bindings: [{ binding: 0, access: 'uniform' }] }];
    await assert.rejects(Program.create(device, { ...manifest, kernels }, code), /kernel repeat: .*binding/is);
    await assert.rejects(Program.create(device, { ...manifest, format: 2 }, code), /format 2/);
});

test('uniforms lie where the manifest says, derived ones among them', async () => {
    const simulation = await create(5, { capacity: 8 });
    simulation.set({ gravity: [1.5, -9.75], time_step: 0.25, stiffness: 3 });
    simulation.initialise();
    const words = await simulation.readBuffer('echo'), floats = new Float32Array(words.buffer);
    assert.deepEqual([...words.slice(0, 4)], [5, 8, ...gridOf(domain).nodes]);
    const f = Math.fround;
    assert.deepEqual([...floats.slice(4, 10)], [1.5, -9.75, 0.25, f(0.1), f(2.5), 3]);
    assert.equal(words[12], 1000000);
    simulation.set('particles', 4);
    assert.throws(() => simulation.set('particles', 9), /9 particles do not fit into a capacity of 8/);
    assert.throws(() => simulation.set('nodes', [4, 4]), /cannot change/);
    assert.throws(() => simulation.set('gravty', [0, 0]), /no uniform gravty; there are .*gravity/);
    for (const wrong of [[1], 1, [1, NaN], ['1', '2'], [1, 2, 3]])
        assert.throws(() => simulation.set('gravity', wrong), /gravity is vec2<f32>/);
    for (const wrong of [-1, 0.5, 2 ** 32]) assert.throws(() => simulation.set('stop_at', wrong), /stop_at is u32/);
});

test('the grid is that of firn::Domain', () => {
    const { nodes, cells, coordinates } = gridOf(domain);
    assert.deepEqual(nodes, [4 * (4 + 2), 4 * (3 + 2)]); // 13 and 10 cells in whole blocks, one below, one above
    assert.ok(cells[0] <= (0.3 + 1) / 0.1 && cells[0] > 12.99999 && cells[1] === 10);
    assert.equal(coordinates.length, 24 + 20);
    assert.equal(coordinates[4], -1);
    assert.ok(Math.abs(coordinates[0] + 1.4) < 1e-6 && Math.abs(coordinates[24 + 5] - 2.1) < 1e-6);
    const narrow = gridOf({ lower: [0, 0], upper: [0.7, 1], cell_size: 0.1 }); // 0.7 / 0.1 is a little less than 7
    assert.ok(narrow.cells[0] < 7 && narrow.cells[0] > 6.99999);
    assert.throws(() => gridOf({ lower: [0, 0], upper: [1, 0], cell_size: 0.1 }), FirnError);
});

test('a buffer of distances has as many as the manifest says, or as many as are given', async () => {
    const buffers = [...manifest.buffers, { name: 'distances', binding: 20, per: 'distance', type: 'f32', count: 1 }];
    const withGrids = { ...manifest, buffers, distances: 5 };
    const other = await Program.create(device, withGrids, code);
    for (const [more, count] of [[{}, 5], [{ distances: 7 }, 7]]) {
        const simulation = await Simulation.create(other, { particles: 2, domain, ...more });
        const numbers = Float32Array.from({ length: count }, (_, k) => 0.5 * k);
        simulation.writeBuffer('distances', numbers);
        assert.deepEqual(await simulation.readBuffer('distances'), numbers);
        assert.throws(() => simulation.writeBuffer('distances', new Float32Array(6)), /24|28|20/);
    }
    const size = { capacity: 2, nodes: gridOf(domain).nodes, distances: 2 ** 40 };
    assert.throws(() => checkLimits(withGrids, size, device.limits), /coarser grids of distances/);
});

test('positions are kept as a place in a block, and come back', async () => {
    const simulation = await create(3);
    const position = [-1, 2, -0.55, 2.39999, 0.29999, 2.9];
    simulation.write({ position });
    assert.deepEqual([...await simulation.read('corner')], [0, 0, 4, 0, 12, 8]);
    const back = await simulation.read('position');
    position.forEach((x, k) => assert.ok(Math.abs(back[k] - x) <= 0.1 * 2 ** -22, `${back[k]} is not ${x}`));
});

test('components are read as they were written, and nothing else is touched', async () => {
    const simulation = await create(3, { capacity: 5 });
    simulation.writeBuffer('motion', new Float32Array(25).fill(9));
    simulation.write({ corner: [1, 2, 3, 4, 5, 6] });
    assert.deepEqual([...await simulation.read('corner')], [1, 2, 3, 4, 5, 6]);
    const rows = [9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 1, 3, 5, 9, 9, 2, 4, 6, 9, 9, 9, 9, 9, 9, 9];
    assert.deepEqual([...await simulation.readBuffer('motion')], rows);
    assert.throws(() => simulation.write({ corner: [1] }), /corner has 2 numbers for each of 3 particles/);
    assert.throws(() => simulation.write({ speed: [1, 2, 3] }), /no component speed; .* place, corner, mass, visits/);
    assert.throws(() => simulation.writeBuffer('motion', new Float32Array(3)), /100 bytes, not 12/);
});

test('every particle is visited once a step, in more workgroups than one dimension has', async () => {
    const simulation = await create(70000);
    simulation.step(37); // two submissions of 16 and one of 5
    assert.equal(simulation.steps, 37);
    const visits = await simulation.read('visits');
    assert.equal(visits.length, 70000);
    assert.ok(visits.every((n) => n === 37));
    assert.throws(() => simulation.step(1, 'step_sorted'), /has no schedule step_sorted/);
    assert.throws(() => simulation.run(['visitt']), /has no kernel visitt/);
});

test('an error of the program is thrown with its sentence, the particle and the step', async () => {
    const simulation = await create();
    simulation.set('stop_at', 3);
    simulation.step(2);
    assert.deepEqual(await simulation.check(), { error: 0, particle: 0, signal_speed: 1.5 });
    simulation.step();
    await assert.rejects(simulation.check(),
        { code: 7, particle: 3, step: 3, message: /^A particle was visited too often\. \(particle 3, .* step 3\)$/ });
});

// A set of particles counts its visits, and those of all sets on the grid, of which each knows its number.
const counting = { ...manifest, name: 'another', material: 'gravel', status: { ...manifest.status, set: 3 },
    uniforms: { ...manifest.uniforms,
        fields: [...manifest.uniforms.fields, { name: 'set_number', type: 'u32', offset: 52, default: 0 }] } };
const countingCode = code.replace('atomicStore(&status[1], i)', 'atomicStore(&status[3], words[3].y); $&');

test('sets on one grid share its buffers, and a kernel without particles runs once', async () => {
    const other = await Program.create(device, counting, countingCode);
    const first = await Simulation.create(other, { particles: 10, domain });
    const second = await Simulation.create(other, { particles: 7, capacity: 9, domain }, first);
    assert.deepEqual(first.sets, [first, second]);
    first.run(['visit', 'repeat']);
    assert.deepEqual([...await first.read('visits')], Array(10).fill(1));
    assert.deepEqual([...await second.read('visits')], Array(7).fill(1));
    const echo = await second.readBuffer('echo');
    assert.deepEqual([...echo], [...await first.readBuffer('echo')]);
    assert.deepEqual([echo[0], echo[13]], [10, 0], 'the words of the first set');
    second.run(['repeat']);
    assert.deepEqual([...(await first.readBuffer('echo')).slice(0, 2)], [7, 9], 'and of the second one');
    assert.equal((await first.readBuffer('echo'))[13], 1, 'its set_number');
    second.set('particles', 9);
    second.write({ mass: [8, 9] }, 7);
    second.run(['visit']);
    assert.deepEqual([...await second.read('mass')], [0, 0, 0, 0, 0, 0, 0, 8, 9]);
    assert.deepEqual([...await second.read('visits')], [2, 2, 2, 2, 2, 2, 2, 1, 1]);
    assert.deepEqual([...await first.read('visits')], Array(10).fill(1));
    second.set('stop_at', 3);
    first.step();
    await assert.rejects(first.check(), { message: /\(particle 3 of gravel, at the latest in step 1\)$/ });
});

test('a set that cannot be on a grid is refused', async () => {
    const first = await create(), second = await Simulation.create(program, { particles: 3, domain }, first);
    const refuse = (grid, size, message) => assert.rejects(Simulation.create(program, { particles: 3, ...size }, grid),
        (error) => error instanceof FirnError && message.test(error.message));
    await refuse(first, { nodes: [4, 8] }, /have the same nodes/);
    await refuse(second, { domain }, /with the first one on its grid/);
    for (let k = 0; k < 6; ++k) await Simulation.create(program, { particles: 3, domain }, first);
    await refuse(first, { domain }, /There are 8 sets/);
    assert.equal(first.sets.length, 8);
});

test('bursts of a source are due as those of firn::Source', () => {
    const samples = { position: [0, 0, 1, 0], volume: 0.01 };
    const jet = Source.jet(samples, 0.5, 1000, [3, -4], { start: 1, end: 1.35 });
    assert.equal(jet.rate, 10);
    assert.deepEqual([jet.particles, jet.timeOf(3), jet.next], [2, 1.3, 1]);
    assert.deepEqual([0.999, 1].map((time) => jet.isDue(time)), [false, true]);
    jet.bursts = 4;
    assert.deepEqual([jet.next, jet.isDue(2)], [Infinity, false]);
    const wrong = (change, message) => assert.throws(() => new Source({ samples, density: 1, velocity: [1, 0],
        ...change }), (error) => error instanceof FirnError && message.test(error.message));
    wrong({ samples: { position: [], volume: 1 } }, /no particles/);
    wrong({ rate: 0 }, /0 bursts a second/);
    wrong({ density: NaN }, /NaN kg/);
    wrong({ start: 2, end: 1 }, /from 2 s to 1 s/);
    assert.throws(() => Source.jet(samples, 0.5, 1000, [0, 0]), /speed 0 m/);
    const run = new Run({ sets: [] });
    assert.throws(() => run.addSource({}, jet), /to a set of the run/);
});

test('too many particles are refused before any memory is taken, and as many as fit are not', async () => {
    const fit = 128 * 2 ** 20 / 20; // of 5 floats, at the 128 MiB that every device has for a binding
    const most = Math.floor(fit);
    await assert.rejects(create(most + 1), { limit: 'maxStorageBufferBindingSize', fit: most,
        message: new RegExp(`Buffer motion .* 128\\.0 MiB here: ${most} particles fit`) });
    (await create(most)).destroy();
    await assert.rejects(create(10, { domain: undefined, nodes: [4, 5] }), /multiples of 4/);
    await assert.rejects(create(0), /positive integer/);
    const larger = await requestDevice(gpu, manifest, { particles: most + 1, domain });
    assert.ok(larger.limits.maxStorageBufferBindingSize > 128 * 2 ** 20);
    larger.destroy();
});

test('a lost device is an error that says so, and so is none at all', async () => {
    const other = await openDevice();
    const simulation = await Simulation.create(await Program.create(other, manifest, code), { particles: 10, domain });
    const reading = simulation.read('visits');
    other.destroy();
    await assert.rejects(reading, (error) => error.lost && /device was lost/.test(error.message));
    assert.throws(() => simulation.step(), /device was lost/);
    await assert.rejects(requestDevice(undefined, manifest, { particles: 10, domain }), /no WebGPU here/);
});

test('a command that the device refuses is an error', async () => {
    const other = await openDevice();
    const simulation = await Simulation.create(await Program.create(other, manifest, code), { particles: 10, domain });
    simulation.component('visits').gpu.destroy();
    simulation.step();
    await other.queue.onSubmittedWorkDone();
    await new Promise((resolve) => { setTimeout(resolve, 20); });
    assert.throws(() => simulation.step(), /refused a command/);
    other.destroy();
});
