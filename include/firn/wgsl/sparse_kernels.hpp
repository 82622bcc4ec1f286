/// \file The WGSL texts of a sparse grid: a program stores only the blocks of 4^D nodes that particles reach.
///
/// Before each step the device finds these blocks. The buffer "block_table" has, for `n` = params.blocks blocks:
/// from word 0 on a hash table of 4 n entries, each the number of a block of the lattice plus one (0: free) and the
/// block's place in the grid; from word 8 n on the number of the block at each place; from word 9 n on, for each place,
/// the places of the 2^D blocks that start 0 or 1 blocks further along each axis.
///
/// The places of blocks differ from run to run. No number depends on them, because sums are integers.
#pragma once

#include <firn/core/requirements.hpp>

namespace firn::inline FIRN_BUILD::wgsl::text {

/// WGSL text of the functions that tell where nodes are in a dense grid.
inline constexpr const char* dense_nodes = R"(
fn node_count() -> u32 { return ${NODE_COUNT}; }
fn node_index(at: ${IVEC}) -> u32 { return ${NODE_INDEX}; }
fn node_at(i: u32) -> ${UVEC} { return ${NODE_AT}; }
fn nodes_from(k: ${VEC}) -> ${IVEC} { return lattice_from(k); }
fn block_count() -> u32 { return node_count() / ${BLOCK_NODES}u; }
fn block_of(first: ${IVEC}) -> u32 { let at = first / 4; return ${BLOCK_INDEX}; }
/// The first node of a block.
fn enter_block(block: u32) -> ${IVEC} { return ${BLOCK_ORIGIN}; }
)";

/// WGSL text of the functions that tell where nodes are in a sparse grid. nodes_from() finds the block of the first
/// node that a particle reaches; node_index() is for the nodes from there on.
inline constexpr const char* sparse_nodes = R"(
var<private> home: u32;         // place of the block of the first node
var<private> home_block: ${IVEC}; // this block, in blocks

fn block_count() -> u32 { return min(atomicLoad(&status[24]) + atomicLoad(&status[25]), params.blocks); }
fn node_count() -> u32 { return ${BLOCK_NODES}u * block_count(); }
fn number_of(block: ${IVEC}) -> u32 { return u32(${BLOCK_OF_LATTICE}); }
fn block_at(number: u32) -> ${IVEC} { return ${LATTICE_BLOCK}; }
fn first_entry(number: u32) -> u32 { return ((number * 2654435769u) >> 5u) % (4u * params.blocks); }
fn next_entry(entry: u32) -> u32 { return (entry + 1u) % (4u * params.blocks); }

fn place_of(block: ${IVEC}) -> u32 {
    let number = number_of(block);
    var entry = first_entry(number);
    for (var k = 0u; k < 4u * params.blocks; k++) {
        let there = block_words[2u * entry];
        if (there == number + 1u) { return block_words[2u * entry + 1u]; }
        if (there == 0u) { break; }
        entry = next_entry(entry);
    }
    return 0u; // of a block that no particle reaches
}
fn nodes_from(k: ${VEC}) -> ${IVEC} {
    let first = lattice_from(k);
    home_block = first >> ${UVEC}(2u);
    home = place_of(home_block);
    return first;
}
fn node_index(at: ${IVEC}) -> u32 {
    let further = (at >> ${UVEC}(2u)) - home_block; // no index is negative
    let in_block = at & ${IVEC}(3);
    let place = block_words[9u * params.blocks + ${AROUND}u * home + u32(${FURTHER})];
    return ${BLOCK_NODES}u * place + u32(${IN_BLOCK});
}
/// The place of the block of the first node, after nodes_from().
fn block_of(first: ${IVEC}) -> u32 { return home; }
/// The first node of the block at a place. node_index() is for the nodes from there on, then.
fn enter_block(place: u32) -> ${IVEC} {
    home = place;
    home_block = block_at(block_words[8u * params.blocks + place]);
    return 4 * home_block;
}
fn node_at(i: u32) -> ${UVEC} {
    let in_block = i % ${BLOCK_NODES}u;
    return ${UVEC}(4 * block_at(block_words[8u * params.blocks + i / ${BLOCK_NODES}u])) + ${AT_IN_BLOCK};
}
)";

/// WGSL text in which activate_blocks enters the blocks that the particles with a first node in `block` reach.
inline constexpr const char* enter_reached = R"(for (var k = 1u; k < ${AROUND}u; k++) {
        let further = ${FURTHER_BLOCK};
        if (all(further < ${IVEC}(params.nodes / 4u))) { enter(further, found, 25u); }
    })";

/// The same beside mirrored walls: also the blocks of nodes behind them, of which no particle may reach any.
inline constexpr const char* enter_reached_and_mirrored =
    R"(let low = select(${IVEC}(0), ${IVEC}(-1), ${IS_BELOW});
    let high = ${HIGH};
    ${LOOPS}
        let k = ${IVEC}(${COUNTERS});
        let further = ${BLOCK_AT_K}; // among them blocks of first nodes, which are there already
        if (any(k != ${IVEC}(0)) && all(further >= ${IVEC}(0)) && all(further < ${IVEC}(params.nodes / 4u))) {
            enter(further, found, 25u);
        }
    ${END})";

/// WGSL text of functions for mirrored walls in a sparse grid. In a pass of the walls across an axis, an invocation is
/// a node, and does the columns that it leads. \see mirror
inline constexpr const char* sparse_lines = R"(
/// The nodes along one axis: node k has the index along * k + across along the axes; `first` is added to its place.
struct Line {
    first: u32,
    along: ${IVEC},
    across: ${IVEC},
}
/// Index of node k of a line, or no_node: of a node outside, or in a block that is not stored.
fn node_of_line(line: Line, k: i32) -> u32 {
    let at = ${IN_DOMAIN};
    if (any(at < ${IVEC}(0)) || any(at >= ${IVEC}(params.nodes))) { return no_node; }
    let block = at >> ${UVEC}(2u);
    let place = place_of(block);
    if (block_words[8u * params.blocks + place] != number_of(block)) { return no_node; }
    let in_block = at & ${IVEC}(3);
    return line.first + ${BLOCK_NODES}u * place + u32(${IN_BLOCK});
}
/// Whether the k-th block along an axis has nodes beside node `on`.
fn is_beside(k: i32, on: i32) -> bool { return k >= ((on - 1) >> 2u) && k <= ((on + 1) >> 2u); }
/// Along each axis, whether a block has nodes beside a mirrored wall across this axis.
fn are_beside_walls(block: ${IVEC}) -> vec${D}<bool> {
    return vec${D}<bool>(${BESIDE_WALLS});
}
)";

/// WGSL text of the entry points that find the blocks of a sparse grid: clear_table, find_blocks, activate_blocks and
/// link_blocks. They run before begin_step, so that nothing has changed if there are more blocks than memory. Status
/// words: 24 the number of blocks that contain a particle's first node, 25 the number of further blocks.
inline constexpr const char* find_blocks = R"(
/// Whether this is no step: after an error, or if no time is left.
fn step_is_idle() -> bool { return failed() || (params.bound_time_step == 2u && atomicLoad(&status[21]) == 0u); }

/// Enters a block, unless it is there: at the place `before` + the number that the status word has, which it counts.
fn enter(block: ${IVEC}, before: u32, word: u32) {
    let number = number_of(block);
    var entry = first_entry(number);
    for (var k = 0u; k < 8u * params.blocks && !failed(); k++) {
        let there = atomicLoad(&block_table[2u * entry]);
        if (there == number + 1u) { return; }
        if (there == 0u) {
            let result = atomicCompareExchangeWeak(&block_table[2u * entry], 0u, number + 1u);
            if (result.exchanged) {
                let place = before + atomicAdd(&status[word], 1u);
                if (place >= params.blocks) { break; }
                atomicStore(&block_table[2u * entry + 1u], place);
                atomicStore(&block_table[8u * params.blocks + place], number);
                return;
            }
        } else {
            entry = next_entry(entry);
        }
    }
    fail(${BLOCKS_ERROR}u, 0xffffffffu);
}

@compute @workgroup_size(${GROUP})
fn clear_table(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.blocks || step_is_idle()) { return; }
    for (var k = 0u; k < 8u; k++) { atomicStore(&block_table[8u * i + k], 0u); }
    if (i == 0u) {
        atomicStore(&status[1], 0xffffffffu); // no particle
        atomicStore(&status[24], 0u);
        atomicStore(&status[25], 0u);
    }
}

/// The blocks of first nodes: as they are after the places are counted anew, if they will be.
@compute @workgroup_size(${GROUP})
fn find_blocks(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= params.particles || step_is_idle()) { return; }
    var place = load_place(i);
    var corner = load_corner(i);
    if (atomicLoad(&status[set_word(0u)]) != 0u) {
        let shift = shift_of_sort(place);
        place -= shift;
        corner += shift;
    }
    enter(lattice_from(base_node_of(place) + corner) / 4, 0u, 24u);
}

/// The blocks further along the axes, which the same particles reach.
@compute @workgroup_size(${GROUP})
fn activate_blocks(${INVOCATION}) {
    let i = invocation(group, groups, local);
    let found = atomicLoad(&status[24]);
    if (i >= min(found, params.blocks) || step_is_idle()) { return; }
    let block = block_at(atomicLoad(&block_table[8u * params.blocks + i]));
    ${ENTER_FURTHER}
}

@compute @workgroup_size(${GROUP})
fn link_blocks(${INVOCATION}) {
    let i = invocation(group, groups, local);
    if (i >= min(atomicLoad(&status[24]), params.blocks) || step_is_idle()) { return; }
    let block = block_at(block_words[8u * params.blocks + i]);
    for (var k = 0u; k < ${AROUND}u; k++) {
        block_words[9u * params.blocks + ${AROUND}u * i + k] = place_of(${FURTHER_BLOCK});
    }
}
)";

}  // namespace firn::inline FIRN_BUILD::wgsl::text
