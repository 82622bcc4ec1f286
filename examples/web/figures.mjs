// The list of figures in a corner of the picture.

/** Milliseconds as text. */
export const milliseconds = (x) => (Number.isFinite(x) ? `${x.toFixed(x < 10 ? 2 : 1)} ms` : '–');
/** A whole number as text, in groups of three digits. */
export const whole = (x) => (Number.isFinite(x) ? x.toLocaleString('en').replaceAll(',', ' ') : '–');

/**
 * Fills the list with a row for each of `labels`, [name, label].
 * @return a function that shows texts, an object with a text for each name
 */
export function figureList(list, labels) {
    const rows = Object.fromEntries(labels.map(([name, label]) => {
        const row = document.createElement('div'), term = document.createElement('dt');
        const text = document.createElement('dd');
        term.textContent = label;
        row.append(term, text);
        list.append(row);
        return [name, text];
    }));
    return (texts) => {
        for (const [name, text] of Object.entries(texts))
            if (rows[name].textContent !== text) rows[name].textContent = text;
    };
}
