/// \file Particles, points, meshes, a program's own arrays and the fields of a state in Eigen's matrices.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/data/eigen.hpp>
#include <firn/firn.hpp>
#include <firn/io/eigen.hpp>

#include <Eigen/Dense>

using namespace firn;
using test_support::check_refused;

namespace {

Particles<float, 2> some_particles() {
    Particles<float, 2> particles(Domain<2>{.lower = {0, 0}, .upper = {1, 1}, .cell_size = 0.1});
    for (int i = 0; i < 40; ++i) {
        const float x = float(i);
        particles.push_back({0.02 * i, 0.5}, {x, -x}, 1 + x, 1e-3F, {Mat<float, 2>::rows(1, x, 2 * x, 3)});
    }
    particles.remove(7);
    return particles;
}

}  // namespace

TEST_CASE("Copies of particles' fields have a column for each, in the order of their ids' copy", "[data][eigen]") {
    const auto particles = some_particles();
    const auto id = copy_of_ids(particles);
    const auto x = copy_of_positions(particles);
    const auto v = copy_of_velocities(particles);
    const auto mass = copy_of_masses(particles);
    const auto F = copy_of_deformation_gradients(particles);
    REQUIRE((id.size() == 39 && x.cols() == 39 && v.cols() == 39 && mass.size() == 39 && F.cols() == 39));
    CHECK((id.array() != 7U).all());
    for (Eigen::Index i = 0; i < id.size(); ++i) {
        const double number = id[i];
        CHECK(x.col(i).isApprox(Eigen::Vector2d(0.02 * number, 0.5), 1e-6));
        CHECK(v.col(i).cast<double>() == Eigen::Vector2d(number, -number));
        CHECK(double(mass[i]) == 1 + number);
        CHECK(Eigen::Matrix2d(F.col(i).reshaped(2, 2).cast<double>()) ==
              (Eigen::Matrix2d() << 1, number, 2 * number, 3).finished());
    }
    CHECK(copy_of_stresses(particles).isZero());
}

TEST_CASE("Columns become points, and a mesh", "[data][eigen]") {
    Eigen::Matrix3Xd columns(3, 2);
    columns << 1, 4, 2, 5, 3, 6;
    const std::vector<Vec<double, 3>> points = points_of(columns * 2);
    CHECK((points.size() == 2 && points[1] == Vec<double, 3>{8.0, 10.0, 12.0}));
    const Eigen::MatrixXd rows = columns.transpose();  // as libigl and NumPy keep them
    CHECK(points_of<3>(rows.transpose())[0] == Vec<double, 3>{1.0, 2.0, 3.0});
    check_refused<parameter_error>([&] { points_of<3>(rows); }, "2 × 1");

    Eigen::Matrix3Xd corners(3, 4);
    corners << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
    Eigen::Matrix3Xi facets(3, 4);
    facets << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
    const TriangleMesh mesh = triangle_mesh(corners, facets);
    check_mesh(mesh);
    CHECK((mesh.triangles.size() == 4 && mesh.triangles[3] == std::array{1, 2, 3}));
    check_refused<parameter_error>([&] { return triangle_mesh(corners, facets.topRows(2)); }, "a column of 3 for each");
}

TEST_CASE("A program's own columns are stepped where they lie", "[data][eigen]") {
    // The stages on Eigen's matrices against those on arrays of firn's vectors: the same bits, for any strides.
    const Eigen::Index n = 300;
    Eigen::Matrix<float, 2, Eigen::Dynamic> x(2, n), v = Eigen::Matrix<float, 2, Eigen::Dynamic>::Zero(2, n);
    for (Eigen::Index i = 0; i < n; ++i) x.col(i) << 0.3F + 0.01F * float(i % 20), 0.4F + 0.01F * float(i / 20);
    v.row(0) = 3 * x.row(1).array() - 1;
    const auto step = [&](StridedSpan<float> position, StridedSpan<float> velocity) {
        std::vector<float> rest(std::size_t(n) * 4 * 3, 0.0F), mass(std::size_t(n), 0.1F),
            volume(std::size_t(n), 1e-4F);
        for (std::size_t i = 0; i < std::size_t(n); ++i) rest[4 * i] = rest[4 * i + 3] = 1;
        const ForeignParticles<float, 2> view{position,
                                              velocity,
                                              StridedSpan<float>::matrices<2>(rest.data() + 4 * n, false),
                                              symmetric_matrices<2>(rest.data() + 8 * n),
                                              StridedSpan<float>::scalars(mass.data()),
                                              StridedSpan<float>::scalars(volume.data()),
                                              {StridedSpan<float>::matrices<2>(rest.data(), false)}};
        const Domain<2> domain{.lower = {0, 0}, .upper = {1, 1}, .cell_size = 0.02};
        SparseGrid<float, 2> grid(domain);
        auto partition = partition_particles<QuadraticBSpline>(view, std::size_t(n), domain);
        grid.activate(partition);
        const auto jelly = FixedCorotated<float>::from_young_poisson(1e4, 0.3);
        p2g<QuadraticBSpline, Apic, MlsForce>(detail::Serial{}, view, partition, grid, 1e-4);
        grid_update(detail::Serial{}, grid, 1e-4, Eigen::Vector2d(0, -9.81),
                    Walls<float, 2>::all(Eigen::Vector2f::Zero(), Eigen::Vector2f::Ones(), {}));
        g2p<QuadraticBSpline, Apic, MlsForce>(detail::Serial{}, view, partition, grid, jelly, 1e-4);
    };
    std::vector<Vec<float, 2>> positions(static_cast<std::size_t>(n)), velocities(positions.size());
    as_eigen(positions) = x;
    as_eigen(velocities) = v;
    step(StridedSpan<float>::vectors<2>(positions[0].v), StridedSpan<float>::vectors<2>(velocities[0].v));

    Eigen::Matrix<float, 4, Eigen::Dynamic> wide(4, n);
    wide.bottomRows(2) = x;
    Eigen::Matrix<float, Eigen::Dynamic, 2> arrays = v.transpose();
    step(as_span(wide.bottomRows(2)), as_span(arrays.transpose()));
    CHECK(wide.bottomRows(2) == as_eigen(positions));
    CHECK(arrays.transpose() == as_eigen(velocities));
    CHECK(as_eigen(velocities) != v);

    Eigen::MatrixXf large(10, n);
    check_refused<parameter_error>([&] { as_span(large); }, "at most 9");
}

TEST_CASE("The fields of a state are maps, a matrix of a particle a value", "[data][eigen]") {
    StateField<double> F{
        .name = "deformation_gradient", .unit = "1", .components = 4, .values = {1, 2, 3, 4, 5, 6, 7, 8}};
    CHECK(as_eigen(std::as_const(F)).col(1) == Eigen::Vector4d(5, 6, 7, 8));
    CHECK(matrix_of<2>(F, 1) == (Eigen::Matrix2d() << 5, 6, 7, 8).finished());
    as_eigen(F) *= 2;
    CHECK(F.values[7] == 16);
    const auto kept = as_eigen(StateField<double>(F));
    CHECK((kept.rows() == 4 && kept(0, 0) == 2));
    check_refused<parameter_error>([&] { matrix_of<3>(F, 0); }, "has 4 components");
    check_refused<parameter_error>([&] { matrix_of<2>(F, 2); }, "matrix 2 of 2 × 2");
}
