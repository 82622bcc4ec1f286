/// \file Writes the seeds of the state reader's fuzzer into a folder: small states of every kind.
#include <firn/io/state_writer.hpp>

#include "small_run.hpp"
#include "unit/io/example_state.hpp"

int main(int, char** arguments) {
    const std::filesystem::path folder = arguments[1];
    std::filesystem::create_directories(folder);
    auto solid = states::example<float>(3, 3);
    firn::write_state(folder / "solid.hdf", solid);
    solid.facets = {0, 1, 2};
    firn::write_state(folder / "facets.hdf", solid);
    firn::write_state(folder / "plane.hdf", states::example<double>(2, 2));
    auto smooth = states::example<float>(3, 2000);
    for (auto& field : smooth.fields) std::fill(field.values.begin(), field.values.end(), 1.0F);
    firn::write_state(folder / "deflated.hdf", smooth, {.compression = 1});
    firn::write_state(folder / "run.hdf", small_run::begun());
}
