// Sources, which add particles while a simulation runs, and steps that end where a source gives some.
//
//   const run = new Run(simulation);                                         // after simulation.initialise()
//   run.addSource(water, Source.jet(layer, spacing, 1000, [0, -2, 0]));
//   await run.advance(0.5);                                                  // s
import { FirnError } from './firn.mjs';

const longEnough = 1e30; // s
const atOnce = 16, betweenLooks = 256; // steps; so many the program logs
const withTimeLeft = 2; // of the uniform bound_time_step

/**
 * A source of particles, which adds them in bursts. Burst k = 0, 1, ... is due at the time start + k / rate, if this is
 * not after `end`. It has the rules of firn::Source.
 */
export class Source {
    /**
     * @param options {{samples: object, density: number, velocity: number[], rate?: number, start?: number,
     *        end?: number}} the particles of one burst ({ position, volume }, the positions one after the other [m]),
     *        their density [kg/m^3] and velocity [m/s], the number of bursts a second, and the times of the first burst
     *        and after which there is none [s]
     */
    constructor({ samples, density, velocity, rate = 1, start = 0, end = Infinity }) {
        Object.assign(this, { samples, density, velocity, rate, start, end, bursts: 0 });
        const particles = samples.position.length / velocity.length;
        if (!(particles > 0)) throw new FirnError('A source has no particles to give.');
        if (![rate, density, samples.volume].every((x) => x > 0 && Number.isFinite(x)))
            throw new FirnError(`A source gives ${rate} bursts a second of particles of ${samples.volume} m^3 and ` +
                `${density} kg/m^3; all three must be positive and finite.`);
        if (!Number.isFinite(start) || !(end >= start))
            throw new FirnError(`A source gives particles from ${start} s to ${end} s; the start must be finite and ` +
                'not after the end.');
        this.particles = particles;
    }

    /**
     * A source whose bursts form a jet without gaps: each is a layer of thickness `spacing` [m], perpendicular to the
     * velocity, and the next one is due when it has moved by as much.
     */
    static jet(layer, spacing, density, velocity, times = {}) {
        const speed = Math.hypot(...velocity);
        if (!(spacing > 0 && speed > 0 && Number.isFinite(speed / spacing)))
            throw new FirnError(`A jet of speed ${speed} m/s with layers ${spacing} m apart: both must be positive.`);
        return new Source({ samples: layer, density, velocity, rate: speed / spacing, ...times });
    }

    timeOf(burst) { return this.start + burst / this.rate; }
    /** When the next burst is due [s]; infinite if none follows. */
    get next() {
        const due = this.timeOf(this.bursts);
        return due <= this.end ? due : Infinity;
    }
    isDue(time) { return this.next <= time; }
}

/**
 * Adds particles without strain behind the last one of a set, after the steps so far. As on the CPU, the stress and the
 * signal speed of the set are found anew, and the next step sorts it.
 */
export function addParticles(set, { position, volume }, density, velocity) {
    const { manifest, particles: first } = set, D = manifest.dimension;
    const count = position.length / D, all = (x) => new Float32Array(count).fill(x);
    set.set('particles', first + count);
    set.write({ ...set.atRest(count), position, volume: all(volume), mass: all(density * volume),
        velocity: Float32Array.from(position, (_, k) => velocity[k % D]) }, first);
    set.run(manifest.initialise, 1, [set]);
    set.sortNext();
}

/** Takes steps of a simulation, all sets on its grid together, at their bound, and lets sources give particles. */
export class Run {
    time = 0; // s
    steps = 0;
    status = null; // the last one
    #sources = [];
    #end = NaN; // until which the device has the time left
    #counted = 0; // steps that the device had taken at the last look
    #step = 0; // about how long one is [s]
    #isStopped = false;

    /**
     * @param simulation {Simulation} the first set of particles on a grid, before its first step
     * @param schedule () => string: the schedule of a step
     */
    constructor(simulation, schedule = () => 'step') {
        Object.assign(this, { simulation, schedule });
        for (const set of simulation.sets) set.sortNext(); // the CPU sorts before the first step
    }

    /** Adds a source to a set. Bursts that were due before the present time are left out. */
    addSource(set, source) {
        if (!this.simulation.sets.includes(set)) throw new FirnError('A source gives particles to a set of the run.');
        while (this.steps > 0 && source.isDue(this.time)) ++source.bursts;
        this.#sources.push({ set, source });
    }

    /** When the next burst is due [s]; infinite if none follows. */
    get nextBurst() { return Math.min(Infinity, ...this.#sources.map(({ source }) => source.next)); }

    #give() {
        for (const { set, source } of this.#sources)
            for (; source.isDue(this.time); ++source.bursts) {
                const { samples: { position, volume }, velocity, density } = source, D = velocity.length;
                const since = this.time - source.timeOf(source.bursts);
                addParticles(set, { position: position.map((x, k) => x + velocity[k % D] * since), volume }, density,
                    velocity);
            }
    }

    /** Lets the device take no step that goes beyond a time [s]. */
    #takeUntil(end) {
        if (end === this.#end) return;
        this.simulation.setTimeLeft(Math.min(end - this.time, longEnough));
        for (const set of this.simulation.sets) set.set('bound_time_step', withTimeLeft);
        this.#end = end;
    }

    /**
     * Takes steps until `duration` [s] has passed, or `most` steps are taken. A step ends where a burst is due, and the
     * burst is added then; the steps do not depend on how many of them a call takes. A call has to end before the next.
     * @returns the number of steps
     */
    async advance(duration, most = Infinity) {
        const { simulation } = this, end = this.time + duration, before = this.steps;
        this.#give();
        while (!this.#isStopped && this.time < end && this.steps - before < most) {
            const until = Math.min(end, this.nextBurst);
            this.#takeUntil(until);
            const wanted = this.#step > 0 ? Math.ceil((until - this.time) / this.#step) + 1 : atOnce;
            simulation.step(Math.min(wanted, most - (this.steps - before), betweenLooks), this.schedule());
            await this.#look(until);
            if (!this.#isStopped) this.#give();
        }
        return this.steps - before;
    }

    /** Lets advance() submit nothing more: before the simulation is destroyed. */
    stop() { this.#isStopped = true; }

    /** Waits for steps until a time [s], and takes note of them. */
    async #look(until) {
        const { simulation } = this, words = await simulation.readBuffer('status');
        const names = simulation.manifest.status, numbers = new Float32Array(words.buffer);
        const taken = [], begun = this.time, hasArrived = !(numbers[names.time_left] > 0);
        for (; this.#counted < words[names.steps]; ++this.#counted)
            taken.push(numbers[names.first_time_step + this.#counted % betweenLooks]);
        this.steps += taken.length;
        simulation.steps = this.steps; // the others that it was asked for did nothing
        this.status = await simulation.check(words);
        for (const dt of taken) this.time += dt;
        if (hasArrived) this.time = until;
        if (!(this.time > begun)) throw new FirnError(`At ${begun} s the bound of the time step is too small.`);
        const whole = hasArrived ? taken.slice(0, -1) : taken;
        if (whole.length) this.#step = whole.at(-1);
    }
}
