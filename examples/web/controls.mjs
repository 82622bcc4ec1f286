// The form beside the picture, built from a table of controls. The page's address can set controls by their names:
// ?particles=10000&cells=32&young=20000&paused=1.

/** Writes x with three digits and a prefix of the unit: 38.5 kPa. */
export function withUnit(x, unit) {
    if (!Number.isFinite(x)) return '–';
    if (x === 0) return `0 ${unit}`;
    const prefixes = ['n', 'µ', 'm', '', 'k', 'M', 'G', 'T'];
    const power = Math.min(Math.max(Math.floor(Math.log10(Math.abs(x) * 1.0005) / 3), -3), 4);
    const number = x / 1000 ** power, digits = Math.abs(number) >= 99.95 ? 0 : Math.abs(number) >= 9.995 ? 1 : 2;
    return `${number.toFixed(digits)} ${prefixes[power + 3]}${unit}`.trim();
}

// kind: 'select' (options), 'log' (a slider over powers of ten), 'range', 'number' or 'vector'.
// scene: whether a change restarts the simulation.
export const table = [
    { group: 'Scene', controls: [
        { name: 'program', label: 'Program', kind: 'select', wide: true, options: [], value: '', scene: true },
        { name: 'bodies', label: 'Bodies', kind: 'select', options: [], value: 'cubes', scene: true },
        { name: 'particles', label: 'Particles, about', kind: 'select', whole: true, value: '50000', scene: true,
            options: [['10000', '10 000'], ['50000', '50 000'], ['200000', '200 000']] },
        { name: 'cells', label: 'Cells', kind: 'select', whole: true, value: '64', scene: true,
            options: [['32', '32³'], ['64', '64³']] },
    ] },
    { group: 'Time', controls: [
        { name: 'time_step', label: 'Time step', kind: 'log', min: 1e-5, max: 2e-3, value: 2.5e-4, unit: 's' },
        { name: 'steps', label: 'Steps a frame', kind: 'range', min: 1, max: 60, step: 1, value: 14 },
        { name: 'schedule', label: 'P2G', kind: 'select', value: 'step',
            options: [['step', 'direct'], ['step_sorted', 'sorted by block']] },
    ] },
    { group: 'Material', controls: [
        { name: 'young', label: 'Young’s modulus', kind: 'log', min: 1e3, max: 1e6, value: 4e4, unit: 'Pa' },
        { name: 'poisson', label: 'Poisson’s ratio', kind: 'range', min: 0, max: 0.45, step: 0.01, value: 0.3 },
    ] },
    { group: 'Gravity', controls: [
        { name: 'gravity', label: 'm/s²', kind: 'vector', step: 0.1, value: [0, -9.81, 0] },
    ] },
    { group: 'Pointer', controls: [
        { name: 'pointer', label: 'Left button, or a finger', kind: 'select', value: 'orbit',
            options: [['orbit', 'turns the view'], ['attract', 'attracts'], ['repel', 'repels']] },
        { name: 'radius', label: 'Radius', kind: 'range', min: 0.05, max: 0.5, step: 0.01, value: 0.2, unit: 'm' },
        { name: 'strength', label: 'Strength', kind: 'range', min: 10, max: 300, step: 5, value: 100, unit: 'm/s²' },
    ] },
    { group: 'Picture', controls: [
        { name: 'colour', label: 'Colour shows', kind: 'select', value: 'body',
            options: [['body', 'the body'], ['speed', 'the speed']] },
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

    /** @param changed (name, control) => void: called when the user has changed a value */
    constructor(form, changed) {
        this.form = form;
        this.changed = changed;
        form.addEventListener('submit', (event) => event.preventDefault());
        for (const { group, controls } of table) this.addGroup(group, controls);
    }

    addGroup(title, controls) {
        const group = element('fieldset', { dataset: { group: title } }, [element('legend', { textContent: title })]);
        for (const control of controls) group.append(this.#row(control));
        this.form.append(group);
        return group;
    }

    removeGroup(title) {
        const group = this.form.querySelector(`fieldset[data-group="${title}"]`);
        for (const { name } of group?.querySelectorAll('[name]') ?? []) {
            delete this.values[name];
            delete this.#inputs[name];
        }
        group?.remove();
    }

    #row(control) {
        const { name, label, kind, unit = '' } = control, id = `control_${name}`;
        const input = { select: () => this.#select(control, id), vector: () => this.#vector(control, id) }[kind]?.() ??
            this.#number(control, id);
        const isSlider = kind === 'log' || kind === 'range';
        const text = element('label', { htmlFor: kind === 'vector' ? `${id}_0` : id, textContent: label });
        if (kind === 'number' && unit && unit !== '1') text.textContent += ` [${unit}]`;
        const isWide = kind === 'select' && control.wide;
        const row = element('div', { className: isWide ? 'control wide' : 'control' }, [text]);
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
            // A slider is not more precise than two digits.
            this.#user(name, kind === 'log' ? Number((min * (max / min) ** x).toPrecision(2)) : x);
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

    setOptions(name, options) {
        const { input } = this.#inputs[name];
        input.replaceChildren(...options.map(([value, text]) => new Option(text, value)));
        this.set(name, this.values[name]);
    }

    show(name, visible) { this.#inputs[name].row.hidden = !visible; }
    showGroup(title, visible) { this.form.querySelector(`fieldset[data-group="${title}"]`).hidden = !visible; }

    /** Sets the controls that the page's address names. Throws an Error if a value is not valid. */
    read(parameters) {
        for (const [name, { control }] of Object.entries(this.#inputs)) {
            const text = parameters.get(name);
            if (text === null) continue;
            const choices = control.options?.map(([value]) => value) ?? [];
            const isFree = control.kind === 'select' && (control.whole || !choices.length);
            if (control.kind === 'select' && !isFree && !choices.includes(text))
                throw new Error(`In the address, ${name} is ${text}; it can be ${choices.join(', ')}.`);
            const numbers = text.split(',').map(Number), needed = control.kind === 'vector' ? 3 : 1;
            const isNumber = control.kind !== 'select' || control.whole;
            if (isNumber && (numbers.length !== needed || !numbers.every(Number.isFinite) || text.trim() === ''))
                throw new Error(`In the address, ${name} is ${text}; not ${needed === 3 ? 'x,y,z' : 'a number'}.`);
            this.set(name, !isNumber ? text : needed === 3 ? numbers : numbers[0]);
        }
    }
}
