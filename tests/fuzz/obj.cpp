/// \file Any bytes as an OBJ file: a mesh that check_mesh() accepts, or a typed error.
#include <firn/io/obj.hpp>

#include "fuzzed.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    return read_bytes(data, size, [](const auto& path) {
        try {
            static_cast<void>(firn::read_obj_points(path));
        } catch (const firn::error&) {
        }
        firn::check_mesh(firn::read_obj(path));
    });
}
