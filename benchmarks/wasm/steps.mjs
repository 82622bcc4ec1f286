// node steps.mjs NAME THREADS: for NAME.wasm, prints a line for each scene: its name and the shortest time of a step [ms].
import process from 'node:process';
import { load } from '../../examples/web/wasm/module.mjs';

const [name, threads] = [process.argv[2], Number(process.argv[3])];
const { call, ...module } = await load(name, { threads });
for (const scene of ['snow', 'balls', 'cloth']) {
    call[`make_${scene}`](threads);
    let least = Infinity;
    for (let i = 0; i < 60; ++i) {
        const start = performance.now();
        call[`step_${scene}`]();
        least = Math.min(least, performance.now() - start);
    }
    console.log(`${scene} ${least.toFixed(3)}`);
}
process.exit(module.threads === threads ? 0 : 1);
