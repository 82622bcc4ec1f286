// quick: -O1
// part: arithmetic
/// \file Functions and shapes that are sampled on a grid of distances, and what is refused.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/data/sampled_distance.hpp>

#include <string>

using namespace firn;

namespace sampled_distance_tests {
namespace {

/// A grid of these options is refused with an E that says `part`.
template <class E = parameter_error, int D, class F>
void check_refused(const F& f, const SampledDistanceOptions<D>& options, const std::string& part) {
    test_support::check_refused<E>([&] { (void)sampled_distance<D>(f, options); }, part);
}

}  // namespace

TEST_CASE("a function is sampled at each node, the last axis first", "[data][sampled_distance]") {
    const auto f = [](const Vec<double, 3>& x) { return 100 * x[0] + 10 * x[1] + x[2]; };
    const auto grid = sampled_distance<3, double>(f, {.lower = {1, 2, 3}, .upper = {1.5, 3, 4.2}, .spacing = 0.5});
    CHECK(grid->nodes == std::array{2, 3, 4});  // the last one reaches beyond 4.2
    CHECK(grid->lower == Vec<double, 3>{1, 2, 3});
    CHECK(grid->spacing == 0.5);
    REQUIRE(grid->values.size() == 24);
    std::size_t k = 0;
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 3; ++j)
            for (int l = 0; l < 4; ++l)
                CHECK(grid->values[k++] == Approx(100 * (1 + 0.5 * i) + 10 * (2 + 0.5 * j) + 3 + 0.5 * l));
    const auto fits = sampled_distance<2>([](const auto& x) { return x[0]; },
                                          {.lower = {0, 0}, .upper = {0.3, 0.7}, .spacing = 0.1, .exact_up_to = 0.2});
    CHECK(fits->nodes == std::array{4, 8});
    CHECK(fits->exact_up_to == 0.2);
}

TEST_CASE("a sampled shape acts as the shape does", "[data][sampled_distance]") {
    const auto check = [](auto dimension) {
        constexpr int D = dimension;
        const Sphere<float, D> ball{0.3F};
        using V = Vec<double, D>;
        const Collider<DistanceGrid<float, D>> sampled{
            .shape = {sampled_distance<D>(ball, {.lower = V::filled(-0.4), .upper = V::filled(0.4), .spacing = 0.02})},
            .friction = 0.3};
        const Collider<Sphere<float, D>> exact{.shape = ball, .friction = 0.3};
        for (double angle = 0; angle < 6; angle += 0.1) {
            const V x = V{std::cos(angle), std::sin(angle)} * 0.29;
            CHECK(sampled.shape.signed_distance(cast<float>(x)) == Approx(-0.01).margin(1e-3));
            const auto v = Vec<float, D>{1, -2};
            CHECK(norm(sampled.velocity(cast<float>(x), v) - exact.velocity(cast<float>(x), v)) < 0.1F);
        }
    };
    check(std::integral_constant<int, 2>{});
    check(std::integral_constant<int, 3>{});
}

TEST_CASE("grids that cannot be sampled are refused", "[data][sampled_distance]") {
    using Options = SampledDistanceOptions<2>;
    const auto right = [](const Vec<double, 2>& x) { return x[0]; };
    const auto refused = [&](const Options& options, const std::string& part) { check_refused(right, options, part); };
    const Options good{.lower = {0, 0}, .upper = {1, 1}, .spacing = 0.25};
    const auto with = [&](const auto& change) {
        Options other = good;
        change(other);
        return other;
    };
    const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
    CHECK(sampled_distance<2>(right, good)->nodes == std::array{5, 5});
    for (const double bad : {0.0, -1.0, nan, infinite})
        refused(with([&](Options& o) { o.spacing = bad; }), "The spacing of a grid of distances is");
    for (const double bad : {0.0, -1.0, nan, infinite})
        refused(with([&](Options& o) { o.upper[1] = bad; }), "along axis 1");
    refused(with([&](Options& o) { o.lower[0] = nan; }), "along axis 0");
    for (const double bad : {0.0, -1.0, nan}) refused(with([&](Options& o) { o.exact_up_to = bad; }), "up to");
    refused(with([](Options& o) { o.spacing = 1e-3, o.most_bytes = 1e6; }), "1002001 nodes, 4008004 bytes");
    check_refused<memory_error>(right, with([](Options& o) { o.spacing = 1e-12; }),
                                "Take a wider spacing or a smaller box.");
    check_refused([&](const Vec<double, 2>& x) { return x[0] == 0.5 && x[1] == 0.75 ? nan : 1; }, good,
                  "The distance at (0.5, 0.75) m is nan");
    check_refused([](const Vec<double, 2>&) { return 1e300; }, good,  // beyond the range of float
                  "The distance at (0, 0) m is 1e+300");
    // A box thinner than one spacing has two nodes across.
    CHECK(sampled_distance<2>(right, with([](Options& o) { o.upper[0] = 0.01; }))->nodes == std::array{2, 5});
}

}  // namespace sampled_distance_tests
