/// \file What the tests of states share: a state with every kind of entry, its bits, and a folder that goes away.
#pragma once

#include "support/message.hpp"
#include <firn/io/state.hpp>

#include <stdlib.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace states {

/// An empty folder, removed with all that is in it.
class Folder {
public:
    Folder() {
        std::string pattern = (std::filesystem::temp_directory_path() / "firn-states-XXXXXX").string();
        if (!::mkdtemp(pattern.data())) throw std::runtime_error("no temporary folder");
        path_ = pattern;
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

    std::set<std::string> names() const {
        std::set<std::string> found;
        for (const auto& entry : std::filesystem::directory_iterator(path_)) found.insert(entry.path().filename());
        return found;
    }

private:
    std::filesystem::path path_;
};

inline std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline void put_bytes(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary | std::ios::trunc).write(bytes.data(), std::streamsize(bytes.size()));
}

/// Random bits of finite, infinite and not-a-number values alike: a conversion on the way would change some.
template <class S>
std::vector<S> any_bits(std::size_t count, std::uint64_t seed) {
    std::vector<S> values(count);
    for (auto& value : values) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;  // Knuth's MMIX generator
        const std::uint64_t bits = seed ^ (seed >> 29);
        std::memcpy(&value, &bits, sizeof value);
    }
    return values;
}

template <class S>
firn::State<S> example(int dimension, std::size_t count) {
    const auto D = std::size_t(dimension);
    firn::State<S> state;
    state.dimension = dimension;
    state.step = std::numeric_limits<std::uint64_t>::max();
    state.time = 0.1;
    state.last_time_step = 1.0 / 3e4;
    state.fields = {{"position", "m", dimension, any_bits<S>(D * count, 1)},
                    {"velocity", "m/s", dimension, any_bits<S>(D * count, 2)},
                    {"C", "1/s", dimension * dimension, any_bits<S>(D * D * count, 3)},
                    {"deformation_gradient", "1", dimension * dimension, any_bits<S>(D * D * count, 4)},
                    {"mass", "kg", 1, any_bits<S>(count, 5)},
                    {"a pair", "µm", 2, any_bits<S>(2 * count, 6)}};
    for (std::size_t i = 0; i < count; ++i) {
        state.id.push_back(std::int64_t(count - i) * 5'000'000'000);
        state.body.push_back(i % 2 ? std::numeric_limits<std::int32_t>::min() : std::int32_t(i));
    }
    state.parameters = {{"material", "young", "Pa", {1e3}},
                        {"material", "poisson", "1", {double(0.3f)}},
                        {"grid", "lower", "m", {-1, 0, 0.5}},
                        {"grid", "cell_size", "m", {1.0 / 128}}};
    state.attributes = {{"transfer", "APIC"}, {"kernel", "quadratic B-spline"}, {"note", ""}, {"author", "Åse"}};
    state.tables = {{"slot", 1, {3, -1, std::numeric_limits<std::int64_t>::min()}}, {"blocks", 2, {1, 2, 3, 4}}};
    return state;
}

/// Equality that tells −0 from 0 and one NaN from another.
template <class S>
bool same_bits(const firn::State<S>& a, const firn::State<S>& b) {
    if (a.fields.size() != b.fields.size()) return false;
    for (std::size_t i = 0; i < a.fields.size(); ++i) {
        const auto &f = a.fields[i], &g = b.fields[i];
        if (f.name != g.name || f.unit != g.unit || f.components != g.components ||
            f.values.size() != g.values.size() ||
            (!f.values.empty() && std::memcmp(f.values.data(), g.values.data(), f.values.size() * sizeof(S)) != 0)) {
            return false;
        }
    }
    const auto same = [](const firn::StateParameter& p, const firn::StateParameter& q) {
        return p.group == q.group && p.name == q.name && p.unit == q.unit && p.values.size() == q.values.size() &&
               std::memcmp(p.values.data(), q.values.data(), p.values.size() * sizeof(double)) == 0;
    };
    return a.dimension == b.dimension && a.step == b.step && a.time == b.time && a.last_time_step == b.last_time_step &&
           a.id == b.id && a.body == b.body && a.facets == b.facets && a.attributes == b.attributes &&
           a.tables == b.tables &&
           std::equal(a.parameters.begin(), a.parameters.end(), b.parameters.begin(), b.parameters.end(), same);
}

using test_support::holds;
using test_support::message;

}  // namespace states
