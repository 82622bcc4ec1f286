/// \file Who writes first to the memory of particles, nodes and points: the workers whose shares it is. A machine whose
/// processors have memory of their own puts each page where it is first written.
///
/// Aligned memory of some size is given out without access. Whoever touches a page first gets a signal, whose handler
/// notes the thread and allows access.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/lagrangian.hpp>

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <new>
#include <string>
#include <vector>

using namespace firn;

namespace {

constexpr std::size_t page_bytes = 4096, least_bytes = 64 * page_bytes;

/// Memory that is watched.
struct Piece {
    std::atomic<std::uintptr_t> begin = 0;
    std::size_t pages = 0;
    std::atomic<std::uint8_t>* writer = nullptr;  ///< of each page: 0 none, 1 the caller, 2 a helper
};
constexpr std::size_t most_pieces = 4096;
Piece pieces[most_pieces];
std::atomic<std::size_t> piece_count = 0;
std::atomic<bool> is_watching = false;
thread_local bool is_caller = false;

void note_writer(int, siginfo_t* info, void*) {
    const auto address = reinterpret_cast<std::uintptr_t>(info->si_addr);
    for (std::size_t p = 0; p < piece_count; ++p) {
        const std::uintptr_t begin = pieces[p].begin;
        if (address < begin || address >= begin + pieces[p].pages * page_bytes) continue;
        const std::size_t page = (address - begin) / page_bytes;
        std::uint8_t none = 0;
        pieces[p].writer[page].compare_exchange_strong(none, is_caller ? 1 : 2);
        ::mprotect(reinterpret_cast<void*>(begin + page * page_bytes), page_bytes, PROT_READ | PROT_WRITE);
        return;
    }
    std::signal(SIGSEGV, SIG_DFL);  // a real one
}

void* map(std::size_t bytes, int access) {
    void* memory = ::mmap(nullptr, bytes, access, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    return memory;
}

std::size_t pages_of(std::size_t bytes) { return (bytes + page_bytes - 1) / page_bytes; }

/// Watches what is allocated while it lives, on the calling thread or its helpers.
struct Watch {
    Watch() {
        struct sigaction action{};
        action.sa_sigaction = note_writer;
        action.sa_flags = SA_SIGINFO;
        sigaction(SIGSEGV, &action, &before);
        is_caller = is_watching = true;
        first = piece_count;
    }
    ~Watch() {
        is_watching = false;
        sigaction(SIGSEGV, &before, nullptr);
    }
    struct sigaction before{};
    std::size_t first = 0;
};

/// Pieces that were not written in two halves, or, where fields lie one after another, in two halves of each: as
/// sentences.
std::string wrongly_shared(const Watch& watch, std::size_t& seen) {
    std::string text;
    seen = 0;
    for (std::size_t p = watch.first; p < piece_count; ++p) {
        std::array<std::size_t, 3> count{};
        std::size_t turns = 0;
        std::uint8_t last = 0;
        for (std::size_t page = 0; page < pieces[p].pages; ++page) {
            const std::uint8_t writer = pieces[p].writer[page];
            ++count[writer];
            turns += writer != last;
            last = writer;
        }
        const std::size_t written = count[1] + count[2];
        if (written < 70) continue;
        ++seen;
        constexpr std::size_t most_fields = 10;
        if (100 * count[1] < 45 * written || 100 * count[2] < 45 * written || turns > 2 * most_fields)
            text += sentence("piece ", p, " of ", pieces[p].pages, " pages: ", count[1], " by the caller, ", count[2],
                             " by the helper, ", turns, " turns; ");
    }
    return text;
}

template <class Run>
void check_shared(const Run& run, std::size_t least_seen) {
    detail::longest_wait_for_owner = 20;  // this machine may be busy with other tests
    std::size_t seen = 0;
    const Watch watch;
    run();
    CHECK(wrongly_shared(watch, seen) == "");
    CHECK(seen >= least_seen);
}

}  // namespace

void* operator new(std::size_t bytes, std::align_val_t alignment) {
    const std::size_t pages = pages_of(bytes);
    if (bytes < least_bytes) {
        if (void* memory = std::aligned_alloc(std::size_t(alignment), (bytes + 63) / 64 * 64)) return memory;
        throw std::bad_alloc();
    }
    // Aligned as a large page. What lies before and after is left: addresses are not memory.
    const std::size_t align = std::max(std::size_t(alignment), page_bytes);
    const auto start = reinterpret_cast<std::uintptr_t>(map(pages * page_bytes + align, PROT_NONE));
    const std::uintptr_t begin = (start + align - 1) / align * align;
    const std::size_t p = piece_count;
    if (is_watching && p < most_pieces) {
        pieces[p].pages = pages;
        pieces[p].writer = static_cast<std::atomic<std::uint8_t>*>(map(pages, PROT_READ | PROT_WRITE));
        pieces[p].begin = begin;
        piece_count = p + 1;
    } else {
        ::mprotect(reinterpret_cast<void*>(begin), pages * page_bytes, PROT_READ | PROT_WRITE);
    }
    return reinterpret_cast<void*>(begin);
}
void operator delete(void* memory, std::align_val_t) noexcept {
    const auto begin = reinterpret_cast<std::uintptr_t>(memory);
    for (std::size_t p = 0; p < piece_count; ++p)
        if (pieces[p].begin == begin) {
            ::madvise(memory, pieces[p].pages * page_bytes, MADV_DONTNEED);  // its addresses are not given out again
            return;
        }
    if (begin % page_bytes != 0) std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t alignment) noexcept {
    operator delete(memory, alignment);
}

TEST_CASE("The fields of particles and nodes are first written by the workers whose shares they are") {
    const Domain<3> box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 64};
    const auto cube = sample_box<3>({0.2, 0.2, 0.2}, {0.7, 0.7, 0.7}, {.spacing = 1.0 / 128});
    const auto jelly = FixedCorotated<float>::from_young_poisson(1e4, 0.3);
    SECTION("APIC") {
        check_shared(
            [&] {
                Simulation<3> simulation(box, jelly, Coloured{2});
                simulation.most_steps_between_sorts = 2;
                simulation.add(cube, 1000.0, {1.0, 0.0, 0.5});
                simulation.fixed_time_step = 1e-4;
                simulation.advance(4e-4);
            },
            5);
    }
    SECTION("integers, and transfers that keep layers of nodes and velocities") {
        check_shared(
            [&] {
                Simulation<3, FixedCorotated<float>, Fmpm, MlsForce, QuadraticBSpline, ColouredFixedPoint<std::int32_t>>
                    simulation(box, jelly, {2});
                simulation.transfer.order = 2;
                simulation.add(cube, 1000.0, {1.0, 0.0, 0.5});
                simulation.fixed_time_step = 1e-4;
                simulation.advance(2e-4);
            },
            7);
    }
}

TEST_CASE("The fields of a particle system are first written by the workers whose shares they are") {
    const auto sheet = cloth({0.0, 1.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, {250, 250});
    check_shared(
        [&] {
            ParticleSystem<3> system;
            system.threads = 2;
            system.add(sheet, {.mass = 1e-4, .radius = 1e-3});
            system.constraints.add(sheet);
            system.add_force(aerodynamic_surface_of<float>(sheet, {.wind = {3, 0, 1}}));
            system.collisions.emplace();
            system.advance(2e-3, 1e-3);
        },
        10);
}
