// Runs emitted WGSL programs against numbers from the CPU: in node (Dawn, compiler Tint) or Deno (wgpu, compiler naga).
//
//   run.mjs [--time STEPS] FOLDER...                 runs each FOLDER's case.json
//   run.mjs --validate [--expect-invalid] PATH...    only compiles: PATH is a program's folder or a .wgsl file
//   run.mjs --pairwise FOLDER...                     compiles so many of the programs that all pairs of choices occur
//
// FOLDER holds program.wgsl, manifest.json, little-endian binary files and case.json:
//   { "particles": N, "capacity": N, "uniforms": { "nodes": [..], "time_step": 1e-4, .. },
//     "inputs": { "motion": "motion.bin", .. },   whole buffers or single components
//     "steps": 50, "schedule": "step",
//     "error": 2,                                 the status that the steps must end with; 0 if left out
//     "expect": [ { "buffer": "nodes", "after": "p2g", "file": "nodes.bin", "exactly": true },
//                 { "buffer": "motion", "after": "step", "steps": 1, "file": "motion_1.bin", "tolerance": 1e-6 } ] }
// "buffer" may also be a component, or "position" in cells from the lower corner, all numbers of particle 0 first; or a
// word of the status that is a float.
// "after" is a kernel of the schedule, or the schedule, in the step number "steps" (the last one if left out), or
// "initialise". "exactly" compares 32-bit words; "tolerance" is the largest |a - b| between floats.
// The environment's FIRN_WEBGPU names the folder that cmake/webgpu.sh made. Exit status: 1 if anything differs.
import { existsSync, readFileSync } from 'node:fs';
import { basename, join, resolve } from 'node:path';
import process from 'node:process';
import { pathToFileURL } from 'node:url';
import { Program, Simulation } from '../../examples/web/firn.mjs';

const isDeno = 'Deno' in globalThis;
const shown = 3; // differences per comparison

async function openGpu(backend) {
    if (isDeno) return navigator.gpu;
    const folder = process.env.FIRN_WEBGPU;
    if (!folder) throw new Error('FIRN_WEBGPU is not set: run this through firn_dawn of cmake/webgpu.sh.');
    const dawn = await import(pathToFileURL(join(folder, 'node_modules/webgpu/index.js')));
    Object.assign(globalThis, dawn.globals);
    return dawn.create([`backend=${backend}`]);
}

async function openDevice(gpu) {
    const adapter = await gpu.requestAdapter();
    if (!adapter) throw new Error('There is no WebGPU adapter.');
    const { description, device } = adapter.info;
    return { device: await adapter.requestDevice(), name: description || device };
}

const readJson = (path) => JSON.parse(readFileSync(path, 'utf8'));

function readProgram(folder) {
    const manifest = readJson(join(folder, 'manifest.json'));
    return { manifest, code: readFileSync(join(folder, manifest.code), 'utf8') };
}

let passed = 0, failed = 0;
function report(good, text) {
    console.log(`${good ? 'ok  ' : 'FAIL'} ${text.split('\n\n')[0]}`); // after an empty line Tint lists all overloads
    if (good) ++passed;
    else ++failed;
}

// ---- comparing ----

/** The words to compare: of a buffer per particle only those of particles that are there. */
function* wordsOf(simulation, name, length) {
    const buffer = simulation.manifest.buffers.find((each) => each.name === name);
    const stride = buffer?.per === 'particle' ? simulation.capacity : length;
    const used = buffer?.per === 'particle' ? simulation.particles : length;
    for (let row = 0; row < length; row += stride) for (let i = 0; i < used; ++i) yield row + i;
}

/** A whole buffer, or a component (all of particle 0 first); "position" is place + corner, in cells. */
async function numbersOf(simulation, name) {
    if (simulation.manifest.buffers.some((buffer) => buffer.name === name)) return simulation.readBuffer(name);
    if (name in simulation.manifest.status) return Float32Array.of((await simulation.status())[name]);
    if (name !== 'position') return simulation.read(name);
    const corner = await simulation.read('corner');
    return (await simulation.read('place')).map((place, k) => place + corner[k]);
}

async function compare(simulation, folder, expectation) {
    const { buffer, file, exactly, tolerance, after } = expectation;
    if ((exactly === true) === (tolerance !== undefined))
        throw new Error(`${file}: say either "exactly" or "tolerance".`);
    const got = await numbersOf(simulation, buffer);
    const bytes = readFileSync(join(folder, file));
    const title = `${buffer} after ${after}${expectation.steps ? ` (step ${expectation.steps})` : ''}`;
    if (bytes.byteLength !== got.byteLength)
        return report(false, `${title}: ${got.byteLength} bytes, and ${file} has ${bytes.byteLength}`);
    const raw = new Uint8Array(bytes).buffer;
    const expected = new got.constructor(raw);
    const gotWords = new Uint32Array(got.buffer), expectedWords = new Uint32Array(raw);
    const different = [];
    let compared = 0, largest = 0, unlike = 0;
    for (const k of wordsOf(simulation, buffer, got.length)) {
        ++compared;
        const difference = Math.abs(got[k] - expected[k]);
        if (difference > largest) largest = difference;
        // Written so that a NaN differs.
        if (exactly ? gotWords[k] === expectedWords[k] : difference <= tolerance) continue;
        if (++unlike <= shown) different.push(`[${k}] ${got[k]}, expected ${expected[k]}`);
    }
    const asked = exactly ? 'exactly' : `to ${tolerance}`;
    if (compared === 0) report(false, `${title}: nothing to compare`);
    else if (unlike === 0) report(true, `${title}: ${compared} equal ${asked}, largest difference ${largest}`);
    else {
        const some = different.join('; ');
        report(false, `${title}: ${unlike} of ${compared} not equal ${asked}: ${some}; largest difference ${largest}`);
    }
}

// ---- running ----

async function runCase(device, folder, timedSteps) {
    const { manifest, code } = readProgram(folder), test = readJson(join(folder, 'case.json'));
    const { particles = test.uniforms.particles, capacity = particles } = test;
    const { schedule = 'step', steps = 1, expect = [] } = test;
    const program = await Program.create(device, manifest, code);
    const { nodes, blocks } = test.uniforms;
    const simulation = await Simulation.create(program, { particles, capacity, nodes, blocks });
    simulation.set(test.uniforms);
    for (const [name, file] of Object.entries(test.inputs ?? {})) {
        const bytes = readFileSync(join(folder, file)), { buffer } = new Uint8Array(bytes);
        if (manifest.buffers.some((each) => each.name === name)) simulation.writeBuffer(name, bytes);
        else simulation.write({ [name]: new Float32Array(buffer) });
    }
    const left = new Set(expect);
    const compareThose = async (step, after) => {
        for (const expectation of expect) {
            const at = expectation.after === 'initialise' ? 0 : expectation.steps ?? steps;
            if (at !== step || expectation.after !== after) continue;
            left.delete(expectation);
            await compare(simulation, folder, expectation);
        }
    };
    simulation.initialise();
    await compareThose(0, 'initialise');
    const stops = new Set([steps, ...expect.map((each) => each.steps ?? steps)].filter((n) => n > 0));
    for (const stop of [...stops].sort((a, b) => a - b)) {
        const kernels = manifest[schedule] ?? [];
        const inside = expect.some((each) => (each.steps ?? steps) === stop && kernels.includes(each.after));
        simulation.step(stop - simulation.steps - (inside ? 1 : 0), schedule);
        if (inside) {
            for (const kernel of kernels) {
                simulation.run([kernel]);
                await compareThose(stop, kernel);
            }
            ++simulation.steps;
        }
        await compareThose(stop, schedule);
    }
    for (const { buffer, after } of left) report(false, `${buffer} after ${after}: no such kernel in ${schedule}`);
    await checkStatus(simulation, test.error ?? 0);
    if (timedSteps) await time(simulation, schedule, timedSteps);
    simulation.destroy();
}

async function checkStatus(simulation, expected) {
    try {
        await simulation.check();
        report(expected === 0, expected ? `status: no error, expected error ${expected}` : 'status: no error');
    } catch (error) {
        if (error.code === undefined) throw error;
        const other = expected === error.code ? '' : `, expected ${expected || 'none'}`;
        report(!other, `status: error ${error.code}${other}: ${error.message}`);
    }
}

async function time(simulation, schedule, steps) {
    const finish = () => simulation.device.queue.onSubmittedWorkDone();
    simulation.step(Math.min(steps, 3), schedule);
    await finish();
    const start = performance.now();
    simulation.step(steps, schedule);
    await finish();
    const each = (performance.now() - start) / steps;
    console.log(`     ${each.toFixed(3)} ms a step: ${simulation.particles} particles, ${steps} steps`);
    await simulation.check();
}

// ---- compiling only ----

/** A .wgsl file alone: every entry point with the bindings that the compiler finds. */
async function compileFile(device, path) {
    const code = readFileSync(path, 'utf8');
    device.pushErrorScope('validation');
    const module = device.createShaderModule({ code });
    const { messages } = await module.getCompilationInfo();
    const lines = messages.filter(({ type }) => type === 'error')
        .map((m) => `${path}:${m.lineNum}:${m.linePos}: ${m.message.trim()}`);
    const error = await device.popErrorScope();
    if (lines.length || error) throw new Error(lines.join('\n') || `${path}: ${error.message}`);
    for (const [, entryPoint] of code.matchAll(/@compute[^{;]*?\bfn\s+(\w+)/g))
        await device.createComputePipelineAsync({ layout: 'auto', compute: { module, entryPoint } })
            .catch((cause) => { throw new Error(`${path}: kernel ${entryPoint}: ${cause.message.trim()}`); });
}

async function compileProgram(device, folder) {
    const { manifest, code } = readProgram(folder);
    await Program.create(device, { ...manifest, code: join(folder, manifest.code) }, code);
}

/** Some of the programs, so that every pair of choices (a transfer and a material, say) is in at least one of them. */
function pairwise(folders) {
    const factors = ['dimension', 'kernel', 'transfer', 'force', 'material', 'boundary', 'field'];
    const pairsOf = (folder) => {
        const manifest = readJson(join(folder, 'manifest.json'));
        return factors.flatMap((a, i) => factors.slice(i + 1).map((b) => `${a} ${manifest[a]}, ${b} ${manifest[b]}`));
    };
    const candidates = folders.map((folder) => ({ folder, pairs: pairsOf(folder) }));
    const open = new Set(candidates.flatMap(({ pairs }) => pairs)), chosen = [];
    while (open.size) {
        const gain = ({ pairs }) => pairs.filter((pair) => open.has(pair)).length;
        const best = candidates.reduce((a, b) => (gain(b) > gain(a) ? b : a));
        best.pairs.forEach((pair) => open.delete(pair));
        chosen.push(best.folder);
    }
    return chosen;
}

async function validate(device, path, invalid) {
    const name = basename(resolve(path));
    try {
        if (path.endsWith('.wgsl')) await compileFile(device, path);
        else await compileProgram(device, path);
        report(!invalid, `${name}: ${invalid ? 'compiles, and must not' : 'compiles'}`);
    } catch (error) {
        // Only what a compiler says counts as a rejection, not a missing file.
        const rejected = !(error instanceof SyntaxError) && error.code === undefined;
        report(invalid && rejected, `${name}: ${invalid && rejected ? 'is rejected: ' : ''}${error.message}`);
    }
}

// ---- the command line ----

function readArguments(words) {
    const options = { paths: [], validate: false, invalid: false, time: 0 };
    for (let i = 0; i < words.length; ++i) {
        if (words[i] === '--validate') options.validate = true;
        else if (words[i] === '--expect-invalid') options.validate = options.invalid = true;
        else if (words[i] === '--pairwise') options.validate = options.pairwise = true;
        else if (words[i] === '--time') options.time = Number(words[++i]);
        else if (words[i].startsWith('-')) throw new Error(`run.mjs does not know ${words[i]}.`);
        else options.paths.push(words[i]);
    }
    if (!options.paths.length || !Number.isInteger(options.time))
        throw new Error('run.mjs [--time STEPS] | [--validate] [--expect-invalid] FOLDER...');
    for (const path of options.paths) if (!existsSync(path)) throw new Error(`There is no ${path}.`);
    if (options.pairwise) options.paths = pairwise(options.paths);
    return options;
}

async function main() {
    const options = readArguments(process.argv.slice(2));
    const gpu = await openGpu(options.validate ? 'null' : 'vulkan');
    let opened = await openDevice(gpu);
    console.log(`${isDeno ? 'Deno' : 'Dawn'} on ${opened.name}`);
    for (const path of options.paths) {
        if (!options.validate) console.log(`${basename(resolve(path))}:`);
        try {
            if (options.validate) await validate(opened.device, path, options.invalid);
            else await runCase(opened.device, path, options.time);
        } catch (error) {
            report(false, `${basename(resolve(path))}: ${error.message}`);
            if (error.lost) opened = await openDevice(gpu);
        }
    }
    opened.device.destroy();
    console.log(`${passed} passed, ${failed} failed`);
    process.exitCode = failed || !passed ? 1 : 0;
}

await main();
