// Runs a program on the page: owns the device, the simulation and its picture, and steps and draws in each frame.
import { FirnError, Program, Simulation, checkLimits, fetchProgram, gridOf, requestDevice } from './firn.mjs';
import { Renderer } from './render.mjs';
import { fetchCase, fillBodies, lame, longest, plainBox, plainLook, scenes, writeBodies, writeCase, writeVaried,
    youngPoisson } from './scene.mjs';

const framesInFlight = 2;
const stepsAtOnce = 20; // the steps that step() takes between two waits for the device
const longestFrame = 200; // ms; a slow device takes fewer steps a frame
const largest = { particles: 500_000, cells: 128 }; // the device can run this size if it is large enough

export class Player {
    paused = false;
    simulation = null;
    box = plainBox;
    figures = { frame: NaN, step: NaN, rate: NaN, time: 0, signal_speed: NaN, largest_acceleration: NaN,
        time_step: NaN, needed: 0, taken: 0 };
    dirty = true;
    #device = null;
    #programs = null; // of the sets of particles
    #run = null; // of a scene of several materials
    #isRunning = false; // whether the run waits for its steps
    #renderer = null;
    #bodies = null;
    #mesh = null; // of the programs, if they have one
    #force = { x: 0, y: 0, sign: 0 };
    #pending = 0; // frames that the device has not finished
    #builds = 0;
    #waiting = Promise.resolve();
    #last = { frame: NaN, done: 0, look: '' };
    #owed = 0; // simulated time that frames have taken too little [s]

    /**
     * @param controls {Controls} the form, whose values the simulation gets
     * @param from {{urls: string[], folder: string, scene: string}} the folders of the programs, one for each set of
     *        particles, and that of the case, if there is one, or else the name of the scene
     * @param told {{failed: function, loaded: function, built: function}} callbacks: failed(error), loaded(manifest)
     *        with a new program, built() with a new simulation
     */
    constructor(canvas, camera, controls, from, told) {
        Object.assign(this, { canvas, camera, controls, from, told });
        requestAnimationFrame((now) => this.#loop(now));
    }

    get device() { return this.#device; }
    get manifest() { return this.simulation?.manifest ?? this.#programs?.[0].manifest; }
    get particles() { return this.simulation?.sets.reduce((sum, { particles }) => sum + particles, 0); }
    get scene() { return scenes[this.from.scene]; }
    get look() { return this.from.folder ? plainLook : this.scene.look; }
    /** The bound of the next time step [s]. */
    get bound() {
        const { manifest, figures: { signal_speed, largest_acceleration } } = this;
        const cellSize = this.simulation?.values.cell_size;
        return Math.min(manifest?.time_step_safety * cellSize / signal_speed,
            manifest?.acceleration_safety * Math.sqrt(cellSize / largest_acceleration));
    }
    #has(uniform) { return this.manifest?.uniforms.fields.some(({ name }) => name === uniform) ?? false; }
    get gravityName() { return this.#has('field_gravity') ? 'field_gravity' : 'gravity'; }
    get hasForce() { return this.#has('field_strength') && this.#has('field_centre'); }

    /** Why the device cannot run so many particles; empty if it can. */
    refusal(particles) {
        const { sets, nodes } = this.simulation, all = sets.reduce((sum, { capacity }) => sum + capacity, 0);
        try {
            for (const { manifest, capacity } of sets)
                checkLimits(manifest, { capacity: Math.ceil(particles * capacity / all), nodes }, this.#device.limits);
            return '';
        } catch (error) {
            return error.message;
        }
    }

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
        this.#run?.stop();
        this.simulation?.destroy();
        this.simulation = this.#run = null;
        this.#isRunning = false;
        this.#owed = 0;
        Object.assign(this.figures, { step: NaN, rate: NaN, time: 0, signal_speed: NaN, largest_acceleration: NaN,
            time_step: NaN, needed: 0 });
    }

    async #build() {
        const { values } = this.controls, { urls, folder } = this.from, { scene } = this;
        const start = folder ? await fetchCase(folder) : null;
        this.box = start ? plainBox : scene.box;
        const cellSize = start?.uniforms.cell_size ?? longest(this.box) / values.cells;
        const domain = { ...this.box, cell_size: cellSize };
        const several = !start && scene.sets ? await import('./sets.mjs') : null;
        const fill = several ? several.fillSets : (...all) => [fillBodies(...all)];
        const filled = start ? [start] : fill(scene, values.particles, cellSize, values.speed);
        const sizes = filled.map(({ particles, capacity = particles }) =>
            ({ particles, capacity, ...(start ? { nodes: start.uniforms.nodes } : { domain }) }));
        if (String(this.#programs?.map(({ url }) => url)) !== String(urls) || !this.#device)
            await this.#load(urls, sizes[0]);
        const simulation = await this.#create(sizes), { sets } = simulation;
        if (this.#mesh) simulation.writeBuffer('distances', this.#mesh.distances);
        let drawn = filled;
        if (start) {
            drawn = [await writeCase(simulation, start)];
            this.#showCase(start.uniforms);
        } else {
            sets.forEach((set, k) => {
                if (several) several.writeSet(set, scene.sets[k], filled[k]);
                else writeBodies(set, filled[k], values.density);
                this.#place(set);
                set.set('bound_time_step', 1); // a case takes the steps of the CPU
            });
        }
        this.simulation = simulation;
        this.#bodies = filled[0];
        if (!start) {
            for (const name of Object.keys(values)) this.apply(name, true);
            if (!several) writeVaried(simulation, scene, filled[0]);
        }
        simulation.initialise();
        if (several) {
            this.#run = new several.Run(simulation, () => values.schedule);
            filled.forEach(({ jet }, k) => jet && this.#run.addSource(sets[k], jet));
        }
        this.#renderer.show(drawn.map((each, k) => ({ look: this.look, ...each, simulation: sets[k] })),
            { cellSize, box: this.box, look: this.look, obstacle: this.#obstacle(simulation) });
        this.apply('colour');
        this.dirty = true;
        this.told.built();
        await this.#check(simulation);
    }

    /** Creates the sets of particles. Returns the first one, which has the grid. */
    async #create(sizes) {
        let simulation = null;
        try {
            for (const [k, size] of sizes.entries()) {
                const set = await Simulation.create(this.#programs[k], size, simulation);
                simulation ??= set;
            }
            return simulation;
        } catch (error) {
            simulation?.destroy();
            throw error;
        }
    }

    /** Sets a uniform of those sets of particles that have it. */
    #set(name, value) {
        for (const set of this.simulation.sets)
            if (set.manifest.uniforms.fields.some((field) => field.name === name)) set.set(name, value);
    }

    /** Puts the walls and the obstacle where the scene has them. */
    #place(simulation) {
        const { box, scene: { obstacle } } = this;
        for (const { name } of simulation.manifest.uniforms.fields) {
            const [, what] = /^boundary_(?:\d+_)?(?:shape_)?(lower|upper|half_extents|position)$/.exec(name) ?? [];
            const value = what && (box[what] ?? obstacle?.[what]);
            if (value) simulation.set(name, value);
        }
    }

    /** The obstacle that the program has, where its uniforms say. */
    #obstacle({ values }) {
        const [, of] = Object.keys(values).map((name) => /^(.*_)shape_(half_extents|grid_first)$/.exec(name))
            .find((found) => found) ?? [];
        if (!of || (!this.#mesh && !values[`${of}shape_half_extents`])) return null;
        return { half_extents: values[`${of}shape_half_extents`], position: values[`${of}position`],
            rotation: values[`${of}rotation`], colour: this.scene.obstacle?.colour ?? '#9c6248' };
    }

    async #load(urls, size) {
        const fetched = await Promise.all(urls.map(fetchProgram)).catch((error) => {
            throw new FirnError(`There is no program: ${error.message} Write one there with 06_emit_wgsl of firn's ` +
                'examples, or start serve.mjs with a folder of programs.');
        });
        for (const { manifest: { name, dimension } } of fetched)
            if (dimension !== 3) throw new FirnError(`${name} is in ${dimension} dimensions; this page shows three.`);
        const [{ manifest }] = fetched, hasMesh = manifest.distances && !this.from.folder; // a case has its own
        const mesh = hasMesh ? await (await import('./mesh.mjs')).fetchMesh(urls[0]) : null;
        if (!this.#device) {
            const { nodes } = gridOf({ lower: [0, 0, 0], upper: [1, 1, 1], cell_size: 1 / largest.cells });
            const device = await requestDevice(navigator.gpu, manifest, { particles: largest.particles, nodes })
                .catch((error) => (error.limit ? requestDevice(navigator.gpu, manifest, size) : Promise.reject(error)));
            device.lost.then(({ reason, message }) => {
                if (this.#device !== device) return;
                this.#device = this.#programs = this.#renderer = null;
                this.#drop();
                this.#fail(new FirnError(`The graphics device was lost (${reason}). ${message}`, { lost: true }));
            });
            this.#renderer = await Renderer.create(device, this.canvas);
            this.#device = device;
        }
        this.#programs = null;
        this.#mesh = mesh;
        await this.#renderer.useMesh(mesh);
        this.#programs = await Promise.all(fetched.map(async (each, k) =>
            Object.assign(await Program.create(this.#device, each.manifest, each.code), { url: urls[k] })));
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

    /** Passes the value of a control to the simulation or the picture. `starting`: before the first step. */
    apply(name, starting = false) {
        const { simulation } = this, { values } = this.controls;
        if (!simulation) return;
        this.dirty = true;
        if (name === 'time_step') this.#set(name, values[name]);
        else if (name === 'gravity') this.#set(this.gravityName, values[name]);
        else if (name === 'colour') this.#renderer.speeds = values[name] === 'speed';
        if (!this.#applyMaterial(name) || starting || this.from.folder) return;
        writeVaried(simulation, this.scene, this.#bodies);
        simulation.initialise(); // the stress and the signal speed of the changed material
    }

    #applyMaterial(name) {
        const { simulation } = this, { values } = this.controls;
        if (simulation.sets.length > 1) return false; // each has its own
        if (['young', 'poisson'].includes(name) && this.#has('material_mu') && this.#has('material_lambda')) {
            const { mu, lambda } = lame(values.young, values.poisson);
            simulation.set({ material_mu: mu, material_lambda: lambda });
            return true;
        }
        if (!name.startsWith('material_')) return false;
        simulation.set(name, values[name]);
        return true;
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
        const force = { centre, direction, radius, strength: sign * strength };
        for (const [name, value] of Object.entries(force)) this.#set(`field_${name}`, value);
    }

    /** Takes steps. Resolves to the time that they took [s]. */
    #advance(simulation, count) {
        this.#applyForce();
        if (this.#run) return this.#advanceRun(this.#run, count);
        simulation.resetTime();
        simulation.step(count, this.controls.values.schedule);
        this.dirty = true;
        return this.#check(simulation).then((status) => {
            if (simulation !== this.simulation) return 0;
            this.figures.time += status.time;
            this.figures.time_step = status.time_step;
            return status.time;
        });
    }

    async #advanceRun(run, count) {
        const begun = run.time;
        this.dirty = this.#isRunning = true;
        try {
            await run.advance(Infinity, count);
        } catch (error) {
            if (run === this.#run) this.#fail(error);
            throw error;
        } finally {
            if (run === this.#run) this.#isRunning = false;
        }
        if (run !== this.#run) return 0;
        const { signal_speed, largest_acceleration, time_step } = run.status;
        Object.assign(this.figures, { signal_speed, largest_acceleration, time_step, time: run.time });
        return run.time - begun;
    }

    /** Pauses, takes `count` steps, and resolves when they are done and drawn. Rejects if a step has failed. */
    async step(count = 1) {
        this.paused = true;
        await this.#waiting;
        while (this.#isRunning) await new Promise((done) => { setTimeout(done, 5); }); // the steps of a frame
        const { simulation } = this;
        if (!simulation) throw new FirnError('There is no simulation to step.');
        for (let left = count; left > 0 && simulation === this.simulation; left -= stepsAtOnce)
            await this.#advance(simulation, Math.min(left, stepsAtOnce));
        this.draw();
    }

    async #check(simulation) {
        try {
            const status = await simulation.check();
            const { signal_speed, largest_acceleration } = status;
            if (simulation === this.simulation) Object.assign(this.figures, { signal_speed, largest_acceleration });
            return status;
        } catch (error) {
            if (simulation === this.simulation) this.#fail(error);
            throw error;
        }
    }

    #fail(error) {
        this.paused = true;
        this.error = error;
        if (error.code === undefined) this.#programs = null; // it keeps the errors of the device

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

    /** How many steps the next frame takes, so that frames simulate equal times. */
    #stepsOfFrame(wanted) {
        const { figures, controls: { values } } = this, dt = Math.min(values.time_step, this.bound || Infinity);
        figures.needed = Math.max(1, Math.round((wanted + this.#owed) / dt));
        const inTime = Number.isFinite(figures.step) ? Math.floor(longestFrame / figures.step) : figures.needed;
        figures.taken = Math.min(figures.needed, values.steps, Math.max(1, inTime));
        return figures.taken;
    }

    #frame(now, simulation) {
        const { figures, paused } = this, { queue } = this.#device;
        const smooth = (name, value) => {
            figures[name] = Number.isFinite(figures[name]) ? 0.92 * figures[name] + 0.08 * value : value;
        };
        ++this.#pending;
        if (!paused && !this.#isRunning) {
            const wanted = this.controls.values.frame, count = this.#stepsOfFrame(wanted);
            const start = performance.now(), since = now - this.#last.frame;
            const advanced = this.#advance(simulation, count);
            advanced.then((time) => {
                if (simulation !== this.simulation) return;
                this.#owed = Math.min(Math.max(this.#owed + wanted - time, -wanted), 0.5 * wanted);
            }, () => {});
            (this.#run ? advanced : queue.onSubmittedWorkDone()).then(() => {
                // The previous frame may still have been running.
                const began = Math.max(start, this.#last.done);
                if (simulation === this.simulation) smooth('step', (performance.now() - began) / count);
            }, () => {});
            if (Number.isFinite(since)) {
                smooth('frame', since);
                figures.rate = 1000 * count * this.particles / figures.frame;
            }
            this.#last.frame = now;
        }
        this.draw();
        queue.onSubmittedWorkDone().catch(() => {}).finally(() => {
            --this.#pending;
            this.#last.done = performance.now();
        });
    }

    // ---- reading ----

    /** The positions of the particles [m]: x, y, z of particle 0, then of particle 1, ..., set after set. */
    async positions() {
        const { simulation, box } = this, { cell_size } = simulation.values;
        const all = new Float32Array(3 * this.particles);
        let first = 0;
        for (const set of simulation.sets) {
            const [place, corner] = [await set.read('place'), await set.read('corner')];
            all.set(place.map((p, k) => box.lower[k % 3] + (corner[k] + p) * cell_size), first);
            first += place.length;
        }
        return all;
    }

    /** The centre of mass [m], summed in 64 bits. */
    async centreOfMass() {
        const { simulation, box } = this, { cell_size } = simulation.values, sum = [0, 0, 0];
        let all = 0;
        for (const set of simulation.sets) {
            const [place, corner, mass] = [await set.read('place'), await set.read('corner'), await set.read('mass')];
            mass.forEach((m, i) => {
                all += m;
                for (let a = 0; a < 3; ++a) sum[a] += m * (corner[3 * i + a] + place[3 * i + a]);
            });
        }
        return sum.map((x, a) => box.lower[a] + x / all * cell_size);
    }
}
