// Runs the module particles.wasm in a worker of the page particles.mjs. Each message is a job:
//   { id, make: { scene, particles, threads, module } }   makes a scene, and loads the module if need be
//   { id, actions: [[name, ...], ...], steps, draw }      does the actions, takes the steps, and returns what to draw
// and is answered by { id, ...result } or, if the module has thrown, { id, error }.
import { load, whyNoThreads } from './wasm/module.mjs';

let module = null, loaded = '';
const milliseconds = () => performance.now();

function numbers(count) { return [...module.numbers(Float64Array, module.call.live_numbers(), count)]; }

function writeText(text) {
    const bytes = new TextEncoder().encode(text).subarray(0, 256);
    module.numbers(Uint8Array, module.call.live_text(), bytes.length).set(bytes);
    return bytes.length;
}

/** Passes lines of sight on, each as eye and direction. */
function writeRays(...rays) {
    module.numbers(Float64Array, module.call.live_numbers(), 6 * rays.length).set(rays.flat());
}

async function make({ scene, particles, threads, url }) {
    if (!module || module.ended || loaded !== `${threads} ${url}`) {
        module?.end();
        module = await load(url, { threads }).catch((error) => {
            throw new Error(`The scenes cannot be loaded: ${error.message}. examples/web/run.sh builds them, if ` +
                'clang 19 and its libraries for WebAssembly are installed.');
        });
        loaded = `${threads} ${url}`;
    }
    module.call.live_make(writeText(scene), particles, module.threads);
    module.call.live_stage();
    const [dimension, ...rest] = numbers(14), [distance, yaw, pitch, isBox] = rest.slice(9);
    const [target, lower, upper] = [0, 3, 6].map((k) => rest.slice(k, k + 3));
    return { stage: { dimension, target, lower, upper, distance, yaw, pitch, isBox: isBox > 0 },
        threads: module.threads, why: whyNoThreads() };
}

const actions = {
    set: (name, value) => module.call.live_set(writeText(name), value),
    grab: (ray, slope) => {
        writeRays(ray);
        return module.call.live_grab(slope);
    },
    drag: (ray) => {
        writeRays(ray);
        module.call.live_drag();
    },
    release: () => module.call.live_release(),
    pin: (ray, slope) => {
        writeRays(ray);
        return module.call.live_pin(slope);
    },
    cut: (from, to) => {
        writeRays(from, to);
        return module.call.live_cut();
    },
    net: () => {
        const table = module.numbers(Uint32Array, module.call.live_net(), 4).slice();
        return { positions: module.numbers(Float64Array, table[0], table[1]).slice(),
            links: module.numbers(Uint32Array, table[2], table[3]).slice() };
    },
};

/** Copies of what the page draws, to be handed over. */
function pictureOf(knownSurface) {
    const at = module.call.live_draw(), table = module.numbers(Uint32Array, at, 15).slice(), version = table[14];
    const array = (row, Type) => module.numbers(Type, table[2 * row], table[2 * row + 1]).slice();
    const picture = { version };
    for (const [row, name] of ['balls', 'ballKinds', 'vertices', 'vertexKinds'].entries())
        picture[name] = array(row, Float32Array);
    picture.triangles = version === knownSurface ? null : array(4, Uint32Array);
    picture.rods = array(5, Float32Array);
    picture.pins = array(6, Float32Array);
    return picture;
}

function frame({ actions: wanted, steps, surface }) {
    const results = wanted.map(([name, ...values]) => actions[name](...values));
    const start = milliseconds();
    if (steps > 0) module.call.live_step(steps);
    const stepping = milliseconds() - start;
    module.call.live_describe();
    const [time, timeStep, particles, links, held, ...mean] = numbers(8);
    return { results, stepping, figures: { time, timeStep, particles, links, held, mean },
        picture: pictureOf(surface) };
}

async function answer({ id, make: wanted, ...job }) {
    try {
        const result = wanted ? await make(wanted) : frame(job);
        const buffers = Object.values(result.picture ?? {}).map((each) => each?.buffer).filter((buffer) => buffer);
        postMessage({ id, ...result }, buffers);
    } catch (error) {
        postMessage({ id, error: error.message });
    }
}

let busy = Promise.resolve(); // jobs run one after the other
onmessage = ({ data }) => { busy = busy.then(() => answer(data)); };
