/// \file Manufactured solutions: body forces as computed elsewhere (tests/reference/mms_body_force.csv), and the error
/// of displacements, which falls with the square of the cells.
#include "../../benchmarks/verification/scenes/manufactured.hpp"

#include "support/catch.hpp"
#include "support/csv.hpp"

using namespace firn;
using namespace verification;

namespace {

Matter matter_of(const csv::Row& row) {
    return {csv::number(row, "mu"), csv::number(row, "lambda"), csv::number(row, "rho0")};
}

/// Body force and position as in a row; the other derivatives against differences.
template <int D, class Solution>
void check_row(const Solution& solution, const csv::Row& row) {
    const char* const columns[] = {"X", "Y", "Z", "x", "y", "z", "bx", "by", "bz"};
    Vec<double, D> X{}, x{}, b{};
    for (int a = 0; a < D; ++a) {
        X[a] = csv::number(row, columns[a]);
        x[a] = csv::number(row, columns[3 + a]);
        b[a] = csv::number(row, columns[6 + a]);
    }
    const double t = csv::number(row, "t"), d = 1e-5 * solution.period();
    CHECK(norm(solution.position(X, t) - x) < 1e-11);
    CHECK(norm(solution.body_force(X, t) - b) < 1e-10 * norm(b));
    const auto v = (solution.position(X, t + d) - solution.position(X, t - d)) * (0.5 / d);
    CHECK(norm(solution.velocity(X, t) - v) <= 1e-8 * norm(v));  // at a wall nothing moves
    const auto F = solution.deformation_gradient(X, t), rate = solution.deformation_rate(X, t);
    const auto change = (solution.deformation_gradient(X, t + d) - solution.deformation_gradient(X, t - d)) * (0.5 / d);
    CHECK(squared_norm(change - rate) < 1e-14 * squared_norm(rate));
    for (int j = 0; j < D; ++j) {
        Vec<double, D> step = Vec<double, D>::zero();
        step[j] = 1e-6;
        const auto column = (solution.position(X + step, t) - solution.position(X - step, t)) * 0.5e6;
        for (int i = 0; i < D; ++i) CHECK(F(i, j) == Approx(column[i]).margin(1e-8));
    }
}

template <class Solution>
using Scene = Manufactured<double, Solution, Apic, MlsForce, QuadraticBSpline>;

/// At the end, over A.
template <class Solution>
double error_after(Scene<Solution>&& scene, int steps) {
    for (int i = 0; i < steps; ++i) scene.step();
    return scene.error().mean_square / scene.solution.amplitude;
}

/// After half a period.
double error_of_waves(int n) {
    const AxisAligned<2> waves{{3846.15384615, 5769.23076923, 1}, 0.05};
    Domain<2> domain{{0.0, 0.0}, {2.0, 2.0}, 1.0 / n};
    domain.periodic = {true, true};
    const int steps = 7 * n / 2;
    return error_after(
        Scene<AxisAligned<2>>(waves, domain, sample_box<2>(domain.lower, domain.upper, {.spacing = 0.5 / n}),
                              waves.period() / 2 / steps),
        steps);
}
double error_of_vortex(int n) {
    const Vortex vortex{{384.615, 576.923, 1000}, 0.1};
    const int steps = 6 * n;
    return error_after(Scene<Vortex>(vortex, {{-1.5, -1.5}, {1.5, 1.5}, 1.0 / n}, ring_samples(1.0 / n), 1.0 / steps),
                       steps);
}

}  // namespace

TEST_CASE("The body forces of the manufactured solutions are those computed independently") {
    int rows = 0;
    for (const auto& row : csv::read("mms_body_force.csv")) {
        CAPTURE(row.at("case"), row.at("X"), row.at("t"));
        const std::string& of = row.at("case");
        if (of == "generalised_vortex_neohookean")
            check_row<2>(Vortex{matter_of(row), csv::number(row, "A")}, row), ++rows;
        else if (of == "axis_aligned_nh")
            check_row<3>(AxisAligned<3>{matter_of(row), csv::number(row, "A")}, row), ++rows;
        else if (of == "stuck_waves_nh")
            check_row<2>(StuckWaves{matter_of(row), csv::number(row, "A")}, row), ++rows;
    }
    CHECK(rows == 27);
}

TEST_CASE("Manufactured waves are met to 0.4 % of their amplitude, better with finer cells", "[slow]") {
    // Of second order but for the particles' quadrature; measured: 0.80 % and 0.27 %.
    const double coarse = error_of_waves(16), fine = error_of_waves(32);
    CAPTURE(coarse, fine);
    CHECK(fine < 0.004);
    CHECK(fine < 0.4 * coarse);
}

TEST_CASE("The error of a manufactured vortex falls with the square of the cells") {
    // Measured: 18.6 % and 4.9 % of the largest turn.
    const double coarse = error_of_vortex(8), fine = error_of_vortex(16);
    CAPTURE(coarse, fine);
    CHECK(fine < 0.06);
    CHECK(std::log2(coarse / fine) > 1.85);
}
