/// \file The WGSL texts of loads, and of the reactions of loads: sums of their impulses over the particles. \see
/// LoadReaction
///
/// The buffer "load_reactions" is that of a set of particles. It has, for each load, a scale: a power of two, at most
/// 1 / q, where q is the load times the time step; then, for each component of the impulse and of the angular impulse
/// of each load, an integer of 96 bits as in reaction_kernels.hpp. A particle of mass m whose velocity changes by Δv
/// adds 2⁴⁴ m Δv / q. As Δv is what rounding leaves of the load's, no component of m Δv exceeds 2 q, so an integer is
/// at most 2⁴⁵. There are less than 2³² particles, so that no sum overflows.
#pragma once

#include <firn/core/requirements.hpp>

#include <string>

namespace firn::inline FIRN_BUILD::wgsl {

namespace text {

/// WGSL text of the entry point push, which changes the particles' velocities by loads.
inline constexpr const char* push = R"(
@compute @workgroup_size(${GROUP})
fn push(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.particles || stopped()) { return; }
    read_time_step();
    let acting = u32(load_loads(i));
    var v = load_velocity(i);${LOADS}
    store_velocity(i, v);
}
)";

/// WGSL text of the entry point begin_push, which chooses the scales and sets the sums to zero, and of the functions
/// add_load_reaction(load, impulse, arm) and arm_of_load(i). After text::add_wide.
inline constexpr const char* load_reactions = R"(
@compute @workgroup_size(1)
fn begin_push() {
    if (stopped()) { return; }
    read_time_step();${CHOOSE_SCALES}
    for (var k = ${LOADS}u; k < ${WORDS}u; k++) { atomicStore(&load_reactions[k], 0u); }
}
fn choose_load_scale(load: u32, force: ${VEC}) {
    let largest = ${LARGEST} * chosen.time_step;
    atomicStore(&load_reactions[load], (253u - (bitcast<u32>(clamp(largest, 1e-30f, 1e30f)) >> 23u)) << 23u);
}
/// From the point about which angular impulses are taken to a particle [cells].
fn arm_of_load(i: u32) -> ${VEC} {
    let place = load_place(i);
    var corner = load_corner(i);${INTO_DOMAIN}
    return (corner - params.load_about_cell) + (place - params.load_about_rest);
}
/// \param impulse  of the load on a particle [kg m/s]
fn add_load_reaction(load: u32, impulse: ${VEC}, arm: ${VEC}) {
    if (all(impulse == ${VEC}(0.0f))) { return; }
    let first = ${IMPULSES}u * load;
    let quanta = impulse * bitcast<f32>(atomicLoad(&load_reactions[load])) * 0x1p44f;
    for (var a = 0u; a < ${D}u; a++) { add_wide_of_load(first + a, quanta[a]); }
    let lever = arm * params.load_per_arm;
    ${ADD_ANGULAR}
}
)";

/// WGSL statements that move the corner of a particle's block, so that the particle lies in a periodic domain.
inline constexpr const char* corner_into_domain = R"(
    let period = ${VEC}(params.period);
    corner = select(corner, corner + period, (period > ${VEC}(0.0f)) & (place < -corner));
    corner = select(corner, corner - period, (period > ${VEC}(0.0f)) & (place >= period - corner));)";

}  // namespace text

namespace detail {

/// Returns the WGSL statements in which loads change the velocity of a particle.
/// \param react  whether their impulses are summed
inline std::string statements_of_loads(int loads, bool react) {
    std::string text = react ? "\n    let arm = arm_of_load(i);" : "";
    for (int k = 0; k < loads; ++k) {
        const std::string n = std::to_string(k), change = "v += pushed_by(params.load_" + n + ", load_mass(i));";
        text += "\n    if ((acting & " + std::to_string(1u << k) + "u) != 0u) {";
        text += react ? "\n        let before = v;\n        " + change + "\n        add_load_reaction(" + n +
                            "u, load_mass(i) * (v - before), arm);\n    }"
                      : " " + change + " }";
    }
    return text;
}

/// Returns the WGSL statements that choose the scales of the sums of the impulses of loads.
inline std::string scales_of_loads(int loads) {
    std::string text;
    for (int k = 0; k < loads; ++k)
        text += "\n    choose_load_scale(" + std::to_string(k) + "u, params.load_" + std::to_string(k) + ");";
    return text;
}
/// Returns the WGSL expression of the size of the largest component of a force.
inline std::string largest_component(int dimension) {
    const std::string in_plane = "max(abs(force.x), abs(force.y))";
    return dimension == 2 ? in_plane : "max(" + in_plane + ", abs(force.z))";
}
/// Returns the WGSL statements that add an angular impulse. \param add  name of the function that adds a number
inline std::string add_angular(int dimension, const std::string& add) {
    if (dimension == 2) return add + "(first + 2u, lever.x * quanta.y - lever.y * quanta.x);";
    return "let angular = cross(lever, quanta);\n    for (var a = 0u; a < 3u; a++) { " + add +
           "(first + 3u + a, angular[a]); }";
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD::wgsl
