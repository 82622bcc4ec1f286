/// \file Any bytes as a state: one whose parts fit, which can be written and read again, or a typed error.
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>

#include "fuzzed.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    return read_bytes(data, size, [](const auto& path) {
        try {
            firn::check_state(firn::read_state<double>(path));
        } catch (const firn::error&) {
        }
        firn::check_state(firn::read_state<float>(path));
    });
}
