/// \file Mohr–Coulomb plasticity: the return mapping against an enumeration of all sets of planes that may flow,
/// element tests in closed form, softening, and what holds for every model.
#include "support/effort.hpp"
#include "support/materials.hpp"
#include "support/message.hpp"
#include <firn/material/check.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/softening_band.hpp>

#include "../../../benchmarks/verification/scenes/soil_element.hpp"

#include <algorithm>

using namespace materials;
using verification::Element;

namespace mohr_coulomb_tests {
namespace {

using Model = MohrCoulomb<double>;
template <int D>
using Soil = Model::state<D>;
template <int D>
using Numbers = Eigen::Matrix<double, D, 1>;

/// A yield function n·τ − bound and the direction of its flow, in principal axes in any order.
template <int D>
struct Plane {
    Numbers<D> normal, flow;
    double bound;
};
/// The planes of both surfaces: one for each ordered pair of axes, one for each axis.
template <int D>
std::vector<Plane<D>> planes_of(const Model& model) {
    const double s = std::sin(model.friction_angle), d = std::sin(model.dilatancy_angle);
    std::vector<Plane<D>> planes;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
            Plane<D> plane{Numbers<D>::Zero(), Numbers<D>::Zero(), model.tension};
            plane.normal[i] = plane.flow[i] = 1;
            if (i != j) {
                plane.normal[i] += s, plane.normal[j] += s - 1;
                plane.flow[i] += d, plane.flow[j] += d - 1;
                plane.bound = 2 * model.cohesion * std::cos(model.friction_angle);
            }
            planes.push_back(plane);
        }
    return planes;
}
template <int D>
Eigen::Matrix<double, D, D> elasticity_of(const Model& model) {
    return Eigen::Matrix<double, D, D>::Identity() * (2 * model.mu) +
           Eigen::Matrix<double, D, D>::Constant(model.lambda);
}
template <int D>
double excess_of(const std::vector<Plane<D>>& planes, const Numbers<D>& tau) {
    double most = -std::numeric_limits<double>::infinity();
    for (const auto& plane : planes) most = std::max(most, plane.normal.dot(tau) - plane.bound);
    return most;
}

/// A point that a set of planes leads to with flows that are not negative. It violates no plane.
template <int D>
struct Solution {
    Numbers<D> stress;
    double least_flow;   ///< the smallest flow, times 2μ [Pa]
    double least_slack;  ///< how far the other planes are [Pa]
    int active;          ///< number of planes
};
/// Tries all sets of up to D planes. \param scale  [Pa]
template <int D>
std::vector<Solution<D>> all_solutions(const Model& model, const Numbers<D>& trial, double scale) {
    const auto planes = planes_of<D>(model);
    const auto C = elasticity_of<D>(model);
    std::vector<Solution<D>> found;
    for (unsigned set = 1; set < 1u << planes.size(); ++set) {
        const int n = std::popcount(set);
        if (n > D) continue;
        std::array<const Plane<D>*, D> active{};
        for (unsigned k = 0, place = 0; k < planes.size(); ++k)
            if (set >> k & 1u) active[place++] = &planes[k];
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, D, D> A(n, n);
        Eigen::Matrix<double, Eigen::Dynamic, 1, 0, D, 1> f(n);
        for (int i = 0; i < n; ++i) {
            f[i] = active[std::size_t(i)]->normal.dot(trial) - active[std::size_t(i)]->bound;
            for (int j = 0; j < n; ++j)
                A(i, j) = active[std::size_t(i)]->normal.dot(C * active[std::size_t(j)]->flow) / (2 * model.mu);
        }
        if (n == 1 && f[0] < 0) continue;
        if (std::abs(A.determinant()) < 1e-9) continue;
        const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, D, 1> flow = A.inverse() * f;
        if (flow.minCoeff() < -1e-11 * scale) continue;
        Numbers<D> stress = trial;
        for (int i = 0; i < n; ++i) stress -= C * active[std::size_t(i)]->flow * (flow[i] / (2 * model.mu));
        if (excess_of(planes, stress) > 1e-11 * scale) continue;
        double slack = std::numeric_limits<double>::infinity();
        for (unsigned k = 0; k < planes.size(); ++k)
            if (!(set >> k & 1u)) slack = std::min(slack, planes[k].bound - planes[k].normal.dot(stress));
        found.push_back({stress, flow.minCoeff(), slack, n});
    }
    return found;
}

template <int D>
Numbers<D> principal_stresses(const Mat<double, D>& tau) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, D, D>> solver(as_eigen(tau));
    return solver.eigenvalues().reverse();
}
template <int D>
Numbers<D> vector_of(const Vec<double, D>& v) {
    Numbers<D> numbers;
    for (int i = 0; i < D; ++i) numbers[i] = v[i];
    return numbers;
}
/// Principal strains in descending order; some of them equal or close.
template <int D>
Vec<double, D> strains(Random& random, double mean, double spread) {
    std::array<double, D> e;
    for (double& x : e) x = mean * random.uniform(-1, 1) / 3 + spread * random.uniform(-1, 1);
    const double shift = mean * random.uniform(-1, 1);
    for (double& x : e) x += shift;
    const double kind = random.uniform(0, 1);
    if (kind < 0.1) e[1] = e[0];
    if (kind > 0.1 && kind < 0.2) e[D - 1] = e[1] + 1e-13;
    if (kind > 0.2 && kind < 0.25) e.fill(e[0]);
    std::sort(e.begin(), e.end(), std::greater<>());
    Vec<double, D> sorted{};
    for (int i = 0; i < D; ++i) sorted[i] = e[std::size_t(i)];
    return sorted;
}
template <int D>
Soil<D> strained(Random& random, const Vec<double, D>& e) {
    Vec<double, D> stretches{};
    for (int i = 0; i < D; ++i) stretches[i] = std::exp(e[i]);
    return {DeformationGradient<double, D>(with_singular_values<D>(random, stretches)), 0};
}

MohrCoulombProperties properties(double cohesion, double friction, double dilatancy, double tension, double poisson) {
    return {.young = 1e6,
            .poisson = poisson,
            .cohesion = cohesion,
            .friction_angle = degrees(friction),
            .dilatancy_angle = degrees(dilatancy),
            .tension = tension};
}
constexpr double none = std::numeric_limits<double>::infinity();

template <int D>
struct Counts {
    int elastic = 0, at_apex = 0, by_active[D + 1] = {};
};
template <int D>
void check_return(const Model& model, Random& random, int states, Counts<D>& counts) {
    const auto planes = planes_of<D>(model);
    const Numbers<D> ones = Numbers<D>::Ones();
    const double apex = model.friction_angle > 0 ? model.cohesion / std::tan(model.friction_angle) : none;
    double worst = 0, worst_excess = 0, worst_strain = 0;
    int missed = 0, ambiguous = 0, moved = 0;
    for (int k = 0; k < states; ++k) {
        const double size = std::pow(10., random.uniform(-2.5, -1));
        const Vec<double, D> e = strains<D>(random, k % 3 ? size : 0.1 * size, size);
        const Soil<D> state = strained<D>(random, e);
        const Numbers<D> strain = vector_of<D>(e), trial = elasticity_of<D>(model) * strain;
        const double scale = std::max(model.cohesion, trial.cwiseAbs().maxCoeff());
        const auto after = model.returned_with_stress(state);
        const Numbers<D> tau = principal_stresses<D>(after.stress);
        const double allowed = 1e-10 * scale;
        worst_excess = std::max(worst_excess, excess_of(planes, tau) / scale);
        if (excess_of(planes, trial) <= 1e-12 * scale) {
            ++counts.elastic;
            missed += !(same_bits(after.state, state));
            continue;
        }
        const auto solutions = all_solutions<D>(model, trial, scale);
        if (solutions.empty()) {
            // No flow leads back: only for flow that does not dilate, past the apex.
            ++counts.at_apex;
            missed += !(model.dilatancy_angle == 0 && trial.sum() / D >= apex - 1e-9 * scale && apex <= model.tension &&
                        (tau - apex * ones).norm() <= allowed);
            continue;
        }
        ++counts.by_active[solutions[0].active];
        for (const auto& other : solutions) ambiguous += (other.stress - solutions[0].stress).norm() > allowed;
        worst = std::max(worst, (tau - solutions[0].stress).norm() / scale);
        // γ is the largest plastic strain minus the smallest.
        const Numbers<D> plastic = strain - elasticity_of<D>(model).inverse() * solutions[0].stress;
        worst_strain = std::max(worst_strain, std::abs(after.state.plastic_strain - (plastic[0] - plastic[D - 1])));
        moved += !same_bits(model.returned(after.state), after.state);
    }
    CAPTURE(model.cohesion, model.friction_angle, model.dilatancy_angle, model.tension, model.lambda);
    CHECK(missed == 0);
    CHECK(ambiguous == 0);
    CHECK(worst <= 1e-10);
    CHECK(worst_excess <= 1e-10);
    CHECK(worst_strain <= 1e-12);
    CHECK(moved == 0);
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("the return is the one point that flow of planes that are reached leads to, of all their sets",
                       "[material]", ((int D), D), 2, 3) {
    Random random(81);
    Counts<D> counts;
    const int states =
        test_support::fewer_if_quick(test_support::fewer_if_slow(2000, 500), 40);  // of each of 52 models
    // Cohesion, friction angle, dilatancy angle, tension.
    const std::array<double, 4> soils[] = {
        {1e4, 30, 30, none}, {1e4, 30, 10, none}, {1e4, 30, 0, none}, {1e4, 0, 0, none}, {0, 35, 5, none},
        {1e4, 30, 30, 8e3},  {1e4, 30, 10, 2e3},  {1e4, 30, 0, 5e3},  {1e4, 0, 0, 5e3},  {1e4, 20, 3, 0},
        {1e4, 0, 0, 3e4},    {3e3, 60, 40, 1e3},  {1e4, 30, 10, 1e6}};
    for (const double poisson : {0.3, 0., 0.45, -0.2})
        for (const auto& [cohesion, friction, dilatancy, tension] : soils)
            check_return<D>(Model::from_properties(properties(cohesion, friction, dilatancy, tension, poisson)), random,
                            states, counts);
    CHECK(counts.elastic > 4 * states);
    CHECK(counts.at_apex > states / 2);
    for (int n = 1; n <= D; ++n) CHECK(counts.by_active[n] > 4 * states);
}

TEST_CASE("triaxial compression and extension, and plane strain: strength and dilatancy of Mohr–Coulomb",
          "[material]") {
    for (const double friction : {30., 20., 0.})
        for (const double dilatancy : {30., 12., 0.}) {
            if (dilatancy > friction) continue;
            CAPTURE(friction, dilatancy);
            const auto model = Model::from_properties(properties(1e4, friction, dilatancy, none, 0.3));
            const double s = std::sin(model.friction_angle), d = std::sin(model.dilatancy_angle);
            const double N = (1 + s) / (1 - s), N_psi = (1 + d) / (1 - d), confined = 2e4, c = 1e4;
            const double major = confined * N + 2 * c * std::sqrt(N), minor = (confined - 2 * c * std::sqrt(N)) / N;
            const double allowed = 1e-10 * std::max(c, major);
            const Element start = Element{model}.strained_with({0, 0, 0}, {1, 1, 1}, 0, -confined);
            const auto along = [&](const Numbers<3>& step, const Numbers<3>& part, int kept) {
                Element now = start;
                for (int i = 0; i < 40; ++i) now = now.strained_with(step, part, kept, -confined);
                return now;
            };
            // Compression along axis 0; the two others are kept at the pressure.
            Element now = along({-0.005, 0, 0}, {0, 1, 1}, 1);
            CHECK(std::abs(-now.stress()[0] - major) <= allowed);
            CHECK(std::abs(-now.stress()[1] - confined) <= allowed);
            CHECK(std::abs(now.stress()[2] - now.stress()[1]) <= allowed);
            Element next = now.strained_with({-0.005, 0, 0}, {0, 1, 1}, 1, -confined);
            Numbers<3> flow = next.plastic() - now.plastic();
            CHECK(flow[0] == Approx(-0.005).epsilon(1e-9));
            CHECK(flow.sum() / flow[0] == Approx(1 - N_psi).margin(1e-9));
            CHECK(next.soil.plastic_strain - now.soil.plastic_strain == Approx(flow[1] - flow[0]).epsilon(1e-9));
            // Extension along axis 0: the others become the largest pressure.
            if (minor < 0 || friction > 0) {
                now = along({0.005, 0, 0}, {0, 1, 1}, 1);
                CHECK(std::abs(-now.stress()[0] - minor) <= allowed);
                CHECK(std::abs(now.stress()[2] - now.stress()[1]) <= allowed);
                next = now.strained_with({0.005, 0, 0}, {0, 1, 1}, 1, -confined);
                flow = next.plastic() - now.plastic();
                CHECK(flow.sum() / (flow[1] + flow[2]) == Approx(1 - N_psi).margin(1e-9));
            }
            // Plane strain: no strain along axis 2, whose stress is the middle one.
            now = along({-0.005, 0, 0}, {0, 1, 0}, 1);
            CHECK(std::abs(-now.stress()[0] - major) <= allowed);
            CHECK(now.stress()[2] < now.stress()[1] - 1e3);
            CHECK(now.stress()[2] > now.stress()[0] + 1e3);
            next = now.strained_with({-0.005, 0, 0}, {0, 1, 0}, 1, -confined);
            flow = next.plastic() - now.plastic();
            CHECK(flow.sum() / flow[0] == Approx(1 - N_psi).margin(1e-9));
            CHECK(std::abs(flow[2]) <= 1e-14);
        }
}

TEMPLATE_TEST_CASE_SIG("pure shear under pressure: the circle of stress touches the line c + σ tan φ", "[material]",
                       ((int D), D), 2, 3) {
    for (const double friction : {35., 0.}) {
        const auto model = Model::from_properties(properties(1e4, friction, 0, none, 0.25));
        const double s = std::sin(model.friction_angle), cosine = std::cos(model.friction_angle), pressure = 3e4;
        const double strain = pressure / (2 * model.mu + D * model.lambda);
        const double radius = pressure * s + 1e4 * cosine;
        Soil<D> soil{DeformationGradient<double, D>(Mat<double, D>::diagonal(std::exp(-strain))), 0};
        Mat<double, D> rate = Mat<double, D>::zero();
        rate(0, 0) = std::expm1(0.001), rate(1, 1) = std::expm1(-0.001);
        for (int i = 0; i < 100; ++i) soil = updated(model, soil, rate, 1.0);
        Mat<double, D> tau = kirchhoff_stress(model, soil);
        CHECK(std::abs(tau(0, 0) - (-pressure + radius)) <= 1e-10 * pressure);
        CHECK(std::abs(tau(1, 1) - (-pressure - radius)) <= 1e-10 * pressure);
        CHECK(soil.plastic_strain == Approx(0.2 - radius / model.mu).epsilon(1e-10));
        // Simple shear turns the axes; the circle touches the line all the same.
        const double J = determinant(soil.F);
        rate = Mat<double, D>::zero(), rate(0, 1) = 0.003;
        for (int i = 0; i < 100; ++i) soil = updated(model, soil, rate, 1.0);
        tau = kirchhoff_stress(model, soil);
        const double middle = 0.5 * (tau(0, 0) + tau(1, 1)),
                     size = std::hypot(0.5 * (tau(0, 0) - tau(1, 1)), tau(0, 1));
        CHECK(std::abs(size - (-middle * s + 1e4 * cosine)) <= 1e-10 * pressure);
        CHECK(determinant(soil.F) == Approx(J).epsilon(1e-12));
        CHECK(tau(0, 1) > 0.5 * radius);
    }
}

TEST_CASE("pulled apart on all sides, soil bears the tension at the apex, or the cut-off", "[material]") {
    for (const double cut : {none, 5e3})
        for (const double dilatancy : {0., 30.}) {
            const auto model = Model::from_properties(properties(1e4, 30, dilatancy, cut, 0.3));
            const double expected = std::min(cut, 1e4 / std::tan(degrees(30).in_radians()));
            Soil<3> soil{DeformationGradient<double, 3>(diagonal_of<3>({1.05, 1.052, 1.054})), 0};
            const auto after = model.returned_with_stress(soil);
            CHECK(size_of(after.stress - Mat<double, 3>::diagonal(expected)) <= 1e-10 * 2e5);
            CHECK(after.state.plastic_strain == Approx(std::log(1.054 / 1.05)).epsilon(1e-10));
        }
    // Pulled along one axis: that stress is the cut-off, and Poisson's contraction is free.
    const auto model = Model::from_properties(properties(1e4, 30, 0, 5e3, 0.3));
    Element now{model};
    for (int i = 0; i < 20; ++i) now = now.strained_with({0.002, 0, 0}, {0, 1, 1}, 1, 0);
    CHECK(std::abs(now.stress()[0] - 5e3) <= 1e-6);
    CHECK(std::abs(now.stress()[1]) <= 1e-6);
    CHECK(now.strain[1] == Approx(-0.3 * 5e3 / 1e6).epsilon(1e-9));
    CHECK(now.soil.plastic_strain == Approx(0.04 - 5e3 / 1e6).epsilon(1e-9));
}

namespace {

/// The numbers of the stress after a return, with derivatives.
template <class T, int D>
Mat<T, D> stress_after(const Model& plain, const Mat<T, D>& F) {
    typename MohrCoulomb<T>::template state<D> state;
    state.F = DeformationGradient<T, D>(F);
    return lift<T>(plain).returned_with_stress(state).stress;
}
/// The difference of the derivative of the stress along dF from a central difference, relative to the moduli.
template <int D>
double error_of_tangent(const Model& model, const Mat<double, D>& F, const Mat<double, D>& dF) {
    Mat<dual<double>, D> lifted;
    for (int k = 0; k < D * D; ++k) lifted.m[k] = {F.m[k], dF.m[k]};
    const auto got = stress_after<dual<double>, D>(model, lifted);
    const double h = 1e-6;
    const auto at = [&](double t) { return stress_after<double, D>(model, F + dF * t); };
    const auto a = at(h), b = at(-h), c = at(2 * h), d = at(-2 * h);
    double error = 0;
    for (int k = 0; k < D * D; ++k)
        error = std::max(error, std::abs(got.m[k].derivative - (8 * (a.m[k] - b.m[k]) - (c.m[k] - d.m[k])) / (12 * h)));
    return error / (2 * model.mu + D * model.lambda);
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("dual numbers give the tangent in every region of Mohr–Coulomb, at equal strains, too",
                       "[material][dual]", ((int D), D), 2, 3) {
    Random random(82);
    int by_active[D + 1] = {}, equal = 0;
    double worst = 0;
    for (const double tension : {none, 4e3})
        for (const double dilatancy : {30., 10., 0.}) {
            const auto model = Model::from_properties(properties(1e4, 30, dilatancy, tension, 0.3));
            for (int k = 0; k < test_support::fewer_if_quick(1000, 100); ++k) {
                const Vec<double, D> e = strains<D>(random, 0.04, 0.03);
                const Numbers<D> trial = elasticity_of<D>(model) * vector_of<D>(e);
                const auto solutions = all_solutions<D>(model, trial, 1e4);
                // Within 1e-3 of a border of regions there is another region nearby.
                bool near_border = solutions.empty() || excess_of(planes_of<D>(model), trial) < 1e3;
                for (const auto& one : solutions)
                    near_border = near_border || one.least_flow < 100 || (one.active < D && one.least_slack < 100);
                if (near_border) continue;
                ++by_active[solutions[0].active];
                equal += e[0] - e[1] < 1e-9 || e[1] - e[D - 1] < 1e-9;
                const Mat<double, D> F = strained<D>(random, e).F;
                const double error = error_of_tangent<D>(model, F, random.gaussian<D>());
                CAPTURE(tension, dilatancy, e[0], e[1], e[D - 1]);
                if (error > 1e-8) CHECK(error <= 1e-8);
                worst = std::max(worst, error);
            }
        }
    for (int n = 1; n <= D; ++n) CHECK(by_active[n] > test_support::fewer_if_quick(100, 10));
    CHECK(equal > test_support::fewer_if_quick(100, 10));
    CAPTURE(worst, equal);
    CHECK(worst > 0);
    CHECK(worst <= 1e-8);
}

namespace {

constexpr MohrCoulombProperties softening_soil{.young = 1e6,
                                               .poisson = 0.3,
                                               .cohesion = 1e4,
                                               .friction_angle = degrees(35),
                                               .dilatancy_angle = degrees(12),
                                               .tension = 6e3,
                                               .residual_cohesion = 1e3,
                                               .residual_friction_angle = degrees(25),
                                               .residual_dilatancy_angle = degrees(0),
                                               .softening_strain = 0.2};
/// Soil without softening that has the strength after a plastic shear strain γ.
template <template <class> class M, class S>
M<S> hardened_to(const M<S>& model, double gamma) {
    const double part = std::min(gamma / double(model.softening_strain), 1.);
    const auto between = [&](S peak, S residual) { return S(peak + (residual - peak) * part); };
    M<S> perfect = model;
    perfect.cohesion = between(model.cohesion, model.residual_cohesion);
    perfect.friction_angle = between(model.friction_angle, model.residual_friction_angle);
    perfect.dilatancy_angle = between(model.dilatancy_angle, model.residual_dilatancy_angle);
    perfect.softening_strain = 0;
    return perfect;
}

/// Returns of soil that softens within a step: γ and stress must be those of perfect soil with the strength of γ. The
/// error left by the fixed number of passes, of γ [of the step's γ].
template <class S, int D>
double softening_error(const MohrCoulomb<S>& model, int states) {
    Random random(83);
    double worst = 0;
    int softened = 0, entirely = 0;
    for (int k = 0; k < states; ++k) {
        auto start = strained<D>(random, strains<D>(random, 0.04, 0.04));
        start.plastic_strain = k % 4 ? random.uniform(0, 0.2) : 0;
        const auto state = converted<typename MohrCoulomb<S>::template state<D>>(start);
        const auto after = model.returned_with_stress(state);
        const double before = double(state.plastic_strain), gamma = double(after.state.plastic_strain);
        if (std::abs(gamma - before) <= 1e-6) continue;
        const auto expected = hardened_to(model, gamma).returned_with_stress(state);
        const double error = std::abs(double(expected.state.plastic_strain) - gamma) / std::abs(gamma - before);
        if (!(error <= worst)) worst = error;  // keeps NaN
        gamma < double(model.softening_strain) ? ++softened : ++entirely;
    }
    CHECK(softened > states / 8);
    CHECK(entirely > states / 40);
    return worst;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("soil that softens has the strength of its plastic shear strain after the step", "[material]",
                       ((int D), D), 2, 3) {
    const int states = test_support::fewer_if_quick(10000, 1000);
    const double error = softening_error<double, D>(Model::from_properties(softening_soil), states);
    const double of_float = softening_error<float, D>(MohrCoulomb<float>::from_properties(softening_soil), states);
    CAPTURE(error, of_float);
    CHECK(error <= 1e-9);
    CHECK(of_float <= 1e-3);
}

TEST_CASE("after a large shear soil has its residual strength; its first one at first", "[material]") {
    const auto model = Model::from_properties(softening_soil);
    // Plane strain at a kept pressure.
    Element now = Element{model}.strained_with({0, 0, 0}, {1, 1, 1}, 0, -2e4);
    double most = 0;
    for (int i = 0; i < 200; ++i) {
        now = now.strained_with({-0.002, 0, 0}, {0, 1, 0}, 1, -2e4);
        most = std::max(most, -now.stress()[0]);
    }
    const auto strength = [](double cohesion, double angle) {
        const double s = std::sin(degrees(angle).in_radians()), N = (1 + s) / (1 - s);
        return 2e4 * N + 2 * cohesion * std::sqrt(N);
    };
    CHECK(-now.stress()[0] == Approx(strength(1e3, 25)).epsilon(1e-10));
    CHECK(most <= strength(1e4, 35) * (1 + 1e-12));
    CHECK(most >= 0.95 * strength(1e4, 35));
    CHECK(now.soil.plastic_strain > 0.3);
    // It keeps its volume once the dilatancy angle has fallen to 0.
    const Element next = now.strained_with({-0.002, 0, 0}, {0, 1, 0}, 1, -2e4);
    CHECK(std::abs((next.plastic() - now.plastic()).sum()) <= 1e-12);
}

TEST_CASE("the work of a band does not depend on the cell size, if the softening strain is scaled by it",
          "[material]") {
    // A band as wide as a cell is sheared without friction, in 2D. What it does beyond the work of the residual
    // strength, per area of the band, is ½ (c − c_r) softening_strain · band_width.
    const SofteningBand<Model> model{Model::from_properties({.young = 1e8,
                                                             .cohesion = 1e4,
                                                             .friction_angle = degrees(0),
                                                             .residual_cohesion = 2e3,
                                                             .softening_strain = 0.5}),
                                     0.02};
    CHECK(model.softening_strain_in(0.02) == Approx(0.5).epsilon(1e-14));
    const double expected = 0.5 * (1e4 - 2e3) * 0.5 * 0.02;
    for (const double cell_size : {0.01, 0.02, 0.1, 0.4}) {
        Surroundings<double, 2> here{};
        here.cell_size = cell_size;
        const SofteningBand<Model> scaled = model.at(here);
        CHECK(scaled.softening_strain == model.softening_strain_in(cell_size));
        Soil<2> soil;
        double work = 0, before = 0;
        const double rate = scaled.softening_strain / 500;
        for (int i = 0; i < 1500; ++i) {
            Mat<double, 2> shear = Mat<double, 2>::zero();
            shear(0, 0) = std::expm1(0.5 * rate), shear(1, 1) = std::expm1(-0.5 * rate);
            soil = updated(scaled, soil, shear, 1.0);
            const Mat<double, 2> tau = kirchhoff_stress(scaled, soil);
            const double strength = 0.5 * (tau(0, 0) - tau(1, 1));
            work += (0.5 * (strength + before) - 2e3) * rate * cell_size * (i > 0);
            before = strength;
        }
        CHECK(scaled.at(here).softening_strain == Approx(scaled.softening_strain).epsilon(1e-14));
        // The elastic strain at yield, (c − c_r)/(2 μ), is at most 2 % of the smallest softening strain.
        CAPTURE(cell_size);
        CHECK(before == Approx(2e3).epsilon(1e-9));
        CHECK(work == Approx(expected).epsilon(0.02));
    }
}

TEMPLATE_TEST_CASE_SIG("Mohr–Coulomb: stress from energy, objectivity, isotropy, wave speed, lanes, floats, NaN",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    Random random(84);
    for (const MohrCoulombProperties& of : {softening_soil, properties(1e4, 30, 10, 4e3, 0.3),
                                            properties(1e4, 30, 10, none, 0.3), properties(1e4, 0, 0, none, 0.3)}) {
        const auto model = Model::from_properties(of);
        for (int trial = 0; trial < 20; ++trial) {
            const Soil<D> state = model.returned(strained<D>(random, strains<D>(random, 0.1, 0.05)));
            CAPTURE(trial);
            check_energy<MohrCoulomb, D>(model, state, model.mu);
            check_turned<MohrCoulomb, D>(model, state, random, model.mu);
            check_wave_speed<MohrCoulomb, D>(model, state, random);
        }
        const auto state_of = [](int i) {
            Random of_state(std::uint64_t(500 + i));
            const double size = i % 2 ? 0.05 : 0.005;
            Soil<D> state = strained<D>(of_state, strains<D>(of_state, size, size));
            state.plastic_strain = i % 3 ? 0 : of_state.uniform(0, 0.2);
            return state;
        };
        const auto small = MohrCoulomb<float>::from_properties(of);
        check_nan<D>(small);
        check_lanes<float, D>(small, state_of, 320);
        check_lanes<double, D>(model, state_of, 160);
        for (int i = 0; i < 50; ++i) check_float<D>(small, state_of(i), 100);
    }
}

TEST_CASE("Mohr–Coulomb refuses properties that are none", "[material][error]") {
    using test_support::holds;
    const auto from = [](const MohrCoulombProperties& p) { return MohrCoulomb<float>::from_properties(p); };
    const auto said = [&](const MohrCoulombProperties& p) {
        return test_support::message<parameter_error>([&] { from(p); });
    };
    CHECK_THROWS_AS(from({.young = 0}), parameter_error);
    CHECK_THROWS_AS(from({.poisson = 0.5}), parameter_error);
    for (const double wrong : {-1.0, std::nan(""), double(INFINITY)}) {
        CHECK(holds(said({.cohesion = wrong}), "The cohesion is"));
        CHECK(holds(said({.residual_cohesion = wrong}), "The residual cohesion is"));
        CHECK(holds(said({.softening_strain = wrong}), "The softening strain is"));
    }
    for (const double wrong : {-1.0, std::nan("")}) CHECK(holds(said({.tension = wrong}), "The tension cut-off is"));
    CHECK(holds(said({.friction_angle = degrees(90)}), "The friction angle is 90 degrees"));
    CHECK(holds(said({.friction_angle = degrees(20), .dilatancy_angle = degrees(21)}),
                "The dilatancy angle is 21 degrees and the friction angle 20"));
    CHECK(holds(said({.dilatancy_angle = degrees(-1)}), "at least 0 and at most the friction angle"));
    CHECK(holds(said({.residual_friction_angle = degrees(5), .residual_dilatancy_angle = degrees(6)}),
                "The residual dilatancy angle is 6 degrees"));
    for (const MohrCoulombProperties& harder :
         {MohrCoulombProperties{.residual_cohesion = 2e4, .softening_strain = 0.1},
          MohrCoulombProperties{.residual_friction_angle = degrees(26), .softening_strain = 0.1},
          MohrCoulombProperties{
              .residual_friction_angle = degrees(2), .residual_dilatancy_angle = degrees(1), .softening_strain = 0.1}})
        CHECK(holds(said(harder), "no residual value may be larger"));
    CHECK_NOTHROW(from({.residual_cohesion = 2e4}));
    const MohrCoulomb<float> defaults, same = from({});
    for_parameters(defaults, [&](const std::string& name, const char*, const float& value) {
        for_parameters(same, [&](const std::string& other, const char*, const float& of_other) {
            if (name == other) CHECK(value == Approx(of_other).epsilon(1e-6));
        });
    });
}

TEST_CASE("inverted soil that yields becomes upright", "[material]") {
    // At a Poisson's ratio of 0.2 it does: the pressure aside is a quarter of that along the axis, less than 1/N =
    // 0.41.
    const auto model = MohrCoulomb<float>::from_properties({.poisson = 0.2});
    for (const float first : {-0.01F, -0.7F, -1.3F}) {
        MohrCoulomb<float>::state<3> state;
        state.F(0, 0) = first;
        check_upright(model.returned(state).F, 1e-5, 0.5);
    }
}

TEST_CASE("A weakened soil has its cohesion and the tangent of its friction angle divided") {
    auto soil = MohrCoulomb<double>::from_properties({.cohesion = 1e4,
                                                      .friction_angle = degrees(30),
                                                      .dilatancy_angle = degrees(25),
                                                      .residual_cohesion = 1e3,
                                                      .residual_friction_angle = degrees(20),
                                                      .softening_strain = 0.1});
    auto weak = soil;
    weak.weaken(1.5);
    CHECK(weak.cohesion == Approx(1e4 / 1.5));
    CHECK(std::tan(weak.friction_angle) == Approx(std::tan(soil.friction_angle) / 1.5));
    CHECK(weak.dilatancy_angle == weak.friction_angle);
    CHECK(weak.residual_cohesion == Approx(1e3 / 1.5));
    CHECK(std::tan(weak.residual_friction_angle) == Approx(std::tan(soil.residual_friction_angle) / 1.5));
    CHECK(weak.mu == soil.mu);
    CHECK_NOTHROW(check_material<3>(weak));
    CHECK_THROWS_AS(soil.weaken(0), parameter_error);
}

}  // namespace mohr_coulomb_tests
