/// \file The WGSL texts of transfers that blend velocities, such as FLIP. As those in kernels.hpp, they contain
/// placeholders ${NAME} and no physics. \see blends_velocities
///
/// P2G adds up the momenta twice, with the impulses of stress and without them. The buffer "nodes" has four numbers for
/// each node with forces, and then, from the place before_forces(0) on, four for each node before forces act. The mass
/// of a node is the same in both: it is added up once, with forces. Status words 28 and 29: the largest momentum of a
/// particle before forces act, and the scale of these sums.
#pragma once

#include <firn/core/requirements.hpp>

namespace firn::inline FIRN_BUILD::wgsl::text {

/// WGSL text of the functions for what nodes have before forces act: where it is, the scale of its sums, and the
/// velocities that follow from them.
inline constexpr const char* before_forces = R"(
/// Where the buffer has what node `node` has before forces act.
fn before_forces(node: u32) -> u32 { return node + ${ALL_NODES}; }

var<workgroup> largest_before_forces: atomic<u32>;
fn measure_before_forces(i: u32, fraction: ${VEC}) {
    let load = load_of(record_before_forces(load_particle(i), fraction));
    atomicMax(&largest_before_forces, bitcast<u32>(load.momentum));
}
/// Chooses the scale after that of the sums with forces. The masses, and so their scale, are the same.
fn choose_scale_before_forces() {
    if (failed()) { return; }
    let load = FixedPointLoad(status_number(28u), 0.0f, status_number(5u), status_number(6u));
    atomicStore(&status[29], bitcast<u32>(scale_for(load, FixedPointScale(params.momentum_scale, 0.0f)).momentum));
}
fn scale_before_forces() -> FixedPointScale { return FixedPointScale(status_number(29u), status_number(8u)); }
fn update_before_forces(i: u32, mass: f32) {
    let at = before_forces(i);
    let momentum = ${VEC}(nodes[at].${AXES}) * inverse(scale_before_forces().momentum);
    let v = velocity_before_forces(momentum, mass);
    nodes[at] = bitcast<vec4<i32>>(vec4<f32>(${V_AXES}, mass));
}

fn gather_before_forces(first: ${IVEC}, f: ${VEC}) -> ${VEC} {
    var w = kernel_weights_of(f);
    ${GATHER}
}
)";

/// WGSL statements of the function that adds a particle to the nodes, for its momentum before forces act: its record,
/// the record along a line of nodes, and what a node receives.
/// @{
inline constexpr const char* record_before_forces = R"(
    let record_before = in_quanta(record_before_forces(load_particle(i), fraction), scale_before_forces());)";
inline constexpr const char* line_before_forces = R"(
        let line_before = close_last_axis(record_before, f32(k - ${CENTRE}), w[${LAST}][k]${LAST_GRADIENT});)";
inline constexpr const char* add_before_forces = R"(
            let q_before = nearest(value_at(line_before, ${OFFSETS}, ${WEIGHT}${GRADIENT_WEIGHTS}));
            for (var c = 0u; c < ${D}u; c++) {
                if (q_before[c] != 0) { atomicAdd(&${TARGET_BEFORE}, q_before[c]); }
            })";
/// @}

/// WGSL statements that add the k-th number of the arena for momenta before forces act to the sums in the grid.
inline constexpr const char* arena_before_forces = R"(
        let sum_before = atomicLoad(&arena_before[arena_number(u32(node), k % 4u)]);
        if (sum_before != 0) {
            atomicAdd(&node_sums[4u * before_forces(node_index(origin + ${ARENA_NODE})) + k % 4u], sum_before);
        })";

}  // namespace firn::inline FIRN_BUILD::wgsl::text
