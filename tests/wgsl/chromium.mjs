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
