/// \file Makes a film of a run's pictures with ffmpeg, if it is installed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

namespace example {

/// Returns "_0012" + ending for the number 12.
inline std::string numbered(int number, const char* ending) {
    char text[24];
    std::snprintf(text, sizeof text, "_%04d", number);
    return std::string(text) + ending;
}

/// Puts a word in quotes for the shell.
inline std::string quoted(const std::string& word) {
#ifdef _WIN32
    return '"' + word + '"';
#else
    std::string result = "'";
    for (const char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return result + "'";
#endif
}

inline bool has_ffmpeg() {
#ifdef _WIN32
    return std::system("ffmpeg -version > NUL 2>&1") == 0;
#else
    return std::system("ffmpeg -version > /dev/null 2>&1") == 0;
#endif
}

/// Pictures per second: a film lasts at least five seconds, unless that would be fewer than ten pictures per second.
inline std::int64_t pictures_per_second(std::int64_t pictures) {
    return std::clamp<std::int64_t>(pictures / 5, 10, 30);
}

/// The command that makes FILE.mp4 of the pictures FILE_0000.png … . It is H.264 in 4:2:0, which every player knows.
/// \param file  path without ending
inline std::string film_command(const std::filesystem::path& file, std::int64_t first, std::int64_t count) {
    const std::string path = std::filesystem::absolute(file).string();
    std::string pattern = "file:";
    for (const char c : path) pattern += c == '%' ? std::string("%%") : std::string(1, c);
    return "ffmpeg -nostdin -y -loglevel error -framerate " + std::to_string(pictures_per_second(count)) +
           " -start_number " + std::to_string(first) + " -i " + quoted(pattern + "_%04d.png") + " -frames:v " +
           std::to_string(count) +
           " -vf \"pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p\""
           " -colorspace bt709 -color_primaries bt709 -color_trc bt709 -c:v libx264 -crf 20 -movflags +faststart " +
           quoted("file:" + path + ".mp4");
}

/// Whether ffmpeg is installed. If not, prints so, with the command that makes the film of `states` states elsewhere.
inline bool finds_ffmpeg(const std::filesystem::path& file, std::int64_t states) {
    if (has_ffmpeg()) return true;
    std::cerr
        << "There are pictures but no film, because the program ffmpeg is not found. Install it, or make the film "
           "elsewhere with:\n"
        << film_command(file, 0, states) << std::endl;
    return false;
}

/// Makes FILE.mp4 of the pictures of `states` states, or of the last ones if earlier ones have no picture. Returns
/// whether there is a film; if not, prints why.
inline bool make_film(const std::filesystem::path& file, int states) {
    int first = states;
    while (first > 0 && std::filesystem::exists(file.string() + numbered(first - 1, ".png"))) --first;
    if (first == states) {
        std::cerr << "There is no film, because there are no pictures." << std::endl;
        return false;
    }
    if (first > 0) std::cout << "the film begins with state " << first << ": earlier ones have no picture" << std::endl;
    if (std::system(film_command(file, first, states - first).c_str()) != 0) {
        std::cerr << "ffmpeg has failed, so there is no film " << file.string()
                  << ".mp4. Its message is above. The pictures are there." << std::endl;
        return false;
    }
    std::cout << "film: " << file.string() << ".mp4" << std::endl;
    return true;
}

}  // namespace example
