/// \file Bodies of state_series.hpp. A program that links firn::compiled_hdf5 does not include them.
#pragma once

#include <firn/io/file_series-inl.hpp>
#include <firn/io/state_series.hpp>

#include <utility>

namespace firn::inline FIRN_BUILD {

[[gnu::cold]] FIRN_BODY StateSeries::StateSeries(std::filesystem::path directory, std::string name,
                                                 const StateOptions& options)
    : files_(std::move(directory), std::move(name), ".hdf"), options_(options) {}

[[gnu::cold]] FIRN_BODY void StateSeries::go_on_from(double time) { files_.go_on_from(time); }

template <state_scalar S>
[[gnu::cold]] std::filesystem::path StateSeries::write(const State<S>& state) {
    return write_with(state.time, [&](const std::filesystem::path& file, const StateOptions& options) {
        write_state(file, state, options);
    });
}

[[gnu::cold]] FIRN_BODY std::filesystem::path StateSeries::write_with(
    double time, const std::function<void(const std::filesystem::path&, const StateOptions&)>& put) {
    StateOptions options = options_;
    if (options.complete_every > 0 && files_.next() % options.complete_every == 0) options.fields.clear();
    return files_.write(time, [&](const std::filesystem::path& file) { put(file, std::as_const(options)); });
}

}  // namespace firn::inline FIRN_BUILD
