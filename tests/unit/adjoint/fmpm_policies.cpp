// quick: no
// sanitized: no
/// \file The gradient through the series of FMPM, and of transfers of a program's own, against difference quotients and
/// runs in dual numbers.
#include "support/gradient_checks.hpp"

using namespace derivatives;

namespace fmpm_policies_gradient_tests {
namespace {

/// A series of a program's own, whose particles carry affine fields, and whose terms are not linear.
struct Bent {
    static constexpr bool affine = true;
    int order = 3;

    template <scalar S, int D>
    static Mat<S, D> affine_field(const Mat<S, D>& C) {
        return C * S(0.7);
    }
    template <scalar S, int D>
    static Vec<S, D> next(const Vec<S, D>& v_1, const Vec<S, D>& v_j, const Vec<S, D>& there_and_back) {
        return v_1 + (v_j - there_and_back) * (S(1) / (S(1) + dot(v_j, there_and_back) * S(0.1)));
    }
};

template <int D, class... Policies, class Boundary>
auto run_of(int order, const Boundary& boundary) {
    Run<SimulationWith<D, FixedCorotated<double>, Boundary, Policies...>> run{jelly, boundary};
    run.dt = 1e-3;
    run.boundary_changes = false;
    run.transfer.order = order;
    return run;
}
template <class R>
void check_transposed(R run, int steps) {
    run.dt = 0x1p-11;
    tangent::check_transposed(run.at(0), steps, 2);
}

}  // namespace

TEST_CASE("gradients through FMPM of several orders", "[adjoint]") {
    for (const int order : {1, 2, 4}) {
        CAPTURE(order);
        const auto run = run_of<2, Fmpm>(order, walls_of_run<2>());
        check_derivatives(run);
        check_transposed(run, 12);
    }
    for (const int order : {1, 2, 4}) {
        CAPTURE(order);
        auto run = run_of<3, Fmpm>(order, walls_of_run<3>(Contact::slip));
        check_transposed(run, 3);
        run.steps = 2;
        CHECK(run.error() < 1e-6);
    }
}
TEST_CASE("gradients through FMPM beside mirrored walls", "[adjoint]") {
    for (const Contact contact : {Contact::stick, Contact::slip, Contact::separate}) {
        CAPTURE(int(contact));
        auto walls = walls_of_run<2>(contact, 0.2);
        walls.nodes_behind = NodesBehind::mirrored;
        auto run = run_of<2, Fmpm>(3, walls);
        run.downwards = -20;  // so that matter comes so near that it reaches the nodes behind the wall
        check_derivatives(run);
        check_transposed(run, 12);
    }
}
TEST_CASE("gradients through FMPM with averages of the rate of volume change, and with a wide kernel", "[adjoint]") {
    check_transposed(run_of<2, Fmpm, FBar, CubicBSpline>(3, walls_of_run<2>()), 12);
}
TEST_CASE("gradients through a series of a program's own", "[adjoint]") {
    const auto run = run_of<2, Bent, WeightGradientForce>(3, walls_of_run<2>());
    check_derivatives(run);
    check_transposed(run, 12);
}
TEST_CASE("the gradient of 200 steps of FMPM is the derivative of the run in dual numbers", "[adjoint]") {
    auto run = run_of<2, Fmpm>(3, walls_of_run<2>());
    run.dt = 0x1p-11;
    for (const tangent::Compared& one : tangent::compare(run.at(0), 200, 2)) {
        CAPTURE(one.gradient, one.tangent);
        CHECK(std::abs(one.gradient - one.tangent) <= 1e-9 * std::abs(one.tangent));
    }
}

}  // namespace fmpm_policies_gradient_tests
