// node examples/web/serve.mjs [PORT] [PROGRAMS]: serves this folder on http://127.0.0.1:PORT (default 8000). At
// /programs/ it serves the folder PROGRAMS (default build/web), which has a folder for each program that 06_emit_wgsl
// wrote. GET /programs/ returns a list of them as JSON. Modules that wasm/build.sh wrote lie in PROGRAMS/wasm. Exit
// status: 1 if the port is in use, 2 if it is not a number.
import { createReadStream } from 'node:fs';
import { readdir, realpath, stat } from 'node:fs/promises';
import { createServer } from 'node:http';
import { dirname, extname, join, resolve, sep } from 'node:path';
import process from 'node:process';
import { fileURLToPath, pathToFileURL } from 'node:url';

const types = {
    '.html': 'text/html; charset=utf-8', '.mjs': 'text/javascript', '.js': 'text/javascript', '.css': 'text/css',
    '.json': 'application/json', '.wgsl': 'text/plain; charset=utf-8', '.png': 'image/png',
    '.bin': 'application/octet-stream', '.wasm': 'application/wasm',
};

/** The file at `path` below `root`; null if there is none, or if .. or a link leads out of `root`. */
async function below(root, path) {
    try {
        const top = await realpath(root), file = await realpath(resolve(top, `.${sep}${path}`));
        return file === top || file.startsWith(top.endsWith(sep) ? top : top + sep) ? file : null;
    } catch {
        return null;
    }
}

async function programNames(root) {
    const names = [];
    for (const entry of await readdir(root, { withFileTypes: true }).catch(() => []))
        if (entry.isDirectory() && await below(root, join(entry.name, 'manifest.json'))) names.push(entry.name);
    return names.sort();
}

async function answer(request, response, pages, programs) {
    const refuse = (status) => response.writeHead(status, { 'content-type': 'text/plain' }).end(`${status}\n`);
    if (request.method !== 'GET' && request.method !== 'HEAD') return refuse(405);
    let path;
    try {
        path = decodeURIComponent(request.url.split('?')[0]);
    } catch {
        return refuse(400);
    }
    // The last two give the pages shared memory, on which WebAssembly's threads work.
    const common = {
        'cache-control': 'no-store', 'x-content-type-options': 'nosniff',
        'cross-origin-opener-policy': 'same-origin', 'cross-origin-embedder-policy': 'require-corp',
    };
    if (path === '/programs/') {
        response.writeHead(200, { ...common, 'content-type': types['.json'] });
        return response.end(JSON.stringify(await programNames(programs)));
    }
    const inPrograms = path.startsWith('/programs/');
    let file = await below(inPrograms ? programs : pages, inPrograms ? path.slice('/programs'.length) : path);
    if (file && path.endsWith('/')) file = await below(file, 'index.html');
    const size = file && await stat(file);
    if (!size?.isFile()) return refuse(404);
    const type = types[extname(file)] ?? 'application/octet-stream';
    response.writeHead(200, { ...common, 'content-type': type, 'content-length': size.size });
    if (request.method === 'HEAD') return response.end();
    return createReadStream(file).on('error', () => response.destroy()).pipe(response);
}

/** Serves the folder `pages`, and `programs` at /programs/. Resolves to the server. Port 0 takes any free port. */
export function serve({ port = 8000, pages = dirname(fileURLToPath(import.meta.url)), programs }) {
    const server = createServer((request, response) => {
        answer(request, response, pages, programs).catch(() => response.destroy());
    });
    return new Promise((done, fail) => {
        server.once('error', fail);
        server.listen(port, '127.0.0.1', () => done(server));
    });
}

if (process.argv[1] && import.meta.url === pathToFileURL(await realpath(process.argv[1])).href) {
    const build = join(dirname(fileURLToPath(import.meta.url)), '../../build/web');
    const [port = '8000', programs = build] = process.argv.slice(2);
    if (!/^\d+$/.test(port) || Number(port) > 65535) {
        console.error(`The port is ${port}; it must be a whole number from 0 (any free port) to 65535.`);
        process.exit(2);
    }
    const server = await serve({ port: Number(port), programs }).catch((error) => {
        console.error({ EADDRINUSE: `Port ${port} is in use: give another one, or 0 for any that is free.`,
            EACCES: `Port ${port} may not be opened by this user: give one from 1024 on.` }[error.code] ??
            error.message);
        process.exit(1);
    });
    console.log(`http://127.0.0.1:${server.address().port}/`);
}
