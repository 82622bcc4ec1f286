// The page examples/web/index.html in headless Chromium, with the CPU's particles of a case.
//
//   page.mjs [--screenshot FILE.png] FOLDER
//
// FOLDER holds a program, case.json with its files (see run.mjs), and page.json, where the CPU says what comes out:
//   { "steps": 100, "centre_of_mass": [x, y, z], "tolerance": 1e-5 }                        m
// ../../programs, seen from FOLDER, holds the programs of the page's scenes, as 06_emit_wgsl --all writes them.
// Run through firn_chromium of cmake/webgpu.sh. Exit status: 1 if a promise is broken.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { basename, dirname, join, resolve } from 'node:path';
import process from 'node:process';
import { serve } from '../../examples/web/serve.mjs';
import { launch, layoutOf, runTests } from './chromium.mjs';
import { sceneTests } from './page_scenes.mjs';

const milliseconds = 120_000; // pipelines, and steps on a software GPU
const desktop = { width: 1280, height: 800 }, phone = { width: 390, height: 844 };
const small = { width: 800, height: 400 };
const colourful = 60; // largest less smallest channel: particles are, the background, the box and text are not

function readArguments(words) {
    const at = words.indexOf('--screenshot'), [, screenshot = null] = at < 0 ? [] : words.splice(at, 2);
    if (words.length !== 1) throw new Error('page.mjs [--screenshot FILE.png] FOLDER');
    return { screenshot, folder: resolve(words[0]) };
}

const { screenshot, folder } = readArguments(process.argv.slice(2));
const name = basename(folder);
const expected = JSON.parse(readFileSync(join(folder, 'page.json'), 'utf8'));
const server = await serve({ port: 0, programs: dirname(folder) });
const sceneServer = await serve({ port: 0, programs: join(folder, '../../programs') });
const browser = await launch();

/** Opens the page and waits until it says how it is. Collects what a browser complains about. */
async function open(query, { viewport = desktop, script = null, colorScheme = 'light', at = server } = {}) {
    const page = await browser.newPage({ viewport, colorScheme }), problems = [];
    page.setDefaultTimeout(milliseconds);
    page.on('pageerror', (error) => problems.push(error.message));
    page.on('console', (message) => {
        if (['error', 'warning'].includes(message.type())) problems.push(message.text());
    });
    if (script) await page.addInitScript(script);
    await page.goto(`http://127.0.0.1:${at.address().port}/?${query}`);
    await page.waitForFunction(() => document.body?.dataset.state)
        .catch(() => { throw new Error(`the page does not start: ${problems.join('; ')}`); });
    return { page, problems };
}

const stateOf = (page) => page.evaluate(() => ({ ...document.body.dataset }));
const notice = (page) => page.locator('#notice');

/** The canvas as it is on the screen: width, height and RGBA. */
async function pixelsOf(page) {
    await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
    const png = await page.locator('#view').screenshot();
    const [width, height, data] = await page.evaluate(async (base64) => {
        const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
        const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
        context.drawImage(image, 0, 0);
        const bytes = context.getImageData(0, 0, image.width, image.height).data;
        let text = '';
        for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
        return [image.width, image.height, btoa(text)];
    }, png.toString('base64'));
    return { width, height, rgba: Buffer.from(data, 'base64') };
}

/** Where particles are seen: how many pixels are of the warm and of the cold body, their box and their middle. */
function particlesIn({ width, rgba }) {
    const seen = { warm: 0, cold: 0, middle: [0, 0],
        left: Infinity, right: -Infinity, top: Infinity, bottom: -Infinity };
    for (let i = 0; i < rgba.length; i += 4) {
        const [r, g, b] = rgba.subarray(i, i + 3), x = (i / 4) % width, y = Math.floor(i / 4 / width);
        if (Math.max(r, g, b) - Math.min(r, g, b) < colourful) continue;
        ++seen[r > b ? 'warm' : 'cold'];
        Object.assign(seen, { left: Math.min(seen.left, x), right: Math.max(seen.right, x),
            top: Math.min(seen.top, y), bottom: Math.max(seen.bottom, y) });
        seen.middle = [seen.middle[0] + x, seen.middle[1] + y];
    }
    seen.count = seen.warm + seen.cold;
    seen.middle = seen.middle.map((sum) => sum / seen.count);
    return seen;
}

/** Where the page's camera should show them: the box of all positions, and the centre of mass. */
const projected = (page) => page.evaluate(async () => {
    const position = await firn.positions(), [x, y] = [[], []];
    for (let i = 0; i < position.length; i += 3) {
        const [px, py] = firn.project(position.subarray(i, i + 3));
        x.push(px);
        y.push(py);
    }
    const range = (numbers) => numbers.reduce(([low, high], n) => [Math.min(low, n), Math.max(high, n)],
        [Infinity, -Infinity]);
    const centre = firn.project(await firn.centreOfMass());
    return { x: range(x), y: range(y), centre, particles: position.length / 3 };
});

async function compareWithPicture(page, picture) {
    const seen = particlesIn(picture), should = await projected(page);
    assert.ok(seen.warm > 400 && seen.cold > 400, `of the bodies ${seen.warm} and ${seen.cold} pixels are seen`);
    const near = (a, b, pixels, what) => assert.ok(Math.abs(a - b) <= pixels, `${what}: ${a}, expected ${b}`);
    // A particle reaches some pixels beyond its position; a dark one at an edge may not count.
    near(seen.left, should.x[0], 14, 'left end [pixels]');
    near(seen.right, should.x[1], 14, 'right end [pixels]');
    near(seen.top, should.y[0], 14, 'upper end [pixels]');
    near(seen.bottom, should.y[1], 14, 'lower end [pixels]');
    const size = Math.hypot(should.x[1] - should.x[0], should.y[1] - should.y[0]);
    assert.ok(Math.hypot(seen.middle[0] - should.centre[0], seen.middle[1] - should.centre[1]) < 0.15 * size,
        `the middle of what is seen is ${seen.middle}, the centre of mass ${should.centre}`);
    return should;
}

const fromCase = `program=${name}&case=programs/${name}&paused=1`;
let picture = null;

const tests = {
    async 'takes exactly the steps it is told to, and agrees with the CPU'() {
        const { page, problems } = await open(fromCase);
        assert.deepEqual(await stateOf(page), { state: 'running', reason: '' });
        const before = await pixelsOf(page);
        const { particles } = await compareWithPicture(page, before);
        assert.equal(particles, JSON.parse(readFileSync(join(folder, 'case.json'), 'utf8')).particles);
        const start = await page.evaluate(() => firn.centreOfMass());
        assert.equal(await page.evaluate(() => firn.simulation.steps), 0, 'a paused page must not step');
        await page.evaluate((n) => firn.step(n), expected.steps);
        assert.equal(await page.evaluate(() => firn.simulation.steps), expected.steps);
        const centre = await page.evaluate(() => firn.centreOfMass());
        const difference = centre.map((x, a) => Math.abs(x - expected.centre_of_mass[a]));
        assert.ok(difference.every((d) => d <= expected.tolerance),
            `centre of mass ${centre}, on the CPU ${expected.centre_of_mass}`);
        assert.ok(Math.hypot(...centre.map((x, a) => x - start[a])) > 10 * expected.tolerance, 'nothing has moved');
        picture = await pixelsOf(page);
        await compareWithPicture(page, picture);
        let changed = 0;
        for (let i = 0; i < picture.rgba.length; i += 4)
            if (Math.abs(picture.rgba[i] - before.rgba[i]) > 20) ++changed;
        assert.ok(changed > 200, `${changed} pixels have changed`);
        if (screenshot) await page.screenshot({ path: screenshot });
        assert.deepEqual(problems, []);
        console.log(`     ${particles} particles, centre of mass ${centre}, largest difference ` +
            `${Math.max(...difference)} m, ${changed} pixels changed`);
        await page.close();
    },

    async 'plays, pauses, steps and restarts by keys'() {
        const { page, problems } = await open(`${fromCase}&steps=1`);
        const steps = () => page.evaluate(() => firn.simulation?.steps);
        await page.keyboard.press('s');
        await page.waitForFunction(() => firn.simulation?.steps === 1);
        await page.keyboard.press(' ');
        await page.waitForFunction(() => firn.simulation?.steps > 3);
        await page.keyboard.press(' ');
        const stopped = await steps();
        await page.waitForTimeout(500);
        assert.equal(await steps(), stopped);
        await page.keyboard.press('r');
        await page.waitForFunction(() => firn.simulation?.steps === 0);
        assert.deepEqual(problems, []);
        await page.close();
    },

    async 'the pointer attracts with its right button, and repels with shift'() {
        const { page, problems } = await open(`program=${name}&paused=1&particles=3000&cells=32&gravity=0,0,0` +
            '&radius=0.5&strength=300');
        const { uniforms } = JSON.parse(readFileSync(join(folder, 'manifest.json'), 'utf8'));
        assert.ok(uniforms.fields.some((field) => field.name === 'field_strength'),
            'the program has no force for the pointer: give a case with one');
        const at = { x: 620, y: 420 }, far = async (press) => { // pixels between the bodies' middle and the pointer
            await page.evaluate(() => firn.restart());
            await page.mouse.move(at.x, at.y);
            if (press === 'shift') await page.keyboard.down('Shift');
            if (press) await page.mouse.down({ button: 'right' });
            assert.equal(await page.locator('#ring').isVisible(), Boolean(press));
            await page.evaluate(() => firn.step(60));
            await page.mouse.up({ button: 'right' });
            await page.keyboard.up('Shift');
            const [x, y] = (await projected(page)).centre;
            return Math.hypot(x - at.x, y - at.y);
        };
        const free = await far(''), attracted = await far('right'), repelled = await far('shift');
        assert.ok(attracted < free - 2 && repelled > free + 2, `${attracted} < ${free} < ${repelled} pixels`);
        assert.deepEqual(problems, []);
        console.log(`     ${[attracted, free, repelled].map((d) => d.toFixed(1)).join(' < ')} pixels`);
        await page.close();
    },

    async 'an error of the simulation is shown, and a restart helps'() {
        const { page } = await open(fromCase);
        const message = await page.evaluate(() => {
            firn.simulation.set('time_step', 1);
            return firn.step(5).then(() => '', (error) => error.message);
        });
        assert.match(message, /particle|blown up/);
        assert.equal(await notice(page).innerText().then((text) => text.includes(message)), true);
        assert.equal(await page.locator('#pause').isDisabled(), true);
        await page.locator('#notice_restart').click();
        await page.waitForFunction(() => document.body.dataset.state === 'running');
        assert.equal(await notice(page).isVisible(), false);
        await page.evaluate(() => firn.step(2));
        await page.close();
    },

    async 'a lost device is told, and a restart helps'() {
        const { page } = await open(fromCase);
        await page.evaluate(() => firn.device.destroy());
        await notice(page).waitFor({ state: 'visible' });
        assert.match(await notice(page).innerText(), /device was lost/);
        await page.locator('#notice_restart').click();
        await page.waitForFunction(() => document.body.dataset.state === 'running');
        await page.evaluate(() => firn.step(2));
        assert.ok(particlesIn(await pixelsOf(page)).count > 800);
        await page.close();
    },

    async 'a browser without WebGPU gets a sentence'() {
        const script = () => Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
        const { page, problems } = await open(fromCase, { script });
        assert.equal(await notice(page).isVisible(), true);
        assert.match(await notice(page).innerText(), /no WebGPU.*Chrome/);
        assert.equal((await stateOf(page)).state, 'failed');
        assert.deepEqual(problems, []);
        await page.close();
    },

    async 'its own scenes are drawn, on a phone, too, and every control has a name'() {
        for (const [query, options] of [['particles=3000&cells=32&scene=ring', { viewport: phone }],
            ['particles=3000&cells=32', { colorScheme: 'dark' }]]) {
            const { page, problems } = await open(`program=${name}&paused=1&${query}`, options);
            await page.evaluate(() => firn.step(2));
            await compareWithPicture(page, await pixelsOf(page));
            const found = await layoutOf(page, '.transport button, .figures div');
            assert.deepEqual(found, { wide: 0, nameless: [], outside: 0 });
            assert.deepEqual(problems, []);
            if (screenshot && options.viewport)
                await page.screenshot({ path: screenshot.replace(/(\.png)?$/, '_phone.png') });
            await page.close();
        }
    },

    ...sceneTests({ open: (query) => open(query, { viewport: small, at: sceneServer }), pixelsOf, screenshot }),
};

console.log(`Chromium ${browser.version()}, ${name}`);
await runTests(tests);
await browser.close();
server.close();
sceneServer.close();
