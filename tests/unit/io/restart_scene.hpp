/// \file A run of any material, transfer and execution that is stopped half-way and goes on from its file with another
/// number of threads: 500 steps (sanitized: 100) give the bits of a run that was never stopped. A plain build tries
/// every material, transfer and execution at least once; with FIRN_TEST_ALL every material meets every execution.
#pragma once

#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include "example_state.hpp"

namespace restarts {

using namespace firn;

/// A block is thrown at another against the floor.
template <class Material, class Execution, class Transfer = Apic, class Volume = OwnVolume>
void goes_on(const Material& material) {
    using Run = Simulation<2, Material, Transfer, MlsForce, QuadraticBSpline, Execution,
                           Walls<material_scalar_t<Material>, 2>, Volume>;
    const auto made = [&](int threads) {
        Execution execution{};
        if constexpr (!std::same_as<Execution, detail::Serial>) execution.threads = threads;
        return Run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, material, execution);
    };
    constexpr double spacing = 1.0 / 32;
    Run whole = made(1), stopped = made(4);
    for (Run* run : {&whole, &stopped}) {
        run->add(sample_box<2>({0.35, 0.0}, {0.6, 0.25}, {.spacing = spacing}), 1000);
        run->add(sample_box<2>({0.4, 0.3}, {0.65, 0.5}, {.spacing = spacing}), 1000, {0.3, -2.5});
    }
    const int before = test_support::fewer_if_slow(233, 40), after = test_support::fewer_if_slow(267, 60);
    for (int i = 0; i < before + after; ++i) whole.step();
    for (int i = 0; i < before; ++i) stopped.step();
    const states::Folder folder;
    const auto state = state_of(stopped);
    write_state(folder / "state.hdf", state);
    Run continued = made(3);
    restore(continued, read_state<typename Run::scalar_type>(folder / "state.hdf"));
    for (int i = 0; i < after; ++i) continued.step();
    const auto should_be = state_of(whole);
    CAPTURE(Material::name, Execution::name, Transfer::name);
    CHECK((state_of(continued) == should_be));  // too large to be printed
    CHECK(should_be.field("kirchhoff_stress").values != state.field("kirchhoff_stress").values);
    CHECK(should_be.field("position").values != state.field("position").values);
}

/// With one execution, or with all.
template <class Execution, class Transfer = Apic, class Material>
void goes_on_with(const Material& material) {
    goes_on<Material, Execution, Transfer>(material);
#ifdef FIRN_TEST_ALL
    goes_on<Material, detail::Serial, Transfer>(material);
    goes_on<Material, Coloured, Transfer>(material);
    goes_on<Material, FixedPoint<std::int32_t>, Transfer>(material);
    goes_on<Material, FixedPoint<std::int64_t>, Transfer>(material);
    goes_on<Material, ColouredFixedPoint<std::int32_t>, Transfer>(material);
    goes_on<Material, ColouredFixedPoint<std::int64_t>, Transfer>(material);
#endif
}

}  // namespace restarts
