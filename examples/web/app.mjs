// The page. Its address can set: program=NAME, a folder in programs/; case=FOLDER with particles from files (see
// scene.mjs); paused=1; and any control by its name: scene=sand, particles=10000, cells=32, ... (see controls.mjs).
//
// Tests and the console can use `firn`: ready (a promise), simulation, device, pause(), resume(), restart(),
// await step(n), await positions(), await centreOfMass(), project(point), figures, error. document.body.dataset.state
// becomes "running" with the first picture, or "failed" with a sentence in dataset.reason.
import { OrbitCamera } from './camera.mjs';
import { Controls, withUnit } from './controls.mjs';
import { figureList, milliseconds, whole } from './figures.mjs';
import { Player } from './player.mjs';
import { listen } from './pointer.mjs';
import { Programs } from './programs.mjs';
import { fullSpeed, ramp } from './render.mjs';
import { longest, plainBox, plainView, scenes, youngPoisson } from './scene.mjs';

const figuresMilliseconds = 250;
const byId = (id) => document.getElementById(id);
const parameters = new URLSearchParams(location.search);
const canvas = byId('view'), camera = new OrbitCamera();
const controls = new Controls(byId('controls'), changed);
const from = { urls: ['program'], folder: parameters.get('case'), scene: '' };
const player = new Player(canvas, camera, controls, from, { failed, loaded, built });
const programs = new Programs();
const askedProgram = parameters.get('program'); // instead of that of the scene
let isFirst = true; // until the values of the address are taken

// ---- errors ----

function failed(error) {
    console.info(error);
    byId('notice_text').textContent = error.message;
    byId('notice_restart').hidden = !navigator.gpu || error.isFinal === true;
    byId('notice').hidden = false;
    if (!player.manifest) byId('subtitle').textContent = '';
    Object.assign(document.body.dataset, { state: 'failed', reason: error.message });
    showState();
}

function requireWebGpu() {
    if (navigator.gpu) return;
    throw new Error(globalThis.isSecureContext
        ? 'This browser has no WebGPU, which computes and draws the simulation. Open the page in a current Chrome, ' +
            'Edge, Safari or Firefox, and switch on WebGPU or hardware acceleration in its settings if needed.'
        : 'Browsers offer WebGPU only to pages from https or localhost: open this page from there.');
}

// ---- scenes and programs ----

const isOfMaterial = (name) => name.startsWith('material_');

/** Throws if the address has a name that means nothing here. */
function checkNames() {
    const known = ['program', 'case', 'paused', ...controls.names];
    const unknown = [...new Set(parameters.keys())].filter((name) => !known.includes(name) && !isOfMaterial(name));
    const list = (names) => names.join(', ');
    if (unknown.length)
        throw new Error(`The address has ${list(unknown)}, which means nothing here. It can have ${list(known)}, and ` +
            'material_… with a parameter of the material.');
    const paused = parameters.get('paused') ?? '0';
    if (!['0', '1'].includes(paused)) throw new Error(`In the address, paused is ${paused}; it must be 0 or 1.`);
}

/** Throws if the address has a parameter that the material does not have. */
function checkMaterialNames(manifest) {
    const known = controls.names.filter(isOfMaterial);
    for (const name of parameters.keys())
        if (isOfMaterial(name) && !known.includes(name))
            throw new Error(`The address has ${name}; the material ${manifest.material} has ` +
                `${known.join(', ') || 'no such parameters'}.`);
}

/** Sets the controls that depend on the scene. */
function useScene(name) {
    from.scene = name;
    const scene = scenes[name];
    controls.set('scene', name);
    controls.setOptions('cells', scene.cells);
    const { title } = scenes[name];
    for (const [control, value] of Object.entries({ speed: 1, radius: 0.2, ...scene.values }))
        if (!isOfMaterial(control)) controls.set(control, value);
    const materials = programs.materialsOf(scene.materials);
    controls.setOptions('material', materials.map((each) => [each, words(each.replace('per_particle_', ''))]));
    controls.set('material', materials[0]);
    const bodies = scene.bodies ?? scene.sets.flatMap((set) => set.bodies);
    controls.show('speed', bodies.some(({ velocity }) => velocity.some((v) => v !== 0)));
    controls.show('material', !askedProgram && !scene.sets);
    canvas.setAttribute('aria-label', `${title}. The arrow keys or a drag turn the view, + and − or the wheel zoom.`);
    usePolicies({ walls: scene.walls });
    lookAround();
}

function lookAround() {
    const [view, box] = from.folder ? [plainView, plainBox] : [scenes[from.scene].view, scenes[from.scene].box];
    camera.look(view, longest(box));
}

const words = (name) => name.replaceAll('_', ' ');

/** Chooses the program with the material that has most of the wanted policies, and shows its policies. */
function usePolicies(wanted) {
    const material = controls.values.material, chosen = programs.nearest(material, wanted);
    for (const name of programs.policies) {
        const options = programs.choices(material, name);
        controls.setOptions(name, options.map((each) => [each, words(each)]));
        controls.set(name, chosen[name]);
        controls.show(name, !askedProgram && !scenes[from.scene].sets && options.length > 1);
    }
    const { sets, walls } = scenes[from.scene];
    // The program of the first set changes velocities at nodes, where walls and obstacle act.
    const all = sets?.map(({ material: each }, k) => programs.nearest(each, k === 0 ? { walls } : {}).program) ??
        [chosen.program];
    from.urls = (askedProgram ? [askedProgram] : all).map((program) => `programs/${program}`);
}

function chosenPolicies() {
    return Object.fromEntries(programs.policies.map((name) => [name, controls.values[name]]));
}

function loaded(manifest) {
    const { title, sets } = scenes[from.scene];
    const material = sets ? [] : [words(manifest.material.replace('per_particle_', ''))];
    byId('subtitle').textContent = [from.folder ? 'a case from files' : title, ...material,
        manifest.transfer.toUpperCase()].join(' · ');
    const value = (name) => manifest.uniforms.fields.find((field) => field.name === name)?.default;
    const hasLame = value('material_mu') !== undefined && value('material_lambda') !== undefined;
    const isScene = !from.folder;
    for (const name of ['young', 'poisson']) controls.show(name, hasLame);
    controls.showGroup('Scene', isScene);
    controls.show('density', isScene);
    controls.showGroup('Material', !sets);
    controls.show('frame', isScene);
    controls.showGroup('Pointer', player.hasForce);
    byId('force_keys').hidden = !player.hasForce;
    controls.show('schedule', 'step_sorted' in manifest);
    controls.removeGroup('More of the material');
    const more = sets ? [] : manifest.uniforms.fields.filter(({ name, type }) => isOfMaterial(name) && type === 'f32' &&
        !['material_mu', 'material_lambda'].includes(name));
    const { values } = scenes[from.scene];
    const isOfAddress = (name) => isFirst && parameters.has(name);
    if (hasLame && isScene) {
        // Further parameters, such as those of plasticity, suit only the stiffness that is the default of the material.
        const stiffness = more.length || !values.young ? youngPoisson(value('material_mu'), value('material_lambda'))
            : values;
        for (const name of ['young', 'poisson']) if (!isOfAddress(name)) controls.set(name, stiffness[name]);
    }
    if (more.length) {
        const group = controls.addGroup('More of the material', more.map(({ name, unit, default: standard }) => ({
            name, unit, label: words(name.slice('material_'.length)), kind: 'number',
            value: (isScene && values[name]) || Number(standard.toPrecision(6)) })));
        document.querySelector('fieldset[data-group="Material"]').after(group);
    }
    if (isFirst) {
        checkMaterialNames(manifest);
        controls.read(parameters, controls.names.filter(isOfMaterial));
    }
    isFirst = false;
}

/** Offers the numbers of particles that the device has room for. */
function built() {
    const options = controls.optionsOf('particles').map(([number, text]) => {
        const refusal = player.refusal(Number(number));
        return [number, refusal ? `${text}: too many here` : text, refusal];
    });
    controls.setOptions('particles', options);
    const refusals = options.map(([, , refusal]) => refusal).filter((refusal) => refusal);
    byId('limit').textContent = refusals[0] ?? '';
    byId('limit').hidden = !refusals.length;
}

/** Lists the programs, and takes the values of the address. */
async function choose() {
    controls.setOptions('scene', Object.entries(scenes).map(([name, { title }]) => [name, title]));
    checkNames();
    await programs.fetchNames();
    controls.set('scene', askedProgram || from.folder ? 'cubes' : 'snow');
    controls.read(parameters, ['scene']);
    const others = ['program', 'case', 'material', ...programs.policies].filter((name) => parameters.has(name));
    if (scenes[controls.values.scene].sets && others.length)
        throw new Error(`The scene ${controls.values.scene} has programs of its own: leave ${others.join(', ')} out ` +
            'of the address, or choose another scene.');
    useScene(controls.values.scene);
    controls.read(parameters, ['material']);
    usePolicies(chosenPolicies());
    const before = controls.names.filter((name) => !isOfMaterial(name) && !['scene', 'material'].includes(name));
    controls.read(parameters, before);
    const asked = chosenPolicies(), found = programs.nearest(controls.values.material, asked);
    const differs = programs.policies.find((name) => parameters.has(name) && found[name] !== asked[name]);
    if (differs && !askedProgram)
        throw new Error(`There is no program with the ${programs.policies.map((name) => `${name} ${asked[name]}`)
            .join(', ')} and the material ${controls.values.material}; 06_emit_wgsl --list prints those there are.`);
    usePolicies(asked);
}

// ---- controls ----

function changed(name, { scene }) {
    if (name === 'scene') useScene(controls.values.scene);
    if (name === 'material') usePolicies(chosenPolicies());
    // What was chosen last counts more than the others.
    if (programs.policies.includes(name)) usePolicies({ ...chosenPolicies(), first: name });
    if (name === 'pointer') showState();
    if (scene) restart();
    else player.apply(name);
    if (name === 'colour') showLegend();
}

function restart() {
    byId('notice').hidden = true;
    player.error = null;
    player.paused = wantsPause;
    return player.restart().then(showState, () => {}); // failed() has shown the error
}

let wantsPause = parameters.has('paused') ? parameters.get('paused') === '1'
    : matchMedia('(prefers-reduced-motion: reduce)').matches;

function setPaused(paused) {
    if (!player.simulation || (player.error && !paused)) return;
    player.paused = wantsPause = paused;
    showState();
}

async function single() {
    setPaused(true);
    if (!player.error) await player.step(1).catch(() => {});
    showState();
}

const actions = { ' ': () => setPaused(!player.paused), r: restart, s: single };

document.addEventListener('keydown', (event) => {
    const action = actions[event.key.toLowerCase()];
    if (!action || event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest('input:not([type=range]), select, button')) return; // these use the keys themselves
    event.preventDefault();
    action();
});
const buttons = { pause: actions[' '], single, restart, notice_restart: restart };
for (const [id, action] of Object.entries(buttons)) {
    byId(id).addEventListener('click', (event) => {
        if (event.detail) event.currentTarget.blur(); // after a click the space bar still pauses
        action();
    });
}

listen(canvas, camera, () => (player.simulation && player.hasForce ? controls.values.pointer : 'orbit'), (force) => {
    player.setForce(force);
    const ring = byId('ring'), { clientWidth: width, clientHeight: height } = canvas;
    ring.hidden = force.sign === 0 || !player.simulation || !player.hasForce;
    if (ring.hidden) return;
    const distance = camera.ray(force.x, force.y, width / height).distance;
    const pixels = controls.values.radius / (distance * camera.tangent(width / height)) * height / 2;
    Object.assign(ring.style, { width: `${2 * pixels}px`, height: `${2 * pixels}px`, transform:
        `translate(${width * (1 + force.x) / 2 - pixels}px, ${height * (1 - force.y) / 2 - pixels}px)` });
    ring.classList.toggle('repel', force.sign < 0);
});

const dark = matchMedia('(prefers-color-scheme: dark)');
const showTheme = () => player.setTheme(dark.matches ? 'dark' : 'light');
dark.addEventListener('change', showTheme);

// ---- figures ----

const showTexts = figureList(byId('figures'), [['particles', 'particles'], ['time', 'simulated time'],
    ['frame', 'frame'], ['step', 'step'], ['rate', 'particle steps'], ['time_step', 'time step'],
    ['bound', 'its bound']]);

function showFigures() {
    const { simulation, bound, paused, figures: { frame, step, rate, time, time_step: taken, ...steps } } = player;
    showTexts({ particles: whole(player.particles),
        time: `${time.toFixed(3)} s`, frame: milliseconds(frame), step: milliseconds(step),
        rate: Number.isFinite(rate) ? withUnit(rate, '/s') : '–', time_step: withUnit(taken, 's'),
        bound: withUnit(bound, 's') });
    const slowness = steps.needed / steps.taken, isSlow = Boolean(simulation) && !paused && slowness > 1.5;
    byId('warning').hidden = !isSlow;
    const warning = isSlow ? `A frame should take ${steps.needed} steps and takes ${steps.taken}: the simulation ` +
        `runs ${slowness.toFixed(1)} times slower than asked for.` : '';
    if (byId('warning').textContent !== warning) byId('warning').textContent = warning;
}

function showState() {
    const stuck = Boolean(player.error) || !player.simulation;
    byId('pause').textContent = player.paused ? 'Play' : 'Pause';
    byId('pause').disabled = byId('single').disabled = stuck;
    byId('restart').disabled = !navigator.gpu;
    canvas.classList.toggle('force', controls.values.pointer !== 'orbit');
    if (!stuck) Object.assign(document.body.dataset, { state: 'running', reason: '' });
    showFigures();
}

function showLegend() {
    byId('legend').hidden = controls.values.colour !== 'speed';
    byId('legend_end').textContent = `${fullSpeed} m/s`;
    document.querySelector('.ramp').style.background = `linear-gradient(to right, ${ramp.join(', ')})`;
}

// ---- start ----

async function start() {
    showTheme();
    showState();
    requireWebGpu();
    await choose().catch((error) => { throw Object.assign(error, { isFinal: true }); });
    showLegend();
    player.paused = wantsPause;
    await player.restart();
    player.draw();
    showState();
    setInterval(showFigures, figuresMilliseconds);
}

const ready = start();
ready.catch((error) => { if (error !== player.error) failed(error); });
globalThis.firn = {
    ready,
    get simulation() { return player.simulation; },
    get device() { return player.device; },
    get figures() { return { ...player.figures, bound: player.bound }; },
    get error() { return player.error; },
    pause: () => setPaused(true), resume: () => setPaused(false), restart,
    step: (count) => player.step(count).finally(showState),
    positions: () => player.positions(), centreOfMass: () => player.centreOfMass(),
    /** The place of a point [m] on the canvas, in CSS pixels from the upper left corner. */
    project: (point) => {
        const { clientWidth: width, clientHeight: height } = canvas, [x, y] = camera.project(point, width / height);
        return [width * (1 + x) / 2, height * (1 - y) / 2];
    },
};
