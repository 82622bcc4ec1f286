/// \file The WGSL texts of a program's helper functions and entry points. The entry points call functions that were
/// recorded from the definitions in C++ (recorded.hpp).
///
/// There is no physics in these texts. They contain placeholders ${NAME}, which text.hpp replaces.
///
/// Buffers with values of particles are structures of arrays: the c-th value (from 0) of particle i is at index
/// c * params.capacity + i. The position of a particle is stored as two vectors [cells]: `corner`, the lower corner of
/// a block of 4^D cells, and `place`, the position relative to this corner. So positions have the same resolution
/// everywhere in the domain. The grid is dense (all nodes are stored) or sparse (sparse_kernels.hpp), with one block of
/// ghost nodes below the domain.
/// If the node at the domain's lower corner has the lattice coordinates 0, the node with lattice coordinate k along an
/// axis has the index k + 4 along this axis.
#pragma once

#include <firn/core/requirements.hpp>

namespace firn::inline FIRN_BUILD::wgsl::text {

/// WGSL text of helper functions for several entry points. These functions access the bits of floats, report errors,
/// and compute indices of nodes.
inline constexpr const char* helpers = R"(
// Status words: 0 error, 1 first particle with it, 2 largest signal speed, 3 to 6 load, 7 and 8 scale, 9 and 10 the
// time step, 11 time, 12 to 18 filters of volumes, 19 largest acceleration, 20 share of shifting, 21 and 22 time left,
// 23 steps taken, 24 and 25 blocks, 26 whether a sink may have been met, 27 the set with the error, 28 load and
// 29 scale of momentum before forces act, 32 to 287 time steps. Five words of each set of particles follow: whether a
// particle has left its block, in this step, in the last one, and by shifting; the set's largest signal speed; and how
// many of its particles are in order. Numbers are f32 bits: of positive ones the order is the same.
var<private> no_constant: u32 = 0u; // infinities and NaN must not be constants

fn from_bits(bits: u32) -> f32 { return bitcast<f32>(bits + no_constant); }
fn is_finite(x: f32) -> bool { return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u; }
fn power_of_two(n: f32) -> f32 { return bitcast<f32>((i32(n) + 127) << 23u); }
fn exponent_of(x: f32) -> f32 { return f32((bitcast<i32>(x) >> 23u) - 127); }
fn significand_of(x: f32) -> f32 { return bitcast<f32>((bitcast<u32>(x) & 0x7fffffu) | 0x3f800000u); }
fn leading_half(x: f32) -> f32 { return bitcast<f32>(bitcast<u32>(x) & 0xfffff000u); }

/// Which invocation this is, counted over both dimensions of a dispatch.
fn invocation(group: vec3<u32>, groups: vec3<u32>, local: u32) -> u32 {
    return (group.y * groups.x + group.x) * ${GROUP}u + local;
}
fn status_number(word: u32) -> f32 { return bitcast<f32>(atomicLoad(&status[word])); }
fn failed() -> bool { return atomicLoad(&status[0]) != 0u; }
/// The k-th status word of this set of particles.
fn set_word(k: u32) -> u32 { return ${FIRST_SET_WORD}u + ${WORDS_OF_SET}u * params.set_number + k; }
/// After an error nothing is changed any more, nor in a step of no time, which begin_step chooses when no time is left.
fn stopped() -> bool { return failed() || (params.bound_time_step == 2u && atomicLoad(&status[9]) == 0u); }
fn fail(error: u32, particle: u32) {
    atomicMax(&status[0], error);
    atomicMin(&status[1], particle);
    atomicStore(&status[27], params.set_number); // other sets do nothing then
}
var<workgroup> largest: array<atomic<u32>, 3>;
/// Makes a status word at least as large as `bits`. Few calls of many change it, and only those write.
fn raise_status(word: u32, bits: u32) {
    if (bits > atomicLoad(&status[word])) { atomicMax(&status[word], bits); }
}
/// Index along each axis of the node at lattice coordinates k; never outside, whatever k is.
fn lattice_from(k: ${VEC}) -> ${IVEC} {
    return clamp(${LATTICE} + ${IVEC}(4), ${IVEC}(0), ${IVEC}(params.nodes) - ${IVEC}(${SUPPORT}));
}
/// How far the corner of a particle's block moves when its place is counted anew.
fn shift_of_sort(place: ${VEC}) -> ${VEC} { return 4.0f * floor(0.25f * base_node_of(place)); }
/// Whether a particle is too far from its block: more than a cell.
fn has_left_block(place: ${VEC}) -> bool {
    let node = base_node_of(place);
    return any(node < ${VEC}(-1.0f)) || any(node > ${VEC}(4.0f));
}
fn kernel_weights_of(f: ${VEC}) -> array<${WEIGHTS}, ${D}> { return array<${WEIGHTS}, ${D}>(${KERNEL_WEIGHTS}); }
)";

/// WGSL text of the function that moves lattice coordinates into the domain, for programs with periodic axes.
inline constexpr const char* periods = R"(
/// Lattice coordinates, moved into the domain by whole periods along the periodic axes.
fn into_domain(k: ${IVEC}) -> ${IVEC} {
    let period = max(${IVEC}(params.period), ${IVEC}(1));
    return select(k, (k % period + period) % period, params.period > ${UVEC}(0u));
}
)";

/// WGSL text of a function that returns the gradients of the weights. It is used if G2P needs these gradients.
inline constexpr const char* gradient_helpers = R"(
fn kernel_gradients_of(f: ${VEC}) -> array<${WEIGHTS}, ${D}> { return array<${WEIGHTS}, ${D}>(${KERNEL_GRADIENTS}); }
)";

/// WGSL text of the functions that choose the time step and read the chosen one, and of the entry point begin_step. It
/// is one invocation, which chooses the time step, resets those words of the buffer "status" that each step computes,
/// and counts the step. All other entry points of the step run after it, so they agree on whether a step is taken.
inline constexpr const char* time_step = R"(
struct TimeStep {
    time_step: f32,          // [s]
    place_per_velocity: f32, // dt / h [s/m]
}
var<private> chosen: TimeStep;

fn bound_time_step(bound: f32) {
    if (bound < chosen.time_step) { chosen = TimeStep(bound, place_per_velocity_of(bound)); }
}
/// The given time step, or the bound or the time left if that is asked for and shorter. The signal speed is that after
/// the last step, the acceleration that of the last step.
fn choose_time_step() {
    chosen = TimeStep(params.time_step, params.place_per_velocity);
    if (params.bound_time_step == 2u) { chosen.place_per_velocity = place_per_velocity_of(params.time_step); }
    let speed = max(status_number(2u), params.boundary_speed);
    let acceleration = status_number(19u);
    if (params.bound_time_step != 0u) {
        if (speed > 0.0f) { bound_time_step(stable_step(speed)); }
        if (acceleration > 0.0f && is_finite(acceleration)) { bound_time_step(accelerated_step(acceleration)); }
    }
    if (params.bound_time_step == 2u) {
        let left = TimeLeft(status_number(21u), status_number(22u));
        let within = step_within(left, chosen.time_step);
        bound_time_step(within.step);
        if (params.least_time_left > 0.0f && left.high - within.step <= params.least_time_left) {
            bound_time_step(0.0f);
        } else {
            atomicStore(&status[21], bitcast<u32>(within.left.high));
            atomicStore(&status[22], bitcast<u32>(within.left.low));
        }
    }
    atomicStore(&status[9], bitcast<u32>(chosen.time_step));
    atomicStore(&status[10], bitcast<u32>(chosen.place_per_velocity));
    ${KEEP_TIME}
}
fn read_time_step() {
    chosen = TimeStep(status_number(9u), status_number(10u));
}

@compute @workgroup_size(1)
fn begin_step() {
    if (atomicLoad(&status[26]) != 0u) { fail(${SINK_ERROR}u, 0xffffffffu); }
    if (failed()) { return; }
    choose_time_step();
    if (stopped()) { return; } // what the last step has measured is for the step that comes when there is time again
    let step = atomicAdd(&status[23], 1u);
    atomicStore(&status[32u + step % 256u], bitcast<u32>(chosen.time_step));${CHOOSE_SHARE}${BEGIN_REACTIONS}
    atomicStore(&status[1], 0xffffffffu); // no particle
    for (var k = 2u; k < 7u; k++) { atomicStore(&status[k], 0u); }${CLEAR_LOADS}
    atomicStore(&status[19], 0u);
    for (var at = ${FIRST_SET_WORD}u; at < ${END_OF_SETS}u; at += ${WORDS_OF_SET}u) {
        atomicStore(&status[at + 1u], atomicExchange(&status[at], 0u));
        atomicStore(&status[at + 2u], 0u);
        atomicStore(&status[at + 3u], 0u);
        atomicStore(&status[at + 4u], 0u);
    }
}
)";

/// WGSL text of a function that keeps the largest acceleration of the field, which limits the next time step.
inline constexpr const char* acceleration = R"(
fn see_acceleration(position: ${VEC}, velocity: ${VEC}) {
    raise_status(19u, bitcast<u32>(acceleration_of(position, velocity)));
}
)";

/// WGSL text of the entry point clear, which sets the sums and the particle counts of all nodes to zero.
inline constexpr const char* clear = R"(
@compute @workgroup_size(${GROUP})
fn clear(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    for (var k = 0u; k < 4u; k++) { atomicStore(&node_sums[4u * i + k], 0); }${CLEAR_BEFORE}${CLEAR_RATES}
    atomicStore(&counts[i], 0u);
}
)";

/// WGSL text of the entry point ${NAME}. If a particle has left the reach of its block, which the status word ${WORD}
/// tells, it counts the places of all particles from the blocks in which they are, as the CPU does when it sorts them.
inline constexpr const char* sort = R"(
@compute @workgroup_size(${GROUP})
fn ${NAME}(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.particles || stopped() || atomicLoad(&status[set_word(${WORD}u)]) == 0u) { return; }
    let place = load_place(i);
    let shift = shift_of_sort(place);
    store_place(i, place - shift);
    store_corner(i, ${NEW_CORNER});
}
)";

/// WGSL text of the entry point ${NAME}, which finds the largest q, g and m of all particles. If ${COUNT} is not empty,
/// it counts the particles by their base nodes, too. \see stage/fixed_point.hpp
inline constexpr const char* measure = R"(
@compute @workgroup_size(${GROUP})
fn ${NAME}(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !stopped()) {
        read_time_step();
        let place = load_place(i);
        let base = base_node_of(place);
        let record = record_of(load_particle(i), place - base);
        let load = load_of(record);
        atomicMax(&largest[0], bitcast<u32>(load.momentum));
        atomicMax(&largest[1], bitcast<u32>(load.gradient));
        atomicMax(&largest[2], bitcast<u32>(load.mass));${MEASURE_BEFORE}${COUNT}
    }
    workgroupBarrier();
    if (local < 3u) { raise_status(3u + local, atomicLoad(&largest[local])); }${KEEP_BEFORE}
}
)";

/// WGSL text of the entry points measure_counts, which finds the largest number of particles with one base node, and
/// choose_scale, which chooses the scale (quanta per unit) of the integer sums of P2G. \see stage/fixed_point.hpp
inline constexpr const char* choose_scale = R"(
@compute @workgroup_size(${GROUP})
fn measure_counts(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < node_count() && !stopped()) {
        atomicMax(&largest[0], bitcast<u32>(f32(atomicLoad(&counts[i]))));
    }
    workgroupBarrier();
    if (local == 0u) { raise_status(6u, atomicLoad(&largest[0])); }
}

/// The scales for a load, or the given ones, which are 0 if none is; or the error that none keeps the sums in range.
fn scale_for(load: FixedPointLoad, given: FixedPointScale) -> FixedPointScale {
    let bound = bound_of(load);
    var scale = scale_of(bound);
    if (!is_finite(bound.momentum) || !is_finite(bound.mass)) {
        fail(1u, 0xffffffffu);
    } else if (bound.contributions >= 1073741824.0f) {
        fail(2u, 0xffffffffu);
    } else if (given.momentum > scale.momentum || given.mass > scale.mass) {
        fail(3u, 0xffffffffu);
    }
    if (given.momentum > 0.0f) { scale.momentum = given.momentum; }
    if (given.mass > 0.0f) { scale.mass = given.mass; }
    return scale;
}

@compute @workgroup_size(1)
fn choose_scale() {
    if (stopped()) { return; }
    let load = FixedPointLoad(status_number(3u), status_number(4u), status_number(5u), status_number(6u));
    let scale = scale_for(load, FixedPointScale(params.momentum_scale, params.mass_scale));
    atomicStore(&status[7], bitcast<u32>(scale.momentum));
    atomicStore(&status[8], bitcast<u32>(scale.mass));${CHOOSE_BEFORE}
}

fn chosen_scale() -> FixedPointScale {
    return FixedPointScale(status_number(7u), status_number(8u));
}
/// To the nearest integer, ties to even. The bound keeps it in range; the clamp keeps i32() defined in any case.
fn nearest(x: vec4<f32>) -> vec4<i32> {
    return vec4<i32>(clamp(round(x), vec4<f32>(-2147483520.0f), vec4<f32>(2147483520.0f)));
}
)";

/// WGSL text of the function ${NAME}(i, scale${ORIGIN}), which adds the momentum and mass of particle i, as ${RECORD}
/// has them, to the sums at the nodes. ${TARGET} is the place of integer c of a node in an array. ${FIRST} is the first
/// node that the particle reaches, in this array; ${ORIGIN} is a parameter from which it is counted, if there is one.
inline constexpr const char* scatter = R"(
fn ${NAME}(i: u32, scale: FixedPointScale${ORIGIN}) {
    let place = load_place(i);
    let base = base_node_of(place);
    let fraction = place - base;
    let record = in_quanta(${RECORD}, scale);${RECORD_BEFORE}
    let first = ${FIRST};
    var w = kernel_weights_of(fraction);
    ${GRADIENTS}
    for (var k = 0; k < ${SUPPORT}; k++) {
        let line = close_last_axis(record, f32(k - ${CENTRE}), w[${LAST}][k]${LAST_GRADIENT});${LINE_BEFORE}
        ${LOOPS}
            let q = nearest(value_at(line, ${OFFSETS}, ${WEIGHT}${GRADIENT_WEIGHTS}));
            let node = ${NODE};
            for (var c = 0u; c < 4u; c++) {
                if (q[c] != 0) { atomicAdd(&${TARGET}, q[c]); }
            }${ADD_BEFORE}
        ${END}
    }
}
)";

/// WGSL text of the entry point p2g, which adds the particles directly to the sums in the grid.
inline constexpr const char* p2g = R"(
@compute @workgroup_size(${GROUP})
fn p2g(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.particles || stopped()) { return; }
    read_time_step();
    scatter(i, chosen_scale());
}
)";

/// WGSL text of the entry points of P2G through workgroup memory, but the last one: clear_bins, count_cells,
/// place_cells and order_particles. They sort the particles by the cell of their base node (the first node that a
/// particle touches), the cells of a block of 4^D nodes together. In p2g_blocks, which follows, each workgroup adds up
/// the particles of one block in an array in workgroup memory, the arena.
///
/// The buffer "bins" has the particles in this order, then for each block: a number for each of its cells, which is how
/// many particles it has and then where they end; and where the block's particles begin and end. The order of blocks
/// differs from run to run. No number depends on it, because sums are integers.
inline constexpr const char* p2g_sorted = R"(
fn bins_of(block: u32) -> u32 { return params.capacity + ${BIN_WORDS}u * block; }
fn cell_of(i: u32) -> u32 {
    let at = nodes_from(base_node_of(load_place(i)) + load_corner(i));
    let in_block = at & ${IVEC}(3);
    return bins_of(block_of(at)) + u32(${IN_BLOCK});
}

@compute @workgroup_size(${GROUP})
fn clear_bins(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    bin_words[bins_of(i / ${BLOCK_NODES}u) + i % ${BLOCK_NODES}u] = 0u;
}

@compute @workgroup_size(${GROUP})
fn count_cells(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !stopped()) { atomicAdd(&bins[cell_of(i)], 1u); }
}

var<workgroup> ends: array<u32, ${BLOCK_NODES}>;
var<workgroup> begin_of_block: u32;

/// Where the particles of each cell are to begin; and how many particles of all sets have a base node, at most.
@compute @workgroup_size(${BLOCK_NODES})
fn place_cells(${INVOCATION}) {
    let block = group.y * groups.x + group.x;
    let is_block = block < block_count() && !stopped();
    let cell = bins_of(block) + local;
    var own = 0u;
    if (is_block) { own = bin_words[cell]; }
    ends[local] = own;
    workgroupBarrier();
    for (var reach = 1u; reach < ${BLOCK_NODES}u; reach *= 2u) {
        var before = 0u;
        if (local >= reach) { before = ends[local - reach]; }
        workgroupBarrier();
        ends[local] += before;
        workgroupBarrier();
    }
    let count = ends[${BLOCK_NODES}u - 1u];
    if (local == 0u && count > 0u) {
        begin_of_block = atomicAdd(&status[set_word(4u)], count) - params.first_particle;
    }
    workgroupBarrier();
    if (is_block) {
        bin_words[cell] = begin_of_block + ends[local] - own;
        if (local < 2u) {
            bin_words[bins_of(block) + ${BLOCK_NODES}u + local] = begin_of_block + local * count;
        }
    }
    if (own > 0u) {
        let in_block = local;
        let node = node_index(enter_block(block) + ${IVEC}(${AT_IN_BLOCK}));
        let all = atomicAdd(&counts[node], own) + own;
        atomicMax(&largest[0], bitcast<u32>(f32(all)));
    }
    workgroupBarrier();
    if (local == 0u) { raise_status(6u, atomicLoad(&largest[0])); }
}

@compute @workgroup_size(${GROUP})
fn order_particles(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !stopped()) { atomicStore(&bins[atomicAdd(&bins[cell_of(i)], 1u)], i); }
}

var<workgroup> arena: array<atomic<i32>, ${ARENA_NUMBERS}>;
${SCATTER})";

/// WGSL text of the entry point ${NAME}, in which each workgroup adds up the particles of one block with the function
/// ${SCATTER}, then adds the sums to the grid. ${TARGET} is the place there of integer k % 4 of a node in the arena.
inline constexpr const char* p2g_blocks = R"(
@compute @workgroup_size(${GROUP})
fn ${NAME}(${INVOCATION}) {
    let block = group.y * groups.x + group.x;
    if (local < 2u && block < block_count() && !stopped()) {
        ends[local] = bin_words[bins_of(block) + ${BLOCK_NODES}u + local];
    }
    let begin = workgroupUniformLoad(&ends[0]);
    let end = workgroupUniformLoad(&ends[1]);
    if (begin == end) { return; }
    read_time_step();
    let scale = ${SCALE};
    let origin = enter_block(block);
    for (var s = begin + local; s < end; s += ${GROUP}u) { ${SCATTER}(bin_words[s], scale, origin); }
    workgroupBarrier();
    for (var k = local; k < ${ARENA_NUMBERS}u; k += ${GROUP}u) {
        let node = i32(k / 4u);
        let sum = atomicLoad(&arena[arena_number(u32(node), k % 4u)]);
        if (sum != 0) { atomicAdd(&${TARGET}, sum); }${ADD_BEFORE}
    }
}
)";

/// WGSL text of the entry point grid_update, which replaces the sums of momentum and mass at each node by the velocity
/// and mass of the node.
inline constexpr const char* grid_update = R"(
@compute @workgroup_size(${GROUP})
fn grid_update(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    let sums = nodes[i];
    if (sums.w < ${FEWEST}i) { // empty, or next to it
        nodes[i] = vec4<i32>(0);${EMPTY_BEFORE}${NO_MASS_BEFORE_WALLS}
        return;
    }
    read_time_step();
    let scale = chosen_scale();
    let momentum = ${MOMENTUM};
    let mass = f32(sums.w) * inverse(scale.mass);
    let at = node_at(i);
    let position = ${VEC}(${COORDINATES});
    ${NEW_VELOCITY}
    see_acceleration(position, momentum * inverse(mass));${REACT}
    nodes[i] = bitcast<vec4<i32>>(vec4<f32>(${V_AXES}, mass));${UPDATE_BEFORE}
}
)";

/// WGSL text of the lines of nodes of a dense grid, for mirrored walls.
inline constexpr const char* dense_lines = R"(
/// The nodes along one axis: node k of the line is nodes[first + stride * k].
struct Line {
    first: u32,
    stride: u32,
    count: i32,
}
/// The i-th line along an axis with `count` nodes, where `stride` is how far two of them are apart.
fn line_of_nodes(i: u32, stride: u32, count: u32) -> Line {
    return Line(i / stride * stride * count + i % stride, stride, i32(count));
}
/// Index of node k of a line, or no_node.
fn node_of_line(line: Line, k: i32) -> u32 {
    if (k < 0 || k >= line.count) { return no_node; }
    return line.first + line.stride * u32(k);
}
)";

/// WGSL text of helper functions for mirrored walls. A column consists of three nodes of a line of nodes along an axis.
inline constexpr const char* mirror_helpers = R"(
const no_node: u32 = 0xffffffffu;
fn load_node(line: Line, k: i32) -> vec4<f32> {
    let i = node_of_line(line, k);
    if (i == no_node) { return vec4<f32>(0.0f); }
    return bitcast<vec4<f32>>(nodes[i]);
}
fn store_node(line: Line, k: i32, v: ${VEC}, mass: f32) {
    let i = node_of_line(line, k);
    if (i != no_node) { nodes[i] = bitcast<vec4<i32>>(vec4<f32>(${V_AXES}, mass)); }
}
/// The nodes behind node `on`, at it and in front of it.
fn load_column(line: Line, on: i32, inward: i32) -> NodeColumn {
    let b = load_node(line, on - inward);
    let o = load_node(line, on);
    let f = load_node(line, on + inward);
    return NodeColumn(b.${AXES}, o.${AXES}, f.${AXES}, b.w, o.w, f.w);
}
fn store_column(line: Line, on: i32, inward: i32, column: NodeColumn) {
    store_node(line, on - inward, column.behind, column.mass_behind);
    store_node(line, on, column.on, column.mass_on);
    store_node(line, on + inward, column.front, column.mass_front);
}
fn has_matter(column: NodeColumn) -> bool {
    return column.mass_behind > 0.0f || column.mass_on > 0.0f || column.mass_front > 0.0f;
}

const no_plane: i32 = -1000000;
/// The index along its axis of the nodes on a wall; no_plane if the wall lies between nodes. `lower` is the position of
/// the domain's lower end, where the node with the index 4 is.
fn node_of_wall(position: f32, lower: f32) -> i32 {
    let cells = (position - lower) / params.cell_size;
    let node = clamp(round(cells), -900000.0f, 900000.0f);
    let rounding = 1e-6f + 1e-6f * (abs(position) + abs(lower)) / params.cell_size;
    return select(no_plane, i32(node) + 4, abs(cells - node) <= rounding);
}
)";

/// WGSL text of the entry point ${NAME}, in which all mirrored walls of one part of the boundary across one axis act on
/// the nodes beside them. If ${IDLE} is true, it does nothing. In a dense grid, an invocation does one line of nodes
/// across these walls.
inline constexpr const char* mirror = R"(
@compute @workgroup_size(${GROUP})
fn ${NAME}(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= ${LINES} || ${IDLE}) { return; }
    ${LINE}
    let lower = coordinates[${FIRST_COORDINATE}];
    ${WALLS}
}
)";

/// WGSL text of two entry points: g2p, which updates and moves the particles, and initialise, which computes the stress
/// of the particles before the first step.
inline constexpr const char* g2p = R"(
fn see_speed(speed: u32) {
    raise_status(2u, speed);
    raise_status(set_word(3u), speed);
}
fn velocity_at(node: u32) -> ${VEC} { return bitcast<vec4<f32>>(nodes[node]).${AXES}; }

fn gather(first: ${IVEC}, f: ${VEC}) -> Sums${D} {
    var w = kernel_weights_of(f);
    ${GRADIENTS}
    ${GATHER}
}

var<workgroup> fastest: atomic<u32>;

@compute @workgroup_size(${GROUP})
fn g2p(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !stopped()) {
        read_time_step();
        let place = load_place(i);
        let corner = load_corner(i);
        let base = base_node_of(place);
        let fraction = place - base;
        ${TAKE}
        ${UPDATE}
        let moved = moved_by(${MOTION}, place, corner);
        let speed = signal_speed(${VELOCITY}, load_mass(i), load_volume(i), state${HERE});
        if (is_finite(${STRESS_SUM} + speed) && moved.outside <= 1.0f) {
            store_state(i, state);
            store_kirchhoff_stress(i, stress);
            store_velocity(i, ${VELOCITY});
            ${STORE_AFFINE}
            store_place(i, moved.position);${SEE_SINKS}
            if (has_left_block(moved.position)) { atomicStore(&status[set_word(0u)], 1u); }
            atomicMax(&fastest, bitcast<u32>(speed));
        } else {
            fail(select(4u, 5u, is_finite(${STRESS_SUM} + speed)), params.first_particle + i);
        }
    }
    workgroupBarrier();
    if (local == 0u) { see_speed(atomicLoad(&fastest)); }
}

/// Once, after particles were written: the stress of their state.
@compute @workgroup_size(${GROUP})
fn initialise(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles) {
        let state = load_state(i);
        let base = base_node_of(load_place(i));
        let at = ${UVEC}(lattice_from(base + load_corner(i)));
        see_acceleration(${VEC}(${COORDINATES}) + params.cell_size * (load_place(i) - base), load_velocity(i));
        ${ASK_AT_FIRST}store_kirchhoff_stress(i, kirchhoff_stress(state${AT_FIRST_RATE}${HERE}));
        atomicMax(&fastest, bitcast<u32>(signal_speed(load_velocity(i), load_mass(i), load_volume(i), state${HERE})));
    }
    workgroupBarrier();
    if (local == 0u) { see_speed(atomicLoad(&fastest)); }
}
)";

}  // namespace firn::inline FIRN_BUILD::wgsl::text
