/// \file The tables `slot` and `blocks` of a state say in which order a run adds up numbers, whatever its memory looks
/// like; restore() reads them as this version and as earlier versions write them.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/scenes.hpp"
#include <firn/io/hash_stream.hpp>
#include <firn/io/restart.hpp>
#include <firn/io/simulation_state.hpp>

#include <array>
#include <cstring>
#include <random>

using namespace firn;

namespace slots {
namespace {

/// Two bodies: dense blocks, and cubes of sparse blocks.
Simulation<2> started() {
    Simulation<2> run({{0, 0}, {1, 1}, 1.0 / 32});
    run.add(sample_box<2>({0.3, 0.0}, {0.6, 0.25}, {.spacing = 1.0 / 64}), 1000);
    run.add(sample_box<2>({0.1, 0.3}, {0.9, 0.9}, {.spacing = 1.0 / 32}), 1000, {0.3, -2.5});
    for (int i = 0; i < 20; ++i) run.step();
    return run;
}

StateTable& table_of(State<float>& state, const std::string& name) {
    for (StateTable& table : state.tables)
        if (table.name == name) return table;
    throw std::logic_error(name);
}

/// The state with the tables of schema_version 3: the slots of memory, and the blocks in the order of their keys.
State<float> as_before(Simulation<2>& run) {
    State<float> state = state_of(run);
    const BlockPartition<2>& partition = run.partition();
    std::vector<std::int64_t>& blocks = table_of(state, "blocks").values;
    blocks.clear();
    for (const std::uint32_t r : partition.by_block) {
        const BlockRange<2>& range = partition.ranges[r];
        blocks.insert(blocks.end(),
                      {range.block[0], range.block[1], std::int64_t(range.first_slot), std::int64_t(range.particles)});
    }
    const auto slot_of = slots_by_id(run.particles(), 1);
    table_of(state, "slot").values.assign(slot_of.begin(), slot_of.end());
    return state;
}

}  // namespace

TEST_CASE("The table of blocks follows the curve, and slots count the particles along it", "[io]") {
    Simulation<2> run = started();
    State<float> state = state_of(run);
    const auto &blocks = table_of(state, "blocks").values, &slot = table_of(state, "slot").values;
    const BlockPartition<2>& partition = run.partition();
    REQUIRE(blocks.size() == 4 * partition.ranges.size());
    std::vector<std::int64_t> id_of(state.size(), -1);
    for (std::size_t i = 0; i < state.size(); ++i) id_of.at(std::size_t(slot[i])) = state.id[i];
    std::int64_t next = 0;
    for (std::size_t b = 0; b < partition.ranges.size(); ++b) {
        const BlockCoordinate<2> block{int(blocks[4 * b]), int(blocks[4 * b + 1])};
        if (b > 0) CHECK(before_on_curve<2>({int(blocks[4 * b - 4]), int(blocks[4 * b - 3])}, block));
        CHECK(blocks[4 * b + 2] == next);
        const auto range =
            std::ranges::find_if(partition.ranges, [&](const BlockRange<2>& r) { return r.block == block; });
        REQUIRE(range != partition.ranges.end());
        REQUIRE(blocks[4 * b + 3] == std::int64_t(range->particles));
        for (std::size_t k = 0; k < range->particles; ++k, ++next)
            REQUIRE(id_of[std::size_t(next)] == run.particles().id(range->first_slot + k));
    }
    CHECK(next == std::int64_t(state.size()));
}

TEST_CASE("A run goes on to the same bits from slots as earlier versions wrote them, and from any others", "[io]") {
    Simulation<2> run = started();
    const State<float> before = as_before(run), now = state_of(run);
    REQUIRE(before.tables != now.tables);

    State<float> shuffled = now;  // the blocks in another order
    std::vector<std::int64_t>& blocks = table_of(shuffled, "blocks").values;
    std::vector<std::array<std::int64_t, 4>> rows(blocks.size() / 4);
    std::memcpy(rows.data(), blocks.data(), blocks.size() * sizeof(std::int64_t));
    std::ranges::shuffle(rows, std::minstd_rand(7));
    const std::vector<std::int64_t> slot_was = table_of(shuffled, "slot").values;
    std::int64_t next = 0;
    for (auto& row : rows) {
        for (std::size_t i = 0; i < slot_was.size(); ++i)
            if (slot_was[i] >= row[2] && slot_was[i] < row[2] + row[3])
                table_of(shuffled, "slot").values[i] = slot_was[i] - row[2] + next;
        row[2] = next;
        next += row[3];
    }
    std::memcpy(blocks.data(), rows.data(), blocks.size() * sizeof(std::int64_t));

    for (int i = 0; i < 60; ++i) run.step();
    for (const State<float>& state : {before, now, shuffled}) {
        Simulation<2> continued({{0, 0}, {1, 1}, 1.0 / 32});
        restore(continued, state);
        for (int i = 0; i < 60; ++i) continued.step();
        CHECK((state_of(continued) == state_of(run)));
    }
}

TEST_CASE("Slots and blocks that contradict each other are refused", "[io]") {
    Simulation<2> run = started();
    const State<float> now = state_of(run), before = as_before(run);
    const auto refused = [&](const State<float>& good, const char* word, const auto& damage) {
        State<float> state = good;
        damage(table_of(state, "blocks").values, table_of(state, "slot").values);
        Simulation<2> target({{0, 0}, {1, 1}, 1.0 / 32});
        const std::string said = test_support::message<io_error>([&] { restore(target, state); });
        UNSCOPED_INFO(said << " | " << word);
        CHECK(test_support::holds(said, word));
    };
    using Table = std::vector<std::int64_t>;
    for (const State<float>& good : {now, before}) {
        refused(good, "order of particles", [](Table& b, Table&) { b[4 + 2] = b[2]; });  // two blocks share slots
        refused(good, "table of blocks", [](Table& b, Table&) { std::copy_n(b.data(), 2, b.data() + 4); });
        refused(good, "table of blocks", [](Table& b, Table&) { b[2] = -1; });
        refused(good, "table of blocks", [](Table& b, Table&) { b[2] = std::int64_t(1) << 62; });
        refused(good, "table of blocks", [](Table& b, Table&) { b[3] = std::numeric_limits<std::int64_t>::max(); });
        refused(good, "table of blocks", [](Table& b, Table&) { b[3] += 1; });
        refused(good, "table of blocks", [](Table& b, Table&) { b.resize(b.size() - 4); });
        refused(good, "order of particles", [](Table&, Table& s) { s[5] = s[6]; });
        refused(good, "order of particles", [](Table&, Table& s) { s[5] = -1; });
        refused(good, "order of particles", [](Table&, Table& s) { s[5] = 1 << 20; });
    }
}

TEST_CASE("The hash of an array is that of its pieces, each hashed where the last hash was sent to", "[io]") {
    for (const std::size_t count : {0, 1, 25, 60, 61, 1000, 100'000}) {
        std::vector<float> numbers(count);
        for (std::size_t i = 0; i < count; ++i) numbers[i] = float(random_bits(5, i));
        for (const std::size_t pieces : {1, 2, 7, 64}) {
            detail::HashStream stream;
            for (std::size_t p = 0; p < pieces; ++p) {
                detail::HashStream next;
                next.go_on_from(stream.bytes());
                const std::size_t from = count * p * p / (pieces * pieces),
                                  to = count * (p + 1) * (p + 1) / (pieces * pieces);
                next.add(std::as_bytes(std::span(numbers).subspan(from, to - from)), sizeof(float));
                stream.go_on_from(next.bytes());
            }
            CHECK(stream.hash() == detail::hash_numbers(std::as_bytes(std::span(numbers)), sizeof(float)));
        }
    }
}

}  // namespace slots
