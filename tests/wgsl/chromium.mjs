// Headless Chromium with WebGPU by SwiftShader. The environment's FIRN_WEBGPU names the folder that cmake/webgpu.sh
// made.
import { join } from 'node:path';
import process from 'node:process';
import { pathToFileURL } from 'node:url';

export async function launch(folder = process.env.FIRN_WEBGPU) {
    if (!folder) throw new Error('FIRN_WEBGPU is not set: run this through firn_chromium of cmake/webgpu.sh.');
    const { chromium } = (await import(pathToFileURL(join(folder, 'node_modules/playwright-core/index.js')))).default;
    const home = join(folder, 'chromium');
    return chromium.launch({
        executablePath: join(home, 'chromium'), ignoreDefaultArgs: ['--headless', '--disable-gpu'],
        env: { ...process.env, LD_LIBRARY_PATH: `${home}:${join(home, 'lib')}`, FONTCONFIG_PATH: home, HOME: home },
        args: ['--headless=new', '--no-sandbox', '--disable-dev-shm-usage', '--enable-unsafe-webgpu',
            '--enable-features=Vulkan,WebGPU', '--enable-unsafe-swiftshader', '--use-webgpu-adapter=swiftshader',
            '--use-vulkan=swiftshader', '--use-angle=swiftshader'],
    });
}

/** What does not fit on a page: pixels beyond its width, controls without a name, and elements outside the window. */
export const layoutOf = (page, elements) => page.evaluate((selector) => ({
    wide: document.documentElement.scrollWidth - innerWidth,
    nameless: [...document.querySelectorAll('input, select, button')]
        .filter((each) => !each.labels?.[0]?.textContent && !each.ariaLabel && !each.textContent)
        .map((each) => each.id),
    outside: [...document.querySelectorAll(selector)].filter((each) => {
        const { left, right, top, bottom } = each.getBoundingClientRect();
        return left < 0 || top < 0 || right > innerWidth || bottom > innerHeight;
    }).length,
}), elements);

/** Runs tests, by their promises, and says which hold. Sets the exit status: 1 if a promise is broken. */
export async function runTests(tests) {
    let failed = 0;
    for (const [promise, test] of Object.entries(tests)) {
        try {
            await test();
            console.log(`ok   ${promise}`);
        } catch (error) {
            ++failed;
            console.log(`FAIL ${promise}: ${error.message}`);
        }
    }
    console.log(`${Object.keys(tests).length - failed} passed, ${failed} failed`);
    process.exitCode = failed ? 1 : 0;
}
