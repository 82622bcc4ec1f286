/// \file The normal and the gap between two contact groups at a node: against known planes, and independent of the
/// order of particles.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/exec/separation.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>

#include <algorithm>
#include <vector>

namespace separation_tests {

using namespace firn;

template <int D>
using Near = detail::NearParticles<QuadraticBSpline, D>;

/// Two half-spaces of particles, half a cell apart on lattices of their own that are turned with the plane between
/// them. The nodes of a block lie around a point of the plane.
template <int D>
struct HalfSpaces {
    Near<D> above, below;
    Vec<double, D> normal;
    Vec<double, D> point;
    std::vector<double> distances{};  ///< of the nodes from the plane

    HalfSpaces(std::uint64_t seed, double gap, double jitter, bool reversed = false) {
        std::uint64_t next = 100'000 * seed;
        const auto random = [&] { return 2 * scenes::noise(next++) - 1; };
        Vec<double, D> axis[D];
        for (int a = 0; a < D; ++a) {  // Gram and Schmidt
            for (int c = 0; c < D; ++c) axis[a][c] = random();
            for (int b = 0; b < a; ++b) axis[a] -= axis[b] * dot(axis[a], axis[b]);
            axis[a] = axis[a] * (1 / norm(axis[a]));
        }
        normal = axis[0];
        for (int a = 0; a < D; ++a) point[a] = 1.5 + 0.5 * random();
        int low[D], high[D];
        std::fill_n(low, D, 0);
        std::fill_n(high, D, block_size - 1);
        above.clear(low, high), below.clear(low, high);
        constexpr int most = 12;
        std::uint32_t id = 0;
        for (int i = -most; i < most; ++i)
            for (int k = -most; k < most; ++k)
                for (int l = D == 3 ? -most : 0; l < (D == 3 ? most : 1); ++l) {
                    const double steps[3] = {i + 0.5, k + 0.3, l + 0.1};
                    Vec<double, D> x = point + normal * (i < 0 ? -0.5 * gap : 0.5 * gap);
                    for (int a = 0; a < D; ++a) x += axis[a] * (0.5 * steps[a]);
                    for (int a = 0; a < D; ++a) x[a] += 0.5 * jitter * random();
                    add(i < 0 ? below : above, id++, x);
                }
        for (Near<D>* near : {&above, &below}) {
            if (reversed) std::reverse(near->found.begin(), near->found.end());
            near->sort();
        }
    }

private:
    static void add(Near<D>& near, std::uint32_t id, const Vec<double, D>& x) {
        typename Near<D>::Particle particle{id, 0, {}, 0.25f};
        for (int a = 0; a < D; ++a) {
            particle.place[a] = float(x[a]);
            const int base = int(std::floor(particle.place[a] - 0.5f)) - near.first(a);
            if (base < 0 || base >= near.bins(a)) return;
            particle.bin = particle.bin * std::uint32_t(near.bins(a)) + std::uint32_t(base);
        }
        near.found.push_back(particle);
    }
};

struct Errors {
    std::vector<double> angles, gaps;
};
/// Looks at all nodes of a block that both groups reach.
template <int D>
Errors errors(double gap, double jitter, ContactNormals how) {
    Errors all;
    for (std::uint64_t seed = 1; seed <= (D == 2 ? 40 : 12); ++seed) {
        const HalfSpaces<D> of(seed, gap, jitter);
        for (int n = 0; n < block_nodes<D>; ++n) {
            int node[D];
            for (int a = 0; a < D; ++a) node[a] = n >> 2 * a & 3;
            const auto found = Separator<QuadraticBSpline, D>{}(of.above, of.below, node, Vec<double, D>::zero(), 10,
                                                                how, Vec<double, D>::zero());
            if (!found.may_touch) continue;
            all.angles.push_back(std::acos(std::min(1.0, dot(found.normal, of.normal))));
            all.gaps.push_back(found.gap - gap);
        }
    }
    std::ranges::sort(all.angles);
    std::ranges::sort(all.gaps);
    return all;
}
double part(const std::vector<double>& sorted, double share) {
    return sorted[std::size_t(share * double(sorted.size()))];
}

template <int D>
void check_planes() {
    constexpr double degree = 3.14159265358979 / 180;
    for (const double gap : {0.0, 0.3}) {
        const Errors regular = errors<D>(gap, 0, ContactNormals::regression);
        CAPTURE(D, gap, part(regular.angles, 0.5) / degree, part(regular.angles, 0.9) / degree);
        CAPTURE(part(regular.gaps, 0.1), part(regular.gaps, 0.5), regular.gaps.back());
        REQUIRE(regular.angles.size() > 100);
        CHECK(part(regular.angles, 0.5) < 1 * degree);
        CHECK(part(regular.angles, 0.9) < 6 * degree);
        CHECK(std::abs(part(regular.gaps, 0.5)) < 0.015);
        CHECK(part(regular.gaps, 0.1) > -0.02);
        CHECK(regular.gaps.back() < 0.1 * 1.5 * 1.5);  // a particle 1.5 cells beside the node lies deeper by ½ κ l²
        // Jitter up to a tenth of a cell on both sides: the gap between the outermost particles is smaller by up to
        // 0.2, times the largest component sum of a direction.
        const Errors rough = errors<D>(gap, 0.2, ContactNormals::regression);
        CHECK(part(rough.angles, 0.5) < 2 * degree);
        CHECK(part(rough.gaps, 0.5) > -0.25);
    }
    // The normal of the gradients of volumes is the cheap choice.
    const Errors cheap = errors<D>(0, 0, ContactNormals::volume_gradient);
    CHECK(part(cheap.angles, 0.5) < 6 * degree);
    CHECK(part(cheap.gaps, 0.5) > -0.3);
}

TEST_CASE("The plane between two half-spaces is found, at any angle, with and without jitter") {
    check_planes<2>();
    check_planes<3>();
}

TEST_CASE("The surface between two groups does not depend on the order of particles") {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        const HalfSpaces<3> one(seed, 0.1, 0.2), other(seed, 0.1, 0.2, true);
        for (int n = 0; n < 64; ++n) {
            const int node[3] = {n >> 4, n >> 2 & 3, n & 3};
            const auto find = [&](const HalfSpaces<3>& of) {
                return Separator<QuadraticBSpline, 3>{}(of.above, of.below, node, Vec<double, 3>::zero(), 10,
                                                        ContactNormals::regression, Vec<double, 3>::zero());
            };
            const auto a = find(one), b = find(other);
            CHECK(a.gap == b.gap);
            for (int k = 0; k < 3; ++k) CHECK(a.normal[k] == b.normal[k]);
        }
    }
}

TEST_CASE("Groups that a plane separates before and after the step do not touch") {
    const HalfSpaces<2> of(3, 0.2, 0);
    const int node[2] = {1, 1};
    const auto may_touch = [&](double along, double reach) {
        return Separator<QuadraticBSpline, 2>{}(of.above, of.below, node, of.normal * along, reach,
                                                ContactNormals::regression, Vec<double, 2>::zero())
            .may_touch;
    };
    CHECK_FALSE(may_touch(0, 0));
    CHECK_FALSE(may_touch(0.3, 0));
    CHECK(may_touch(-0.25, 0));
    CHECK(may_touch(0, 0.3));
}

TEST_CASE("A symmetric system is solved, and one that is not definite is refused") {
    double A[3][3] = {{4, 0, 0}, {2, 5, 0}, {-2, 1, 6}}, b[3];
    const double x[3] = {1, 0.5, 2};
    const double full[3][3] = {{4, 2, -2}, {2, 5, 1}, {-2, 1, 6}};
    for (int i = 0; i < 3; ++i) {
        b[i] = 0;
        for (int k = 0; k < 3; ++k) b[i] += full[i][k] * x[k];
    }
    REQUIRE(detail::solve_definite(A, b));
    for (int i = 0; i < 3; ++i) CHECK(b[i] == Approx(x[i]).epsilon(1e-14));
    double singular[2][2] = {{1, 0}, {1, 1}}, right[2] = {1, 1};
    CHECK_FALSE(detail::solve_definite(singular, right));
}

}  // namespace separation_tests
