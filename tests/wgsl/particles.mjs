// The page examples/web/particles.html in headless Chromium. A scripted pointer drags, pins, cuts and tears; what it
// does is measured in the positions and links that the module gives.
//
//   particles.mjs [--screenshot FOLDER] PROGRAMS
//
// PROGRAMS/wasm holds particles.wasm (see examples/web/wasm/build.sh). Run through
// firn_chromium of cmake/webgpu.sh. Exit status: 1 if a promise is broken.
import assert from 'node:assert/strict';
import { join, resolve } from 'node:path';
import process from 'node:process';
import { serve } from '../../examples/web/serve.mjs';
import { launch, layoutOf, runTests } from './chromium.mjs';

const milliseconds = 60_000;
const small = { width: 780, height: 380 }, phone = { width: 390, height: 844 };

const words = process.argv.slice(2), at = words.indexOf('--screenshot');
const [, screenshots = null] = at < 0 ? [] : words.splice(at, 2);
if (words.length !== 1) throw new Error('particles.mjs [--screenshot FOLDER] PROGRAMS');
const server = await serve({ port: 0, programs: resolve(words[0]) });
const browser = await launch();

/** Makes a page, and collects what the browser complains about. */
async function newPage(options) {
    const page = await browser.newPage(options), problems = [];
    page.setDefaultTimeout(milliseconds);
    page.on('pageerror', (error) => problems.push(error.message));
    page.on('console', (message) => {
        if (['error', 'warning'].includes(message.type()) && !/GPU stall/.test(message.text()))
            problems.push(message.text());
    });
    return { page, problems };
}

/** Opens the address in a page, and waits until the page says how it is. */
async function open(query, { page, problems } = desktop) {
    problems.length = 0;
    await page.goto('about:blank');
    await page.goto(`http://127.0.0.1:${server.address().port}/particles.html?${query}`);
    await page.waitForFunction(() => document.body?.dataset.state)
        .catch(() => { throw new Error(`the page does not start: ${problems.join('; ')}`); });
    return { page, problems };
}
const desktop = await newPage({ viewport: small });

const notice = (page) => page.locator('#notice');
const figures = (page) => page.evaluate(() => live.figures);
const step = (page, count) => page.evaluate((n) => live.step(n), count);
const choose = (page, tool) => page.locator(`#tool_${tool}`).check({ force: true });
/** All points [m] and links, and where the points are on the canvas [pixels]. */
const netOf = async (page) => {
    const { positions, links, places } = await page.evaluate(async () => {
        const [{ positions: all, links: ends }] = await live.act(['net']), points = [];
        for (let i = 0; i < all.length; i += 3) points.push([...all.subarray(i, i + 3)]);
        return { positions: points, links: [...ends], places: points.map((x) => live.project(x)) };
    });
    const pairs = Array.from({ length: links.length / 2 }, (_, k) => links.slice(2 * k, 2 * k + 2));
    return { positions, places, links: pairs };
};
const distance = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));
/** Waits until the page has passed all that the pointer did on to the module. */
const settled = (page) => page.evaluate(() => new Promise((done) => {
    requestAnimationFrame(() => requestAnimationFrame(() => live.act().then(done)));
}));

/** The canvas as it is on the screen: RGBA of each pixel. */
async function pixelsOf(page) {
    const png = await page.locator('#view').screenshot();
    const data = await page.evaluate(async (base64) => {
        const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
        const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
        context.drawImage(image, 0, 0);
        const bytes = context.getImageData(0, 0, image.width, image.height).data;
        let text = '';
        for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
        return btoa(text);
    }, png.toString('base64'));
    return Buffer.from(data, 'base64');
}

const is = {
    red: (r, g, b) => r > g + 45 && r > b + 45, blue: (r, g, b) => b > r + 45 && b > g + 15,
    green: (r, g, b) => g > r + 25 && g > b + 25, teal: (r, g, b) => g > r + 40 && b > r + 40,
    grey: (r, g, b) => Math.max(r, g, b) < 170 && Math.max(r, g, b) - Math.min(r, g, b) < 25,
    yellow: (r, g, b) => r > b + 60 && g > b + 40, white: (r, g, b) => Math.min(r, g, b) > 250,
    dark: (r, g, b) => Math.max(r, g, b) < 60,
};
function count(rgba, what) {
    let all = 0;
    for (let i = 0; i < rgba.length; i += 4) if (what(rgba[i], rgba[i + 1], rgba[i + 2])) ++all;
    return all;
}
/** How many pixels differ by more than 20 of 255. */
function changedPixels(before, after) {
    let all = 0;
    for (let i = 0; i < after.length; i += 4)
        if (Math.abs(before[i] - after[i]) > 20 || Math.abs(before[i + 2] - after[i + 2]) > 20) ++all;
    return all;
}

/** Whether the segments ab and cd of the picture cross. */
function cross(a, b, c, d) {
    const side = (p, q, r) => (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

const scenes = { // steps, and the colours that must be seen
    balls: [60, ['red', 'blue', 'green', 'yellow']], bodies: [60, ['red', 'blue', 'grey']],
    cloth: [40, ['red', 'grey']], pile: [60, ['red', 'blue', 'yellow']], fountain: [60, ['teal', 'grey']],
    snow: [100, ['white']], jelly: [60, ['red', 'yellow']],
};

const tests = {
    async 'every scene of the menu is drawn in its colours, and moves'() {
        const { page, problems } = await open('scene=fountain&paused=1&threads=1');
        for (const [scene, [steps, colours]] of Object.entries(scenes)) {
            await page.locator('#control_scene').selectOption(scene);
            await page.waitForFunction((name) => live.figures.scene === name && live.figures.time === 0, scene);
            const before = await pixelsOf(page), start = await figures(page);
            await step(page, steps);
            const after = await pixelsOf(page), end = await figures(page);
            const seen = colours.map((colour) => count(after, is[colour]));
            assert.ok(seen.every((n) => n > 60), `${scene}: of ${colours} ${seen} pixels are seen`);
            const changed = changedPixels(before, after);
            assert.ok(changed > 150, `${scene}: ${changed} pixels have changed`);
            assert.ok(Math.abs(end.time - steps * end.timeStep) < 1e-9, `${scene}: ${end.time} s`);
            assert.ok(scene === 'fountain' ? end.particles > 50 : distance(end.mean, start.mean) > 1e-3,
                `${scene} does not move: ${start.mean}, then ${end.mean}`);
            assert.deepEqual(problems, []);
            if (screenshots) await page.screenshot({ path: join(screenshots, `${scene}.png`) });
        }
    },

    async 'the pointer drags a point, which follows it and is free again'() {
        const { page, problems } = await open('scene=cloth&paused=1&threads=1&particles=400&wind=0&tear=3');
        await step(page, 100);
        const before = await netOf(page), corner = before.positions.length - 1, [x, y] = before.places[corner];
        await page.mouse.move(x, y);
        await page.mouse.down();
        await settled(page);
        assert.equal((await figures(page)).held, corner);
        const to = [x + 60, y - 40];
        await page.mouse.move(...to, { steps: 4 });
        await settled(page);
        await step(page, 120);
        const held = await netOf(page), off = distance(held.places[corner], to);
        const moved = distance(held.positions[corner], before.positions[corner]);
        assert.ok(off < 2, `the held corner is ${off} pixels from the pointer`);
        assert.ok(moved > 0.1, `the corner has moved by ${moved} m`);
        const neighbour = corner - 1; // held, too: it keeps its place beside the corner
        assert.ok(distance(held.positions[neighbour], held.positions[corner]) < 0.2);
        await page.mouse.up();
        await settled(page);
        assert.equal((await figures(page)).held, -1);
        await step(page, 60);
        const free = await netOf(page), fallen = distance(free.positions[corner], held.positions[corner]);
        assert.ok(fallen > 0.02, `the corner has moved by ${fallen} m since it is free`);
        assert.deepEqual(problems, []);
        console.log(`     dragged ${moved.toFixed(3)} m, ${off.toFixed(2)} pixels off, then moved ${fallen.toFixed(3)} m`);
    },

    async 'a cut takes exactly the links that the pointer crosses'() {
        const { page, problems } = await open('scene=bodies&paused=1&threads=1&tool=cut');
        const { places, links } = await netOf(page);
        // Across the legs of the first ragdoll, whose links hold without others.
        const from = await page.evaluate(() => live.project([0.42, 0.297, 0]));
        const to = await page.evaluate(() => live.project([0.68, 0.301, 0]));
        await page.mouse.move(...from);
        await page.mouse.down();
        await page.mouse.move(...to, { steps: 12 });
        await page.mouse.up();
        await settled(page);
        const left = new Set((await netOf(page)).links.map((ends) => ends.join()));
        const crossed = links.filter(([a, b]) => cross(from, to, places[a], places[b]));
        const gone = links.filter((ends) => !left.has(ends.join()));
        assert.ok(crossed.length >= 2, `the pointer crosses ${crossed.length} links`);
        assert.deepEqual(gone.map(String).sort(), crossed.map(String).sort());
        assert.equal((await figures(page)).links, links.length - crossed.length);
        assert.deepEqual(problems, []);
        console.log(`     ${crossed.length} of ${links.length} links crossed and cut`);
    },

    async 'a cut through cloth parts it, and the part falls'() {
        const { page, problems } = await open('scene=cloth&paused=1&threads=1&particles=400&wind=0&tear=3&tool=cut');
        const { places, links, positions } = await netOf(page), rows = Math.sqrt(positions.length);
        const between = (a, b) => places[a].map((x, k) => (x + places[b][k]) / 2);
        // Between rows 4 and 5, and on either side beyond the edge.
        const from = between(4 * rows, 5 * rows), to = between(5 * rows - 1, 6 * rows - 1);
        const way = to.map((x, k) => x - from[k]);
        const ends = [-0.05, 1.05].map((t) => from.map((x, k) => x + t * way[k]));
        await page.mouse.move(...ends[0]);
        await page.mouse.down();
        await page.mouse.move(...ends[1], { steps: 30 });
        await page.mouse.up();
        await settled(page);
        const left = (await netOf(page)).links, across = left.filter(([a, b]) => a < 5 * rows !== b < 5 * rows);
        const crossed = links.filter(([a, b]) => cross(...ends, places[a], places[b])).length;
        assert.deepEqual(across, []);
        assert.equal(links.length - left.length, crossed);
        await step(page, 180);
        const after = (await netOf(page)).positions, last = after.length - 1;
        const fallen = positions[last][1] - after[last][1], hangs = after[4 * rows + 3][1];
        assert.ok(fallen > 0.8, `the part has fallen by ${fallen} m`);
        assert.ok(hangs > after[last][1] + 0.3, `what is pinned hangs at ${hangs} m, the part at ${after[last][1]}`);
        assert.deepEqual(problems, []);
    },

    async 'a pin holds a point, and a second one sets it free'() {
        const { page, problems } = await open('scene=cloth&paused=1&threads=1&particles=400&wind=0&tool=pin');
        const before = await netOf(page), corner = before.positions.length - 1;
        await page.mouse.click(...before.places[corner]);
        await settled(page);
        await step(page, 200);
        const pinned = await netOf(page), moved = distance(pinned.positions[corner], before.positions[corner]);
        const other = distance(pinned.positions[corner - 9], before.positions[corner - 9]);
        assert.equal(moved, 0);
        assert.ok(other > 0.05, `a point beside it has moved by ${other} m`);
        await page.mouse.click(...pinned.places[corner]);
        await settled(page);
        await step(page, 60);
        const fallen = pinned.positions[corner][1] - (await netOf(page)).positions[corner][1];
        assert.ok(fallen > 0.05, `it has fallen by ${fallen} m`);
        assert.deepEqual(problems, []);
        console.log(`     pinned: 0 m, beside it ${other.toFixed(3)} m; unpinned: ${fallen.toFixed(3)} m down`);
    },

    async 'the slider of the wind blows the cloth forwards'() {
        const { page, problems } = await open('scene=cloth&paused=1&threads=1&particles=400&wind=0');
        await step(page, 120);
        const calm = (await figures(page)).mean;
        await page.evaluate(() => live.restart());
        await page.locator('#control_wind').focus();
        await page.keyboard.press('End'); // 10 m/s
        assert.equal(await page.locator('#control_wind').inputValue(), '10');
        await settled(page);
        await step(page, 120);
        const blown = (await figures(page)).mean;
        assert.ok(blown[2] > calm[2] + 0.1, `its centre is at ${blown}, without wind at ${calm}`);
        assert.deepEqual(problems, []);
        console.log(`     by ${(blown[2] - calm[2]).toFixed(3)} m in half a second`);
    },

    async 'what is pulled beyond the tear factor tears'() {
        const torn = [];
        for (const tear of [1.2, 3]) {
            const { page, problems } = await open(`scene=cloth&paused=1&threads=1&particles=400&wind=0&tear=${tear}`);
            const { places, links } = await netOf(page), [x, y] = places.at(-1);
            await page.mouse.move(x, y);
            await page.mouse.down();
            await page.mouse.move(x - 50, y + 140, { steps: 3 });
            await settled(page);
            await step(page, 150);
            torn.push(links.length - (await figures(page)).links);
            assert.deepEqual(problems, []);
        }
        assert.ok(torn[0] > 10 && torn[1] === 0, `${torn[0]} links tear at 1.2, ${torn[1]} where they never tear`);
        console.log(`     ${torn[0]} links have torn`);
    },

    async 'the emitters keep to their maximum and their rate, also when they change'() {
        const { page, problems } = await open('scene=fountain&paused=1&threads=1&rate=1000&maximum=300&variance=0');
        await step(page, 60);
        assert.ok(Math.abs((await figures(page)).particles - 250) <= 7, 'a quarter of a second at 1000/s');
        await step(page, 120);
        const most = (await figures(page)).particles;
        assert.ok(most >= 300 && most <= 307, `${most} drops, of 300 at most`);
        await page.evaluate(() => live.act(['set', 'maximum', 10_000], ['set', 'rate', 200]));
        await step(page, 120);
        const later = (await figures(page)).particles;
        assert.ok(Math.abs(later - most - 100) <= 7, `${later} drops after half a second more at 200/s`);
        assert.deepEqual(problems, []);
    },

    async 'a bad value in the address gets a sentence'() {
        for (const [query, sentence] of [
            ['scene=ice', /scene is ice; it can be balls, bodies, cloth/],
            ['wind=strong', /wind is strong; it must be a number from -10 to 10 m\/s\./],
            ['wind=99', /wind is 99; it must be a number from -10 to 10 m\/s\./],
            ['colour=red', /colour is not known; there can be/],
            ['tool=saw', /tool is saw; it can be drag, pin, cut, turn/], ['threads=0', /threads is 0/],
            ['scene=balls&particles=2000000', /balls is asked for 2000000 particles; give 1 to 10000/]]) {
            const { page, problems } = await open(query);
            assert.equal(await notice(page).isVisible(), true, query);
            assert.match(await notice(page).innerText(), sentence);
            assert.equal(await page.evaluate(() => document.body.dataset.state), 'failed');
            assert.deepEqual(problems, []);
        }
    },

    async 'what the module throws is shown, and a restart helps'() {
        const { page, problems } = await open('scene=cloth&paused=1&threads=1&particles=100');
        const message = await page.evaluate(async () => {
            await live.act(['set', 'iterations', -1]);
            return live.step(1).then(() => '', (error) => error.message);
        });
        assert.equal(message, 'There are -1 iterations; give 0 or more.');
        assert.match(await notice(page).innerText(), /There are -1 iterations; give 0 or more\.\s*Restart/);
        assert.equal(await page.locator('#pause').isDisabled(), true);
        await page.locator('#notice_restart').click();
        await page.waitForFunction(() => document.body.dataset.state === 'running' && live.stage);
        assert.equal(await notice(page).isVisible(), false);
        await step(page, 3);
        assert.ok((await figures(page)).time > 0);
        assert.deepEqual(problems, []);
    },

    async 'plays on two threads to the same numbers as on one, pauses, and obeys the keys'() {
        const means = [];
        for (const threads of [1, 2]) {
            const { page, problems } = await open(`scene=pile&particles=300&paused=1&threads=${threads}`);
            await step(page, 60);
            means.push((await figures(page)).mean);
            assert.equal((await figures(page)).threads, threads);
            const time = () => page.evaluate(() => live.figures.time);
            await page.keyboard.press(' ');
            await page.waitForFunction((from) => live.figures.time > from + 0.05, await time());
            await page.keyboard.press(' ');
            await settled(page);
            const stopped = await time();
            await page.waitForTimeout(200);
            assert.equal(await time(), stopped);
            await page.keyboard.press('3');
            assert.equal(await page.locator('#tool_cut').isChecked(), true);
            await page.keyboard.press('r');
            await page.waitForFunction(() => live.figures.time === 0);
            assert.deepEqual(problems, []);
        }
        assert.deepEqual(means[0], means[1]);
    },

    async 'on a phone without WebGPU it fits, touch pins, the keys drag, and every control has a name'() {
        const script = () => Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined });
        const hand = await newPage({ viewport: phone, hasTouch: true, colorScheme: 'dark' });
        await hand.page.addInitScript(script);
        const { page, problems } = await open('scene=cloth&paused=1&threads=1&particles=400&wind=0&tool=pin', hand);
        const { places, positions } = await netOf(page), corner = positions.length - 1;
        await page.touchscreen.tap(...places[corner]);
        await settled(page);
        await step(page, 60);
        assert.deepEqual((await netOf(page)).positions[corner], positions[corner]);
        // The cross starts in the middle of the picture; Enter takes what is there, and lets it go.
        await choose(page, 'drag');
        await page.locator('#view').focus();
        await page.keyboard.press('ArrowUp');
        const middle = await page.locator('#view').evaluate((view) => [view.clientWidth / 2, view.clientHeight / 2]);
        const wanted = (await netOf(page)).places[corner - 10].map((x, k) => Math.round((x - middle[k]) / 10));
        for (const [k, [less, more]] of [['ArrowLeft', 'ArrowRight'], ['ArrowUp', 'ArrowDown']].entries())
            for (let n = Math.abs(wanted[k]); n > 0; --n) await page.keyboard.press(wanted[k] < 0 ? less : more);
        await page.keyboard.press('Enter');
        await settled(page);
        const { held } = await figures(page), start = (await netOf(page)).places[held];
        assert.ok(held >= 0, 'nothing is held');
        for (let k = 0; k < 3; ++k) await page.keyboard.press('Shift+ArrowUp');
        await settled(page);
        await step(page, 60);
        const raised = start[1] - (await netOf(page)).places[held][1];
        assert.ok(raised > 60, `it was raised by ${raised} pixels`);
        await page.keyboard.press('Enter');
        await settled(page);
        assert.equal((await figures(page)).held, -1);
        const pixels = await pixelsOf(page);
        assert.ok(count(pixels, is.red) > 2000, 'the cloth is not seen');
        assert.ok(count(pixels, is.dark) > 20_000, 'the background is not dark');
        const found = await layoutOf(page, '.transport button, .figures div, .tools label');
        assert.deepEqual(found, { wide: 0, nameless: [], outside: 0 });
        assert.deepEqual(problems, []);
        if (screenshots) await page.screenshot({ path: join(screenshots, 'phone.png') });
        await page.close();
    },
};

console.log(`Chromium ${browser.version()}, particles.html`);
await runTests(tests);
await browser.close();
server.close();
