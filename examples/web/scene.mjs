// The particles at the start: two bodies thrown at each other in a unit box, or particles from files.
import { FirnError } from './firn.mjs';

export const box = { lower: [0, 0, 0], upper: [1, 1, 1] }; // m
export const density = 1000; // kg/m^3

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
    cube: { inside: () => true, part: 1 },
    ball: { inside: ([x, y, z]) => x * x + y * y + z * z <= 1, part: Math.PI / 6 },
    ring: {
        inside: ([x, y, z]) => (Math.hypot(x, z) - (1 - tube)) ** 2 + y * y <= tube ** 2,
        part: 2 * Math.PI ** 2 * (1 - tube) * tube ** 2 / 8,
    },
};

// side of the surrounding cube [m]; centre [m]; turn [rad] about x, then y, then z; velocity [m/s]
export const scenes = {
    cubes: { title: 'Two cubes', bodies: [
        { shape: 'cube', side: 0.28, centre: [0.28, 0.40, 0.47], turn: [0.35, 0.5, 0.2], velocity: [2.6, 1.5, 0.1] },
        { shape: 'cube', side: 0.28, centre: [0.72, 0.52, 0.53], turn: [-0.2, 0.3, 0.6], velocity: [-2.6, 1, -0.1] },
    ] },
    ring: { title: 'Ball and ring', bodies: [
        { shape: 'ball', side: 0.28, centre: [0.24, 0.42, 0.5], turn: [0, 0, 0], velocity: [3.2, 1.5, 0] },
        { shape: 'ring', side: 0.46, centre: [0.70, 0.50, 0.5], turn: [1.32, 0.89, 0], velocity: [-1.2, 1.4, 0] },
    ] },
};

function rotation([a, b, c]) {
    const [ca, sa, cb, sb, cc, sc] = [a, b, c].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
    return ([x, y, z]) => {
        [y, z] = [ca * y - sa * z, sa * y + ca * z];
        [x, z] = [cb * x + sb * z, cb * z - sb * x];
        return [cc * x - sc * y, sc * x + cc * y, z];
    };
}

/**
 * Fills two bodies with about `count` particles, each body on a lattice. Returns position [m], velocity [m/s] and
 * volume [m^3], particle after particle, the body of each particle, and the spacing [m].
 *
 * A cell has at least 1.75 particles along each axis, because a body with fewer falls apart. Few particles on a fine
 * grid therefore make smaller bodies.
 */
export function throwBodies({ bodies }, count, cellSize) {
    const least = 2 * Math.max(...bodies.map(({ shape }) => 1 / shapes[shape].part)); // so that none is empty
    if (!(count >= least)) throw new FirnError(`${count} particles are too few for ${bodies.length} bodies.`);
    const position = [], velocity = [], body = [], volume = [];
    let widest = 0;
    bodies.forEach((each, b) => {
        const { inside, part } = shapes[each.shape], turned = rotation(each.turn);
        const along = Math.max(2, Math.round(Math.cbrt(count / bodies.length / part)));
        const spacing = Math.min(each.side / along, cellSize / 1.75);
        widest = Math.max(widest, spacing);
        const at = (i) => (2 * i + 1) / along - 1;
        for (let i = 0; i < along; ++i) for (let j = 0; j < along; ++j) for (let k = 0; k < along; ++k) {
            const point = [at(i), at(j), at(k)];
            if (!inside(point)) continue;
            const offset = turned(point).map((x) => x * along * spacing / 2);
            position.push(...offset.map((x, a) => x + each.centre[a]));
            velocity.push(...each.velocity);
            volume.push(spacing ** 3);
            body.push(b);
        }
    });
    return { particles: body.length, position, velocity, volume, body: Uint32Array.from(body),
        spacing: widest };
}

/** Writes the particles of the bodies to the simulation, without strain. */
export function writeBodies(simulation, { particles, position, velocity, volume }) {
    const repeat = (numbers) => Float32Array.from({ length: particles * numbers.length },
        (_, i) => numbers[i % numbers.length]);
    const values = { position, velocity, volume, mass: volume.map((v) => density * v) };
    // Further fields of the material's state get the manifest's default, if they have one.
    for (const component of simulation.manifest.buffers.flatMap(({ components = [] }) => components)) {
        if (component.name === 'deformation_gradient') values[component.name] = repeat([1, 0, 0, 0, 1, 0, 0, 0, 1]);
        else if (component.default !== undefined) values[component.name] = repeat([component.default].flat());
    }
    simulation.write(values);
}

async function fetched(url) {
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
