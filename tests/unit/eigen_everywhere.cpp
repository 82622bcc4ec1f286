/// \file Every public place that takes a small vector takes Eigen's: a scene that is made with those moves to the bits
/// of the same scene made with firn's.
#include "support/catch.hpp"
#include <firn/core/eigen.hpp>
#include <firn/field/damped.hpp>
#include <firn/firn.hpp>
#include <firn/lagrangian.hpp>

#include <Eigen/Dense>

using namespace firn;

namespace {

/// Makes vectors and matrices of firn's.
struct Firn {
    using V = Vec<double, 3>;
    using F = Vec<float, 3>;
    static V v(double x, double y, double z) { return {x, y, z}; }
    static F f(float x, float y, float z) { return {x, y, z}; }
    static Mat<double, 3> turn() { return rotation({0, 1, 0}, std::acos(-1.0) / 2); }
};

/// The same as expressions of Eigen's, which must be evaluated to be kept.
struct Eigens {
    using V = Eigen::Vector3d;
    using F = Eigen::Vector3f;
    static auto v(double x, double y, double z) { return Eigen::RowVector3d(x, y, z); }
    static F f(float x, float y, float z) { return {x, y, z}; }
    static Eigen::Matrix3d turn() {
        const Mat<double, 3> R = Firn::turn();
        return as_eigen(R);
    }
};

/// Where everything is in the end.
using Places = std::vector<Vec<double, 3>>;

template <class Make>
Places grid_scene() {
    using V = typename Make::V;
    const auto v = Make::v;
    const Domain<3> domain{.lower = v(0, 0, 0), .upper = v(1, 1, 1), .cell_size = 1.0 / 16};
    using Floor = Collider<HalfSpace<float, 3>>;
    using Ball = Collider<Sphere<float, 3>>;
    using Boundary = Together<Walls<float, 3>, Floor, Ball>;
    const Floor floor{.shape = {.outward = Make::f(0, 1, 0)}, .position = v(0, 0.1, 0)};
    const Ball ball{.shape = {.radius = 0.1F},
                    .position = v(0.5, 0.2, 0.5),
                    .linear_velocity = v(0, 0.2, 0),
                    .angular_velocity = v(0, 3, 0)};
    const Boundary boundary{Walls<float, 3>::all(Make::f(0, 0, 0), Make::f(1, 1, 1), {Contact::slip, 0}), floor, ball};
    using Jelly = FixedCorotated<float>;
    Simulation<3, Jelly, Apic, MlsForce, QuadraticBSpline, Coloured, Boundary> simulation(
        domain, Jelly::from_young_poisson(2e4, 0.3), {1}, boundary);
    simulation.gravity = v(0, -5, 0);
    simulation.reactions.emplace().about = V(0.5, 0.2, 0.5);

    const SamplingOptions options{.spacing = 1.0 / 24};
    const Body box = simulation.add(sample_box<3>(v(0.4, 0.35, 0.4), v(0.6, 0.5, 0.6), options), 1000, v(0.1, -1, 0));
    simulation.add(sample_sphere<3>(v(0.25, 0.5, 0.25), 0.1, options), 1000, v(0, -1, 0.1));
    const Samples<3> layer = sample_box<3>(v(0.7, 0.6, 0.7), v(0.8, 0.65, 0.8), options);
    simulation.add_source(Source<3>::jet(layer, 0.05, 1000, v(0, -2, 0)));
    simulation.add_sink({.lower = v(0.7, 0, 0.7), .upper = v(0.9, 0.45, 0.9)});
    simulation.add_load(box, [](const V& x, double time) -> V { return V(x * (0.02 * std::cos(time))); });
    simulation.set_states(box, [](const V& x, auto& state) { state.F(0, 1) = float(0.1 * x[1]); });

    for (int i = 0; i < 4; ++i) simulation.step();
    simulation.step(v(0, -9, 0.5));  // a vector, a field, and a field of the velocity
    simulation.advance(1e-4, [](const auto& x) { return x * -2.0F; });
    simulation.step(Damped<float, 3>{.field = {.gravity = Make::f(0, -9, 1)}, .rate = 0.1F});
    simulation.remove_if([](const V& x, std::uint32_t) { return x[0] > 0.58; });
    simulation.step();

    Places all;
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) all.push_back(particles.exact_position(slot));
    all.push_back(simulation.totals().momentum);
    for (const Reaction<3>& part : simulation.reactions->parts) all.push_back(part.angular_impulse);
    return all;
}

template <class Make>
Places point_scene() {
    const auto v = Make::v;
    ParticleSystem<3> system;
    system.gravity = v(0, -9, 0);
    const Net<3> sheet = cloth(v(0, 1, 0), v(1, 0, 0), v(0, 0, 1), {6, 6});
    system.add(sheet, {.masses = facet_masses(sheet, 0.2)}, v(0.1, 0, 0));
    const Net<3> line = rope<3>(v(2, 1, 0), v(3, 1, 0), 5);
    system.add(line, {.masses = std::vector<double>(line.positions.size(), 0.1)});
    system.constraints.add(sheet);
    system.points.pin(0, v(0, 0.1, 0));
    system.points.add({.position = v(0.5, 2, 0.5), .velocity = v(0, -1, 0), .mass = 2, .radius = 0.1});
    system.add_force(aerodynamic_surface_of<float>(sheet, {.wind = Make::f(3, 0, 1)}));
    system.add_force(DragOnPoints<float, 3>{{.wind = Make::f(1, 0, 0)}});
    system.add_force(ForceOnEach{[](const auto& points, std::size_t i) ->
                                 typename Make::F { return typename Make::F(points.velocity[i] * -0.1F); }});
    system.add_emitter({.position = v(0, 3, 0), .direction = v(1, 1, 0), .rate = 1000});
    system.advance(0.02, 0.002);
    Places all;
    for (const auto& x : system.points.position) all.push_back(cast<double>(x));
    const TriangleMesh mesh{.vertices = {v(0, 0, 0), v(1, 0, 0), v(0, 1, 0), v(0, 0, 1)},
                            .triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
    for (const TriangleMesh& moved :
         {translated(mesh, v(1, 2, 3)), rotated(mesh, Make::turn(), v(0.5, 0, 0)), fitted(mesh, v(0.5, 0.5, 0.5), 0.2)})
        all.insert(all.end(), moved.vertices.begin(), moved.vertices.end());
    return all;
}

}  // namespace

TEST_CASE("A scene on the grid that is made with Eigen's vectors moves as one made with firn's", "[eigen]") {
    const Places expected = grid_scene<Firn>();
    CHECK(expected.size() > 100);
    CHECK(grid_scene<Eigens>() == expected);
}

TEST_CASE("Points, nets and meshes that are made with Eigen's vectors are as those made with firn's", "[eigen]") {
    const Places expected = point_scene<Firn>();
    CHECK(expected.size() > 50);
    CHECK(point_scene<Eigens>() == expected);
}

TEST_CASE("A field in Eigen's terms accelerates as the same field in firn's", "[eigen]") {
    const auto run = [](const auto& field) {
        Simulation<2> simulation({.cell_size = 1.0 / 16}, FixedCorotated<float>::from_young_poisson(1e4, 0.3), {1});
        simulation.add(sample_box<2>({0.3, 0.3}, {0.5, 0.5}, {.spacing = 1.0 / 32}), 1000);
        for (int i = 0; i < 5; ++i) simulation.step(field);
        return simulation.totals().momentum;
    };
    const auto expected = run([]<class S>(const Vec<S, 2>& x) { return Vec<S, 2>{-x[1], x[0]}; });
    CHECK(run([]<class S>(const Eigen::Matrix<S, 2, 1>& x) -> Eigen::Matrix<S, 2, 1> {
              return Eigen::Matrix<S, 2, 1>(-x[1], x[0]);
          }) == expected);
    CHECK(norm(expected) > 0);
}
