/// \file Gives the bytes of a fuzzer to a reader of files.
#pragma once

#include <firn/core/error.hpp>

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>

/// Calls read(path) for a file of these bytes. A typed error is an answer; any other exception is not.
template <class Read>
int read_bytes(const std::uint8_t* data, std::size_t size, const Read& read) {
    static const std::filesystem::path path = [] {
        const std::filesystem::path memory = "/dev/shm";
        const auto folder = std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
        return folder / ("firn_fuzz_" + std::to_string(::getpid()));
    }();
    std::ofstream(path, std::ios::binary | std::ios::trunc)
        .write(reinterpret_cast<const char*>(data), std::streamsize(size));
    try {
        read(path);
    } catch (const firn::error&) {
    }
    std::filesystem::remove(path);
    return 0;
}
