// The form beside the picture, built from a table of controls. The page's address can set controls by their names:
// ?particles=10000&cells=32&young=20000&paused=1.

/** Writes x with three digits and a prefix of the unit: 38.5 kPa. */
export function withUnit(x, unit) {
    if (!Number.isFinite(x)) return '–';
    if (x === 0) return `0 ${unit}`;
    if (unit.startsWith('kg')) return `${Number(x.toPrecision(3))} ${unit}`; // it has a prefix already
    const prefixes = ['n', 'µ', 'm', '', 'k', 'M', 'G', 'T'];
    const power = Math.min(Math.max(Math.floor(Math.log10(Math.abs(x) * 1.0005) / 3), -3), 4);
    const number = x / 1000 ** power, digits = Math.abs(number) >= 99.95 ? 0 : Math.abs(number) >= 9.995 ? 1 : 2;
    return `${number.toFixed(digits)} ${prefixes[power + 3]}${unit}`.trim();
}

// kind: 'select' (options), 'log' (a slider over powers of ten), 'range', 'number' or 'vector'.
// scene: whether a change restarts the simulation. more: the group is folded away.
export const table = [
    { group: 'Scene', controls: [
        { name: 'scene', label: 'Scene', kind: 'select', options: [], value: '', scene: true },
        { name: 'material', label: 'Material', kind: 'select', options: [], value: '', scene: true },
        { name: 'cells', label: 'Cells', kind: 'select', whole: true, value: '64', scene: true, min: 8, max: 512,
            options: [] },
        { name: 'particles', label: 'Particles, about', kind: 'select', whole: true, value: '50000', scene: true,
            min: 100, max: 4_000_000, options: [['10000', '10 000'], ['50000', '50 000'], ['100000', '100 000'],
                ['200000', '200 000'], ['500000', '500 000']] },
        { name: 'speed', label: 'Speed of the start', kind: 'range', min: 0, max: 2, step: 0.05, value: 1, unit: '×',
            scene: true },
    ] },
    { group: 'Time', controls: [
        { name: 'frame', label: 'Simulated time a frame', kind: 'log', min: 1e-4, max: 2e-2, value: 4e-3, unit: 's' },
        { name: 'time_step', label: 'Longest time step', kind: 'log', min: 1e-6, max: 1e-2, value: 2.5e-4, unit: 's' },
        { name: 'steps', label: 'Steps a frame, at most', kind: 'log', min: 1, max: 1000, step: 1, value: 100 },
    ] },
    { group: 'Material', controls: [
        { name: 'density', label: 'Density', kind: 'log', min: 10, max: 10000, value: 1000, unit: 'kg/m³',
            scene: true },
        { name: 'young', label: 'Young’s modulus', kind: 'log', min: 1e3, max: 1e7, value: 4e4, unit: 'Pa' },
        { name: 'poisson', label: 'Poisson’s ratio', kind: 'range', min: 0, max: 0.45, step: 0.01, value: 0.3 },
    ] },
    { group: 'Gravity', controls: [
        { name: 'gravity', label: 'm/s²', kind: 'vector', step: 0.1, min: -1000, max: 1000, value: [0, -9.81, 0] },
    ] },
    { group: 'Pointer', controls: [
        { name: 'pointer', label: 'Left button, or a finger', kind: 'select', value: 'orbit',
            options: [['orbit', 'turns the view'], ['attract', 'attracts'], ['repel', 'repels']] },
        { name: 'radius', label: 'Radius', kind: 'range', min: 0.05, max: 1.5, step: 0.01, value: 0.2, unit: 'm' },
        { name: 'strength', label: 'Strength', kind: 'range', min: 10, max: 300, step: 5, value: 100, unit: 'm/s²' },
    ] },
    { group: 'Picture', controls: [
        { name: 'colour', label: 'Colour shows', kind: 'select', value: 'body',
            options: [['body', 'the body'], ['speed', 'the speed']] },
    ] },
    { group: 'More', more: true, controls: [
        ...['kernel', 'transfer', 'force', 'walls', 'field'].map((name) => ({ name, scene: true, kind: 'select',
            label: `${name[0].toUpperCase()}${name.slice(1)}`, options: [], value: '' })),
        { name: 'schedule', label: 'P2G', kind: 'select', value: 'step',
            options: [['step', 'direct'], ['step_sorted', 'sorted by block']] },
    ] },
];

function element(name, properties = {}, children = []) {
    const { dataset = {}, ...rest } = properties, made = Object.assign(document.createElement(name), rest);
    Object.assign(made.dataset, dataset);
    made.append(...children);
    return made;
}

export class Controls {
    values = {};
    #inputs = {}; // by name: the control and its elements

    /**
     * @param changed (name, control) => void: called when the user has changed a value
     * @param groups the groups of controls, as in `table`
     */
    constructor(form, changed, groups = table) {
        this.form = form;
        this.changed = changed;
        form.addEventListener('submit', (event) => event.preventDefault());
        for (const { group, controls, more } of groups) this.addGroup(group, controls, more);
    }

    addGroup(title, controls, more = false) {
        const heading = element(more ? 'summary' : 'legend', { textContent: title });
        const group = element(more ? 'details' : 'fieldset', { dataset: { group: title } }, [heading]);
        for (const control of controls) group.append(this.#row(control));
        this.form.append(group);
        return group;
    }

    removeGroup(title) {
        const group = this.#group(title);
        for (const { name } of group?.querySelectorAll('[name]') ?? []) {
            delete this.values[name];
            delete this.#inputs[name];
        }
        group?.remove();
    }

    #group(title) { return this.form.querySelector(`[data-group="${title}"]`); }

    #row(control) {
        const { name, label, kind, unit = '' } = control, id = `control_${name}`;
        const input = { select: () => this.#select(control, id), vector: () => this.#vector(control, id) }[kind]?.() ??
            this.#number(control, id);
        const isSlider = kind === 'log' || kind === 'range';
        const text = element('label', { htmlFor: kind === 'vector' ? `${id}_0` : id, textContent: label });
        if (kind === 'number' && unit && unit !== '1') text.textContent += ` [${unit}]`;
        const row = element('div', { className: 'control' }, [text]);
        const output = isSlider ? element('output', {}) : null;
        if (output) {
            output.htmlFor = id;
            row.append(output);
        }
        row.append(input);
        this.#inputs[name] = { control, input, output, row };
        this.set(name, control.value);
        return row;
    }

    #user(name, value) {
        this.values[name] = value;
        this.#describe(name);
        this.changed(name, this.#inputs[name].control);
    }

    #select({ name, options, whole }, id) {
        const select = element('select', { id, name }, options.map(([value, text]) => new Option(text, value)));
        select.addEventListener('change', () => this.#user(name, whole ? Number(select.value) : select.value));
        return select;
    }

    #vector({ name, value, step }, id) {
        const inputs = value.map((_, a) => {
            const input = element('input', { type: 'number', id: `${id}_${a}`, name, step: String(step) });
            input.setAttribute('aria-label', `${name} along ${'xyz'[a]}`);
            return input;
        });
        for (const input of inputs) input.addEventListener('input', () => {
            const numbers = inputs.map((each) => each.valueAsNumber);
            if (numbers.every(Number.isFinite)) this.#user(name, numbers);
        });
        return element('div', { className: 'numbers' }, inputs);
    }

    #number({ name, kind, min, max, step }, id) {
        const input = element('input', { type: kind === 'number' ? 'number' : 'range', id, name });
        if (kind === 'log') Object.assign(input, { min: '0', max: '1', step: '0.001' });
        else Object.assign(input, { min: min ?? '', max: max ?? '', step: step ?? 'any' });
        input.addEventListener('input', () => {
            const x = input.valueAsNumber;
            if (!Number.isFinite(x)) return;
            if (kind !== 'log') return this.#user(name, x);
            // A slider is not more precise than two digits.
            const chosen = Number((min * (max / min) ** x).toPrecision(2));
            return this.#user(name, step ? Math.round(chosen / step) * step : chosen);
        });
        return input;
    }

    #describe(name) {
        const { control: { kind, unit = '' }, input, output } = this.#inputs[name], value = this.values[name];
        if (!output) return;
        output.textContent = kind === 'log' ? withUnit(value, unit) : `${Number(value.toPrecision(6))} ${unit}`.trim();
        input.setAttribute('aria-valuetext', output.textContent);
    }

    has(name) { return name in this.#inputs; }

    set(name, value) {
        const { control, input } = this.#inputs[name], { kind, min, max, whole } = control;
        this.values[name] = whole ? Number(value) : value;
        const digits = (x) => String(Number(x.toPrecision(6)));
        if (kind === 'vector') [...input.children].forEach((each, a) => { each.value = digits(value[a]); });
        else if (kind === 'log') input.value = String(Math.log(value / min) / Math.log(max / min));
        else {
            const known = kind !== 'select' || [...input.options].some((option) => option.value === String(value));
            if (!known && value !== '') input.append(new Option(String(value), String(value)));
            input.value = String(value);
        }
        this.#describe(name);
    }

    /** Sets the choices of a select: [value, text], or [value, text, why it cannot be chosen]. */
    setOptions(name, options) {
        const { input, control } = this.#inputs[name];
        input.replaceChildren(...options.map(([value, text, refusal = '']) =>
            Object.assign(new Option(text, value), { disabled: Boolean(refusal), title: refusal })));
        control.options = options;
        this.set(name, this.values[name]);
    }

    show(name, visible) { this.#inputs[name].row.hidden = !visible; }
    showGroup(title, visible) { this.#group(title).hidden = !visible; }

    optionsOf(name) { return this.#inputs[name].control.all ??= this.#inputs[name].control.options; }
    get names() { return Object.keys(this.#inputs); }

    /** Sets those of the named controls that the page's address names. Throws an Error if a value is not valid. */
    read(parameters, names) {
        for (const name of names) {
            const text = parameters.get(name);
            if (text !== null) this.set(name, this.#value(this.#inputs[name].control, text));
        }
    }

    #value({ name, kind, options, whole, min = -Infinity, max = Infinity, unit = '' }, text) {
        const refuse = (allowed) => { throw new Error(`In the address, ${name} is ${text}; it must be ${allowed}.`); };
        if (kind === 'select' && !whole) {
            const choices = options.map(([value]) => value);
            if (!choices.includes(text)) refuse(choices.length > 1 ? `one of ${choices.join(', ')}` : choices[0]);
            return text;
        }
        const numbers = text.split(',').map((part) => (part.trim() === '' ? NaN : Number(part)));
        const needed = kind === 'vector' ? 3 : 1, what = kind === 'vector' ? 'x,y,z' : whole ? 'a whole number' :
            'a number';
        const isGood = (x) => Number.isFinite(x) && x >= min && x <= max && (!whole || Number.isInteger(x));
        const range = Number.isFinite(min) ? ` from ${min} to ${max}${unit && ` ${unit}`}` : '';
        if (numbers.length !== needed || !numbers.every(isGood)) refuse(what + range);
        return kind === 'vector' ? numbers : numbers[0];
    }
}
