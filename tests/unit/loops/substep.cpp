// part: memory
/// \file One whole step against numbers computed independently of firn (tests/reference/substep_2d_*.csv): three
/// particles, APIC, both force forms, in double. The numbers have 13 digits.
#include "support/catch.hpp"
#include "support/csv.hpp"
#include "support/scenes.hpp"

using namespace firn;

namespace {

struct ThreeParticles {
    std::vector<double> x, v, C, F, stress, mass, volume;

    ThreeParticles(const std::string& file, const std::string& when) {
        for (const auto& row : csv::read(file)) {
            if (row.at("when") != when) continue;
            for (const char* c : {"x0", "x1"}) x.push_back(csv::number(row, c));
            for (const char* c : {"v0", "v1"}) v.push_back(csv::number(row, c));
            for (const char* c : {"C00", "C01", "C10", "C11"}) C.push_back(csv::number(row, c));
            for (const char* c : {"F00", "F01", "F10", "F11"}) F.push_back(csv::number(row, c));
            mass.push_back(csv::number(row, "m"));
            volume.push_back(csv::number(row, "V0"));
        }
        stress.resize(C.size());
    }
    ForeignParticles<double, 2> view() {
        using Span = StridedSpan<double>;
        return {Span::vectors<2>(x.data()),           Span::vectors<2>(v.data()), Span::matrices<2>(C.data(), true),
                symmetric_matrices<2>(stress.data()), Span::scalars(mass.data()), Span::scalars(volume.data()),
                {Span::matrices<2>(F.data(), true)}};
    }
};

template <class Force>
void check_step(const std::string& form) {
    const Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 0.1};
    const double dt = 1e-4;
    const Vec<double, 2> gravity{0.0, -9.81};
    const auto material = FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    const auto walls = Walls<double, 2>::all({0.0, 0.0}, {1.0, 1.0}, {});
    ThreeParticles particles("substep_2d_" + form + "_particles.csv", "in");
    const ThreeParticles expected("substep_2d_" + form + "_particles.csv", "out");

    const auto view = particles.view();
    const auto partition = partition_particles<QuadraticBSpline>(view, 3, domain);
    SparseGrid<double, 2> grid(domain);
    grid.activate(partition);
    update_stress(detail::Serial{}, view, partition, material, domain.cell_size);

    p2g<QuadraticBSpline, Apic, Force>(Coloured{}, view, partition, grid, dt);
    const auto nodes = csv::read("substep_2d_" + form + "_grid.csv");
    const auto at = [&](const csv::Row& row) {
        return grid.find_node({std::stoi(row.at("i")), std::stoi(row.at("j"))});
    };
    for (const auto& row : nodes) {
        CAPTURE(row.at("i"), row.at("j"));
        const double* node = at(row);
        REQUIRE(node != nullptr);
        CHECK(node[node_mass] == Approx(csv::number(row, "m")).epsilon(1e-11).margin(1e-15));
        for (int a = 0; a < 2; ++a) {
            const std::string c = std::to_string(a);
            CHECK(node[a] ==
                  Approx(csv::number(row, "mv" + c) + dt * csv::number(row, "f" + c)).epsilon(1e-11).margin(1e-15));
        }
    }
    grid_update(Coloured{}, grid, dt, gravity, walls);
    for (const auto& row : nodes) {
        CAPTURE(row.at("i"), row.at("j"));
        if (csv::number(row, "m") == 0)
            continue;  // a particle on the border of its support: weight 0, or a rounding error
        // The lightest nodes carry 1e-7 of the mass: what the sums round there shows.
        for (int a = 0; a < 2; ++a)
            CHECK(at(row)[a] == Approx(csv::number(row, "v" + std::to_string(a))).epsilon(1e-9).margin(1e-12));
    }
    g2p<QuadraticBSpline, Apic, Force>(Coloured{}, view, partition, grid, material, dt);
    const auto same = [](const std::vector<double>& ours, const std::vector<double>& theirs, double epsilon) {
        REQUIRE(ours.size() == theirs.size());
        for (std::size_t i = 0; i < ours.size(); ++i)
            CHECK(ours[i] == Approx(theirs[i]).epsilon(epsilon).margin(epsilon));
    };
    same(particles.x, expected.x, 1e-11);
    same(particles.v, expected.v, 1e-11);
    same(particles.C, expected.C, 1e-10);
    same(particles.F, expected.F, 1e-11);
}

}  // namespace

TEST_CASE("A step with MLS forces equals the reference") { check_step<MlsForce>("mls"); }
TEST_CASE("A step with weight-gradient forces equals the reference") { check_step<WeightGradientForce>("grad"); }
