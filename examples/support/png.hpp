/// \file Writes an image as a PNG file, with libpng.
#pragma once

#include <firn/core/error.hpp>
#include <firn/io/atomic_file.hpp>

#include "image.hpp"
#include <png.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

namespace example {

/// Writes a picture to a temporary file beside `path` and renames it, so that `path` never has half a picture. Makes
/// missing folders.
/// \throws firn::io_error  if it cannot be written
inline void write_png(const std::filesystem::path& path, const Image& image) {
    const auto fail = [&](const std::string& why) {
        throw firn::io_error(firn::sentence("The picture ", path, " cannot be written: ", why, "."));
    };
    if (image.width < 1 || image.height < 1) fail("it has no pixels");

    png_image header;
    std::memset(&header, 0, sizeof header);
    header.version = PNG_IMAGE_VERSION;
    header.width = static_cast<png_uint_32>(image.width);
    header.height = static_cast<png_uint_32>(image.height);
    header.format = PNG_FORMAT_RGB;
    png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(header);
    std::vector<char> file(bytes);
    if (png_image_write_to_memory(&header, file.data(), &bytes, 0, image.pixels.data(), 0, nullptr) == 0) {
        fail(firn::sentence("libpng says: ", static_cast<const char*>(header.message)));
    }

    std::error_code problem;
    if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), problem);
    if (problem) fail(problem.message());
    const std::filesystem::path written = firn::written_file(path);
    auto partial = written;
    partial += ".partial";
    {
        std::ofstream out(partial, std::ios::binary | std::ios::trunc);
        out.write(file.data(), static_cast<std::streamsize>(bytes));
        out.close();
        if (!out) {
            std::filesystem::remove(partial, problem);
            fail("the folder is missing or not writable, or the disk is full");
        }
    }
    std::filesystem::rename(partial, written, problem);
    if (problem) {
        const auto why = problem.message();
        std::filesystem::remove(partial, problem);
        fail(why);
    }
}

}  // namespace example
