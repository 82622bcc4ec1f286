/// \file Solids that move and turn: contact relative to their surface, where they reach, where they are later.
#include "support/catch.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/core/pack.hpp>

#include "surfaces.hpp"

using namespace firn;
using namespace surfaces;

namespace {

/// A solid somewhere, turned and moving at random.
template <class Of>
auto somewhere(Random& random, Contact contact, double friction) {
    using Shape = typename Of::Shape;
    constexpr int D = shape_facts<Shape>::dimension;
    Collider<Shape> solid{.shape = Of::shape(), .contact = contact, .friction = friction};
    solid.position = random.vector<D>(-1, 1);
    solid.linear_velocity = random.vector<D>(-2, 2);
    if constexpr (D == 2) {
        solid.rotation = rotor(radians(random.uniform(-3, 3)));
        solid.angular_velocity = random.uniform(-4, 4);
    } else {
        solid.rotation = rotor(random.direction<3>(), radians(random.uniform(-3, 3)));
        solid.angular_velocity = random.vector<3>(-4, 4);
    }
    return solid;
}

/// A point of the solid's inside, in the world.
template <class Of, class Solid>
auto inside_of(const Solid& solid, Random& random) {
    for (;;) {
        const auto local = random.vector<Solid::D>(-0.5, 0.5);
        if (Of::is_inside(local)) return solid.position + matrix_of(solid.rotation) * local;
    }
}

/// How fast the solid is there, from two of its poses.
template <class Solid, int D>
Vec<double, D> speed_of_surface(const Solid& solid, const Vec<double, D>& x) {
    const auto local = transpose(matrix_of(solid.rotation)) * (x - solid.position);
    const auto at = [&](double t) {
        const auto then = solid.advanced(t);
        return then.position + matrix_of(then.rotation) * local;
    };
    return (at(1e-5) - at(-1e-5)) * (1 / 2e-5);
}

/// That a lane of boundary.velocity(x, v) is `alone`, what one number gives.
template <class Boundary, class S, int D, class Lane>
void check_lane(const Boundary& boundary, const Vec<S, D>& x, const Vec<S, D>& v, const Vec<S, D>& alone,
                const Lane& lane) {
#ifdef __FMA__  // contracted where the compiler likes: as if the node were elsewhere by some rounding
    S allowed = 40 * std::numeric_limits<S>::epsilon();
    for (int a = 0; a < D; ++a)
        for (const S sign : {S(-1), S(1)}) {
            Vec<S, D> beside = x;
            beside[a] += sign * 8 * std::numeric_limits<S>::epsilon();
            allowed = std::max(allowed, norm(boundary.velocity(beside, v) - alone));
        }
    for (int a = 0; a < D; ++a) CHECK(std::abs(lane(a) - alone[a]) <= allowed);
#else
    static_cast<void>(boundary), static_cast<void>(x), static_cast<void>(v);
    for (int a = 0; a < D; ++a) CHECK(lane(a) == alone[a]);
#endif
}

}  // namespace

#define FINITE_SHAPES Ball<2>, Ball<3>, Cuboid<2>, Cuboid<3>, Rounded<2>, Rounded<3>, Torus<2>, Torus<3>
#define ALL_SHAPES FINITE_SHAPES, Slope<2>, Slope<3>, Hollow<Ball<2>>, Hollow<Cuboid<3>>

TEMPLATE_TEST_CASE("contact is relative to the surface as it moves and turns", "[boundary][collider]", ALL_SHAPES) {
    Random random(50);
    int stuck = 0, sliding = 0, leaving = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const Contact contact = trial % 3 == 0 ? Contact::stick : trial % 3 == 1 ? Contact::slip : Contact::separate;
        const double friction = trial % 2 == 0 ? 0 : random.uniform(0, 3);
        const auto solid = somewhere<TestType>(random, contact, friction);
        const auto x = inside_of<TestType>(solid, random);
        constexpr int D = decltype(solid)::D;
        const auto v = random.vector<D>(-5, 5);
        const auto R = matrix_of(solid.rotation);
        const auto normal = R * normal_of(solid.shape, transpose(R) * (x - solid.position));
        const auto surface = speed_of_surface(solid, x);
        CAPTURE(trial, friction);
        int faces = 0;  // beyond a corner of a hollow box, several act
        solid.acting_surfaces(x, v, NoOthers{}, [&](const auto&) { ++faces; });
        if (faces > 1) continue;
        CHECK(norm(solid.surface_velocity(x) - surface) <= 1e-7);
        const auto before = v - surface, after = solid.velocity(x, v) - surface;
        if (contact == Contact::stick) {
            CHECK(norm(after) <= 1e-7);
            continue;
        }
        const double into = dot(before, normal);
        if (contact == Contact::separate && into > 0) {
            CHECK(norm(after - before) <= 1e-7);
            ++leaving;
            continue;
        }
        CHECK(std::abs(dot(after, normal)) <= 1e-7);
        const auto slide = before - normal * into;
        const double lost = std::min(friction * std::max(-into, 0.0), norm(slide));  // Coulomb's cone
        CHECK(norm(after - slide * (1 - lost / norm(slide))) <= 1e-6);
        (lost < norm(slide) ? sliding : stuck)++;
    }
    CHECK(stuck > 5);
    CHECK(sliding > 50);
    CHECK(leaving > 20);
}

TEMPLATE_TEST_CASE("nodes outside the solid and its layer are left alone to the bit, those in the layer are not",
                   "[boundary][collider]", ALL_SHAPES) {
    Random random(51);
    int outside = 0, layer = 0;
    for (int trial = 0; trial < 500; ++trial) {
        auto solid = somewhere<TestType>(random, Contact::stick, 0);
        constexpr int D = decltype(solid)::D;
        const auto x = solid.position + random.vector<D>(-0.6, 0.6), v = random.vector<D>(-5, 5);
        const double distance =
            solid.shape.signed_distance(transpose(matrix_of(solid.rotation)) * (x - solid.position));
        const bool touched = !(solid.velocity(x, v) == v);
        CHECK(touched == (distance <= 0));
        outside += !touched;
        solid.thickness = 0.05;
        const bool in_layer = !(solid.velocity(x, v) == v);
        CHECK(in_layer == (distance <= 0.05));
        layer += in_layer && !touched;
    }
    CHECK(outside > 30);
    CHECK(layer > 5);
}

TEMPLATE_TEST_CASE("reaches() never misses a node that velocity() changes, and misses most of the rest",
                   "[boundary][collider]", ALL_SHAPES) {
    using Shape = typename TestType::Shape;
    using Single = Collider<with_scalar_t<Shape, float>>;
    Random random(52);
    int skipped = 0, needless = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        auto solid = somewhere<TestType>(random, Contact::stick, 0);
        constexpr int D = decltype(solid)::D;
        if (trial % 3 == 0) solid.thickness = random.uniform(0, 0.1);
        // As a simulation in float has it: nodes and distances rounded to float.
        const Single single{lift<float>(solid.shape), solid.contact,  solid.friction, solid.thickness,
                            solid.thickness_in_cells, solid.position, solid.rotation, solid.linear_velocity,
                            solid.angular_velocity};
        const auto low = solid.position + random.vector<D>(-0.9, 0.7), high = low + Vec<double, D>::filled(0.09);
        bool changed = false, changed_single = false;
        for (int node = 0; node < (D == 2 ? 16 : 64); ++node) {
            Vec<double, D> x = low;
            for (int a = 0; a < D; ++a) x[a] += 0.03 * (node >> 2 * a & 3);
            const auto v = Vec<double, D>::filled(7.0);
            changed = changed || !(solid.velocity(x, v) == v);
            changed_single = changed_single || !(single.velocity(cast<float>(x), cast<float>(v)) == cast<float>(v));
        }
        CAPTURE(trial);
        if (changed) CHECK(solid.reaches(low, high));
        if (changed_single) CHECK(single.reaches(low, high));
        skipped += !solid.reaches(low, high);
        needless += solid.reaches(low, high) && !changed;
        if constexpr (is_flat<Shape>) CHECK(solid.reaches(low, high) == changed);  // exact
    }
    CHECK(skipped > 10);  // few find room in a hollow
    CHECK(needless < 600);
}

TEMPLATE_TEST_CASE("no node gets a larger speed than largest_speed(), and not much is lost by it",
                   "[boundary][collider]", ALL_SHAPES) {
    Random random(56);
    double tightest = 0;
    for (int trial = 0; trial < 500; ++trial) {
        auto solid = somewhere<TestType>(random, Contact::stick, 0);
        constexpr int D = decltype(solid)::D;
        if (trial % 2 == 0) solid.thickness = 0.1;
        const auto low = solid.position - random.vector<D>(0, 1), high = solid.position + random.vector<D>(0, 1);
        const double bound = largest_speed(solid, low, high);
        CAPTURE(trial);
        for (int node = 0; node < 200; ++node) {
            Vec<double, D> x{};
            for (int a = 0; a < D; ++a) x[a] = random.uniform(low[a], high[a]);
            const double speed = norm(solid.velocity(x, Vec<double, D>::zero()));
            CHECK(speed <= bound);
            tightest = std::max(tightest, speed / bound);
        }
    }
    CHECK(tightest > 0.8);
}

TEMPLATE_TEST_CASE_SIG("a node on a face follows it however the numbers are rounded", "[boundary][collider]",
                       ((class S, int D), S, D), (float, 2), (double, 3)) {
    // On the face to rounding, a node is in or out; with a layer of a thousandth of a cell it is in.
    const double h = 1.0 / 64;
    Vec<double, D> corner = Vec<double, D>::filled(0.3);
    const Collider<HalfSpace<S, D>> floor{.contact = Contact::stick, .thickness = h / 1000, .position = corner};
    const Vec<S, D> v = Vec<S, D>::filled(S(-1));
    for (int i = 0; i < 40; ++i) {
        Vec<double, D> x = corner;
        x[0] += i * h;
        CHECK(floor.velocity(cast<S>(x), v) == Vec<S, D>::zero());
        x[1] += h;
        CHECK(floor.velocity(cast<S>(x), v) == v);
    }
}

TEMPLATE_TEST_CASE("on a grid, nodes within 1.5 cells are held, the radius of the quadratic spline",
                   "[boundary][collider]", ALL_SHAPES) {
    Random random(57);
    const double h = 0.04;
    int layer = 0;
    for (int trial = 0; trial < 500; ++trial) {
        auto solid = somewhere<TestType>(random, Contact::stick, 0);
        constexpr int D = decltype(solid)::D;
        const auto x = solid.position + random.vector<D>(-0.6, 0.6), v = random.vector<D>(-5, 5);
        const double distance =
            solid.shape.signed_distance(transpose(matrix_of(solid.rotation)) * (x - solid.position));
        const auto touched = [&](const auto& one) { return !(on_grid(one, h).velocity(x, v) == v); };
        CHECK(touched(solid) == (distance <= 1.5 * h));
        layer += touched(solid) && distance > 0;
        if (touched(solid)) CHECK(on_grid(solid, h).reaches(x, x));
        solid.thickness = 0.03;
        CHECK(touched(solid) == (distance <= 1.5 * h + 0.03));
        solid.thickness_in_cells = 0;
        CHECK(touched(solid) == (distance <= 0.03));
    }
    CHECK(layer > 10);
}

TEMPLATE_TEST_CASE_SIG("what stands on a floor or in a corner pushes sideways there, not up and down",
                       "[boundary][collider]", ((int D), D), 2, 3) {
    using V = Vec<double, D>;
    const double h = 1.0 / 64;
    const auto walls = Walls<double, D>::all(V::zero(), V::filled(1), {Contact::separate, 0});
    // From wall to wall across; half a cell above the floor, on it, or in it.
    for (const double bottom : {h / 2, 0.0, -h / 2}) {
        Collider<Box<double, D>> box{.shape = {V::filled(0.5)}, .position = V::filled(0.5)};
        box.shape.half_extents[0] = 0.1;
        box.position[1] = 0.5 + bottom;
        box.linear_velocity[0] = 2;
        Collider<Box<double, D>> floor{.shape = {V::filled(2.0)}};
        floor.position[1] = -2;
        const auto check = [&](const auto& given) {
            const auto boundary = on_grid(given, h);
            // Whatever a particle at the side touches: in the floor's rows and those above, in the corners' and beside.
            for (const double along : {0.601 + h, 0.601, 0.599, 0.6 - h, 0.6 - 1.4 * h})
                for (const double height : {-2 * h, -h, 0.0, h, 2 * h, 5 * h})
                    for (const double across : {-h, 0.0, 0.5, 1.0 + h}) {
                        V x{};
                        x[0] = along;
                        x[1] = height;
                        if (D == 3) x[D - 1] = across;
                        CAPTURE(bottom, along, height, across);
                        const V v = boundary.velocity(x, V::zero());
                        CHECK(std::abs(v[0] - 2) <= 1e-12);
                        CHECK(std::abs(v[1]) <= 1e-12);
                        CHECK(boundary.reaches(x, x));
                    }
        };
        check(Together(walls, box));
        check(Together(box, walls));
        check(Together(walls, BoundaryList<Collider<Box<double, D>>>{{box}}));
        if (D == 2) {  // no walls, another solid; in any order
            check(Together(floor, box));
            check(Together(box, floor));
            check(BoundaryList<Collider<Box<double, D>>>{{floor, box}});
            check(BoundaryList<Collider<Box<double, D>>>{{box, floor}});
        }
    }
    // A plate that lies on the floor, thinner than the distance that is looked over, is there all the same.
    Collider<Box<double, D>> plate{.shape = {V::filled(0.3)}, .position = V::filled(0.5)};
    for (const double thickness : {0.1, 0.5, 1.0, 3.0}) {
        plate.shape.half_extents[1] = plate.position[1] = thickness * h / 2;
        const auto boundary = on_grid(Together(walls, plate), h);
        for (const double height : {0.0, thickness * h, (thickness + 1.4) * h}) {
            V x = V::filled(0.5), v = V::zero();
            x[1] = height;
            v[1] = -1;
            CAPTURE(thickness, height);
            CHECK(std::abs(boundary.velocity(x, v)[1]) <= 1e-12);
        }
    }
}

TEMPLATE_TEST_CASE("beside others, too, lanes are what one number gives, and reaches() misses no node",
                   "[boundary][collider]", FINITE_SHAPES) {
    using Shape = typename TestType::Shape;
    using P = native_pack<double>;
    constexpr int D = shape_facts<Shape>::dimension, lanes = scalar_traits<P>::lanes;
    using V = Vec<double, D>;
    Random random(58);
    int moved = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const auto one = somewhere<TestType>(random, Contact::separate, 0.3);
        const auto other = somewhere<TestType>(random, Contact::slip, 0.2);
        const auto walls = Walls<double, D>::all(V::filled(-0.7), V::filled(0.7), {Contact::separate, 0});
        const auto both = on_grid(Together(walls, one, other), 0.08);
        const auto alone = Together(on_grid(one, 0.08));  // nothing beside
        const auto in_lanes = lift<P>(both);
        V at[lanes], with[lanes];
        Vec<P, D> x{}, v{};
        for (int lane = 0; lane < lanes; ++lane) {
            at[lane] = random.vector<D>(-1, 1);
            with[lane] = random.vector<D>(-3, 3);
            for (int a = 0; a < D; ++a) {
                x[a].set(lane, at[lane][a]);
                v[a].set(lane, with[lane][a]);
            }
        }
        const auto after = in_lanes.velocity(x, v);
        for (int lane = 0; lane < lanes; ++lane) {
            const V of_one = both.velocity(at[lane], with[lane]);
            if (!(of_one == with[lane])) CHECK(both.reaches(at[lane], at[lane]));
            moved += !(of_one == other.velocity(at[lane], alone.velocity(at[lane], with[lane])));
            check_lane(both, at[lane], with[lane], of_one, [&](int a) { return after[a][lane]; });
        }
    }
    CHECK(moved > 100);
}

TEMPLATE_TEST_CASE("every lane of a register is what one number alone gives", "[boundary][collider]", ALL_SHAPES) {
    using Shape = typename TestType::Shape;
    constexpr int D = shape_facts<Shape>::dimension;
    Random random(53);
    const auto compare = [&](auto of) {
        using S = decltype(of);
        using P = native_pack<S>;
        constexpr int lanes = scalar_traits<P>::lanes;
        for (int trial = 0; trial < 60; ++trial) {
            const auto given = somewhere<TestType>(random, trial % 3 == 0 ? Contact::slip : Contact::separate, 0.4);
            const Collider<with_scalar_t<Shape, S>> solid{
                lift<S>(given.shape),     given.contact,  given.friction, given.thickness,
                given.thickness_in_cells, given.position, given.rotation, given.linear_velocity,
                given.angular_velocity};
            const auto in_lanes = lift<P>(solid);
            Vec<P, D> x{}, v{};
            for (int lane = 0; lane < lanes; ++lane) {
                const auto one = random.vector<D>(-0.5, 0.5), motion = random.vector<D>(-3, 3);
                for (int a = 0; a < D; ++a) {
                    x[a].set(lane, S(given.position[a] + one[a]));
                    v[a].set(lane, S(motion[a]));
                }
            }
            const auto after = in_lanes.velocity(x, v);
            for (int lane = 0; lane < lanes; ++lane) {
                Vec<S, D> of_lane{}, with{};
                for (int a = 0; a < D; ++a) {
                    of_lane[a] = x[a][lane];
                    with[a] = v[a][lane];
                }
                const auto alone = solid.velocity(of_lane, with);
                CAPTURE(trial, lane);
                check_lane(solid, of_lane, with, alone, [&](int a) { return after[a][lane]; });
            }
        }
    };
    compare(0.0F);
    compare(0.0);
}

TEMPLATE_TEST_CASE("float gives what double gives, to rounding", "[boundary][collider]", ALL_SHAPES) {
    using Shape = typename TestType::Shape;
    Random random(54);
    for (int trial = 0; trial < 200; ++trial) {
        auto solid = somewhere<TestType>(random, Contact::separate, 0.5);
        constexpr int D = decltype(solid)::D;
        auto x = inside_of<TestType>(solid, random), v = random.vector<D>(-5, 5);
        x = cast<double>(cast<float>(x));
        v = cast<double>(cast<float>(v));
        const auto local = transpose(matrix_of(solid.rotation)) * (x - solid.position);
        if (solid.shape.signed_distance(local) > -1e-5) continue;
        Vec<double, D> nudge = Vec<double, D>::filled(1e-5);  // not at a kink of the distance
        if (norm(normal_of(solid.shape, local + nudge) - normal_of(solid.shape, local - nudge)) > 1e-2) continue;
        const Collider<with_scalar_t<Shape, float>> single{
            lift<float>(solid.shape), solid.contact,  solid.friction, solid.thickness,
            solid.thickness_in_cells, solid.position, solid.rotation, solid.linear_velocity,
            solid.angular_velocity};
        const auto exact = solid.velocity(x, v);
        CAPTURE(trial);
        CHECK(norm(cast<double>(single.velocity(cast<float>(x), cast<float>(v))) - exact) <= 1e-3);
    }
}

TEMPLATE_TEST_CASE_SIG(
    "advanced(): exact for constant rates, in one step or many; a million steps leave a rotation one",
    "[boundary][collider]", ((int D), D), 2, 3) {
    using Shape = typename Ball<D>::Shape;
    Random random(55);
    for (int trial = 0; trial < 20; ++trial) {
        const auto solid = somewhere<Ball<D>>(random, Contact::slip, 0);
        const auto once = solid.advanced(0.02), twice = solid.advanced(0.01).advanced(0.01);
        CHECK(norm(once.position - solid.position - solid.linear_velocity * 0.02) <= 1e-15);
        CHECK(norm(once.position - twice.position) <= 1e-15);
        CHECK(norm(once.rotation - twice.rotation) <= 1e-15);
        const auto back = once.advanced(-0.02);
        CHECK(norm(back.rotation - solid.rotation) <= 1e-15);
    }
    Collider<Shape> wheel{.shape = {0.1}};
    double turns = 1e6 * 1e-4 / (2 * std::numbers::pi);
    if constexpr (D == 2) {
        wheel.angular_velocity = 1;
    } else {
        wheel.angular_velocity = {2.0 / 3, -1.0 / 3, 2.0 / 3};
    }
    for (int i = 0; i < 1'000'000; ++i) wheel = wheel.advanced(1e-4);
    const auto R = matrix_of(wheel.rotation);
    CHECK(squared_norm(transpose(R) * R - Mat<double, D>::identity()) <= 1e-28);
    const double angle = (turns - std::floor(turns)) * 2 * std::numbers::pi;
    CHECK(trace(R) == Approx(D - 2 + 2 * std::cos(angle)).margin(1e-10));
    if constexpr (D == 2) {
        CHECK(R(1, 0) == Approx(std::sin(angle)).margin(1e-10));  // counter-clockwise
    } else {
        CHECK(norm(R * Vec<double, 3>{2.0, -1.0, 2.0} - Vec<double, 3>{2.0, -1.0, 2.0}) <= 1e-9);
        CHECK((R(2, 1) - R(1, 2)) / 2 == Approx(2.0 / 3 * std::sin(angle)).margin(1e-10));  // by the right hand
    }
}

TEST_CASE("rotor() turns by the right hand", "[boundary][collider]") {
    const Angle quarter = degrees(90);
    CHECK(quarter.in_radians() == Approx(std::numbers::pi / 2));
    CHECK(radians(std::numbers::pi / 6).in_degrees() == Approx(30));
    CHECK((2 * degrees(30) + degrees(50) / 2 - degrees(-5)).in_degrees() == Approx(90));
    CHECK(degrees(-90) < degrees(1));
    const auto moved = matrix_of(rotor(quarter)) * Vec<double, 2>{1.0, 0.0};
    CHECK(norm(moved - Vec<double, 2>{0.0, 1.0}) <= 1e-15);
    const auto of_y = matrix_of(rotor(Vec<double, 3>{0.0, 0.0, 5.0}, quarter)) * Vec<double, 3>{0.0, 2.0, 1.0};
    CHECK(norm(of_y - Vec<double, 3>{-2.0, 0.0, 1.0}) <= 1e-15);
}

TEMPLATE_TEST_CASE_SIG("boundaries together act at once, move together, and reach where one does",
                       "[boundary][together]", ((int D), D), 2, 3) {
    using V = Vec<double, D>;
    const auto walls = Walls<double, D>::all(V::filled(-1), V::filled(1), {Contact::slip, 0});
    Collider<Sphere<double, D>> ball{.shape = {0.2}, .contact = Contact::stick};
    ball.linear_velocity = V::filled(3);
    Collider<Box<double, D>> block{.contact = Contact::stick, .position = V::filled(0.2)};
    const Together both(walls, ball, block);
    STATIC_REQUIRE(boundary<std::remove_cv_t<decltype(both)>, double, D>);
    const V v = V::filled(-5);
    CHECK(both.velocity(V::filled(0.05), v) == V::filled(3));  // the ball's
    CHECK(both.velocity(V::filled(0.11), v) == V::zero());     // sticks to both: the last decides
    CHECK(both.velocity(V::filled(0.6), v) == v);              // free
    CHECK(both.velocity(V::filled(-1), v) == V::zero());       // walls
    const Together other(walls, block, ball);
    CHECK(other.velocity(V::filled(0.11), v) == V::filled(3));
    CHECK(advanced(both, 0.1).velocity(V::filled(0.0), v) == v);  // gone
    CHECK(both.reaches(V::filled(-0.05), V::filled(0.0)));
    CHECK(both.reaches(V::filled(0.9), V::filled(1.0)));
    CHECK_FALSE(both.reaches(V::filled(0.4), V::filled(0.5)));
    CHECK(largest_speed(both, V::filled(-1), V::filled(1)) == Approx(3 * std::sqrt(double(D))));
    CHECK(largest_speed(both, V::filled(0.5), V::filled(1)) == 0);
    CHECK(largest_speed(walls, V::filled(-1), V::filled(1)) == 0);
    CHECK(norm(std::get<1>(advanced(both, 0.1).parts).position - V::filled(0.3)) <= 1e-15);

    BoundaryList<Collider<Sphere<double, D>>> list{{ball, ball}};
    list.all[1].position = V::filled(0.1);
    list.all[1].linear_velocity = V::zero();
    CHECK(list.velocity(V::filled(-0.09), v) == V::filled(3));
    CHECK(list.velocity(V::filled(0.05), v) == V::zero());
    CHECK(lift<native_pack<double>>(list).velocity(cast<native_pack<double>>(V::filled(-0.09)),
                                                   cast<native_pack<double>>(v))[0][1] == 3);
    CHECK(largest_speed(list, V::filled(-1), V::filled(1)) == Approx(3 * std::sqrt(double(D))));
    CHECK(norm(advanced(list, 0.5).all[0].position - V::filled(1.5)) <= 1e-15);
    CHECK(list.reaches(V::filled(0.2), V::filled(0.3)));
    CHECK_FALSE(list.reaches(V::filled(0.6), V::filled(0.7)));
    const Together nested(both, list);
    CHECK(part_count(nested) == 5);
    CHECK(part_centre<D>(nested, 4) == V::filled(0.1));
    CHECK(part_centre<D>(nested, 2) == V::filled(0.2));
    CHECK(part_centre<D>(nested, 0) == V::zero());
    CHECK(nested.velocity(V::filled(0.05), v) == V::zero());
    std::vector<int> told;  // which parts did something, as reactions count them
    velocity_among(nested, V::filled(0.05), v, NoOthers{}, [&](int k, const V&, const V&) { told.push_back(k); });
    CHECK(told == std::vector<int>{1, 3, 4});
    const auto on_cells = on_grid(both, 0.05);  // walls look nowhere, boxes do
    CHECK(looks_around(on_cells) == looks_around(on_grid(block, 0.05)));
    CHECK(looks_around(on_cells) > 0);
}

TEST_CASE("what says that it is no surface is none for the solids beside it either", "[boundary][collider]") {
    using V = Vec<double, 2>;
    const double h = 1.0 / 64;
    const auto none = Walls<double, 2>::all(V::zero(), V::filled(1), {Contact::none, 0});
    const Collider<Box<double, 2>> box{.shape = {{0.1, 0.5}}, .position = V::filled(0.5)};  // stands at the bottom
    const auto beside = on_grid(Together(none, box), h);
    const auto alone = on_grid(box, h);
    for (const double along : {0.5, 0.6 - h, 0.6 + h})
        for (const double height : {-h, 0.0, h}) {
            const V x{along, height}, v{-1, 2};
            CAPTURE(along, height);
            CHECK(norm(beside.velocity(x, v) - alone.velocity(x, v)) <= 1e-12);
        }
}

TEST_CASE("the parameters of boundaries together have names of their own, and become lanes", "[boundary][together]") {
    using Both = Together<Walls<float, 2>, Collider<Sphere<float, 2>>, Collider<Sphere<float, 2>>>;
    Both both(Walls<float, 2>::all({0.0F, 0.0F}, {1.0F, 1.0F}, {}), {.shape = {0.25F}}, {.shape = {0.5F}});
    std::get<2>(both.parts).position = {0.1, 0.2};
    std::vector<std::string> names;
    for_parameters(both, [&](const std::string& name, const char*, const auto&) { names.push_back(name); });
    CHECK(names.size() == 2 + 2 * 8);
    CHECK(std::count(names.begin(), names.end(), "0_lower") == 1);
    CHECK(std::count(names.begin(), names.end(), "1_shape_radius") == 1);
    CHECK(std::count(names.begin(), names.end(), "2_position") == 1);
    std::sort(names.begin(), names.end());
    CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());
    CHECK(std::string(Both::name) == "walls_collider_sphere_collider_sphere");
    CHECK(both.description().find("collider_sphere: separate, friction 0") != std::string::npos);
    const auto lanes = lift<native_pack<float>>(both);
    CHECK(std::get<2>(lanes.parts).shape.radius[3] == 0.5F);
    CHECK(std::get<2>(lanes.parts).position[1][2] == 0.2F);
}

TEST_CASE("colliders that cannot be are refused by every step", "[boundary][collider][error]") {
    using Solid = Collider<Sphere<float, 3>>;
    const double not_a_number = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();
    const auto refused = [](const auto& change) {
        Solid solid{};
        change(solid);
        CHECK_THROWS_AS(solid.check(), parameter_error);
        CHECK_THROWS_AS(lift<native_pack<float>>(solid), parameter_error);
        const Together with(Walls<float, 3>::all({0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 1.0F}, {}), solid);
        CHECK_THROWS_AS(lift<native_pack<float>>(with), parameter_error);
        CHECK_THROWS_AS(lift<native_pack<float>>(BoundaryList<Solid>{{Solid{}, solid}}), parameter_error);
    };
    CHECK_NOTHROW(lift<native_pack<float>>(Solid{}));
    for (const double bad : {not_a_number, infinity}) {
        refused([&](Solid& s) { s.position[2] = bad; });
        refused([&](Solid& s) { s.linear_velocity[0] = bad; });
        refused([&](Solid& s) { s.angular_velocity[1] = bad; });
        refused([&](Solid& s) { s.rotation[3] = bad; });
    }
    for (const double bad : {not_a_number, infinity, -0.1}) {
        refused([&](Solid& s) { s.friction = bad; });
        refused([&](Solid& s) { s.thickness = bad; });
        refused([&](Solid& s) { s.shape.radius = float(bad); });
    }
    refused([](Solid& s) { s.rotation = Rotor<double, 3>::zero(); });
    refused([](Solid& s) { s.rotation[0] = 1.001; });
    refused([](Solid& s) { s.shape.radius = 0; });
}
