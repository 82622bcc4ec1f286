/// \file The WGSL texts of the entry points of volumetric policies. As those in kernels.hpp, they contain placeholders
/// ${NAME} and no physics.
///
/// The buffer "rate_sums" has four integers for each node: the sum of V0 a over the particles, with their initial
/// volumes V0 and numbers a; two words for a filter; the sum of V0.
#pragma once

#include <firn/core/requirements.hpp>

namespace firn::inline FIRN_BUILD::wgsl::text {

/// WGSL text of the average of numbers of particles at the nodes: the entry points choose_rate_scale and scatter_rates,
/// and functions for the sums of a node. Status words 12 to 15: the largest |V0 a| and V0, and the two scales of the
/// sums. \see stage/volume.hpp
inline constexpr const char* volume_average = R"(
var<workgroup> largest_rates: array<atomic<u32>, 2>;

fn measure_record(record: P2GRecord) {
    let load = load_of(record);
    atomicMax(&largest_rates[0], bitcast<u32>(load.momentum));
    atomicMax(&largest_rates[1], bitcast<u32>(load.mass));
}

@compute @workgroup_size(1)
fn choose_rate_scale() {
    if (${IDLE}) { return; }
    let load = FixedPointLoad(status_number(12u), 0.0f, status_number(13u), status_number(${COUNT_WORD}u));
    let scale = scale_for(load, FixedPointScale(0.0f, 0.0f));
    atomicStore(&status[14], bitcast<u32>(scale.momentum));
    atomicStore(&status[15], bitcast<u32>(scale.mass));
    for (var k = 12u; k < 14u; k++) { atomicStore(&status[k], 0u); }
}
fn rate_scale() -> FixedPointScale {
    return FixedPointScale(status_number(14u), status_number(15u));
}
${SCATTER}
@compute @workgroup_size(${GROUP})
fn scatter_rates(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.particles || ${IDLE}) { return; }
    scatter_rate(i, rate_scale());
}

/// The sums of node i: of V0 a, and of V0.
fn sums_in_quanta(i: u32) -> vec2<f32> {
    let volume = atomicLoad(&rate_sums[4u * i + 3u]);
    if (volume < ${FEWEST}i) { return vec2<f32>(0.0f); }
    let scale = rate_scale();
    return vec2<f32>(f32(atomicLoad(&rate_sums[4u * i])) * inverse(scale.momentum), f32(volume) * inverse(scale.mass));
}
fn load_sums(i: u32) -> vec2<f32> {
    return vec2<f32>(bitcast<f32>(atomicLoad(&rate_sums[4u * i])), bitcast<f32>(atomicLoad(&rate_sums[4u * i + 3u])));
}
fn store_sums(i: u32, sums: vec2<f32>) {
    atomicStore(&rate_sums[4u * i], bitcast<i32>(sums.x));
    atomicStore(&rate_sums[4u * i + 3u], bitcast<i32>(sums.y));
}

fn gather_average(first: ${IVEC}, f: ${VEC}) -> f32 {
    var w = kernel_weights_of(f);
    ${GATHER}
}
)";

/// WGSL text of the entry point convert_rates. If there are mirrored walls, it replaces the integer sums by numbers.
inline constexpr const char* convert_rates = R"(
@compute @workgroup_size(${GROUP})
fn convert_rates(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || ${IDLE}) { return; }
    store_sums(i, sums_in_quanta(i));
}
/// The sums of the node behind node `on` and of the node in front of it: both get the sum of the two.
fn fold_rates(line: Line, on: i32, inward: i32) {
    let b = node_of_line(line, on - inward);
    let f = node_of_line(line, on + inward);
    if (b == no_node || f == no_node) { return; }
    let sums = load_sums(f) + load_sums(b);
    store_sums(b, sums);
    store_sums(f, sums);
}
)";

/// WGSL text of the entry point clear_rates, which runs before the sums of each of several sets of particles.
inline constexpr const char* clear_rates = R"(
@compute @workgroup_size(${GROUP})
fn clear_rates(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || ${IDLE}) { return; }
    for (var k = 0u; k < 4u; k++) { atomicStore(&rate_sums[4u * i + k], 0); }
    if (i == 0u) { atomicStore(&status[18], 0u); }
}
)";

/// WGSL text of the entry point measure_rate_counts, which finds the largest number of particles with one base node, of
/// those that take part in the sums.
inline constexpr const char* rate_counts = R"(
@compute @workgroup_size(${GROUP})
fn measure_rate_counts(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < node_count() && !${IDLE}) {
        atomicMax(&largest_rates[0], bitcast<u32>(f32(atomicLoad(&rate_sums[4u * i + 1u]))));
    }
    workgroupBarrier();
    if (local == 0u) { atomicMax(&status[18], atomicLoad(&largest_rates[0])); }
}
)";

/// WGSL text of the entry points for the average of the rates of volume change: measure_rates, and average_rates, which
/// puts the average of each node in place of its mass. \see FBar
inline constexpr const char* rates = R"(
@compute @workgroup_size(${GROUP})
fn measure_rates(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !stopped()) {
        let place = load_place(i);
        let base = base_node_of(place);
        let fraction = place - base;
        let first = nodes_from(base + load_corner(i));
        let rate = rate_of(take_from_grid(gather(first, fraction), fraction));
        rates[i] = rate;
        measure_record(volume_record(rate, load_volume(i)));${COUNT_RATE}
    }
    workgroupBarrier();
    if (local < 2u) { atomicMax(&status[12u + local], atomicLoad(&largest_rates[local])); }
}

@compute @workgroup_size(${GROUP})
fn average_rates(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    let sums = ${SUMS}(i);
    nodes[i] = vec4<i32>(nodes[i].xyz, bitcast<i32>(average_rate(sums.x, sums.y)));
}
)";

/// WGSL text of the entry points of a filter of the volume ratios J. The particles that take part have the volume
/// filtered_volume(); rates[i] is J − 1, then its average, and rates[capacity + i] is this volume. Word 1 of a node in
/// rate_sums counts particles by base node, word 2 is the average. Status words 16 to 18: the share b, the number of
/// steps that have begun since the host set it to 0, and the largest number of particles with the same base node; 20:
/// the share of particle shifting. \see VolumeFilter
inline constexpr const char* filter = R"(
fn filter_rests() -> bool {
    return stopped() || atomicLoad(&status[17]) % ${EVERY}u != 0u${NO_SHARE};
}

@compute @workgroup_size(${GROUP})
fn measure_volumes(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !filter_rests()) {
        let base = base_node_of(load_place(i));
        let state = load_state(i);
        let change = volume_change_of(state);
        ${ASK_VOLUME}let volume = filtered_volume_of(state, load_volume(i)${HERE});
        rates[i] = change;
        rates[params.capacity + i] = volume;
        measure_record(volume_record(change, volume));
        atomicAdd(&rate_sums[4u * node_index(nodes_from(base + load_corner(i))) + 1u], 1);
    }
    workgroupBarrier();
    if (local < 2u) { atomicMax(&status[12u + local], atomicLoad(&largest_rates[local])); }
}

@compute @workgroup_size(${GROUP})
fn average_volumes(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || filter_rests()) { return; }
    let sums = ${SUMS}(i);
    atomicStore(&rate_sums[4u * i + 2u], bitcast<i32>(average_rate(sums.x, sums.y)));
    store_sums(i, vec2<f32>(0.0f));
}

fn average_around(i: u32) -> f32 {
    let place = load_place(i);
    let base = base_node_of(place);
    return gather_average(nodes_from(base + load_corner(i)), place - base);
}

@compute @workgroup_size(${GROUP})
fn measure_averages(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !filter_rests()) {
        let average = average_around(i);
        rates[i] = average;
        measure_record(volume_record(average, rates[params.capacity + i]));
    }
    workgroupBarrier();
    if (local < 2u) { atomicMax(&status[12u + local], atomicLoad(&largest_rates[local])); }
}

@compute @workgroup_size(${GROUP})
fn filter_volumes(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.particles || filter_rests()) { return; }
    ${ASK_FILTERED}let after = filtered(load_state(i), load_kirchhoff_stress(i), rates[i], average_around(i),
                         rates[params.capacity + i], status_number(16u)${HERE});
    store_state(i, after.state);
    store_kirchhoff_stress(i, after.stress);
}
)";

/// WGSL text of the entry points of particle shifting, which follow those of a filter of volume ratios. The rates from
/// `capacity` on are the particles' present volumes. Word 1 of a node in rate_sums is the volume beyond the node's
/// room, word 2 the room. Status word 19: the share s. \see stage/shifting.hpp
inline constexpr const char* shift = R"(
@compute @workgroup_size(${GROUP})
fn measure_present(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !${IDLE}) {
        let volume = present_volume_of(load_state(i), load_volume(i));
        rates[i] = 0.0f;
        rates[params.capacity + i] = volume;
        measure_record(volume_record(0.0f, volume));
    }
    workgroupBarrier();
    if (local < 2u) { atomicMax(&status[12u + local], atomicLoad(&largest_rates[local])); }
}

@compute @workgroup_size(${GROUP})
fn find_excess(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || ${IDLE}) { return; }
    let at = node_at(i);
    let node = ${VEC}(${IVEC}(at) - ${IVEC}(4));
    let room = room_beside(${ROOM}, node);
    atomicStore(&rate_sums[4u * i + 1u], bitcast<i32>(excess_of(sums_in_quanta(i).y, room)));
    atomicStore(&rate_sums[4u * i + 2u], bitcast<i32>(room));
}

fn quad_at(node: u32) -> vec4<f32> { return ${QUAD}; }
fn gather_quads(first: ${IVEC}, f: ${VEC}) -> QuadSums${D} {
    var w = kernel_weights_of(f);
    var g = kernel_gradients_of(f);
    ${GATHER}
}

@compute @workgroup_size(${GROUP})
fn shift_particles(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.particles || ${IDLE}) { return; }
    let place = load_place(i);
    let corner = load_corner(i);
    let base = base_node_of(place);
    let sums = gather_quads(nodes_from(base + corner), place - base);
    let moved = shifted_by(sums, place, corner, status_number(20u));
    store_place(i, moved);
    if (has_left_block(moved)) { atomicStore(&status[set_word(2u)], 1u); }
}
)";

}  // namespace firn::inline FIRN_BUILD::wgsl::text
