// A state says by ids which particle is which: its rows may stand in any order.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/io/restart.hpp>
#include <firn/io/simulation_state.hpp>

#include <numeric>

using namespace firn;

namespace permuted_rows {

Simulation<2> made() { return Simulation<2>({{0, 0}, {1, 1}, 1.0 / 16}); }

/// The state with its rows in another order: row i is row `order[i]` of before.
State<float> permuted(const State<float>& state, const std::vector<std::size_t>& order) {
    State<float> other = state;
    const auto permute = [&](auto& values, std::size_t columns) {
        const auto before = values;
        for (std::size_t i = 0; i < order.size(); ++i)
            std::copy_n(before.begin() + std::ptrdiff_t(order[i] * columns), columns,
                        values.begin() + std::ptrdiff_t(i * columns));
    };
    permute(other.id, 1);
    permute(other.body, 1);
    for (StateField<float>& field : other.fields) permute(field.values, std::size_t(field.components));
    for (StateTable& table : other.tables)
        if (table.name == "slot") permute(table.values, 1);
    return other;
}

TEST_CASE("a run goes on to the same bits from a state whose rows stand in another order", "[io]") {
    Simulation<2> whole = made();
    whole.add(sample_box<2>({0.3, 0.0}, {0.6, 0.25}, {.spacing = 1.0 / 32}), 1000);
    whole.add(sample_box<2>({0.4, 0.3}, {0.7, 0.5}, {.spacing = 1.0 / 32}), 1000, {0.3, -2.5});
    for (int i = 0; i < 20; ++i) whole.step();
    const State<float> state = state_of(whole);
    std::vector<std::size_t> order(state.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random_bits(3, i) % (i + 1)]);
    const State<float> other = permuted(state, order);
    REQUIRE(other.id != state.id);

    for (const Restart how : {Restart::same_bits, Restart::converted}) {
        Simulation<2> from_state = made(), from_other = made();
        restore(from_state, state, how);
        restore(from_other, other, how);
        for (int i = 0; i < 60; ++i) from_state.step(), from_other.step();
        CHECK((state_of(from_other) == state_of(from_state)));
        if (how != Restart::same_bits) continue;
        for (int i = 0; i < 60; ++i) whole.step();
        CHECK((state_of(from_other) == state_of(whole)));
    }
}

TEST_CASE("two rows of one id are refused", "[io]") {
    Simulation<2> run = made();
    run.add(sample_box<2>({0.3, 0.0}, {0.6, 0.25}, {.spacing = 1.0 / 32}), 1000);
    State<float> state = state_of(run);
    state.id[5] = state.id[9];
    CHECK_THROWS_AS(restore(run, state), io_error);
    CHECK_THROWS_AS(restore(run, state, Restart::converted), io_error);
}

}  // namespace permuted_rows
