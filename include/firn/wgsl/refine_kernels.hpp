/// \file The WGSL texts of transfers that refine velocities by a series, such as FMPM. As those in kernels.hpp, they
/// contain placeholders ${NAME} and no physics. \see refines_velocities
///
/// The names are those of FMPM. The buffer "nodes" has four numbers for each node: after P2G the sums of momentum
/// [quanta] and mass [quanta], after the series its momentum [kg m/s] in place of the first. Then come four numbers for
/// each node from the place back_at(0) on: the momenta that go back to the nodes, or A v_j; from last_at(0) on: v_j;
/// and with mirrored walls from first_at(0) on: v_1. Walls act on what is at back_at(0): on v_1, and on A v_j. The mass
/// of a node is the same in all terms: P2G adds it up once. Status words 28 and 29: the largest momentum of a particle
/// in a term, and the scale of the sums of the term.
#pragma once

#include <firn/core/requirements.hpp>

namespace firn::inline FIRN_BUILD::wgsl::text {

/// WGSL text of the functions for what nodes have of a series, and of the entry points that take velocities from the
/// nodes to the particles and back: measure_term, choose_term_scale and scatter_term.
inline constexpr const char* series = R"(
/// Where the buffer has what node `node` has of the series.
fn back_at(node: u32) -> u32 { return node + ${ALL_NODES}; }
fn last_at(node: u32) -> u32 { return back_at(node) + ${ALL_NODES}; }
fn first_at(node: u32) -> u32 { return last_at(node) + ${ALL_NODES}; }

/// The mass of a node; 0 if it is empty, or next to it.
fn mass_of_node(i: u32) -> f32 {
    let quanta = nodes[i].w;
    return select(f32(quanta) * inverse(status_number(8u)), 0.0f, quanta < ${FEWEST}i);
}
/// The velocity that follows from a momentum in the buffer, where `scale` quanta make a unit.
fn velocity_from(at: u32, scale: f32, mass: f32) -> ${VEC} {
    return velocity_before_forces(${VEC}(nodes[at].${AXES}) * inverse(scale), mass);
}
fn first_before_walls(i: u32) -> ${VEC} { return velocity_from(i, status_number(7u), mass_of_node(i)); }
fn store_velocity_at(at: u32, v: ${VEC}, mass: f32) {
    nodes[at] = bitcast<vec4<i32>>(vec4<f32>(${V_AXES}, mass));
}
fn store_momentum_of_series(i: u32, v: ${VEC}) {
    nodes[i] = vec4<i32>(bitcast<vec4<i32>>(vec4<f32>(${V_AXES}, 0.0f)).xyz, nodes[i].w);
}

fn gather_last(first: ${IVEC}, f: ${VEC}) -> ${VEC} {
    var w = kernel_weights_of(f);
    ${GATHER}
}
fn record_in_term(i: u32, fraction: ${VEC}) -> P2GRecord {
    let particle = P2GParticle(load_mass(i), load_volume(i), load_term_velocity(i), ${AFFINE}, ${NO_STRESS});
    return record_before_forces(particle, fraction);
}

var<workgroup> largest_in_term: atomic<u32>;

@compute @workgroup_size(${GROUP})
fn measure_term(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i < params.particles && !stopped()) {
        let place = load_place(i);
        let base = base_node_of(place);
        let fraction = place - base;
        store_term_velocity(i, gather_last(nodes_from(base + load_corner(i)), fraction));
        atomicMax(&largest_in_term, bitcast<u32>(load_of(record_in_term(i, fraction)).momentum));
    }
    workgroupBarrier();
    if (local == 0u) { raise_status(28u, atomicLoad(&largest_in_term)); }
}

/// Chooses the scale of a term after that of P2G. The masses, and so their scale, are the same.
@compute @workgroup_size(1)
fn choose_term_scale() {
    if (stopped()) { return; }
    let load = FixedPointLoad(status_number(28u), 0.0f, status_number(5u), status_number(6u));
    atomicStore(&status[29], bitcast<u32>(scale_for(load, FixedPointScale(params.momentum_scale, 0.0f)).momentum));
    atomicStore(&status[28], 0u);
}
/// With it, records have no mass.
fn term_scale() -> FixedPointScale { return FixedPointScale(status_number(29u), 0.0f); }
${SCATTER}
@compute @workgroup_size(${GROUP})
fn scatter_term(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.particles || stopped()) { return; }
    scatter_in_term(i, term_scale());
}
)";

/// WGSL text of begin_series, the first entry point for nodes of a series, and of functions that return v_1 and A v_j
/// of a node: without mirrored walls.
inline constexpr const char* begin_series = R"(
@compute @workgroup_size(${GROUP})
fn begin_series(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    store_velocity_at(last_at(i), first_before_walls(i), 0.0f);
    nodes[back_at(i)] = vec4<i32>(0);
}
fn first_term(i: u32) -> ${VEC} { return first_before_walls(i); }
fn term_back(i: u32) -> ${VEC} { return velocity_from(back_at(i), status_number(29u), mass_of_node(i)); }
)";

/// As begin_series with mirrored walls, which act between some entry points: after begin_series, before keep_first; and
/// in each term after convert_term, before next_term or last_term.
inline constexpr const char* begin_mirrored_series = R"(
@compute @workgroup_size(${GROUP})
fn begin_series(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    store_velocity_at(back_at(i), first_before_walls(i), mass_of_node(i));
}

@compute @workgroup_size(${GROUP})
fn keep_first(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    let first = nodes[back_at(i)];
    nodes[first_at(i)] = first;
    nodes[last_at(i)] = first;
    nodes[back_at(i)] = vec4<i32>(0);
}

@compute @workgroup_size(${GROUP})
fn convert_term(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    let mass = mass_of_node(i);
    store_velocity_at(back_at(i), velocity_from(back_at(i), status_number(29u), mass), mass);
}
fn first_term(i: u32) -> ${VEC} { return velocity_at(first_at(i)); }
fn term_back(i: u32) -> ${VEC} { return velocity_at(back_at(i)); }
)";

/// WGSL text of the entry points next_term, which adds the next term of a series at the nodes; and last_term, which
/// adds the last one and leaves the momentum in place of that of P2G.
inline constexpr const char* next_terms = R"(
@compute @workgroup_size(${GROUP})
fn next_term(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    let next = next_of_series(first_term(i), velocity_at(last_at(i)), term_back(i));
    store_velocity_at(last_at(i), next, 0.0f);
    nodes[back_at(i)] = vec4<i32>(0);
}

@compute @workgroup_size(${GROUP})
fn last_term(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= node_count() || stopped()) { return; }
    store_momentum_of_series(i, momentum_of_series(first_term(i), velocity_at(last_at(i)), term_back(i),
                                                   ${BEFORE_WALLS}mass_of_node(i)));
}
)";

}  // namespace firn::inline FIRN_BUILD::wgsl::text
