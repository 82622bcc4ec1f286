// The page. Its address can set: program=NAME, a folder in programs/; case=FOLDER with particles from files (see
// scene.mjs); paused=1; and any control by its name: particles=10000, cells=32, time_step=1e-4, ... (see controls.mjs).
//
// Tests and the console can use `firn`: ready (a promise), simulation, device, pause(), resume(), restart(),
// await step(n), await positions(), await centreOfMass(), project(point), figures, error. document.body.dataset.state
// becomes "running" with the first picture, or "failed" with a sentence in dataset.reason.
import { OrbitCamera } from './camera.mjs';
import { Controls, withUnit } from './controls.mjs';
import { Player } from './player.mjs';
import { listen } from './pointer.mjs';
import { fullSpeed, ramp } from './render.mjs';
import { scenes, youngPoisson } from './scene.mjs';

const figuresMilliseconds = 250;
const byId = (id) => document.getElementById(id);
const parameters = new URLSearchParams(location.search);
const canvas = byId('view'), camera = new OrbitCamera();
const controls = new Controls(byId('controls'), changed);
const from = { url: 'program', folder: parameters.get('case') };
const player = new Player(canvas, camera, controls, from, { failed, loaded });
let moreMaterial = ''; // the program whose material's further controls are shown

// ---- errors ----

function failed(error) {
    console.info(error);
    byId('notice_text').textContent = error.message;
    byId('notice_restart').hidden = !navigator.gpu;
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

// ---- programs ----

/** The names of the folders in programs/, if the server lists them. */
async function programNames() {
    for (const list of ['programs/', 'programs/index.json']) {
        const names = await fetch(list).then((answer) => answer.json()).catch(() => null);
        if (Array.isArray(names)) return names.filter((name) => !/^2d/.test(name));
    }
    return [];
}

/** A title made from the name of a program, the material first. */
function programTitle(name) {
    const [, transfer, force, material, walls, field] =
        /^3d_.+?_(apic|pic)_(mls|weight_gradient)_(.+?)(?:_walls_([a-z]+))?_(attraction|gravity)$/.exec(name) ?? [];
    if (!material) return name;
    const pointer = field === 'gravity' ? 'no pointer' : '';
    return [material, transfer.toUpperCase(), force.replace('mls', 'MLS'), walls, pointer].filter((part) => part)
        .join(', ').replaceAll('_', ' ');
}

/** The program that the scenes were made for, or the one most similar to it. */
function usualProgram(names) {
    const words = ['_apic_', '_mls_', '_fixed_corotated_', '_attraction', '_separate'];
    const likeness = (name) => words.filter((word) => name.includes(word)).length;
    return names.reduce((best, name) => (likeness(name) > likeness(best) ? name : best), names[0]);
}

async function choosePrograms() {
    const names = await programNames(), asked = parameters.get('program');
    controls.setOptions('program', names.map((name) => [name, programTitle(name)]));
    controls.show('program', names.length > 1);
    if (asked || names.length) controls.set('program', asked || usualProgram(names));
}

function loaded(manifest) {
    byId('subtitle').textContent = [manifest.material.replaceAll('_', ' '), manifest.transfer.toUpperCase(),
        from.folder ? 'a case from files' : ''].filter((word) => word).join(' · ');
    const value = (name) => manifest.uniforms.fields.find((field) => field.name === name)?.default;
    const hasLame = value('material_mu') !== undefined && value('material_lambda') !== undefined;
    for (const name of ['young', 'poisson']) controls.show(name, hasLame);
    for (const name of ['bodies', 'particles', 'cells']) controls.show(name, !from.folder);
    controls.showGroup('Scene', !from.folder);
    controls.showGroup('Pointer', player.hasForce);
    byId('force_keys').hidden = !player.hasForce;
    controls.show('schedule', 'step_sorted' in manifest);
    // Controls for further parameters of the material.
    if (moreMaterial === manifest.name) return;
    moreMaterial = manifest.name;
    controls.removeGroup('More of the material');
    const more = manifest.uniforms.fields.filter(({ name, type }) => name.startsWith('material_') && type === 'f32' &&
        !['material_mu', 'material_lambda'].includes(name));
    if (!more.length) return;
    // Further parameters, such as those of plasticity, suit only the stiffness that is the default of the material.
    if (hasLame) {
        const stiffness = youngPoisson(value('material_mu'), value('material_lambda'));
        for (const name of ['young', 'poisson']) if (!parameters.has(name)) controls.set(name, stiffness[name]);
    }
    const group = controls.addGroup('More of the material', more.map(({ name, unit, default: value }) => ({
        name, unit, label: name.slice('material_'.length).replaceAll('_', ' '), kind: 'number',
        value: Number(value.toPrecision(6)) })));
    document.querySelector('fieldset[data-group="Material"]').after(group);
}

// ---- controls ----

function changed(name, { scene }) {
    if (name === 'program') from.url = `programs/${controls.values.program}`;
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

let wantsPause = parameters.has('paused') ? parameters.get('paused') !== '0'
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

const figures = Object.fromEntries([['particles', 'particles'], ['time', 'simulated time'], ['frame', 'frame'],
    ['step', 'step'], ['rate', 'particle steps'], ['bound', 'time step’s bound']].map(([name, label]) => {
    const row = document.createElement('div'), term = document.createElement('dt'), text = document.createElement('dd');
    term.textContent = label;
    row.append(term, text);
    byId('figures').append(row);
    return [name, text];
}));

function showFigures() {
    const { simulation, bound, figures: { frame, step, rate, time } } = player;
    const milliseconds = (x) => (Number.isFinite(x) ? `${x.toFixed(x < 10 ? 2 : 1)} ms` : '–');
    const texts = { particles: simulation ? simulation.particles.toLocaleString('en').replaceAll(',', ' ') : '–',
        time: `${time.toFixed(3)} s`, frame: milliseconds(frame), step: milliseconds(step),
        rate: Number.isFinite(rate) ? withUnit(rate, '/s') : '–', bound: withUnit(bound, 's') };
    for (const [name, text] of Object.entries(texts))
        if (figures[name].textContent !== text) figures[name].textContent = text;
    const dt = simulation?.values.time_step, exceeds = dt > bound * 1.0001;
    byId('warning').hidden = !exceeds;
    const warning = exceeds ? `The time step of ${withUnit(dt, 's')} is above its bound of ${withUnit(bound, 's')}: ` +
        'make it shorter, or the material softer.' : '';
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
    controls.show('program', false); // until the programs are known
    controls.setOptions('bodies', Object.entries(scenes).map(([name, { title }]) => [name, title]));
    requireWebGpu();
    await choosePrograms();
    controls.read(parameters);
    showLegend();
    if (controls.values.program) from.url = `programs/${controls.values.program}`;
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
