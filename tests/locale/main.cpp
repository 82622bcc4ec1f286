/// \file firn_locale c++|c FOLDER: a program that has set a locale with a decimal comma and grouped digits writes the
/// same states, meshes, GPU programs and messages as one that has set none, and reads them. With "c++", the locale is
/// made here and is that of C++'s streams; with "c", it is one of the machine's for C's functions, or the program ends
/// with 77 (skipped).
#include <firn/firn.hpp>
#include <firn/io/background_series.hpp>
#include <firn/io/obj.hpp>
#include <firn/io/ply.hpp>
#include <firn/io/states.hpp>
#include <firn/io/usd_series.hpp>
#include <firn/wgsl/manifest.hpp>
#include <firn/wgsl/program.hpp>

#include <array>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <locale>
#include <sstream>
#include <string>
#include <vector>

using namespace firn;

namespace {

int mistakes = 0;
void require(bool holds, const std::string& what) {
    if (!holds) std::printf("Not so: %s\n", what.c_str()), ++mistakes;
}

struct Text {
    std::string what, bytes;
};

std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

template <class F>
std::string message(const F& f) {
    try {
        f();
    } catch (const error& e) {
        return e.what();
    }
    return "no error";
}

auto scene() {
    const Collider<Sphere<float, 2>> ball{.shape = {.radius = 0.125F}, .position = {0.5, 1.0 / 3}};
    return Simulation(Domain<2>{.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 32},
                      FixedCorotated<float>::from_young_poisson(12345.6, 0.3),
                      Together(Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0.3}), ball));
}

/// What firn writes, each with its name.
std::vector<Text> written(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    auto run = scene();
    run.add(sample_box<2>({0.4, 0.6}, {0.6, 0.8}, {.spacing = 1.0 / 64}), 1234.5, {0.5, -1.25});
    for (int k = 0; k < 5; ++k) run.step();
    const State<float> state = state_of(run);
    write_state(folder / "state.hdf", state);
    write_ply(folder / "state.ply", state);
    UsdSeries(folder, "stage").write(state);
    write_obj(folder / "mesh.obj", TriangleMesh{{{0.1, 1234567.5, 1e-9}, {1, 0, 0}, {0, 1, 1.0 / 3}}, {{0, 1, 2}}});
    StateSeries series(folder, "run", {});
    series.write(state);
    const wgsl::Program program = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(
        FixedCorotated<float>::from_young_poisson(12345.6, 0.3), std::get<0>(run.boundary.parts), Gravity<float, 2>{});

    // 1,001 lines, so that the number of the wrong one has a thousand.
    const auto wrong_file = folder.parent_path() / "wrong.obj";
    std::ofstream wrong(wrong_file, std::ios::binary);
    for (int i = 0; i < 1000; ++i) wrong << "v 0.5 0 0\n";
    wrong << "v 0.5 x 0\n";
    wrong.close();
    return {{"state", bytes_of(folder / "state.hdf")},
            {"PLY", bytes_of(folder / "state.ply")},
            {"OBJ", bytes_of(folder / "mesh.obj")},
            {"series", bytes_of(folder / "run.hdf.series")},
            {"USD", bytes_of(folder / "stage.usda") + bytes_of(folder / "stage_0000.usda")},
            {"WGSL", program.code},
            {"manifest", wgsl::manifest(program)},
            {"sentence", sentence("dt = ", 0.5, " s, ", 1234567, ", ", std::uint64_t(12345678901), ", ", 1.5F, ", ",
                                  1e300, ", ", -std::numeric_limits<double>::infinity())},
            {"number of particles that do not fit", message([] { require_memory(1.5e300, "It", "Take less."); })},
            {"bytes", detail::bytes_text(3758096384.0) + detail::bytes_text(512)},
            {"error of a parameter", message([] { FixedCorotated<float>::from_young_poisson(12345.5, 0.75); })},
            {"error in line 1001", message([&] { return read_obj(wrong_file); })},
            {"description of walls", run.boundary.description()}};
}

/// What it writes is read again, and a run goes on from it.
void read_again(const std::filesystem::path& folder) {
    auto whole = scene(), next = scene();
    restore(whole, read_state<float>(folder / "state.hdf"));
    restore(next, read_state<float>(folder / "run_0000.hdf"));
    for (int k = 0; k < 3; ++k) whole.step(), next.step();
    require(state_of(whole) == state_of(next), "the run goes on to the same bits");
    const auto mesh = read_obj(folder / "mesh.obj");
    require(mesh.vertices[0][0] == 0.1 && mesh.vertices[0][1] == 1234567.5, "the mesh has its coordinates");
    require(read_series(folder / "run.hdf.series")[0].time == read_state<float>(folder / "state.hdf").time,
            "the series has its time");
}

/// A decimal comma, and points between thousands.
struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
};

/// Sets a locale of C's with a decimal comma, or makes one in the folder; returns false if there is none.
bool set_comma_in_c(const std::filesystem::path& folder) {
    const std::string made = "localedef -i de_DE -f UTF-8 " + (folder / "de_DE.UTF-8").string() + " 2>/dev/null";
    const auto is_set = [] {
        for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "de_DE", "fr_FR.UTF-8"})
            if (std::setlocale(LC_ALL, name) && *std::localeconv()->decimal_point == ',') return true;
        return false;
    };
    if (is_set()) return true;
    ::setenv("LOCPATH", folder.c_str(), 1);
    return std::system(made.c_str()) == 0 && is_set();
}

}  // namespace

int main(int, char** arguments) {
    const bool in_c = arguments[1] == std::string("c");
    const std::filesystem::path folder = arguments[2];
    std::filesystem::remove_all(folder);
    const auto before = written(folder / "plain");
    if (in_c) {
        if (!set_comma_in_c(folder)) return std::puts("skipped: no locale with a decimal comma"), 77;
        std::array<char, 8> text{};
        std::snprintf(text.data(), text.size(), "%g", 0.5);
        require(text.data() == std::string("0,5"), "C writes 0,5");
    } else {
        std::locale::global(std::locale(std::locale::classic(), new Comma));
        std::ostringstream text;
        text << 1234.5;
        require(text.str() == "1.234,5", "C++ writes 1.234,5");
    }
    const auto after = written(folder / "comma");
    for (std::size_t i = 0; i < before.size(); ++i)
        if (before[i].bytes != after[i].bytes) {
            require(false, before[i].what + " has the same bytes");
            if (before[i].bytes.size() < 500) std::printf("%s\n%s\n", before[i].bytes.c_str(), after[i].bytes.c_str());
        }
    read_again(folder / "plain");
    read_again(folder / "comma");
    return mistakes;
}
