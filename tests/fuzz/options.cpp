/// \file Any lines as the arguments of an example: options in their ranges, or an exit code.
#include "support/options.hpp"

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::istringstream lines(std::string(reinterpret_cast<const char*>(data), size));
    std::vector<std::string> words{"falling"};
    for (std::string word; words.size() < 50 && std::getline(lines, word);) words.push_back(word);
    std::vector<const char*> arguments;
    for (const std::string& word : words) arguments.push_back(word.c_str());

    example::CommandLine line({.name = "falling", .about = "Something falls."});
    double young = 1e3;
    line.add("--young", young, "Young's modulus in Pa", 1.0, 1e9);
    std::ostringstream kept;  // away from the terminal
    auto* const out = std::cout.rdbuf(kept.rdbuf());
    auto* const err = std::cerr.rdbuf(kept.rdbuf());
    const auto exit_code = line.parse(int(arguments.size()), arguments.data());
    std::cout.rdbuf(out);
    std::cerr.rdbuf(err);
    if (exit_code) return 0;
    const example::Options& options = line.options();
    const bool in_range = options.particles >= 1 && options.particles <= example::CommandLine::most_particles &&
                          options.schedule.steps >= 0 && options.threads >= 1 && young >= 1 && young <= 1e9 &&
                          !options.output.empty();
    if (!in_range) std::abort();
    return 0;
}
