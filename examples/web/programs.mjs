// The programs that 06_emit_wgsl wrote, by what their names say of their policies.

const kinds = {
    kernel: '.+', transfer: 'apic|pic', force: 'mls|weight_gradient', material: '.+?', walls: 'walls_\\w+?',
    field: 'attraction|gravity',
};
const pattern = new RegExp(`^3d_${Object.entries(kinds).map(([name, kind]) => `(?<${name}>${kind})`).join('_')}$`);
const usual = { kernel: 'quadratic_b_spline', transfer: 'apic', force: 'mls', walls: 'separate', field: 'attraction' };

export class Programs {
    policies = Object.keys(usual);
    #all = [];

    /** Asks the server, or reads programs/index.json. */
    async fetchNames() {
        for (const list of ['programs/', 'programs/index.json']) {
            const names = await fetch(list).then((answer) => answer.json()).catch(() => null);
            if (Array.isArray(names)) return this.use(names);
        }
        return null;
    }

    use(names) {
        this.#all = names.map((program) => ({ ...pattern.exec(program)?.groups, program }))
            .filter(({ material }) => material).map((each) => ({ ...each, walls: each.walls.slice('walls_'.length) }));
    }

    #with(material) { return this.#all.filter((each) => each.material === material); }

    /** Those of the materials for which there are programs; all, if there are none for any. */
    materialsOf(materials) {
        const there = materials.filter((material) => this.#with(material).length);
        return there.length ? there : materials;
    }

    /** What a policy can be with a material. */
    choices(material, policy) {
        const all = [...new Set(this.#with(material).map((each) => each[policy]))];
        return all.length ? all : [usual[policy]];
    }

    /** The program with most of the wanted policies, above all with the one that `first` names. */
    nearest(material, wanted) {
        const want = { ...usual, ...wanted };
        const likeness = (each) => this.policies.reduce((sum, name) =>
            sum + (each[name] === want[name]) * (name === wanted.first ? 10 : 1), 0);
        const none = { ...want, program: `3d_${want.kernel}_${want.transfer}_${want.force}_${material}_walls_` +
            `${want.walls}_${want.field}` };
        return this.#with(material).reduce((best, each) => (likeness(each) > likeness(best) ? each : best),
            this.#with(material)[0] ?? none);
    }
}
