// quick: no
// sanitized: -O1
/// \file Checkpoints on disk: the gradient has the same bits as with all of them in memory, and where files fail,
/// nothing is lost.
#include "support/bring_state.hpp"
#include "support/gradient_checks.hpp"
#include "support/message.hpp"
#include "support/temporary_folder.hpp"
#include <firn/data/scratch_file.hpp>

#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>

using namespace derivatives;
using test_support::check_refused;

namespace on_disk_tests {
namespace {

using Elastic = SimulationWith<2, FixedCorotated<double>>;
constexpr double dt = 1e-3;
constexpr int steps = 41;

/// A block that is poured on, flies into a sink and falls on the floor.
Elastic made(int threads = 1, bool with_sources = true) {
    Elastic simulation(Domain<2>({0, 0}, {1, 1}, 1. / 16), jelly, Coloured{threads}, walls_of_run<2>());
    simulation.fixed_time_step = dt;
    simulation.warn = {};
    simulation.most_steps_between_sorts = 7;
    const SamplingOptions lattice{.spacing = 1. / 40};
    simulation.add(sample_box(Vec<double, 2>{0.2, 0.1}, Vec<double, 2>{0.7, 0.5}, lattice), 1000, {1, -1});
    if (!with_sources) return simulation;
    simulation.add_source({.samples = sample_box(Vec<double, 2>{0.3, 0.55}, Vec<double, 2>{0.5, 0.6}, lattice),
                           .density = 800,
                           .velocity = {0.1, -3},
                           .rate = 0.1 / dt,
                           .start = 3.3 * dt,
                           .lifespan = 25 * dt});
    simulation.add_sink({.lower = {0.68, 0}, .upper = {0.75, 0.33}});
    return simulation;
}

/// All that an adjoint of a run tells.
struct Told {
    std::vector<double> gradient;
    std::vector<std::uint32_t> repetitions;
    std::size_t checkpoints;
};
template <class Recorded>
std::vector<double> gradient_of(Recorded& adjoint) {
    const auto gradient = adjoint.gradient();
    const auto& set = gradient.set();
    std::vector<double> all{set.material.mu, set.material.lambda};
    for (const auto& x : set.position) all.insert(all.end(), {x[0], x[1]});
    for (const auto& state : set.state) all.insert(all.end(), state.F.m, state.F.m + 4);
    all.insert(all.end(), gradient.position_norm.begin(), gradient.position_norm.end());
    return all;
}
Told told(Elastic simulation, const AdjointOptions& options) {
    Adjoint adjoint(simulation, options);
    adjoint.measure_steps([](const auto& p) { return p.position[1] * p.velocity[0] * 0.1; });
    adjoint.advance(20 * dt);
    adjoint.advance((steps - 20) * dt);
    adjoint.measure(Run<Elastic>::measure);
    const std::vector<double> all = gradient_of(adjoint);
    return {all, adjoint.repetitions(), adjoint.checkpoints()};
}

/// What one state takes [bytes].
std::size_t bytes_of_state(Elastic simulation) {
    constexpr std::size_t much = std::size_t(1) << 30;
    return much / (Adjoint(simulation, {.memory = much}).checkpoints() + 1);
}

/// Lets no file become larger, as if the disk were full.
class FullDisk {
public:
    explicit FullDisk(std::size_t bytes) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        rlimit now = before_;
        now.rlim_cur = bytes;
        ::setrlimit(RLIMIT_FSIZE, &now);
    }
    ~FullDisk() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, signal_);
    }

private:
    void (*signal_)(int) = std::signal(SIGXFSZ, SIG_IGN);
    rlimit before_{};
};

/// The scratch file in a folder, which is not seen there; nothing if the system does not show it.
std::optional<std::filesystem::path> scratch_file_in(const std::filesystem::path& folder) {
    std::error_code none;
    for (const auto& open : std::filesystem::directory_iterator("/proc/self/fd", none))
        if (std::filesystem::read_symlink(open, none).string().starts_with(folder.string())) return open.path();
    return {};
}

/// A state that counts the memory in use, and how many states are elsewhere.
struct Counted {
    struct Memory {
        static inline std::size_t all = 0;
        std::size_t index = 0;
        Memory() { ++all; }
        ~Memory() { --all; }
        Memory(const Memory&) = delete;
    };
    struct Away {
        static inline std::size_t all = 0;
        std::size_t index;
        explicit Away(std::size_t of) : index(of) { ++all; }
        ~Away() { --all; }
        Away(const Away&) = delete;
    };
    std::unique_ptr<Memory> memory{};
    std::unique_ptr<Away> away{};
};

/// Takes `all` steps and goes back with checkpoints of which `most_away` have room elsewhere. \param fails  fails() is
/// asked before each one is put there: 0 it is put, 1 there is no room, 2 the disk fails
/// \param grow_at  the step at which states become larger, so that half as many have room
template <class Fails>
std::vector<int> go_back(std::size_t all, std::size_t in_memory, std::size_t most_away, const Fails& fails,
                         std::size_t grow_at = 0) {
    struct Failed {};
    const auto put = [&](Counted& state, Counted& memory) {
        if (const int how = fails(); how == 1)
            return false;
        else if (how == 2)
            throw Failed();
        REQUIRE(!memory.memory);
        state.away = std::make_unique<Counted::Away>(state.memory->index);
        REQUIRE(Counted::Away::all <= most_away + 1);
        memory.memory = std::move(state.memory);
        return true;
    };
    const auto bring_back = [&](Counted& state, Counted& memory) {
        REQUIRE(state.away);
        if (!memory.memory) memory.memory = std::make_unique<Counted::Memory>();
        state.memory = std::move(memory.memory);
        state.memory->index = state.away->index;
        state.away.reset();
    };
    Checkpoints<Counted> kept(in_memory, {most_away, put, bring_back});
    std::size_t now = 0;
    const auto store = [&](Counted& to) {
        if (!to.memory) to.memory = std::make_unique<Counted::Memory>();
        to.memory->index = now;
        REQUIRE(Counted::Memory::all <= in_memory);
    };
    const auto succeeds = [&](const auto& part) {
        try {
            part();
            return true;
        } catch (const Failed&) {
            return false;
        }
    };
    kept.keep(0, store);
    for (now = 1; now <= all; ++now) {
        if (now == grow_at) {
            in_memory = std::max<std::size_t>(2, in_memory / 2);
            succeeds([&] { kept.lower_most(in_memory, most_away / 2); });
            REQUIRE(Counted::Memory::all <= in_memory);
        }
        succeeds([&] { kept.keep(now, store); });
    }
    now = all;
    succeeds([&] { kept.finish(store); });
    std::vector<int> again(all);
    for (std::size_t wanted = all; wanted-- > 0;) {
        if (wanted == all / 3)
            succeeds([&] {
                const std::size_t first = kept.first().memory->index;
                REQUIRE(first == 0);
            });
        kept.forget_behind(wanted);
        const auto bring = [&] {
            test_support::bring_state(
                kept, now, wanted, [](const Counted& state) { return state.memory->index; }, store,
                [&](std::size_t k) { ++again[k]; });
        };
        while (!succeeds(bring)) {
        }
        REQUIRE(Counted::Memory::all <= in_memory);
    }
    return again;
}

}  // namespace

TEST_CASE("checkpoints elsewhere are as many as in memory, and those in memory are never too many", "[adjoint]") {
    const auto never = [] { return 0; };
    for (const std::size_t in_memory : {2, 3, 7, 25})
        for (const std::size_t away : {1, 2, 5, 30})
            for (const std::size_t n : {1, 2, 9, 40, 121, 500}) {
                CAPTURE(in_memory, away, n);
                CHECK(go_back(n, in_memory, away, never) == go_back(n, in_memory + away, 0, never));
            }
    CHECK(Counted::Memory::all + Counted::Away::all == 0);
    Random random(7);
    for (int k = 0; k < 300; ++k) {
        const auto up_to = [&](double most) { return std::size_t(random.uniform(0, most)); };
        const auto at_times = [&] { return random.uniform(0, 1) < 0.9 ? 0 : 1 + int(up_to(2)); };
        go_back(1 + up_to(200), 2 + up_to(9), 1 + up_to(30), at_times, up_to(150));
        go_back(1 + up_to(200), 2 + up_to(9), 1 + up_to(30), never, up_to(150));
        go_back(1 + up_to(200), 2 + up_to(9), 1 + up_to(30), [] { return 1; });
    }
}

TEST_CASE("the states that are needed last are put away", "[adjoint]") {
    std::vector<std::size_t> put;
    Checkpoints<std::size_t> kept(3, {17,
                                      [&](std::size_t& state, std::size_t&) {
                                          put.push_back(state);
                                          return true;
                                      },
                                      [](std::size_t&, std::size_t&) {}});
    for (std::size_t now = 0; now < 9; ++now) kept.keep(now, [&](std::size_t& to) { to = now; });
    CHECK(put == std::vector<std::size_t>{0, 1, 2, 3, 4, 5});
}

TEST_CASE("a gradient has the same bits with checkpoints on disk, and no step is taken again more often", "[adjoint]") {
    const TemporaryFolder folder;
    for (const bool with_sources : {false, true}) {
        const std::size_t bytes = bytes_of_state(made(1, with_sources));
        const Told all = told(made(1, with_sources), {.memory = 200 * bytes});
        CHECK(all.checkpoints > steps);
        const std::size_t little = (with_sources ? 12 : 7) * bytes / 2;  // sources make states larger
        for (const auto& [threads, disk] : {std::pair(1, std::size_t(5) << 20), std::pair(3, std::size_t(1) << 20)}) {
            CAPTURE(with_sources, threads, disk);
            const Told on_disk =
                told(made(threads, with_sources), {.memory = little, .folder = folder.path(), .disk = disk});
            CHECK(on_disk.gradient == all.gradient);
            CHECK(on_disk.checkpoints >= (disk >> 18));
            if (with_sources) continue;  // then the states in memory and those on disk are not of one size
            const Told in_memory = told(made(1, false), {.memory = (on_disk.checkpoints + 1) * (bytes + 1)});
            CHECK(in_memory.checkpoints == on_disk.checkpoints);
            CHECK(in_memory.repetitions == on_disk.repetitions);
        }
        CHECK(told(made(1, with_sources), {.memory = little}).checkpoints <= 4);
    }
    CHECK(folder.count() == 0);
}

TEST_CASE("a scratch file that was changed or cut off is noticed; its folder may be removed", "[adjoint]") {
    Elastic simulation = made();
    const AdjointOptions options{.memory = 6 * bytes_of_state(made()), .disk = 4 << 20};
    const auto attempt = [&](const auto& harm, bool is_harmless) {
        std::optional<TemporaryFolder> folder(std::in_place);
        auto with_folder = options;
        with_folder.folder = folder->path();
        Elastic own = simulation;
        Adjoint adjoint(own, with_folder);
        adjoint.advance(steps * dt);
        adjoint.measure(Run<Elastic>::measure);
        const auto file = scratch_file_in(folder->path());
        if (!file) return;  // this system does not show it
        const std::string name = folder->path();
        harm(*file, folder);
        if (is_harmless) {
            CHECK(gradient_of(adjoint)[0] != 0);
            return;
        }
        const double x = own.particles().exact_position(0)[0];
        for (int again = 0; again < 2; ++again)
            check_refused<io_error>([&] { adjoint.gradient(); }, name + "\" does not have the bytes");
        CHECK(own.particles().exact_position(0)[0] == x);
        CHECK(own.steps() == steps);
        own.step();
    };
    attempt([](const auto& file, auto&) { std::filesystem::resize_file(file, file_size(file) / 2 - 7); }, false);
    attempt(
        [](const auto& file, auto&) {
            for (std::size_t at = 4001; at < file_size(file); at += ScratchFile::page_bytes / 2) {
                std::fstream open(file, std::ios::binary | std::ios::in | std::ios::out);
                open.seekg(std::streamoff(at));
                const char byte = char(open.get());
                open.seekp(std::streamoff(at));
                open.put(char(byte ^ 16));
            }
        },
        false);
    attempt([](const auto&, auto& folder) { folder.reset(); }, true);
}

TEST_CASE("a record on disk is read as it was written, in any order, and its room is used again", "[adjoint]") {
    const TemporaryFolder folder;
    Random random(5);
    constexpr std::size_t pages = 12;
    ScratchFile file(folder.path(), pages * ScratchFile::page_bytes + 5);
    CHECK(folder.count() == 0);
    struct Kept {
        std::vector<std::vector<std::byte>> parts;
        ScratchFile::Record record;
        std::size_t pages = 0;
    };
    std::vector<Kept> all;
    std::size_t used = 0, refused = 0;
    for (int k = 0; k < 300; ++k) {
        if (!all.empty() && random.uniform(0, 1) < 0.4) {
            const auto which = all.begin() + std::ptrdiff_t(random.uniform(0, double(all.size())));
            used -= which->pages;
            all.erase(which);
            continue;
        }
        Kept one;
        std::vector<std::span<const std::byte>> parts;
        std::size_t bytes = 0;
        for (std::size_t part = 0; part < 3; ++part) {
            auto& numbers = one.parts.emplace_back(std::size_t(std::pow(random.uniform(0, 1), 4) * 300'000));
            for (std::size_t i = 0; i < numbers.size(); i += 97) numbers[i] = std::byte(random.uniform(0, 255));
            bytes += numbers.size();
        }
        for (const auto& numbers : one.parts) parts.emplace_back(numbers);
        one.pages = ScratchFile::pages_for(bytes);
        auto record = file.write(parts);
        REQUIRE(record.has_value() == (used + one.pages <= pages));
        refused += std::size_t(!record);
        if (!record) continue;
        one.record = std::move(*record);
        used += one.pages;
        all.push_back(std::move(one));
        for (const Kept& kept : all) {
            auto read = kept.parts;
            std::vector<std::span<std::byte>> to;
            for (auto& numbers : read) std::ranges::fill(numbers, std::byte(1)), to.emplace_back(numbers);
            file.read(kept.record, to);
            REQUIRE(read == kept.parts);
        }
    }
    CHECK(refused > 10);
}

TEST_CASE("what is wrong with a folder is told when the adjoint is made", "[adjoint]") {
    const TemporaryFolder folder;
    Elastic simulation = made();
    const auto refused = [&]<class Error>(const AdjointOptions& options, const std::string& why, Error) {
        check_refused<Error>([&] { Adjoint(simulation, options); }, why);
    };
    const std::string missing = folder.path() / "missing", file = folder.path() / "file";
    std::ofstream(file) << "a file";
    refused({.folder = missing, .disk = 1 << 24}, missing + "\" failed: No such file or directory", io_error(""));
    refused({.folder = file, .disk = 1 << 24}, file + "\" failed: Not a directory", io_error(""));
    refused({.folder = folder.path(), .disk = 1 << 16}, "the room of two states", parameter_error(""));
    refused({.folder = folder.path()}, "An adjoint may use 0 bytes in the folder", parameter_error(""));
    refused({.disk = 1 << 24}, "there is no folder: give one", parameter_error(""));
    CHECK(folder.count() == 1);
}

TEST_CASE("where the disk is full, the program is told, and goes on with the checkpoints that there are", "[adjoint]") {
    const TemporaryFolder folder;
    const std::size_t bytes = bytes_of_state(made());
    Elastic plain = made(), simulation = made();
    Adjoint by_memory(plain, {.memory = 200 * bytes}),
        adjoint(simulation, {.memory = 6 * bytes, .folder = folder.path(), .disk = 8 << 20});
    int failed = 0;
    const auto height = [](const auto& p) { return p.position[1]; };
    by_memory.measure_steps(height), adjoint.measure_steps(height);
    {
        const FullDisk full(700'000);
        for (int k = 0; k < steps; ++k) {
            by_memory.step();
            const std::string said = test_support::message<io_error>([&] { adjoint.step(); });
            if (test_support::holds(said, "failed: File too large. Make room there")) ++failed;
            REQUIRE(simulation.steps() == std::size_t(k + 1));
            REQUIRE(adjoint.steps() == std::size_t(k + 1));
            REQUIRE(simulation.time() == plain.time());
        }
        by_memory.measure(Run<Elastic>::measure), adjoint.measure(Run<Elastic>::measure);
        CHECK(adjoint.measured() == by_memory.measured());
        CHECK(gradient_of(adjoint) == gradient_of(by_memory));
    }
    CHECK(failed > 0);
    CHECK(failed < 5);
    CHECK(adjoint.checkpoints() < 20);
    by_memory.step(), adjoint.step();
    CHECK(gradient_of(adjoint) == gradient_of(by_memory));
}

TEST_CASE("a step that is recorded goes back though a measure of it has thrown", "[adjoint]") {
    using Ball = Collider<Sphere<double, 2>>;
    const auto by_motion = [](bool throws) {
        Ball ball;
        ball.shape.radius = 0.1;
        ball.position = {0.2, 0.05};
        ball.linear_velocity = {0.5, 0.4};
        SimulationWith<2, FixedCorotated<double>, Ball> simulation(Domain<2>({0, 0}, {1, 1}, 1. / 16), jelly, {}, ball);
        simulation.fixed_time_step = dt;
        simulation.warn = {};
        simulation.add(sample_box(Vec<double, 2>{0.2, 0.1}, Vec<double, 2>{0.4, 0.3}, {.spacing = 1. / 32}), 1000,
                       {0, -1});
        Adjoint adjoint(simulation);
        int left = throws ? 3 : 100;
        adjoint.measure_steps([&](const auto& p) {
            if (p.id == 0 && --left == 0) throw 1;
            return 0 * p.mass;
        });
        try {
            adjoint.advance((throws ? 10 : 3) * dt);
        } catch (int) {
        }
        adjoint.advance(7 * dt);
        adjoint.measure(Run<Elastic>::measure);
        const auto gradient = adjoint.gradient();
        REQUIRE(gradient.intervals.size() == 2);
        const auto& of = gradient.intervals[0].boundary;
        return std::vector<double>{of.position[0], of.position[1], of.linear_velocity[0], of.linear_velocity[1]};
    };
    const std::vector<double> whole = by_motion(false);
    CHECK(std::count(whole.begin(), whole.end(), 0.0) == 0);
    CHECK(by_motion(true) == whole);
}

TEST_CASE("two adjoints use one folder, and leave nothing in it, whatever is thrown", "[adjoint]") {
    const TemporaryFolder folder;
    const AdjointOptions options{.memory = 4 * bytes_of_state(made()), .folder = folder.path(), .disk = 4 << 20};
    Elastic one = made(), other = made(1, false);
    try {
        Adjoint first(one, options), second(other, options);
        for (int step = 0; step < 30; ++step) first.step(), second.step();
        first.measure(Run<Elastic>::measure), second.measure(Run<Elastic>::measure);
        CHECK(gradient_of(first) != gradient_of(second));
        throw 1;
    } catch (int) {
    }
    CHECK(folder.count() == 0);
    CHECK(!scratch_file_in(folder.path()));

    // check() begins at the first state, which is on disk.
    Adjoint adjoint(other, options);
    adjoint.advance(30 * dt);
    adjoint.measure(Run<Elastic>::measure);
    const auto gradient = adjoint.gradient();
    adjoint.step();
    adjoint.measure(Run<Elastic>::measure);
    const auto later = adjoint.gradient();
    auto direction = later.zero();
    for (auto& v : direction.set().velocity) v = {1, 0.5};
    const DerivativeCheck check = adjoint.check(later, direction, 1e-7);
    CHECK(check.central == Approx(check.gradient).epsilon(1e-5));
    CHECK(check.gradient != 0);
}

}  // namespace on_disk_tests
