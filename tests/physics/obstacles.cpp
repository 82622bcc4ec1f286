// quick: no
/// \file Obstacles that stand on a floor and in corners push sand and water: none gets into them or behind them.
///
/// Before colliders had a layer and looked at the solids beside them, of 2,926 particles of sand 39 were in a box that
/// pushed at 0.3 m/s for 2 s, and 21 behind it.
#include "support/catch.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/firn.hpp>

#include <numbers>

using namespace firn;

namespace {

constexpr double away = -50;  ///< where solids wait that take no part [m]

/// Every kind of solid, so that all cases are one program. One of them is driven through all the matter along x.
template <int D>
struct Solids {
    Collider<HalfSpace<float, D>> plane{.friction = 0.3};
    BoundaryList<Collider<Box<float, D>>> boxes{};
    Collider<Capsule<float, D>> capsule{.friction = 0.3};
    Collider<DistanceGrid<float, D>> numbers{};

    Solids() {
        plane.position[1] = capsule.position[1] = numbers.position[1] = away;
        DistanceNumbers<float, D> far;
        far.spacing = 1;
        far.nodes.fill(2);
        far.values.assign(std::size_t(1) << D, 1.0F);
        numbers.shape.numbers = std::make_shared<const DistanceNumbers<float, D>>(far);
    }
    auto with(const Walls<float, D>& walls) const { return Together(walls, plane, boxes, capsule, numbers); }
};

/// Matter in a trough of the width 0.3 m (in 3D), on a floor at that height [m].
template <int D>
struct Trough {
    double h, depth = 0.12, to = 1, floor = 0;
    Domain<D> domain() const {
        Domain<D> box{Vec<double, D>::zero(), Vec<double, D>::filled(0.3), h};
        box.upper[0] = 2;
        box.upper[1] = 1;
        return box;
    }
    Samples<D> matter() const {
        Vec<double, D> lower = Vec<double, D>::zero(), upper = Vec<double, D>::filled(0.3);
        lower[0] = 0.3;
        upper[0] = to;
        lower[1] = floor;
        upper[1] = floor + depth;
        return sample_box<D>(lower, upper, {.spacing = h / 2});
    }
};

struct Leaks {
    int deep = 0, behind = 0;
    double before = 1;  ///< from the surface to the next particle [m]
};

/// \param distance  distance(x): of x from the driven solid, where that is at the end [m]
template <int D, class Material, class Distance>
Leaks push(const Trough<D>& trough, const Material& material, const Solids<D>& solids, double duration,
           double centre_at_the_end, const Distance& distance) {
    const Domain<D> domain = trough.domain();
    const auto walls =
        Walls<float, D>::all(cast<float>(domain.lower), cast<float>(domain.upper), {Contact::separate, 0.3});
    Simulation simulation(domain, material, Coloured{}, solids.with(walls));
    simulation.add(trough.matter(), 1600);
    simulation.advance(duration);
    const auto& particles = simulation.particles();
    Leaks leaks;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const Vec<double, D> x = particles.exact_position(slot);
        leaks.deep += distance(x) < -0.1 * trough.h || x[1] < trough.floor - 0.1 * trough.h;
        leaks.behind += distance(x) >= 0 && x[0] < centre_at_the_end;
        leaks.before = std::min(leaks.before, distance(x));
    }
    return leaks;
}

template <class Shape>
Collider<Shape> driven(const Shape& shape, double height, double speed) {
    Collider<Shape> solid{.shape = shape, .friction = 0.3};
    solid.position[0] = 0.15;
    solid.position[1] = height;
    if (Collider<Shape>::D == 3) solid.position[Collider<Shape>::D - 1] = 0.15;
    solid.linear_velocity[0] = speed;
    return solid;
}

template <int D>
Vec<double, D> half_of_box() {
    Vec<double, D> half = Vec<double, D>::filled(0.3);  // broader than the trough
    half[0] = 0.1;
    return half;
}
template <int D>
double to_box(const Vec<double, D>& x) {
    return Box<double, D>{half_of_box<D>()}.signed_distance(x);
}

/// The same box as a mesh, or in the plane as numbers.
template <int D>
auto distances_of_box(double spacing) {
    if constexpr (D == 3) {
        TriangleMesh mesh;
        for (int corner = 0; corner < 8; ++corner)
            mesh.vertices.push_back({corner & 1 ? 0.1 : -0.1, corner & 2 ? 0.3 : -0.3, corner & 4 ? 0.3 : -0.3});
        mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                          {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
        return DistanceGrid<float, 3>{mesh_distance(mesh, {.spacing = spacing})};
    } else {
        DistanceNumbers<float, 2> numbers;
        numbers.lower = {-0.25, -0.45};
        numbers.spacing = spacing;
        for (int a = 0; a < 2; ++a) numbers.nodes[std::size_t(a)] = int(-2 * numbers.lower[a] / spacing) + 2;
        for (int i = 0; i < numbers.nodes[0]; ++i)
            for (int j = 0; j < numbers.nodes[1]; ++j)
                numbers.values.push_back(float(to_box<2>(numbers.lower + Vec<double, 2>{i * spacing, j * spacing})));
        return DistanceGrid<float, 2>{std::make_shared<const DistanceNumbers<float, 2>>(numbers)};
    }
}

/// Upright in the plane; lying across the trough in 3D.
template <int D>
auto capsule(double speed) {
    Collider<Capsule<float, D>> solid = driven(Capsule<float, D>{0.3F, 0.12F}, D == 2 ? 0.42 : 0.12, speed);
    if constexpr (D == 3) solid.rotation = rotor({1.0, 0.0, 0.0}, degrees(90));
    return solid;
}

template <int D>
void push_all(const Trough<D>& trough, const auto& material, bool other_floors) {
    for (const double speed : {0.3, 3.0}) {
        const double duration = 0.6 / speed, end = 0.15 + 0.6;
        const auto none = [&](const char* what, const Solids<D>& solids, const auto& distance) {
            const Leaks leaks = push(trough, material, solids, duration, end, distance);
            CAPTURE(what, speed, leaks.before / trough.h);
            CHECK(leaks.deep == 0);
            CHECK(leaks.behind == 0);
            CHECK(leaks.before < 1.5 * trough.h);  // nor is it held off by more than the layer
        };
        const auto of_box = [&](double height) {
            return [=](Vec<double, D> x) {
                x[0] -= end;
                x[1] -= height;
                if (D == 3) x[D - 1] -= 0.15;
                return to_box<D>(x);
            };
        };
        const Box<float, D> box{cast<float>(half_of_box<D>())};
        if (other_floors) {
            const double height = trough.floor + 0.3;
            Solids<D> on_plane;
            on_plane.plane.position[1] = trough.floor;
            on_plane.boxes.all = {driven(box, height, speed)};
            none("a box on a plane", on_plane, of_box(height));

            Solids<D> on_plate;
            auto plate = driven(Box<float, D>{Vec<float, D>::filled(0.3F)}, trough.floor - 0.1, 0);
            plate.shape.half_extents = Vec<float, D>::filled(2.5F);
            plate.shape.half_extents[1] = 0.1F;
            on_plate.boxes.all = {plate, driven(box, height, speed)};
            none("a box on a plate", on_plate, of_box(height));
            std::swap(on_plate.boxes.all[0], on_plate.boxes.all[1]);
            none("a box on a plate that acts after it", on_plate, of_box(height));
            continue;
        }
        // On the floor, and half a cell in it: there it stands on no row of nodes.
        for (const double height : {0.3, 0.3 - trough.h / 2}) {
            Solids<D> with_box;
            with_box.boxes.all = {driven(box, height, speed)};
            none("box", with_box, of_box(height));
        }
        Solids<D> with_capsule;
        with_capsule.capsule = capsule<D>(speed);
        none("capsule", with_capsule, [&](const Vec<double, D>& x) {
            Vec<double, D> local = x - with_capsule.capsule.position;
            local[0] -= 0.6;
            local = transpose(matrix_of(with_capsule.capsule.rotation)) * local;
            return Capsule<double, D>{0.3, 0.12}.signed_distance(local);
        });
        Solids<D> with_numbers;
        with_numbers.numbers = driven(distances_of_box<D>(trough.h / 2), 0.3, speed);
        none(D == 3 ? "mesh" : "numbers", with_numbers, of_box(0.3));
    }
}

}  // namespace

TEST_CASE("nothing gets into or behind an obstacle that is driven along a floor", "[boundary][collider]") {
    const Trough<2> trough{1.0 / 64};
    push_all(trough, Sand<float>::from_properties({}), false);
    push_all(trough, Fluid<float>::from_properties({.bulk = 2e5}), false);
}

TEST_CASE("nothing gets into or behind an obstacle in the corners of a floor and walls", "[boundary][collider]") {
    const Trough<3> trough{1.0 / 32, 0.09, 0.8};
    push_all(trough, Sand<float>::from_properties({}), false);
}

TEST_CASE("nothing gets into or behind an obstacle whose floor is another solid", "[boundary][collider]") {
    const Trough<2> trough{1.0 / 64, 0.12, 1, 0.1};  // the floor off the nodes' rows
    push_all(trough, Sand<float>::from_properties({}), true);
}
