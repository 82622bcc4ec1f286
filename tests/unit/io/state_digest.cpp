/// \file No bit of a state changes unseen between a writer and a reader.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>

#include "example_state.hpp"
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <limits>
#include <numeric>
#include <random>
#include <set>

using states::example;
using states::Folder;

namespace state_digest_tests {
namespace {

using State = firn::State<float>;

struct Outcomes {
    long refused = 0;
    long equal = 0;
    long different = 0;  ///< accepted, but not what was written
    long other = 0;      ///< an exception of another type
    std::size_t first_different = 0;
};

/// Reads the file once for each of these bits, which alone is turned. In a process of its own: a crash shows, and HDF5
/// 1.10 keeps memory after a wrong checksum, of which it complains when a process ends in the usual way.
template <class S>
Outcomes turn_bits(const std::filesystem::path& path, const firn::State<S>& written,
                   const std::vector<std::size_t>& bits) {
    int ends[2];
    REQUIRE(::pipe(ends) == 0);
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        Outcomes seen;
        const int fd = ::open(path.c_str(), O_RDWR);
        for (const std::size_t bit : bits) {
            char byte = 0;
            if (::pread(fd, &byte, 1, off_t(bit / 8)) != 1) ::_exit(1);
            const char turned = char(byte ^ (1 << (bit % 8)));
            if (::pwrite(fd, &turned, 1, off_t(bit / 8)) != 1) ::_exit(1);
            try {
                if (states::same_bits(firn::read_state<S>(path), written))
                    ++seen.equal;
                else if (seen.different++ == 0)
                    seen.first_different = bit;
            } catch (const firn::io_error&) {
                ++seen.refused;
            } catch (...) {
                ++seen.other;
            }
            if (::pwrite(fd, &byte, 1, off_t(bit / 8)) != 1) ::_exit(1);
        }
        if (!states::same_bits(firn::read_state<S>(path), written)) ::_exit(2);
        ::_exit(::write(ends[1], &seen, sizeof seen) == sizeof seen ? 0 : 1);
    }
    ::close(ends[1]);
    Outcomes seen;
    const bool whole = ::read(ends[0], &seen, sizeof seen) == sizeof seen;
    ::close(ends[0]);
    int status = -1;
    REQUIRE(::waitpid(child, &status, 0) == child);
    REQUIRE(WIFEXITED(status));
    REQUIRE(WEXITSTATUS(status) == 0);
    REQUIRE(whole);
    return seen;
}

/// One bit, any of its eight, of each `stride`-th byte.
std::vector<std::size_t> bit_of_each(std::size_t stride, const std::filesystem::path& path) {
    std::mt19937 random(1);
    std::vector<std::size_t> bits;
    for (std::size_t byte = 0; byte < std::filesystem::file_size(path); byte += stride)
        bits.push_back(byte * 8 + random() % 8);
    return bits;
}

void check_outcomes(const Outcomes& seen, std::size_t turned) {
    INFO(turned << " bits: " << seen.refused << " refused, " << seen.equal
                << " read as written; first that differs: bit " << seen.first_different);
    CHECK(seen.different == 0);
    CHECK(seen.other == 0);
    CHECK(seen.refused + seen.equal == long(turned));
    CHECK(seen.refused > long(turned) / 3);  // the rest is room for more, and what only ParaView reads
}

/// Every part of a state, each with a number or a letter that can change.
const std::vector<std::pair<const char*, std::function<void(State&)>>>& changes() {
    static const std::vector<std::pair<const char*, std::function<void(State&)>>> all = {
        {"dimension", [](State& s) { s.dimension = 2; }},
        {"step", [](State& s) { s.step ^= 1; }},
        {"time", [](State& s) { s.time = std::nextafter(s.time, 1.0); }},
        {"last_time_step", [](State& s) { s.last_time_step = -0.0; }},
        {"id", [](State& s) { s.id[2] += 1; }},
        {"ids change places", [](State& s) { std::swap(s.id[0], s.id[1]); }},
        {"body", [](State& s) { s.body[2] ^= 1 << 30; }},
        {"facets", [](State& s) { s.facets = {0, 1, 2}; }},
        {"field's name", [](State& s) { s.fields[1].name += "'"; }},
        {"field's unit", [](State& s) { s.fields[1].unit = "m"; }},
        {"field's shape", [](State& s) { s.fields[2].components = 3; }},
        {"field's values", [](State& s) { s.fields[2].values.back() += 1; }},
        {"field's sign of zero", [](State& s) { s.fields[3].values[0] = -0.0F; }},
        {"fields change values", [](State& s) { std::swap(s.fields[2].values, s.fields[3].values); }},
        {"field less", [](State& s) { s.fields.pop_back(); }},
        {"parameter's group", [](State& s) { s.parameters[0].group = "grid"; }},
        {"parameter's name", [](State& s) { s.parameters[0].name = "joung"; }},
        {"parameter's unit", [](State& s) { s.parameters[0].unit = "kPa"; }},
        {"parameter's value", [](State& s) { s.parameters[0].values[0] += 1; }},
        {"letter from group to name",
         [](State& s) { s.parameters[0].group = "materialy", s.parameters[0].name = "oung"; }},
        {"attribute's name", [](State& s) { s.attributes[0].name = "t"; }},
        {"attribute's value", [](State& s) { s.attributes[2].value = "x"; }},
        {"attributes change values", [](State& s) { std::swap(s.attributes[0].value, s.attributes[1].value); }},
        {"table's name", [](State& s) { s.tables[0].name = "slots"; }},
        {"table's columns", [](State& s) { s.tables[1].columns = 4; }},
        {"table's values", [](State& s) { s.tables[0].values[2] ^= 1; }},
    };
    return all;
}

State with_facets() {
    auto state = example<float>(2, 3);
    state.facets = {0, 1, 2, 0};
    return state;
}

State to_be_changed() {
    auto state = example<float>(3, 6);
    state.last_time_step = 0;
    state.fields[3].values[0] = 0;
    return state;
}

/// The state as an earlier schema_version had it: without a digest, and before 3 with other names.
void make_old(const std::filesystem::path& path, std::int64_t schema) {
    const firn::hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
    const firn::hdf5::Group group(H5Gopen2(file.id(), "/firn", H5P_DEFAULT), "open");
    if (H5Aexists(group.id(), "digest") > 0) H5Adelete(group.id(), "digest");
    const firn::hdf5::Attribute version(H5Aopen(group.id(), "schema_version", H5P_DEFAULT), "open");
    H5Awrite(version.id(), H5T_NATIVE_INT64, &schema);
    const auto rename = [&](const char* now, const char* then) {
        if (schema < 3) H5Lmove(file.id(), now, H5L_SAME_LOC, then, H5P_DEFAULT, H5P_DEFAULT);
    };
    rename("/VTKHDF/PointData/body", "/VTKHDF/PointData/material");
    rename("/VTKHDF/FieldData/last_time_step", "/VTKHDF/FieldData/dt");
}

template <class S>
std::string refusal(const std::filesystem::path& path) {
    return states::message<firn::io_error>([&] { return firn::read_state<S>(path); });
}

}  // namespace

TEST_CASE("Whichever bit of a state's file is turned, the state is refused or read as it was written", "[io][state]") {
    const Folder folder;
    const auto path = folder / "a.hdf";
    SECTION("with facets, a bit of each byte") {
        const auto state = with_facets();
        firn::write_state(path, state);
        const auto bits = bit_of_each(test_support::fewer_if_slow(1, 11), path);
        check_outcomes(turn_bits(path, state, bits), bits.size());
    }
    SECTION("with arrays that are placed, a bit of each of many bytes") {
        const auto state = example<double>(3, 3700);
        firn::write_state(path, state);
        const auto bits = bit_of_each(test_support::fewer_if_slow(331, 3331), path);
        check_outcomes(turn_bits(path, state, bits), bits.size());
    }
    SECTION("compressed, a bit of each of many bytes") {
        auto state = example<float>(3, 1500);
        for (auto& field : state.fields) std::iota(field.values.begin(), field.values.end(), 1.0F);
        firn::write_state(path, state, {.compression = 1});
        const auto bits = bit_of_each(test_support::fewer_if_slow(17, 101), path);
        check_outcomes(turn_bits(path, state, bits), bits.size());
    }
}
TEST_CASE("The same for each bit of a file", "[io][state][.full]") {
    const Folder folder;
    const auto state = with_facets();
    firn::write_state(folder / "a.hdf", state);
    std::vector<std::size_t> bits(std::filesystem::file_size(folder / "a.hdf") * 8);
    std::iota(bits.begin(), bits.end(), std::size_t(0));
    check_outcomes(turn_bits(folder / "a.hdf", state, bits), bits.size());
}

TEST_CASE("A state whose values were changed is refused with what to do, and can be looked at", "[io][state]") {
    const Folder folder;
    const auto path = folder / "changed.hdf";
    const auto state = example<float>(3, 4);
    firn::write_state(path, state);
    {
        const firn::hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
        const firn::hdf5::Dataset mass(H5Dopen2(file.id(), "/VTKHDF/PointData/mass", H5P_DEFAULT), "open");
        const float values[4] = {1, 2, 3, 4};
        H5Dwrite(mass.id(), H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
    }
    const auto message = refusal<float>(path);
    INFO(message);
    CHECK(states::holds(message, path.string()));
    CHECK(states::holds(message, "bits have changed since it was written. Use an earlier state"));
    CHECK(states::holds(message, "verify = false"));
    const auto found = firn::read_state<float>(path, {.verify = false});
    CHECK(found.field("mass").values == std::vector<float>{1, 2, 3, 4});
    CHECK(found.id == state.id);
}

TEST_CASE("States of schema_version 1, which have no digest, are read; one of version 2 without is refused",
          "[io][state]") {
    const Folder folder;
    const auto path = folder / "old.hdf";
    const auto state = example<double>(2, 5);
    firn::write_state(path, state);
    make_old(path, 1);
    CHECK(states::same_bits(firn::read_state<double>(path), state));
    firn::write_state(path, state);
    make_old(path, 2);
    CHECK(states::holds(refusal<double>(path), "it has no digest"));
    CHECK(states::same_bits(firn::read_state<double>(path, {.verify = false}), state));
    firn::write_state(path, state);
    make_old(path, 6);
    CHECK(states::holds(refusal<double>(path), "schema_version is 6; this firn reads 1 to 5"));
}

TEST_CASE("Any change of a state changes its digest", "[io][state]") {
    std::set<std::uint64_t> digests{firn::digest(to_be_changed())};
    for (const auto& [what, change] : changes()) {
        auto state = to_be_changed();
        change(state);
        INFO(what);
        CHECK(digests.insert(firn::digest(state)).second);
    }
    auto more_precise = example<double>(3, 0);
    CHECK(firn::digest(more_precise) != firn::digest(example<float>(3, 0)));
}

TEST_CASE("A digest does not depend on the order of what has names", "[io][state]") {
    auto state = example<float>(3, 6);
    const auto before = firn::digest(state);
    std::reverse(state.fields.begin(), state.fields.end());
    std::reverse(state.parameters.begin(), state.parameters.end());
    std::reverse(state.attributes.begin(), state.attributes.end());
    std::reverse(state.tables.begin(), state.tables.end());
    CHECK(firn::digest(state) == before);
    const Folder folder;
    firn::write_state(folder / "turned.hdf", state);
    CHECK(firn::digest(firn::read_state<float>(folder / "turned.hdf")) == before);
}

TEST_CASE("A file's digest is of the fields that it holds", "[io][state]") {
    const Folder folder;
    for (const std::vector<std::string>& fields : {std::vector<std::string>{}, {"mass"}, {"position", "velocity"}}) {
        const auto state = example<float>(2, 9);
        firn::write_state(folder / "a.hdf", state, {.fields = fields});
        CHECK_NOTHROW(firn::read_state<float>(folder / "a.hdf"));
    }
}

TEST_CASE("A digest is the same on every machine and with every compiler", "[io][state]") {
    // Made by this library; they must not change, or files could no longer be verified.
    CHECK(firn::digest(example<float>(3, 100)) == 0xb22756c51d6cb580);
    CHECK(firn::digest(example<double>(2, 100)) == 0x700bcc597f018521);
    // Of the sanity tests of xxHash 0.8 (XXH3_64bits of no byte).
    CHECK(firn::detail::hash_bytes({}) == 0x2d06800538d394c2);
    // A machine of the other byte order hashes the bytes of this one.
    const std::vector<std::int32_t> numbers{1, -2, 0x01020304}, turned{0x01000000, int(0xfeffffff), 0x04030201};
    CHECK(firn::detail::hash_numbers<std::endian::big>(std::as_bytes(std::span(turned)), 4) ==
          firn::detail::hash_numbers<std::endian::little>(std::as_bytes(std::span(numbers)), 4));
}

}  // namespace state_digest_tests
