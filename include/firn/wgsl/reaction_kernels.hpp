/// \file The WGSL texts of the reactions of a boundary: sums of its impulses on matter over the nodes. \see Reactions
///
/// The buffer "reactions" has, for each component of the impulse and of the angular impulse of each part of the
/// boundary, three words: an integer of 96 bits, the low word first. The order of nodes makes no difference to
/// integers. Word 0 of the buffer is a scale: a power of two, at most 1 / V, where V is the largest signal speed or
/// speed of the boundary. A node whose mass is m quanta and whose velocity changes by Δv adds 2¹³ m Δv / V: an integer
/// of 2⁴⁴ where V changes the heaviest node, so that the much smaller impulses of matter at rest are exact to 1e-7,
/// too.
///
/// The sums cannot overflow. m is below 2³¹, so what a node adds is at most 2⁶⁰ unless Δv exceeds 2¹⁶ V, which is an
/// error. There are less than 2³⁰ nodes, as each has four indices of 32 bits in the buffer "nodes". The grid update and
/// mirrored walls along up to three axes add to a node, so the sum is below 2⁹². The scale of arms is at most one half
/// over the largest arm, so an angular impulse is no larger than an impulse. Sums in two words would either overflow or
/// lose the impulses of matter at rest.
#pragma once

#include <firn/core/requirements.hpp>

namespace firn::inline FIRN_BUILD::wgsl::text {

/// WGSL text of the function begin_reactions(), which chooses the scale and sets the sums to zero.
inline constexpr const char* begin_reactions = R"(
/// V is no less than 2^-10 cells per step. Dust at rest has no signal speed, but may fall onto a wall.
fn begin_reactions() {
    let least_speed = 0x1p-10f / max(chosen.place_per_velocity, 1e-20f);
    let speed = clamp(max(max(status_number(2u), params.boundary_speed), least_speed), 1e-20f, 1e20f);
    atomicStore(&reactions[0], (253u - (bitcast<u32>(speed) >> 23u)) << 23u);
    for (var k = 1u; k < ${WORDS}u; k++) { atomicStore(&reactions[k], 0u); }
}
)";

/// WGSL text of the function ${ADD_WIDE}(number, x), which adds to the integers of 96 bits from word ${FIRST_SUM} of a
/// buffer on.
inline constexpr const char* add_wide = R"(/// Adds the integer next to x to the sum with this number.
fn ${ADD_WIDE}(number: u32, x: f32) {
    if (!is_finite(x)) { return; } // G2P reports it
    if (abs(x) > 0x1p60f) {
        fail(${REACTION_ERROR}u, 0xffffffffu);
        return;
    }
    let size = round(abs(x));
    if (size == 0.0f) { return; }
    let high = floor(size * 0x1p-32f);
    var words = vec3<u32>(u32(size - high * 0x1p32f), u32(high), 0u);
    if (x < 0.0f) {
        words = ~words;
        words.x += 1u;
        if (words.x == 0u) { words.y += 1u; }
    }
    let at = ${FIRST_SUM}u + 3u * number;
    let low = atomicAdd(&${SUMS}[at], words.x);
    if (low + words.x < low) {
        words.y += 1u;
        if (words.y == 0u) { words.z += 1u; }
    }
    let middle = atomicAdd(&${SUMS}[at + 1u], words.y);
    if (middle + words.y < middle) { words.z += 1u; }
    if (words.z != 0u) { atomicAdd(&${SUMS}[at + 2u], words.z); }
}
)";

/// WGSL text of the function add_reaction(part, mass, change, arm), which adds the impulse of a part at a node.
inline constexpr const char* add_reaction = R"(/// \param mass    of the node [quanta]
/// \param change  of the node's velocity by the part [m/s]
/// \param arm     from the point about which angular impulses are taken to the node [m]
fn add_reaction(part: u32, mass: f32, change: ${VEC}, arm: ${VEC}) {
    if (all(change == ${VEC}(0.0f))) { return; }
    let first = ${IMPULSES}u * part;
    let quanta = mass * (change * (0x1p13f * bitcast<f32>(atomicLoad(&reactions[0]))));
    for (var a = 0u; a < ${D}u; a++) { add_wide(first + a, quanta[a]); }
    let lever = arm * params.per_arm;
    ${ADD_ANGULAR}
}
)";

/// WGSL text of the function add_reactions_of_wall(…), which adds the impulses of a mirrored wall at the nodes of a
/// column. The masses of nodes before walls act are in the buffer "counts" [quanta].
inline constexpr const char* add_reactions_of_wall = R"(
fn add_reaction_at(part: u32, line: Line, k: i32, change: ${VEC}, about: ${VEC}) {
    let i = node_of_line(line, k);
    if (i == no_node) { return; }
    let at = node_at(i);
    add_reaction(part, f32(atomicLoad(&counts[i])), change, ${VEC}(${COORDINATES}) - about);
}
fn add_reactions_of_wall(part: u32, line: Line, on: i32, inward: i32, before: NodeColumn, after: NodeColumn,
                         about: ${VEC}) {
    add_reaction_at(part, line, on - inward, after.behind - before.behind, about);
    add_reaction_at(part, line, on, after.on - before.on, about);
    add_reaction_at(part, line, on + inward, after.front - before.front, about);
}
)";

}  // namespace firn::inline FIRN_BUILD::wgsl::text
