/// \file Which solids a simulation warns of as too thin for its cells, and how thick it finds them.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/contact/coulomb.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/firn.hpp>

#include "data/meshes.hpp"

using namespace firn;
using test_support::holds;

namespace solid_warnings_tests {

namespace {

constexpr double h = 1.0 / 32;

/// A plate of a user across the domain: 0.6 x + 0.8 y is at most `half` [m].
template <scalar S, int D>
struct Plate {
    S half = S(0.1);
    static constexpr const char* name = "plate";
    static constexpr auto parameters() { return std::tuple{parameter{"half", "m", &Plate::half}}; }
    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const { return abs(S(0.6) * x[0] + S(0.8) * x[1]) - half; }
};

template <class Boundary>
std::string warning(const Boundary& boundary, bool has_groups = false) {
    constexpr int D = detail::made_for<Boundary>::D;
    return detail::thin_solids(boundary, Domain<D>{Vec<double, D>::zero(), Vec<double, D>::filled(1), h}, has_groups);
}

/// Checks that there is a warning of a solid of this thickness [cells] if it is below a limit, and else none.
void check(const std::string& said, double cells, double limit) {
    CAPTURE(cells, limit, said);
    REQUIRE(said.empty() == (cells >= limit));
    if (!said.empty()) CHECK(std::abs(std::stod(said.substr(said.find(" m thick, ") + 10)) - cells) < 1e-4);
}

template <class Shape>
Collider<Shape> placed(const Shape& shape) {
    Collider<Shape> solid{.shape = shape};
    solid.position = Vec<double, Collider<Shape>::D>::filled(0.4);
    if constexpr (Collider<Shape>::D == 2)
        solid.rotation = rotor(radians(0.3));
    else
        solid.rotation = rotor({1, 2, 3}, radians(0.7));
    return solid;
}

}  // namespace

TEST_CASE("solids thinner than 3 cells are warned of once, with their thickness", "[simulation]") {
    for (const double cells : {0.4, 1.6, 2.4, 2.98, 3.0, 4.0, 20.0}) {
        const float half = float(cells * h / 2);
        check(warning(placed(Box<float, 2>{{half, 0.4F}})), cells, 3);
        check(warning(placed(Box<float, 2>{{0.4F, half}})), cells, 3);
        check(warning(placed(Plate<float, 2>{half})), cells, 3);
        check(warning(placed(Box<float, 3>{{0.4F, 0.1F, half}})), std::min(cells, 0.2 / h), 3);
        check(warning(placed(Capsule<float, 3>{0.1F, half})), cells, 3);
        const BoundaryList<Collider<Box<float, 2>>> list{{placed(Box<float, 2>{{0.2F, 0.2F}}),
                                                          placed(Box<float, 2>{{half, 0.2F}}),
                                                          placed(Box<float, 2>{{half, 0.2F}})}};
        check(warning(Together(Walls<float, 2>::all({0, 0}, {1, 1}, {}), list)), cells, 3);
    }
}

TEST_CASE("thin meshes are warned of; interpolation makes their thickness uncertain by a spacing's diagonal",
          "[simulation][slow]") {
    for (const double cells : {0.3, 1.2, 1.6, 2.1, 2.4, 3.1, 5.0})
        for (const double spacing : {h, h / 2, h / 4}) {
            const double half = cells * h / 2, uncertainty = std::sqrt(3.0) * spacing / h;
            const auto mesh =
                mesh_distance(test_meshes::box({-half, -0.2, -0.15}, {half, 0.2, 0.15}), {.spacing = spacing});
            const std::string said = warning(placed(DistanceGrid<float, 3>{mesh}));
            CAPTURE(cells, spacing / h, said);
            if (cells + uncertainty < 3) REQUIRE_FALSE(said.empty());
            if (cells > 3) REQUIRE(said.empty());
            if (said.empty()) continue;
            const double found = std::stod(said.substr(said.find(" m thick, ") + 10));
            CHECK(found > cells - uncertainty);
            CHECK(found < cells + uncertainty);
        }
}

TEST_CASE("by the gap, solids thinner than 2.5 cells are warned of, unless there are contact groups", "[simulation]") {
    for (const double cells : {0.4, 1.6, 2.4, 2.6, 3.0}) {
        const auto box = placed(Box<float, 2>{{float(cells * h / 2), 0.4F}});
        check(warning(GapContact{box}), cells, 2.5);
        check(warning(GapContact{Together(Walls<float, 2>::all({0, 0}, {1, 1}, {}), box)}), cells, 2.5);
        check(warning(GapContact{box}, true), cells, 0);
        check(warning(box, true), cells, 3);
    }
    const auto said = warning(GapContact{placed(Box<float, 2>{{0.03125F, 0.4F}})});
    CHECK(holds(said, "a collider_box at (0.4, 0.4) m is about 0.0625 m thick, 2 cells"));
    CHECK(holds(said, "contact group"));
}

TEST_CASE("solids that are not thin, and those that hold or do not act, are not warned of", "[simulation]") {
    CHECK(warning(placed(Sphere<float, 2>{0.01F})).empty());  // a ball does not pull
    CHECK(warning(Collider<HalfSpace<float, 2>>{}).empty());
    CHECK(warning(Walls<float, 2>::all({0, 0}, {1, 1}, {})).empty());
    auto stick = placed(Box<float, 2>{{0.01F, 0.2F}});
    stick.contact = Contact::stick;
    CHECK(warning(stick).empty());
    stick.contact = Contact::none;
    CHECK(warning(stick).empty());
    stick.contact = Contact::slip;
    CHECK(!warning(stick).empty());
    Collider<Complement<Box<float, 2>>> container{.shape = {{{0.49F, 0.49F}}}, .position = {0.5, 0.5}};
    CHECK(warning(container).empty());
    CHECK(warning(placed(Box<float, 2>{{0.05F, 0.05F}})).empty());
}

TEST_CASE("a simulation warns of a thin solid once, before the first step", "[simulation]") {
    const Domain<2> domain{{0, 0}, {1, 1}, h};
    const auto count = [&](auto simulation) {
        int thin = 0;
        simulation.warn = [&](const std::string& text) { thin += holds(text, "1.6 cells: "); };
        simulation.add(sample_box<2>({0.8, 0.8}, {0.9, 0.9}, {.spacing = h / 2}), 1000);
        for (int i = 0; i < 3; ++i) simulation.step();
        return thin;
    };
    const auto box = placed(Box<double, 2>{{0.8 * h, 0.2}});
    CHECK(count(Simulation(domain, FixedCorotated<double>{}, GapContact{box})) == 1);
    CHECK(count(Simulation(domain, FixedCorotated<double>{}, GapContact{box}, CoulombContact{})) == 0);
}

}  // namespace solid_warnings_tests
