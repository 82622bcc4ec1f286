// The page of particles. firn, compiled to WebAssembly, computes in a worker; this page draws and passes the pointer
// on. Its address can set: scene=NAME, particles=NUMBER, threads=NUMBER, tool=drag, pin, cut or turn, paused=1, and any
// control by its name: wind=3, drag=1.2, ...
//
// Tests and the console can use `live`: ready (a promise), pause(), resume(), restart(), await step(n), figures, stage,
// await act([name, ...], ...) with the actions of particles_worker.mjs, project(point), ray(x, y), drawing(n), error.
// document.body.dataset.state becomes "running" with the first picture, or "failed" with a sentence in dataset.reason.
import { OrbitCamera } from './camera.mjs';
import { Controls } from './controls.mjs';
import { figureList, milliseconds, whole } from './figures.mjs';
import { Painter } from './particles_draw.mjs';

const module = 'programs/wasm/particles';
const frame = 1 / 60; // s; steps are a whole fraction of it
const mostFrames = 2; // that one picture catches up
const reachPixels = 14; // the pointer takes points within this distance
const turnPerPixel = 0.007; // rad
const figuresMilliseconds = 250;

const forces = ['gravity', 'wind', 'drag'];
const numbers = (...all) => all.map((n) => [String(n), n.toLocaleString('en').replaceAll(',', ' ')]);
const squares = (...all) => all.map((n) => [String(n * n), `${n} × ${n}`]);
/** The scenes: their particles, the controls that they show and what these are at the start, and how slow they run. */
const scenes = {
    balls: { title: 'Balls (2D)', particles: numbers(1000, 3000, 10_000),
        values: { gravity: 9.8, wind: 0, drag: 0.5, friction: 0.2, restitution: 0.5 } },
    bodies: { title: 'Ropes, soft bodies, ragdolls (2D)', particles: null,
        values: { gravity: 9.8, wind: 0, drag: 0.5, friction: 0.5, restitution: 0.1, iterations: 8, tear: 3 } },
    cloth: { title: 'Cloth', particles: squares(32, 48, 64, 128), usual: 48 * 48,
        values: { gravity: 9.8, wind: 2, drag: 1.2, friction: 0.4, iterations: 8, tear: 1.6 } },
    pile: { title: 'Pile of soft bodies', particles: numbers(1500, 4000, 10_000),
        values: { gravity: 9.8, friction: 0.4, restitution: 0, iterations: 4, tear: 3 } },
    fountain: { title: 'Fountain', particles: null,
        values: { gravity: 9.8, wind: 0.5, drag: 0.5, friction: 0.3, restitution: 0.3, rate: 1200, lifespan: 3,
            maximum: 6000, variance: 0.2 } },
    snow: { title: 'Snow (material point method)', slow: 3, particles: numbers(8000, 20_000, 50_000),
        values: { gravity: 9.8, friction: 0.5 } },
    jelly: { title: 'Jelly (material point method)', particles: numbers(8000, 20_000, 50_000),
        values: { gravity: 9.8, friction: 0.3 } },
};
const hasPoints = (scene) => scene !== 'snow' && scene !== 'jelly';
const hasLinks = (scene) => 'tear' in scenes[scene].values;
const tools = { drag: 'Drag', pin: 'Pin', cut: 'Cut', turn: 'Turn' };
const mostThreads = Math.min(navigator.hardwareConcurrency || 1, 8);

const table = [
    { group: 'Scene', controls: [
        { name: 'scene', label: 'Scene', kind: 'select', wide: true, value: 'cloth',
            options: Object.entries(scenes).map(([name, { title }]) => [name, title]) },
        { name: 'particles', label: 'Particles', kind: 'select', whole: true, value: '0', options: [] },
        { name: 'threads', label: 'Threads', kind: 'select', whole: true, value: String(Math.min(mostThreads, 4)),
            options: Array.from({ length: mostThreads }, (_, k) => [String(k + 1), String(k + 1)]) },
    ] },
    { group: 'Air and gravity', controls: [
        { name: 'wind', label: 'Wind', kind: 'range', min: -10, max: 10, step: 0.1, value: 0, unit: 'm/s' },
        { name: 'drag', label: 'Drag coefficient', kind: 'range', min: 0, max: 3, step: 0.05, value: 0.5 },
        { name: 'gravity', label: 'Gravity', kind: 'range', min: 0, max: 20, step: 0.1, value: 9.8, unit: 'm/s²' },
    ] },
    { group: 'Contact and links', controls: [
        { name: 'friction', label: 'Friction', kind: 'range', min: 0, max: 1, step: 0.05, value: 0.3 },
        { name: 'restitution', label: 'Restitution', kind: 'range', min: 0, max: 0.95, step: 0.05, value: 0.3 },
        { name: 'iterations', label: 'Iterations', kind: 'range', min: 1, max: 30, step: 1, value: 8 },
        { name: 'tear', label: 'Tear factor (3: never)', kind: 'range', min: 1.05, max: 3, step: 0.05,
            value: 3 },
    ] },
    { group: 'Emitters', controls: [
        { name: 'rate', label: 'Rate', kind: 'range', min: 50, max: 4000, step: 50, value: 1200, unit: '/s' },
        { name: 'lifespan', label: 'Lifespan', kind: 'range', min: 0.5, max: 6, step: 0.1, value: 3, unit: 's' },
        { name: 'maximum', label: 'Maximum', kind: 'range', min: 100, max: 10_000, step: 100, value: 6000 },
        { name: 'variance', label: 'Variance', kind: 'range', min: 0, max: 1, step: 0.05, value: 0.2 },
    ] },
];
const parametersOf = (scene) => Object.keys(scenes[scene].values);

const byId = (id) => document.getElementById(id);
const canvas = byId('view'), camera = new OrbitCamera();
const controls = new Controls(byId('controls'), changed, table);
const address = new URLSearchParams(location.search);

let painter = null, stage = null, figures = {}, error = null;
let paused = address.has('paused') ? address.get('paused') !== '0'
    : matchMedia('(prefers-reduced-motion: reduce)').matches;
let tool = 'drag', builds = 0, threads = { count: 1, why: null };
let dirty = true, pending = false, actions = [], surface = 0, owed = 0; // owed: time that has not been stepped [s]
const times = { frame: NaN, step: NaN, last: NaN };

// ---- the worker ----

let worker = null, jobs = new Map(), nextJob = 0;

function startWorker() {
    worker?.terminate();
    for (const { refuse } of jobs.values()) refuse(new Error('The scene was started again.'));
    jobs = new Map();
    const made = worker = new Worker(new URL('particles_worker.mjs', import.meta.url), { type: 'module' });
    made.onmessage = ({ data: { id, error: sentence, ...result } }) => {
        const job = jobs.get(id);
        if (made !== worker || !job) return;
        jobs.delete(id);
        if (sentence) job.refuse(new Error(sentence));
        else job.done(result);
    };
    made.onerror = (event) => {
        for (const { refuse } of jobs.values())
            refuse(new Error(`The worker of the page cannot run: ${event.message ?? 'a file is missing'}.`));
        jobs.clear();
    };
}

/** Sends a job to the worker. Resolves to its result. */
function ask(job) {
    return new Promise((done, refuse) => {
        const id = ++nextJob;
        jobs.set(id, { done, refuse });
        worker.postMessage({ id, ...job });
    });
}

// ---- the scene ----

async function restart() {
    const build = ++builds;
    const { scene, particles, threads: wanted } = controls.values;
    if (!worker || error) startWorker();
    byId('notice').hidden = true;
    error = stage = null;
    actions = [];
    surface = owed = 0;
    try {
        const url = new URL(module, location.href).href;
        const many = scenes[scene].particles ? particles : 0;
        const made = await ask({ make: { scene, particles: many, threads: wanted, url } });
        if (build !== builds) return;
        stage = made.stage;
        threads = { count: made.threads, why: made.why };
        painter.setStage(stage);
        if (lookedAt !== scene) lookAt(scene);
        actions = parametersOf(scene).map((name) => ['set', name, controls.values[name]]);
        await advance(0);
        showState();
    } catch (problem) {
        if (build === builds && problem !== error) failed(problem);
    }
}

let lookedAt = '';
function lookAt(scene) {
    lookedAt = scene;
    const { yaw, pitch, target, lower, upper } = stage;
    Object.assign(camera, { yaw, pitch, target: [...target], distance: stage.distance });
    if (stage.isBox) { // a narrow picture shows all of it, too
        const aspect = canvas.clientWidth / canvas.clientHeight, [width, , depth] = upper.map((x, a) => x - lower[a]);
        const half = (width * Math.cos(yaw) + depth * Math.abs(Math.sin(yaw))) / 2;
        camera.distance = Math.max(camera.distance, half / (camera.tangent(aspect) * aspect) + depth / 4);
    }
    fit();
}
/** Brings the whole of a 2D scene into the picture. */
function fit() {
    if (stage?.dimension !== 2) return;
    const aspect = canvas.clientWidth / canvas.clientHeight, half = camera.tangent(aspect), margin = 1.06;
    const [width, height] = [0, 1].map((a) => stage.upper[a] - stage.lower[a]);
    Object.assign(camera, { yaw: 0, pitch: 0 });
    camera.distance = Math.max(height / 2 * 1.3, width / 2 * margin / aspect) / half;
}

/** Sends the actions that wait, and takes steps. Returns the results of the actions. */
async function advance(steps) {
    const wanted = actions.splice(0), build = builds;
    const result = await ask({ actions: wanted, steps, surface }).catch((problem) => {
        if (build === builds) failed(problem);
        throw problem;
    });
    if (build !== builds) return [];
    figures = { ...result.figures, scene: lookedAt };
    surface = result.picture.version;
    painter.show(result.picture);
    dirty = true;
    if (steps > 0) times.step = smooth(times.step, result.stepping / steps);
    return result.results;
}
const smooth = (mean, value) => (Number.isFinite(mean) ? 0.9 * mean + 0.1 * value : value);

function loop(now) {
    requestAnimationFrame(loop);
    if (!stage) return;
    if (!pending && !error && (!paused || actions.length)) {
        const since = Number.isFinite(times.last) ? (now - times.last) / 1000 : frame;
        times.last = paused ? NaN : now;
        owed = paused ? 0 : Math.min(owed + since, mostFrames * frame);
        const frames = Math.floor(owed / frame + 0.01);
        owed = Math.max(owed - frames * frame, 0);
        if (frames > 0) times.frame = smooth(times.frame, 1000 * since);
        if (frames > 0 || actions.length) {
            pending = true;
            advance(frames * stepsAFrame()).catch(() => {}).finally(() => { pending = false; });
        }
    }
    const look = [camera.yaw, camera.pitch, camera.distance, canvas.clientWidth, canvas.clientHeight].join();
    if (!dirty && look === loop.look) return;
    if (look !== loop.look) fit();
    loop.look = look;
    draw();
}
const slowness = () => scenes[controls.values.scene].slow ?? 1;
const stepsAFrame = () => (figures.timeStep ? Math.max(Math.round(frame / figures.timeStep / slowness()), 1) : 0);

function draw() {
    painter.draw(camera);
    dirty = false;
}

/** Pauses and takes `count` steps. Resolves when they are drawn. */
async function step(count) {
    setPaused(true);
    while (pending) await new Promise((done) => { setTimeout(done, 2); });
    for (let left = count; left > 0 && !error; left -= 200) await advance(Math.min(left, 200)).catch(() => {});
    draw();
    showState();
    if (error) throw error;
}

// ---- errors and state ----

function failed(problem) {
    console.info(problem);
    error = problem;
    byId('notice_text').textContent = problem.message;
    byId('notice_restart').hidden = !painter;
    byId('notice').hidden = false;
    Object.assign(document.body.dataset, { state: 'failed', reason: problem.message });
    showState();
}

function setPaused(wanted) {
    if (!stage || (error && !wanted)) return;
    paused = wanted;
    times.last = NaN;
    showState();
}

function showState() {
    const stuck = Boolean(error) || !stage;
    byId('pause').textContent = paused ? 'Play' : 'Pause';
    byId('pause').disabled = byId('single').disabled = stuck;
    byId('restart').disabled = !painter;
    byId('subtitle').textContent = stage
        ? scenes[controls.values.scene].title + (slowness() > 1 ? `, slowed ${slowness()} times` : '') : 'starting …';
    if (!stuck) Object.assign(document.body.dataset, { state: 'running', reason: '' });
    byId('warning').hidden = !threads.why;
    if (threads.why && byId('warning').textContent !== threads.why) byId('warning').textContent = threads.why;
    showFigures();
}

const showTexts = figureList(byId('figures'), [['particles', 'particles'], ['links', 'links'],
    ['time', 'simulated time'], ['frame', 'frame'], ['step', 'step'], ['threads', 'threads']]);

function showFigures() {
    showTexts({ particles: whole(figures.particles), links: whole(figures.links),
        time: `${(figures.time ?? 0).toFixed(2)} s`, frame: milliseconds(times.frame), step: milliseconds(times.step),
        threads: String(threads.count) });
}

// ---- controls ----

/** Shows the controls of a scene, with the values that it starts with unless the address has set them. */
function showScene(scene) {
    const { particles, usual, values } = scenes[scene];
    if (particles) controls.setOptions('particles', particles);
    controls.show('particles', Boolean(particles));
    if (particles && !address.has('particles')) controls.set('particles', String(usual ?? particles[0][0]));
    for (const { group, controls: all } of table.slice(1)) {
        for (const { name } of all) {
            controls.show(name, name in values);
            if (name in values && !address.has(name)) controls.set(name, values[name]);
        }
        controls.showGroup(group, all.some(({ name }) => name in values));
    }
    for (const [name, allowed] of [['pin', hasPoints(scene)], ['cut', hasLinks(scene)],
        ['turn', !['balls', 'bodies'].includes(scene)]]) {
        byId(`tool_${name}`).parentElement.hidden = !allowed;
        if (!allowed && tool === name) chooseTool('drag');
    }
}

function changed(name) {
    if (name === 'scene') {
        for (const each of controls.names) address.delete(each); // what the address said was for another scene
        showScene(controls.values.scene);
    }
    if (['scene', 'particles', 'threads'].includes(name)) {
        times.frame = times.step = NaN;
        restart();
    } else actions.push(['set', name, controls.values[name]]);
}

/** Takes what the address says. Throws an Error if it cannot be. */
function readAddress() {
    const known = [...controls.names, 'tool', 'paused'];
    for (const name of address.keys())
        if (!known.includes(name))
            throw new Error(`In the address, ${name} is not known; there can be ${known.join(', ')}.`);
    const chosen = address.get('tool') ?? 'drag';
    if (!(chosen in tools))
        throw new Error(`In the address, tool is ${chosen}; it can be ${Object.keys(tools).join(', ')}.`);
    const scene = address.get('scene') ?? controls.values.scene;
    if (!(scene in scenes))
        throw new Error(`In the address, scene is ${scene}; it can be ${Object.keys(scenes).join(', ')}.`);
    showScene(scene);
    controls.read(address, controls.names);
    for (const name of ['particles', 'threads'])
        if (!(Number.isInteger(controls.values[name]) && controls.values[name] >= (name === 'threads' ? 1 : 0)))
            throw new Error(`In the address, ${name} is ${address.get(name)}; it must be a whole number above 0.`);
    chooseTool(chosen);
}

// ---- the pointer ----

for (const [name, title] of Object.entries(tools)) {
    const properties = { type: 'radio', name: 'tool', id: `tool_${name}`, value: name };
    const input = Object.assign(document.createElement('input'), properties);
    const label = document.createElement('label');
    label.append(input, title);
    input.addEventListener('change', () => chooseTool(name));
    byId('tools').append(label);
}

function chooseTool(name) {
    finish();
    tool = name;
    byId(`tool_${name}`).checked = true;
    for (const each of Object.keys(tools)) canvas.classList.toggle(each, each === name);
}

/** The line of sight through a point of the canvas [pixels], as eye and direction. */
function ray(x, y) {
    const { clientWidth: width, clientHeight: height } = canvas;
    const { direction } = camera.ray(2 * x / width - 1, 1 - 2 * y / height, width / height);
    return [...camera.frame().eye, ...direction];
}
/** How far from the line of sight the pointer reaches, per distance. */
const slope = () => reachPixels * 2 * camera.tangent(canvas.clientWidth / canvas.clientHeight) / canvas.clientHeight;

let using = null; // what the pointer does now: { tool, last: [x, y], path }

function begin(x, y) {
    if (!stage || error) return;
    using = { tool, last: [x, y], path: [[x, y]] };
    if (tool === 'drag') actions.push(['grab', ray(x, y), slope()]);
    if (tool === 'pin') actions.push(['pin', ray(x, y), slope()]);
}
function move(x, y) {
    if (!using) return;
    if (using.tool === 'drag') {
        if (actions.at(-1)?.[0] === 'drag') actions.pop(); // only the latest place counts
        actions.push(['drag', ray(x, y)]);
    }
    if (using.tool === 'cut' && Math.hypot(x - using.last[0], y - using.last[1]) >= 3) {
        actions.push(['cut', ray(...using.last), ray(x, y)]);
        using.path.push([x, y]);
        showPath(using.path.slice(-60));
    } else if (using.tool === 'cut') return;
    using.last = [x, y];
}
function finish() {
    if (using?.tool === 'drag') actions.push(['release']);
    using = null;
    showPath([]);
}
const showPath = (path) => byId('path').firstElementChild.setAttribute('points', path.map((x) => x.join()).join(' '));

const pointers = new Map(); // pointers that are down: id to [x, y]
const placeOf = (event) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
};
const spread = () => {
    const [[ax, ay], [bx, by]] = pointers.values();
    return Math.max(Math.hypot(ax - bx, ay - by), 1);
};
let turning = null; // id of the pointer that turns the view
canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, placeOf(event));
    byId('cross').hidden = true;
    if (pointers.size > 1) return finish(); // two fingers zoom and turn
    if (event.button === 2 || tool === 'turn') turning = event.pointerId;
    else begin(...placeOf(event));
});
canvas.addEventListener('pointermove', (event) => {
    const before = pointers.get(event.pointerId), now = placeOf(event);
    if (!before) return;
    const apart = pointers.size === 2 ? spread() : 0;
    pointers.set(event.pointerId, now);
    const isFlat = stage?.dimension === 2;
    if (!isFlat && (turning === event.pointerId || pointers.size === 2)) {
        const part = turnPerPixel / pointers.size;
        camera.turn((before[0] - now[0]) * part, (now[1] - before[1]) * part);
    }
    if (apart) zoom(apart / spread());
    else if (turning !== event.pointerId) {
        // Chromium joins several movements into one event; a cut follows each of them.
        const all = event.getCoalescedEvents?.() ?? [];
        for (const each of all.length ? all : [event]) move(...placeOf(each));
    }
});
for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) canvas.addEventListener(end, (event) => {
    if (!pointers.delete(event.pointerId)) return;
    if (turning === event.pointerId) turning = null;
    if (pointers.size === 0) finish();
});
const zoom = (factor) => {
    if (stage?.dimension === 3) camera.zoom(factor);
};
canvas.addEventListener('contextmenu', (event) => event.preventDefault());
canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoom(Math.exp(event.deltaY * (event.deltaMode ? 0.04 : 0.0012)));
}, { passive: false });

// ---- the keys ----

const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const cross = [NaN, NaN];
canvas.addEventListener('keydown', (event) => {
    const { key } = event, element = byId('cross');
    if (key === '+' || key === '=') zoom(0.92);
    if (key === '-') zoom(1 / 0.92);
    if (key in arrows) {
        event.preventDefault();
        const way = arrows[key];
        if (tool === 'turn') return camera.turn(-0.08 * way[0], -0.08 * way[1]);
        const size = [canvas.clientWidth, canvas.clientHeight], pixels = event.shiftKey ? 40 : 10;
        for (const a of [0, 1]) {
            const moved = Math.min(Math.max(cross[a] + pixels * way[a], 0), size[a]);
            cross[a] = Number.isFinite(moved) ? moved : size[a] / 2; // it starts in the middle
        }
        element.hidden = false;
        element.style.transform = `translate(${cross[0]}px, ${cross[1]}px)`;
        move(...cross);
    }
    if (key === 'Enter' && Number.isFinite(cross[0]) && !element.hidden) {
        if (using || tool === 'pin') {
            if (tool === 'pin') begin(...cross);
            finish();
        } else begin(...cross);
        element.classList.toggle('busy', Boolean(using));
    }
    if (key === 'Escape') {
        finish();
        element.hidden = true;
        element.classList.remove('busy');
    }
});

const single = () => step(1).catch(() => {});
const keys = { ' ': () => setPaused(!paused), r: restart, s: single };
Object.keys(tools).forEach((name, k) => {
    keys[String(k + 1)] = () => { if (!byId(`tool_${name}`).parentElement.hidden) chooseTool(name); };
});
document.addEventListener('keydown', (event) => {
    const action = keys[event.key.toLowerCase()];
    if (!action || event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest('input:not([type=range], [type=radio]), select, button, a')) return; // they use the keys
    event.preventDefault();
    action();
});
const buttons = { pause: keys[' '], single, restart, notice_restart: restart };
for (const [id, action] of Object.entries(buttons)) byId(id).addEventListener('click', (event) => {
    if (event.detail) event.currentTarget.blur(); // after a click the space bar still pauses
    action();
});

const dark = matchMedia('(prefers-color-scheme: dark)');
function showTheme() {
    if (painter) painter.theme = dark.matches ? 'dark' : 'light';
    dirty = true;
}
dark.addEventListener('change', showTheme);

// ---- start ----

async function start() {
    showState();
    readAddress();
    painter = new Painter(canvas);
    canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => {
        painter.start();
        painter.setStage(stage);
        surface = 0; // the triangles are needed again
        actions.push(['release']);
    });
    showTheme();
    await restart();
    requestAnimationFrame(loop);
    setInterval(showFigures, figuresMilliseconds);
}

const ready = start();
ready.catch(failed);
globalThis.live = {
    ready,
    get figures() { return { ...figures, frameTime: times.frame, stepTime: times.step, threads: threads.count }; },
    get stage() { return stage; },
    get error() { return error; },
    pause: () => setPaused(true), resume: () => setPaused(false), restart, step,
    /** Does actions of the worker, and resolves to their results. */
    act: (...wanted) => {
        actions.push(...wanted);
        return advance(0);
    },
    /** The place of a point [m] on the canvas, in CSS pixels from the upper left corner. */
    project: (point) => {
        const { clientWidth: width, clientHeight: height } = canvas, [x, y] = camera.project(point, width / height);
        return [width * (1 + x) / 2, height * (1 - y) / 2];
    },
    ray,
    /** The mean time of `count` drawings [ms]. */
    drawing: (count) => {
        draw();
        painter.finish();
        const from = performance.now();
        for (let k = 0; k < count; ++k) {
            draw();
            painter.finish();
        }
        return (performance.now() - from) / count;
    },
};
