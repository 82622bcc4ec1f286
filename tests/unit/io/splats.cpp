/// \file Gaussian splats: the properties of the format in their order, and covariances that are F Σ₀ Fᵀ.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/io/splats.hpp>

#include "example_state.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

using firn::Mat;
using firn::Vec;
using states::Folder;

namespace splats_tests {

namespace {

struct Read {
    std::string header;
    std::vector<std::vector<float>> rows;
};

/// A PLY file of floats only.
Read read_floats(const std::filesystem::path& path) {
    static_assert(std::endian::native == std::endian::little);
    const std::string all = states::bytes_of(path);
    const std::size_t end = all.find("end_header\n") + 11;
    Read read{all.substr(0, end), {}};
    std::size_t columns = 0;
    for (std::size_t at = 0; (at = read.header.find("property float ", at)) != std::string::npos; ++at) ++columns;
    REQUIRE((all.size() - end) % (4 * columns) == 0);
    for (std::size_t at = end; at < all.size(); at += 4 * columns) {
        read.rows.emplace_back(columns);
        std::memcpy(read.rows.back().data(), all.data() + at, 4 * columns);
    }
    return read;
}

/// The covariance of a row, from its last seven numbers: log scales and the quaternion, as viewers compute it.
Mat<double, 3> covariance(const std::vector<float>& row) {
    const auto at = [&](int k) { return double(row[row.size() - 7 + std::size_t(k)]); };
    const double w = at(3), x = at(4), y = at(5), z = at(6);
    CHECK(w >= 0);
    CHECK(std::abs(w * w + x * x + y * y + z * z - 1) < 3e-7);
    const Mat<double, 3> R = Mat<double, 3>::rows(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                                                  2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                                                  2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y));
    Mat<double, 3> squares = Mat<double, 3>::zero();
    for (int k = 0; k < 3; ++k) squares(k, k) = std::exp(2 * at(k));
    return R * squares * transpose(R);
}

double distance(const Mat<double, 3>& a, const Mat<double, 3>& b) { return std::sqrt(squared_norm(a - b)); }

firn::State<double> particles(int dimension, std::size_t count) {
    firn::State<double> state;
    state.dimension = dimension;
    const auto D = std::size_t(dimension);
    state.fields = {
        {"position", "m", dimension, std::vector<double>(D * count, 0.5)},
        {"volume", dimension == 3 ? "m^3" : "m^2", 1, std::vector<double>(count, std::pow(0.02, dimension))}};
    for (std::size_t i = 0; i < count; ++i) state.id.push_back(std::int64_t(i));
    state.body.resize(count);
    return state;
}

}  // namespace

TEST_CASE("A splat has the properties of the format, in their order, as numbers that viewers expect", "[io]") {
    const Folder folder;
    auto state = particles(3, 1);
    state.fields[0].values = {1, 2, 3};
    state.fields.push_back({"temperature", "K", 1, {300}});
    firn::write_splats(folder / "a.ply", state,
                       {.radius = 0.25,
                        .field = "temperature",
                        .colour_of = [](std::span<const double> t) { return Vec<double, 3>{t[0] / 300, 0, 0.5}; },
                        .opacity = 0.75});
    const Read read = read_floats(folder / "a.ply");
    CHECK(read.header ==
          "ply\nformat binary_little_endian 1.0\ncomment Gaussian splats, positions in metres, after 0 seconds\n"
          "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
          "property float ny\nproperty float nz\nproperty float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n"
          "property float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float scale_2\n"
          "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\nend_header\n");
    REQUIRE(read.rows.size() == 1);
    const auto& row = read.rows[0];
    CHECK(std::vector<float>(row.begin(), row.begin() + 6) == std::vector<float>{1, 2, 3, 0, 0, 0});
    CHECK(row[6] == Approx(0.5 / 0.28209479177387814));
    CHECK(row[7] == Approx(-0.5 / 0.28209479177387814));
    CHECK(row[8] == 0);
    CHECK(1 / (1 + std::exp(-row[9])) == Approx(0.75));
    for (std::size_t k = 10; k < 13; ++k) CHECK(row[k] == Approx(std::log(0.25)));
    // A ball has no axes: any rotation is right.
    CHECK(distance(covariance(row), Mat<double, 3>::diagonal(0.0625)) < 1e-7);
}

TEST_CASE("The covariance of a splat is that of a Gaussian that F has deformed", "[io]") {
    const Folder folder;
    test_support::Random random(5);
    constexpr std::size_t count = 300;
    auto state = particles(3, count);
    std::vector<Mat<double, 3>> F(count);
    firn::StateField<double> field{"deformation_gradient", "1", 9, {}};
    for (std::size_t i = 0; i < count; ++i) {
        do {
            for (double& x : F[i].m) x = random.uniform(-1, 1);
            if (i < 40)  // nearly a rotation by half a turn, where w is small, and others about each axis
                F[i] =
                    firn::matrix_of(firn::turned(firn::no_rotation<double, 3>(),
                                                 Vec<double, 3>{i % 3 == 0 ? 3.14159 : 1e-3 * double(i),
                                                                i % 3 == 1 ? 3.14159 : 0, i % 3 == 2 ? 3.1415 : 0})) *
                    Mat<double, 3>::rows(2, 0, 0, 0, 1.5, 0, 0, 0, 0.3);
            if (i == 40) F[i] = Mat<double, 3>::identity();
            if (i == 41) F[i] = Mat<double, 3>::rows(1, 0, 0, 0, 2, 0, 0, 0, 3);  // axes in the other order
        } while (determinant(F[i]) < 0.02);
        for (int k = 0; k < 9; ++k) field.values.push_back(F[i](k / 3, k % 3));
    }
    state.fields.push_back(field);
    state.fields.push_back({"volume_ratio", "1", 1, std::vector<double>(count, -9)});  // F counts
    firn::write_splats(folder / "a.ply", state, {.radius = 0.1});
    const Read read = read_floats(folder / "a.ply");
    REQUIRE(read.rows.size() == count);
    double worst = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Mat<double, 3> expected = F[i] * transpose(F[i]) * 0.01;
        worst = std::max(worst, distance(covariance(read.rows[i]), expected) / std::sqrt(squared_norm(expected)));
    }
    INFO("worst relative error " << worst);
    CHECK(worst < 2e-6);  // of floats: logarithms near 5 have an error of 2.4e-7, doubled by the square
    // Σ₀ comes from the volume: half the spacing of 0.02 m.
    firn::write_splats(folder / "b.ply", state);
    CHECK(distance(covariance(read_floats(folder / "b.ply").rows[40]), Mat<double, 3>::diagonal(1e-4)) < 1e-9);
}

TEST_CASE("A fluid's splat is a ball of J times the volume; in the plane F is 1 across it", "[io]") {
    const Folder folder;
    auto fluid = particles(3, 1);
    fluid.fields.push_back({"volume_ratio", "1", 1, {0.512}});
    firn::write_splats(folder / "a.ply", fluid, {.radius = 0.5});
    CHECK(distance(covariance(read_floats(folder / "a.ply").rows[0]), Mat<double, 3>::diagonal(0.16)) < 1e-6);
    auto flat = particles(2, 1);
    flat.fields.push_back({"deformation_gradient", "1", 4, {2, 1, 0, 0.5}});
    firn::write_splats(folder / "b.ply", flat);
    const auto row = read_floats(folder / "b.ply").rows[0];
    CHECK(row[2] == 0);
    CHECK(distance(covariance(row), Mat<double, 3>::rows(5, 0.5, 0, 0.5, 0.25, 0, 0, 0, 1) * 1e-4) < 2e-9);
    auto slope = particles(2, 1);  // of a material in 3D
    slope.fields.push_back({"deformation_gradient", "1", 9, {2, 0, 0, 0, 1, 0, 0, 0, 3}});
    firn::write_splats(folder / "c.ply", slope);
    CHECK(distance(covariance(read_floats(folder / "c.ply").rows[0]),
                   Mat<double, 3>::rows(4, 0, 0, 0, 1, 0, 0, 0, 9) * 1e-4) < 3e-9);
}

TEST_CASE("Splats of the degree 3 have 45 zeros more, for viewers that ask for them", "[io]") {
    const Folder folder;
    firn::write_splats(folder / "a.ply", particles(3, 2), {.harmonics = 3});
    const Read read = read_floats(folder / "a.ply");
    CHECK(states::holds(read.header, "property float f_dc_2\nproperty float f_rest_0\n"));
    CHECK(states::holds(read.header, "property float f_rest_44\nproperty float opacity\n"));
    REQUIRE(read.rows.size() == 2);
    CHECK(read.rows[1].size() == 17 + 45);
    for (std::size_t k = 9; k < 54; ++k) CHECK(read.rows[1][k] == 0);
}

TEST_CASE("What cannot be a splat is refused, and nothing is written", "[io]") {
    const Folder folder;
    const auto refused = [&](const firn::State<double>& state, const firn::SplatOptions& options) {
        return states::message<firn::parameter_error>([&] { firn::write_splats(folder / "a.ply", state, options); });
    };
    const auto state = particles(3, 2);
    for (const double o : {0.0, 1.0, -1.0, 2.0, std::numeric_limits<double>::quiet_NaN()})
        CHECK(states::holds(refused(state, {.opacity = o}), "SplatOptions::opacity"));
    for (const double r : {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
        CHECK(states::holds(refused(state, {.radius = r}), "SplatOptions::radius"));
    CHECK(states::holds(refused(state, {.harmonics = 4}), "SplatOptions::harmonics is 4"));
    CHECK(states::holds(refused(state, {.colour = {0, 1.5, 0}}), "a colour of 1.5"));
    CHECK(states::holds(refused(state, {.field = "heat", .colour_of = [](auto) { return Vec<double, 3>{}; }}),
                        "no field 'heat'"));
    auto other = state;
    other.fields[1].values[1] = 0;
    CHECK(states::holds(refused(other, {}), "Particle 1 has a volume of 0"));
    other.fields.pop_back();
    CHECK(states::holds(refused(other, {}), "no field 'volume'"));
    CHECK_NOTHROW(firn::write_splats(folder / "b.ply", other, {.radius = 1}));
    other.fields.push_back({"volume_ratio", "1", 1, {1, -1}});
    CHECK(states::holds(refused(other, {.radius = 1}), "Particle 1 has a volume ratio of -1"));
    other.fields.push_back({"deformation_gradient", "1", 9, std::vector<double>(18, 1)});
    CHECK(states::holds(refused(other, {.radius = 1}), "Particle 0 has a principal stretch of 0"));
    other.fields.back().values[3] = std::numeric_limits<double>::quiet_NaN();
    CHECK(states::holds(refused(other, {.radius = 1}), "'deformation_gradient' of particle 0 is nan"));
    CHECK(folder.names() == std::set<std::string>{"b.ply"});
    CHECK_THROWS_AS(firn::write_splats(folder / "no/a.ply", state), firn::io_error);
}

}  // namespace splats_tests
