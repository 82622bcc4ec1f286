// What the page's own scenes promise: tests for page.mjs.
import assert from 'node:assert/strict';
import { basename } from 'node:path';
import { bodiesVolume, scenes } from '../../examples/web/scene.mjs';

const small = 'cells=32&particles=1000&paused=1';

/** How many pixels of a picture are white, and how many have the colour of the obstacle, inside a box of pixels. */
function coloursIn({ width, rgba }, [left, right], [top, bottom]) {
    const seen = { white: 0, obstacle: 0, all: 0 };
    const from = (edge) => Math.max(Math.ceil(edge), 0);
    for (let y = from(top); y < bottom; ++y) for (let x = from(left); x < right; ++x) {
        const [r, g, b] = rgba.subarray(4 * (y * width + x));
        ++seen.all;
        if (Math.min(r, g, b) > 205 && Math.max(r, g, b) - Math.min(r, g, b) < 25) ++seen.white;
        if (r > 1.3 * g && g > b && r - b > 35) ++seen.obstacle;
    }
    return seen;
}

/** Where points [m] are on the canvas: their range along x and y. */
const rangeOf = (page, points) => page.evaluate((all) => {
    const places = all.map((point) => firn.project(point));
    return [0, 1].map((a) => [Math.min(...places.map((p) => p[a])), Math.max(...places.map((p) => p[a]))]);
}, points);

/** The snow: where it is, how much of it is crushed, and in how many pieces it is, seen on boxes of 2.5 spacings. */
const snowOf = (page) => page.evaluate(async () => {
    const position = await firn.positions(), [x, y, z] = await firn.centreOfMass();
    const volume = await firn.simulation.read('volume'), width = 2.5 * Math.cbrt(volume[0]);
    const open = new Set();
    for (let i = 0; i < position.length; i += 3)
        open.add([0, 1, 2].map((a) => Math.floor(position[i + a] / width)).join());
    const steps = [-1, 0, 1], beside = steps.flatMap((a) => steps.flatMap((b) => steps.map((c) => [a, b, c])));
    let pieces = 0;
    while (open.size) {
        const front = [open.values().next().value];
        open.delete(front[0]);
        ++pieces;
        while (front.length) {
            const at = front.pop().split(',').map(Number);
            for (const step of beside) {
                const next = at.map((n, a) => n + step[a]).join();
                if (open.delete(next)) front.push(next);
            }
        }
    }
    const plastic = await firn.simulation.read('plastic_volume');
    return { x, y, z, pieces, crushed: plastic.filter((J) => Math.abs(J - 1) > 0.02).length / plastic.length };
});

/** The particles of the tank, set after set: how many, their mass, and a number that any change of them changes. */
const tankOf = (page) => page.evaluate(async () => {
    const all = [], sum = (numbers) => numbers.reduce((a, b) => a + b, 0);
    for (const set of firn.simulation.sets) {
        const words = new Uint32Array((await set.readBuffer('motion')).buffer);
        const [mass, volume] = [await set.read('mass'), await set.read('volume')];
        all.push({ material: set.manifest.material, particles: set.particles, mass: sum(mass), volume: sum(volume),
            state: words.reduce((hash, word) => Math.imul(hash ^ word, 0x01000193) >>> 0, 0x811c9dc5) });
    }
    const [lower, upper] = [[0, 1, 2].map(() => Infinity), [0, 1, 2].map(() => -Infinity)];
    (await firn.positions()).forEach((x, k) => {
        lower[k % 3] = Math.min(lower[k % 3], x);
        upper[k % 3] = Math.max(upper[k % 3], x);
    });
    return { sets: all, lower, upper, time: firn.figures.time };
});

/** The mesh in the tank: its position, and where its vertices are on the canvas, those above a height [m] first. */
const meshOf = (page, height) => page.evaluate(async (from) => {
    const { values } = firn.simulation, position = values.boundary_1_position;
    const { name } = performance.getEntriesByType('resource').find((each) => each.name.endsWith('/vertices.bin'));
    const numbers = new Float32Array(await (await fetch(name)).arrayBuffer());
    const vertices = Array.from({ length: numbers.length / 3 }, (_, v) =>
        position.map((x, a) => x + numbers[3 * v + a]));
    const isHigh = ([, y]) => y > from, projected = (some) => some.map(firn.project);
    return { position, high: projected(vertices.filter(isHigh)), low: projected(vertices.filter((x) => !isHigh(x))) };
}, height);

/**
 * How many pixels have the mesh's colour: of those at its vertices that nothing hides, and of those around it; and how
 * many of the former are in the light.
 */
function meshIn({ width, rgba }, { high, low }) {
    const colour = ([x, y]) => rgba.subarray(4 * (Math.round(y) * width + Math.round(x)));
    const isOfMesh = (place) => {
        const [r, g, b] = colour(place);
        return r > 1.1 * g && b > 1.1 * g && b < 1.6 * r;
    };
    const all = [...high, ...low], far = 6, around = [];
    const [[left, right], [top, bottom]] = [0, 1].map((a) => {
        const along = all.map((place) => place[a]);
        return [Math.min(...along) - far, Math.max(...along) + far];
    });
    for (let y = Math.ceil(top); y < bottom; ++y) for (let x = Math.ceil(left); x < right; ++x)
        if (all.every(([px, py]) => Math.max(Math.abs(px - x), Math.abs(py - y)) > far)) around.push([x, y]);
    const part = (places, is) => places.filter(is).length / places.length;
    return { inside: part(high, isOfMesh), around: part(around, isOfMesh), pixels: around.length,
        lit: part(high, (place) => colour(place)[0] > 130) };
}

/**
 * How deep particles are in the mesh [m], by the distance of the node next to each, and how many are up to a cell away;
 * and how far the mesh's vertices are from where the distances are 0 [spacings].
 */
const depthsOf = (page) => page.evaluate(async () => {
    const { values } = firn.simulation, files = performance.getEntriesByType('resource');
    const [distances, vertices] = await Promise.all(['/distances.bin', '/vertices.bin'].map(async (file) =>
        new Float32Array(await (await fetch(files.find(({ name }) => name.endsWith(file)).name)).arrayBuffer())));
    const [lower, nodes, strides, spacing] = ['lower', 'nodes', 'strides', 'spacing']
        .map((name) => values[`boundary_1_shape_grid_${name}`]);
    const distancesAt = (points, origin) => Array.from({ length: points.length / 3 }, (_, i) => {
        const node = lower.map((x, a) => Math.round((points[3 * i + a] - origin[a] - x) / spacing));
        const isThere = node.every((n, a) => n >= 0 && n < nodes[a]);
        return isThere ? distances[node.reduce((sum, n, a) => sum + n * strides[a], 0)] : Infinity;
    });
    const ofParticles = distancesAt(await firn.positions(), values.boundary_1_position);
    const off = distancesAt(vertices, [0, 0, 0]).reduce((most, d) => Math.max(most, Math.abs(d)), 0) / spacing;
    return { deepest: -Math.min(...ofParticles, 0), near: ofParticles.filter((d) => d < values.cell_size).length, off,
        cell: values.cell_size, largest: -distances.reduce((a, b) => Math.min(a, b)) };
});

/** The colour of a picture around a place [pixels]: the middle one of each channel. */
function colourAt({ width, rgba }, [x, y], reach = 4) {
    const channels = [[], [], []];
    for (let j = -reach; j <= reach; ++j) for (let i = -reach; i <= reach; ++i) {
        const at = 4 * ((Math.round(y) + j) * width + Math.round(x) + i);
        channels.forEach((all, c) => all.push(rgba[at + c]));
    }
    return channels.map((all) => all.sort((a, b) => a - b)[all.length >> 1]);
}

/** What files of the page a browser has read. */
const filesOf = (page) => page.evaluate(() => performance.getEntriesByType('resource').map(({ name }) => name));

export const sceneTests = ({ open, pixelsOf, screenshot }) => ({
    async 'snow is white, its obstacle is drawn, it is crushed there, and no step is longer than its bound'() {
        const { page, problems } = await open(`${small}&speed=2&time_step=0.0015`);
        const bounded = (steps) => page.evaluate(async (count) => {
            const { simulation } = firn, { time_step_safety: safety } = simulation.manifest;
            const { cell_size: h } = simulation.values;
            let most = 0;
            for (let k = 0; k < count; ++k) {
                const { signal_speed: speed } = await simulation.check();
                simulation.step(1);
                most = Math.max(most, (await simulation.check()).time_step * speed / (safety * h));
            }
            return most;
        }, steps);
        const start = await snowOf(page);
        const picture = await pixelsOf(page);
        const ball = await rangeOf(page, [[start.x, start.y - 0.15, start.z], [start.x, start.y + 0.15, start.z]]);
        const [[middle]] = ball, snow = coloursIn(picture, [middle - 30, middle + 30], ball[1]);
        assert.ok(snow.white > 0.6 * snow.all, `${snow.white} of ${snow.all} pixels of the ball are white`);
        const { values } = await page.evaluate(() => ({ values: firn.simulation.values }));
        const [x, y, z] = values.boundary_1_position, [a, b, c] = values.boundary_1_shape_half_extents;
        // The lower half of the face that the ball flies at, away from the ball's shadow.
        const face = await rangeOf(page, [[x + a, y - 0.8 * b, z + 0.75 * c], [x + a, y - 0.3 * b, z + 0.95 * c]]);
        const wall = coloursIn(picture, ...face);
        assert.ok(wall.all > 100 && wall.obstacle > 0.9 * wall.all,
            `${wall.obstacle} of ${wall.all} pixels have the colour of the obstacle`);
        const far = coloursIn(picture, [picture.width - 120, picture.width - 20], [60, 160]);
        assert.equal(far.obstacle + far.white, 0, 'the background has neither colour');

        let longest = await bounded(4);
        await page.evaluate(() => firn.step(26)); // it hits the wall
        longest = Math.max(longest, await bounded(10));
        await page.evaluate(() => firn.step(20));
        const hit = await snowOf(page);
        longest = Math.max(longest, await bounded(4));
        assert.ok(longest <= 1.00001 && longest > 0.999, `the longest step is ${longest} of its bound`);
        assert.ok(start.crushed === 0 && hit.crushed > 0.5, `${start.crushed}, then ${hit.crushed} are crushed`);
        assert.ok(hit.x < start.x - 0.5 && hit.x > x + a, `from x = ${start.x} m to ${hit.x} m`);
        const speed = await page.evaluate(async () => {
            const [before] = await firn.centreOfMass(), { time } = firn.figures;
            await firn.step(20);
            return ((await firn.centreOfMass())[0] - before) / (firn.figures.time - time);
        });
        const after = await snowOf(page);
        assert.ok(speed > 0.3, `after the wall the ball moves at ${speed} m/s`);
        assert.equal(after.pieces, 1, 'on 32 cells snow stays in one piece');
        if (screenshot) await page.screenshot({ path: screenshot.replace(/(\.png)?$/, '_snow.png') });
        assert.deepEqual(problems, []);
        console.log(`     longest step ${longest.toFixed(5)} of its bound, ${Math.round(100 * hit.crushed)} % crushed, ` +
            `back at ${speed.toFixed(2)} m/s`);
        await page.close();
    },

    async 'a dam breaks, and frames simulate equal times, though the bound changes'() {
        const { page, problems } = await open('scene=dam&cells=16&particles=1000&frame=0.006&time_step=0.01&paused=1');
        const { needed, bound, before, after } = await page.evaluate(async () => {
            const [start] = await firn.centreOfMass();
            firn.resume();
            const frames = () => new Promise((done) => { requestAnimationFrame(() => setTimeout(done, 20)); });
            while (!(firn.figures.time > 0.03)) await frames();
            const { figures } = firn;
            firn.pause();
            await firn.step(40);
            return { ...figures, before: start, after: (await firn.centreOfMass())[0] };
        });
        assert.ok(Math.abs(needed * bound / 0.006 - 1) < 0.6, `${needed} steps of at most ${bound} s`);
        assert.ok(after > before + 0.015, `water: from x = ${before} m to ${after} m`);
        if (screenshot) await page.screenshot({ path: screenshot.replace(/(\.png)?$/, '_dam.png') });
        assert.deepEqual(problems, []);
        await page.close();
    },

    async 'a sand column runs out'() {
        const { page, problems } = await open('scene=sand&cells=16&particles=1000&paused=1&time_step=0.01');
        const [, before] = await page.evaluate(() => firn.centreOfMass());
        await page.evaluate(() => firn.step(40));
        const [, after] = await page.evaluate(() => firn.centreOfMass());
        assert.ok(after < before - 0.02, `sand: from a height of ${before} m to ${after} m`);
        if (screenshot) await page.screenshot({ path: screenshot.replace(/(\.png)?$/, '_sand.png') });
        assert.deepEqual(problems, []);
        await page.close();
    },

    async 'water, sand, snow and jelly share a tank, each with its colour and mass, and a jet pours when it is due'() {
        const { page, problems } = await open('scene=tank&cells=16&particles=2000&paused=1&time_step=0.01&frame=0.012');
        const { sets, box, obstacle } = scenes.tank, jetOf = sets[0].jet;
        const start = await tankOf(page), picture = await pixelsOf(page);
        assert.deepEqual(start.sets.map(({ material }) => material), sets.map(({ material }) => material));
        const [spaced] = start.sets.map(({ volume }, k) => volume / bodiesVolume(sets[k].bodies));
        start.sets.forEach(({ mass, volume }, k) => {
            assert.ok(Math.abs(mass / volume / sets[k].density - 1) < 1e-5, `density of ${sets[k].material}`);
            const wanted = spaced * bodiesVolume(sets[k].bodies); // all are spaced alike
            assert.ok(Math.abs(volume / wanted - 1) < 0.2,
                `volume of ${sets[k].material}: ${volume} m^3, expected ${wanted}`);
        });
        const colours = {
            water: [[1.08, 0.06, 0.45], ([r, g, b]) => b > 1.3 * r && b > g],
            sand: [[0.15, 0.1, 0.45], ([r, g, b]) => r > 1.1 * g && g > 1.2 * b],
            snow: [sets[2].bodies[0].centre, ([r, g, b]) => Math.min(r, g, b) > 170 && Math.max(r, g, b) < 1.2 * r],
            green: [sets[3].bodies[0].centre, ([r, g, b]) => g > 1.3 * r && g > 1.2 * b],
        };
        for (const [what, [point, has]] of Object.entries(colours)) {
            const [[x], [y]] = await rangeOf(page, [point]), colour = colourAt(picture, [x, y]);
            assert.ok(has(colour), `${what} has the colour ${colour}`);
        }
        const ofMesh = (await filesOf(page)).filter((file) => file.endsWith('.bin')).map((file) => basename(file));
        assert.deepEqual(ofMesh.sort(), ['distances.bin', 'triangles.bin', 'vertices.bin']);
        const there = await meshOf(page, 0.12), mesh = meshIn(picture, there); // water may hide what is lower
        assert.deepEqual(there.position, obstacle.position);
        assert.ok(mesh.inside > 0.9 && mesh.pixels > 2000 && mesh.around === 0,
            `${mesh.inside} of the mesh and ${mesh.around} of ${mesh.pixels} pixels around it have its colour`);
        assert.ok(mesh.lit > 0.2, `${mesh.lit} of the mesh is in the light`);

        // First in frames; a second run does not depend on them.
        await page.evaluate(async () => {
            firn.resume();
            while (firn.simulation.steps < 5) await new Promise((done) => { setTimeout(done, 10); });
            firn.pause();
            await firn.step(Math.max(1, 34 - firn.simulation.steps));
        });
        const poured = await tankOf(page);
        const { steps, capacity, spacing } = await page.evaluate(async () => ({ steps: firn.simulation.steps,
            capacity: firn.simulation.capacity, spacing: Math.cbrt((await firn.simulation.read('volume')).at(-1)) }));
        const rate = Math.hypot(...jetOf.velocity) / spacing; // a layer has moved on by its thickness
        const bursts = (time) => Math.floor((Math.min(time, jetOf.end) - jetOf.start) * rate) + 1;
        const each = (capacity - start.sets[0].particles) / bursts(jetOf.end);
        assert.ok(Number.isInteger(each) && each > 0, `${each} particles come at once`);
        assert.ok(bursts(poured.time) > 1, `${poured.time} s are over, and the jet pours from ${jetOf.start} s on`);
        const expected = start.sets.map(({ particles }, k) => particles + (k === 0 ? each * bursts(poured.time) : 0));
        assert.deepEqual(poured.sets.map(({ particles }) => particles), expected);
        assert.ok(poured.sets.every(({ state }, k) => state !== start.sets[k].state), 'all move');
        for (let a = 0; a < 3; ++a)
            assert.ok(poured.lower[a] >= box.lower[a] && poured.upper[a] <= box.upper[a],
                `from ${poured.lower[a]} m to ${poured.upper[a]} m along axis ${a}`);
        const [[x], [y]] = await rangeOf(page, [await page.evaluate(() => firn.simulation.read('position')
            .then((all) => [...all.slice(-3)]))]);
        const [red, , blue] = colourAt(await pixelsOf(page), [x, y], 1);
        assert.ok(blue > 1.3 * red, `the jet has the colour ${red}, ..., ${blue}`);
        if (screenshot) await page.screenshot({ path: screenshot.replace(/(\.png)?$/, '_tank.png') });
        await page.evaluate(async (count) => {
            firn.step(count).catch(() => {}); // which the restart interrupts
            await firn.restart();
            await firn.step(count);
        }, steps);
        assert.deepEqual(await tankOf(page), poured, 'a second run');

        // Water is thrown at the mesh.
        await page.locator('#control_gravity_0').fill('-100');
        await page.locator('#control_cells').selectOption('32');
        await page.evaluate(async () => { do await firn.step(10); while (firn.figures.time < 0.085); });
        const { deepest, near, off, cell, largest } = await depthsOf(page);
        assert.ok(off > 0 && off < 1, `vertices are up to ${off} spacings from where distances are 0`);
        assert.ok(near > 50 && deepest < cell && largest > 2 * cell,
            `${near} particles are at the mesh, up to ${deepest} m deep; a cell has ${cell} m, it ${largest} m`);
        const programs = (await filesOf(page)).filter((file) => file.endsWith('program.wgsl'));
        assert.equal(programs.length, sets.length);
        assert.deepEqual(problems, []);
        console.log(`     ${poured.sets.map(({ material, particles }) => `${material} ${particles}`).join(', ')}; ` +
            `${steps} steps, ${poured.time.toFixed(3)} s, ${bursts(poured.time)} bursts of ${each}; ${near} are at the ` +
            `mesh, up to ${(deepest / cell).toFixed(2)} cells deep`);
        await page.close();
    },

    async 'few choices are in sight, and density and the parameters of the material can be set'() {
        const { page, problems } = await open(`${small}&density=200&material_hardening=4`);
        const { values } = await page.evaluate(() => ({ values: firn.simulation.values }));
        assert.equal(values.material_hardening, 4);
        const files = await filesOf(page);
        assert.equal(files.filter((file) => file.endsWith('program.wgsl')).length, 1);
        assert.ok(!files.some((file) => /\/(sets|sources|mesh)\.mjs|\.bin$/.test(file)),
            'what only the tank needs is left out');
        const total = () => page.evaluate(async () => {
            const [mass, volume] = [await firn.simulation.read('mass'), await firn.simulation.read('volume')];
            return mass[0] / volume[0];
        });
        assert.ok(Math.abs(await total() - 200) < 0.01);
        const select = (name) => page.locator(`#control_${name}`);
        const optionsOf = (name) => select(name).evaluate((each) => [...each.options].map(({ value }) => value));
        assert.deepEqual(await optionsOf('scene'), ['snow', 'sand', 'dam', 'cubes', 'ring', 'tank']);
        assert.deepEqual(await optionsOf('material'), ['per_particle_snow']);
        assert.ok((await optionsOf('particles')).includes('500000'));
        assert.equal(await page.locator('select:visible').count(), 6, 'selects outside of "More"');
        const mu = () => page.evaluate(() => firn.simulation.read('mu').then((all) => all[0]));
        const { standard, first } = await page.evaluate(() => ({
            standard: firn.simulation.manifest.uniforms.fields.find(({ name }) => name === 'material_mu').default,
            first: firn.simulation.manifest.buffers.flatMap(({ components = [] }) => components)
                .find(({ name }) => name === 'mu').default[0] }));
        assert.equal(first, standard, 'a particle at rest has the material’s stiffness');
        const soft = await mu();
        await page.locator('#control_young').evaluate((input) => {
            input.value = '1';
            input.dispatchEvent(new Event('input'));
        });
        assert.ok(await mu() > 5 * soft, 'the particles’ own stiffness follows the control');
        await select('scene').selectOption('cubes');
        await page.waitForFunction(() => firn.simulation?.manifest.material === 'fixed_corotated');
        await select('material').selectOption('neo_hookean');
        await page.waitForFunction(() => firn.simulation?.manifest.material === 'neo_hookean');
        await page.locator('summary').click();
        await select('walls').selectOption('stick');
        await page.waitForFunction(() => firn.simulation?.manifest.boundary === 'walls_stick');
        assert.deepEqual(problems, []);
        await page.close();
    },

    async 'what the address cannot have gets a sentence'() {
        for (const [query, sentence] of [
            ['sceen=sand', /^The address has sceen, which means nothing here\. It can have .*scene/],
            ['scene=lava', /scene is lava; it must be one of snow, sand, dam, cubes, ring, tank\./],
            ['scene=dam&material=sand', /material is sand; it must be fluid\./],
            ['particles=many', /particles is many; it must be a whole number from 100 to 4000000\./],
            ['particles=5', /particles is 5; .* from 100/], ['poisson=0.7', /poisson is 0\.7; .* from 0 to 0\.45\./],
            ['gravity=1,2', /gravity is 1,2; it must be x,y,z/], ['paused=maybe', /paused is maybe; it must be 0 or 1/],
            ['scene=cubes&kernel=sine', /kernel is sine; it must be one of/],
            [`${small}&material_stickiness=3`, /material_stickiness; the material .*snow has .*material_hardening/],
            ['scene=tank&walls=stick', /The scene tank has programs of its own: leave walls out of the address/],
            ['program=none', /There is no program: .*none.*404/]]) {
            const { page } = await open(query);
            const { state, reason } = await page.evaluate(() => ({ ...document.body.dataset }));
            assert.equal(state, 'failed', query);
            assert.match(reason, sentence);
            assert.ok((await page.locator('#notice').innerText()).includes(reason));
            await page.close();
        }
    },
});
