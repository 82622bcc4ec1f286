/// \file Any bytes as a state: one whose parts fit, which can be written and read again, and from which a simulation
/// goes on; or a typed error.
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>

#include "fuzzed.hpp"
#include "small_run.hpp"
#include "unit/io/example_state.hpp"

#include <cstdlib>

namespace {

/// What a reader that does not verify accepts, one that verifies reads back to the bit once it is written.
template <class S>
void check(const std::filesystem::path& path) {
    const firn::State<S> found = firn::read_state<S>(path, {.verify = false});
    try {
        if (!states::same_bits(firn::read_state<S>(path), found)) std::abort();
    } catch (const firn::io_error&) {  // its digest does not match
    }
    if constexpr (std::same_as<S, float>) small_run::goes_on_from(found);
    auto again = path;
    again += "_again";
    firn::write_state(again, found);
    const auto read = firn::read_state<S>(again);
    std::filesystem::remove(again);
    if (firn::digest(read) != firn::digest(found)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    return read_bytes(data, size, [](const auto& path) {
        try {
            check<double>(path);
        } catch (const firn::error&) {
        }
        check<float>(path);
    });
}
