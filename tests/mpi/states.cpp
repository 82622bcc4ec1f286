// ranks: 3
// more_ranks: 1 2 4
// threads: 1
/// \file A state whose particles are on many ranks makes the same file as one that one process holds, and is read back
/// on any number of ranks.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/mpi.hpp>
#include <firn/mpi/states.hpp>

#include "shared_folder.hpp"
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <random>
#include <set>

using namespace firn;

namespace mpi_states {
namespace {

std::set<std::string> names_in(const SharedFolder& folder) {
    std::set<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) found.insert(entry.path().filename());
    return found;
}

/// Bits of numbers from a seed. The numbers are finite, and many are −0.
template <class S>
S any_number(std::uint64_t seed, std::uint64_t index) {
    const std::uint64_t bits = random_bits(seed, index);
    return bits % 7 == 0 ? S(-0.0) : S(std::ldexp(double(std::int64_t(bits)), -40));
}

/// Which particle is where in a state of `count` particles in `blocks` blocks: their ids, and in which order they lie
/// along the curve.
struct Layout {
    std::vector<std::int64_t> id;        ///< ids, ascending
    std::vector<std::size_t> at;         ///< for each slot, the index in `id` of its particle
    std::vector<std::size_t> block_end;  ///< for each block, one past its last slot
};
Layout layout(std::size_t count, std::size_t blocks, std::int64_t id_step, unsigned seed) {
    Layout made;
    std::mt19937 random(seed);
    std::int64_t id = id_step > 1 ? -5 : 0;
    for (std::size_t i = 0; i < count; ++i) {
        made.id.push_back(id);
        id += id_step > 1 ? 1 + std::int64_t(random() % std::uint64_t(id_step)) : 1;
    }
    made.at.resize(count);
    std::iota(made.at.begin(), made.at.end(), std::size_t(0));
    // Neighbours in space mostly have neighbouring ids, but some are far away.
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t other = random() % 4 ? std::min(count - 1, i + random() % 50) : random() % count;
        std::swap(made.at[i], made.at[other]);
    }
    for (std::size_t b = 0; b < blocks; ++b) made.block_end.push_back(count * (b + 1) / blocks);
    return made;
}

/// The part of a state that has the blocks [first, last) of the layout; 0 and all blocks: the whole state.
template <class S>
State<S> part_of(const Layout& layout, int dimension, std::size_t first, std::size_t last) {
    const auto D = std::size_t(dimension);
    State<S> state;
    state.dimension = dimension;
    state.step = 12345;
    state.time = 0.7;
    state.last_time_step = 1.0 / 3e4;
    state.fields = {{"position", "m", dimension, {}},
                    {"velocity", "m/s", dimension, {}},
                    {"mass", "kg", 1, {}},
                    {"deformation_gradient", "1", dimension * dimension, {}},
                    {"a pair", "µm", 2, {}}};
    state.parameters = {{"material", "young", "Pa", {1e3}}, {"grid", "lower", "m", {-1, 0, 0.5}}};
    state.attributes = {{"transfer", "APIC"}, {"note", ""}};
    state.tables = {{"slot", 1, {}}, {"blocks", dimension + 2, {}}, {"bodies", 3, {1, 2, 3}}};
    const std::size_t begin = first == 0 ? 0 : layout.block_end[first - 1],
                      end = last == 0 ? 0 : layout.block_end[last - 1];
    std::vector<std::pair<std::size_t, std::size_t>> rows;  // index and slot
    for (std::size_t slot = begin; slot < end; ++slot) rows.push_back({layout.at[slot], slot - begin});
    std::sort(rows.begin(), rows.end());
    for (const auto& [i, slot] : rows) {
        state.id.push_back(layout.id[i]);
        state.body.push_back(std::int32_t(i % 3));
        state.tables[0].values.push_back(std::int64_t(slot));
        for (std::size_t f = 0; f < state.fields.size(); ++f)
            for (std::size_t c = 0; c < std::size_t(state.fields[f].components); ++c)
                state.fields[f].values.push_back(any_number<S>(10 * f + c, i));
    }
    std::size_t start = begin;
    for (std::size_t b = first; b < last; ++b) {
        for (std::size_t a = 0; a < D; ++a) state.tables[1].values.push_back(a + 1 == D ? std::int64_t(2 * b) : 0);
        state.tables[1].values.push_back(std::int64_t(start - begin));
        state.tables[1].values.push_back(std::int64_t(layout.block_end[b] - start));
        start = layout.block_end[b];
    }
    return state;
}

/// The block with which a rank's part begins: ranks have different numbers of particles, and one has none.
std::size_t first_block(int rank, int size, std::size_t blocks) {
    if (rank == 0) return 0;
    if (rank == size) return blocks;
    if (size > 2 && rank == 2) return first_block(1, size, blocks);  // rank 1 has nothing
    return blocks * std::size_t(rank) * std::size_t(rank) / std::size_t(size * size);
}
template <class S>
State<S> my_part(const mpi::Communicator& all, const Layout& layout, int dimension) {
    const std::size_t blocks = layout.block_end.size();
    return part_of<S>(layout, dimension, first_block(all.rank(), all.size(), blocks),
                      first_block(all.rank() + 1, all.size(), blocks));
}

/// Bits of states, apart from the tables and the order of fields.
template <class S>
bool same_rows(const State<S>& a, const State<S>& b) {
    const auto same = [](const StateField<S>& f, const StateField<S>& g) {
        return f.name == g.name && f.unit == g.unit && f.components == g.components &&
               f.values.size() == g.values.size() &&
               (f.values.empty() || std::memcmp(f.values.data(), g.values.data(), f.values.size() * sizeof(S)) == 0);
    };
    return a.id == b.id && a.body == b.body && a.tables[0] == b.tables[0] &&
           std::equal(a.fields.begin(), a.fields.end(), b.fields.begin(), b.fields.end(), same);
}

template <class S>
void check_file(int dimension, std::size_t count, std::size_t blocks, std::int64_t id_step,
                const StateOptions& options) {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    const Layout made = layout(count, blocks, id_step, 17);
    const State<S> whole = part_of<S>(made, dimension, 0, blocks);
    if (all.rank() == 0) write_state(folder / "serial.hdf", whole, options);
    mpi::write_state(all, folder / "ranks.hdf", my_part<S>(all, made, dimension), options);
    INFO(dimension << "D, " << count << " particles, " << blocks << " blocks, ids " << id_step << ", compression "
                   << options.compression);
    if (options.compression == 0)
        CHECK(bytes_of(folder / "ranks.hdf") == bytes_of(folder / "serial.hdf"));
    else
        CHECK((read_state<S>(folder / "ranks.hdf") == read_state<S>(folder / "serial.hdf")));
    CHECK(names_in(folder) == std::set<std::string>{"serial.hdf", "ranks.hdf"});

    const State<S> back = mpi::read_state<S>(all, folder / "ranks.hdf");
    const State<S> serial = read_state<S>(folder / "serial.hdf");
    const std::uint64_t first = all.sum_before(std::uint64_t(back.size()));
    CHECK(all.sum(std::uint64_t(back.size())) == count);
    CHECK(back.size() <= count / std::uint64_t(all.size()) + 1);
    State<S> expected = serial;
    const auto cut = [&](auto& values, std::size_t columns) {
        using Values = std::remove_reference_t<decltype(values)>;
        const auto begin = values.begin() + std::ptrdiff_t(first * columns);
        values = Values(begin, begin + std::ptrdiff_t(back.size() * columns));
    };
    cut(expected.id, 1);
    cut(expected.body, 1);
    cut(expected.tables[0].values, 1);
    for (auto& field : expected.fields) cut(field.values, std::size_t(field.components));
    CHECK(same_rows(back, expected));
    CHECK(back.tables[2] == expected.tables[2]);
    CHECK(all.sum(std::uint64_t(back.tables[1].values.size())) == serial.tables[1].values.size());
    CHECK(back.parameters == expected.parameters);
    CHECK(back.attributes == expected.attributes);
    CHECK(back.time == expected.time);
    CHECK(back.step == expected.step);
}

}  // namespace

TEST_CASE("A state has the bytes of one that was written without MPI: small and large arrays") {
    check_file<float>(3, 1000, 30, 1, {});
    check_file<float>(3, 70'001, 900, 1, {});    // some arrays are placed, some go through HDF5
    check_file<double>(3, 40'000, 8000, 1, {});  // the table of blocks is placed, too
}
TEST_CASE("A state has the bytes of one that was written without MPI: 2D, sparse ids") {
    check_file<float>(2, 50'000, 700, 1000, {});
    check_file<double>(2, 33'333, 700, std::int64_t(1) << 40, {});
}
TEST_CASE("A state has the bytes of one that was written without MPI: few or no particles") {
    for (const std::size_t count : {0, 1, 2, 3, 5}) check_file<float>(3, count, count, 10, {});
}
TEST_CASE("A state has the bytes of one that was written without MPI: selected fields") {
    check_file<float>(3, 70'000, 900, 5, {.fields = {"mass", "a pair"}});
}
TEST_CASE("A compressed state has the fields and the digest of one that was written without MPI") {
    check_file<float>(3, 70'000, 900, 5, {.compression = 1});
    check_file<double>(2, 90'000, 900, 1, {.compression = 3});
    check_file<float>(3, 100, 9, 1, {.compression = 1});
}

TEST_CASE("Ranks whose states do not fit together are refused on all ranks, and no file is left") {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    const Layout made = layout(500, 20, 3, 5);
    const auto refused = [&](const char* word, const auto& damage, auto error) {
        State<float> mine = my_part<float>(all, made, 3);
        damage(mine);
        const std::string said =
            test_support::message<decltype(error)>([&] { mpi::write_state(all, folder / "wrong.hdf", mine); });
        UNSCOPED_INFO(said << " | " << word);
        CHECK(test_support::holds(said, word));
        CHECK(all.text_of(0, said) == said);
        all.barrier();
        CHECK(names_in(folder).empty());
    };
    const int last = all.size() - 1;
    using Wrong = parameter_error;
    const auto unordered = [&](State<float>& s) {
        if (all.rank() == last) std::swap(s.id[0], s.id[1]);
    };
    refused(all.size() > 1 ? ("Rank " + std::to_string(last) + " of").c_str() : "ids", unordered, Wrong(""));
    refused("ascending", unordered, Wrong(""));
    refused(
        "facets",
        [&](auto& s) {
            s.facets = {0, 0, 0};
            if (s.size() == 0) s.facets.clear();
        },
        usage_error(""));
    refused(
        "'slot'",
        [&](auto& s) {
            if (all.rank() == last) s.tables[0].values.push_back(0);
        },
        Wrong(""));
    if (all.size() == 1) return;
    refused(
        "differ in more",
        [&](auto& s) {
            if (all.rank() == last) s.time += 1;
        },
        Wrong(""));
    refused(
        "differ in more",
        [&](auto& s) {
            if (all.rank() == last) std::swap(s.fields[1], s.fields[2]);
        },
        Wrong(""));
    refused(
        "differ in more",
        [&](auto& s) {
            if (all.rank() == last) s.parameters[0].values[0] = 2;
        },
        Wrong(""));
    const std::int64_t twice = made.id[250];
    refused(
        "id",
        [&](auto& s) {
            // Every rank that has particles claims the same id.
            if (s.size() == 0) return;
            const auto place = std::lower_bound(s.id.begin(), s.id.end(), twice);
            (place == s.id.end() ? s.id.back() : *place) = twice;
        },
        Wrong(""));
}

TEST_CASE("A folder that is missing or cannot be written is named in one error on all ranks") {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    const State<float> mine = my_part<float>(all, layout(500, 20, 3, 5), 3);
    const std::string said =
        test_support::message<io_error>([&] { mpi::write_state(all, folder / "missing/state.hdf", mine); });
    CHECK(test_support::holds(said, "No such file or directory"));
    CHECK(all.text_of(0, said) == said);
    const std::string unread =
        test_support::message<io_error>([&] { return mpi::read_state<float>(all, folder / "missing/state.hdf"); });
    CHECK(test_support::holds(unread, "could not open it"));
}

TEST_CASE("A rank whose writes fail is named on all ranks, and the old file stays") {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    const Layout made = layout(90'000, 900, 1, 5);
    const State<float> mine = my_part<float>(all, made, 3);
    mpi::write_state(all, folder / "state.hdf", mine);
    const std::string before = bytes_of(folder / "state.hdf");
    std::signal(SIGXFSZ, SIG_IGN);
    for (int failing = 0; failing < all.size(); ++failing) {
        rlimit limit{}, none{};
        ::getrlimit(RLIMIT_FSIZE, &none);
        limit = none;
        limit.rlim_cur = 1'000'000;
        if (all.rank() == failing) ::setrlimit(RLIMIT_FSIZE, &limit);
        State<float> later = mine;
        later.step += 1;
        const std::string said =
            test_support::message<io_error>([&] { mpi::write_state(all, folder / "state.hdf", later); });
        ::setrlimit(RLIMIT_FSIZE, &none);
        UNSCOPED_INFO(said);
        CHECK(test_support::holds(said, "File too large"));
        if (all.size() > 1) CHECK(test_support::holds(said, "Rank " + std::to_string(failing) + " of "));
        CHECK(all.text_of(0, said) == said);
        all.barrier();
        CHECK(bytes_of(folder / "state.hdf") == before);
        CHECK(names_in(folder) == std::set<std::string>{"state.hdf"});
        all.barrier();
    }
    std::signal(SIGXFSZ, SIG_DFL);
}

TEST_CASE("A file that is removed while it is written is missed by all ranks") {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    mpi::detail::SharedFile file(all, folder / "state.hdf");
    mpi::detail::Outcome outcome(all);
    const std::byte byte{7};
    outcome.attempt([&] { file.write(std::uint64_t(all.rank()), std::span(&byte, 1)); });
    all.barrier();
    if (all.rank() == 0)
        for (const std::string& name : names_in(folder)) std::filesystem::remove(folder / name);
    all.barrier();
    const std::string said = test_support::message<io_error>([&] { file.commit(outcome); });
    CHECK(test_support::holds(said, "Renaming"));
    CHECK(all.text_of(0, said) == said);
    CHECK(names_in(folder).empty());
}

TEST_CASE("Damage to a file is found by all ranks, wherever it is") {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    const Layout made = layout(70'000, 900, 1, 5);
    mpi::write_state(all, folder / "state.hdf", my_part<float>(all, made, 3));
    const std::string good = bytes_of(folder / "state.hdf");
    for (const double at : {0.3, 0.5, 0.7, 0.9}) {
        all.barrier();
        if (all.rank() == 0) {
            std::string bad = good;
            bad[std::size_t(at * double(bad.size()))] ^= 4;
            std::ofstream(folder / "bad.hdf", std::ios::binary).write(bad.data(), std::streamsize(bad.size()));
        }
        all.barrier();
        const std::string said =
            test_support::message<io_error>([&] { return mpi::read_state<float>(all, folder / "bad.hdf"); });
        UNSCOPED_INFO(said << " at " << at);
        CHECK(test_support::holds(said, "does not match its digest"));
        CHECK_NOTHROW(mpi::read_state<float>(all, folder / "bad.hdf", {.verify = false}));
    }
    all.barrier();
    if (all.rank() == 0) std::filesystem::resize_file(folder / "bad.hdf", good.size() / 2);
    all.barrier();
    CHECK_THROWS_AS(mpi::read_state<float>(all, folder / "bad.hdf"), io_error);
    const std::string said =
        test_support::message<io_error>([&] { return mpi::read_state<double>(all, folder / "state.hdf"); });
    CHECK(test_support::holds(said, "read it with read_state<float>"));
}

TEST_CASE("A series on ranks has the files and the list of one without MPI") {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    const Layout made = layout(3000, 90, 1, 5);
    const StateOptions options{.fields = {"mass"}, .complete_every = 2};
    const State<float> whole = part_of<float>(made, 3, 0, 90), mine = my_part<float>(all, made, 3);
    const auto at = [](State<float> state, double time) {
        state.time = time;
        return state;
    };
    mpi::StateSeries series(all, folder / "ranks", "run", options);
    for (int i = 0; i < 4; ++i) CHECK(series.write(at(mine, i)).filename() == "run_000" + std::to_string(i) + ".hdf");
    CHECK(series.size() == 4);
    mpi::StateSeries more(all, folder / "ranks", "run", options);
    more.go_on_from(1);
    CHECK(more.size() == 2);
    for (int i = 0; i < 3; ++i) more.write(at(mine, 1.25 + i));
    CHECK(more.size() == 5);
    if (all.rank() == 0) {
        StateSeries one(folder / "serial", "run", options);
        for (int i = 0; i < 4; ++i) one.write(at(whole, i));
        one.go_on_from(1);
        for (int i = 0; i < 3; ++i) one.write(at(whole, 1.25 + i));
        for (const auto& entry : std::filesystem::directory_iterator(folder / "serial")) {
            INFO(entry.path());
            CHECK(bytes_of(entry.path()) == bytes_of(folder / "ranks" / entry.path().filename()));
        }
    }
    // A state that cannot be written leaves the series as it was, and the next one takes its place.
    State<float> wrong = mine;
    wrong.facets = {0, 0, 0};
    if (wrong.size() == 0) wrong.facets.clear();
    CHECK_THROWS_AS(more.write(wrong), usage_error);
    CHECK(more.size() == 5);
    CHECK(more.write(at(mine, 9)).filename() == "run_0005.hdf");
    all.barrier();
    CHECK_THROWS_AS(mpi::StateSeries(all, folder / "ranks", "a/b"), parameter_error);
    CHECK_THROWS_AS(mpi::StateSeries(all, folder / "ranks/run_0000.hdf", "a"), io_error);
    all.barrier();
    // The list cannot be written, because a folder has its name: rank 0 alone notices.
    mpi::StateSeries blocked(all, folder / "blocked", "run");
    if (all.rank() == 0) std::filesystem::create_directories(folder / "blocked/run.hdf.series/x");
    all.barrier();
    CHECK_THROWS_AS(blocked.write(mine), io_error);
    CHECK(blocked.size() == 0);
    all.barrier();
    CHECK(!std::filesystem::exists(folder / "blocked/run_0000.hdf"));
}

}  // namespace mpi_states
