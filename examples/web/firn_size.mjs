// The buffers and device limits that a program needs for a number of particles and a grid, and the numbers of the grid.

export const blockWidth = 4; // nodes per axis of a block
export const mostSets = 8; // of particles on one grid
export const wordsOfSet = 5; // of the buffer "status"
export const groupsPerAxis = 65535; // workgroups that every device can dispatch along one axis
const product = (numbers) => numbers.reduce((a, b) => a * b, 1);
const megabytes = (bytes) => `${(bytes / 2 ** 20).toFixed(1)} MiB`;

/** An error with a sentence for the user. `code` is the program's error number, if the program reported the error. */
export class FirnError extends Error {
    constructor(message, details = {}) {
        super(message);
        Object.assign(this, { name: 'FirnError', ...details });
    }
}

/** The numbers that a buffer holds for each particle, node, ... */
export const numbersEach = (buffer) =>
    buffer.components ? buffer.components.reduce((sum, { count }) => sum + count, 0) : buffer.count;

/** Whether a buffer is of one set of particles, even if several sets have one grid. */
export const isOfParticles = ({ per }) => per.startsWith('particle');
/** Whether a kernel uses buffers of particles: it runs for each set of those on one grid. */
export const hasOwnBuffers = ({ buffers }, { bindings }) => buffers.some((buffer) => isOfParticles(buffer) &&
    bindings.some(({ binding }) => binding === buffer.binding));

/**
 * The number of particles, nodes, blocks, ... for `capacity` particles and `nodes` nodes along each axis; if the program's
 * grid is sparse, for `blocks` blocks of nodes; and for `distances` numbers in grids of distances, if these are not those
 * of the manifest.
 */
export function extents(manifest, { capacity, nodes, blocks, distances = manifest.distances ?? 0 }) {
    if (!Number.isInteger(capacity) || capacity < 1)
        throw new FirnError(`The number of particles must be a positive integer, not ${capacity}.`);
    const good = (n) => Number.isInteger(n) && n > 0 && n % blockWidth === 0;
    if (nodes?.length !== manifest.dimension || !nodes.every(good))
        throw new FirnError(`nodes must be ${manifest.dimension} positive multiples of ${blockWidth}, not ${nodes}.`);
    const sparse = manifest.grid === 'sparse';
    if (sparse && !(Number.isInteger(blocks) && blocks > 0))
        throw new FirnError(`The number of blocks of a sparse grid must be a positive integer, not ${blocks}.`);
    const nodesEach = blockWidth ** manifest.dimension;
    const node = sparse ? blocks * nodesEach : product(nodes), block = node / nodesEach;
    const lines = nodes.map((along, a) => [`${'xyz'[a]}_line`, node / along]);
    const bins = capacity + block * (nodesEach + 2);
    return { particle: capacity, particle_and_bin: bins, node, block, axis_node: nodes.reduce((a, b) => a + b, 0),
        distance: distances, particle_set: 1, program: 1, ...Object.fromEntries(lines) };
}

/** The bytes of each binding, by its number. Buffers of the manifest that share a binding share memory. */
export function bindingSizes(manifest, size) {
    const count = extents(manifest, size), sizes = new Map();
    for (const buffer of manifest.buffers) {
        if (!(buffer.per in count))
            throw new FirnError(`Buffer ${buffer.name} is per ${buffer.per}, which this host does not know.`);
        const bytes = 4 * numbersEach(buffer) * count[buffer.per];
        sizes.set(buffer.binding, Math.max(sizes.get(buffer.binding) ?? 4, bytes));
    }
    return sizes;
}

/**
 * The device limits that a program of this size needs, named as in `requiredLimits` of requestDevice().
 * @param size {{capacity: number, nodes: number[], blocks?: number, distances?: number}} the most particles, and the nodes
 *        along each axis (multiples of 4); see extents()
 */
export function requiredLimits(manifest, size) {
    const largest = Math.max(...bindingSizes(manifest, size).values());
    const storage = (kernel) => kernel.bindings.filter(({ access }) => access !== 'uniform').length;
    const width = Math.max(manifest.workgroup_size, ...manifest.kernels.map((kernel) => kernel.workgroup_size ?? 1));
    return {
        maxBufferSize: largest, maxStorageBufferBindingSize: largest,
        maxStorageBuffersPerShaderStage: Math.max(...manifest.kernels.map(storage)),
        maxUniformBufferBindingSize: manifest.uniforms.bytes,
        maxComputeInvocationsPerWorkgroup: width, maxComputeWorkgroupSizeX: width,
    };
}

/** Throws if the limits of a device or an adapter are too small. The message says how many particles would fit. */
export function checkLimits(manifest, size, limits) {
    const count = extents(manifest, size);
    for (const buffer of manifest.buffers) {
        const each = 4 * numbersEach(buffer), bytes = each * count[buffer.per];
        for (const limit of ['maxStorageBufferBindingSize', 'maxBufferSize']) {
            if (!(bytes > limits[limit])) continue;
            const fit = Math.floor(Math.min(limits.maxStorageBufferBindingSize, limits.maxBufferSize) / each);
            const advice = buffer.per === 'particle' ? `${fit} particles fit`
                : buffer.per === 'distance' ? 'use coarser grids of distances' : 'use larger cells or a smaller domain';
            throw new FirnError(`Buffer ${buffer.name} needs ${megabytes(bytes)} for ${count[buffer.per]} ` +
                `${buffer.per}s, and ${limit} is ${megabytes(limits[limit])} here: ${advice}.`, { limit, fit });
        }
    }
    for (const [limit, need] of Object.entries(requiredLimits(manifest, size)))
        if (need > limits[limit])
            throw new FirnError(`${manifest.name} needs ${limit} ${need}, and it is ${limits[limit]} here.`, { limit });
}

/**
 * The grid of a domain, the same as in firn.
 * @param domain {{lower: number[], upper: number[], cell_size: number}} [m]
 * @returns the nodes along each axis, the extent in cells, and the coordinates of the nodes [m], axis after axis
 */
export function gridOf({ lower, upper, cell_size }) {
    if (!(cell_size > 0) || !lower.every((low, a) => upper[a] - low >= 2 * cell_size))
        throw new FirnError('The domain must be at least two cells wide along each axis, and cell_size positive.');
    const along = lower.map((low, a) => (upper[a] - low) / cell_size);
    // One block of ghost nodes below, and at least three ghost nodes above.
    const nodes = along.map((n) => blockWidth * (Math.ceil(Math.ceil(n - 1e-6) / blockWidth) + 2));
    const coordinates = lower.flatMap((low, a) => Array.from({ length: nodes[a] }, (_, i) =>
        // Rounded to 32 bits as on the CPU.
        Math.fround(low + cell_size * (Math.floor(i / blockWidth) - 1) * blockWidth) +
            Math.fround((i % blockWidth) * Math.fround(cell_size))));
    return { nodes, cells: along.map(roundDown), coordinates: Float32Array.from(coordinates) };
}

/** Rounds down to 32 bits, so that a particle beyond the wall does not count as inside. */
function roundDown(x) {
    const rounded = new Float32Array([x]);
    if (rounded[0] > x) new Uint32Array(rounded.buffer)[0] -= 1;
    return rounded[0];
}
