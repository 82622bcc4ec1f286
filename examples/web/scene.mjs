// The scenes: what is in the box at the start, and how it looks. Or particles from files.
import { FirnError } from './firn.mjs';

/** The Lamé parameters [Pa] of Young's modulus [Pa] and Poisson's ratio. */
export const lame = (young, poisson) => ({
    mu: young / (2 * (1 + poisson)),
    lambda: young * poisson / ((1 + poisson) * (1 - 2 * poisson)),
});

/** Young's modulus [Pa] and Poisson's ratio of the Lamé parameters [Pa]. */
export const youngPoisson = (mu, lambda) => ({
    young: mu * (3 * lambda + 2 * mu) / (lambda + mu),
    poisson: lambda / (2 * (lambda + mu)),
});

// Shapes in the cube from -1 to 1: a test whether a point is inside, and the part of the cube that the shape fills.
const tube = 0.32;
const shapes = {
    block: { inside: () => true, part: 1 },
    ball: { inside: ([x, y, z]) => x * x + y * y + z * z <= 1, part: Math.PI / 6 },
    column: { inside: ([x, , z]) => x * x + z * z <= 1, part: Math.PI / 4 },
    ring: {
        inside: ([x, y, z]) => (Math.hypot(x, z) - (1 - tube)) ** 2 + y * y <= tube ** 2,
        part: 2 * Math.PI ** 2 * (1 - tube) * tube ** 2 / 8,
    },
};
const cube = (side) => [side, side, side];

// How particles and what is around them look. radius: of a particle, in spacings; smooth: how far normals
// follow the surface instead of each sphere; shade: how dark crevices are; gloss.
const looks = {
    plain: { bodies: ['#d9703f', '#3d86c6'], radius: 0.62, smooth: 0, shade: 0, gloss: 0.1,
        light: ['#f4f3f0', '#3a3e45'], dark: ['#14161a', '#aab0b8'] },
    snow: { bodies: ['#fbfdff', '#f4f9ff'], radius: 0.85, smooth: 0.8, shade: 1, gloss: 0.02, speckled: true,
        light: ['#b3c3d3', '#33414f'], dark: ['#141a22', '#aab0b8'] },
    sand: { bodies: ['#dcb67a', '#c89a57'], radius: 0.7, smooth: 0.45, shade: 0.8, gloss: 0.03, speckled: true,
        light: ['#e9e6e0', '#3a3e45'], dark: ['#14161a', '#aab0b8'] },
    water: { bodies: ['#2f86c9', '#3c93d2'], radius: 0.9, smooth: 0.92, shade: 0.5, gloss: 0.45, speckled: true,
        light: ['#eef0f1', '#3a3e45'], dark: ['#14161a', '#aab0b8'] },
};
export const plainLook = looks.plain;
export const plainBox = { lower: [0, 0, 0], upper: [1, 1, 1] }; // m

export const plainView = { target: [0.5, 0.42, 0.5], distance: 2.5, yaw: 0.62, pitch: 0.24 };
const elastic = { materials: ['fixed_corotated', 'neo_hookean', 'hencky', 'soft_tissue', 'von_mises'],
    walls: 'separate', box: plainBox, look: looks.plain, view: plainView,
    values: { cells: 64, density: 1000, young: 4e4, poisson: 0.3, frame: 4e-3, time_step: 2.5e-4 },
    cells: [['32', '32³'], ['64', '64³']] };

/** Snow pressed by hand is stiffer and tougher than the snow of the program, and weak here and there. */
const packed = {
    mu: (mu) => 4 * mu, lambda: (lambda) => 4 * lambda, lowest_stretch: (stretch) => 1 - 2 * (1 - stretch),
    highest_stretch: (stretch, strength) => 1 + strength * (stretch - 1),
};

// box [m]; obstacle: where that of the program is [m], if it has one, and its colour; bodies: shape; size of the
// surrounding box [m]; centre [m]; anchor: the point [m] towards which a body shrinks (its centre, if left out); turn
// [rad] about x, then y, then z; velocity [m/s]; jitter: how far particles are off their lattice, 1: anywhere in their
// cell. vary: the fields of a particle from the program's parameter and the particle's strength. cells: the choices
// along the longest edge of the box. values: of the controls. sets: of several materials on one grid, each with its
// bodies, its density [kg/m^3], its material's parameters and what is its own of the look; jet: a disc from which
// particles come, with its velocity [m/s], from `start` to `end` [s]. Walls and obstacle are those of the first set's
// program.
export const scenes = {
    snow: {
        title: 'Snowball', materials: ['per_particle_snow'], walls: 'separate_box', look: looks.snow,
        box: { lower: [0, 0, 0], upper: [4, 4, 4] },
        obstacle: { half_extents: [0.12, 0.7, 0.8], position: [1.1, 0.7, 2], colour: '#9c6248' },
        view: { target: [1.8, 0.62, 2.05], distance: 4.6, yaw: 0.6, pitch: 0.2 },
        bodies: [{ shape: 'ball', size: cube(0.68), centre: [2.3, 1, 2], velocity: [-8, 0.5, 0], jitter: 1 }],
        vary: packed, lump: 0.2, variation: 2,
        cells: [['32', '32³: like soap'], ['64', '64³'], ['128', '128³: breaks']],
        values: { cells: 128, density: 400, frame: 4e-3, time_step: 1e-3, radius: 0.6, material_largest_exponent: 2 },
    },
    sand: {
        title: 'Sand column', materials: ['sand', 'nacc', 'snow'], walls: 'stick', look: looks.sand,
        box: { lower: [0, 0, 0], upper: [1, 0.75, 1] }, view: { ...plainView, target: [0.5, 0.22, 0.5], distance: 2.1 },
        bodies: [{ shape: 'column', size: [0.26, 0.6, 0.26], centre: [0.5, 0.3, 0.5], anchor: [0.5, 0, 0.5],
            velocity: [0, 0, 0], jitter: 1 }],
        cells: [['32', '32 a metre'], ['64', '64 a metre'], ['128', '128 a metre']],
        values: { cells: 64, density: 1600, frame: 5e-3, time_step: 5e-4 },
    },
    dam: {
        title: 'Dam break', materials: ['fluid'], walls: 'separate', look: looks.water,
        box: { lower: [0, 0, 0], upper: [1.2, 0.6, 0.3] }, obstacle: { position: [0.95, 0, 0.15], colour: '#8c6e9c' },
        view: { target: [0.6, 0.24, 0.15], distance: 2.2, yaw: 0.35, pitch: 0.26 },
        bodies: [{ shape: 'block', size: [0.6, 0.4, 0.3], centre: [0.3, 0.2, 0.15], anchor: [0, 0, 0],
            velocity: [0, 0, 0], jitter: 0.6 }],
        cells: [['32', '32 along the tank'], ['64', '64 along the tank'], ['128', '128 along the tank']],
        values: { cells: 64, density: 1000, frame: 8e-3, time_step: 1e-3 },
    },
    cubes: { ...elastic, title: 'Jelly cubes', bodies: [
        { shape: 'block', size: cube(0.28), centre: [0.28, 0.40, 0.47], turn: [0.35, 0.5, 0.2],
            velocity: [2.6, 1.5, 0.1] },
        { shape: 'block', size: cube(0.28), centre: [0.72, 0.52, 0.53], turn: [-0.2, 0.3, 0.6],
            velocity: [-2.6, 1, -0.1] },
    ] },
    ring: { ...elastic, title: 'Ball and ring', bodies: [
        { shape: 'ball', size: cube(0.28), centre: [0.24, 0.42, 0.5], velocity: [3.2, 1.5, 0] },
        { shape: 'ring', size: cube(0.46), centre: [0.70, 0.50, 0.5], turn: [1.32, 0.89, 0],
            velocity: [-1.2, 1.4, 0] },
    ] },
    tank: {
        title: 'Water, sand, snow and jelly', materials: ['fluid'], walls: 'separate_mesh', look: looks.water,
        box: { lower: [0, 0, 0], upper: [1.2, 0.8, 0.6] },
        obstacle: { position: [0.56, 0, 0.3], colour: '#8c6e9c' },
        view: { target: [0.6, 0.27, 0.3], distance: 2.3, yaw: 0.42, pitch: 0.3 },
        sets: [
            { material: 'fluid', density: 1000, bodies: [{ shape: 'block', size: [0.4, 0.15, 0.6],
                centre: [1, 0.075, 0.3], anchor: [1.2, 0, 0], velocity: [0, 0, 0], jitter: 0.6 }],
            jet: { centre: [1.08, 0.66, 0.3], radius: 0.045, velocity: [-1.6, 0.4, 0], start: 0.02, end: 2 } },
            { material: 'sand', density: 1600, look: { ...looks.sand, shade: looks.water.shade },
                bodies: [{ shape: 'block', size: [0.3, 0.24, 0.6], centre: [0.15, 0.12, 0.3], anchor: [0, 0, 0],
                    velocity: [0, 0, 0], jitter: 1 }] },
            { material: 'snow', density: 400, values: { material_largest_exponent: 2 },
                look: { ...looks.snow, shade: looks.water.shade },
                bodies: [{ shape: 'ball', size: cube(0.24), centre: [0.24, 0.58, 0.32], velocity: [0.8, -1, 0],
                    jitter: 1 }] },
            { material: 'fixed_corotated', density: 900, young: 3e4, poisson: 0.3,
                look: { bodies: ['#3fa45b', '#cf4a44'], radius: 0.75, smooth: 0.85, gloss: 0.2, speckled: false },
                bodies: [
                    { shape: 'block', size: cube(0.15), centre: [0.95, 0.34, 0.42], turn: [0.3, 0.5, 0.2],
                        velocity: [0, 0, 0] },
                    { shape: 'ring', size: cube(0.22), centre: [0.8, 0.55, 0.18], turn: [1.1, 0.3, 0],
                        velocity: [0, -0.5, 0] }] },
        ],
        cells: [['32', '32 along the tank'], ['48', '48 along the tank'], ['64', '64 along the tank'],
            ['96', '96 along the tank']],
        values: { cells: 48, frame: 4e-3, time_step: 1e-3, radius: 0.25 },
    },
};

/** The length of the longest edge [m]. */
export const longest = ({ lower, upper }) => Math.max(...lower.map((low, a) => upper[a] - low));

function rotation([a, b, c]) {
    const [ca, sa, cb, sb, cc, sc] = [a, b, c].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
    return ([x, y, z]) => {
        [y, z] = [ca * y - sa * z, sa * y + ca * z];
        [x, z] = [cb * x + sb * z, cb * z - sb * x];
        return [cc * x - sc * y, sc * x + cc * y, z];
    };
}

/** Random numbers from 0 to 1, the same after each call. */
function randomNumbers() {
    let state = 0x9e3779b9;
    return () => {
        state = state + 0x6d2b79f5 | 0;
        let bits = Math.imul(state ^ state >>> 15, state | 1);
        bits ^= bits + Math.imul(bits ^ bits >>> 7, bits | 61);
        return ((bits ^ bits >>> 14) >>> 0) / 2 ** 32;
    };
}

/** Smooth noise of mean 0 and variance 1, a function of a point: waves in random directions, in lumps of a size [m]. */
function noise(lump) {
    const random = randomNumbers(), count = 48;
    const waves = Array.from({ length: count }, () => [0, 0, 0, 0].map(() => Math.PI * (2 * random() - 1)));
    const scale = 1.7 / lump;
    return (x, y, z) => waves.reduce((sum, [a, b, c, phase]) =>
        sum + Math.cos((a * x + b * y + c * z) * scale + phase), 0) / Math.sqrt(count / 2);
}

/** The volume of bodies [m^3]. */
export const bodiesVolume = (bodies) =>
    bodies.reduce((sum, { shape, size: [a, b, c] }) => sum + shapes[shape].part * a * b * c, 0);

/**
 * Fills the bodies of a scene with about `count` particles. Returns position [m], velocity [m/s] and volume [m^3],
 * particle after particle, the body of each particle, its strength, and the spacing [m].
 *
 * A cell has at least 1.75 particles along each axis, because a body with fewer falls apart. Few particles on a fine
 * grid therefore make smaller bodies.
 */
export function fillBodies({ bodies, lump, variation, look }, count, cellSize, speed = 1) {
    const wanted = Math.cbrt(bodiesVolume(bodies) / count), spacing = Math.min(wanted, cellSize / 1.75);
    const position = [], velocity = [], body = [], volume = [], random = randomNumbers();
    bodies.forEach((each, b) => {
        const { shape, centre, anchor = centre, turn = [0, 0, 0], jitter = 0 } = each, turned = rotation(turn);
        const size = each.size.map((length) => length * spacing / wanted);
        const middle = centre.map((x, a) => anchor[a] + (x - anchor[a]) * spacing / wanted);
        const along = size.map((length) => Math.max(1, Math.round(length / spacing)));
        const off = () => jitter * (random() - 0.5);
        const before = body.length;
        for (let i = 0; i < along[0]; ++i) for (let j = 0; j < along[1]; ++j) for (let k = 0; k < along[2]; ++k) {
            const point = [i, j, k].map((n, a) => (2 * (n + off()) + 1) / along[a] - 1);
            if (!shapes[shape].inside(point)) continue;
            const offset = turned(point.map((x, a) => x * size[a] / 2));
            position.push(...offset.map((x, a) => x + middle[a]));
            velocity.push(...each.velocity.map((v) => v * speed));
            volume.push(size[0] * size[1] * size[2] / (along[0] * along[1] * along[2]));
            body.push(look?.speckled ? Number(random() < 0.5) : b);
        }
        if (body.length === before)
            throw new FirnError(`${count} particles are too few for ${bodies.length} bodies.`);
    });
    const of = lump ? noise(lump) : null;
    const strength = Float32Array.from(body, (_, i) =>
        (of ? Math.exp(variation * of(...position.slice(3 * i, 3 * i + 3))) : 1));
    return { particles: body.length, position, velocity, volume, strength, body: Uint32Array.from(body), spacing };
}

/** The parameters of the material that the program has for each particle, by the names of their fields. */
export function variedFields({ vary = {} }, manifest) {
    const uniforms = manifest.uniforms.fields.map(({ name }) => name);
    return manifest.buffers.flatMap(({ components = [] }) => components).map(({ name }) => name)
        .filter((name) => uniforms.includes(`material_${name}`))
        .map((name) => ({ name, value: vary[name] ?? ((x) => x) }));
}

/** Writes the fields of particles that vary, from the uniforms of the simulation. */
export function writeVaried(simulation, scene, { strength }) {
    for (const { name, value } of variedFields(scene, simulation.manifest)) {
        const parameter = simulation.values[`material_${name}`];
        simulation.write({ [name]: Float32Array.from(strength, (s) => value(parameter, s)) });
    }
}

/** Writes the particles of the bodies to the simulation, without strain. `density` is in kg/m^3. */
export function writeBodies(simulation, { particles, position, velocity, volume }, density) {
    simulation.write({ ...simulation.atRest(particles), position, velocity, volume,
        mass: volume.map((v) => density * v) });
}

/** The answer with the file at `url`. */
export async function fetched(url) {
    const answer = await fetch(url);
    if (!answer.ok) throw new FirnError(`${url} cannot be read: ${answer.status}.`);
    return answer;
}

/** Reads `folder`/case.json and the files that it names, in the format of tests/wgsl/run.mjs: particles of the CPU. */
export async function fetchCase(folder) {
    const test = await (await fetched(`${folder}/case.json`)).json();
    const inputs = await Promise.all(Object.entries(test.inputs ?? {}).map(async ([name, file]) =>
        [name, new Float32Array(await (await fetched(`${folder}/${file}`)).arrayBuffer())]));
    const { particles = test.uniforms.particles, capacity = particles, uniforms } = test;
    return { particles, capacity, uniforms, inputs };
}

/** Writes the particles of a case. Returns what show() needs. A case has no bodies: its two halves count as two. */
export async function writeCase(simulation, { uniforms, inputs, particles }) {
    simulation.set(uniforms);
    for (const [name, numbers] of inputs) {
        const isBuffer = simulation.manifest.buffers.some((each) => each.name === name);
        if (isBuffer) simulation.writeBuffer(name, numbers);
        else simulation.write({ [name]: numbers });
    }
    const [place, corner, volume] = await Promise.all(['place', 'corner', 'volume'].map((c) => simulation.read(c)));
    const x = Float32Array.from({ length: particles }, (_, i) => place[3 * i] + corner[3 * i]);
    const middle = Float32Array.from(x).sort()[particles >> 1];
    return { body: Uint32Array.from(x, (each) => (each < middle ? 0 : 1)), spacing: Math.cbrt(volume[0]) };
}
