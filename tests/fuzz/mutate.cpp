/// \file firn_mutate COUNT SEEDS: damages COUNT states, COUNT meshes and COUNT states in memory in ways of its own, not
/// led by coverage, and counts what becomes of them. SEEDS: a folder of OBJ files.
///
/// Of a state's file that was damaged: refused, or read as it was written. Read without verifying: refused, or a state
/// from which a simulation goes on or refuses to. What was damaged in memory and then written has a digest that is
/// right and reaches all that restore() checks.
#include <firn/io/obj.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>

#include "small_run.hpp"
#include "unit/io/example_state.hpp"
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <random>
#include <variant>

namespace {

using State = firn::State<float>;

enum class Outcome { refused, as_written, other_than_written, read, goes_on, other_exception, count };
constexpr const char* names[] = {"refused", "as written", "OTHER THAN WRITTEN", "read", "goes on", "OTHER EXCEPTION"};

/// What parent and child share.
struct Counts {
    long at = 0;  ///< inputs begun
    long outcomes[int(Outcome::count)] = {};
};

class Damage {
public:
    explicit Damage(std::uint64_t seed) : random_(seed) {}

    std::size_t below(std::size_t end) { return end == 0 ? 0 : std::size_t(random_() % end); }

    /// A number that is extreme, or any.
    std::uint64_t word() {
        constexpr std::uint64_t extreme[] = {0,
                                             1,
                                             ~0ull,
                                             1ull << 63,
                                             (1ull << 63) - 1,
                                             1ull << 31,
                                             (1ull << 31) - 1,
                                             1ull << 32,
                                             0x7ff0000000000000,
                                             0xfff8000000000000,
                                             0x7f800000ff800000,
                                             0xffffffff00000000};
        return below(2) == 0 ? extreme[below(std::size(extreme))] : random_();
    }
    float number() {
        constexpr float extreme[] = {0,
                                     -0.0F,
                                     1,
                                     -1,
                                     1e30F,
                                     -1e30F,
                                     1e-40F,
                                     3e38F,
                                     std::numeric_limits<float>::infinity(),
                                     -std::numeric_limits<float>::infinity(),
                                     std::numeric_limits<float>::quiet_NaN()};
        return below(2) == 0 ? extreme[below(std::size(extreme))] : std::bit_cast<float>(std::uint32_t(random_()));
    }

    void of_bytes(std::string& bytes) {
        for (std::size_t n = 1 + below(4); n > 0 && !bytes.empty(); --n) {
            const std::size_t at = below(bytes.size()), length = std::min(bytes.size() - at, 1 + below(300));
            switch (below(7)) {
                case 0:
                    bytes[at] = char(bytes[at] ^ (1 << below(8)));
                    break;
                case 1:
                    bytes.resize(at);
                    break;
                case 2:
                    bytes.erase(at, length);
                    break;
                case 3:
                    bytes.insert(below(bytes.size()), bytes.substr(at, length));
                    break;
                case 4:
                    bytes.replace(at, length, length, below(2) == 0 ? '\0' : char(below(256)));
                    break;
                default: {
                    const std::uint64_t value = word();
                    const std::size_t size = std::min(bytes.size() - at, std::size_t(1) << below(4));
                    std::memcpy(bytes.data() + at, &value, size);
                }
            }
        }
    }

    /// Changes numbers, and sometimes numbers of numbers, of a state.
    void of_state(State& state) {
        for (std::size_t n = 1 + below(3); n > 0; --n) {
            switch (below(8)) {
                case 0:
                case 1:
                    change(state.fields[below(state.fields.size())].values, [&](float) { return number(); });
                    break;
                case 2:
                    change(state.fields[below(state.fields.size())].values,
                           [&](float x) { return x + float(below(2000)) / 100 - 10; });
                    break;
                case 3:
                    change(state.tables[below(state.tables.size())].values,
                           [&](std::int64_t) { return std::int64_t(word()); });
                    break;
                case 4:
                    change(state.tables[below(state.tables.size())].values,
                           [&](std::int64_t x) { return x + std::int64_t(below(9)) - 4; });
                    break;
                case 5:
                    change(state.parameters[below(state.parameters.size())].values,
                           [&](double x) { return below(2) == 0 ? -x : std::bit_cast<double>(word()); });
                    break;
                case 6:
                    change(state.id, [&](std::int64_t) { return std::int64_t(word()); });
                    break;
                default:
                    of_shape(state);
            }
        }
    }

private:
    template <class T, class F>
    void change(std::vector<T>& values, const F& f) {
        if (values.empty()) return;
        T& value = values[below(values.size())];
        value = f(value);
    }
    void of_shape(State& state) {
        switch (below(8)) {
            case 0:
                state.fields.erase(state.fields.begin() + std::ptrdiff_t(below(state.fields.size())));
                break;
            case 1:
                state.tables[below(state.tables.size())].values.clear();
                break;
            case 2:
                state.time = std::bit_cast<double>(word());
                break;
            case 3:
                state.step = word();
                break;
            case 4:
                state.parameters.erase(state.parameters.begin() + std::ptrdiff_t(below(state.parameters.size())));
                break;
            case 5:
            case 6:
                move(state);
                break;
            default: {  // a particle less
                if (state.size() == 0) return;
                state.id.pop_back();
                state.body.pop_back();
                for (auto& field : state.fields)
                    field.values.resize(field.values.size() - std::size_t(field.components));
            }
        }
    }

    /// A particle elsewhere, its position and its place in its block in agreement.
    void move(State& state) {
        const auto field = [&](std::string_view name) {
            return std::find_if(state.fields.begin(), state.fields.end(),
                                [&](const auto& f) { return f.name == name; });
        };
        const auto position = field("position"), place = field("place");
        const std::size_t i = below(state.size() * 2);
        if (position == state.fields.end() || place == state.fields.end() || i >= position->values.size()) return;
        const float cells = float(below(17)) - 8;
        position->values[i] += cells / 16;
        place->values[i] += cells;
    }

    std::mt19937_64 random_;
};

std::filesystem::path place() {
    const std::filesystem::path memory = "/dev/shm";
    const auto folder = std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
    return folder / ("firn_mutate_" + std::to_string(::getpid()));
}

/// Calls one(i) for 0 ≤ i < count, each of which notes outcomes, in processes of their own: a crash ends only one
/// input, and what HDF5 loses of broken files is given back. Returns how many crashed or took longer than a minute.
template <class One>
long count_outcomes(const char* title, long count, const One& one) {
    constexpr long batch = 500;
    void* const shared = ::mmap(nullptr, sizeof(Counts), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) std::abort();
    Counts& counts = *new (shared) Counts;
    long crashes = 0;
    while (counts.at < count) {
        std::fflush(nullptr);
        const pid_t child = ::fork();
        if (child < 0) std::abort();
        if (child == 0) {
            for (long n = 0; n < batch && counts.at < count; ++n) {
                const long i = counts.at++;
                ::alarm(60);
                try {
                    one(i, counts);
                } catch (const std::exception& other) {
                    std::printf("%s %ld: %s\n", title, i, other.what());
                    ++counts.outcomes[int(Outcome::other_exception)];
                }
            }
            std::fflush(nullptr);
            ::_exit(0);
        }
        int status = -1;
        ::waitpid(child, &status, 0);
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
            ++crashes;
            std::printf("%s %ld: crash, sanitizer's report or timeout (status %d)\n", title, counts.at - 1, status);
        }
    }
    std::printf("%s: %ld inputs, %ld crashes", title, count, crashes);
    for (int k = 0; k < int(Outcome::count); ++k) {
        if (counts.outcomes[k] > 0) std::printf(", %ld %s", counts.outcomes[k], names[k]);
    }
    std::printf("\n");
    const long wrong =
        crashes + counts.outcomes[int(Outcome::other_than_written)] + counts.outcomes[int(Outcome::other_exception)];
    ::munmap(shared, sizeof(Counts));
    return wrong;
}

void note(Counts& counts, Outcome outcome) { ++counts.outcomes[int(outcome)]; }

/// A seed: a state and its file.
struct Seed {
    std::variant<State, firn::State<double>> state;
    std::string bytes;
};

std::vector<Seed> state_seeds() {
    std::vector<Seed> seeds;
    const auto path = place();
    const auto add = [&](const auto& state, const firn::StateOptions& options = {}) {
        firn::write_state(path, state, options);
        seeds.push_back({state, states::bytes_of(path)});
        std::filesystem::remove(path);
    };
    auto solid = states::example<float>(3, 3);
    add(solid);
    solid.facets = {0, 1, 2};
    add(solid);
    add(states::example<double>(2, 2));
    auto smooth = states::example<float>(3, 2000);
    for (auto& field : smooth.fields) std::fill(field.values.begin(), field.values.end(), 1.0F);
    add(smooth, {.compression = 1});
    add(small_run::begun());
    return seeds;
}

template <class S>
void read_damaged(const std::filesystem::path& path, const firn::State<S>& written, Counts& counts) {
    try {
        const bool same = states::same_bits(firn::read_state<S>(path), written);
        note(counts, same ? Outcome::as_written : Outcome::other_than_written);
    } catch (const firn::error&) {
        note(counts, Outcome::refused);
    }
    try {
        const auto found = firn::read_state<S>(path, {.verify = false});
        if constexpr (std::same_as<S, float>) {
            if (small_run::goes_on_from(found)) note(counts, Outcome::goes_on);
        }
    } catch (const firn::error&) {
    }
}

long damage_state_files(long count) {
    const auto seeds = state_seeds();
    const auto path = place();
    const long wrong = count_outcomes("states' files", count, [&](long i, Counts& counts) {
        Damage damage{std::uint64_t(i)};
        const Seed& seed = seeds[damage.below(seeds.size())];
        std::string bytes = seed.bytes;
        damage.of_bytes(bytes);
        states::put_bytes(path, bytes);
        std::visit([&](const auto& state) { read_damaged(path, state, counts); }, seed.state);
    });
    std::filesystem::remove(path);
    return wrong;
}

long damage_states(long count) {
    const State whole = small_run::begun();
    const auto path = place();
    const long wrong = count_outcomes("states in memory", count, [&](long i, Counts& counts) {
        Damage damage{std::uint64_t(i)};
        State state = whole;
        damage.of_state(state);
        try {
            firn::write_state(path, state);
            const auto found = firn::read_state<float>(path);
            note(counts, states::same_bits(found, state) ? Outcome::as_written : Outcome::other_than_written);
            if (small_run::goes_on_from(found)) note(counts, Outcome::goes_on);
        } catch (const firn::error&) {
            note(counts, Outcome::refused);
        }
    });
    std::filesystem::remove(path);
    return wrong;
}

/// The files of a folder, in an order that does not depend on their names; none if there is no such folder.
std::vector<std::string> files_of(const std::filesystem::path& folder) {
    std::vector<std::string> files;
    std::error_code missing;
    for (const auto& entry : std::filesystem::directory_iterator(folder, missing))
        if (entry.is_regular_file()) files.push_back(states::bytes_of(entry.path()));
    std::sort(files.begin(), files.end());
    return files;
}

long damage_meshes(const std::vector<std::string>& seeds, long count) {
    const auto path = place();
    const long wrong = count_outcomes("OBJ files", count, [&](long i, Counts& counts) {
        Damage damage{std::uint64_t(i)};
        std::string bytes = seeds[damage.below(seeds.size())];
        damage.of_bytes(bytes);
        states::put_bytes(path, bytes);
        try {
            firn::check_mesh(firn::read_obj(path));
            note(counts, Outcome::read);
        } catch (const firn::error&) {
            note(counts, Outcome::refused);
        }
        try {
            static_cast<void>(firn::read_obj_points(path));
        } catch (const firn::error&) {
        }
    });
    std::filesystem::remove(path);
    return wrong;
}

}  // namespace

int main(int count, char** arguments) {
    const long inputs = count == 3 ? std::atol(arguments[1]) : 0;
    const std::vector<std::string> meshes = count == 3 ? files_of(arguments[2]) : std::vector<std::string>{};
    if (inputs < 1 || meshes.empty()) {
        std::fprintf(stderr, "firn_mutate COUNT SEEDS: a number above 0, and a folder of OBJ files\n");
        return 2;
    }
    const long wrong = damage_state_files(inputs) + damage_states(inputs) + damage_meshes(meshes, inputs);
    return wrong == 0 ? 0 : 1;
}
