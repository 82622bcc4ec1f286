/// \file How nodes at and beyond the faces of the box move: stick, slip, separate, Coulomb friction. The expected
/// velocities are those of the definition, written down for one axis at a time.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/core/dual.hpp>

using namespace firn;
using test_support::Random;

namespace {

constexpr Contact contacts[] = {Contact::stick, Contact::slip, Contact::separate};

template <int D>
Walls<double, D> unit_box(Contact contact, double friction) {
    return Walls<double, D>::all(Vec<double, D>::zero(), Vec<double, D>::filled(1), {contact, friction});
}
template <int D>
Vec<double, D> with(int axis, double along, double elsewhere) {
    Vec<double, D> r = Vec<double, D>::filled(elsewhere);
    r[axis] = along;
    return r;
}
template <int D>
Vec<double, D> tangential(Vec<double, D> v, int axis) {
    v[axis] = 0;
    return v;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("nodes inside the box are left alone to the bit", "[boundary]", ((int D), D), 2, 3) {
    Random random(30);
    for (Contact contact : contacts) {
        for (int trial = 0; trial < 50; ++trial) {
            const auto v = random.vector<D>(-5, 5);
            CHECK(unit_box<D>(contact, 0.5).velocity(random.vector<D>(0.01, 0.99), v) == v);
        }
    }
}

TEMPLATE_TEST_CASE_SIG(
    "one face: stick stops, slip stops the normal motion, separate lets matter leave; on the face and "
    "at the ghost nodes beyond it",
    "[boundary]", ((int D), D), 2, 3) {
    Random random(31);
    for (int axis = 0; axis < D; ++axis) {
        for (bool upper : {false, true}) {
            for (double beyond : {0.0, 0.05, 0.1}) {
                const Vec<double, D> x = with<D>(axis, upper ? 1 + beyond : -beyond, 0.5);
                for (int trial = 0; trial < 20; ++trial) {
                    const Vec<double, D> v = random.vector<D>(-2, 2);
                    const bool leaves = upper ? v[axis] < 0 : v[axis] > 0;
                    CAPTURE(axis, upper, beyond, trial);
                    CHECK(unit_box<D>(Contact::stick, 0).velocity(x, v) == Vec<double, D>::zero());
                    CHECK(unit_box<D>(Contact::slip, 0).velocity(x, v) == tangential(v, axis));
                    CHECK(unit_box<D>(Contact::separate, 0).velocity(x, v) == (leaves ? v : tangential(v, axis)));
                    if (leaves)
                        CHECK(unit_box<D>(Contact::separate, 0.7).velocity(x, v) == v);  // no friction without contact
                }
            }
        }
    }
}

TEMPLATE_TEST_CASE_SIG("Coulomb: the tangential speed falls by min(μ |Δv_n|, |v_t|) and keeps its direction",
                       "[boundary]", ((int D), D), 2, 3) {
    Random random(32);
    int stuck = 0, sliding = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const int axis = trial % D;
        const bool upper = trial / D % 2 == 1;
        const double friction = random.uniform(0, 2);
        const Vec<double, D> x = with<D>(axis, upper ? 1.02 : -0.02, 0.5);
        Vec<double, D> v = random.vector<D>(-2, 2);
        v[axis] = std::abs(v[axis]) * (upper ? 1 : -1);  // into the wall
        for (Contact contact : {Contact::slip, Contact::separate}) {
            const Vec<double, D> after = unit_box<D>(contact, friction).velocity(x, v);
            const double before_speed = norm(tangential(v, axis)), after_speed = norm(tangential(after, axis));
            const double lost = std::min(friction * std::abs(v[axis]), before_speed);
            CAPTURE(trial, friction);
            CHECK(after[axis] == 0);
            CHECK(before_speed - after_speed == Approx(lost).epsilon(1e-12).margin(1e-15));
            CHECK(norm(tangential(after, axis) * before_speed - tangential(v, axis) * after_speed) <= 1e-14);
            (lost < before_speed ? sliding : stuck)++;
        }
    }
    CHECK(stuck > 50);
    CHECK(sliding > 50);
}

TEMPLATE_TEST_CASE_SIG("no wall adds energy, whatever its contact and friction, faces, edges and corners", "[boundary]",
                       ((int D), D), 2, 3) {
    Random random(33);
    for (int trial = 0; trial < 2000; ++trial) {
        Walls<double, D> walls = unit_box<D>(Contact::stick, 0);
        for (auto* faces : {&walls.at_lower, &walls.at_upper})
            for (Wall& wall : *faces) wall = {contacts[int(random.uniform(0, 3))], random.uniform(0, 3)};
        const Vec<double, D> x = random.vector<D>(-0.5, 1.5), v = random.vector<D>(-5, 5);
        const Vec<double, D> after = walls.velocity(x, v);
        CAPTURE(trial);
        CHECK(dot(after, after) <= dot(v, v) * (1 + 1e-15));
        for (int a = 0; a < D; ++a) {  // and nothing goes on into a wall
            if (x[a] <= 0) CHECK(after[a] >= 0);
            if (x[a] >= 1) CHECK(after[a] <= 0);
        }
    }
}

TEMPLATE_TEST_CASE_SIG("in a corner all its faces act", "[boundary]", ((int D), D), 2, 3) {
    const Vec<double, D> into = Vec<double, D>::filled(-1);
    const Vec<double, D> corner = Vec<double, D>::zero();
    for (Contact contact : contacts) CHECK(unit_box<D>(contact, 0).velocity(corner, into) == Vec<double, D>::zero());
    CHECK(unit_box<D>(Contact::separate, 0).velocity(corner, -into) == -into);
    Walls<double, D> walls = unit_box<D>(Contact::slip, 0);  // a face that sticks, beside one that slips
    walls.at_lower[1].contact = Contact::stick;
    CHECK(walls.velocity(corner, -into) == Vec<double, D>::zero());
    const Vec<double, D> edge = with<D>(0, 0.0, 1.0);  // the lower face of x, the upper faces of the others
    CHECK(unit_box<D>(Contact::separate, 0).velocity(edge, with<D>(0, 2.0, 3.0)) == with<D>(0, 2.0, 0.0));
}

TEMPLATE_TEST_CASE_SIG("each face has its own condition", "[boundary]", ((int D), D), 2, 3) {
    Walls<double, D> walls = unit_box<D>(Contact::slip, 0);
    walls.at_upper[1] = {Contact::stick, 0};
    const Vec<double, D> v = Vec<double, D>::filled(1.0);
    CHECK(walls.velocity(with<D>(1, 1.0, 0.5), v) == Vec<double, D>::zero());
    CHECK(walls.velocity(with<D>(1, 0.0, 0.5), v) == tangential(v, 1));
    CHECK(walls.velocity(with<D>(0, 1.0, 0.5), v) == tangential(v, 0));
}

TEMPLATE_TEST_CASE("friction has derivatives everywhere, at rest and where it stops the motion, too",
                   "[boundary][dual]", double) {
    using S = dual<TestType>;
    const Vec<S, 2> normal{S(0), S(1)};
    const auto derivative = [&](S along, S across, double friction) {
        return velocity_after_contact(Vec<S, 2>{along, across}, normal, Contact::separate, S(friction))[0].derivative;
    };
    const S at_rest(0, 1), moving(2, 1), into(-1, 0);
    CHECK(derivative(at_rest, into, 0) == 1);    // frictionless: slides as it is pushed
    CHECK(derivative(at_rest, into, 0.5) == 0);  // held
    CHECK(derivative(at_rest, S(0), 0.5) == 1);  // nothing presses it on
    CHECK(derivative(moving, into, 0.5) == Approx(1));
    CHECK(derivative(moving, into, 3) == 0);                // stopped
    CHECK(derivative(S(2), S(-1, 1), 0.5) == Approx(0.5));  // pressed on less
}

TEMPLATE_TEST_CASE_SIG("reaches() tells whether a block of nodes is touched", "[boundary]", ((class S, int D), S, D),
                       (float, 2), (float, 3), (double, 2), (double, 3)) {
    const auto walls = Walls<S, D>::all(Vec<S, D>::zero(), Vec<S, D>::filled(S(1)), {Contact::stick, 0});
    const auto block = [](double low, double high) {
        return std::pair{Vec<double, D>::filled(low), Vec<double, D>::filled(high)};
    };
    const auto reaches = [&](const auto& b) { return walls.reaches(b.first, b.second); };
    CHECK_FALSE(reaches(block(0.1, 0.9)));
    CHECK(reaches(block(0, 0.5)));
    CHECK(reaches(block(0.5, 1)));
    CHECK(reaches(block(-0.5, -0.1)));
    CHECK(reaches(block(1.1, 1.5)));
    for (int axis = 0; axis < D; ++axis) {
        auto beyond = block(0.3, 0.6);
        beyond.first[axis] = -0.1;
        CHECK(reaches(beyond));
        beyond = block(0.3, 0.6);
        beyond.second[axis] = 1;
        CHECK(reaches(beyond));
    }
    // Never false where velocity() does something.
    Random random(34);
    for (int trial = 0; trial < 500; ++trial) {
        const Vec<double, D> low = random.vector<D>(-0.3, 1.2), high = low + Vec<double, D>::filled(0.15);
        Vec<S, D> corner{};
        for (int a = 0; a < D; ++a) corner[a] = S(random.uniform(0, 1) < 0.5 ? low[a] : high[a]);
        const Vec<S, D> v = Vec<S, D>::filled(S(1));
        if (!walls.reaches(low, high)) CHECK(walls.velocity(corner, v) == v);
    }
}

TEMPLATE_TEST_CASE("the nodes on a face are seen as such, however lower + i h is rounded", "[boundary]", float,
                   double) {
    // As grid_update() computes them: the first node of a block in double, its neighbours by adding i h in S. Without
    // room for rounding, 3 % (float) and 16 % (double) of these boxes would have a face that moves.
    using S = TestType;
    const Vec<S, 2> v{S(-1), S(1)};
    for (double lower : {0.0, -1.0, -0.5, 0.1, 0.3, 2.7}) {
        for (double extent : {1.0, 2.0, 0.7, 3.0}) {
            for (int n = 8; n < 200; ++n) {
                const double h = extent / n, block = lower + h * (n / 4 * 4);
                const auto walls =
                    Walls<S, 2>::all({S(lower), S(lower)}, {S(lower + extent), S(lower + extent)}, {Contact::stick, 0});
                const S upper_node = S(block) + S(n % 4) * S(h);
                const S inner_node = S(lower + h * ((n - 1) / 4 * 4)) + S((n - 1) % 4) * S(h);
                const S middle = S(lower + extent / 2);
                CAPTURE(lower, extent, n);
                CHECK(walls.velocity({upper_node, middle}, v)[1] == 0);
                CHECK(walls.velocity({middle, S(lower)}, v)[1] == 0);
                CHECK(walls.velocity({inner_node, middle}, v)[1] == 1);
                const double last = block + h * 3;
                if (n % 4 == 3) CHECK(walls.reaches({block, lower + extent / 2}, {last, lower + extent / 2}));
            }
        }
    }
}

TEMPLATE_TEST_CASE("on a grid, a face between planes of nodes acts on the nearer one, at either end", "[boundary]",
                   float, double) {
    using S = TestType;
    for (const double h : {0.1, 0.03, 1.0 / 3})
        for (int n = 3; n < 60; ++n)
            for (const double off : {-0.49, -0.2, -1e-3, 0.0, 1e-3, 0.2, 0.49}) {
                const double lower = (1 - off) * h, upper = (n + off) * h;
                const auto walls = Walls<S, 2>::all({lower, lower}, {upper, upper}, {Contact::stick, 0}).on_grid(h);
                CAPTURE(h, n, off);
                const S middle = S((1 + n) * h / 2);
                for (int node = -1; node <= n + 2; ++node) {
                    const S x = S(node) * S(h);
                    const bool held = node <= 1 || node >= n;
                    CHECK((walls.velocity({x, middle}, {S(1), S(1)})[1] == 0) == held);
                    CHECK((walls.velocity({middle, x}, {S(1), S(1)})[0] == 0) == held);
                    if (held) CHECK(walls.reaches({node * h, middle}, {node * h, middle}));
                }
                if (n > 4) CHECK_FALSE(walls.reaches({2 * h, 2 * h}, {(n - 1) * h, (n - 1) * h}));
            }
}

TEST_CASE("walls that cannot be are refused", "[boundary][error]") {
    using W = Walls<double, 2>;
    const double not_a_number = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();
    for (double friction : {-0.1, not_a_number, infinity}) {
        CHECK_THROWS_AS(W::all({0.0, 0.0}, {1.0, 1.0}, {Contact::slip, friction}), parameter_error);
        W walls = W::all({0.0, 0.0}, {1.0, 1.0}, {});
        walls.at_upper[1].friction = friction;
        CHECK_THROWS_AS(walls.lifted<float>(), parameter_error);  // as every step does
    }
    CHECK_THROWS_AS(W::all({0.0, 0.0}, {1.0, 0.0}, {}), parameter_error);
    CHECK_THROWS_AS(W::all({0.0, 0.0}, {-1.0, 1.0}, {}), parameter_error);
    CHECK_THROWS_AS(W::all({0.0, not_a_number}, {1.0, 1.0}, {}), parameter_error);
    CHECK_THROWS_AS(W::all({0.0, 0.0}, {1.0, infinity}, {}), parameter_error);
}

TEMPLATE_TEST_CASE_SIG("contact with an inclined surface", "[boundary]", ((int D), D), 2, 3) {
    // A node pressed on with |v_n| = 2 that slides with 3; μ = 0.5 leaves 2 of it.
    Random random(35);
    for (int trial = 0; trial < 50; ++trial) {
        const Vec<double, D> normal = random.direction<D>();
        Vec<double, D> along = random.direction<D>();
        along = along - normal * dot(along, normal);
        along = along * (1 / norm(along));
        const Vec<double, D> v = along * 3.0 - normal * 2.0;
        CHECK(norm(velocity_after_contact(v, normal, Contact::separate, 0.5) - along * 2.0) <= 1e-14);
        CHECK(norm(velocity_after_contact(v, normal, Contact::slip, 0.5) - along * 2.0) <= 1e-14);
        CHECK(norm(velocity_after_contact(v, normal, Contact::stick, 0.5)) == 0);
        CHECK(norm(velocity_after_contact(along * 3.0 + normal * 2.0, normal, Contact::separate, 0.5) - along * 3.0 -
                   normal * 2.0) <= 1e-14);
    }
}
