/// \file The normal and the gap between two contact groups at a node: against known planes, and independent of the
/// order of particles.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/loops/near_particles.hpp>
#include <firn/loops/separation.hpp>

#include <algorithm>
#include <vector>

namespace separation_tests {

using namespace firn;

template <int D>
using Near = NearParticles<QuadraticBSpline, D>;

/// Two half-spaces of particles, half a cell apart on lattices of their own that are turned with the plane between
/// them. The nodes of a block lie around a point of the plane.
template <int D>
struct HalfSpaces {
    Near<D> above, below;
    typename Near<D>::Blocks blocks{};
    std::vector<std::pair<BlockCoordinate<D>, typename Near<D>::Particle>> above_found{}, below_found{};
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
        constexpr int most = 12;
        std::uint32_t id = 0;
        for (int i = -most; i < most; ++i)
            for (int k = -most; k < most; ++k)
                for (int l = D == 3 ? -most : 0; l < (D == 3 ? most : 1); ++l) {
                    const double steps[3] = {i + 0.5, k + 0.3, l + 0.1};
                    Vec<double, D> x = point + normal * (i < 0 ? -0.5 * gap : 0.5 * gap);
                    for (int a = 0; a < D; ++a) x += axis[a] * (0.5 * steps[a]);
                    for (int a = 0; a < D; ++a) x[a] += 0.5 * jitter * random();
                    add(i < 0 ? below_found : above_found, id++, x);
                }
        fill(above, above_found, reversed);
        fill(below, below_found, reversed);
    }

    /// Returns the surface between the half-spaces at a node.
    Separation<D> at(int n, const Vec<double, D>& moved, double reach, ContactNormals how) const {
        detail::AroundBlock<QuadraticBSpline, D> around[2];
        above.gather(blocks, std::uint64_t(1) << n, around[0]);
        below.gather(blocks, std::uint64_t(1) << n, around[1]);
        return Separator<QuadraticBSpline, D>{}({around[0], n}, {around[1], n}, moved, reach, how,
                                                Vec<double, D>::zero());
    }

private:
    static Domain<D> domain() { return {Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 64}; }
    void fill(Near<D>& near, auto found, bool reversed) {
        if (reversed) std::reverse(found.begin(), found.end());
        blocks = near.want_around(domain(), {});
        near.connect(domain(), {});
        near.mark_around(blocks, ~std::uint64_t(0));
        const auto share = [&](Near<D>& lists) {
            for (const auto& [of, particle] : found) lists.found(lists.find(block_key<D>(of))).push_back(particle);
        };
        near.find(domain(), Mirrors{}, 1, share, ParticleSets<MotionView<float, D, BlockedSpan<float>>>{});
    }
    static void add(auto& found, std::uint32_t id, const Vec<double, D>& x) {
        typename Near<D>::Particle particle{{}, 0.25f, id, 0};
        BlockCoordinate<D> of;
        for (int a = 0; a < D; ++a) {
            const int base = int(std::floor(float(x[a]) - 0.5f));
            of[std::size_t(a)] = base >> 2;
            if (base < -4 || base > 3) return;
            particle.bin = particle.bin * 4 + std::uint32_t(base & 3);
            particle.place[a] = float(x[a]) - float(4 * (base >> 2));
        }
        found.emplace_back(of, particle);
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
            const auto found = of.at(n, Vec<double, D>::zero(), 10, how);
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
            const auto a = one.at(n, Vec<double, 3>::zero(), 10, ContactNormals::regression);
            const auto b = other.at(n, Vec<double, 3>::zero(), 10, ContactNormals::regression);
            CHECK(a.gap == b.gap);
            for (int k = 0; k < 3; ++k) CHECK(a.normal[k] == b.normal[k]);
        }
    }
}

TEST_CASE("Groups that a plane separates before and after the step do not touch") {
    const HalfSpaces<2> of(3, 0.2, 0);
    const auto may_touch = [&](double along, double reach) {
        return of.at(5, of.normal * along, reach, ContactNormals::regression).may_touch;
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
