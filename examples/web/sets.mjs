// Scenes of several materials: their sets of particles, and the jets that pour more. Loaded by scenes that have them.
import { Source } from './sources.mjs';
import { bodiesVolume, fillBodies, lame, writeBodies } from './scene.mjs';

export { Run } from './sources.mjs';

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / Math.hypot(...a));

/** The positions [m] in a disc across a direction, on a square lattice. */
function disc(centre, radius, direction, spacing) {
    const [along] = [unit(direction)], aside = Math.abs(along[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1];
    const first = unit(cross(along, aside)), second = cross(along, first), position = [];
    const most = Math.ceil(radius / spacing);
    for (let i = -most; i <= most; ++i) for (let j = -most; j <= most; ++j)
        if (Math.hypot(i, j) * spacing <= radius)
            position.push(...centre.map((x, a) => x + spacing * (i * first[a] + j * second[a])));
    return position;
}

function jetOf({ centre, radius, velocity, start, end }, density, spacing, wanted) {
    const position = disc(centre, radius * spacing / wanted, velocity, spacing);
    const jet = Source.jet({ position, volume: spacing ** 3 }, spacing, density, velocity, { start, end });
    let bursts = 0;
    while (jet.timeOf(bursts) <= end) ++bursts;
    return { jet, poured: bursts * jet.particles };
}

const pouredVolume = ({ jet }) =>
    (jet ? Math.PI * jet.radius ** 2 * Math.hypot(...jet.velocity) * (jet.end - jet.start) : 0);

/**
 * Fills the bodies of all sets of a scene with particles of one size, about `count` with those that jets pour. Returns
 * for each set what fillBodies() returns, the capacity, and its jet.
 */
export function fillSets(scene, count, cellSize, speed = 1) {
    const volumes = scene.sets.map(({ bodies }) => bodiesVolume(bodies));
    const all = scene.sets.reduce((sum, set, k) => sum + volumes[k] + pouredVolume(set), 0);
    const wanted = Math.cbrt(all / count);
    return scene.sets.map((set, k) => {
        const look = { ...scene.look, ...set.look };
        const filled = fillBodies({ ...set, look }, volumes[k] / wanted ** 3, cellSize, speed);
        const { jet = null, poured = 0 } = set.jet ? jetOf(set.jet, set.density, filled.spacing, wanted) : {};
        const capacity = filled.particles + poured;
        // The colours of those to come.
        const body = Uint32Array.from({ length: capacity }, (_, i) => filled.body[i % filled.particles]);
        return { ...filled, body, capacity, jet, look };
    });
}

/** Writes the particles and the material of a set. */
export function writeSet(simulation, { density, young, poisson, values = {} }, filled) {
    writeBodies(simulation, filled, density);
    if (young) {
        const { mu, lambda } = lame(young, poisson);
        simulation.set({ material_mu: mu, material_lambda: lambda });
    }
    simulation.set(values);
}
