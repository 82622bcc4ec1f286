// What examples/web/serve.mjs gives away, and what it does not.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { request } from 'node:http';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import process from 'node:process';
import { after, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { serve } from '../../examples/web/serve.mjs';

const folder = mkdtempSync(join(tmpdir(), 'firn-serve-'));
for (const name of ['pages', 'pages/sub', 'programs', 'programs/one', 'programs/none', 'pages-beside'])
    mkdirSync(join(folder, name));
const files = { 'pages/index.html': 'page', 'pages/host.mjs': 'host', 'programs/one/manifest.json': '{}',
    'programs/one/program.wgsl': 'code', 'programs/one/module.wasm': 'code', 'pages-beside/secret': 'secret', 'secret': 'secret' };
for (const [name, text] of Object.entries(files)) writeFileSync(join(folder, name), text);
symlinkSync(join(folder, 'secret'), join(folder, 'pages/link'));
const server = await serve({ port: 0, pages: join(folder, 'pages'), programs: join(folder, 'programs') });
after(() => {
    server.close();
    rmSync(folder, { recursive: true });
});

/** Sends the path as it is: fetch() would take .. out. */
const get = (path, method = 'GET') => new Promise((done, fail) => {
    request({ port: server.address().port, host: '127.0.0.1', path, method, agent: false }, (response) => {
        let text = '';
        response.setEncoding('utf8').on('data', (part) => { text += part; });
        const { statusCode: status, headers } = response;
        response.on('end', () => done({ status, type: headers['content-type'], text, headers }));
    }).on('error', fail).end();
});

test('pages and programs are served with their types', async () => {
    const answer = async (path) => {
        const { status, type, text } = await get(path);
        return { status, type, text };
    };
    assert.deepEqual(await answer('/'), { status: 200, type: 'text/html; charset=utf-8', text: 'page' });
    assert.deepEqual(await answer('/host.mjs?x=1'), { status: 200, type: 'text/javascript', text: 'host' });
    assert.equal((await get('/programs/one/module.wasm')).type, 'application/wasm');
    assert.equal((await get('/programs/one/program.wgsl')).text, 'code');
    assert.deepEqual(JSON.parse((await get('/programs/')).text), ['one']);
    assert.equal(server.address().address, '127.0.0.1');
});

test('pages may share memory between threads', async () => {
    for (const path of ['/', '/host.mjs', '/programs/one/module.wasm']) {
        const { headers } = await get(path);
        assert.equal(headers['cross-origin-opener-policy'], 'same-origin');
        assert.equal(headers['cross-origin-embedder-policy'], 'require-corp');
    }
});

test('nothing outside the two folders is served', async () => {
    const outside = [
        '/../secret', '/%2e%2e/secret', '/..%2fsecret', '/sub/../../secret', '//../secret', '/link',
        '/../pages-beside/secret', '/%2e%2e/pages-beside/secret', '/programs/../../secret',
        '/programs/..%2f..%2fsecret',
        '/programs/../pages/index.html', '/sub', '/sub/', '/no.mjs',
    ];
    for (const path of outside) {
        const { status, text } = await get(path);
        assert.equal(status, 404, path);
        assert.ok(!text.includes('secret'), path);
    }
    assert.equal((await get('/%')).status, 400);
    assert.equal((await get('/%00')).status, 404);
    assert.equal((await get('/', 'POST')).status, 405);
    assert.equal((await get('/', 'HEAD')).text, '');
});

test('a port that is no number, or in use, gets a sentence', () => {
    const script = fileURLToPath(new URL('../../examples/web/serve.mjs', import.meta.url));
    const start = (port) => {
        const { status, stderr } = spawnSync(process.execPath, [script, port], { encoding: 'utf8', timeout: 20_000 });
        return { status, stderr };
    };
    for (const port of ['http', '-1', '8000x', '70000'])
        assert.deepEqual(start(port), { status: 2,
            stderr: `The port is ${port}; it must be a whole number from 0 (any free port) to 65535.\n` });
    const { port } = server.address();
    assert.deepEqual(start(String(port)), { status: 1,
        stderr: `Port ${port} is in use: give another one, or 0 for any that is free.\n` });
});
