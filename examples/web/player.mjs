// Runs a program on the page: owns the device, the simulation and its picture, and steps and draws in each frame.
import { FirnError, Program, Simulation, fetchProgram, requestDevice } from './firn.mjs';
import { Renderer } from './render.mjs';
import { box, fetchCase, lame, youngPoisson, scenes, throwBodies, writeBodies, writeCase } from './scene.mjs';

const framesInFlight = 2;
const stepsAtOnce = 20; // the steps that step() takes between two waits for the device
const largest = { particles: 250_000, cells: 128 }; // the device can run this size, or more if needed
const timeStepBound = 0.3; // cells that the fastest signal may cross in a step
const checkMilliseconds = 300;

export class Player {
    paused = false;
    simulation = null;
    figures = { frame: NaN, step: NaN, rate: NaN, time: 0, signal_speed: NaN };
    dirty = true;
    #device = null;
    #program = null;
    #renderer = null;
    #force = { x: 0, y: 0, sign: 0 };
    #pending = 0; // frames that the device has not finished
    #builds = 0;
    #waiting = Promise.resolve();
    #last = { frame: NaN, check: 0, done: 0, look: '' };

    /**
     * @param controls {Controls} the form, whose values the simulation gets
     * @param from {{url: string, folder: string}} the folder of the program, and that of the case, if there is one
     * @param told {{failed: function, loaded: function}} callbacks: failed(error), loaded(manifest)
     */
    constructor(canvas, camera, controls, from, told) {
        Object.assign(this, { canvas, camera, controls, from, told });
        requestAnimationFrame((now) => this.#loop(now));
    }

    get device() { return this.#device; }
    get manifest() { return this.simulation?.manifest ?? this.#program?.manifest; }
    get bound() { return timeStepBound * this.simulation?.values.cell_size / this.figures.signal_speed; }
    #has(uniform) { return this.manifest?.uniforms.fields.some(({ name }) => name === uniform) ?? false; }
    get gravityName() { return this.#has('field_gravity') ? 'field_gravity' : 'gravity'; }
    get hasForce() { return this.#has('field_strength') && this.#has('field_centre'); }

    // ---- starting ----

    /** Starts again from the first state. Creates the device and the program only if they are missing or unusable. */
    restart() {
        const build = ++this.#builds;
        this.#drop();
        // Builds run one after the other. If several are waiting, only the last of them runs.
        this.#waiting = this.#waiting.catch(() => {}).then(() => build === this.#builds && this.#build());
        this.#waiting.catch((error) => this.#fail(error));
        return this.#waiting;
    }

    #drop() {
        this.simulation?.destroy();
        this.simulation = null;
        Object.assign(this.figures, { step: NaN, rate: NaN, time: 0, signal_speed: NaN });
    }

    async #build() {
        const { values } = this.controls, { url, folder } = this.from;
        const start = folder ? await fetchCase(folder) : null;
        if (this.#program?.url !== url || !this.#device) await this.#load(url, start);
        const cellSize = start?.uniforms.cell_size ?? 1 / values.cells;
        const bodies = start ?? throwBodies(scenes[values.bodies], values.particles, cellSize);
        const { particles, capacity = particles } = bodies;
        const size = start ? { nodes: start.uniforms.nodes } : { domain: { ...box, cell_size: cellSize } };
        const simulation = await Simulation.create(this.#program, { particles, capacity, ...size });
        let drawn = bodies;
        if (start) {
            drawn = await writeCase(simulation, start);
            this.#showCase(start.uniforms);
        } else {
            writeBodies(simulation, bodies);
            for (const name of ['boundary_lower', 'boundary_upper'])
                if (this.#has(name)) simulation.set(name, box[name.slice(9)]);
        }
        this.simulation = simulation;
        if (!start) for (const name of Object.keys(values)) this.apply(name);
        simulation.initialise();
        this.#renderer.show(simulation, { ...drawn, cellSize });
        this.apply('colour');
        this.dirty = true;
        await this.#check(simulation);
    }

    async #load(url, start) {
        const { manifest, code } = await fetchProgram(url).catch((error) => {
            throw new FirnError(`There is no program: ${error.message} Write one there with 06_emit_wgsl of firn's ` +
                'examples, or start serve.mjs with a folder of programs.');
        });
        if (manifest.dimension !== 3)
            throw new FirnError(`${manifest.name} is in ${manifest.dimension} dimensions; this page shows three.`);
        if (!this.#device) {
            const { particles, cells } = this.controls.values, width = Math.max(largest.cells, cells);
            const size = start ? { particles: start.capacity, nodes: start.uniforms.nodes }
                : { particles: Math.max(largest.particles, 2 * particles), domain: { ...box, cell_size: 1 / width } };
            const device = await requestDevice(navigator.gpu, manifest, size);
            device.lost.then(({ reason, message }) => {
                if (this.#device !== device) return;
                this.#device = this.#program = this.#renderer = null;
                this.#drop();
                this.#fail(new FirnError(`The graphics device was lost (${reason}). ${message}`, { lost: true }));
            });
            this.#renderer = await Renderer.create(device, this.canvas);
            this.#device = device;
        }
        this.#program = await Program.create(this.#device, manifest, code);
        this.#program.url = url;
        this.told.loaded(manifest);
    }

    /** Sets the controls to the values of a case. */
    #showCase(uniforms) {
        const { material_mu: mu, material_lambda: lambda } = uniforms;
        const known = { time_step: uniforms.time_step, gravity: uniforms[this.gravityName] };
        if (mu !== undefined && lambda !== undefined)
            Object.assign(known, youngPoisson(mu, lambda));
        for (const [name, value] of Object.entries(known)) if (value !== undefined) this.controls.set(name, value);
    }

    /** Passes the value of a control to the simulation or the picture. */
    apply(name) {
        const { simulation } = this, { values } = this.controls;
        if (!simulation) return;
        this.dirty = true;
        if (name === 'time_step') simulation.set(name, values[name]);
        else if (name === 'gravity') simulation.set(this.gravityName, values[name]);
        else if ((name === 'young' || name === 'poisson') && this.#has('material_mu')) {
            const { mu, lambda } = lame(values.young, values.poisson);
            simulation.set({ material_mu: mu, material_lambda: lambda });
        } else if (name.startsWith('material_')) simulation.set(name, values[name]);
        else if (name === 'colour') this.#renderer.speeds = values[name] === 'speed';
    }

    setTheme(name) {
        this.theme = name;
        this.dirty = true;
    }

    // ---- stepping ----

    /** Makes the pointer at x, y (-1 to 1) pull (sign 1), push (-1) or do neither (0). */
    setForce(force) { this.#force = force; }

    #applyForce() {
        const { simulation, camera, canvas } = this, { x, y, sign } = this.#force;
        if (!this.hasForce || (sign === 0 && simulation.values.field_strength === 0)) return;
        const { centre, direction } = camera.ray(x, y, canvas.clientWidth / canvas.clientHeight);
        const { radius, strength } = this.controls.values;
        simulation.set({ field_centre: centre, field_direction: direction, field_radius: radius,
            field_strength: sign * strength });
    }

    #advance(count) {
        const { simulation } = this;
        this.#applyForce();
        simulation.step(count, this.controls.values.schedule);
        this.figures.time += count * simulation.values.time_step;
        this.dirty = true;
    }

    /** Pauses, takes `count` steps, and resolves when they are done and drawn. Rejects if a step has failed. */
    async step(count = 1) {
        this.paused = true;
        await this.#waiting;
        const { simulation } = this;
        if (!simulation) throw new FirnError('There is no simulation to step.');
        for (let left = count; left > 0 && simulation === this.simulation; left -= stepsAtOnce) {
            this.#advance(Math.min(left, stepsAtOnce));
            await this.#device.queue.onSubmittedWorkDone();
        }
        this.draw();
        await this.#check(simulation);
    }

    async #check(simulation) {
        this.#last.check = performance.now();
        try {
            const { signal_speed } = await simulation.check();
            if (simulation === this.simulation) this.figures.signal_speed = signal_speed;
        } catch (error) {
            if (simulation === this.simulation) this.#fail(error);
            throw error;
        }
    }

    #fail(error) {
        this.paused = true;
        this.error = error;
        if (error.code === undefined) this.#program = null; // it keeps the errors of the device

        this.told.failed(error);
    }

    // ---- frames ----

    draw() {
        if (!this.simulation) return;
        this.#renderer.setTheme(this.theme ?? 'light');
        this.#renderer.draw(this.camera);
        this.dirty = false;
    }

    #loop(now) {
        requestAnimationFrame((next) => this.#loop(next));
        const { simulation, camera, canvas } = this;
        if (!simulation || this.#pending >= framesInFlight) return;
        const look = [camera.yaw, camera.pitch, camera.distance, canvas.clientWidth, canvas.clientHeight].join();
        if (this.paused) this.#last.frame = NaN;
        if (this.paused && !this.dirty && look === this.#last.look) return;
        this.#last.look = look;
        try {
            this.#frame(now, simulation);
        } catch (error) {
            this.#fail(error);
        }
    }

    #frame(now, simulation) {
        const { figures, paused } = this, { queue } = this.#device;
        const smooth = (name, value) => {
            figures[name] = Number.isFinite(figures[name]) ? 0.92 * figures[name] + 0.08 * value : value;
        };
        ++this.#pending;
        if (!paused) {
            const count = this.controls.values.steps, start = performance.now(), since = now - this.#last.frame;
            this.#advance(count);
            queue.onSubmittedWorkDone().then(() => { // the previous frame may still have been running
                const began = Math.max(start, this.#last.done);
                if (simulation === this.simulation) smooth('step', (performance.now() - began) / count);
            }, () => {});
            if (Number.isFinite(since)) {
                smooth('frame', since);
                figures.rate = 1000 * count * simulation.particles / figures.frame;
            }
            this.#last.frame = now;
            if (start - this.#last.check > checkMilliseconds) this.#check(simulation).catch(() => {});
        }
        this.draw();
        queue.onSubmittedWorkDone().catch(() => {}).finally(() => {
            --this.#pending;
            this.#last.done = performance.now();
        });
    }

    // ---- reading ----

    /** The positions of the particles [m]: x, y, z of particle 0, then of particle 1, ... */
    async positions() {
        const { simulation } = this, { cell_size } = simulation.values;
        const [place, corner] = [await simulation.read('place'), await simulation.read('corner')];
        return Float32Array.from(place, (p, k) => box.lower[k % 3] + (corner[k] + p) * cell_size);
    }

    /** The centre of mass [m], summed in 64 bits. */
    async centreOfMass() {
        const { simulation } = this, { cell_size } = simulation.values, sum = [0, 0, 0];
        const [place, corner, mass] = [await simulation.read('place'), await simulation.read('corner'),
            await simulation.read('mass')];
        let all = 0;
        mass.forEach((m, i) => {
            all += m;
            for (let a = 0; a < 3; ++a) sum[a] += m * (corner[3 * i + a] + place[3 * i + a]);
        });
        return sum.map((x, a) => box.lower[a] + x / all * cell_size);
    }
}
