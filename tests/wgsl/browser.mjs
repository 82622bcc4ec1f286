// Opens a page of examples/web in headless Chromium, drawn by SwiftShader, and looks at the pixels of a screenshot.
//
//   browser.mjs [--pages FOLDER] [--programs FOLDER] [--screenshot FILE.png] [--seconds N] [--element CSS] PAGE...
//
// PAGE is a path below the server, with its query. The page sets document.body.dataset.state to "running" once its
// first frame is drawn, or to "failed" with a sentence in dataset.reason. After N more seconds (2 if left out) the
// element (a canvas if left out) must show at least two colours: a canvas that draws nothing raises no error.
// The environment's FIRN_WEBGPU names the folder that cmake/webgpu.sh made (run this through firn_chromium).
import { dirname, join, resolve } from 'node:path';
import process from 'node:process';
import { fileURLToPath } from 'node:url';
import { serve } from '../../examples/web/serve.mjs';
import { launch } from './chromium.mjs';

const startMilliseconds = 120_000; // pipelines and a first step on a software GPU
const root = resolve(dirname(fileURLToPath(import.meta.url)), '../..');

function readArguments(words) {
    const options = { pages: join(root, 'examples/web'), programs: join(root, 'build/web'), screenshot: null,
        seconds: 2, element: 'canvas', paths: [] };
    for (let i = 0; i < words.length; ++i) {
        const name = words[i].slice(2);
        if (!words[i].startsWith('--')) options.paths.push(words[i]);
        else if (!(name in options) || name === 'paths') throw new Error(`browser.mjs does not know ${words[i]}.`);
        else options[name] = words[++i];
    }
    if (!options.paths.length) throw new Error('browser.mjs [--pages FOLDER] [--programs FOLDER] ... PAGE...');
    return options;
}

/** Counts a PNG's pixels by colour: [[colour, pixels], ...], the most frequent first. */
const colours = (page, png) => page.evaluate(async (base64) => {
    const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
    context.drawImage(image, 0, 0);
    const counts = new Map();
    for (const pixel of new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer))
        counts.set(pixel, (counts.get(pixel) ?? 0) + 1);
    return [...counts].sort((a, b) => b[1] - a[1]);
}, png.toString('base64'));

async function look(browser, url, { seconds, element, screenshot }) {
    const page = await browser.newPage(), problems = [];
    page.on('pageerror', (error) => problems.push(error.message));
    page.on('console', (message) => {
        if (['error', 'warning'].includes(message.type())) problems.push(message.text());
    });
    try {
        await page.goto(url);
        await page.waitForFunction(() => document.body?.dataset.state, null, { timeout: startMilliseconds })
            .catch(() => { throw new Error(`the page does not say that it runs. ${problems.join('; ')}`); });
        await page.waitForTimeout(1000 * Number(seconds));
        const { state, reason } = await page.evaluate(() => ({ ...document.body.dataset }));
        if (screenshot) await page.screenshot({ path: screenshot });
        if (state !== 'running') throw new Error(`the page says ${state}: ${reason}`);
        if (problems.length) throw new Error(problems.join('; '));
        const [most, ...others] = await colours(page, await page.locator(element).first().screenshot());
        const drawn = others.reduce((sum, [, pixels]) => sum + pixels, 0);
        if (!drawn) throw new Error(`${element} shows one colour only`);
        return `${drawn} of ${drawn + most[1]} pixels drawn, ${others.length + 1} colours`;
    } finally {
        await page.close();
    }
}

const options = readArguments(process.argv.slice(2));
const server = await serve({ port: 0, pages: options.pages, programs: options.programs });
const browser = await launch();
console.log(`Chromium ${browser.version()}`);
let failed = 0;
for (const path of options.paths) {
    try {
        const url = new URL(path, `http://127.0.0.1:${server.address().port}/`);
        console.log(`ok   ${path}: ${await look(browser, url.href, options)}`);
    } catch (error) {
        console.log(`FAIL ${path}: ${error.message}`);
        ++failed;
    }
}
await browser.close();
server.close();
console.log(`${options.paths.length - failed} passed, ${failed} failed`);
process.exitCode = failed ? 1 : 0;
